//! The motor's run of a calibration: the true angle of the rotor, and the angle that the estimator gives.

use std::time::Instant;

use controller::rate::{Profile, RateHold, RateTuning};
use estimator::{AngleFilter as _, Estimate, Health};
use motor_model::{Angle, Time};

use super::schedule::{TurnSchedule, TurnSegment};
use simulation::math::count::real;
use simulation::math::statistics::root_mean_square;
use simulation::runs::RunError;
use simulation::runs::closed_loop::{self, ClosedRateLoop, RateMoment};
use simulation::runs::filter::SMOOTHER_LAG_MS;
use simulation::runs::simulate::steps_in;
use simulation::runs::stated_errors::{StatedErrorCounts, StatedErrors};
use simulation::scene::{Scene, SceneError};
use simulation::world::body_turn::{BodyTurn, turn_across};
use simulation::world::plant::Plant;
use simulation::world::pose::RotorTilt;

/// A rotor that is said to turn by less in a whole run stands still: its reference errs by some milli-degrees.
const LEAST_TURN_DEG: f64 = 1.0;

/// An instant at which the reference angle is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Which of the gyroscope's samples ends here; 0 is the start.
    pub sample: usize,
    /// Estimated angle, smoothed where the frames since allow it.
    pub angle: Angle,
    /// Its variance in deg^2, as the filter states it.
    pub variance_deg2: f64,
    /// Estimated less true angle in milli-degrees. The fit does not use it.
    pub error_mdeg: f64,
    /// What the filter says of it.
    pub health: Health,
}

/// A run of a motor through the schedule.
#[derive(Clone, Debug)]
pub struct TurningRun {
    /// Seed of the run, which draws the motor and its instruments' noise.
    pub seed: u64,
    /// True angles as seen from above, at the start and at the end of every sample of a gyroscope.
    pub truth: Vec<Angle>,
    /// Integral of the rate about the rotor's own axis, which the gyroscope senses, at the same instants.
    pub sensed: Vec<Angle>,
    /// Sums of the turns about the two axes across it, in degrees, at the same instants.
    pub across_deg: Vec<[f64; 2]>,
    /// The anchors, in order of time.
    pub anchors: Vec<Anchor>,
    /// Time that this machine took for a second of motor time, in the segment in which it took least.
    pub time_s_per_s: f64,
}

/// A motor that is led through a schedule, segment by segment.
pub struct TurningMotor {
    /// What was recorded until now.
    pub turning: TurningRun,
    closed_loop: ClosedRateLoop,
    across: AcrossSum,
    /// The last anchor, while the frames that smooth it are still to come.
    waiting: Option<(Time, usize)>,
    ticks: u64,
    ticks_per_sample: u64,
    samples_per_interval: usize,
}

impl TurningMotor {
    /// The motor of `scene`, at rest.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn new(scene: &Scene, schedule: &TurnSchedule) -> Result<Self, RunError> {
        let closed_loop = closed_loop::rate(scene, hold(0.0, Time::ZERO))?;
        let turning = TurningRun {
            seed: scene.seed(),
            truth: vec![closed_loop.plant().rotor().angle],
            sensed: vec![closed_loop.plant().own_axis_angle()],
            across_deg: vec![[0.0; 2]],
            anchors: Vec::new(),
            time_s_per_s: f64::INFINITY,
        };
        Ok(Self {
            turning,
            across: AcrossSum::new(closed_loop.plant()),
            closed_loop,
            waiting: None,
            ticks: 0,
            ticks_per_sample: schedule.ticks_per_sample,
            samples_per_interval: schedule.samples_per_interval,
        })
    }

    /// Turns at the rate of a segment until its end.
    pub fn turn(&mut self, segment: &TurnSegment) {
        let (begun, first_tick) = (Instant::now(), self.ticks);
        let end = steps_in(segment.until_s * 1e9, real(controller::TICK_NANOS));
        let now = self.closed_loop.plant().now();
        self.closed_loop.program_mut().follow(hold(segment.rate_deg_s, now));
        while self.ticks < end {
            let moment = self.closed_loop.next_tick();
            self.ticks += 1;
            self.record(&moment);
        }
        let turned_s = 1e-9 * real((self.ticks - first_tick) * controller::TICK_NANOS);
        if turned_s > 0.0 {
            self.turning.time_s_per_s =
                self.turning.time_s_per_s.min(begun.elapsed().as_secs_f64() / turned_s);
        }
    }

    fn record(&mut self, moment: &RateMoment) {
        let now = moment.at;
        self.across.add(moment.tilt, moment.angle);
        if let Some((at, anchor)) = self.waiting
            && now.nanos_since(at) >= SMOOTHER_LAG_MS * 1_000_000
        {
            if let Some(smoothed) = self.closed_loop.program().filter().smoothed(at) {
                self.turning.set_anchor(anchor, &smoothed);
            }
            self.waiting = None;
        }
        if !self.ticks.is_multiple_of(self.ticks_per_sample) {
            return;
        }
        let turning = &mut self.turning;
        turning.truth.push(moment.angle);
        turning.sensed.push(moment.own_axis_angle);
        turning.across_deg.push(self.across.sum_rad.map(f64::to_degrees));
        let sample = turning.truth.len() - 1;
        let report = &moment.report;
        let usable = report.estimate.filter(|_| !matches!(report.health, Health::Unusable(_)));
        if let (Some(estimate), true) = (usable, sample.is_multiple_of(self.samples_per_interval)) {
            let place = turning.anchors.len();
            self.waiting = Some((now, place));
            let (angle, health) = (Angle::ZERO, report.health);
            turning.anchors.push(Anchor { sample, angle, variance_deg2: 0.0, error_mdeg: 0.0, health });
            turning.set_anchor(place, &estimate);
        }
    }
}

/// A rate that is held from `now` on.
fn hold(rate_deg_s: f64, now: Time) -> RateHold {
    #[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
    let profile = Profile::Dwell { rate_rad_s: rate_deg_s.to_radians() as f32 };
    RateHold::new(profile, RateTuning::steady(), now)
}

/// The sum of the rotor's turns about the two axes across its own, tick by tick.
struct AcrossSum {
    slope: [f64; 2],
    angle: Angle,
    sum_rad: [f64; 2],
}

impl AcrossSum {
    fn new(plant: &Plant) -> Self {
        let rotor = plant.rotor();
        Self { slope: rotor.pose.slope, angle: rotor.angle, sum_rad: [0.0; 2] }
    }

    /// The end of a tick. A rotor that does not tilt stays level.
    fn add(&mut self, tilt: Option<RotorTilt>, angle: Angle) {
        let slope = tilt.map_or([0.0; 2], |tilt| tilt.pose.slope);
        let half_rad: f64 = 0.5 * angle.radians_since::<f64>(self.angle);
        let middle_rad = self.angle.radians_since::<f64>(Angle::ZERO) + half_rad;
        let turn = turn_across(self.slope, slope, middle_rad);
        self.sum_rad = [0, 1].map(|axis| self.sum_rad[axis] + turn[axis]);
        (self.slope, self.angle) = (slope, angle);
    }
}

impl TurningRun {
    /// Runs the motor of `scene` through the schedule in closed loop.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn run(scene: &Scene, schedule: &TurnSchedule) -> Result<Self, RunError> {
        let mut motor = TurningMotor::new(scene, schedule)?;
        for segment in &schedule.segments {
            motor.turn(segment);
        }
        Ok(motor.turning)
    }

    /// The turns of the rotor from sample to sample of a gyroscope.
    pub fn turns(&self) -> impl Iterator<Item = BodyTurn> {
        let own_axis = self.sensed.windows(2).map(|pair| pair[1].minus(pair[0]).degrees());
        let across = self.across_deg.windows(2).map(|pair| [0, 1].map(|axis| pair[1][axis] - pair[0][axis]));
        own_axis.zip(across).map(|(own_axis_deg, across_deg)| BodyTurn { own_axis_deg, across_deg })
    }

    /// Refuses a run that cannot tell a scale factor.
    ///
    /// # Errors
    /// When there are no two angles of the reference, or the rotor has not turned between them.
    pub fn check(&self) -> Result<(), SceneError> {
        let refused = |conflict: String, hint: &str| SceneError::Conflict { conflict, hint: hint.to_owned() };
        if self.anchors.len() < 2 {
            return Err(refused(
                "this run has no reference: the filter had no estimate that may be used".to_owned(),
                "check that the camera delivers frames of its mark",
            ));
        }
        let turns = self.anchors.windows(2).map(|pair| pair[1].angle.minus(pair[0].angle).degrees().abs());
        let turned_deg: f64 = turns.sum();
        if turned_deg < LEAST_TURN_DEG {
            return Err(refused(
                format!(
                    "the rotor turned by {turned_deg:.4} degrees in all, by the reference: a scale factor needs turns"
                ),
                "check that the drive turns the rotor, with `host-sim rate`",
            ));
        }
        Ok(())
    }

    /// Sets the angle of an anchor from an estimate.
    fn set_anchor(&mut self, anchor: usize, estimate: &Estimate<f32>) {
        let Some(anchor) = self.anchors.get_mut(anchor) else { return };
        let Some(truth) = self.truth.get(anchor.sample) else { return };
        anchor.angle = estimate.angle;
        let deg_per_rad = 1_f64.to_degrees();
        anchor.variance_deg2 = f64::from(estimate.angle_rad2) * deg_per_rad * deg_per_rad;
        anchor.error_mdeg = 1e3 * estimate.angle.minus(*truth).degrees();
    }

    /// Errors of the reference beside what the filter states.
    pub fn reference_stated(&self) -> StatedErrors {
        let mut counts = StatedErrorCounts::default();
        for anchor in &self.anchors {
            let error_deg = 1e-3 * anchor.error_mdeg;
            let normalised = error_deg * error_deg / anchor.variance_deg2;
            counts.add_error(anchor.error_mdeg, normalised, anchor.health);
        }
        counts.figures()
    }

    /// Root mean square error of the reference in milli-degrees.
    pub fn reference_rms_mdeg(&self) -> f64 {
        root_mean_square(self.anchors.iter().map(|anchor| anchor.error_mdeg))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run whose reference has these angles in degrees.
    fn turned(angles_deg: &[f64]) -> Result<(), String> {
        let anchor = |angle_deg: &f64| Anchor {
            sample: 0,
            angle: Angle::from_degrees(*angle_deg),
            variance_deg2: 1e-6,
            error_mdeg: 0.0,
            health: Health::Good,
        };
        let run = TurningRun {
            seed: 1,
            truth: Vec::new(),
            sensed: Vec::new(),
            across_deg: Vec::new(),
            anchors: angles_deg.iter().map(anchor).collect(),
            time_s_per_s: 1.0,
        };
        run.check().map_err(|refused| refused.one_line())
    }

    #[test]
    fn exact_a_run_without_reference_or_turn_is_refused() {
        assert!(turned(&[1.0]).unwrap_err().contains("the filter had no estimate that may be used"));
        assert!(
            turned(&[0.0, 0.002, -0.001]).unwrap_err().contains("the rotor turned by 0.0050 degrees in all")
        );
        assert_eq!(turned(&[0.0, 10.0, 0.0]), Ok(()));
    }
}
