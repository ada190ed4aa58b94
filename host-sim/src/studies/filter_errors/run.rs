//! One plant on the rig, all filters beside it, on the same frames and samples.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use controller::{Drive as _, Sense as _};
use estimator::{AngleFilter as _, CameraFrame, Health, Innovation, LdvSample};
use motor_model::{Angle, DriveCommand, DriveMode, Impacts, MotorState, Time};

use super::account::Account;
use super::genie::{Genie, Kick};
use super::timeline::{self, Phase};
use crate::runs::filter::{AnyFilter, FILTERS, SMOOTHER_LAG_MS};
use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::studies::StudyError;
use crate::world::instruments::Camera;
use crate::world::plant::Plant;

/// Genies: name, and the share to which they know each kick.
pub const GENIES: [(&str, f64); 3] = [("genie", 0.0), ("genie_10_percent", 0.1), ("genie_3_percent", 0.03)];

/// What filters know after the fact, [`SMOOTHER_LAG_MS`] later: name, and the filter's place in [`FILTERS`].
pub const SMOOTHED: [(&str, usize); 2] = [("constant_rate_smoothed", 0), ("impact_aided_smoothed", 1)];

/// Ticks from one comparison of the estimates to the next: 70 us, so that all ages of the last frame have their turn.
const TICKS_PER_COMPARISON: u64 = 7;

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
    let mut driver = TickDriver::new(scene, Comparison::new(scene, mode)?)?;
    let command = driver.program_mut().enter(Time::ZERO);
    driver.overrule(command);
    let mut ticks = 0;
    driver.run(|_, moment| {
        ticks += 1;
        if ticks % TICKS_PER_MS == 0 {
            progress(1);
        }
        let over = moment.at.nanos() >= timeline::duration_nanos();
        if over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    Ok(driver.into_program().accounts)
}

const TICKS_PER_MS: u64 = 100;

#[expect(clippy::cast_possible_truncation, reason = "200")]
const LAG_TICKS: usize = (SMOOTHER_LAG_MS * TICKS_PER_MS) as usize;

/// All filters and genies on the same frames and samples, and an account of each.
struct Comparison {
    mode: DriveMode,
    phase: Option<Phase>,
    free_motion: FreeMotion,
    filters: Vec<AnyFilter>,
    genies: Vec<Genie>,
    /// Of the filters, then of their smoothers, then of the genies.
    accounts: Vec<Accounts>,
    /// The truth of the last ticks, the newest last, as many as the smoother's lag.
    truths: VecDeque<Instant>,
    ticks: u64,
}

impl Comparison {
    fn new(scene: &Scene, mode: DriveMode) -> Result<Self, StudyError> {
        let camera_rad2 = Camera::variance_rad2(scene);
        let genie = |&(_, share): &(_, f64)| Genie::new(share, camera_rad2, scene.seed());
        Ok(Self {
            mode,
            phase: None,
            free_motion: FreeMotion::default(),
            filters: FILTERS.iter().map(|name| AnyFilter::named(name)).collect::<Result<_, _>>()?,
            genies: GENIES.iter().map(genie).collect(),
            accounts: names().map(|_| Accounts::default()).collect(),
            truths: VecDeque::new(),
            ticks: 0,
        })
    }

    /// Begins the tick at `now`: tells the filters of its drive, and interrupts the accounts where a phase begins.
    fn enter(&mut self, now: Time) -> DriveCommand {
        let (command, phase) = timeline::at(now, self.mode);
        self.filters.iter_mut().for_each(|filter| filter.drive(now, command));
        if phase != self.phase {
            self.phase = phase;
            self.accounts.iter_mut().flatten().for_each(Account::interrupt);
        }
        command
    }

    fn take_ldv(&mut self, sample: &LdvSample) {
        for (filter, accounts) in self.filters.iter_mut().zip(&mut self.accounts) {
            if let Some(innovation) = filter.update_ldv(sample) {
                note(accounts, self.phase, &innovation);
            }
        }
    }

    fn take_frame(&mut self, frame: &CameraFrame) {
        let (filters, genies) = self.accounts.split_at_mut(self.filters.len() + SMOOTHED.len());
        for (filter, accounts) in self.filters.iter_mut().zip(filters) {
            note(accounts, self.phase, &filter.update_camera(frame));
        }
        for (genie, accounts) in self.genies.iter_mut().zip(genies) {
            note(accounts, self.phase, &genie.update_camera(frame));
        }
    }

    /// Remembers the truth of a tick's end for the smoothers.
    fn remember(&mut self, now: Instant) {
        if self.truths.len() > LAG_TICKS {
            self.truths.pop_front();
        }
        self.truths.push_back(now);
    }

    /// Compares every estimate with the truth.
    fn judge(&mut self, phase: Phase, now: &Instant) {
        let Instant { at, angle, rate_rad_s, .. } = *now;
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
            let (estimate, health) = (filter.estimate(at), filter.health(at));
            accounts[phase as usize].estimate(estimate.as_ref(), health, angle, rate_rad_s);
        }
        for (genie, accounts) in self.genies.iter().zip(genies) {
            accounts[phase as usize].estimate(genie.estimate().as_ref(), Health::Good, angle, rate_rad_s);
        }
    }
}

impl TickProgram for Comparison {
    type Report = ();

    /// The genies are told of every impact.
    const OBSERVES_STEPS: bool = true;

    fn step(&mut self, before: &MotorState<f64>, at: Time, impacts: &Impacts<f64>, plant: &Plant) {
        let before = Instant::of(at, before);
        let after = Instant::of(plant.now(), plant.state());
        let touched = !impacts.is_empty() || before.in_contact || after.in_contact;
        let genies = &mut self.genies;
        self.free_motion
            .step(&before, &after, touched, |kick| genies.iter_mut().for_each(|genie| genie.tell(&kick)));
    }

    fn tick(&mut self, now: Time, ports: &mut RigPorts) {
        let truth = Instant::of(now, ports.plant().state());
        let genies = &mut self.genies;
        self.free_motion.close(&truth, |kick| genies.iter_mut().for_each(|genie| genie.tell(&kick)));
        self.remember(truth);
        while let Some(sample) = ports.ldv_sample() {
            self.take_ldv(&sample);
        }
        while let Some(frame) = ports.camera_frame() {
            self.take_frame(&frame);
        }
        self.ticks += 1;
        if let Some(phase) = self.phase.filter(|_| self.ticks.is_multiple_of(TICKS_PER_COMPARISON)) {
            self.judge(phase, &truth);
        }
        ports.drive(self.enter(now));
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
    in_contact: bool,
}

impl Instant {
    fn of(at: Time, state: &MotorState<f64>) -> Self {
        let in_contact = state.in_contact != [false; 2];
        Self { at, angle: state.rotor.angle.angle(), rate_rad_s: state.rotor.rate_rad_s, in_contact }
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
struct FreeMotion {
    /// Where the steps without a change by teeth began.
    free_since: Option<Instant>,
}

impl FreeMotion {
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
    fn law_the_kicks_are_the_whole_motion() {
        // The last change but one is air drag.
        let rates = [1.0, 1.0, 3.0, 2.5, 2.4, 2.0];
        let touched = [false, true, true, false, true];
        let mut angle_units = 0;
        let instants: Vec<Instant> = (0_u32..)
            .zip(rates)
            .map(|(n, rate_rad_s)| {
                angle_units += i64::from(n) * 1000;
                let at = Time::from_micros(u64::from(n));
                Instant { at, angle: Angle::from_units(angle_units), rate_rad_s, in_contact: false }
            })
            .collect();
        let (mut free_motion, mut kicks) = (FreeMotion::default(), Vec::new());
        for (pair, touched) in instants.windows(2).zip(touched) {
            free_motion.step(&pair[0], &pair[1], touched, |kick| kicks.push(kick));
        }
        free_motion.close(&instants[5], |kick| kicks.push(kick));
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
