//! The steps of an open-loop run, in either precision, with an observer.

use motor_model::{DriveCommand, Real};

use super::stepped_motor::{FastContacts, HeightOnlyMotor, SteppedMotor, TiltingSteppedMotor};
use super::tilt_statistics::{TiltSummary, TiltSums};
use super::{OpenLoopRun, Precision, StepCounts, steps_in};
use crate::math::spectrum::{LIMIT_HZ, SpectralLine, Tail};
use crate::math::statistics::{Accumulator, Spread};
use crate::runs::RunError;
use crate::scene::RotorModel;
use crate::world::pose::Pose;

/// An impact counts when tooth and rotor approach faster than this. The number of slower ones, by chattering, depends
/// on the step.
pub const FAST_APPROACH_M_S: f64 = 1e-3;

/// The motion of a motor at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorSample {
    /// Simulated time.
    pub time_s: f64,
    /// Height of the rotor over the teeth at rest.
    pub height_m: f64,
    /// Vertical velocity of the rotor.
    pub velocity_m_s: f64,
    /// Angle turned.
    pub angle_deg: f64,
    /// Angular rate.
    pub rate_rad_s: f64,
    /// Heights of both pairs of teeth, or of the first two of four teeth.
    pub tooth_heights_m: [f64; 2],
    /// Shift of the rotor's mass centre, and tilt; `None` of a rotor that has neither.
    pub pose: Option<Pose>,
    /// The drive in force.
    pub drive: DriveCommand,
}

/// Observes a run.
pub trait Observer {
    /// Time between its samples, rounded to whole steps; `None` for no samples.
    fn interval_s(&self) -> Option<f64>;

    /// Takes a sample: the first at the start, the last not after the end.
    ///
    /// # Errors
    /// When it cannot go on; the run then stops with that error.
    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError>;
}

/// Observes nothing.
impl Observer for () {
    fn interval_s(&self) -> Option<f64> {
        None
    }

    fn observe(&mut self, _: &MotorSample) -> Result<(), RunError> {
        Ok(())
    }
}

/// Observes nothing for `None`.
impl<O: Observer> Observer for Option<O> {
    fn interval_s(&self) -> Option<f64> {
        self.as_ref().and_then(O::interval_s)
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        self.as_mut().map_or(Ok(()), |observer| observer.observe(sample))
    }
}

/// Two observers of one run with the same interval, either of which may want no samples.
impl<A: Observer, B: Observer> Observer for (A, B) {
    fn interval_s(&self) -> Option<f64> {
        self.0.interval_s().or(self.1.interval_s())
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        self.0.observe(sample)?;
        self.1.observe(sample)
    }
}

/// The statistics of a run, from the end of settling to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLoopSummary {
    /// Rate of the rotor, over samples at [`crate::math::spectrum::SAMPLE_RATE_HZ`].
    pub rate_rad_s: Spread,
    /// Largest line of the vertical velocity below [`LIMIT_HZ`]; `None` when no impact counted.
    pub collision: Option<SpectralLine>,
    /// Impacts that approached faster than [`FAST_APPROACH_M_S`], per second.
    pub impacts_per_s: f64,
    /// Angle turned since the start.
    pub angle_deg: f64,
    /// Steps taken.
    pub steps: u64,
    /// Samples in the spectrum.
    pub spectrum_samples: usize,
    /// Samples per second of rate and spectrum.
    pub sample_rate_hz: f64,
    /// Tilt, shift and hub; `None` of a rotor that has none.
    pub tilt: Option<TiltSummary>,
}

/// Runs `run` from rest, observed by `observer`.
///
/// # Errors
/// When the run's settings do not go together, a number is not finite, or the observer cannot go on.
pub fn simulate(run: &OpenLoopRun, observer: &mut dyn Observer) -> Result<OpenLoopSummary, RunError> {
    let counts = run.step_counts()?;
    match (run.rotor, run.precision) {
        (RotorModel::HeightOnly, Precision::F32) => {
            simulate_in(HeightOnlyMotor::<f32>::new(run)?, run, &counts, observer)
        }
        (RotorModel::HeightOnly, Precision::F64) => {
            simulate_in(HeightOnlyMotor::<f64>::new(run)?, run, &counts, observer)
        }
        (RotorModel::Tilting(_), Precision::F32) => {
            simulate_in(TiltingSteppedMotor::<f32>::new(run)?, run, &counts, observer)
        }
        (RotorModel::Tilting(_), Precision::F64) => {
            simulate_in(TiltingSteppedMotor::<f64>::new(run)?, run, &counts, observer)
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "step counts stay below 2^53")]
fn simulate_in<T: Real>(
    mut motor: impl SteppedMotor<T>,
    run: &OpenLoopRun,
    counts: &StepCounts,
    observer: &mut dyn Observer,
) -> Result<OpenLoopSummary, RunError> {
    let sample_rate_hz = run.sample_rate_hz(counts);
    let observer_steps = observer.interval_s().map(|interval_s| steps_in(interval_s, run.step_s).max(1));

    let mut rate = Accumulator::default();
    let mut velocity = Tail::default();
    let mut tilt = TiltSums::default();
    let mut fast = FastContacts::default();
    let mut fast_settled = FastContacts::default();
    if observer_steps.is_some() {
        observer.observe(&motor.sample(run.drive))?;
    }
    while motor.steps() < counts.steps {
        let steps = motor.steps();
        let settling_ends = if steps < counts.settle_steps { counts.settle_steps } else { u64::MAX };
        let stop = next_multiple(steps, counts.sample_steps)
            .min(observer_steps.map_or(u64::MAX, |interval| next_multiple(steps, interval)))
            .min(settling_ends)
            .min(counts.steps);
        while motor.steps() < stop {
            let FastContacts { teeth, hub } = motor.step(run.drive);
            fast.teeth += teeth;
            fast.hub += hub;
        }
        if stop == counts.settle_steps {
            fast_settled = fast;
        }
        if stop.is_multiple_of(counts.sample_steps) {
            let sample = motor.sample(run.drive);
            let time_s = stop as f64 * run.step_s;
            for (quantity, value) in
                [("the rotor's rate", sample.rate_rad_s), ("the rotor's velocity", sample.velocity_m_s)]
            {
                if !value.is_finite() {
                    return Err(RunError::Diverged { quantity, time_s });
                }
            }
            if stop > counts.settle_steps {
                rate.add(sample.rate_rad_s);
                velocity.push(sample.velocity_m_s);
                tilt.add(&sample);
            }
        }
        if observer_steps.is_some_and(|interval| stop.is_multiple_of(interval)) {
            observer.observe(&motor.sample(run.drive))?;
        }
    }

    let counted = fast.teeth - fast_settled.teeth;
    let settled_s = (counts.steps - counts.settle_steps) as f64 * run.step_s;
    let largest = || velocity.spectrum(sample_rate_hz).largest_below(LIMIT_HZ);
    let hub_per_s = (fast.hub - fast_settled.hub) as f64 / settled_s;
    Ok(OpenLoopSummary {
        rate_rad_s: rate.spread(),
        collision: if counted > 0 { largest() } else { None },
        impacts_per_s: counted as f64 / settled_s,
        angle_deg: motor.rotor().angle.angle().degrees(),
        steps: motor.steps(),
        spectrum_samples: velocity.len(),
        sample_rate_hz,
        tilt: tilt.summary(sample_rate_hz, hub_per_s, counted > 0),
    })
}

/// The first multiple of `interval` after `step`.
fn next_multiple(step: u64, interval: u64) -> u64 {
    (step / interval + 1) * interval
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn run_of(sets: &[(&str, &str)]) -> OpenLoopRun {
        let mut scene = Scene::default();
        for (key, value) in [("simulate.duration_s", "0.3"), ("simulate.settle_s", "0.1")].iter().chain(sets)
        {
            scene.set(key, value).unwrap();
        }
        OpenLoopRun::from_scene(&scene).unwrap()
    }

    /// Keeps all samples.
    struct Keep(f64, Vec<MotorSample>);

    impl Observer for Keep {
        fn interval_s(&self) -> Option<f64> {
            Some(self.0)
        }
        fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
            self.1.push(*sample);
            Ok(())
        }
    }

    #[test]
    fn law_an_observer_changes_nothing_and_the_seed_does() {
        let run = run_of(&[]);
        let mut keep = Keep(7e-6, Vec::new());
        let unseen = simulate(&run, &mut ()).unwrap();
        assert_eq!(unseen, simulate(&run, &mut keep).unwrap());
        assert_ne!(unseen, simulate(&OpenLoopRun { seed: 2, ..run }, &mut ()).unwrap());
        // 0.3 s / 7 us = 42857.1, and the start.
        assert_eq!(keep.1.len(), 42_858);
        assert!((keep.1[3].time_s - 21e-6).abs() < 1e-15);
    }

    /// The summary against the same figures as plain sums of an observer's samples.
    #[test]
    fn dual_summary_is_that_of_the_samples() {
        let run = run_of(&[("simulate.drive", "b")]);
        let mut keep = Keep(50e-6, Vec::new());
        let summary = simulate(&run, &mut keep).unwrap();
        let settled: Vec<&MotorSample> = keep.1.iter().filter(|sample| sample.time_s > 0.1 + 1e-9).collect();
        assert_eq!((summary.spectrum_samples, settled.len()), (4000, 4000));
        let mean = settled.iter().map(|sample| sample.rate_rad_s).sum::<f64>() / 4000.0;
        assert!((summary.rate_rad_s.mean - mean).abs() < 1e-12 * mean.abs());
        assert!(mean > 1.0, "mode B turns clockwise");
        let turned_deg = keep.1.last().unwrap().angle_deg;
        assert!((summary.angle_deg - turned_deg).abs() < 1e-12);
    }

    #[test]
    fn law_nothing_collides_and_nothing_turns_without_drive() {
        // A rotor at rest falls onto the teeth in each step. Friction at that impulse, mu g dt m_r R_t / J, bounds its
        // turn.
        let one_step_rad_s = 0.4 * 9.81 * 1e-6 * 46e-6 * 3.063e-3 / 4.59e-10;
        for precision in ["f32", "f64"] {
            let run = run_of(&[("simulate.drive", "off"), ("simulate.precision", precision)]);
            let summary = simulate(&run, &mut ()).unwrap();
            assert_eq!(summary.collision, None);
            assert!(summary.impacts_per_s.abs() <= 0.0);
            assert!(summary.rate_rad_s.mean.abs() + summary.rate_rad_s.sd < one_step_rad_s);
            assert!(summary.angle_deg.abs() < 1e-3);
        }
    }

    #[test]
    fn law_f32_and_f64_agree_on_the_rate() {
        let rate = |precision| {
            let run = run_of(&[("simulate.precision", precision), ("simulate.duration_s", "1")]);
            simulate(&run, &mut ()).unwrap().rate_rad_s
        };
        let (single, double) = (rate("f32"), rate("f64"));
        // Chaotic motions of the same law: their means agree within their spreads.
        assert!((single.mean - double.mean).abs() < single.sd + double.sd);
    }
}
