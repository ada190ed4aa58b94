//! A rate held in closed loop, or a profile of rates, against the truth: `host-sim rate`.
//!
//! The first [`SETTLE_S`] are left out. Over the rest, by the true angle:
//!
//! ```text
//! mean error = turned / asked - 1                ripple = rms of (angle - reference) and of (rate - asked)
//! ```
//!
//! For a staircase both ways, turns count in the direction asked for, without the rests. Beside it stands the range of
//! this motor: its fastest mean rates in open loop, in either mode ([`RateRange`]), and the range that the loop's map
//! promises before the run ([`PromisedRange`]).
//!
//! The mean is over the rest of the run. Its error is the angle's error over that time, so a longer run measures it
//! better.

mod keeping_up;
mod outcome;
mod point;
mod profile;
mod promised;
mod range;

use std::convert::Infallible;
use std::ops::ControlFlow;

use controller::TICK_NANOS;
use controller::rate::{RateHold, RateStop};
use motor_model::{DriveMode, Time, math};

use crate::math::statistics::MeanSquare;
use crate::runs::RunError;
use crate::runs::closed_loop::{self, ClosedRateLoop, RateMoment};
use crate::runs::filter;
use crate::runs::limits;
use crate::runs::rotor_tilt::TiltFigureSums;
use crate::runs::stated_errors::StatedErrorCounts;
use crate::scene::Scene;
use keeping_up::NO_DRIVE;
pub use keeping_up::{CANNOT_KEEP_UP, KeepingUp, cannot_keep_up};
pub use outcome::{RateOutcome, reason};
pub use point::RatePoint;
pub use profile::profile;
pub use promised::{PromisedRange, PromisedRate};
pub use range::RateRange;

/// Left out at the start, and after each step of a staircase.
pub const SETTLE_S: f64 = 0.25;

/// Sums over the measured time.
#[derive(Default)]
struct RateSums {
    ticks: f64,
    turned_deg: f64,
    asked_deg: f64,
    following_deg: MeanSquare,
    ripple_deg2_s2: f64,
    estimate_mdeg: MeanSquare,
    stated: StatedErrorCounts,
    tilt: TiltFigureSums,
    saturated: f64,
    /// Whether there was a reference in the last tick, and how often it was lost.
    had_reference: bool,
    reference_losses: u32,
    /// Why and when in s the rate was held no more.
    stopped: Option<(RateStop, f64)>,
    /// Rate in deg/s of a motor that did not keep up in the end.
    reached_deg_s: Option<f64>,
}

/// A tick of the loop in s.
#[expect(clippy::cast_precision_loss, reason = "10,000 ns")]
const TICK_S: f64 = TICK_NANOS as f64 / 1e9;
/// Ticks from one point of the picture to the next.
const TICKS_PER_POINT: u64 = 500;

/// Runs the rate of `scene`, and calls `observe` with a point of the picture every 5 ms.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, observe: impl FnMut(RatePoint)) -> Result<RateOutcome, RunError> {
    let ControlFlow::Continue(outcome) =
        run_with(scene, observe, |_, _| ControlFlow::<Infallible>::Continue(()))?;
    Ok(outcome)
}

/// The same, and `intervene` sees the loop after every tick, and may change it, or end the run with a value of its own.
///
/// # Errors
/// When the scene is refused.
pub fn run_with<B>(
    scene: &Scene,
    mut observe: impl FnMut(RatePoint),
    mut intervene: impl FnMut(&mut ClosedRateLoop, &RateMoment) -> ControlFlow<B>,
) -> Result<ControlFlow<B, RateOutcome>, RunError> {
    let promised = PromisedRange::of(scene)?;
    let profile = profile(scene)?;
    limits::check_rate(scene, &profile)?;
    let hold = RateHold::new(profile, limits::rate_tuning(scene), Time::ZERO);
    let duration_s = scene.number("rate.duration_s");
    let profile_name = scene.choice("rate.profile");
    let both_ways = profile_name == "both_ways";
    let mut sums = RateSums::default();
    let mut closed_loop = closed_loop::rate(scene, hold)?;
    let mut last_angle = closed_loop.plant().rotor().angle;
    let (mut point_angle, mut ticks) = (last_angle, 0_u64);
    let mut last_off_deg = None;
    let mut since_point = TiltFigureSums::default();
    let mut keeping_up = KeepingUp::new(scene);
    let ended = closed_loop.run(|closed_loop, tick| {
        if let ControlFlow::Break(value) = intervene(closed_loop, &tick) {
            return ControlFlow::Break(ControlFlow::Break(value));
        }
        ticks += 1;
        sums.tilt.add(tick.tilt.as_ref());
        since_point.add(tick.tilt.as_ref());
        let (angle, time_s, report) = (tick.angle, tick.seconds(), &tick.report);
        let asked_deg_s = f64::from(report.wanted_rad_s).to_degrees();
        // A tick without a decision has the reference of the last.
        let reference = report.estimate.and(report.reference);
        let off_deg = reference.map(|reference| angle.minus(reference).degrees());
        last_off_deg = off_deg.or(last_off_deg);
        let amplitude = f64::from(report.applied.amplitude());
        let has_reference = report.reference.is_some();
        sums.reference_losses += u32::from(sums.had_reference && !has_reference);
        sums.had_reference = has_reference;
        sums.stopped = sums.stopped.or(report.stopped.map(|why| (why, time_s)));
        if let Some(estimate) = report.estimate.filter(|_| report.stopped.is_none()) {
            keeping_up.take(tick.at, report.wanted_rad_s, report.reference, estimate.angle);
        }
        if profile::settled(profile_name, time_s, duration_s) {
            sums.ticks += 1.0;
            // Both ways, turns count in the direction asked for: otherwise they would cancel.
            let along = if both_ways { asked_deg_s.signum() } else { 1.0 };
            sums.turned_deg += along * angle.minus(last_angle).degrees();
            sums.asked_deg += along * asked_deg_s * TICK_S;
            if let Some(off_deg) = off_deg {
                sums.following_deg.add(off_deg);
            }
            let ripple = tick.rate_rad_s.to_degrees() - asked_deg_s;
            sums.ripple_deg2_s2 += ripple * ripple;
            if let Some(estimate) = &report.estimate {
                sums.stated.add(estimate, report.health, angle);
                sums.estimate_mdeg.add(1e3 * estimate.angle.minus(angle).degrees());
            }
            sums.saturated += f64::from(u8::from(amplitude >= 1.0));
        }
        last_angle = angle;
        if ticks.is_multiple_of(TICKS_PER_POINT) {
            #[expect(clippy::cast_precision_loss, reason = "500")]
            let rate_deg_s = angle.minus(point_angle).degrees() / (TICKS_PER_POINT as f64 * TICK_S);
            let drive = if report.applied.mode() == Some(DriveMode::C) { -amplitude } else { amplitude };
            let tilt = std::mem::take(&mut since_point).figures();
            observe(RatePoint {
                time_s,
                asked_deg_s,
                rate_deg_s,
                off_deg: last_off_deg.filter(|_| has_reference).unwrap_or(0.0),
                drive,
                tilt,
                health: report.health,
            });
            point_angle = angle;
        }
        if time_s >= duration_s {
            ControlFlow::Break(ControlFlow::Continue(()))
        } else {
            ControlFlow::Continue(())
        }
    });
    if let ControlFlow::Break(value) = ended {
        return Ok(ControlFlow::Break(value));
    }
    sums.reached_deg_s = keeping_up.reached_deg_s().filter(|_| sums.stopped.is_none());
    Ok(ControlFlow::Continue(sums.outcome(scene, promised, RateRange::of(scene)?)))
}

impl RateSums {
    fn outcome(&self, scene: &Scene, promised: PromisedRange, range: RateRange) -> RateOutcome {
        let measured_s = self.ticks * TICK_S;
        // Nothing has turned in no time.
        let some_s = measured_s.max(TICK_S);
        let (rate_deg_s, profile) = (scene.number("rate.deg_s"), scene.choice("rate.profile"));
        // A motor that reaches the rate is held back by a map that does not.
        let has_drive = promised.holds || !range.holds_profile(rate_deg_s, profile);
        let following_rms_deg = self.following_deg.root_of_some();
        RateOutcome {
            rate_deg_s,
            profile,
            measured_s,
            asked_deg_s: self.asked_deg / some_s,
            mean_deg_s: self.turned_deg / some_s,
            mean_error_percent: (self.asked_deg.abs() > 0.0)
                .then(|| 100.0 * (self.turned_deg - self.asked_deg) / self.asked_deg),
            following_rms_deg,
            ripple_rms_deg_s: math::sqrt(self.ripple_deg2_s2 / self.ticks.max(1.0)),
            estimate_rms_mdeg: self.estimate_mdeg.root_of_some(),
            stated: self.stated.figures(),
            tilt: self.tilt.figures(),
            reference_losses: self.reference_losses,
            stopped: self.stopped.map(|(why, _)| format!("{why:?}")),
            reason: self
                .stopped
                .map(|(why, _)| reason(why))
                .or_else(|| {
                    (self.ticks > 0.0 && following_rms_deg.is_none()).then_some(outcome::NO_REFERENCE)
                })
                .or_else(|| self.reached_deg_s.map(|_| if has_drive { CANNOT_KEEP_UP } else { NO_DRIVE })),
            stopped_s: self.stopped.map(|(_, time_s)| time_s),
            reached_deg_s: self.reached_deg_s,
            filter: filter::chosen(scene),
            saturated: self.saturated / self.ticks.max(1.0),
            promised,
            range,
            has_faults: !scene.fault_words().is_empty(),
            seed: scene.seed(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Origin;

    const REACH: RateRange = RateRange { clockwise_deg_s: 900.0, counter_clockwise_deg_s: -76.0 };

    fn held(sets: &[&str], sums: &RateSums) -> RateOutcome {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        let scene = Scene::of_sets(&sets).unwrap();
        sums.outcome(&scene, PromisedRange::of(&scene).unwrap(), REACH)
    }

    /// A rotor that turns by 75 degrees for 100 asked for is too slow by a quarter, either way.
    #[test]
    fn exact_a_rate_that_is_too_low_has_a_negative_error() {
        for (deg_s, sign) in [("100", 1.0), ("-100", -1.0)] {
            let sums = RateSums { turned_deg: sign * 75.0, asked_deg: sign * 100.0, ..RateSums::default() };
            let outcome = held(&[&format!("rate.deg_s={deg_s}")], &sums);
            assert_eq!(outcome.mean_error_percent, Some(-25.0));
            assert!(outcome.to_string().contains(": -25.0000 % off"), "{outcome}");
        }
    }

    /// What the motor reaches leaves its faults out, and says so.
    #[test]
    fn exact_the_range_of_a_motor_with_faults_is_said_to_be_without_them() {
        let mut scene = Scene::default();
        let said = |scene: &Scene| {
            RateSums::default().outcome(scene, PromisedRange::of(scene).unwrap(), REACH).to_string()
        };
        assert!(said(&scene).ends_with("this motor reaches -76 to +900 deg/s\n"));
        scene.add_fault("drive:dead", &|_| Ok(()), Origin::Program).unwrap();
        assert!(said(&scene).ends_with("this motor reaches -76 to +900 deg/s without its faults\n"));
    }

    /// A rotor that is behind is held back by its map where that promises less than asked for, and the motor reaches
    /// it; by the motor elsewhere.
    #[test]
    fn exact_what_holds_a_rotor_back_is_named() {
        let outcome = |deg_s: &str, mean_deg_s, reach| {
            let scene = Scene::of_sets(&[format!("rate.deg_s={deg_s}")]).unwrap();
            let asked = PromisedRange::of(&scene).unwrap();
            let clockwise = PromisedRate { mean_deg_s, sd_deg_s: 0.0 };
            let promised =
                PromisedRange { clockwise, holds: mean_deg_s >= scene.number("rate.deg_s"), ..asked };
            let mut sums = RateSums { reached_deg_s: Some(4.0), ticks: 1.0, ..RateSums::default() };
            sums.following_deg.add(90.0);
            sums.outcome(&scene, promised, reach)
        };
        for (deg_s, promised, why) in
            [("100", 1.0, NO_DRIVE), ("100", 800.0, CANNOT_KEEP_UP), ("950", 1.0, CANNOT_KEEP_UP)]
        {
            let outcome = outcome(deg_s, promised, REACH);
            assert_eq!(outcome.reason, Some(why), "{deg_s} {promised}");
            let said =
                format!("not held           {why}: it turned +4.0 deg/s in all the time it was behind");
            assert!(outcome.to_string().contains(&said), "{outcome}");
        }
    }

    /// In no measured time nothing turns, and nothing is said of estimates.
    #[test]
    fn exact_no_time_has_no_rate_and_no_reason() {
        let outcome = held(&[], &RateSums::default());
        assert_eq!((outcome.mean_deg_s, outcome.asked_deg_s, outcome.reason), (0.0, 0.0, None));
    }

    /// Without a frame nothing is followed and nothing estimated, and a rate of 0 has no percentage.
    #[test]
    fn exact_what_was_not_measured_has_no_value() {
        let sums = RateSums { ticks: 1000.0, ..RateSums::default() };
        let outcome = held(&["rate.deg_s=0", "camera.drop_probability=1"], &sums);
        let RateOutcome { following_rms_deg, estimate_rms_mdeg, mean_error_percent, stated, .. } = &outcome;
        let missing = [*following_rms_deg, *estimate_rms_mdeg, *mean_error_percent, stated.beyond_3_sigma];
        assert_eq!(missing, [None; 4]);
        let text = outcome.to_string();
        for words in
            ["following          - deg rms", "estimator error    - mdeg rms", "no estimate that may be used"]
        {
            assert!(text.contains(words), "{text}");
        }
        assert!(!text.contains("NaN") && outcome.reason.is_some(), "{text}");
    }
}
