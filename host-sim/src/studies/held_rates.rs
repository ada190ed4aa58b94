//! Rates held by one motor, each in a run of its own: the error of the mean rate, and the error of the estimated angle.

use rayon::prelude::*;

use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::runs::RunError;
use crate::runs::rate::{self, RateOutcome};
use crate::scene::Scene;

/// The rates in deg/s, clockwise positive: a fast one, those of a calibration, and slow ones. The page opens with the
/// first.
const RATES_DEG_S: [f64; 5] = [600.0, 160.0, 50.0, -40.0, -80.0];

/// The outcome of each rate.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldRates {
    outcomes: Vec<RateOutcome>,
}

/// Holds each rate with the motor of `scene`.
///
/// # Errors
/// When the scene is refused.
pub fn run(scene: &Scene) -> Result<HeldRates, RunError> {
    let held = |rate_deg_s: &f64| -> Result<RateOutcome, RunError> {
        let mut scene = scene.clone();
        scene.set("rate.deg_s", &rate_deg_s.to_string())?;
        rate::run(&scene, |_| ())
    };
    let outcomes: Result<Vec<RateOutcome>, RunError> = RATES_DEG_S.par_iter().map(held).collect();
    Ok(HeldRates { outcomes: outcomes? })
}

impl HeldRates {
    /// The values of its page.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let first = self.outcomes.first();
        let figure = |of: fn(&RateOutcome) -> String| first.map_or_else(String::new, of);
        vec![
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
        ]
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
}
