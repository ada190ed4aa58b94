//! One plant on the desk, all filters beside it, on the same frames and samples.

use std::collections::VecDeque;

use estimator::{AngleFilter as _, Health, Innovation, LdvSample};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::account::Account;
use super::genie::{Genie, Kick};
use super::timeline::{self, Phase};
use crate::runs::filter::{AnyFilter, FILTERS, SMOOTHER_LAG_MS};
use crate::scene::Scene;
use crate::studies::StudyError;
use crate::world::instruments::Camera;
use crate::world::rig::Desk;

/// Genies: name, and the share to which they know each kick.
pub const GENIES: [(&str, f64); 3] = [("genie", 0.0), ("genie_10_percent", 0.1), ("genie_3_percent", 0.03)];

/// What filters know after the fact, [`SMOOTHER_LAG_MS`] later: name, and the filter's place in [`FILTERS`].
pub const SMOOTHED: [(&str, usize); 2] = [("constant_rate_smoothed", 0), ("impact_aided_smoothed", 1)];

/// Ticks from one look at the estimates to the next: 70 us, so that all ages of the last frame have their turn.
const TICKS_PER_LOOK: u64 = 7;

/// One account a phase.
pub type Accounts = [Account; Phase::ALL.len()];

/// Names of what is compared, in the order of the accounts.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILTERS.iter().copied().chain(SMOOTHED.iter().map(|of| of.0)).chain(GENIES.iter().map(|genie| genie.0))
}

/// Runs the plant of `scene` under `mode`; tells `progress` of every simulated millisecond.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, mode: DriveMode, progress: &impl Fn(u64)) -> Result<Vec<Accounts>, StudyError> {
    let mut contest = Contest::new(scene)?;
    let mut ticks = 0;
    while contest.now().nanos() < timeline::duration_nanos() {
        let (command, phase) = timeline::at(contest.now(), mode);
        contest.enter(command, phase);
        contest.tick(phase);
        ticks += 1;
        if ticks % TICKS_PER_LOOK == 0 {
            contest.look(phase);
        }
        if ticks % TICKS_PER_MS == 0 {
            progress(1);
        }
    }
    Ok(contest.accounts)
}

const TICKS_PER_MS: u64 = 100;

#[expect(clippy::cast_possible_truncation, reason = "200")]
const LAG_TICKS: usize = (SMOOTHER_LAG_MS * TICKS_PER_MS) as usize;

struct Contest {
    desk: Desk,
    command: DriveCommand,
    phase: Option<Phase>,
    chronicle: Chronicle,
    filters: Vec<AnyFilter>,
    genies: Vec<Genie>,
    /// Of the filters, then of what they know after the fact, then of the genies.
    accounts: Vec<Accounts>,
    /// The truth of the last ticks, the newest last, as many as the smoother's lag.
    truths: VecDeque<Instant>,
}

impl Contest {
    fn new(scene: &Scene) -> Result<Self, StudyError> {
        let camera_rad2 = Camera::variance_rad2(scene);
        let genie = |&(_, share): &(_, f64)| Genie::new(share, camera_rad2, scene.seed());
        Ok(Self {
            desk: Desk::new(scene)?,
            command: DriveCommand::OFF,
            phase: None,
            chronicle: Chronicle::default(),
            filters: FILTERS.iter().map(|name| AnyFilter::named(name)).collect::<Result<_, _>>()?,
            genies: GENIES.iter().map(genie).collect(),
            accounts: names().map(|_| Accounts::default()).collect(),
            truths: VecDeque::new(),
        })
    }

    fn now(&self) -> Time {
        self.desk.plant().now()
    }

    /// Tells the filters of drive and time, and of the phase whoever keeps account of it.
    fn enter(&mut self, command: DriveCommand, phase: Option<Phase>) {
        self.command = command;
        let now = self.now();
        self.filters.iter_mut().for_each(|filter| filter.drive(now, command));
        if phase != self.phase {
            self.phase = phase;
            self.accounts.iter_mut().flatten().for_each(Account::interrupt);
        }
    }

    /// The plant moves on by a tick; then everybody takes in what has arrived.
    fn tick(&mut self, phase: Option<Phase>) {
        for _ in 0..self.desk.steps_per_tick() {
            let before = Instant::of(&self.desk);
            let impacts = self.desk.step(self.command);
            let after = Instant::of(&self.desk);
            let touched = !impacts.is_empty() || before.pressed || after.pressed;
            self.chronicle.step(&before, &after, touched, |kick| {
                self.genies.iter_mut().for_each(|genie| genie.tell(&kick));
            });
        }
        self.chronicle.close(&Instant::of(&self.desk), |kick| {
            self.genies.iter_mut().for_each(|genie| genie.tell(&kick));
        });
        if self.truths.len() > LAG_TICKS {
            self.truths.pop_front();
        }
        self.truths.push_back(Instant::of(&self.desk));
        while let Some(sample) = self.desk.ldv_sample() {
            self.take_ldv(&sample, phase);
        }
        while let Some(frame) = self.desk.camera_frame() {
            let (filters, genies) = self.accounts.split_at_mut(self.filters.len() + SMOOTHED.len());
            for (filter, accounts) in self.filters.iter_mut().zip(filters) {
                note(accounts, phase, &filter.update_camera(&frame));
            }
            for (genie, accounts) in self.genies.iter_mut().zip(genies) {
                note(accounts, phase, &genie.update_camera(&frame));
            }
        }
    }

    fn take_ldv(&mut self, sample: &LdvSample, phase: Option<Phase>) {
        for (filter, accounts) in self.filters.iter_mut().zip(&mut self.accounts) {
            if let Some(innovation) = filter.update_ldv(sample) {
                note(accounts, phase, &innovation);
            }
        }
    }

    /// Compares every estimate with the truth.
    fn look(&mut self, phase: Option<Phase>) {
        let Some(phase) = phase else { return };
        let Instant { at, angle, rate_rad_s, .. } = Instant::of(&self.desk);
        let (filters, others) = self.accounts.split_at_mut(self.filters.len());
        let (smoothed, genies) = others.split_at_mut(SMOOTHED.len());
        if let Some(then) = self.truths.front().filter(|_| self.truths.len() > LAG_TICKS) {
            for ((_, place), accounts) in SMOOTHED.iter().zip(smoothed) {
                let filter = &self.filters[*place];
                let (estimate, health) = (filter.smoothed(then.at), filter.health(at));
                accounts[phase as usize].estimate(estimate.as_ref(), health, then.angle, then.rate_rad_s);
            }
        }
        for (filter, accounts) in self.filters.iter().zip(filters) {
            accounts[phase as usize].estimate(
                filter.estimate(at).as_ref(),
                filter.health(at),
                angle,
                rate_rad_s,
            );
        }
        for (genie, accounts) in self.genies.iter().zip(genies) {
            accounts[phase as usize].estimate(genie.estimate().as_ref(), Health::Good, angle, rate_rad_s);
        }
    }
}

fn note<T: motor_model::Real>(accounts: &mut Accounts, phase: Option<Phase>, innovation: &Innovation<T>) {
    if let Some(phase) = phase {
        accounts[phase as usize].innovation(innovation);
    }
}

/// What a genie may know of an instant.
#[derive(Clone, Copy, Debug)]
struct Instant {
    at: Time,
    angle: Angle,
    rate_rad_s: f64,
    pressed: bool,
}

impl Instant {
    fn of(desk: &Desk) -> Self {
        let (at, state) = (desk.plant().now(), desk.plant().state());
        let pressed = state.in_contact != [false; 2];
        Self { at, angle: state.rotor.angle.angle(), rate_rad_s: state.rotor.rate_rad_s, pressed }
    }

    fn kick_since(&self, before: &Self, contact: bool) -> Kick {
        let span_s: f64 = self.at.seconds_since(before.at);
        Kick {
            until: self.at,
            span_s,
            angle_rad: self.angle.minus(before.angle).radians_since::<f64>(Angle::ZERO)
                - before.rate_rad_s * span_s,
            rate_rad_s: self.rate_rad_s - before.rate_rad_s,
            contact,
        }
    }
}

/// The motion as kicks: one for every step in which teeth changed the rate, one for all steps between two of those.
#[derive(Clone, Debug, Default)]
struct Chronicle {
    /// Where the steps without a change by teeth began.
    free_since: Option<Instant>,
}

impl Chronicle {
    fn step(&mut self, before: &Instant, after: &Instant, touched: bool, mut tell: impl FnMut(Kick)) {
        let changed = before.rate_rad_s.to_bits() != after.rate_rad_s.to_bits();
        if touched && changed {
            self.close(before, &mut tell);
            tell(after.kick_since(before, true));
        } else if self.free_since.is_none() {
            self.free_since = Some(*before);
        }
    }

    /// Tells of the steps without a change by teeth that end at `now`.
    fn close(&mut self, now: &Instant, mut tell: impl FnMut(Kick)) {
        if let Some(since) = self.free_since.take() {
            tell(now.kick_since(&since, false));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kicks add up to the motion, and only those of contact are marked so.
    #[test]
    fn law_the_chronicle_tells_the_whole_motion() {
        // The last change but one is air drag.
        let rates = [1.0, 1.0, 3.0, 2.5, 2.4, 2.0];
        let touched = [false, true, true, false, true];
        let mut angle_units = 0;
        let instants: Vec<Instant> = (0_u32..)
            .zip(rates)
            .map(|(n, rate_rad_s)| {
                angle_units += i64::from(n) * 1000;
                let at = Time::from_micros(u64::from(n));
                Instant { at, angle: Angle::from_units(angle_units), rate_rad_s, pressed: false }
            })
            .collect();
        let (mut chronicle, mut kicks) = (Chronicle::default(), Vec::new());
        for (pair, touched) in instants.windows(2).zip(touched) {
            chronicle.step(&pair[0], &pair[1], touched, |kick| kicks.push(kick));
        }
        chronicle.close(&instants[5], |kick| kicks.push(kick));
        let contacts: Vec<bool> = kicks.iter().map(|kick| kick.contact).collect();
        assert_eq!(contacts, [false, true, true, false, true]);
        let (mut angle_rad, mut rate) = (0.0, 1.0);
        for kick in &kicks {
            angle_rad += rate * kick.span_s + kick.angle_rad;
            rate += kick.rate_rad_s;
        }
        assert!((rate - 2.0).abs() < 1e-12);
        let expected: f64 = instants[5].angle.minus(instants[0].angle).radians_since(Angle::ZERO);
        assert!((angle_rad - expected).abs() < 1e-12);
    }
}
