//! Rates by the map of its own: each motor is commissioned, then holds rates by either map.

use rayon::prelude::*;

use super::{HeldRate, hold_one, or_nan};
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::studies::beside::BesideScene;
use simulation::runs::RunError;
use simulation::runs::commission;
use simulation::runs::rate::RateOutcome;
use simulation::scene::Scene;

/// The rates in deg/s, clockwise positive: one that every tilting motor holds, one near what it reaches, and one back.
const RATES_DEG_S: [f64; 3] = [160.0, 250.0, -40.0];

/// A rate of a motor, by both maps.
#[derive(Clone, Debug)]
struct ByBothMaps {
    scene: String,
    by_prior: HeldRate,
    /// By its own map, or why there is none.
    by_own: Result<HeldRate, String>,
}

/// The rates of every scene.
#[derive(Clone, Debug, Default)]
pub struct OwnMapRates {
    rows: Vec<ByBothMaps>,
}

impl OwnMapRates {
    /// Commissions the motor of each of `scenes`, then holds each rate.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn run(scenes: &[BesideScene]) -> Result<Self, RunError> {
        let rows: Vec<Vec<ByBothMaps>> = scenes.par_iter().map(of_motor).collect::<Result<_, RunError>>()?;
        Ok(Self { rows: rows.concat() })
    }

    /// Its table on the page.
    pub fn page_values(&self) -> [PlacedValue; 1] {
        let mut table = Table::new(&[
            "scene",
            "rate deg/s",
            "Table 1's map: mean off %",
            "own map: mean off %",
            "own map promises deg/s",
            "reach deg/s",
        ]);
        for ByBothMaps { scene, by_prior: HeldRate { outcome, .. }, by_own } in &self.rows {
            let promised = |own: &HeldRate| {
                let promised = own.outcome.promised;
                let (back, forth) = (promised.counter_clockwise.mean_deg_s, promised.clockwise.mean_deg_s);
                format!("{back:+.0} to {forth:+.0}")
            };
            table.push(vec![
                scene.clone(),
                format!("{:+.0}", outcome.rate_deg_s),
                mean_off(outcome),
                by_own.as_ref().map_or_else(Clone::clone, |own| mean_off(&own.outcome)),
                by_own.as_ref().map_or_else(|_| "-".to_owned(), promised),
                format!(
                    "{:+.0} to {:+.0}",
                    outcome.range.counter_clockwise_deg_s, outcome.range.clockwise_deg_s
                ),
            ]);
        }
        [("table_own_maps", table.markdown())]
    }
}

/// The error of the mean, and what became of a rate that was not held to its end.
fn mean_off(outcome: &RateOutcome) -> String {
    let percent = format!("{:+.3}", or_nan(outcome.mean_error_percent));
    match (&outcome.stopped, outcome.reached_deg_s) {
        (Some(why), _) => format!("{percent}, {why}"),
        (None, Some(reached_deg_s)) => format!("{percent}, told: {reached_deg_s:+.0}"),
        (None, None) => percent,
    }
}

fn of_motor(of: &BesideScene) -> Result<Vec<ByBothMaps>, RunError> {
    let BesideScene { name, scene } = of;
    let own = match commission::run(scene, |_| ())?.commissioned.map {
        Ok(map) => Ok(scene.clone().with_response_map(map)),
        Err(unfit) => Err(unfit.to_string()),
    };
    let at = |scene: &Scene, rate_deg_s: f64| -> Result<HeldRate, RunError> {
        let mut scene = scene.clone();
        scene.set("rate.deg_s", &rate_deg_s.to_string())?;
        hold_one(&scene)
    };
    let row = |&rate_deg_s: &f64| -> Result<ByBothMaps, RunError> {
        let by_own = match &own {
            Ok(own) => Ok(at(own, rate_deg_s)?),
            Err(unfit) => Err(unfit.clone()),
        };
        Ok(ByBothMaps { scene: name.clone(), by_prior: at(scene, rate_deg_s)?, by_own })
    };
    RATES_DEG_S.par_iter().map(row).collect()
}
