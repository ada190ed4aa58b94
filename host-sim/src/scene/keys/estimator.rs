//! Keys of the estimator.

use crate::scene::{Kind, Setting};

/// The filters by name, from the simplest to the richest.
pub const FILTERS: &[&str] = &["constant_rate", "impact_aided", "twin"];

/// The estimator's settings.
pub const SETTINGS: &[Setting] = &[Setting {
    key: "estimator.filter",
    unit: "",
    kind: Kind::Choice { default: "twin", of: FILTERS },
    meaning: "filter of angle and rate: from the camera alone, with the vibrometer's impacts, or with a twin as well",
}];
