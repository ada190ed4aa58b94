//! SciPy's `solve_ivp` with events, in a Python process.

use std::io::Write as _;
use std::process::{Command, Stdio};

use serde::Deserialize;
use serde_json::{Value, json};

use super::super::step_cost::StepCost;
use super::super::vibrating_plate::{
    ABSOLUTE_TOLERANCE, CAPTURE_M_S, CLEARANCE_M, FIRST_BEFORE_S, RELATIVE_TOLERANCE, START_M,
    VibratingPlate, start_heights_m,
};
use super::{PEER_STEP_S, PeerRow};

const SCRIPT: &str = include_str!("scipy.py");
const METHODS: [&str; 2] = ["LSODA", "RK45"];
/// The second is the Python of the system's packages, for a path on which another Python comes first.
const PYTHONS: [&str; 2] = ["python3", "/usr/bin/python3"];
const MISSING: &str = "not measured: python3 with SciPy not found (apt install python3-scipy)";

/// The script's result for one method.
#[derive(Deserialize)]
struct MethodResult {
    method: String,
    taken_s: f64,
    impacts: usize,
    first_impacts_s: Vec<f64>,
}

/// One row for each method, or one row that says what is missing.
pub fn rows(plate: &VibratingPlate, time_s: f64) -> Vec<PeerRow> {
    let problem = json!({
        "plate": plate,
        "methods": METHODS,
        "step_s": PEER_STEP_S,
        "relative_tolerance": RELATIVE_TOLERANCE,
        "absolute_tolerance": ABSOLUTE_TOLERANCE,
        "stick_m_s": CAPTURE_M_S,
        "clear_m": CLEARANCE_M,
        "start_m": START_M,
        "time_s": time_s,
        "starts_m": start_heights_m().collect::<Vec<f64>>(),
        "first_before_s": FIRST_BEFORE_S,
    });
    let Some(python) = PYTHONS.into_iter().find(|python| has_scipy(python)) else {
        return vec![PeerRow::unmeasured("SciPy solve_ivp", MISSING)];
    };
    match results(python, &problem) {
        Ok(results) => results.iter().map(|result| row(plate, time_s, result)).collect(),
        Err(why) => vec![PeerRow::unmeasured("SciPy solve_ivp", &format!("not measured: {why}"))],
    }
}

fn has_scipy(python: &str) -> bool {
    let mut command = Command::new(python);
    command
        .args(["-c", "import scipy.integrate"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn results(python: &str, problem: &Value) -> Result<Vec<MethodResult>, String> {
    let mut command = Command::new(python);
    command.args(["-c", SCRIPT]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| error.to_string())?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(problem.to_string().as_bytes()).map_err(|error| error.to_string())?;
    }
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let message = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(message.lines().last().unwrap_or("the script failed").to_owned());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
}

fn row(plate: &VibratingPlate, simulated_s: f64, result: &MethodResult) -> PeerRow {
    let firsts = result.first_impacts_s.iter().zip(start_heights_m());
    let errors: Vec<f64> = firsts.map(|(time_s, start_m)| time_s - plate.first_impact_s(start_m)).collect();
    let name = format!("SciPy solve_ivp {}", result.method);
    let cost = StepCost::new(PEER_STEP_S, simulated_s, result.taken_s);
    PeerRow::measured(&name, cost, errors, result.impacts)
}
