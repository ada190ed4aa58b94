//! Steady motion: mean rate, impacts per second and collision frequency, each with its interval.
//!
//! A run starts from rest and settles. Its seed draws the amplitudes of the tooth pairs. Model and reference run with
//! the same seeds, so each seed gives one difference. The mean of the differences is the error. Twice its standard
//! error is the half width of its interval of about 95 %.

use motor_model::{AmplitudeVariation, DriveCommand, DriveMode, Motor, MotorParams, MotorState, Real, math};
use serde::Serialize;

use super::method::{Measurement, StepMethod, fast_impacts};
use super::reference::Reference;
use super::reference::events::{ContactEvent, ContactEventKind, ReferenceObserver};
use super::reference::state::ReferenceState;
use super::reference::system::Segment;
use simulation::math::count::real;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::spectrum::{LIMIT_HZ, SAMPLE_RATE_HZ, SAMPLES_MAX, Spectrum};
use simulation::math::statistics::Spread;
use simulation::runs::RunError;
use simulation::runs::simulate::{FAST_APPROACH_M_S, steps_in};

/// A constant drive under which the motion becomes steady.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveCondition {
    /// Mode driven.
    pub mode: DriveMode,
    /// Amplitude of the drive.
    pub amplitude: f32,
    /// Whether there are impacts. In mode C at 0.3 the rotor stays in sustained contact.
    pub collides: bool,
}

/// Full drive and 0.3 in either mode.
pub const CONDITIONS: [DriveCondition; 4] = [
    DriveCondition { mode: DriveMode::B, amplitude: 1.0, collides: true },
    DriveCondition { mode: DriveMode::C, amplitude: 1.0, collides: true },
    DriveCondition { mode: DriveMode::B, amplitude: 0.3, collides: true },
    DriveCondition { mode: DriveMode::C, amplitude: 0.3, collides: false },
];

/// Number and length of the runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadySchedule {
    /// Runs of a condition.
    pub seeds: u64,
    /// Least number of runs.
    pub seeds_min: u64,
    /// Largest number of steps of all runs of a condition together. So fine steps get fewer runs.
    pub steps_max: f64,
    /// Time from rest before the measurement.
    pub settle_s: f64,
    /// Time of the measurement.
    pub time_s: f64,
}

/// The means over one run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SteadyMeans {
    /// Mean rate.
    pub rate_rad_s: f64,
    /// Impacts faster than 1 mm/s, per second.
    pub impacts_per_s: f64,
    /// Frequency of the largest line of the vertical velocity below 5 kHz.
    pub collision_hz: f64,
}

/// An error relative to the reference, with the half width of its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deviation {
    /// The reference's mean over all of its runs.
    pub converged: f64,
    /// The model's mean less the reference's over the same seeds, relative to the latter's magnitude.
    pub relative: f64,
    /// Two standard errors of that difference, relative to the same magnitude.
    pub half_width: f64,
}

/// The errors of a method under one condition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SteadyErrors {
    /// Number of runs compared.
    pub runs: usize,
    /// Mean rate.
    pub rate: Deviation,
    /// Impacts per second; `null` without impacts.
    pub impacts: Option<Deviation>,
    /// Collision frequency; `null` without impacts.
    pub collision: Option<Deviation>,
}

impl DriveCondition {
    /// The command of the drive.
    pub fn command(self) -> DriveCommand {
        DriveCommand::saturating(self.mode, self.amplitude)
    }

    /// Such as `B` or `C 0.3`.
    pub fn name(self) -> String {
        let full = self.amplitude >= 1.0;
        if full { format!("{:?}", self.mode) } else { format!("{:?} {}", self.mode, self.amplitude) }
    }
}

impl SteadySchedule {
    /// The schedule for `condition`. Motion without impacts is not chaotic, so fewer and shorter runs suffice.
    #[must_use]
    pub fn of(self, condition: DriveCondition) -> Self {
        if condition.collides {
            self
        } else {
            Self {
                seeds: self.seeds.min(8),
                seeds_min: self.seeds_min.min(4),
                settle_s: 0.1,
                time_s: 0.1,
                ..self
            }
        }
    }

    /// Number of runs of a model of this step.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "few runs; a cast saturates")]
    pub fn seeds_at(&self, step_s: f64) -> u64 {
        let steps = (self.settle_s + self.time_s) / step_s;
        ((self.steps_max / steps) as u64).clamp(self.seeds_min, self.seeds)
    }
}

/// The tooth amplitudes that `seed` draws.
fn variation(seed: u64) -> AmplitudeVariation {
    AmplitudeVariation::draw(&MotorParams::nominal(), &mut stream(seed, RandomSource::AmplitudeVariation))
}

/// Mean frequency of the largest line over all full windows of the samples. Samples for less than a window count as
/// one.
fn collision_hz(samples: &[f64], rate_hz: f64) -> f64 {
    let windows = samples.chunks_exact(SAMPLES_MAX.min(samples.len().max(1)));
    let lines = windows.filter_map(|window| {
        let spectrum = Spectrum::of(window.iter().copied(), rate_hz);
        spectrum.largest_below(LIMIT_HZ).map(|line| line.frequency_hz)
    });
    lines.collect::<Spread>().mean
}

/// Measures the means over one run of a model.
struct SteadyMeasurement {
    condition: DriveCondition,
    schedule: SteadySchedule,
    step_s: f64,
}

impl Measurement for SteadyMeasurement {
    type Outcome = SteadyMeans;

    fn measure<T: Real>(&self, motor: &Motor<T>) -> SteadyMeans {
        let Self { condition, schedule, step_s } = *self;
        let command = condition.command();
        let per_sample = steps_in(1.0, SAMPLE_RATE_HZ * step_s).max(1);
        let interval_s = real(per_sample) * step_s;
        let mut state = MotorState::default();
        for _ in 0..steps_in(schedule.settle_s, step_s) {
            motor.step(&mut state, command);
        }
        let origin = state.rotor.angle.angle();
        let (mut fast, mut samples) = (0_u64, Vec::new());
        let count = steps_in(schedule.time_s, interval_s);
        for _ in 0..count {
            for _ in 0..per_sample {
                fast += u64::from(fast_impacts(motor, &mut state, command));
            }
            samples.push(state.rotor.velocity_m_s.to_f64());
        }
        let time_s = real(count) * interval_s;
        SteadyMeans {
            rate_rad_s: state.rotor.angle.angle().radians_since::<f64>(origin) / time_s,
            impacts_per_s: real(fast) / time_s,
            collision_hz: collision_hz(&samples, 1.0 / interval_s),
        }
    }
}

/// Samples the vertical velocity of the reference and counts its fast impacts.
#[derive(Default)]
struct SteadyObserver {
    interval_s: f64,
    next_s: f64,
    samples: Vec<f64>,
    fast: u32,
}

impl ReferenceObserver for SteadyObserver {
    fn segment(&mut self, start: &ReferenceState, segment: &Segment, end: f64) {
        while self.next_s <= start.time_s + segment.duration_s * end {
            let tau = ((self.next_s - start.time_s) / segment.duration_s).max(0.0);
            self.samples.push(segment.at(tau).velocity_m_s);
            self.next_s += self.interval_s;
        }
    }

    fn event(&mut self, event: &ContactEvent) {
        if let ContactEventKind::Impact { approach_m_s, .. } = event.kind {
            self.fast += u32::from(approach_m_s > FAST_APPROACH_M_S);
        }
    }
}

/// The means over one run of the reference.
///
/// # Errors
/// When the reference stalls.
pub fn reference_means(
    condition: DriveCondition,
    schedule: SteadySchedule,
    seed: u64,
) -> Result<SteadyMeans, RunError> {
    let reference = Reference::nominal(&variation(seed))?;
    let command = condition.command();
    let SteadySchedule { settle_s, time_s, .. } = schedule.of(condition);
    let mut state = ReferenceState::default();
    reference.run(&mut state, command, settle_s, &mut ())?;
    let origin_rad = state.angle_rad;
    let interval_s = 1.0 / SAMPLE_RATE_HZ;
    let mut observer =
        SteadyObserver { interval_s, next_s: state.time_s + interval_s, ..SteadyObserver::default() };
    reference.run(&mut state, command, time_s, &mut observer)?;
    Ok(SteadyMeans {
        rate_rad_s: (state.angle_rad - origin_rad) / time_s,
        impacts_per_s: f64::from(observer.fast) / time_s,
        collision_hz: collision_hz(&observer.samples, SAMPLE_RATE_HZ),
    })
}

/// The errors of `method` under `condition`. `reference` holds the reference's means for each seed.
///
/// # Errors
/// When the method's step is out of bounds.
pub fn errors(
    method: &StepMethod,
    condition: DriveCondition,
    schedule: SteadySchedule,
    reference: &[SteadyMeans],
) -> Result<SteadyErrors, RunError> {
    let schedule = schedule.of(condition);
    let run = SteadyMeasurement { condition, schedule, step_s: method.step_s };
    let seeds = 1..=schedule.seeds_at(method.step_s);
    let found: Result<Vec<SteadyMeans>, _> = seeds.map(|seed| method.apply(variation(seed), &run)).collect();
    let found = found?;
    let deviation = |of: fn(&SteadyMeans) -> f64| Deviation::between(&found, reference, of);
    let collisions = |of| condition.collides.then(|| deviation(of));
    Ok(SteadyErrors {
        runs: found.len(),
        rate: deviation(|batch| batch.rate_rad_s),
        impacts: collisions(|batch| batch.impacts_per_s),
        collision: collisions(|batch| batch.collision_hz),
    })
}

impl Deviation {
    /// Compares the runs `found` with the first of the runs `reference`, seed by seed.
    fn between(found: &[SteadyMeans], reference: &[SteadyMeans], of: impl Fn(&SteadyMeans) -> f64) -> Self {
        let all: Spread = reference.iter().map(&of).collect();
        let differences: Spread = found.iter().zip(reference).map(|(a, b)| of(a) - of(b)).collect();
        let magnitude = all.mean.abs();
        Self {
            converged: all.mean,
            relative: differences.mean / magnitude,
            half_width: 2.0 * differences.sd / math::sqrt(real(found.len())) / magnitude,
        }
    }

    /// The larger of the error's magnitude and its half width: no smaller error can be resolved.
    pub fn resolved(&self) -> f64 {
        self.relative.abs().max(self.half_width)
    }
}
