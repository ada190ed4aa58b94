//! What the report on an open-loop run shows: the course of the angle, the vertical motion for its spectrum, and some
//! milliseconds of the motion up close.

use simulation::math::spectrum::{SAMPLE_RATE_HZ, Spectrum, Tail};
use simulation::runs::RunError;
use simulation::runs::simulate::{MotorSample, Observer, OpenLoopRun, simulate};

/// Points of the course of the angle at most.
const COURSE_MAX: f64 = 600.0;
/// Length of the motion up close: some tens of the mode's periods, and more until it has [`IMPACTS`].
const CLOSE_S: f64 = 4e-3;
/// Impacts up close, where there are so many within [`CLOSE_MAX_S`] after settling.
const IMPACTS: usize = 6;
const CLOSE_MAX_S: f64 = 50e-3;
/// Impacts closer to each other count as one: the rotor meets two teeth.
const APART_S: f64 = 1e-4;
/// The rotor's velocity changes by more than this from sample to sample only at an impact.
const STEP_M_S: f64 = 1e-3;
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

/// The motion of `run` up close, from the first impact after settling on; from the end of settling on where there is no
/// impact. The run is made again as far as that.
///
/// # Errors
/// When the run fails.
pub fn close_up(run: &OpenLoopRun) -> Result<Vec<MotorSample>, RunError> {
    let duration_s = (run.settle_s + CLOSE_MAX_S).min(run.duration_s);
    let interval_s = CLOSE_INTERVAL_S.max(run.step_s);
    // Half an interval earlier: times are rounded.
    let from_s = run.settle_s.min(duration_s - CLOSE_S) - 0.5 * interval_s;
    let mut close = CloseUp { interval_s, from_s, samples: Vec::new() };
    simulate(&OpenLoopRun { duration_s, settle_s: 0.0, ..*run }, &mut close)?;
    Ok(with_impacts(close.samples))
}

/// The part of `samples` from before the first impact until [`CLOSE_S`] later, and at least until [`IMPACTS`] are seen.
fn with_impacts(mut samples: Vec<MotorSample>) -> Vec<MotorSample> {
    let impacts = impacts(&samples);
    let first = impacts.first().map_or(0, |impact| impact - 1);
    samples.drain(..first);
    let Some(start) = samples.first() else { return samples };
    let enough = impacts.get(IMPACTS - 1).or(impacts.last()).map_or(0, |impact| impact + 1 - first);
    let until_s = start.time_s + CLOSE_S;
    let shortest = samples.partition_point(|sample| sample.time_s <= until_s);
    samples.truncate(shortest.max(enough));
    samples
}

/// The places of the samples at the end of an impact.
fn impacts(samples: &[MotorSample]) -> Vec<usize> {
    let mut places = Vec::new();
    let mut last_s = f64::NEG_INFINITY;
    for (place, pair) in samples.windows(2).enumerate() {
        let [before, after] = [&pair[0], &pair[1]];
        if (after.velocity_m_s - before.velocity_m_s).abs() > STEP_M_S {
            if after.time_s - last_s > APART_S {
                places.push(place + 1);
            }
            last_s = after.time_s;
        }
    }
    places
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
        assert!((0.05..0.052).contains(&first.time_s) && last.time_s - first.time_s > 3.99e-3);
        let hits = impacts(&close);
        assert!(hits[0] == 1 && hits.len() >= IMPACTS, "{hits:?}");
        let seen = trace.angles_deg.iter().find(|point| (point.0 - 0.053).abs() < 1e-9).unwrap();
        let same = close.iter().find(|sample| (sample.time_s - 0.053).abs() < 1e-9).unwrap();
        assert!((same.angle_deg - seen.1).abs() < 1e-12);
    }
}
