//! The report of `host-sim simulate` on a run.

use std::fmt;

use motor_model::{DriveCommand, DriveMode, FrictionLaw, ImpactRule};
use serde::Serialize;

use super::{OpenLoopRun, OpenLoopSummary, TiltSummary};

/// `b`, `c` or `off`.
pub fn drive_name(drive: DriveCommand) -> &'static str {
    match drive.mode() {
        Some(DriveMode::B) => "b",
        Some(DriveMode::C) => "c",
        None => "off",
    }
}

/// The word of a scene for a rule of impacts.
pub fn rule_name(rule: ImpactRule) -> &'static str {
    match rule {
        ImpactRule::EndOfStep => "end_of_step",
        ImpactRule::Located => "located",
    }
}

/// The result of a run with its settings; JSON by its field names.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OpenLoopReport {
    /// `b`, `c` or `off`.
    pub drive: &'static str,
    /// Drive amplitude.
    pub amplitude: f32,
    /// Simulated time.
    pub duration_s: f64,
    /// Time left out of the statistics.
    pub settle_s: f64,
    /// Length of a step.
    pub step_s: f64,
    /// Seed.
    pub seed: u64,
    /// `end_of_step` or `located`.
    pub impacts: &'static str,
    /// `paper` or `coulomb`.
    pub friction: &'static str,
    /// `f32` or `f64`.
    pub precision: &'static str,
    /// Mean rate, clockwise positive.
    pub rotor_rate_mean_rad_s: f64,
    /// Standard deviation of the rate.
    pub rotor_rate_sd_rad_s: f64,
    /// Frequency of the largest line of the vertical velocity below 5 kHz; null without an impact.
    pub collision_frequency_hz: Option<f64>,
    /// Amplitude of that line; 0 without an impact.
    pub collision_amplitude_m_s: f64,
    /// Impacts that approach faster than 1 mm/s.
    pub impacts_per_s: f64,
    /// Angle turned since the start, clockwise positive.
    pub angle_deg: f64,
    /// Samples in the spectrum.
    pub spectrum_samples: usize,
    /// Samples per second of rate and spectrum.
    pub sample_rate_hz: f64,
    /// Tilt, shift and hub; left out of a rotor that has none.
    #[serde(flatten)]
    pub tilt: Option<TiltSummary>,
    /// Steps taken.
    pub steps: u64,
    /// Time that the run took on this machine.
    pub wall_s: f64,
}

impl OpenLoopReport {
    /// The report of `run`, which ended as `summary` and took `wall_s`.
    pub fn new(run: &OpenLoopRun, summary: &OpenLoopSummary, wall_s: f64) -> Self {
        Self {
            drive: drive_name(run.drive),
            amplitude: run.drive.amplitude(),
            duration_s: run.duration_s,
            settle_s: run.settle_s,
            step_s: run.step_s,
            seed: run.seed,
            impacts: rule_name(run.impact_rule),
            friction: match run.friction_law {
                FrictionLaw::Paper => "paper",
                FrictionLaw::Coulomb => "coulomb",
            },
            precision: run.precision.name(),
            rotor_rate_mean_rad_s: summary.rate_rad_s.mean,
            rotor_rate_sd_rad_s: summary.rate_rad_s.sd,
            collision_frequency_hz: summary.collision.map(|line| line.frequency_hz),
            collision_amplitude_m_s: summary.collision.map_or(0.0, |line| line.amplitude),
            impacts_per_s: summary.impacts_per_s,
            angle_deg: summary.angle_deg,
            spectrum_samples: summary.spectrum_samples,
            sample_rate_hz: summary.sample_rate_hz,
            tilt: summary.tilt,
            steps: summary.steps,
            wall_s,
        }
    }
}

impl OpenLoopReport {
    /// The result in words: what is said, and of what.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let (rate, sd) = (self.rotor_rate_mean_rad_s, self.rotor_rate_sd_rad_s);
        let mut lines = vec![
            ("rotor rate", format!("{rate:+.4} +- {sd:.4} rad/s, clockwise positive")),
            ("turned", format!("{:+.3} deg", self.angle_deg)),
        ];
        match self.collision_frequency_hz {
            Some(frequency_hz) => lines.extend([
                ("collision frequency", format!("{frequency_hz:.1} Hz")),
                ("collision amplitude", format!("{:.3} mm/s", 1e3 * self.collision_amplitude_m_s)),
            ]),
            None => lines.push(("collision frequency", "none: nothing collides".to_owned())),
        }
        lines.push(("impacts", format!("{:.1} per s, faster than 1 mm/s", self.impacts_per_s)));
        if let Some(tilt) = &self.tilt {
            let TiltSummary { tilt_rms_mrad, tilt_max_mrad, shift_rms_m, hub_contacts_per_s, .. } = tilt;
            lines.extend([
                ("amplitude at the rim", format!("{:.3} mm/s", 1e3 * tilt.rim_amplitude_m_s)),
                ("tilt", format!("{tilt_rms_mrad:.2} mrad rms, {tilt_max_mrad:.1} at most")),
                ("shift", format!("{:.2} um rms", 1e6 * shift_rms_m)),
                ("hub contacts", format!("{hub_contacts_per_s:.1} per s, faster than 1 mm/s")),
                ("turns backwards", format!("{:.1} % of the time", 100.0 * tilt.reversed_share)),
            ]);
        }
        lines
    }
}

impl fmt::Display for OpenLoopReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { drive, amplitude, duration_s, settle_s, step_s, seed, friction, precision, .. } = self;
        writeln!(f, "drive {drive}, amplitude {amplitude}, {friction} friction, {precision}, seed {seed}")?;
        let impacts =
            if self.impacts == "located" { "where they happen" } else { "at the end of their step" };
        writeln!(
            f,
            "{duration_s} s in steps of {:.4} us, {settle_s} s to settle; impacts {impacts}",
            1e6 * step_s
        )?;
        writeln!(f)?;
        self.lines().iter().try_for_each(|(what, said)| writeln!(f, "{what:<22}{said}"))?;
        writeln!(f)?;
        let nanoseconds = 1e9 * self.wall_s * step_s / duration_s;
        writeln!(f, "{} steps in {:.3} s: {nanoseconds:.1} ns a step", self.steps, self.wall_s)
    }
}
