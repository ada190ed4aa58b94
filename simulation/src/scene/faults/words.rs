//! The words of faults: what can fail, how, and what value belongs to it.

use motor_model::DriveMode;

use super::{CameraFault, DriveFault, FaultKind, MarkFault, VibrometerFault};
use crate::math::plain_number::plain;
use crate::scene::setting::Kind;

/// A word of a fault.
#[derive(Clone, Copy, Debug)]
pub struct FaultWord {
    /// What fails; `mark` is followed by the number of the mark.
    pub thing: &'static str,
    /// How it fails.
    pub what: &'static str,
    /// Another word for it, that of PX4's command `failure`; empty for none.
    pub alias: &'static str,
    /// The value that belongs to it.
    pub value: FaultValue,
    /// What happens, in one line.
    pub meaning: &'static str,
    /// The fault with this value.
    pub(super) kind: fn(FaultArgument) -> FaultKind,
}

/// The value that belongs to a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultValue {
    /// None.
    None,
    /// A number with the unit, the bounds and, where it may be left out, the default of this key.
    Number {
        /// The key.
        key: &'static str,
        /// Whether it may be left out.
        optional: bool,
    },
    /// A mode, b or c; both if it is left out.
    Mode,
}

/// The value that was given.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaultArgument {
    pub number: f64,
    pub mode: Option<DriveMode>,
    pub mark: u8,
}

const fn word(
    thing: &'static str,
    (what, alias): (&'static str, &'static str),
    value: FaultValue,
    meaning: &'static str,
    kind: fn(FaultArgument) -> FaultKind,
) -> FaultWord {
    FaultWord { thing, what, alias, value, meaning, kind }
}

const fn given(key: &'static str) -> FaultValue {
    FaultValue::Number { key, optional: false }
}

const fn optional(key: &'static str) -> FaultValue {
    FaultValue::Number { key, optional: true }
}

/// All words.
pub const WORDS: [FaultWord; 26] = {
    use FaultKind::{Camera, Drift, Drive, Jolt, Mark, Rub, Stuck, Vibrometer};
    use FaultValue::{Mode, None};
    [
        word("camera", ("lost", "off"), None, "no frames", |_| Camera(CameraFault::Lost)),
        word("camera", ("stuck", ""), None, "the last picture again", |_| Camera(CameraFault::Stuck)),
        word("camera", ("zeros", ""), None, "angle zero", |_| Camera(CameraFault::Zeros)),
        word(
            "camera",
            ("offset", "wrong"),
            optional("camera.fault_offset_deg"),
            "another feature, this many degrees further",
            |value| Camera(CameraFault::Offset(value.number)),
        ),
        word(
            "camera",
            ("intermittent", ""),
            given("camera.drop_probability"),
            "each frame is lost with this probability",
            |value| Camera(CameraFault::Intermittent(value.number)),
        ),
        word(
            "camera",
            ("outliers", "garbage"),
            given("camera.outlier_probability"),
            "each frame is an outlier with this probability",
            |value| Camera(CameraFault::Outliers(value.number)),
        ),
        word(
            "camera",
            ("delayed", ""),
            given("camera.latency_s"),
            "frames arrive this much later",
            |value| Camera(CameraFault::Delayed(value.number)),
        ),
        word("mark", ("lost", "off"), None, "the mark is not found", |at| Mark(at.mark, MarkFault::Lost)),
        word("mark", ("stuck", ""), None, "the mark stays where it was in the picture", |at| {
            Mark(at.mark, MarkFault::Stuck)
        }),
        word(
            "mark",
            ("false", "wrong"),
            optional("camera.false_mark_m"),
            "another feature of the rotor, this many metres further round",
            |at| Mark(at.mark, MarkFault::False(at.number)),
        ),
        word("mark", ("exchanged", ""), None, "the mark and its next one are taken for each other", |at| {
            Mark(at.mark, MarkFault::Exchanged)
        }),
        word("ldv", ("lost", "off"), None, "no samples", |_| Vibrometer(VibrometerFault::Lost)),
        word("ldv", ("stuck", ""), None, "the last value again", |_| Vibrometer(VibrometerFault::Stuck)),
        word("ldv", ("zeros", ""), None, "zeros", |_| Vibrometer(VibrometerFault::Zeros)),
        word("ldv", ("inverted", "wrong"), None, "the wrong sign", |_| Vibrometer(VibrometerFault::Inverted)),
        word("ldv", ("not_a_number", "garbage"), None, "no numbers", |_| {
            Vibrometer(VibrometerFault::NotANumber)
        }),
        word(
            "ldv",
            ("intermittent", ""),
            given("ldv.drop_probability"),
            "each sample is lost with this probability",
            |value| Vibrometer(VibrometerFault::Intermittent(value.number)),
        ),
        word(
            "ldv",
            ("outliers", ""),
            given("ldv.outlier_probability"),
            "each sample is an outlier with this probability",
            |value| Vibrometer(VibrometerFault::Outliers(value.number)),
        ),
        word("ldv", ("offset", ""), given("ldv.bias_m_s"), "this much more", |value| {
            Vibrometer(VibrometerFault::Offset(value.number))
        }),
        word(
            "drive",
            ("weak", ""),
            given("fault.drive_gain"),
            "this part of the amplitude reaches the coil",
            |value| Drive(DriveFault::Weak(value.number)),
        ),
        word("drive", ("dead", "off"), Mode, "nothing reaches the coil, of one mode or of both", |value| {
            Drive(DriveFault::Dead(value.mode))
        }),
        word("drive", ("swapped", "wrong"), None, "the coil is driven in the other mode", |_| {
            Drive(DriveFault::Swapped)
        }),
        word(
            "stator",
            ("drift", ""),
            given("fault.drift_percent"),
            "the resonances of modes B and C drift by this, until the end of the time; at once if it has none",
            |value| Drift(value.number),
        ),
        word(
            "rotor",
            ("jolt", ""),
            given("fault.jolt_rad_s"),
            "change of the rotor's rate, at one time",
            |value| Jolt(value.number),
        ),
        word("rotor", ("stuck", ""), None, "the rotor does not turn", |_| Stuck),
        word(
            "hub",
            ("rub", ""),
            given("fault.hub_friction"),
            "the hub rubs with this coefficient of friction; of a rotor that shifts on its pin",
            |value| Rub(value.number),
        ),
    ]
};

/// Thing, word and value of a fault.
pub(super) fn spelled(kind: FaultKind) -> (String, &'static str, Option<String>) {
    let number = |x: f64| Some(plain(x));
    let (thing, what, value) = match kind {
        FaultKind::Mark(mark, fault) => {
            let (what, value) = match fault {
                MarkFault::Lost => ("lost", None),
                MarkFault::Stuck => ("stuck", None),
                MarkFault::False(further_m) => ("false", number(further_m)),
                MarkFault::Exchanged => ("exchanged", None),
            };
            return (format!("mark{mark}"), what, value);
        }
        FaultKind::Camera(CameraFault::Lost) => ("camera", "lost", None),
        FaultKind::Camera(CameraFault::Stuck) => ("camera", "stuck", None),
        FaultKind::Camera(CameraFault::Zeros) => ("camera", "zeros", None),
        FaultKind::Camera(CameraFault::Offset(degrees)) => ("camera", "offset", number(degrees)),
        FaultKind::Camera(CameraFault::Intermittent(part)) => ("camera", "intermittent", number(part)),
        FaultKind::Camera(CameraFault::Outliers(part)) => ("camera", "outliers", number(part)),
        FaultKind::Camera(CameraFault::Delayed(by_s)) => ("camera", "delayed", number(by_s)),
        FaultKind::Vibrometer(VibrometerFault::Lost) => ("ldv", "lost", None),
        FaultKind::Vibrometer(VibrometerFault::Stuck) => ("ldv", "stuck", None),
        FaultKind::Vibrometer(VibrometerFault::Zeros) => ("ldv", "zeros", None),
        FaultKind::Vibrometer(VibrometerFault::Inverted) => ("ldv", "inverted", None),
        FaultKind::Vibrometer(VibrometerFault::NotANumber) => ("ldv", "not_a_number", None),
        FaultKind::Vibrometer(VibrometerFault::Intermittent(part)) => ("ldv", "intermittent", number(part)),
        FaultKind::Vibrometer(VibrometerFault::Outliers(part)) => ("ldv", "outliers", number(part)),
        FaultKind::Vibrometer(VibrometerFault::Offset(by_m_s)) => ("ldv", "offset", number(by_m_s)),
        FaultKind::Drive(DriveFault::Weak(gain)) => ("drive", "weak", number(gain)),
        FaultKind::Drive(DriveFault::Dead(None)) => ("drive", "dead", None),
        FaultKind::Drive(DriveFault::Dead(Some(DriveMode::B))) => ("drive", "dead", Some("b".to_owned())),
        FaultKind::Drive(DriveFault::Dead(Some(DriveMode::C))) => ("drive", "dead", Some("c".to_owned())),
        FaultKind::Drive(DriveFault::Swapped) => ("drive", "swapped", None),
        FaultKind::Drift(percent) => ("stator", "drift", number(percent)),
        FaultKind::Jolt(rad_s) => ("rotor", "jolt", number(rad_s)),
        FaultKind::Stuck => ("rotor", "stuck", None),
        FaultKind::Rub(friction) => ("hub", "rub", number(friction)),
    };
    (thing.to_owned(), what, value)
}

impl FaultWord {
    /// Whether it concerns the hub, which only a rotor that shifts on its pin has.
    #[must_use]
    pub fn needs_a_hub(&self) -> bool {
        self.thing == "hub"
    }

    /// Whether its number is a part or a coefficient, which has no unit.
    #[must_use]
    pub fn has_no_unit(&self) -> bool {
        matches!(self.value, FaultValue::Number { key, .. } if crate::scene::setting::find(key).unit.is_empty())
    }

    /// Whether it happens at one time, and not during some.
    #[must_use]
    pub fn is_instant(&self) -> bool {
        self.thing == "rotor" && self.what == "jolt"
    }

    /// Least and largest number that it takes; `None` if it takes none.
    #[must_use]
    pub fn bounds(&self) -> Option<(f64, f64)> {
        let FaultValue::Number { key, .. } = self.value else { return None };
        match crate::scene::setting::find(key).kind {
            Kind::Number { min, max, .. } => Some((min, max)),
            _ => None,
        }
    }

    /// How it is written.
    #[must_use]
    pub fn pattern(&self) -> String {
        let thing = if self.thing == "mark" { "markN" } else { self.thing };
        let value = match self.value {
            FaultValue::None => String::new(),
            FaultValue::Number { key, optional } => {
                let setting = crate::scene::setting::find(key);
                let unit = match setting.unit {
                    "" => "PART".to_owned(),
                    "%" => "PERCENT".to_owned(),
                    unit => unit.to_uppercase(),
                };
                if optional { format!("[:{unit}]") } else { format!(":{unit}") }
            }
            FaultValue::Mode => "[:b|:c]".to_owned(),
        };
        format!("{thing}:{}{value}", self.what)
    }
}
