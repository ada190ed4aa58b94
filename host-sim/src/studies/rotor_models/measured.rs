//! The six figures of the experiment, and the same figures of a run.

use motor_model::DriveMode;
use serde::Serialize;

use crate::studies::paper::published::Quantity;
use crate::studies::paper::runs::RunTime;
use simulation::math::statistics::Spread;
use simulation::runs::RunError;
use simulation::runs::simulate::{OpenLoopRun, TiltSummary, simulate};
use simulation::scene::Scene;

/// The quantities that the experiment measured in each mode.
pub const QUANTITIES: [Quantity; 3] =
    [Quantity::Rate, Quantity::CollisionFrequency, Quantity::CollisionAmplitude];

/// What a run of one rotor showed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeasuredRun {
    /// Mean rate in rad/s in the sense of the mode: clockwise in B, counter-clockwise in C.
    pub rate_rad_s: f64,
    /// Frequency of the largest line of the vertical velocity at the centre, in Hz.
    pub collision_frequency_hz: f64,
    /// Amplitude of that line in mm/s.
    pub collision_amplitude_mm_s: f64,
    /// Amplitude of the largest line of the vertical velocity at a rim point, in mm/s.
    pub rim_amplitude_mm_s: f64,
    /// Root mean square of the tilt in mrad.
    pub tilt_rms_mrad: f64,
    /// Contacts of the hole with the pin that approach faster than 1 mm/s, per second.
    pub hub_contacts_per_s: f64,
    /// Part of the time in which the rotor turns against the sense of its mode.
    pub reversed_share: f64,
}

/// What the experiment measured: a mean, and its standard deviation where the paper prints one.
pub fn experiment(mode: DriveMode, quantity: Quantity) -> (f64, Option<f64>) {
    use crate::studies::paper::published::{CASES, PaperSection};
    let cases = CASES.iter().filter(|case| case.place == PaperSection::Table3 && case.mode == mode);
    let figure = cases.flat_map(|case| case.figures).find(|figure| figure.quantity == quantity);
    figure.and_then(|figure| figure.experiment).map_or((f64::NAN, None), |printed| (printed.mean, printed.sd))
}

/// Within what a simulated figure agrees with the experiment.
///
/// Frequencies and amplitudes: two standard deviations of the experiment. The rates are printed as "about 1" and
/// "about 1.4": a factor of two for the first, 15 % for the second, half a unit of the last digit and the reading.
pub fn agrees(mode: DriveMode, quantity: Quantity, value: f64) -> bool {
    let (mean, sd) = experiment(mode, quantity);
    match (sd, mode) {
        (Some(sd), _) => (value - mean).abs() <= 2.0 * sd,
        (None, DriveMode::B) => (0.5 * mean..=2.0 * mean).contains(&value),
        (None, DriveMode::C) => (value / mean - 1.0).abs() <= 0.15,
    }
}

impl MeasuredRun {
    /// A quantity of the experiment, in its unit.
    pub fn get(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Rate => self.rate_rad_s,
            Quantity::CollisionFrequency => self.collision_frequency_hz,
            Quantity::CollisionAmplitude => self.collision_amplitude_mm_s,
        }
    }
}

/// Mean and spread of a quantity over runs.
pub fn spread(runs: &[MeasuredRun], value: impl Fn(&MeasuredRun) -> f64) -> Spread {
    runs.iter().map(value).collect()
}

/// A mean and its spread over the runs, as a cell of a table.
pub fn cell(runs: &[MeasuredRun], decimals: usize, value: impl Fn(&MeasuredRun) -> f64) -> String {
    let spread = spread(runs, value);
    format!("{:.decimals$} +- {:.decimals$}", spread.mean, spread.sd)
}

/// Runs the rotor of `scene` under its drive amplitude in `mode` with a seed for so much time.
///
/// # Errors
/// When the scene is refused or the run fails.
pub fn measured_run(
    scene: &Scene,
    mode: DriveMode,
    seed: u64,
    time: RunTime,
) -> Result<MeasuredRun, RunError> {
    let mut scene = scene.clone();
    let drive = match mode {
        DriveMode::B => "b",
        DriveMode::C => "c",
    };
    for (key, value) in [
        ("simulate.drive", drive),
        ("simulate.duration_s", &time.duration_s.to_string()),
        ("simulate.settle_s", &time.settle_s.to_string()),
        ("seed", &seed.to_string()),
    ] {
        scene.set(key, value)?;
    }
    let summary = simulate(&OpenLoopRun::from_scene(&scene)?, &mut ())?;
    let sense = match mode {
        DriveMode::B => 1.0,
        DriveMode::C => -1.0,
    };
    let of_tilt = |value: fn(&TiltSummary) -> f64| summary.tilt.as_ref().map_or(0.0, value);
    let collision_amplitude_mm_s = summary.collision.map_or(0.0, |line| 1e3 * line.amplitude);
    Ok(MeasuredRun {
        rate_rad_s: sense * summary.rate_rad_s.mean,
        collision_frequency_hz: summary.collision.map_or(0.0, |line| line.frequency_hz),
        collision_amplitude_mm_s,
        // The rim of a rotor that does not tilt moves as its centre.
        rim_amplitude_mm_s: summary
            .tilt
            .map_or(collision_amplitude_mm_s, |tilt| 1e3 * tilt.rim_amplitude_m_s),
        tilt_rms_mrad: of_tilt(|tilt| tilt.tilt_rms_mrad),
        hub_contacts_per_s: of_tilt(|tilt| tilt.hub_contacts_per_s),
        reversed_share: of_tilt(|tilt| tilt.reversed_share),
    })
}
