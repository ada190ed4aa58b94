//! Integrators of other crates and of SciPy on the ball on the vibrating plate: what a user could take instead.
//!
//! Each integrates the same problem with the same tolerances. Its largest step is short enough not to step over an
//! impact. The Rust crates come with the feature `peers`. SciPy runs in a Python that has it.

#[cfg(feature = "peers")]
mod differential_equations;
#[cfg(feature = "peers")]
mod diffsol;
mod fixed_step;
#[cfg(feature = "peers")]
mod ode_solvers;
mod scipy;

use serde::Serialize;

use super::method::{StepMethod, step_methods};
use super::step_cost::{StepCost, TimingEffort, least_times_s};
use super::vibrating_plate::{FIRST_BEFORE_S, START_M, VibratingPlate, start_heights_m};
use simulation::math::statistics::root_mean_square;
use simulation::runs::RunError;

/// Largest step of the peers.
pub const PEER_STEP_S: f64 = 5e-6;

/// Note of a build without the Rust peers.
pub const WITHOUT_PEERS: &str =
    "not measured: built without them (cargo run --release --features peers -- accuracy)";

/// An integrator on the ball on the plate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PeerRow {
    /// Name of the integrator.
    pub name: String,
    /// Largest step.
    pub step_s: f64,
    /// Its cost, if it was measured.
    pub cost: Option<StepCost>,
    /// Error of the time of the first impact, root mean square over the heights of [`start_heights_m`].
    pub first_impact_rms_s: Option<f64>,
    /// Number of impacts in the timed run.
    pub impacts: Option<usize>,
    /// Whether it is the integrator of another Rust crate.
    pub is_crate: bool,
    /// The method, if it is the fixed-step model.
    #[serde(rename = "twin")]
    pub method: Option<StepMethod>,
    /// Why it was not measured.
    pub note: Option<String>,
}

/// An integrator: the times of the impacts of a ball that falls from rest at `start_m`, up to `until_s`.
type Integrator = fn(&VibratingPlate, start_m: f64, until_s: f64) -> Result<Vec<f64>, String>;

/// The Rust peers, by name.
#[cfg(feature = "peers")]
const RUST: [(&str, Integrator); 3] = [
    ("diffsol 0.18 tsit45", diffsol::impacts),
    ("differential-equations 0.7 dopri5", differential_equations::impacts),
    ("ode_solvers 0.6 dopri5", ode_solvers::impacts),
];
#[cfg(not(feature = "peers"))]
const RUST: [(&str, Integrator); 0] = [];

/// All integrators on the ball on the plate: first the fixed-step model at `steps_s`, then the others.
///
/// # Errors
/// When the plate's parameters are refused by the model.
pub fn peers(steps_s: &[f64], effort: TimingEffort) -> Result<Vec<PeerRow>, RunError> {
    let plate = VibratingPlate::nominal()?;
    let mut rows = fixed_step_models(&plate, steps_s, effort)?;
    rows.extend(crates(&plate, effort));
    rows.extend(scipy::rows(&plate, effort.plate_s));
    Ok(rows)
}

/// The fixed-step model at every step, by either rule, in either precision.
fn fixed_step_models(
    plate: &VibratingPlate,
    steps_s: &[f64],
    effort: TimingEffort,
) -> Result<Vec<PeerRow>, RunError> {
    let methods = step_methods(steps_s);
    let least = least_times_s(methods.len(), effort.rounds, |index| {
        fixed_step::taken_s(&methods[index], plate, effort.plate_s)
    })?;
    let row = |(method, &taken_s): (&StepMethod, &f64)| {
        let step_s = method.step_s;
        let errors: Result<Vec<f64>, RunError> = start_heights_m()
            .map(|start_m| {
                Ok(plate
                    .first_error_s(&fixed_step::impacts(method, plate, start_m, FIRST_BEFORE_S)?, start_m))
            })
            .collect();
        let impacts = fixed_step::impacts(method, plate, START_M, effort.plate_s)?.len();
        let cost = StepCost::new(step_s, effort.plate_s, taken_s);
        let row = PeerRow::measured(&format!("twin {}", method.name()), cost, errors?, impacts);
        Ok(PeerRow { step_s, method: Some(*method), ..row })
    };
    methods.iter().zip(&least).map(row).collect()
}

/// The Rust crates at [`PEER_STEP_S`].
fn crates(plate: &VibratingPlate, effort: TimingEffort) -> Vec<PeerRow> {
    if RUST.is_empty() {
        return vec![PeerRow::unmeasured("diffsol, differential-equations, ode_solvers", WITHOUT_PEERS)];
    }
    let row = |&(name, integrator): &(&str, Integrator)| {
        let timed = least_times_s(1, effort.rounds, |_| {
            let start = std::time::Instant::now();
            integrator(plate, START_M, effort.plate_s).map(|_| start.elapsed().as_secs_f64())
        });
        let errors: Result<Vec<f64>, String> = start_heights_m()
            .map(|start_m| Ok(plate.first_error_s(&integrator(plate, start_m, FIRST_BEFORE_S)?, start_m)))
            .collect();
        match (timed, errors, integrator(plate, START_M, effort.plate_s)) {
            (Ok(taken_s), Ok(errors), Ok(impacts)) => {
                let cost = StepCost::new(PEER_STEP_S, effort.plate_s, taken_s[0]);
                let row = PeerRow::measured(name, cost, errors, impacts.len());
                PeerRow { is_crate: true, ..row }
            }
            (Err(why), ..) | (_, Err(why), _) | (.., Err(why)) => {
                PeerRow::unmeasured(name, &format!("not measured: {why}"))
            }
        }
    };
    RUST.iter().map(row).collect()
}

impl PeerRow {
    /// An integrator at [`PEER_STEP_S`] with the errors of the first impact and the number of impacts in the timed
    /// run.
    fn measured(name: &str, cost: StepCost, errors_s: Vec<f64>, impacts: usize) -> Self {
        Self {
            cost: Some(cost),
            first_impact_rms_s: Some(root_mean_square(errors_s)),
            impacts: Some(impacts),
            note: None,
            ..Self::unmeasured(name, "")
        }
    }

    fn unmeasured(name: &str, note: &str) -> Self {
        Self {
            name: name.to_owned(),
            step_s: PEER_STEP_S,
            cost: None,
            first_impact_rms_s: None,
            impacts: None,
            is_crate: false,
            method: None,
            note: Some(note.to_owned()),
        }
    }
}

/// The root of `gap` between `low`, where it is positive, and `high`, where it is not: regula falsi, Illinois variant.
#[cfg(feature = "peers")]
fn descent(mut low: f64, mut high: f64, gap: impl Fn(f64) -> f64) -> f64 {
    let (mut at_low, mut at_high) = (gap(low), gap(high));
    if at_low <= 0.0 {
        return low;
    }
    for _ in 0..60 {
        let middle = high - at_high * (high - low) / (at_high - at_low);
        let at_middle = gap(middle);
        if at_middle > 0.0 {
            (low, at_low, at_high) = (middle, at_middle, 0.5 * at_high);
        } else {
            (high, at_high, at_low) = (middle, at_middle, 0.5 * at_low);
        }
        if high - low < 1e-17 || at_middle == 0.0 {
            break;
        }
    }
    high
}

#[cfg(all(test, feature = "peers"))]
mod tests {
    use super::*;

    /// Three crates with two methods find every impact of 50 ms at the same instant. The motion is chaotic: a tolerance
    /// of 1e-9 grows to some nanoseconds by the fourth impact.
    #[test]
    fn dual_crates_agree_on_every_impact() {
        let plate = VibratingPlate::nominal().unwrap();
        let all = RUST.map(|(_, integrator)| integrator(&plate, START_M, 0.05).unwrap());
        assert!(all[0].len() >= 3, "{all:?}");
        for times_s in &all {
            assert_eq!(times_s.len(), all[0].len(), "{all:?}");
            assert!((times_s[0] - plate.first_impact_s(START_M)).abs() < 1e-15, "{all:?}");
            assert!(times_s.iter().zip(&all[0]).all(|(a, b)| (a - b).abs() < 1e-9), "{all:?}");
        }
    }
}
