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
//! milli-degrees at either end of the gap are as much as 8 s of random walk. For the random walk alone the best rate is
//! 160 deg/s, with five standard deviations of the ripple up to the range of 400. But non-linearity grows with the
//! square of the rate, and two rates hardly tell it. Of 25 ppm it leaves 4.3 ppm of the scale factor in a plan with
//! 160 deg/s, where the random walk of a minute leaves 2.8. With 120 deg/s that is 3.6 and 3.0. One step of the
//! staircase is best for the scale factor.
//! More steps tell the non-linearity of the gyroscope better.

use super::pilot::goes_into_plan;
use simulation::math::count::real;
use simulation::runs::simulate::steps_in;
use simulation::scene::{Scene, SceneError};
use simulation::world::instruments::gyroscope::{self, noise::TimeSpan};

/// A part of a schedule with one rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnSegment {
    /// When it ends, in s since the start; it begins where the one before ends.
    pub until_s: f64,
    /// The rate asked for, clockwise positive; 0 is rest.
    pub rate_deg_s: f64,
}

/// The schedule of a scene, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnSchedule {
    /// Ticks of the loop from one sample of the gyroscope to the next.
    pub ticks_per_sample: u64,
    /// Samples in an interval.
    pub samples_per_interval: usize,
    /// Motor time.
    pub duration_s: f64,
    /// Error in ppm that 95 % of scale factors are to be within, if the plan shall be no longer than that takes.
    pub within_ppm: Option<f64>,
    /// Last rates clockwise, and the other way, negative.
    pub fastest_deg_s: [f64; 2],
    /// The rates, in order of time; they last for the whole motor time.
    pub segments: Vec<TurnSegment>,
}

impl TurnSchedule {
    /// Of a scene.
    ///
    /// # Errors
    /// When the rests leave no time for the turns, the gyroscope's period is no whole number of ticks, or the length of
    /// the plan is that of a pilot which is not there.
    pub fn of(scene: &Scene) -> Result<Self, SceneError> {
        let ticks_per_sample = gyroscope::ticks_per_sample(scene)?;
        let (duration_s, rest_s) = (scene.number("calibrate.duration_s"), scene.number("calibrate.rest_s"));
        let (interval_s, steps) = (scene.number("calibrate.interval_s"), scene.integer("calibrate.steps"));
        let turns = real(2 * steps);
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
        let step = |step: u64| {
            let part = real(step) / real(steps);
            [
                (rest_s, 0.0),
                (turn_s, part * clockwise_deg_s),
                (rest_s, 0.0),
                (turn_s, -part * counter_clockwise_deg_s),
            ]
        };
        let mut schedule = Self {
            ticks_per_sample,
            samples_per_interval,
            duration_s,
            within_ppm: within_ppm(scene)?,
            fastest_deg_s: [clockwise_deg_s, -counter_clockwise_deg_s],
            segments: Vec::new(),
        };
        schedule.extend((1..=steps).flat_map(step).chain([(rest_s, 0.0)]));
        if let Some(last) = schedule.segments.last_mut() {
            last.until_s = duration_s;
        }
        Ok(schedule)
    }

    /// The pilot of a scene: a rest, and as long a turn at each of two rates to either side; without a segment where
    /// the scene asks for none. The slower rate is half of the scene's clockwise, and a quarter the other way, where a
    /// motor turns at less than half of what the scene asks for.
    ///
    /// # Errors
    /// When the pilot is longer than half of the plan, or has turns of less than four intervals.
    pub fn pilot(&self, scene: &Scene) -> Result<Self, SceneError> {
        let pilot_s = scene.number("calibrate.pilot_s");
        let [clockwise, counter_clockwise] = self.fastest_deg_s;
        let rates = [0.0, clockwise, counter_clockwise, 0.5 * clockwise, 0.25 * counter_clockwise];
        let mut pilot = Self { duration_s: pilot_s, segments: Vec::new(), ..self.clone() };
        if pilot_s <= 0.0 {
            return Ok(pilot);
        }
        let turn_s = pilot_s / real(rates.len());
        if !goes_into_plan(scene, pilot_s) {
            return Err(SceneError::Conflict {
                conflict: format!(
                    "calibrate.pilot_s = {pilot_s} s does not go into a plan of calibrate.duration_s = {} s",
                    self.duration_s
                ),
                hint: "a pilot takes at most half of the plan, and twenty intervals at least; 0 for none"
                    .to_owned(),
            });
        }
        pilot.extend(rates.map(|rate_deg_s| (turn_s, rate_deg_s)));
        Ok(pilot)
    }

    /// Until when in s the motor turns before it is judged again, after `seen_s`: until it has turned for `enough_s`,
    /// for twice as long at most, and for a tenth longer at least; until the end where the plan has no error to meet.
    pub fn next_look_s(&self, seen_s: f64, enough_s: Option<f64>) -> f64 {
        if self.within_ppm.is_none() {
            return self.duration_s;
        }
        let (soonest_s, latest_s) = (1.1 * seen_s, 2.0 * seen_s);
        enough_s.unwrap_or(latest_s).clamp(soonest_s, latest_s).min(self.duration_s)
    }

    /// Adds `cycles` rounds of rest, turn, rest and turn back until `duration_s`. The rates in deg/s have their shares
    /// of the time that is left; the rest of it is rest.
    pub fn fill(&mut self, cycles: u32, duration_s: f64, turns: [(f64, f64); 2]) {
        let from_s = self.segments.last().map_or(0.0, |last| last.until_s);
        let cycle_s = (duration_s - from_s) / f64::from(cycles);
        let [(one_deg_s, one), (other_deg_s, other)] = turns;
        let rest_s = 0.5 * cycle_s * (1.0 - one - other);
        let cycle =
            [(rest_s, 0.0), (cycle_s * one, one_deg_s), (rest_s, 0.0), (cycle_s * other, other_deg_s)];
        for _ in 0..cycles {
            self.extend(cycle.into_iter().filter(|(length_s, _)| *length_s > 0.0));
        }
        self.duration_s = duration_s;
        if let Some(last) = self.segments.last_mut() {
            last.until_s = duration_s;
        }
    }

    /// Adds segments of a length in s and a rate in deg/s each.
    fn extend(&mut self, segments: impl IntoIterator<Item = (f64, f64)>) {
        for (length_s, rate_deg_s) in segments {
            let from_s = self.segments.last().map_or(0.0, |last| last.until_s);
            self.segments.push(TurnSegment { until_s: from_s + length_s, rate_deg_s });
        }
    }

    /// Ticks of the loop.
    pub fn ticks(&self) -> u64 {
        steps_in(self.duration_s * 1e9, real(controller::TICK_NANOS))
    }

    /// The rate asked for at a time, in deg/s; 0 after the end.
    pub fn rate_deg_s(&self, time_s: f64) -> f64 {
        let under_way = self.segments.iter().find(|segment| time_s < segment.until_s);
        under_way.map_or(0.0, |segment| segment.rate_deg_s)
    }

    /// The different rates but 0, in the order in which they come.
    pub fn drives_deg_s(&self) -> Vec<f64> {
        let mut drives: Vec<f64> = Vec::new();
        for TurnSegment { rate_deg_s, .. } in &self.segments {
            let is_new = drives.iter().all(|drive| drive.total_cmp(rate_deg_s).is_ne());
            if rate_deg_s.abs() > 0.0 && is_new {
                drives.push(*rate_deg_s);
            }
        }
        drives
    }

    /// The drive that turns the rotor in a span, counted from 1 in the order of [`Self::drives_deg_s`]; 0 at rest. Of
    /// two it is the faster one.
    pub fn drive_in(&self, span: TimeSpan) -> usize {
        let rates = [span.from_s, span.until_s - 1e-9].map(|time_s| self.rate_deg_s(time_s));
        let fastest = if rates[1].abs() > rates[0].abs() { rates[1] } else { rates[0] };
        let place = self.drives_deg_s().iter().position(|drive| drive.total_cmp(&fastest).is_eq());
        place.map_or(0, |place| place + 1)
    }
}

/// The value of `calibrate.within_ppm`; `None` for 0.
fn within_ppm(scene: &Scene) -> Result<Option<f64>, SceneError> {
    let within_ppm = scene.number("calibrate.within_ppm");
    if within_ppm > 0.0 && scene.number("calibrate.pilot_s") <= 0.0 {
        return Err(SceneError::Conflict {
            conflict: format!(
                "calibrate.within_ppm = {within_ppm} needs a pilot, which tells how long that takes"
            ),
            hint: "calibrate.pilot_s=10 and a plan of 20 s at least, or calibrate.within_ppm=0".to_owned(),
        });
    }
    Ok((within_ppm > 0.0).then_some(within_ppm))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(duration_s: &str) -> Scene {
        let mut scene = Scene::default();
        for (key, value) in [("duration_s", duration_s), ("steps", "2"), ("rest_s", "2")] {
            scene.set(&format!("calibrate.{key}"), value).unwrap();
        }
        scene
    }

    /// Rests before each turn and after the last: 30 s with two steps and rests of 2 s are four turns of 5 s and five
    /// rests.
    #[test]
    fn exact_turns_and_rests_fill_the_schedule() {
        let schedule = TurnSchedule::of(&scene("30")).unwrap();
        let segments: Vec<_> = schedule.segments.iter().map(|s| (s.until_s, s.rate_deg_s)).collect();
        let expected = [
            (2.0, 0.0),
            (7.0, 60.0),
            (9.0, 0.0),
            (14.0, -100.0),
            (16.0, 0.0),
            (21.0, 120.0),
            (23.0, 0.0),
            (28.0, -200.0),
            (30.0, 0.0),
        ];
        assert_eq!(segments, expected);
        assert_eq!(schedule.ticks(), 3_000_000);
        // A turn of two intervals is the shortest.
        assert!(TurnSchedule::of(&scene("11.99")).is_err());
        assert!(TurnSchedule::of(&scene("12.01")).is_ok());
    }

    /// A pilot of 10 s has a rest and four turns of 2 s; then come rounds with the shares that are asked for.
    #[test]
    fn exact_a_pilot_and_its_plan() {
        let mut scene = scene("40");
        scene.set("calibrate.pilot_s", "10").unwrap();
        let asked = TurnSchedule::of(&scene).unwrap();
        let mut schedule = asked.pilot(&scene).unwrap();
        let rates: Vec<f64> = schedule.segments.iter().map(|segment| segment.rate_deg_s).collect();
        assert_eq!(rates, [0.0, 120.0, -200.0, 60.0, -50.0]);
        schedule.fill(3, 40.0, [(120.0, 0.3), (-50.0, 0.5)]);
        let time_at = |rate_deg_s: f64| -> f64 {
            let until = schedule.segments.iter().map(|segment| segment.until_s);
            let from = std::iter::once(0.0).chain(until);
            let lengths = schedule.segments.iter().zip(from).map(|(segment, from_s)| {
                let is_of_rate = segment.rate_deg_s.total_cmp(&rate_deg_s).is_eq();
                if is_of_rate { segment.until_s - from_s } else { 0.0 }
            });
            lengths.sum()
        };
        for (rate_deg_s, time_s) in [(0.0, 8.0), (120.0, 11.0), (-200.0, 2.0), (60.0, 2.0), (-50.0, 17.0)] {
            assert!((time_at(rate_deg_s) - time_s).abs() < 1e-9, "{rate_deg_s}");
        }
        for refused in ["21", "4"] {
            scene.set("calibrate.pilot_s", refused).unwrap();
            assert!(asked.pilot(&scene).is_err(), "{refused}");
        }
    }

    /// Each rate is a drive of its own. An interval in which the rotor starts or coasts down belongs to the turn.
    #[test]
    fn exact_drives_by_time() {
        let schedule = TurnSchedule::of(&scene("30")).unwrap();
        let drives = schedule.drives_deg_s();
        assert!(drives.len() == 4 && (drives[2] - 120.0).abs() < 1e-9, "{drives:?}");
        for (from_s, until_s, drive) in [
            (0.0, 1.0, 0),
            (1.5, 2.5, 1),
            (2.0, 7.0, 1),
            (7.0, 8.0, 0),
            (13.5, 14.5, 2),
            (16.0, 17.0, 3),
            (27.0, 28.0, 4),
            (29.0, 30.0, 0),
        ] {
            assert_eq!(schedule.drive_in(TimeSpan { from_s, until_s }), drive, "{from_s}");
        }
    }
}
