//! The schedule of a calibration: rests, and turns to either side at a staircase of rates.
//!
//! # How well a schedule determines the scale factor
//!
//! With a gyroscope that has no noise but its random walk `N`, and an exact reference, rates `r(t)` determine the scale
//! factor to
//!
//! ```text
//! sigma = N / sqrt( integral (r - mean of r)^2 dt )
//! ```
//!
//! if the bias is unknown too. So the schedule turns as fast as it may to one side for half of the time and to the
//! other for the rest. Counter-clockwise that is the motor's full rate, 88 +- 19 deg/s, which has little ripple.
//! Clockwise it could turn at 870 deg/s, with a ripple of 0.33 of the mean. But a sample beyond the gyroscope's range
//! costs more than its interval. The turn in that time is lost and taken from the reference instead, whose 5
//! milli-degrees at either end of the gap are as much as 8 s of random walk. The best rate is 160 deg/s, with five
//! standard deviations of the ripple up to the range of 400. One step of the staircase is best for the scale factor.
//! More steps would show whether a gyroscope is linear.

use controller::rate::Profile;

use simulation::math::count::real;
use simulation::runs::simulate::steps_in;
use simulation::scene::{Scene, SceneError};
use simulation::world::instruments::gyroscope;

/// The schedule of a scene, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnSchedule {
    /// Ticks of the loop from one sample of the gyroscope to the next.
    pub ticks_per_sample: u64,
    /// Samples from one comparison to the next.
    pub samples_per_interval: usize,
    /// Motor time.
    pub duration_s: f64,
    /// Rate of the last step clockwise.
    pub clockwise_deg_s: f64,
    /// The profile of the rate for the controller.
    pub profile: Profile,
}

impl TurnSchedule {
    /// Of a scene.
    ///
    /// # Errors
    /// When the rests leave no time for the turns, or the gyroscope's period is no whole number of ticks.
    pub fn of(scene: &Scene) -> Result<Self, SceneError> {
        let ticks_per_sample = gyroscope::ticks_per_sample(scene)?;
        let steps = u16::try_from(scene.integer("calibrate.steps")).unwrap_or(u16::MAX);
        let (duration_s, rest_s) = (scene.number("calibrate.duration_s"), scene.number("calibrate.rest_s"));
        let interval_s = scene.number("calibrate.interval_s");
        let turns = 2.0 * f64::from(steps);
        let turn_s = (duration_s - (turns + 1.0) * rest_s) / turns;
        if turn_s < 2.0 * interval_s {
            return Err(SceneError::Conflict {
                conflict: format!(
                    "calibrate.duration_s = {duration_s} s leaves {turn_s:.3} s for each of {turns} turns between \
                     rests of calibrate.rest_s = {rest_s} s"
                ),
                hint:
                    "a turn takes two intervals at least: fewer calibrate.steps, shorter rests or a longer \
                    plan"
                        .to_owned(),
            });
        }
        let samples = (interval_s * scene.number("gyroscope.sample_rate_hz")).round().max(1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 1e5")]
        let samples_per_interval = samples as usize;
        let [clockwise_deg_s, counter_clockwise_deg_s] =
            ["calibrate.clockwise_deg_s", "calibrate.counter_clockwise_deg_s"].map(|key| scene.number(key));
        #[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
        let profile = Profile::BothWays {
            clockwise_rad_s: clockwise_deg_s.to_radians() as f32,
            counter_clockwise_rad_s: -counter_clockwise_deg_s.to_radians() as f32,
            steps,
            turn_s: turn_s as f32,
            rest_s: rest_s as f32,
        };
        Ok(Self { ticks_per_sample, samples_per_interval, duration_s, clockwise_deg_s, profile })
    }

    /// Ticks of the loop.
    pub fn ticks(&self) -> u64 {
        steps_in(self.duration_s * 1e9, real(controller::TICK_NANOS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rests before each turn and after the last: 30 s with two steps and rests of 2 s are four turns of 5 s and five
    /// rests.
    #[test]
    fn exact_turns_and_rests_fill_the_schedule() {
        let mut scene = Scene::default();
        for (key, value) in [("duration_s", "30"), ("steps", "2"), ("rest_s", "2")] {
            scene.set(&format!("calibrate.{key}"), value).unwrap();
        }
        let schedule = TurnSchedule::of(&scene).unwrap();
        let Profile::BothWays { steps, turn_s, rest_s, .. } = schedule.profile else {
            panic!("{:?}", schedule.profile)
        };
        assert_eq!(steps, 2);
        assert!((turn_s - 5.0).abs() < 1e-6 && (rest_s - 2.0).abs() < 1e-6, "{turn_s} {rest_s}");
        assert_eq!(schedule.ticks(), 3_000_000);
        // A turn of two intervals is the shortest.
        scene.set("calibrate.duration_s", "11.99").unwrap();
        assert!(TurnSchedule::of(&scene).is_err());
        scene.set("calibrate.duration_s", "12.01").unwrap();
        assert!(TurnSchedule::of(&scene).is_ok());
    }
}
