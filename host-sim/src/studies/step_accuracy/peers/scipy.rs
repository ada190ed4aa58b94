//! SciPy's `solve_ivp` with events, in a Python of its own.

use std::io::Write as _;
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

use super::super::flights::root_mean_square;
use super::super::plate::{
    ABSOLUTE_TOLERANCE, CLEAR_M, FIRST_BEFORE_S, Plate, RELATIVE_TOLERANCE, START_M, STICK_M_S, starts_m,
};
use super::super::timing::Cost;
use super::{PEER_STEP_S, PeerRow};

const SCRIPT: &str = include_str!("scipy.py");
const METHODS: [&str; 2] = ["LSODA", "RK45"];
/// The second is where the system's packages go, should another Python stand first on the path.
const PYTHONS: [&str; 2] = ["python3", "/usr/bin/python3"];
const MISSING: &str = "not measured: python3 with SciPy not found (apt install python3-scipy)";

/// What the script is told.
#[derive(Serialize)]
struct Problem<'a> {
    plate: &'a Plate,
    methods: [&'static str; 2],
    step_s: f64,
    relative_tolerance: f64,
    absolute_tolerance: f64,
    stick_m_s: f64,
    clear_m: f64,
    start_m: f64,
    time_s: f64,
    starts_m: Vec<f64>,
    first_before_s: f64,
}

/// What it says of a method.
#[derive(Deserialize)]
struct Answer {
    method: String,
    taken_s: f64,
    impacts: usize,
    first_impacts_s: Vec<f64>,
}

/// One row a method, or one that says what is missing.
pub fn rows(plate: &Plate, time_s: f64) -> Vec<PeerRow> {
    let problem = Problem {
        plate,
        methods: METHODS,
        step_s: PEER_STEP_S,
        relative_tolerance: RELATIVE_TOLERANCE,
        absolute_tolerance: ABSOLUTE_TOLERANCE,
        stick_m_s: STICK_M_S,
        clear_m: CLEAR_M,
        start_m: START_M,
        time_s,
        starts_m: starts_m().collect(),
        first_before_s: FIRST_BEFORE_S,
    };
    let Some(python) = PYTHONS.into_iter().find(|python| has_scipy(python)) else {
        return vec![PeerRow::unmeasured("SciPy solve_ivp", MISSING)];
    };
    match answers(python, &problem) {
        Ok(answers) => answers.iter().map(|answer| row(plate, time_s, answer)).collect(),
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

fn answers(python: &str, problem: &Problem<'_>) -> Result<Vec<Answer>, String> {
    let mut command = Command::new(python);
    command.args(["-c", SCRIPT]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| error.to_string())?;
    if let Some(mut stdin) = child.stdin.take() {
        let text = serde_json::to_string(problem).map_err(|error| error.to_string())?;
        stdin.write_all(text.as_bytes()).map_err(|error| error.to_string())?;
    }
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(complaint.lines().last().unwrap_or("the script failed").to_owned());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
}

fn row(plate: &Plate, simulated_s: f64, answer: &Answer) -> PeerRow {
    let firsts = answer.first_impacts_s.iter().zip(starts_m());
    let errors: Vec<f64> = firsts.map(|(time_s, start_m)| time_s - plate.first_impact_s(start_m)).collect();
    PeerRow {
        name: format!("SciPy solve_ivp {}", answer.method),
        step_s: PEER_STEP_S,
        cost: Some(Cost::new(PEER_STEP_S, simulated_s, answer.taken_s)),
        first_impact_rms_s: Some(root_mean_square(&errors)),
        impacts: Some(answer.impacts),
        is_crate: false,
        twin: None,
        note: None,
    }
}
