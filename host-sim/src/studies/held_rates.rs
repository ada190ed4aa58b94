//! Rates held by one motor, each in a run of its own: the error of the mean rate, the error of the estimated angle, and
//! the same on other scenes.

mod own_maps;

use std::convert::Infallible;
use std::fmt;
use std::ops::ControlFlow;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;

pub use self::own_maps::OwnMapRates;
use crate::report::document::Document;
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use crate::studies::beside::{Beside, BesideScene, FIRST, SideBySide, side_by_side, worst_of};
use simulation::runs::RunError;
use simulation::runs::closed_loop::{ClosedRateLoop, RateMoment};
use simulation::runs::rate::{self, RateOutcome, RatePoint};
use simulation::scene::Scene;

/// The rates in deg/s, clockwise positive: a fast one, those of a calibration, and slow ones. The page opens with the
/// first.
const RATES_DEG_S: [f64; 5] = [600.0, 160.0, 50.0, -40.0, -80.0];

/// The rates that other scenes are shown at: a second of a motor that tilts takes long.
const RATES_BESIDE_DEG_S: [f64; 3] = [160.0, 50.0, -40.0];

/// What the figures beside other scenes mean.
const ABOUT: &str = "Beyond 3 sigma: share of the estimates, one a tick, whose angle is off by more than three of the \
    standard deviations that the filter states. Good, beyond 5 sigma: estimates that are called good and are off by \
    more than five, and the largest error of these. Lost: how often the reference begins anew, since the estimate was \
    lost. Reach: the fastest mean rates in open loop, in either mode. Time: seconds of this machine for a second of \
    motor time, filter and controller included.";

/// A rate that was held, and its cost.
#[derive(Clone, Debug)]
pub struct HeldRate {
    /// What became of it.
    pub outcome: RateOutcome,
    /// Time that this machine took for a second of motor time.
    pub time_s_per_s: f64,
}

/// Holds the rate of `scene`, and measures the time; `observe` and `intervene` are those of [`rate::run_with`].
///
/// # Errors
/// When the scene is refused.
pub fn hold<B>(
    scene: &Scene,
    mut observe: impl FnMut(RatePoint),
    intervene: impl FnMut(&mut ClosedRateLoop, &RateMoment) -> ControlFlow<B>,
) -> Result<ControlFlow<B, HeldRate>, RunError> {
    let begun = Instant::now();
    let mut time_s_per_s = 0.0;
    let ended = rate::run_with(
        scene,
        |point| {
            time_s_per_s = begun.elapsed().as_secs_f64() / point.time_s;
            observe(point);
        },
        intervene,
    )?;
    Ok(match ended {
        ControlFlow::Continue(outcome) => ControlFlow::Continue(HeldRate { outcome, time_s_per_s }),
        ControlFlow::Break(value) => ControlFlow::Break(value),
    })
}

/// The rate of `scene`, held to the end.
///
/// # Errors
/// When the scene is refused.
pub fn hold_one(scene: &Scene) -> Result<HeldRate, RunError> {
    let ControlFlow::Continue(held) = hold(scene, |_| (), |_, _| ControlFlow::<Infallible>::Continue(()))?;
    Ok(held)
}

/// The outcome of each rate.
#[derive(Clone, Debug)]
pub struct HeldRates {
    outcomes: Vec<HeldRate>,
    beside: Vec<Beside<Vec<HeldRate>>>,
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
fn all_of(scene: &Scene, rates_deg_s: &[f64]) -> Result<Vec<HeldRate>, RunError> {
    let held = |rate_deg_s: &f64| -> Result<HeldRate, RunError> {
        let mut scene = scene.clone();
        scene.set("rate.deg_s", &rate_deg_s.to_string())?;
        hold_one(&scene)
    };
    rates_deg_s.par_iter().map(held).collect()
}

impl HeldRates {
    /// The one rate that a command asked for, and the same on the scenes `beside` it.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn of_one(held: HeldRate, beside: &[BesideScene]) -> Result<Self, RunError> {
        let one = |scene: &Scene| -> Result<_, RunError> { Ok(vec![hold_one(scene)?]) };
        let beside = BesideScene::run_each(beside, one)?;
        Ok(Self { outcomes: vec![held], beside })
    }

    /// The first outcome as one JSON object on one line, with those of the other scenes.
    pub fn json(&self) -> String {
        let mut object = json_of(self.outcomes.first());
        let beside = self.beside.iter().map(|other| {
            let mut row = json_of(other.found.first());
            row["beside"] = json!(other.name);
            row
        });
        object["beside"] = beside.collect();
        format!("{object}\n")
    }

    /// The values of its page, the first scene under the name `name`.
    pub fn page_values(&self, name: &str) -> Vec<PlacedValue> {
        let first = self.outcomes.first();
        let figure =
            |of: fn(&RateOutcome) -> String| first.map_or_else(String::new, |held| of(&held.outcome));
        let mut values = vec![
            ("rate_deg_s", figure(|outcome| format!("{:.0}", outcome.rate_deg_s))),
            (
                "mean_error_percent",
                figure(|outcome| format!("{:.3}", or_nan(outcome.mean_error_percent).abs())),
            ),
            ("measured_s", figure(|outcome| format!("{:.1}", outcome.measured_s))),
            ("following_rms_deg", figure(|outcome| format!("{:.1}", or_nan(outcome.following_rms_deg)))),
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
        for HeldRate { outcome, .. } in &self.outcomes {
            table.push(vec![
                format!("{:+.0}", outcome.rate_deg_s),
                format!("{:+.3}", or_nan(outcome.mean_error_percent)),
                format!("{:.2}", or_nan(outcome.following_rms_deg)),
                format!("{:.0}", outcome.ripple_rms_deg_s),
                format!("{:.1}", or_nan(outcome.estimate_rms_mdeg)),
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
            outcomes.iter().map(|held| cells(name, held)).for_each(|cells| table.push(cells));
        }
        SideBySide { tables: table.cut(2, &["estimate mdeg rms"]), about: ABOUT.to_owned() }
    }
}

/// The outcome as JSON, which depends on the seed alone: without the time.
fn json_of(held: Option<&HeldRate>) -> serde_json::Value {
    serde_json::to_value(held.map(|held| &held.outcome)).unwrap_or_default()
}

/// A figure that may be missing, which a table shows as a dash.
fn or_nan(figure: Option<f64>) -> f64 {
    figure.unwrap_or(f64::NAN)
}

fn cells(scene: &str, HeldRate { outcome, time_s_per_s }: &HeldRate) -> Vec<String> {
    let stated = outcome.stated;
    let worst_mdeg = || format!("{:.1}", stated.good_beyond_5_sigma_worst_mdeg);
    vec![
        scene.to_owned(),
        format!("{:+.0}", outcome.rate_deg_s),
        format!("{:+.3}", or_nan(outcome.mean_error_percent)),
        format!("{:.2}", or_nan(outcome.following_rms_deg)),
        format!("{:.0}", 100.0 * outcome.saturated),
        format!("{:+.0} to {:+.0}", outcome.range.counter_clockwise_deg_s, outcome.range.clockwise_deg_s),
        outcome.reference_losses.to_string(),
        format!("{:.1}", or_nan(outcome.estimate_rms_mdeg)),
        format!("{:.2} %", 100.0 * or_nan(stated.beyond_3_sigma)),
        stated.good_beyond_5_sigma.to_string(),
        worst_of(stated.good_beyond_5_sigma > 0, worst_mdeg),
        format!("~{:.2}", time_s_per_s),
    ]
}

/// The first outcome in words, and the tables of all scenes if there are others.
impl fmt::Display for HeldRates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.outcomes.iter().try_for_each(|held| write!(f, "{}", held.outcome))?;
        if self.beside.is_empty() {
            return Ok(());
        }
        write!(f, "\n{}", Document { blocks: self.side_by_side(FIRST).blocks() }.text())
    }
}
