//! What the report on an open-loop run shows: the course of the angle, the vertical motion for its spectrum, and some
//! milliseconds of the motion up close.

use simulation::math::spectrum::{SAMPLE_RATE_HZ, Spectrum, Tail};
use simulation::runs::RunError;
use simulation::runs::simulate::{MotorSample, Observer, OpenLoopRun, simulate};

/// Points of the course of the angle at most.
const COURSE_MAX: f64 = 600.0;
/// Length of the motion up close: some tens of the mode's periods.
const CLOSE_S: f64 = 4e-3;
/// Least time between its samples: a hundredth of a period.
const CLOSE_INTERVAL_S: f64 = 1e-6;

/// The samples of a run for its report, one every 50 us.
#[derive(Debug)]
pub struct OpenLoopTrace {
    settle_s: f64,
    /// Time between the points of the course.
    apart_s: f64,
    /// Time in s and angle turned in degrees.
    angles_deg: Vec<(f64, f64)>,
    velocity_m_s: Tail,
}

impl OpenLoopTrace {
    /// A trace of `run`.
    pub fn of(run: &OpenLoopRun) -> Self {
        let apart_s = run.duration_s / COURSE_MAX;
        Self { settle_s: run.settle_s, apart_s, angles_deg: Vec::new(), velocity_m_s: Tail::default() }
    }

    /// Mean rates between the points of the course: middle in s, rad/s.
    pub(super) fn rates_rad_s(&self) -> Vec<(f64, f64)> {
        let between = |pair: &[(f64, f64)]| {
            let [(from_s, from_deg), (to_s, to_deg)] = [pair[0], pair[1]];
            (0.5 * (from_s + to_s), (to_deg - from_deg).to_radians() / (to_s - from_s))
        };
        self.angles_deg.windows(2).map(between).collect()
    }

    /// Spectrum of the vertical velocity after settling, as the figures of the run have it.
    pub(super) fn spectrum(&self, sample_rate_hz: f64) -> Spectrum {
        self.velocity_m_s.spectrum(sample_rate_hz)
    }
}

impl Observer for OpenLoopTrace {
    fn interval_s(&self) -> Option<f64> {
        Some(1.0 / SAMPLE_RATE_HZ)
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        if sample.time_s > self.settle_s {
            self.velocity_m_s.push(sample.velocity_m_s);
        }
        if self.angles_deg.last().is_none_or(|last| sample.time_s >= last.0 + self.apart_s) {
            self.angles_deg.push((sample.time_s, sample.angle_deg));
        }
        Ok(())
    }
}

/// Keeps the samples of the motion up close.
struct CloseUp {
    interval_s: f64,
    from_s: f64,
    samples: Vec<MotorSample>,
}

impl Observer for CloseUp {
    fn interval_s(&self) -> Option<f64> {
        Some(self.interval_s)
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        if sample.time_s >= self.from_s {
            self.samples.push(*sample);
        }
        Ok(())
    }
}

/// The motion of `run` up close, from the end of settling on. The run is made again as far as that.
///
/// # Errors
/// When the run fails.
pub fn close_up(run: &OpenLoopRun) -> Result<Vec<MotorSample>, RunError> {
    let duration_s = (run.settle_s + CLOSE_S).min(run.duration_s);
    let interval_s = CLOSE_INTERVAL_S.max(run.step_s);
    // Half an interval earlier: times are rounded.
    let from_s = duration_s - CLOSE_S - 0.5 * interval_s;
    let mut close = CloseUp { interval_s, from_s, samples: Vec::new() };
    simulate(&OpenLoopRun { duration_s, settle_s: 0.0, ..*run }, &mut close)?;
    Ok(close.samples)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::scene::Scene;

    /// The last sample up close is on the way of the whole run, and the course ends at the angle of the run.
    #[test]
    fn exact_the_motion_up_close_is_that_of_the_run() {
        let mut scene = Scene::default();
        for (key, value) in [("simulate.duration_s", "0.1"), ("simulate.settle_s", "0.05")] {
            scene.set(key, value).unwrap();
        }
        let run = OpenLoopRun::from_scene(&scene).unwrap();
        let mut trace = (Some(OpenLoopTrace::of(&run)), ());
        let summary = simulate(&run, &mut trace).unwrap();
        let trace = trace.0.unwrap();
        // 0.05 s of samples, one every 50 us.
        assert_eq!(trace.velocity_m_s.len(), 1000);
        let line = trace.spectrum(summary.sample_rate_hz).largest_below(simulation::math::spectrum::LIMIT_HZ);
        assert_eq!(line, summary.collision);

        let close = close_up(&run).unwrap();
        let (first, last) = (close.first().unwrap(), close.last().unwrap());
        assert!((first.time_s - 0.05).abs() < 1e-9 && (last.time_s - 0.054).abs() < 1e-9);
        let seen = trace.angles_deg.iter().find(|point| (point.0 - 0.052).abs() < 1e-9).unwrap();
        let same = close.iter().find(|sample| (sample.time_s - 0.052).abs() < 1e-9).unwrap();
        assert!((same.angle_deg - seen.1).abs() < 1e-12);
    }
}
