//! Health of an estimate in words: for axes and tables of a report.

use std::collections::BTreeSet;

use estimator::{Health, Reason};

/// In a few words.
pub fn words(health: Health) -> String {
    match health {
        Health::Good => "good".to_owned(),
        Health::Waiting => "waiting".to_owned(),
        Health::Degraded(reason) => format!("degraded: {}", reason_words(reason)),
        Health::Unusable(reason) => format!("unusable: {}", reason_words(reason)),
    }
}

const fn reason_words(reason: Reason) -> &'static str {
    match reason {
        Reason::VibrometerSilent => "vibrometer silent",
        Reason::VibrometerUnfit => "vibrometer too noisy",
        Reason::VibrometerInverted => "vibrometer inverted",
        Reason::VibrometerScale => "vibrometer's scale",
        Reason::VibrometerErratic => "vibrometer erratic",
        Reason::ImpactsUnexplained => "impacts unexplained",
        Reason::CameraSilent => "camera silent",
        Reason::CameraStuck => "camera stuck",
        Reason::NoiseMismatch => "noise mismatch",
        Reason::FramesRefused => "frames refused",
        Reason::ReferenceLost => "reference lost",
        Reason::TurnUnknown => "turn unknown",
        Reason::Uncertain => "uncertain",
    }
}

/// For each health that is not good: its words, and why. Once each.
pub fn why_not_good(healths: impl Iterator<Item = Health>) -> BTreeSet<String> {
    healths.filter_map(|health| Some(format!("{}: {}", capital(&words(health)), why(health)?))).collect()
}

/// Words that begin with a capital.
fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Why, in a sentence; `None` of an estimate that is good.
const fn why(health: Health) -> Option<&'static str> {
    match health {
        Health::Good => None,
        Health::Waiting => Some("No frame had arrived yet: there was no estimate."),
        Health::Degraded(reason) | Health::Unusable(reason) => Some(sentence(reason)),
    }
}

/// Every reason.
const REASONS: [Reason; 13] = [
    Reason::VibrometerSilent,
    Reason::VibrometerUnfit,
    Reason::VibrometerInverted,
    Reason::VibrometerScale,
    Reason::VibrometerErratic,
    Reason::ImpactsUnexplained,
    Reason::CameraSilent,
    Reason::CameraStuck,
    Reason::NoiseMismatch,
    Reason::FramesRefused,
    Reason::ReferenceLost,
    Reason::TurnUnknown,
    Reason::Uncertain,
];

/// The sentence of the reason that a log names so; `None` of a name that no reason has.
pub fn sentence_named(name: &str) -> Option<&'static str> {
    REASONS.iter().find(|reason| format!("{reason:?}") == name).map(|reason| sentence(*reason))
}

const fn sentence(reason: Reason) -> &'static str {
    match reason {
        Reason::VibrometerSilent => "No usable vibrometer sample had arrived for a millisecond.",
        Reason::VibrometerUnfit => "The vibrometer's noise hid the impacts: the camera alone was used.",
        Reason::VibrometerInverted => {
            "The vibrometer showed a rotor pulled down and never pushed up: its sign is wrong."
        }
        Reason::VibrometerScale => {
            "In flight the rotor did not fall as gravity makes it: the vibrometer's scale is wrong."
        }
        Reason::VibrometerErratic => {
            "The vibrometer showed a rotor pulled down, which no impact does: samples were wrong."
        }
        Reason::ImpactsUnexplained => {
            "The twin did not explain the impacts, or the frames contradicted it: the camera was used alone."
        }
        Reason::CameraSilent => "No frame had arrived for two and a half of the usual intervals.",
        Reason::CameraStuck => "The camera repeated one picture: its frames were not used.",
        Reason::NoiseMismatch => "The frames scattered at least twice as much as the camera variance says.",
        Reason::FramesRefused => "The last frames were refused, one after the other.",
        Reason::ReferenceLost => {
            "The frames had jumped as no rotor does: what the angle counted from was not known."
        }
        Reason::TurnUnknown => {
            "The rotor had not been seen for long: the angle was known but for whole turns."
        }
        Reason::Uncertain => {
            "The angle was uncertain: its standard deviation exceeded a thirtieth of a degree."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log has the names of the reasons: each leads to the sentence of its own.
    #[test]
    fn exact_names_of_reasons_lead_to_their_sentences() {
        assert_eq!(sentence_named("CameraStuck"), why(Health::Unusable(Reason::CameraStuck)));
        let sentences: BTreeSet<_> =
            REASONS.iter().map(|reason| sentence_named(&format!("{reason:?}"))).collect();
        assert_eq!(sentences.len(), REASONS.len());
        assert_eq!(sentence_named("Camera"), None);
    }
}
