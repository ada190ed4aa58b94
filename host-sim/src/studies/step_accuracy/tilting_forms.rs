//! What the forms of the rotor cost, and what error each makes by what it leaves out: set F, at full drive.
//!
//! | form | what it leaves out |
//! |---|---|
//! | tilting | nothing |
//! | tilting without shift | shift on the pin, and the friction of its contacts; a stop ends the tilt |
//! | height only | tilt and shift: two pairs of teeth instead of four teeth |
//!
//! There is no event-driven reference with a tilt. All forms are compared with the full one at the finest step, which
//! is a row of its own and shows how well that is known: motion is chaotic, so that statistics are compared, each with
//! two standard errors over independent runs, whose seeds draw the teeth's amplitudes.

use std::time::Instant;

use motor_model::{DriveCommand, DriveMode, Freedom, math};
use rayon::prelude::*;
use serde::Serialize;

use crate::studies::rotor_models::variants::VARIANTS;
use analysis::step_accuracy::step_cost::{StepCost, least_times_s};
use simulation::math::count::real;
use simulation::math::statistics::Spread;
use simulation::runs::RunError;
use simulation::runs::simulate::{OpenLoopRun, OpenLoopSummary, TiltSummary, simulate};
use simulation::scene::RotorModel;

/// The forms, the one that leaves nothing out first.
const FORMS: [RotorModel; 3] =
    [RotorModel::Tilting(Freedom::Full), RotorModel::Tilting(Freedom::WithoutShift), RotorModel::HeightOnly];

/// Both driven modes, with their names in tables.
const MODES: [(DriveMode, &str); 2] = [(DriveMode::B, "B"), (DriveMode::C, "C")];

/// Name of the compared rotor among [`VARIANTS`].
const SET: &str = "set F";

/// Number and length of the runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltingFormsEffort {
    /// Steps that are compared, from fine to coarse; the first is the finest, of the full form alone.
    pub steps_s: &'static [f64],
    /// Runs of each form, step and mode.
    pub seeds: u64,
    /// Time from rest before the statistics, and of them.
    pub settle_s: f64,
    /// See above.
    pub time_s: f64,
    /// Batches that are timed; the least counts.
    pub rounds: u32,
    /// Simulated time of a batch.
    pub timed_s: f64,
}

/// A mean over runs with two standard errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RunMean {
    /// The mean.
    pub mean: f64,
    /// Two standard errors.
    pub half_width: f64,
}

/// A form at a step in a mode.
#[derive(Clone, Debug, Serialize)]
pub struct TiltingFormRow {
    /// The form, as a scene names it.
    pub rotor: &'static str,
    /// The mode.
    pub drive: &'static str,
    /// Length of a step.
    pub step_s: f64,
    /// Mean rate in the sense of the mode: clockwise in B, counter-clockwise in C.
    pub rate_rad_s: RunMean,
    /// Impacts of the teeth faster than 1 mm/s, per second.
    pub impacts_per_s: RunMean,
    /// Root mean square of the tilt; `null` of a rotor that has none.
    pub tilt_rms_mrad: Option<RunMean>,
    /// Contacts of the hub faster than 1 mm/s, per second; `null` of a rotor that has none.
    pub hub_contacts_per_s: Option<RunMean>,
    /// Its cost, of f64 on this machine.
    pub cost: StepCost,
    /// Runs.
    pub runs: u64,
}

/// A form in a mode at a step.
#[derive(Clone, Copy, Debug)]
struct FormCase {
    rotor: RotorModel,
    mode: (DriveMode, &'static str),
    step_s: f64,
}

/// All of them: in each mode the full form at the finest step, then each form at every other step.
fn cases(effort: &TiltingFormsEffort) -> Vec<FormCase> {
    let mut cases = Vec::new();
    for mode in MODES {
        for (place, &step_s) in effort.steps_s.iter().enumerate() {
            let forms = if place == 0 { &FORMS[..1] } else { &FORMS[..] };
            cases.extend(forms.iter().map(|&rotor| FormCase { rotor, mode, step_s }));
        }
    }
    cases
}

/// The rows: costs on one thread, then statistics on all.
///
/// # Errors
/// When a run is refused.
pub fn rows(effort: &TiltingFormsEffort) -> Result<Vec<TiltingFormRow>, RunError> {
    let cases = cases(effort);
    let least = least_times_s(cases.len(), effort.rounds, |index| {
        let run = cases[index].run(1, 0.0, effort.timed_s)?;
        let begun = Instant::now();
        simulate(&run, &mut ())?;
        Ok::<f64, RunError>(begun.elapsed().as_secs_f64())
    })?;
    let row = |(case, taken_s): (&FormCase, &f64)| {
        let runs: Result<Vec<OpenLoopSummary>, RunError> = (1..=effort.seeds)
            .into_par_iter()
            .map(|seed| simulate(&case.run(seed, effort.settle_s, effort.time_s)?, &mut ()))
            .collect();
        Ok(case.row(&runs?, StepCost::new(case.step_s, effort.timed_s, *taken_s)))
    };
    cases.iter().zip(&least).map(row).collect()
}

impl FormCase {
    /// A run of `time_s` after `settle_s`.
    fn run(&self, seed: u64, settle_s: f64, time_s: f64) -> Result<OpenLoopRun, RunError> {
        let set = VARIANTS.iter().find(|variant| variant.name == SET).unwrap_or(&VARIANTS[0]);
        Ok(OpenLoopRun {
            rotor: self.rotor,
            drive: DriveCommand::full(self.mode.0),
            duration_s: settle_s + time_s,
            settle_s,
            step_s: self.step_s,
            seed,
            ..OpenLoopRun::from_scene(&set.scene()?)?
        })
    }

    fn row(&self, runs: &[OpenLoopSummary], cost: StepCost) -> TiltingFormRow {
        let sense = match self.mode.0 {
            DriveMode::B => 1.0,
            DriveMode::C => -1.0,
        };
        let mean = |of: fn(&OpenLoopSummary) -> f64| RunMean::of(runs.iter().map(of));
        let of_tilt = |of: fn(&TiltSummary) -> f64| {
            let values: Option<Vec<f64>> = runs.iter().map(|run| run.tilt.as_ref().map(of)).collect();
            values.map(|values| RunMean::of(values.into_iter()))
        };
        TiltingFormRow {
            rotor: self.rotor.word(),
            drive: self.mode.1,
            step_s: self.step_s,
            rate_rad_s: RunMean::of(runs.iter().map(|run| sense * run.rate_rad_s.mean)),
            impacts_per_s: mean(|run| run.impacts_per_s),
            tilt_rms_mrad: of_tilt(|tilt| tilt.tilt_rms_mrad),
            hub_contacts_per_s: of_tilt(|tilt| tilt.hub_contacts_per_s),
            cost,
            runs: runs.len() as u64,
        }
    }
}

impl RunMean {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let runs = real(values.len());
        let Spread { mean, sd } = values.into_iter().collect();
        Self { mean, half_width: 2.0 * sd / math::sqrt(runs) }
    }

    /// How far this is off `reference`, relative to the latter's magnitude, with two standard errors of both.
    #[must_use]
    pub fn off(&self, reference: &Self) -> Self {
        let magnitude = reference.mean.abs();
        let both = self.half_width * self.half_width + reference.half_width * reference.half_width;
        Self { mean: (self.mean - reference.mean) / magnitude, half_width: math::sqrt(both) / magnitude }
    }
}

/// The row of `rows` with which those of `drive` are compared: the first of its mode.
pub fn reference_of<'a>(rows: &'a [TiltingFormRow], drive: &str) -> Option<&'a TiltingFormRow> {
    rows.iter().find(|row| row.drive == drive)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 and 5 against 1 and 3: means 4 and 2, standard deviations sqrt 2, two standard errors 2 each.
    #[test]
    fn exact_means_and_how_far_they_are_off() {
        let (found, reference) = (RunMean::of([3.0, 5.0].into_iter()), RunMean::of([-1.0, -3.0].into_iter()));
        assert!((found.mean - 4.0).abs() < 1e-12 && (found.half_width - 2.0).abs() < 1e-12, "{found:?}");
        let off = found.off(&reference);
        assert!(
            (off.mean - 3.0).abs() < 1e-12 && (off.half_width - math::sqrt(2.0)).abs() < 1e-12,
            "{off:?}"
        );
    }

    /// The first row of a mode is the full form at the finest step, and no other has that step.
    #[test]
    fn exact_the_reference_is_the_full_form_at_the_finest_step() {
        let effort = TiltingFormsEffort {
            steps_s: &[1e-6, 1e-5],
            seeds: 2,
            settle_s: 0.02,
            time_s: 0.1,
            rounds: 1,
            timed_s: 0.01,
        };
        let rows = rows(&effort).unwrap();
        assert_eq!(rows.len(), 2 * (1 + 3));
        for (_, drive) in MODES {
            let reference = reference_of(&rows, drive).unwrap();
            assert_eq!((reference.rotor, reference.step_s.to_bits()), ("tilting", 1e-6_f64.to_bits()));
            let others: Vec<&TiltingFormRow> =
                rows.iter().filter(|row| row.drive == drive && row.step_s > 2e-6).collect();
            assert_eq!(others.len(), 3);
            for row in others {
                assert_eq!(row.tilt_rms_mrad.is_some(), row.rotor != "height_only", "{row:?}");
                assert!(row.cost.ns_per_step > 0.0 && row.impacts_per_s.mean > 0.0, "{row:?}");
                assert!(row.rate_rad_s.mean > 0.0, "in the sense of the mode: {row:?}");
            }
        }
    }
}
