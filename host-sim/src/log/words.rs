//! What the words of a log mean, as sentences.

use simulation::runs::health_words::sentence_named;

/// A health.
pub(super) fn health_sentence(health: &str) -> String {
    let (level, reason) = health.split_once('(').unwrap_or((health, ""));
    let reason = reason.trim_end_matches(')');
    let because = sentence_named(reason).unwrap_or(reason);
    match level {
        "Good" => "the estimate is good".to_owned(),
        "Waiting" => "there is no estimate: no frame has arrived yet".to_owned(),
        "Degraded" => format!("the estimate is worse than it should be. {because}"),
        "Unusable" => format!("the estimate may not be used. {because}"),
        _ => format!("the health is {health}"),
    }
}

/// Frames that were refused; the largest innovation is `sigmas` of its standard deviation.
pub(super) fn refusal_sentence(verdict: &str, count: u64, sigmas: f64) -> String {
    let frames = if count == 1 { "a frame was".to_owned() } else { format!("{count} frames were") };
    let reason = verdict.trim_start_matches("Rejected(").trim_end_matches(')');
    let because = match reason {
        "Gate" => format!("{sigmas:.1} standard deviations from what the filter predicts"),
        "OutOfHorizon" => "too late, beyond the frames that are kept".to_owned(),
        "Duplicate" => "a frame of the same exposure had come already".to_owned(),
        "Future" => "exposed after the filter's own time: its clock is wrong".to_owned(),
        "Repeated" => "the same code at rest, which says nothing new".to_owned(),
        "Stuck" => "the same code again and again under drive: the camera is stuck".to_owned(),
        other => other.to_owned(),
    };
    format!("{frames} refused: {because}")
}

/// A drive in words, and its least and its largest offset from the design's frequency in Hz.
pub(super) fn drive_sentence(drive: &str, [least_hz, most_hz]: [f32; 2]) -> String {
    let of_design = "Hz from the frequency of the design";
    if least_hz < most_hz {
        format!("{drive}, {least_hz:+} to {most_hz:+} {of_design}")
    } else if least_hz.abs() > 0.0 {
        format!("{drive}, {least_hz:+} {of_design}")
    } else {
        drive.to_owned()
    }
}

/// A phase, and the group of phases that are told as one event.
pub(super) fn phase_sentence(phase: &str) -> (String, &str) {
    let sentence = match phase {
        "None" => "no controller: a recording from elsewhere",
        "Rate" => "the controller holds a rate",
        "Waiting" => "the controller waits for an estimate, drive off",
        "Cruise" => "cruise: the drive is on until the coast remains",
        "Burst" => "bursts",
        "Settling(Rest)" | "Settling(Turning)" => "drive off, until the rotor lies still",
        "Settling(Measuring)" | "Settling(MeasuringUnrested)" => "drive off, measuring the angle",
        // A microcontroller does not tell which of both.
        "Settling" => "drive off, until the rotor lies still and is measured",
        "Brake" => "brake: the other mode is on, since the rotor turns on by itself",
        "Over" => "the rate was held for as long as was asked: drive off",
        "Holding" => "at the target: drive off, measuring on",
        _ => return (stop_sentence(phase), phase),
    };
    let group = if phase == "Burst" || phase.starts_with("Settling") { "bursts" } else { phase };
    (sentence.to_owned(), group)
}

fn stop_sentence(phase: &str) -> String {
    let why = phase.trim_start_matches("Stopped(").trim_end_matches(')');
    let because = match why {
        "Cancelled" => "it was cancelled",
        "TimedOut" => "the deadline passed",
        "Stalled" => "neither mode turns the rotor",
        "ModeInverted" => "the rotor turns against the direction of the mode that drives it",
        "OutOfTravel" => "the target or the rotor is outside the travel allowed",
        "TooManyDrives" => "as many drives as are allowed have brought the rotor no nearer",
        "ModeBLost" => "mode B does not turn the rotor; mode C does",
        "ModeCLost" => "mode C does not turn the rotor; mode B does",
        "KeepsTurning" => "the rotor turns on with the drive off, and the other mode does not stop it",
        "NotMeasurable" => "the angle cannot be measured well enough before the deadline",
        "Stuck" => "the drive does not turn the rotor",
        "WrongWay" => "the rotor turns against the direction asked for",
        "EndOfTravel" => "the rotor would leave the travel",
        "DrivenTooLong" => "the drive was on for as long as is allowed",
        "NoEstimate" => "there was no usable estimate for too long",
        other => other,
    };
    format!("the controller gives up: {because}")
}
