//! The map from impact to impact, from equal states of steady motion.
//!
//! A sample starts at a random instant of the reference's steady motion at full drive, with nothing in contact. The
//! time of its first impact shows how well a method places an impact. The rotor's velocity and rate just after the
//! second impact show the error of one application of the map. Further impacts are not compared: the motion is chaotic,
//! and trajectories diverge after about four of them.

use motor_model::{AmplitudeVariation, DriveCommand, DriveMode, Motor, Real};
use rand_distr::{Distribution, StandardUniform};
use serde::Serialize;

use super::method::{ImpactRecord, Measurement, start, step_recording};
use super::reference::Reference;
use super::reference::events::{ContactEvent, ContactEventKind, ReferenceObserver};
use super::reference::state::ReferenceState;
use super::reference::system::Segment;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::statistics::{root_mean_square, upper_quantile};
use simulation::runs::RunError;
use simulation::runs::simulate::FAST_APPROACH_M_S;

/// Time of steady motion before the first sample is drawn.
const SETTLE_S: f64 = 0.4;
/// Least and largest time between two draws.
const SPACING_S: (f64, f64) = (2e-3, 8e-3);
/// A start without a second impact in this time is not taken. A model that finds none in this time has missed it.
const LONGEST_S: f64 = 30e-3;
/// Seed of the draws.
const SEED: u64 = 1;

/// A start in flight, and the two impacts that follow it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapSample {
    /// The state to start from.
    pub start: ReferenceState,
    /// The next two impacts of the reference. Their time counts from the start.
    pub impacts: [ImpactRecord; 2],
}

/// Samples of one mode of the drive.
#[derive(Clone, Debug)]
pub struct MapSamples {
    /// Mode driven, at full amplitude.
    pub mode: DriveMode,
    /// The samples.
    pub samples: Vec<MapSample>,
}

/// The errors of a method over the samples of one mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ImpactMapErrors {
    /// Samples in which the model found both impacts.
    #[serde(rename = "flights")]
    pub compared: u32,
    /// Samples in which it did not find them.
    pub missed: u32,
    /// Time of the first impact, root mean square.
    pub first_impact_rms_s: f64,
    /// Time of the first impact, largest.
    pub first_impact_max_s: f64,
    /// Vertical velocity after the second impact, root mean square.
    pub velocity_rms_m_s: f64,
    /// Vertical velocity after the second impact, median of the magnitude.
    pub velocity_median_m_s: f64,
    /// Rate after the second impact, root mean square.
    pub rate_rms_rad_s: f64,
    /// Rate after the second impact, median of the magnitude.
    pub rate_median_rad_s: f64,
}

impl MapSamples {
    /// Draws `count` samples in `mode`.
    ///
    /// # Errors
    /// When the reference stalls.
    pub fn draw(mode: DriveMode, count: usize) -> Result<Self, RunError> {
        let reference = Reference::nominal(&AmplitudeVariation::default())?;
        let drive = DriveCommand::full(mode);
        let mut random = stream(SEED, RandomSource::StartStates);
        let mut state = ReferenceState::default();
        reference.run(&mut state, drive, SETTLE_S, &mut ())?;
        let mut samples = Vec::with_capacity(count);
        while samples.len() < count {
            let part: f64 = StandardUniform.sample(&mut random);
            reference.run(&mut state, drive, SPACING_S.0 + part * (SPACING_S.1 - SPACING_S.0), &mut ())?;
            let mut start = state;
            start.time_s = 0.0;
            if start.contact == [false; 2] {
                let mut next = NextImpacts::default();
                reference.run(&mut start.clone(), drive, LONGEST_S, &mut next)?;
                samples.extend(next.two().map(|impacts| MapSample { start, impacts }));
            }
        }
        Ok(Self { mode, samples })
    }
}

/// Keeps the first impacts of a run of the reference.
#[derive(Default)]
struct NextImpacts {
    impacts: Vec<ImpactRecord>,
    approaches_m_s: Vec<f64>,
    /// Whether the state after the last impact is still to come: the next segment starts with it.
    pending: bool,
}

impl NextImpacts {
    /// The first two impacts, if both are fast and at different times: they are no chattering.
    fn two(&self) -> Option<[ImpactRecord; 2]> {
        let [first, second, ..] = self.impacts[..] else { return None };
        let fast = self.approaches_m_s.iter().take(2).all(|&approach| approach > FAST_APPROACH_M_S);
        (fast && second.time_s - first.time_s > 1e-9).then_some([first, second])
    }
}

impl ReferenceObserver for NextImpacts {
    fn segment(&mut self, start: &ReferenceState, _: &Segment, _: f64) {
        if let (true, Some(last)) = (self.pending, self.impacts.last_mut()) {
            (last.velocity_m_s, last.rate_rad_s) = (start.velocity_m_s, start.rate_rad_s);
            self.pending = false;
        }
    }

    fn event(&mut self, event: &ContactEvent) {
        if let ContactEventKind::Impact { approach_m_s, .. } = event.kind
            && self.impacts.len() < 3
        {
            self.impacts.push(ImpactRecord { time_s: event.time_s, velocity_m_s: 0.0, rate_rad_s: 0.0 });
            self.approaches_m_s.push(approach_m_s);
            self.pending = true;
        }
    }
}

/// Measures the errors of a model over all samples.
pub struct ImpactMapMeasurement<'a> {
    /// The samples.
    pub samples: &'a MapSamples,
    /// The model's step.
    pub step_s: f64,
}

impl Measurement for ImpactMapMeasurement<'_> {
    type Outcome = ImpactMapErrors;

    fn measure<T: Real>(&self, motor: &Motor<T>) -> ImpactMapErrors {
        let mut missed = 0;
        // Magnitudes of the errors of each sample.
        let (mut first_s, mut velocity_m_s, mut rate_rad_s) = (Vec::new(), Vec::new(), Vec::new());
        for sample in &self.samples.samples {
            let [first, second] = &sample.impacts;
            if let [found_first, found_second, ..] = self.impacts(motor, sample)[..] {
                first_s.push((found_first.time_s - first.time_s).abs());
                velocity_m_s.push((found_second.velocity_m_s - second.velocity_m_s).abs());
                rate_rad_s.push((found_second.rate_rad_s - second.rate_rad_s).abs());
            } else {
                missed += 1;
            }
        }
        ImpactMapErrors {
            compared: u32::try_from(first_s.len()).unwrap_or(u32::MAX),
            missed,
            first_impact_rms_s: root_mean_square(first_s.iter().copied()),
            first_impact_max_s: first_s.into_iter().fold(0.0, f64::max),
            velocity_rms_m_s: root_mean_square(velocity_m_s.iter().copied()),
            velocity_median_m_s: median(velocity_m_s),
            rate_rms_rad_s: root_mean_square(rate_rad_s.iter().copied()),
            rate_median_rad_s: median(rate_rad_s),
        }
    }
}

impl ImpactMapMeasurement<'_> {
    /// The model's next impacts.
    fn impacts<T: Real>(&self, motor: &Motor<T>, sample: &MapSample) -> Vec<ImpactRecord> {
        let drive = DriveCommand::full(self.samples.mode);
        let mut state = start(&sample.start);
        let mut found = Vec::new();
        let mut steps = 0_u32;
        let mut time_s = 0.0;
        while found.len() < 2 && time_s < LONGEST_S + sample.impacts[1].time_s {
            steps += 1;
            time_s = f64::from(steps) * self.step_s;
            step_recording(motor, &mut state, drive, |impact| {
                found.push(ImpactRecord { time_s: time_s + impact.time_s, ..impact });
            });
        }
        found
    }
}

/// The value in the middle, the upper one of two; 0 of no value.
fn median(mut values: Vec<f64>) -> f64 {
    upper_quantile(&mut values, 500).unwrap_or(0.0)
}
