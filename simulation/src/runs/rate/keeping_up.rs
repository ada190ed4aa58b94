//! Whether a rotor keeps up with its reference, by what a report of the loop carries: simulated, or on a board.
//!
//! ```text
//! behind = reference - estimated angle, in the direction asked for
//! told:    for a second and longer of one rate the rotor has been behind by more than the loop allows one to be ahead,
//!          and beyond what it was behind in the first quarter of a second, behind grew by more than 1 % of the turn
//!          asked for
//! reaches: the mean rate of all the time that it was behind since it last kept up with this rate
//! ```
//!
//! A weak motor is driven harder the farther it is behind: it may stay some degrees behind and turn as fast as it
//! should. One that falls farther behind is driven as hard as it is of use; the search of the best amplitude is part of
//! that time.
//!
//! A rotor that comes near its reference keeps up. Where the reference was lost it begins anew at the rotor: then what
//! was told holds until the rotor has been near for a second, and the time before the loss still counts.

use controller::rate::RateTuning;
use motor_model::{Angle, Time};

use super::SETTLE_S;
use crate::scene::Scene;
use crate::world::instruments::assumed;

/// Time in s from which on a rotor that is behind, or near its reference, is judged.
const JUDGED_S: f64 = 1.0;
/// Part of the turn asked for by which a rotor falls behind that does not keep up: above the ripple of the angle, and
/// below what anybody would call held. An assumption.
const FALLS_BEHIND: f64 = 0.01;

/// The time since when the rotor is behind, where it was then, and the most it was behind in the first [`SETTLE_S`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    at: Time,
    wanted_rad_s: f32,
    angle: Angle,
    behind_deg: f64,
}

/// How far a rotor has turned in how much time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Turned {
    angle_deg: f64,
    time_s: f64,
}

/// What has been seen of a rotor that follows a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepingUp {
    /// How far behind a rotor may be, in degrees.
    allowed_deg: f64,
    stretch: Option<Stretch>,
    /// The rate that was asked for last. In its stretches that are over, since the rotor last kept up, and in the one
    /// under way: how far it turned, clockwise positive.
    wanted_rad_s: f32,
    before: Turned,
    within: Turned,
    /// Whether the reference has been lost since the rotor was near it for a second, and since when it is near.
    lost: bool,
    near_since: Option<Time>,
    /// What the motor reaches, in deg/s, clockwise positive, if it does not keep up.
    told_deg_s: Option<f64>,
}

impl KeepingUp {
    /// Nothing yet of a rotor of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let allowed_deg = f64::from(RateTuning::new(&assumed(scene)).ahead_rad).to_degrees();
        Self {
            allowed_deg,
            stretch: None,
            wanted_rad_s: 0.0,
            before: Turned::default(),
            within: Turned::default(),
            lost: false,
            near_since: None,
            told_deg_s: None,
        }
    }

    /// Takes a report at `at` of a rotor at `angle` that should turn at `wanted_rad_s` and be at `reference`, where
    /// there is one.
    pub fn take(&mut self, at: Time, wanted_rad_s: f32, reference: Option<Angle>, angle: Angle) {
        let Some(reference) = reference.filter(|_| wanted_rad_s.abs() > 0.0) else {
            self.end_stretch();
            (self.near_since, self.lost) = (None, true);
            return;
        };
        if self.wanted_rad_s.to_bits() != wanted_rad_s.to_bits() {
            (self.wanted_rad_s, self.before, self.within) =
                (wanted_rad_s, Turned::default(), Turned::default());
        }
        let along = f64::from(wanted_rad_s.signum());
        let behind_deg = along * reference.minus(angle).degrees();
        if behind_deg <= self.allowed_deg {
            self.note_near(at);
            return;
        }
        self.near_since = None;
        let begun = Stretch { at, wanted_rad_s, angle, behind_deg };
        let stretch = self.stretch.get_or_insert(begun);
        if stretch.wanted_rad_s.to_bits() != wanted_rad_s.to_bits() {
            (self.stretch, self.told_deg_s) = (Some(begun), None);
            return;
        }
        let time_s: f64 = at.seconds_since(stretch.at);
        if time_s <= SETTLE_S {
            stretch.behind_deg = stretch.behind_deg.max(behind_deg);
        }
        let stretch = *stretch;
        self.within = Turned { angle_deg: angle.minus(stretch.angle).degrees(), time_s };
        if time_s >= JUDGED_S {
            let asked_deg = f64::from(wanted_rad_s.abs()).to_degrees() * time_s;
            let falls_behind = behind_deg - stretch.behind_deg > FALLS_BEHIND * asked_deg;
            let (before, within) = (self.before, self.within);
            let mean_deg_s = (before.angle_deg + within.angle_deg) / (before.time_s + within.time_s);
            self.told_deg_s = falls_behind.then_some(mean_deg_s);
        }
    }

    /// The rotor is near its reference.
    fn note_near(&mut self, at: Time) {
        self.end_stretch();
        let near_s: f64 = at.seconds_since(*self.near_since.get_or_insert(at));
        if !self.lost || near_s >= JUDGED_S {
            (self.lost, self.told_deg_s, self.before) = (false, None, Turned::default());
        }
    }

    /// The rotor is not behind any more, or has nothing to be behind of.
    fn end_stretch(&mut self) {
        self.stretch = None;
        let within = std::mem::take(&mut self.within);
        self.before.angle_deg += within.angle_deg;
        self.before.time_s += within.time_s;
    }

    /// What the motor reaches, in deg/s, clockwise positive; `None` while it keeps up.
    pub fn reached_deg_s(&self) -> Option<f64> {
        self.told_deg_s
    }
}

/// What is said of a rotor that does not keep up.
pub const CANNOT_KEEP_UP: &str = "the motor cannot keep up";

/// What is said of one whose motor could, where the map has no drive for it.
pub(super) const NO_DRIVE: &str = "its map has no stronger drive that surely turns this motor";

/// That it does not keep up, with what it reaches.
pub fn cannot_keep_up(reached_deg_s: f64) -> String {
    behind(CANNOT_KEEP_UP, reached_deg_s)
}

/// The same with `why`.
pub(super) fn behind(why: &str, reached_deg_s: f64) -> String {
    format!("{why}: it turned {reached_deg_s:+.1} deg/s in all the time it was behind")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After `ms` milliseconds of a rotor that begins `from_deg` behind and turns at `turns_deg_s`, of a reference of
    /// `wanted` in deg/s.
    fn seen(wanted: f32, turns_deg_s: f64, from_deg: f64, ms: u32) -> Option<f64> {
        let mut keeping_up = KeepingUp::new(&Scene::default());
        let (wanted_deg_s, wanted_rad_s) = (f64::from(wanted), wanted.to_radians());
        for ms in 0..=ms {
            let time_s = 1e-3 * f64::from(ms);
            let angle = Angle::from_degrees(turns_deg_s * time_s - from_deg * wanted_deg_s.signum());
            let reference = Angle::from_degrees(wanted_deg_s * time_s);
            keeping_up.take(
                Time::from_nanos(u64::from(ms) * 1_000_000),
                wanted_rad_s,
                Some(reference),
                angle,
            );
        }
        keeping_up.reached_deg_s()
    }

    /// 2 % too slow is told, with the rate, either way; half a per cent is not, nor is one that catches up, or is
    /// nearer than 3 degrees, or is seen for less than a second.
    #[test]
    fn exact_a_rotor_that_falls_behind_is_told_with_its_rate() {
        for sign in [1.0, -1.0] {
            let fastest = seen(sign * 250.0, f64::from(sign) * 245.0, 5.0, 3500).unwrap();
            assert!((fastest - f64::from(sign) * 245.0).abs() < 1e-3, "{fastest}");
            for (turns, from, ms) in
                [(248.8, 5.0, 9500), (260.0, 90.0, 3500), (249.0, 0.0, 2500), (200.0, 5.0, 900)]
            {
                assert_eq!(seen(sign * 250.0, f64::from(sign) * turns, from, ms), None, "{turns}");
            }
        }
    }

    /// A rotor that falls behind by 8 degrees in two tenths of a second, and then turns as fast as it should, keeps up;
    /// one that turns by 2 % too slowly from then on does not.
    #[test]
    fn exact_a_rotor_that_stays_as_far_behind_keeps_up() {
        for (later_deg_s, told) in [(100.0, false), (98.0, true)] {
            let mut keeping_up = KeepingUp::new(&Scene::default());
            let mut angle_deg = 0.0;
            for ms in 0..=3000_u32 {
                keeping_up.take(
                    Time::from_nanos(u64::from(ms) * 1_000_000),
                    100.0_f32.to_radians(),
                    Some(Angle::from_degrees(0.1 * f64::from(ms))),
                    Angle::from_degrees(angle_deg),
                );
                angle_deg += 1e-3 * if ms < 200 { 60.0 } else { later_deg_s };
                assert!(told || keeping_up.reached_deg_s().is_none(), "{ms}");
            }
            assert_eq!(keeping_up.reached_deg_s().is_some(), told, "{later_deg_s}");
        }
    }

    /// What was told stays told where the reference is lost, until the rotor is near it for a second; and until it is
    /// near, where the reference is not lost.
    #[test]
    fn exact_a_rotor_that_is_near_again_keeps_up() {
        for (lost, told_until_ms) in [(true, 2501), (false, 1500)] {
            let mut keeping_up = KeepingUp::new(&Scene::default());
            for ms in 0..4000_u32 {
                let at = Time::from_nanos(u64::from(ms) * 1_000_000);
                let reference =
                    (!lost || ms != 1500).then(|| Angle::from_degrees(5.0 + 0.1 * f64::from(ms.min(1500))));
                let angle = Angle::from_degrees(if ms < 1500 { 0.0 } else { 155.0 });
                keeping_up.take(at, 1.745, reference, angle);
                let told = (1000..told_until_ms).contains(&ms).then_some(0.0);
                assert_eq!(keeping_up.reached_deg_s(), told, "{ms} {lost}");
            }
        }
    }

    /// A rotor that falls behind for seconds is told in a second in which it gains, with the mean of its rates.
    #[test]
    fn exact_a_rotor_that_is_behind_on_the_whole_is_told() {
        let mut keeping_up = KeepingUp::new(&Scene::default());
        let (mut angle_deg, mut reference_deg) = (0.0, 4.0);
        for ms in 0..=3000_u32 {
            keeping_up.take(
                Time::from_nanos(u64::from(ms) * 1_000_000),
                250.0_f32.to_radians(),
                Some(Angle::from_degrees(reference_deg)),
                Angle::from_degrees(angle_deg),
            );
            reference_deg += 0.25;
            angle_deg += if ms < 2000 { 0.2 } else { 0.26 };
        }
        let fastest = keeping_up.reached_deg_s().unwrap();
        assert!((fastest - 220.0).abs() < 0.1, "{fastest}");
    }

    /// Behind before and after a loss of the reference, by which nothing is kept up with: what is told is the mean of
    /// both times. A rotor that was near for a second has kept up, and so has one with another rate: what was before is
    /// not part of it.
    #[test]
    fn exact_all_the_time_behind_counts() {
        /// Of a rotor that turns at 200 deg/s for 2 s, 5 degrees behind at first, then at 240 until 5 s. The reference
        /// of `wanted` before, and 250 deg/s afterwards, begins anew at 2 s, and waits for `near_ms` there.
        fn seen(wanted: f32, near_ms: u32) -> f64 {
            let mut keeping_up = KeepingUp::new(&Scene::default());
            for ms in 0..=5000 + near_ms {
                let time_s = 1e-3 * f64::from(ms);
                let later_s = time_s - 2.0;
                let (wanted, reference, angle) = if later_s < 0.0 {
                    (wanted, f64::from(wanted) * time_s, 200.0 * time_s - 5.0)
                } else {
                    let turned_s = (later_s - 1e-3 * f64::from(near_ms)).max(0.0);
                    (250.0, 395.0 + 250.0 * turned_s, 395.0 + 240.0 * turned_s)
                };
                let reference = (ms != 2000).then(|| Angle::from_degrees(reference));
                let at = Time::from_nanos(u64::from(ms) * 1_000_000);
                keeping_up.take(at, wanted.to_radians(), reference, Angle::from_degrees(angle));
            }
            keeping_up.reached_deg_s().unwrap()
        }
        // It falls behind by 10 deg/s, and is behind from 3 degrees on.
        let both = (200.0 * 2.0 + 240.0 * 2.7) / (2.0 + 2.7);
        for (wanted, near_ms, expected) in [(250.0, 0, both), (250.0, 1100, 240.0), (300.0, 0, 240.0)] {
            let told = seen(wanted, near_ms);
            assert!((told - expected).abs() < 0.1, "{wanted} {near_ms}: {told} {expected}");
        }
    }

    /// Where the reference is lost each second nothing is told.
    #[test]
    fn exact_a_lost_reference_says_nothing() {
        let mut keeping_up = KeepingUp::new(&Scene::default());
        for ms in 0..3000_u32 {
            let at = Time::from_nanos(u64::from(ms) * 1_000_000);
            let reference = (ms % 900 != 0).then(|| Angle::from_degrees(10.0 + 0.1 * f64::from(ms)));
            keeping_up.take(at, 1.745, reference, Angle::ZERO);
            assert_eq!(keeping_up.reached_deg_s(), None, "{ms}");
        }
    }
}
