//! Rates held by one motor, each in a run of its own: the error of the mean rate, the error of the estimated angle, and
//! the same on other scenes.

use std::fmt;

use rayon::prelude::*;
use serde_json::json;

use crate::report::document::Document;
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::runs::RunError;
use crate::runs::rate::{self, RateOutcome};
use crate::scene::Scene;
use crate::studies::beside::{Beside, BesideScene, FIRST, SideBySide, side_by_side, worst_of};

/// The rates in deg/s, clockwise positive: a fast one, those of a calibration, and slow ones. The page opens with the
/// first.
const RATES_DEG_S: [f64; 5] = [600.0, 160.0, 50.0, -40.0, -80.0];

/// The rates that other scenes are shown at: a second of a motor that tilts takes long.
const RATES_BESIDE_DEG_S: [f64; 3] = [160.0, 50.0, -40.0];

/// What the figures beside other scenes mean.
const ABOUT: &str = "Beyond 3 sigma: share of the estimates, one a tick, whose angle is off by more than three of the \
    standard deviations that the filter states. Good, beyond 5 sigma: estimates that are called good and are off by \
    more than five, and the largest error of these. Lost: how often the reference begins anew, since the estimate was \
    lost. Reach: mean rates at full drive, in either mode. Time: seconds of this machine for a second of motor time, \
    filter and controller included.";

/// The outcome of each rate.
#[derive(Clone, Debug)]
pub struct HeldRates {
    outcomes: Vec<RateOutcome>,
    beside: Vec<Beside<Vec<RateOutcome>>>,
}

/// Holds each rate of the page with the motor of `scene`, and with those of the scenes `beside` it.
///
/// # Errors
/// When a scene is refused.
pub fn run(scene: &Scene, beside: &[BesideScene]) -> Result<HeldRates, RunError> {
    let beside = BesideScene::run_each(beside, |scene| all_of(scene, &RATES_BESIDE_DEG_S))?;
    Ok(HeldRates { outcomes: all_of(scene, &RATES_DEG_S)?, beside })
}

/// Each rate with the motor of a scene.
fn all_of(scene: &Scene, rates_deg_s: &[f64]) -> Result<Vec<RateOutcome>, RunError> {
    let held = |rate_deg_s: &f64| -> Result<RateOutcome, RunError> {
        let mut scene = scene.clone();
        scene.set("rate.deg_s", &rate_deg_s.to_string())?;
        rate::run(&scene, |_| ())
    };
    rates_deg_s.par_iter().map(held).collect()
}

impl HeldRates {
    /// The one rate that a command asked for, and the same on the scenes `beside` it.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn of_one(outcome: RateOutcome, beside: &[BesideScene]) -> Result<Self, RunError> {
        let one = |scene: &Scene| -> Result<_, RunError> { Ok(vec![rate::run(scene, |_| ())?]) };
        let beside = BesideScene::run_each(beside, one)?;
        Ok(Self { outcomes: vec![outcome], beside })
    }

    /// The first outcome as one JSON object on one line, with those of the other scenes.
    pub fn json(&self) -> String {
        let mut object = serde_json::to_value(self.outcomes.first()).unwrap_or_default();
        let beside = self.beside.iter().map(|other| {
            let mut row = serde_json::to_value(other.found.first()).unwrap_or_default();
            row["beside"] = json!(other.name);
            row
        });
        object["beside"] = beside.collect();
        format!("{object}\n")
    }

    /// The values of its page, the first scene under the name `name`.
    pub fn page_values(&self, name: &str) -> Vec<PlacedValue> {
        let first = self.outcomes.first();
        let figure = |of: fn(&RateOutcome) -> String| first.map_or_else(String::new, of);
        let mut values = vec![
            ("rate_deg_s", figure(|outcome| format!("{:.0}", outcome.rate_deg_s))),
            ("mean_error_percent", figure(|outcome| format!("{:.3}", outcome.mean_error_percent.abs()))),
            ("measured_s", figure(|outcome| format!("{:.1}", outcome.measured_s))),
            ("following_rms_deg", figure(|outcome| format!("{:.1}", outcome.following_rms_deg))),
            ("ripple_rms_deg_s", figure(|outcome| format!("{:.0}", outcome.ripple_rms_deg_s))),
            ("reach_clockwise_deg_s", figure(|outcome| format!("{:.0}", outcome.range.clockwise_deg_s))),
            (
                "reach_counter_clockwise_deg_s",
                figure(|outcome| format!("{:.0}", outcome.range.counter_clockwise_deg_s.abs())),
            ),
            ("table_rates", self.table().markdown()),
        ];
        values.extend(self.side_by_side(name).page_values());
        values
    }

    fn table(&self) -> Table {
        let mut table = Table::new(&[
            "rate deg/s",
            "mean off %",
            "angle follows to deg rms",
            "ripple deg/s rms",
            "estimate mdeg rms",
            "at full drive %",
        ]);
        for outcome in &self.outcomes {
            table.push(vec![
                format!("{:+.0}", outcome.rate_deg_s),
                format!("{:+.3}", outcome.mean_error_percent),
                format!("{:.2}", outcome.following_rms_deg),
                format!("{:.0}", outcome.ripple_rms_deg_s),
                format!("{:.1}", outcome.estimate_rms_mdeg),
                format!("{:.0}", 100.0 * outcome.saturated),
            ]);
        }
        table
    }

    /// Every rate on every scene, the first under the name `first`.
    fn side_by_side(&self, first: &str) -> SideBySide {
        let mut table = Table::new(&[
            "scene",
            "rate deg/s",
            "mean off %",
            "follows to deg rms",
            "at full drive %",
            "reach deg/s",
            "lost",
            "estimate mdeg rms",
            "beyond 3 sigma",
            "good, beyond 5 sigma",
            "worst mdeg",
            "time s/s",
        ]);
        for (name, outcomes) in side_by_side(first, &self.outcomes, &self.beside) {
            outcomes.iter().map(|outcome| cells(name, outcome)).for_each(|cells| table.push(cells));
        }
        SideBySide { tables: table.cut(2, &["estimate mdeg rms"]), about: ABOUT.to_owned() }
    }
}

fn cells(scene: &str, outcome: &RateOutcome) -> Vec<String> {
    let stated = outcome.stated;
    let worst_mdeg = || format!("{:.1}", stated.good_beyond_5_sigma_worst_mdeg);
    vec![
        scene.to_owned(),
        format!("{:+.0}", outcome.rate_deg_s),
        format!("{:+.3}", outcome.mean_error_percent),
        format!("{:.2}", outcome.following_rms_deg),
        format!("{:.0}", 100.0 * outcome.saturated),
        format!("{:+.0} to {:+.0}", outcome.range.counter_clockwise_deg_s, outcome.range.clockwise_deg_s),
        outcome.reference_losses.to_string(),
        format!("{:.1}", outcome.estimate_rms_mdeg),
        format!("{:.2} %", 100.0 * stated.beyond_3_sigma),
        stated.good_beyond_5_sigma.to_string(),
        worst_of(stated.good_beyond_5_sigma > 0, worst_mdeg),
        format!("~{:.2}", outcome.time_s_per_s),
    ]
}

/// The first outcome in words, and the tables of all scenes if there are others.
impl fmt::Display for HeldRates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.outcomes.iter().try_for_each(|outcome| write!(f, "{outcome}"))?;
        if self.beside.is_empty() {
            return Ok(());
        }
        write!(f, "\n{}", Document { blocks: self.side_by_side(FIRST).blocks() }.text())
    }
}
