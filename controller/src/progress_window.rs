//! Whether a driven rotor gets on: a slow motor is no stuck one.
//!
//! A cruise is watched in windows of [`WINDOW_NANOS`]. With `d` the turn along the direction of the mode since the window began, and `s^2` the sum of the variances of the
//! angles at both of its ends:
//!
//! ```text
//! at its end:     d > 5 s    it gets on, however slowly, and says how fast;   d < -5 s    it turns the wrong way;   between    it is stuck
//! meanwhile:      d < -1 degree and d < -5 s    it turns the wrong way
//! ```
//!
//! So a rotor that is stuck is noticed within two windows of when it stuck, whatever it did before, and one that turns back after a degree or a window. With the 5 to 20
//! milli-degrees that filters know of a moving rotor's angle, getting on is more than 0.2 to 1 degrees a second.

use estimator::Estimate;
use motor_model::{Angle, Time};

/// Length of a window in ns.
pub const WINDOW_NANOS: u64 = 150_000_000;
/// A turn is one when it exceeds so many of its standard deviations.
const SURELY: f32 = 5.0;
/// A wrong way of this is no accident of the start, in rad: a degree.
const WRONG_WAY_RAD: f32 = 0.017;

/// The window under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressWindow {
    since: Time,
    from: Angle,
    from_rad2: f32,
}

/// What a window tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowOutcome {
    /// It is not over.
    Open,
    /// The rotor turns at this mean rate along the direction of the mode, in rad/s.
    GetsOn(f32),
    /// It does not turn.
    Stuck,
    /// It turns against the direction of the mode.
    WrongWay,
}

impl ProgressWindow {
    /// A window that begins at `now`.
    pub fn from(now: Time, estimate: &Estimate<f32>) -> Self {
        Self { since: now, from: estimate.angle, from_rad2: estimate.angle_rad2 }
    }

    /// What is known by `now` of a rotor driven towards `direction`, clockwise positive.
    pub fn outcome(&self, direction: f32, now: Time, estimate: &Estimate<f32>) -> WindowOutcome {
        let turned_rad = direction * estimate.angle.radians_since::<f32>(self.from);
        let surely_rad2 = SURELY * SURELY * (self.from_rad2 + estimate.angle_rad2);
        let surely = turned_rad * turned_rad > surely_rad2;
        let over = now.nanos_since(self.since) >= WINDOW_NANOS;
        if surely && turned_rad < 0.0 && (over || turned_rad < -WRONG_WAY_RAD) {
            WindowOutcome::WrongWay
        } else if !over {
            WindowOutcome::Open
        } else if surely {
            WindowOutcome::GetsOn(turned_rad / now.seconds_since::<f32>(self.since))
        } else {
            WindowOutcome::Stuck
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
        let after = |nanos, mdeg| progress.outcome(-1.0, Time::from_nanos(nanos), &estimate(mdeg, 4.0));
        let WindowOutcome::GetsOn(rate_rad_s) = after(WINDOW_NANOS, -25.1) else { panic!("it gets on") };
        assert!((rate_rad_s.to_degrees() - 0.0251 / 0.15).abs() < 1e-5, "{rate_rad_s}");
        assert_eq!(after(WINDOW_NANOS, -24.9), WindowOutcome::Stuck);
        assert_eq!(after(WINDOW_NANOS, 24.9), WindowOutcome::Stuck);
        assert_eq!(after(WINDOW_NANOS, 25.1), WindowOutcome::WrongWay);
        for mdeg in [-80e3, 0.0, 900.0] {
            assert_eq!(after(WINDOW_NANOS - 1, mdeg), WindowOutcome::Open, "{mdeg}");
        }
        assert_eq!(after(10_000, 1000.0), WindowOutcome::WrongWay);
    }
}
