//! `host-sim rate`: a rate held in closed loop, or led through a profile, against the truth.
//!
//! The first [`SETTLE_S`] are left out. Over the rest, in the plant's own angle:
//!
//! ```text
//! mean error = (turned - asked) / asked          ripple = rms of (angle - reference) and of (rate - asked)
//! ```
//!
//! for a staircase both ways along what is asked for, without the rests; and beside it what this motor reaches: its mean rates at full drive, open loop, in either mode ([`RateRange`]).
//!
//! Each mean is over as much of the run as is left, so it is the angle's error over the time: the longer, the better.

use std::fmt;
use std::ops::ControlFlow;

use controller::rate::{Profile, RateHold, RateTuning};
use motor_model::{DriveCommand, DriveMode, Time, math};
use serde::Serialize;

use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use crate::runs::RunError;
use crate::runs::closed_loop;
use crate::scene::{Scene, SceneError};
use crate::world::plant::Plant;

/// Left out at the start, and after each step of a staircase.
pub const SETTLE_S: f64 = 0.25;
/// Steps of a staircase, and of one both ways; rests of the latter.
const STEPS: u16 = 5;
const STEPS_BOTH_WAYS: u16 = 2;
const REST_S: f64 = 0.25;

/// What a motor reaches at full drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateRange {
    /// Mean rate in mode B, clockwise, in deg/s.
    pub clockwise_deg_s: f64,
    /// Mean rate in mode C, counter-clockwise and so negative.
    pub counter_clockwise_deg_s: f64,
}

impl RateRange {
    /// Mean over this time, after [`SETTLE_S`]: since the rate ripples by a third, it scatters by some 2 %.
    const MEAN_OVER_S: f64 = 5.0;

    /// Of the motor of `scene`, by itself, with neither loop nor faults.
    ///
    /// # Errors
    /// When the model refuses the scene's parameters.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        let mean = |mode| {
            let mut plant = Plant::draw(scene)?;
            let mut run = |until_s: f64| {
                while plant.now().seconds_since::<f64>(Time::ZERO) < until_s {
                    plant.step(DriveCommand::full(mode));
                }
                plant.state().rotor.angle.angle()
            };
            let from = run(SETTLE_S);
            let until = run(SETTLE_S + Self::MEAN_OVER_S);
            Ok::<f64, RunError>(until.minus(from).degrees() / Self::MEAN_OVER_S)
        };
        Ok(Self { clockwise_deg_s: mean(DriveMode::B)?, counter_clockwise_deg_s: mean(DriveMode::C)? })
    }

    /// Whether it holds `rate_deg_s` on average.
    pub fn holds(self, rate_deg_s: f64) -> bool {
        (self.counter_clockwise_deg_s..=self.clockwise_deg_s).contains(&rate_deg_s)
    }
}

/// What became of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Rate asked for.
    pub rate_deg_s: f64,
    /// Profile.
    pub profile: &'static str,
    /// Time after settling.
    pub measured_s: f64,
    /// Mean of what was asked for in that time; both ways, of its magnitude.
    pub asked_deg_s: f64,
    /// True mean rate in that time.
    pub mean_deg_s: f64,
    /// Error of the mean, in percent of what was asked for.
    pub mean_error_percent: f64,
    /// Root mean square of the true angle less the reference.
    pub following_rms_deg: f64,
    /// Root mean square of the true rate less the one asked for.
    pub ripple_rms_deg_s: f64,
    /// Root mean square of the estimated less the true angle.
    pub estimate_rms_mdeg: f64,
    /// Share of the time at full drive: near 1 the motor cannot do more.
    pub saturated: f64,
    /// What this motor reaches at full drive.
    pub reach: RateRange,
    /// Seed of the run.
    pub seed: u64,
}

/// A moment of a run, for its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Time in s.
    pub time_s: f64,
    /// Rate asked for in deg/s.
    pub asked_deg_s: f64,
    /// True rate, over the time since the last moment, in deg/s.
    pub rate_deg_s: f64,
    /// True angle less reference in degrees.
    pub off_deg: f64,
    /// Amplitude, negative in mode C.
    pub drive: f64,
}

/// The profile of a scene.
///
/// # Errors
/// When the controller refuses the rate.
#[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
pub fn profile(scene: &Scene) -> Result<Profile, RunError> {
    let Profile::Dwell { rate_rad_s } = Profile::dwell(scene.number("rate.deg_s"))? else {
        unreachable!("a dwell")
    };
    let length_s = scene.number("rate.duration_s") as f32;
    Ok(match scene.choice("rate.profile") {
        "staircase" => Profile::Staircase { rate_rad_s, steps: STEPS, step_s: length_s / f32::from(STEPS) },
        "both_ways" if side_s(f64::from(length_s)) < 2.0 * (REST_S + SETTLE_S) => {
            return Err(SceneError::Conflict {
                conflict: format!(
                    "rate.duration_s = {length_s} s leaves no time for four turns after rests of {REST_S} s"
                ),
                hint: format!("{} s and more do", REST_S + 8.0 * (REST_S + SETTLE_S)),
            }
            .into());
        }
        "both_ways" => Profile::BothWays {
            clockwise_rad_s: rate_rad_s.abs(),
            counter_clockwise_rad_s: -rate_rad_s.abs(),
            steps: STEPS_BOTH_WAYS,
            turn_s: (side_s(f64::from(length_s)) - REST_S) as f32,
            rest_s: REST_S as f32,
        },
        "sweep" => Profile::Sweep {
            mean_rad_s: rate_rad_s,
            amplitude_rad_s: 0.25 * rate_rad_s,
            frequency_hz: (1.0, 5.0),
            length_s,
        },
        _ => Profile::Dwell { rate_rad_s },
    })
}

/// Time from one rest of a staircase both ways to the next; it ends with one.
fn side_s(duration_s: f64) -> f64 {
    (duration_s - REST_S) / (2.0 * f64::from(STEPS_BOTH_WAYS))
}

/// Sums over the measured time.
#[derive(Default)]
struct Sums {
    ticks: f64,
    turned_deg: f64,
    asked_deg: f64,
    following_deg2: f64,
    ripple_deg2_s2: f64,
    estimate_mdeg2: f64,
    saturated: f64,
}

const TICK_S: f64 = 1e-5;
/// Ticks from one moment of the picture to the next.
const TICKS_PER_MOMENT: u64 = 500;

/// Runs the rate of `scene`, showing a moment every 5 ms to `observe`.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene, mut observe: impl FnMut(Moment)) -> Result<Outcome, RunError> {
    let hold = RateHold::new(profile(scene)?, RateTuning::default(), Time::ZERO);
    let duration_s = scene.number("rate.duration_s");
    let both_ways = scene.choice("rate.profile") == "both_ways";
    let mut sums = Sums::default();
    let mut closed_loop = closed_loop::rate(scene, hold)?;
    let mut last_angle = closed_loop.plant().state().rotor.angle.angle();
    let (mut moment_angle, mut ticks) = (last_angle, 0_u64);
    closed_loop.run(|_, tick| {
        ticks += 1;
        let (angle, time_s, report) = (tick.angle, tick.seconds(), &tick.report);
        let asked_deg_s = f64::from(report.wanted_rad_s).to_degrees();
        let off_deg = report.reference.map_or(0.0, |reference| angle.minus(reference).degrees());
        let amplitude = f64::from(report.applied.amplitude());
        if settled(scene, time_s, duration_s) {
            sums.ticks += 1.0;
            // Both ways along what is asked for: else nothing would be left of it.
            let along = if both_ways { asked_deg_s.signum() } else { 1.0 };
            sums.turned_deg += along * angle.minus(last_angle).degrees();
            sums.asked_deg += along * asked_deg_s * TICK_S;
            sums.following_deg2 += off_deg * off_deg;
            let ripple = tick.rate_rad_s.to_degrees() - asked_deg_s;
            sums.ripple_deg2_s2 += ripple * ripple;
            if let Some(estimate) = report.estimate {
                let error = 1e3 * estimate.angle.minus(angle).degrees();
                sums.estimate_mdeg2 += error * error;
            }
            sums.saturated += f64::from(u8::from(amplitude >= 1.0));
        }
        last_angle = angle;
        if ticks.is_multiple_of(TICKS_PER_MOMENT) {
            #[expect(clippy::cast_precision_loss, reason = "500")]
            let rate_deg_s = angle.minus(moment_angle).degrees() / (TICKS_PER_MOMENT as f64 * TICK_S);
            let drive = if report.applied.mode() == Some(DriveMode::C) { -amplitude } else { amplitude };
            observe(Moment { time_s, asked_deg_s, rate_deg_s, off_deg, drive });
            moment_angle = angle;
        }
        if time_s >= duration_s { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    Ok(sums.outcome(scene, RateRange::of(scene)?))
}

fn settled(scene: &Scene, time_s: f64, duration_s: f64) -> bool {
    match scene.choice("rate.profile") {
        "staircase" => time_s % (duration_s / f64::from(STEPS)) >= SETTLE_S,
        "both_ways" => time_s % side_s(duration_s) >= REST_S + SETTLE_S && time_s < duration_s - REST_S,
        _ => time_s >= SETTLE_S,
    }
}

impl Sums {
    fn outcome(&self, scene: &Scene, reach: RateRange) -> Outcome {
        let measured_s = self.ticks * TICK_S;
        let root = |sum: f64| math::sqrt(sum / self.ticks.max(1.0));
        Outcome {
            rate_deg_s: scene.number("rate.deg_s"),
            profile: scene.choice("rate.profile"),
            measured_s,
            asked_deg_s: self.asked_deg / measured_s,
            mean_deg_s: self.turned_deg / measured_s,
            mean_error_percent: 100.0 * (self.turned_deg - self.asked_deg) / self.asked_deg.abs(),
            following_rms_deg: root(self.following_deg2),
            ripple_rms_deg_s: root(self.ripple_deg2_s2),
            estimate_rms_mdeg: root(self.estimate_mdeg2),
            saturated: self.saturated / self.ticks.max(1.0),
            reach,
            seed: scene.seed(),
        }
    }
}

impl Outcome {
    /// The outcome as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "rate               {:+.2} deg/s, {}, seed {}",
            self.rate_deg_s, self.profile, self.seed
        )?;
        writeln!(
            f,
            "true mean rate     {:+.4} deg/s for {:+.4} over {:.2} s: {:+.4} % off",
            self.mean_deg_s, self.asked_deg_s, self.measured_s, self.mean_error_percent
        )?;
        writeln!(f, "following          {:.3} deg rms off the reference angle", self.following_rms_deg)?;
        writeln!(f, "ripple             {:.1} deg/s rms", self.ripple_rms_deg_s)?;
        writeln!(f, "estimator error    {:.2} mdeg rms", self.estimate_rms_mdeg)?;
        writeln!(f, "at full drive      {:.1} % of the time", 100.0 * self.saturated)?;
        let RateRange { clockwise_deg_s, counter_clockwise_deg_s } = self.reach;
        let both_ways = self.profile == "both_ways";
        let holds = self.reach.holds(self.rate_deg_s) && (!both_ways || self.reach.holds(-self.rate_deg_s));
        let beyond = if holds { "" } else { ": the rate asked for is beyond it" };
        writeln!(f, "this motor reaches {counter_clockwise_deg_s:+.0} to {clockwise_deg_s:+.0} deg/s{beyond}")
    }
}

/// The run as an SVG document.
///
/// # Errors
/// When the picture cannot be laid out.
pub fn svg(outcome: &Outcome, moments: &[Moment]) -> Result<String, OutputError> {
    let time = || Axis::new("time (s)");
    let line = |of: fn(&Moment) -> f64| moments.iter().map(|m| (m.time_s, of(m))).collect::<Vec<_>>();
    Figure::new(format!("Rate of {} degrees a second in closed loop", outcome.rate_deg_s))
        .caption(format!(
            "plant drawn by seed {}: mean rate {:+.3} % off, ripple {:.0} deg/s rms",
            outcome.seed, outcome.mean_error_percent, outcome.ripple_rms_deg_s
        ))
        .panel(
            Panel::new("Rate, means of 5 ms", time(), Axis::new("rate (deg/s)"))
                .series(Series::line(line(|m| m.rate_deg_s)).colour(Colour::Blue).label("truth"))
                .series(Series::dashes(line(|m| m.asked_deg_s)).colour(Colour::Black).label("asked for")),
        )
        .panel(
            Panel::new("Angle less reference", time(), Axis::new("angle (deg)"))
                .series(Series::line(line(|m| m.off_deg)).colour(Colour::Blue)),
        )
        .panel(
            Panel::new("Drive: mode B up, mode C down", time(), Axis::new("amplitude").within(-1.1..1.1))
                .series(Series::line(line(|m| m.drive)).colour(Colour::Purple))
                .height(210),
        )
        .svg()
}
