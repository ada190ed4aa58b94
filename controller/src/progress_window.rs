//! Whether a cruise turns the rotor: told slow from stuck, and from turning the wrong way.
//!
//! A cruise is tested in windows of [`WINDOW_NANOS`], or of some frames where those come more slowly. With `d` the
//! turn in the direction of the mode since the window began, `m` that of the map, and `s^2` the sum of the variances of
//! the angles at both of its ends:
//!
//! ```text
//! at its end:     d > 5 s     the rotor turns, however slowly: the mean rate is d over the window
//!                 d < -5 s    it turns the wrong way
//!                 m < 40 s    not known well enough to tell: the window goes on
//!                 else        it is stuck: a rotor of a fourth of the map's rate shows 5 s, be its estimate 5 s short
//! before its end: d < -1 degree and d < -5 s    it turns the wrong way
//! ```
//!
//! So a rotor that sticks is noticed within two windows, whatever it did before, and one that turns back is noticed
//! after a degree or a window. Filters know the angle of a moving rotor to 5 to 20 milli-degrees, so that the slowest
//! rate that counts as turning is 0.2 to 1 degrees a second.

use estimator::Estimate;
use motor_model::{Angle, Time};

/// Length of a window in ns: half of the 0.3 s within which a stuck rotor is to be noticed.
pub const WINDOW_NANOS: u64 = 150_000_000;
/// Standard deviations beyond which a turn is significant. An assumption: a normal error exceeds them once in 1.7
/// million windows.
const SIGNIFICANT_SIGMAS: f32 = 5.0;
/// Part of the map's rate from which on a rotor is not taken for stuck, however wide its estimate is. An assumption:
/// with an angle known to some degrees that takes half a second at half of the full rate.
const TURNING_PART: f32 = 0.25;
/// Turn of the map in standard deviations from which on such a rotor turns significantly.
const KNOWN_SIGMAS: f32 = 2.0 * SIGNIFICANT_SIGMAS / TURNING_PART;
/// Turn in rad the wrong way that ends a window early: a degree, more than the start of a cruise can explain.
/// An assumption.
const WRONG_WAY_RAD: f32 = 0.017;

/// The window under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressWindow {
    since: Time,
    from: Angle,
    from_rad2: f32,
}

/// What a window has shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowOutcome {
    /// It is not over yet.
    Open,
    /// The rotor turns at this mean rate in the direction of the mode, in rad/s.
    Turns(f32),
    /// It does not turn.
    Stuck,
    /// It turns against the direction of the mode, at this mean rate in rad/s, above 0.
    WrongWay(f32),
}

impl ProgressWindow {
    /// A window that begins at `now`.
    pub fn from(now: Time, estimate: &Estimate<f32>) -> Self {
        Self { since: now, from: estimate.angle, from_rad2: estimate.angle_rad2 }
    }

    /// Whether the window, `window_nanos` long, is over by `now`.
    pub fn is_over(&self, window_nanos: u64, now: Time) -> bool {
        now.nanos_since(self.since) >= window_nanos
    }

    /// What the window, `window_nanos` long, has shown by `now` of a rotor that the map turns at `rate_rad_s`,
    /// clockwise positive.
    pub fn outcome(
        &self,
        rate_rad_s: f32,
        window_nanos: u64,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> WindowOutcome {
        let direction = if rate_rad_s < 0.0 { -1.0 } else { 1.0 };
        let expected_rad = || rate_rad_s * now.seconds_since::<f32>(self.since);
        let turned_rad = direction * estimate.angle.radians_since::<f32>(self.from);
        let variance_rad2 = self.from_rad2 + estimate.angle_rad2;
        let exceeds = |rad: f32, sigmas: f32| rad * rad > sigmas * sigmas * variance_rad2;
        let significant = exceeds(turned_rad, SIGNIFICANT_SIGMAS);
        let over = self.is_over(window_nanos, now);
        if significant && turned_rad < 0.0 && (over || turned_rad < -WRONG_WAY_RAD) {
            WindowOutcome::WrongWay(-turned_rad / now.seconds_since::<f32>(self.since))
        } else if !over {
            WindowOutcome::Open
        } else if significant {
            WindowOutcome::Turns(turned_rad / now.seconds_since::<f32>(self.since))
        } else if exceeds(expected_rad(), KNOWN_SIGMAS) {
            WindowOutcome::Stuck
        } else {
            WindowOutcome::Open
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rest_filter::tests::estimate;

    /// Angles of 3 and 4 milli-degrees: their difference has 5, and five times that are 25.
    #[test]
    fn exact_five_standard_deviations_tell_slow_from_stuck() {
        let progress = ProgressWindow::from(Time::ZERO, &estimate(0.0, 3.0));
        let after =
            |nanos, mdeg| progress.outcome(-1.0, WINDOW_NANOS, Time::from_nanos(nanos), &estimate(mdeg, 4.0));
        let WindowOutcome::Turns(rate_rad_s) = after(WINDOW_NANOS, -25.1) else { panic!("it turns") };
        assert!((rate_rad_s.to_degrees() - 0.0251 / 0.15).abs() < 1e-5, "{rate_rad_s}");
        assert_eq!(after(WINDOW_NANOS, -24.9), WindowOutcome::Stuck);
        assert_eq!(after(WINDOW_NANOS, 24.9), WindowOutcome::Stuck);
        let WindowOutcome::WrongWay(back_rad_s) = after(WINDOW_NANOS, 25.1) else { panic!("it turns back") };
        assert!((back_rad_s.to_degrees() - 0.0251 / 0.15).abs() < 1e-5, "{back_rad_s}");
        for mdeg in [-80e3, 0.0, 900.0] {
            assert_eq!(after(WINDOW_NANOS - 1, mdeg), WindowOutcome::Open, "{mdeg}");
        }
        assert!(matches!(after(10_000, 1000.0), WindowOutcome::WrongWay(_)));
    }

    /// Angles of 3 and 40 milli-degrees: the map's turn must exceed 1.6 degrees before the rotor can count as stuck.
    #[test]
    fn exact_a_wide_estimate_does_not_show_a_stuck_rotor() {
        let progress = ProgressWindow::from(Time::ZERO, &estimate(0.0, 3.0));
        let limit_s = 40.0 * 1e-3 * 1609_f64.sqrt().to_radians() / 0.02;
        for (part, outcome) in [(0.99, WindowOutcome::Open), (1.01, WindowOutcome::Stuck)] {
            let now = Time::from_nanos((1e9 * part * limit_s) as u64);
            assert!(now.nanos() > WINDOW_NANOS);
            assert_eq!(progress.outcome(0.02, WINDOW_NANOS, now, &estimate(0.0, 40.0)), outcome, "{part}");
        }
    }

    /// A rotor that turns at the map's rate or at a fourth of it never counts as stuck, however wide the estimate is
    /// and however its error of up to five standard deviations lies.
    #[test]
    fn law_a_rotor_that_turns_is_not_stuck() {
        for (part, error) in [(1.0, 0.0), (1.0, -5.0), (0.25, 0.0), (0.25, -5.0)] {
            for sigma_mdeg in [1.0_f32, 40.0, 1000.0, 9000.0] {
                let progress = ProgressWindow::from(Time::ZERO, &estimate(0.0, 0.0));
                let outcomes = (1..=1000_u64).map(|n| {
                    let now = Time::from_nanos(n * WINDOW_NANOS / 50);
                    let off_mdeg = error * f64::from(sigma_mdeg);
                    let mdeg = part * 200e3 * now.seconds_since::<f64>(Time::ZERO) + off_mdeg;
                    progress.outcome(200_f32.to_radians(), WINDOW_NANOS, now, &estimate(mdeg, sigma_mdeg))
                });
                let told = outcomes.into_iter().find(|outcome| *outcome != WindowOutcome::Open);
                assert!(
                    matches!(told, Some(WindowOutcome::Turns(_))),
                    "{part} {error} {sigma_mdeg}: {told:?}"
                );
            }
        }
    }
}
