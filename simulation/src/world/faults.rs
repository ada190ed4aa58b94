//! Faults of the motor during a run: an amplifier that is weak, dead in one mode or both, or wired the wrong way round,
//! resonances that drift away from the drive, jolts of the rotor, a rotor that sticks, a hub that rubs. Several at once
//! add up; of two hubs that rub the rougher one counts.
//!
//! Faults of the instruments are theirs ([`super::instruments`]). A resonance that has drifted before the start is a
//! parameter of the true motor (`plant.motor.mode_b.frequency_hz`).

use motor_model::{DriveCommand, DriveMode, Time};

use crate::scene::Scene;
use crate::scene::faults::{DriveFault, Fault, FaultKind};

/// The faults of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorFaults {
    drive: Vec<(DriveFault, Fault)>,
    /// Jolts that have not happened yet, in rad/s, the next one last.
    jolts: Vec<(Time, f64)>,
    drifts: Vec<Drift>,
    /// When the resonances change next; `None` after the last change.
    drift_due: Option<Time>,
    /// When the rotor sticks.
    stuck: Vec<Fault>,
    /// Friction of a hub that rubs.
    rubs: Vec<(f64, Fault)>,
    /// When the hub's friction changes, the next time last.
    rub_changes: Vec<Time>,
}

/// A drift of the resonances.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drift {
    /// Relative change in the end.
    to: f64,
    from: Time,
    /// 0 for a step.
    over_nanos: u64,
}

/// Time from one change of a drifting resonance to the next, in ns: a drift of a percent in a tenth of a second comes
/// in hundredths of the width of a resonance.
const DRIFT_NANOS: u64 = 1_000_000;

impl Drift {
    fn of(percent: f64, fault: &Fault) -> Self {
        let over_nanos = if fault.until == Fault::NEVER { 0 } else { fault.until.nanos_since(fault.from) };
        Self { to: 0.01 * percent, from: fault.from, over_nanos }
    }

    /// The relative change at `now`.
    fn at(&self, now: Time) -> f64 {
        if now < self.from {
            return 0.0;
        }
        let since_nanos = now.nanos_since(self.from);
        #[expect(clippy::cast_precision_loss, reason = "below 2^53 ns")]
        let part =
            if since_nanos < self.over_nanos { since_nanos as f64 / self.over_nanos as f64 } else { 1.0 };
        self.to * part
    }

    /// When the change at `now` is due to change; `None` if it stays.
    fn due(&self, now: Time) -> Option<Time> {
        if now < self.from {
            return Some(self.from);
        }
        (now.nanos_since(self.from) < self.over_nanos).then(|| now.plus_nanos(DRIFT_NANOS))
    }
}

impl MotorFaults {
    /// Those of a scene.
    pub fn of(scene: &Scene) -> Self {
        let faults = scene.faults();
        let drive = faults.iter().filter_map(|fault| match fault.kind {
            FaultKind::Drive(kind) => Some((kind, *fault)),
            _ => None,
        });
        let jolts = faults.iter().filter_map(|fault| match fault.kind {
            FaultKind::Jolt(rad_s) => Some((fault.from, rad_s)),
            _ => None,
        });
        let drifts = faults.iter().filter_map(|fault| match fault.kind {
            FaultKind::Drift(percent) => Some(Drift::of(percent, fault)),
            _ => None,
        });
        let mut jolts: Vec<_> = jolts.collect();
        jolts.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
        let drifts: Vec<_> = drifts.collect();
        let drift_due = drifts.iter().map(|drift| drift.from).min();
        let stuck = faults.iter().filter(|fault| fault.kind == FaultKind::Stuck).copied().collect();
        let rubs: Vec<_> = faults
            .iter()
            .filter_map(|fault| match fault.kind {
                FaultKind::Rub(friction) => Some((friction, *fault)),
                _ => None,
            })
            .collect();
        let mut rub_changes: Vec<_> = rubs.iter().flat_map(|(_, fault)| [fault.from, fault.until]).collect();
        rub_changes.sort_by_key(|at| std::cmp::Reverse(*at));
        Self { drive: drive.collect(), jolts, drifts, drift_due, stuck, rubs, rub_changes }
    }

    /// Takes the faults of `fresh`, which are the same until `now`: what happens at one time happens once.
    pub fn change(&mut self, fresh: Self, now: Time) {
        let earlier = |at: &Time| *at < now;
        let jolts = self.jolts.iter().filter(|(at, _)| earlier(at));
        self.jolts = fresh.jolts.iter().filter(|(at, _)| !earlier(at)).chain(jolts).copied().collect();
        let changes = self.rub_changes.iter().filter(|at| earlier(at));
        self.rub_changes =
            fresh.rub_changes.iter().filter(|at| !earlier(at)).chain(changes).copied().collect();
        let begin = fresh.drifts.iter().map(|drift| drift.from).filter(|at| !earlier(at));
        self.drift_due = self.drift_due.into_iter().chain(begin).min();
        (self.drive, self.drifts) = (fresh.drive, fresh.drifts);
        (self.stuck, self.rubs) = (fresh.stuck, fresh.rubs);
    }

    /// Whether there is none.
    #[inline]
    pub fn are_none(&self) -> bool {
        self.drive.is_empty()
            && self.jolts.is_empty()
            && self.drift_due.is_none()
            && self.stuck.is_empty()
            && self.rub_changes.is_empty()
    }

    /// Lowest and highest relative change of the resonances that can come together.
    pub fn extreme_drifts(&self) -> [f64; 2] {
        let sum = |limit: fn(f64, f64) -> f64| self.drifts.iter().map(|drift| limit(drift.to, 0.0)).sum();
        [sum(f64::min), sum(f64::max)]
    }

    /// The relative change of the resonances at `now`, whenever it is due to change.
    pub fn drifted(&mut self, now: Time) -> Option<f64> {
        if now < self.drift_due? {
            return None;
        }
        self.drift_due = self.drifts.iter().filter_map(|drift| drift.due(now)).min();
        Some(self.drifts.iter().map(|drift| drift.at(now)).sum())
    }

    /// The roughest friction of a hub that rubs at any time; `None` if none does.
    pub fn roughest_hub(&self) -> Option<f64> {
        self.rubs.iter().map(|(friction, _)| *friction).max_by(f64::total_cmp)
    }

    /// Whether the friction of the hub is due to change at `now`; each change is told once.
    pub fn hub_changes(&mut self, now: Time) -> bool {
        let later = self.rub_changes.partition_point(|at| *at > now);
        let due = later < self.rub_changes.len();
        self.rub_changes.truncate(later);
        due
    }

    /// The friction of the hub at `now`; `None` for its own.
    pub fn hub_friction(&self, now: Time) -> Option<f64> {
        let rubbing = self.rubs.iter().filter(|(_, fault)| fault.covers(now));
        rubbing.map(|(friction, _)| *friction).max_by(f64::total_cmp)
    }

    /// Whether the rotor sticks at `now`.
    #[inline]
    pub fn holds(&self, now: Time) -> bool {
        self.stuck.iter().any(|fault| fault.covers(now))
    }

    /// What reaches the coil at `now` of `command`.
    pub fn drive(&self, now: Time, command: DriveCommand) -> DriveCommand {
        let Some(mode) = command.mode() else { return command };
        let (mut gain, mut swapped) = (1.0_f32, false);
        for (fault, _) in self.drive.iter().filter(|(_, fault)| fault.covers(now)) {
            match fault {
                DriveFault::Dead(dead) if dead.is_none_or(|dead| dead == mode) => return DriveCommand::OFF,
                DriveFault::Dead(_) => {}
                #[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
                DriveFault::Weak(part) => gain *= *part as f32,
                DriveFault::Swapped => swapped = true,
            }
        }
        let mode = match (swapped, mode) {
            (false, mode) => mode,
            (true, DriveMode::B) => DriveMode::C,
            (true, DriveMode::C) => DriveMode::B,
        };
        DriveCommand::saturating(mode, gain * command.amplitude())
            .with_saturating_offset(command.frequency_offset_hz())
    }

    /// The next jolt that is due by `now`, in rad/s; each comes once.
    pub fn jolt(&mut self, now: Time) -> Option<f64> {
        let (at, _) = self.jolts.last()?;
        if now < *at { None } else { self.jolts.pop().map(|(_, rad_s)| rad_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_faults_begin_when_they_should() {
        let mut scene = Scene::default();
        for (key, value) in
            [("from_s", "1"), ("drive_gain", "0.5"), ("modes", "swapped"), ("jolt_rad_s", "-2")]
        {
            scene.set(&format!("fault.{key}"), value).unwrap();
        }
        let mut faults = MotorFaults::of(&scene);
        let (before, after) = (Time::from_nanos(999_999_999), Time::from_nanos(1_000_000_000));
        let command = DriveCommand::saturating(DriveMode::B, 0.8).with_saturating_offset(-31.0);
        assert_eq!(faults.drive(before, command), command);
        let weak = DriveCommand::saturating(DriveMode::C, 0.4).with_saturating_offset(-31.0);
        assert_eq!(faults.drive(after, command), weak, "the frequency is as commanded");
        assert_eq!(faults.drive(after, DriveCommand::OFF), DriveCommand::OFF);
        assert_eq!([before, after, after].map(|now| faults.jolt(now)), [None, Some(-2.0), None]);
        assert!(MotorFaults::of(&Scene::default()).are_none() && !faults.are_none());
    }

    /// A percent in two seconds from the first second on: half of it at 2 s, all of it at 3 s, and then no more
    /// changes.
    #[test]
    fn exact_resonances_drift_in_proportion_to_time() {
        let mut scene = Scene::default();
        for (key, value) in [("from_s", "1"), ("drift_percent", "-1"), ("drift_s", "2")] {
            scene.set(&format!("fault.{key}"), value).unwrap();
        }
        let mut faults = MotorFaults::of(&scene);
        let mut at = |millis: u64| faults.drifted(Time::from_nanos(millis * 1_000_000));
        assert_eq!(at(999), None);
        for (millis, expected) in [(1000, 0.0), (2000, -0.005), (3000, -0.01)] {
            assert!((at(millis).unwrap() - expected).abs() < 1e-12, "{millis}");
        }
        assert_eq!(at(3001), None);
        scene.set("fault.drift_s", "0").unwrap();
        let mut step = MotorFaults::of(&scene);
        assert_eq!(
            [0, 2, 3].map(|s| step.drifted(Time::from_nanos(s * 1_000_000_000))),
            [None, Some(-0.01), None]
        );
    }

    /// Weak from 1 s to 2 s and once more from 1.5 s on, mode C dead from 3 s on, jolts at 0.5 s and 0.7 s in any
    /// order.
    #[test]
    fn exact_faults_by_words_end_and_add_up() {
        let words =
            "drive:weak:0.5@1..2,drive:weak:0.5@1.5.., drive:dead:c@3..,rotor:jolt:-2@0.7 rotor:jolt:1@0.5";
        let mut scene = Scene::default();
        scene.set("faults", words).unwrap();
        let mut faults = MotorFaults::of(&scene);
        let at = |millis: u64| Time::from_nanos(millis * 1_000_000);
        let full = DriveCommand::full(DriveMode::C);
        for (millis, gain) in [(999, 1.0), (1000, 0.5), (1500, 0.25), (2000, 0.5), (3000, 0.0)] {
            let applied = faults.drive(at(millis), full);
            assert!((applied.amplitude() - gain).abs() < 1e-6, "{millis}: {applied:?}");
        }
        assert_eq!(
            [499, 500, 600, 700, 701].map(|millis| faults.jolt(at(millis))),
            [None, Some(1.0), None, Some(-2.0), None]
        );
    }

    /// One percent down in the first second, two up at once at half a second: the sum, and its extremes.
    #[test]
    fn exact_drifts_by_words_add_up() {
        let mut scene = Scene::default();
        scene.set("faults", "stator:drift:-1@0..1 stator:drift:2@0.5..").unwrap();
        let mut faults = MotorFaults::of(&scene);
        let [low, high] = faults.extreme_drifts();
        assert!((low + 0.01).abs() < 1e-12 && (high - 0.02).abs() < 1e-12, "{low} {high}");
        let mut at = |millis: u64| faults.drifted(Time::from_nanos(millis * 1_000_000));
        for (millis, expected) in [(0, 0.0), (400, -0.004), (500, 0.015), (1000, 0.01)] {
            assert!((at(millis).unwrap() - expected).abs() < 1e-12, "{millis}");
        }
        assert_eq!(at(2000), None);
    }

    /// The rougher of two hubs that rub counts while both do, and the hub's own friction in between and after.
    #[test]
    fn exact_a_hub_rubs_while_it_should() {
        let mut scene = Scene::default();
        scene
            .set("faults", "hub:rub:0.6@1..3 hub:rub:0.9@2..4 hub:rub:0.5@5..6 rotor:stuck@2..2.05")
            .unwrap();
        let mut faults = MotorFaults::of(&scene);
        let at = |millis: u64| Time::from_nanos(millis * 1_000_000);
        for (millis, expected) in [
            (0, (false, None)),
            (1000, (true, Some(0.6))),
            (1500, (false, Some(0.6))),
            (2000, (true, Some(0.9))),
            (3000, (true, Some(0.9))),
            (4000, (true, None)),
            (5500, (true, Some(0.5))),
            (6000, (true, None)),
            (7000, (false, None)),
        ] {
            let changes = faults.hub_changes(at(millis));
            assert_eq!((changes, faults.hub_friction(at(millis))), expected, "{millis}");
        }
        assert_eq!(
            [1999, 2000, 2049, 2050].map(|millis| faults.holds(at(millis))),
            [false, true, true, false]
        );
        assert_eq!(faults.roughest_hub(), Some(0.9));
    }

    #[test]
    fn exact_a_dead_mode_drives_nothing_and_the_other_everything() {
        let mut scene = Scene::default();
        scene.set("fault.dead_mode", "c").unwrap();
        let faults = MotorFaults::of(&scene);
        for (mode, applied) in
            [(DriveMode::B, DriveCommand::full(DriveMode::B)), (DriveMode::C, DriveCommand::OFF)]
        {
            assert_eq!(faults.drive(Time::ZERO, DriveCommand::full(mode)), applied);
        }
    }
}
