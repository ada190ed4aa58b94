//! Settings and faults of a scene as JSON.

use motor_model::{Parameter, TiltingParameter};
use serde_json::{Value, json};
use simulation::Kind;
use simulation::scene::faults::{FaultValue, WORDS};
use simulation::scene::{Setting, registry};
use wasm_bindgen::prelude::wasm_bindgen;

use crate::columns::{IMPACT, ROW};

/// The true motor's keys begin so; those of the design follow.
const TRUE_MOTOR: &str = "plant.";

fn kind(setting: &Setting) -> Value {
    match setting.kind.resolved() {
        Kind::Number { min, max, default } => json!({ "number": [min, max, default] }),
        // Beyond 2^53 a whole number is no number of JavaScript's: such bounds are text.
        Kind::Integer { min, max, default } => {
            json!({ "integer": [min.to_string(), max.to_string(), default.to_string()] })
        }
        Kind::Choice { of, default } => json!({ "choice": of, "default": default }),
        Kind::Schedule { .. } | Kind::Faults | Kind::As { .. } => Value::Null,
    }
}

/// The part of the page to which a key belongs; `None` of a key that is not on the page.
fn group(key: &str) -> Option<&'static str> {
    let of_motor = key.strip_prefix(TRUE_MOTOR).unwrap_or_default();
    if Parameter::from_key(of_motor).is_some() {
        return Some("table_1");
    }
    if TiltingParameter::from_key(of_motor).is_some() {
        return Some("hub");
    }
    // Faults have words of their own, and a tolerance belongs to many motors.
    let is_fault = ["fault", "lost", "false_mark", "drop", "duplicate", "outlier"];
    if is_fault.iter().any(|word| key.contains(word)) || key.starts_with("plant.tolerance.") {
        return None;
    }
    match key.split('.').next() {
        Some("position") => Some("move"),
        Some("camera") => Some("camera"),
        Some("ldv") => Some("vibrometer"),
        Some("plant") => Some("plant"),
        _ if key == "estimator.filter" => Some("filter"),
        _ if key == "seed" => Some("plant"),
        _ => None,
    }
}

/// Every setting that the page shows, and the columns of rows and impacts.
#[wasm_bindgen]
pub fn settings() -> String {
    let shown = registry().filter_map(|setting| {
        Some(json!({
            "group": group(setting.key)?,
            "key": setting.key,
            "unit": setting.unit,
            "kind": kind(&setting),
            "bounds": setting.kind.bounds_text(),
            "tolerance": setting.tolerance_text(),
            "origin": setting.origin_text(),
            "meaning": setting.meaning,
        }))
    });
    let settings: Vec<Value> = shown.collect();
    json!({ "settings": settings, "row": ROW, "impact": IMPACT }).to_string()
}

/// Every word of a fault, with the value that belongs to it.
#[wasm_bindgen]
pub fn faults() -> String {
    let words = WORDS.iter().map(|word| {
        let value = match word.value {
            FaultValue::None => Value::Null,
            FaultValue::Mode => json!({ "mode": true }),
            FaultValue::Number { key, .. } => {
                let setting = registry().find(|setting| setting.key == key);
                setting.map_or(
                    Value::Null,
                    |setting| json!({ "key": key, "unit": setting.unit, "kind": kind(&setting) }),
                )
            }
        };
        json!({
            "thing": word.thing,
            "what": word.what,
            "meaning": word.meaning,
            "value": value,
            "instant": word.is_instant() || word.thing == "stator",
            "needs_a_hub": word.needs_a_hub(),
        })
    });
    Value::from(words.collect::<Vec<_>>()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every parameter of the true motor is on the page, once, and each setting of it has bounds.
    #[test]
    fn exact_every_parameter_is_shown() {
        let all: Value = serde_json::from_str(&settings()).unwrap();
        let shown = all["settings"].as_array().unwrap();
        for (group, count) in [("table_1", Parameter::ALL.len()), ("hub", TiltingParameter::ALL.len())] {
            let of_group = shown.iter().filter(|setting| setting["group"] == group).count();
            assert_eq!(of_group, count, "{group}");
        }
        for setting in shown {
            assert!(!setting["kind"].is_null() && setting["bounds"] != "", "{setting}");
        }
        let words: Value = serde_json::from_str(&faults()).unwrap();
        assert_eq!(words.as_array().unwrap().len(), WORDS.len());
    }

    /// Keys that other words or other commands set are not shown.
    #[test]
    fn exact_what_is_not_shown() {
        for key in ["faults", "camera.fault", "ldv.lost_from_s", "rate.duration_s", "motor.friction"] {
            assert_eq!(group(key), None, "{key}");
        }
        assert_eq!(group("plant.motor.friction"), Some("table_1"));
        assert_eq!(group("camera.noise_m"), Some("camera"));
    }
}
