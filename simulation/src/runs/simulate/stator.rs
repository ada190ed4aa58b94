//! The driven stator without a rotor: amplitudes after settling, beside those of the closed form.
//!
//! At resonance a mode's steady amplitude is `k A_n`: `k` is the amplitude of the drive, and `A_n` follows from the
//! tooth amplitude of Table 1 ([`Mode::all`]). A pair of teeth moves by `k A_n |phi_n|` ([`motor_model::ToothPair`]).
//! At any instant of steady motion the amplitude is `sqrt(g^2 + (g' / w)^2)`. Mode A is not driven and stays at rest.

use std::fmt;

use motor_model::{DriveMode, DriveTuning, Mode, Parameter, Stator, StatorState, math};
use serde::Serialize;

use super::OpenLoopRun;
use super::report::drive_name;
use crate::math::statistics::{Accumulator, Spread};
use crate::runs::RunError;
use crate::scene::SceneError;

/// The amplitude of a mode or of a pair of teeth: over the samples after settling, and in closed form.
#[derive(Clone, Debug, Serialize)]
struct SteadyAmplitude {
    of: &'static str,
    simulated_m: Spread,
    closed_form_m: f64,
}

/// The result of a run of the stator with the settings that made it; JSON by its field names.
#[derive(Clone, Debug, Serialize)]
pub struct StatorReport {
    model: &'static str,
    drive: &'static str,
    amplitude: f32,
    duration_s: f64,
    settle_s: f64,
    step_s: f64,
    amplitudes: Vec<SteadyAmplitude>,
    steps: u64,
    wall_s: f64,
}

/// Runs the stator of `run` from rest, in `f64`.
///
/// # Errors
/// When the run's settings do not go together, or the driven mode has no damping: it has no steady amplitude then.
pub fn simulate_stator(run: &OpenLoopRun) -> Result<StatorReport, RunError> {
    let counts = run.step_counts()?;
    refuse_undamped(run)?;
    let stator = Stator::<f64>::try_new(&run.params, DriveTuning::Resonant, run.step_s)?;
    let modes = Mode::all(&run.params)?;
    // Without a drive nothing moves, and either mode will do.
    let driven = if run.drive.mode() == Some(DriveMode::B) { 1 } else { 2 };
    let [_, b_rad_s, c_rad_s] = modes.map(|mode| mode.natural_rad_s);
    let tooth_rad_s = modes[driven].natural_rad_s;
    let mut state = StatorState::default();
    let mut simulated: [Accumulator; 4] = Default::default();
    for step in 1..=counts.steps {
        stator.step(&mut state, run.drive);
        if step > counts.settle_steps && step.is_multiple_of(counts.sample_steps) {
            let (g, v) = (&state.modes.displacement_m, &state.modes.velocity_m_s);
            let pairs = stator.teeth();
            let [p, q] = pairs
                .each_ref()
                .map(|pair| (pair.height(&state.modes), pair.vertical_velocity(&state.modes)));
            let motions = [
                (g.y, v.y / b_rad_s),
                (g.z, v.z / c_rad_s),
                (p.0, p.1 / tooth_rad_s),
                (q.0, q.1 / tooth_rad_s),
            ];
            for (amplitude, (sin, cos)) in simulated.iter_mut().zip(motions) {
                amplitude.add(math::sqrt(sin * sin + cos * cos));
            }
        }
    }
    let antinode_m = f64::from(run.drive.amplitude()) * modes[driven].antinode_amplitude_m;
    let [p, q] = stator.teeth().map(|pair| pair.shape[driven].abs());
    let (b, c) = if driven == 1 { (1.0, 0.0) } else { (0.0, 1.0) };
    let amplitudes =
        [("mode B", b), ("mode C", c), ("teeth 0", p), ("teeth 1", q)].into_iter().zip(simulated);
    let steady = |((of, share), simulated): ((_, f64), Accumulator)| SteadyAmplitude {
        of,
        simulated_m: simulated.spread(),
        closed_form_m: antinode_m * share,
    };
    Ok(StatorReport {
        model: "stator",
        drive: drive_name(run.drive),
        amplitude: run.drive.amplitude(),
        duration_s: run.duration_s,
        settle_s: run.settle_s,
        step_s: run.step_s,
        amplitudes: amplitudes.map(steady).collect(),
        steps: counts.steps,
        wall_s: 0.0,
    })
}

/// Refuses a drive of a mode without damping.
fn refuse_undamped(run: &OpenLoopRun) -> Result<(), RunError> {
    let damping = match run.drive.mode() {
        Some(DriveMode::B) => Parameter::ModeBDampingRatio,
        Some(DriveMode::C) => Parameter::ModeCDampingRatio,
        None => return Ok(()),
    };
    if run.params.get(damping) > 0.0 {
        return Ok(());
    }
    let conflict = format!("{} = 0: the driven stator has no steady amplitude", damping.spec().key);
    Err(SceneError::Conflict { conflict, hint: "a damping ratio above 0, or simulate.drive=off".to_owned() }
        .into())
}

impl StatorReport {
    /// The same of a run that took `wall_s` on this machine.
    #[must_use]
    pub fn timed(self, wall_s: f64) -> Self {
        Self { wall_s, ..self }
    }
}

impl fmt::Display for StatorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { drive, amplitude, duration_s, settle_s, step_s, steps, wall_s, .. } = self;
        writeln!(f, "stator without a rotor, drive {drive} at resonance, amplitude {amplitude}")?;
        writeln!(f, "{duration_s} s in steps of {:.4} us, {settle_s} s to settle\n", 1e6 * step_s)?;
        for SteadyAmplitude { of, simulated_m: Spread { mean, sd }, closed_form_m } in &self.amplitudes {
            let [mean, sd, closed_form] = [mean, sd, closed_form_m].map(|metres| 1e6 * metres);
            writeln!(f, "{of:8} {mean:8.4} +- {sd:.4} um; closed form from Table 1: {closed_form:.4} um")?;
        }
        let nanoseconds = 1e9 * wall_s * step_s / duration_s;
        writeln!(f, "\n{steps} steps in {wall_s:.3} s: {nanoseconds:.1} ns a step")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn exact_a_drive_of_a_mode_without_damping_is_refused() {
        let run = |drive: &str| {
            let drive = format!("simulate.drive={drive}");
            let sets =
                [drive, "motor.mode_b.damping_ratio=0".to_owned(), "simulate.duration_s=0.6".to_owned()];
            simulate_stator(&OpenLoopRun::from_scene(&Scene::of_sets(&sets).unwrap()).unwrap())
        };
        let refused = run("b").unwrap_err().to_string();
        assert!(refused.contains("motor.mode_b.damping_ratio = 0"), "{refused}");
        assert!(run("c").is_ok() && run("off").is_ok());
    }
}
