//! Why a move was given up, as a sentence, and what to change.

use controller::StopReason;

use super::MoveOutcome;
use crate::scene::Scene;

/// The reason and the hint for a move of `scene` with that outcome.
pub(super) fn sentences(why: StopReason, outcome: &MoveOutcome, scene: &Scene) -> (String, String) {
    let (reason, hint) = match why {
        StopReason::Cancelled => ("the move was cancelled".to_owned(), "nothing"),
        StopReason::TimedOut => timed_out(outcome),
        StopReason::Stalled => (
            "neither mode turns the rotor".to_owned(),
            "check amplifier, coil and drive frequencies; a full amplitude frees a rotor that sticks",
        ),
        StopReason::ModeInverted => (
            "the rotor turns against the direction of the mode that drives it".to_owned(),
            "check which mode is driven at which frequency, or commission the motor",
        ),
        StopReason::OutOfTravel => (
            "the target, or the rotor, is outside the travel allowed".to_owned(),
            "a target within the travel",
        ),
        StopReason::TooManyDrives => (
            "as many drives as are allowed have not reached the target".to_owned(),
            "a wider position.tolerance_deg",
        ),
        StopReason::ModeBLost => (
            "mode B, clockwise, does not turn the rotor; mode C does".to_owned(),
            "check the drive at mode B's frequency; targets counter-clockwise can still be reached",
        ),
        StopReason::ModeCLost => (
            "mode C, counter-clockwise, does not turn the rotor; mode B does".to_owned(),
            "check the drive at mode C's frequency; targets clockwise can still be reached to 0.02 degrees",
        ),
        StopReason::KeepsTurning => (
            "the rotor turns on with the drive off, and the other mode does not stop it".to_owned(),
            "a rotor that friction holds while the drive is off: plant.friction=coulomb",
        ),
        StopReason::NotMeasurable => (
            format!(
                "the angle cannot be measured to {} deg before the deadline with these instruments{}",
                outcome.tolerance_deg,
                needed(scene)
            ),
            "a wider position.tolerance_deg, a later position.deadline_s, or a camera with less noise per frame",
        ),
        StopReason::NoEstimate => no_estimate(outcome),
    };
    (reason, hint.to_owned())
}

/// What measuring would need by the forecast, to be appended.
fn needed(scene: &Scene) -> String {
    match super::forecast(scene) {
        Ok(Ok(forecast)) => format!("; as a rule it takes {:.1} s", forecast.measuring_s),
        Ok(Err(unreachable)) => format!(": {unreachable}"),
        Err(_) => String::new(),
    }
}

fn timed_out(outcome: &MoveOutcome) -> (String, &'static str) {
    let most = outcome.waited_s.iter().max_by(|a, b| a.1.total_cmp(b.1));
    let reason = match most {
        Some((what, seconds)) => {
            format!(
                "the deadline is over; the drive was off for {seconds:.2} s for {}",
                what.replace('_', " ")
            )
        }
        None => "the deadline is over with the drive on".to_owned(),
    };
    (reason, "a later position.deadline_s, or a wider position.tolerance_deg")
}

fn no_estimate(outcome: &MoveOutcome) -> (String, &'static str) {
    let most = outcome
        .health
        .iter()
        .filter(|(health, _)| health.starts_with("Unusable") || health.starts_with("Waiting"))
        .max_by(|a, b| a.1.total_cmp(b.1));
    let health = most.map_or_else(String::new, |(health, _)| format!(": {health}"));
    (
        format!("there is no estimate that may be used{health}"),
        "check that the camera delivers frames of its mark",
    )
}
