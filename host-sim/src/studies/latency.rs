//! What a latency costs while a rate is held: the error of the estimate by each filter, and how often it is off by more
//! than it says.

use rayon::prelude::*;

use crate::report::page::PlacedValue;
use crate::report::table::Table;
use simulation::math::count::real;
use simulation::math::statistics::MeanSquare;
use simulation::runs::RunError;
use simulation::runs::rate::{self, RateOutcome};
use simulation::runs::stated_errors::hundredths_or_dash;
use simulation::scene::Scene;

/// Filters, in the order of their cost, and latencies in ticks.
const FILTERS: [&str; 3] = ["twin", "impact_aided", "constant_rate"];
const LATENCY_TICKS: [u32; 5] = [0, 4, 8, 12, 16];

/// Rates in deg/s: one by each mode.
const RATES_DEG_S: [&str; 2] = ["300", "-40"];

/// Holds both rates with each filter at each latency, by the motors of seeds 1 to `motors`, each for the time of
/// `scene`. The value of its page: a row for each filter and latency.
///
/// # Errors
/// When a scene is refused.
pub(crate) fn page_values(scene: &Scene, motors: u64) -> Result<[PlacedValue; 1], RunError> {
    let mut table = Table::new(&[
        "filter",
        "latency",
        "300 deg/s",
        "-40 deg/s",
        "beyond 3 sigma",
        "good, beyond 5 sigma",
        "worst",
    ]);
    for (filter, ticks) in FILTERS.iter().flat_map(|filter| LATENCY_TICKS.map(|ticks| (*filter, ticks))) {
        let held = RATES_DEG_S.map(|rate_deg_s| {
            let outcome = |seed: u64| -> Result<RateOutcome, RunError> {
                let mut scene = scene.clone();
                let (ticks, seed) = (ticks.to_string(), seed.to_string());
                for (key, value) in [
                    ("estimator.filter", filter),
                    ("board.latency_ticks", &ticks),
                    ("rate.deg_s", rate_deg_s),
                    ("seed", &seed),
                ] {
                    scene.set(key, value)?;
                }
                rate::run(&scene, |_| ())
            };
            (1..=motors).into_par_iter().map(outcome).collect::<Result<Vec<_>, _>>()
        });
        let [clockwise, counter_clockwise] = held;
        table.push(row(filter, ticks, &clockwise?, &counter_clockwise?));
    }
    Ok([("table_latency", table.markdown())])
}

fn row(
    filter: &str,
    ticks: u32,
    clockwise: &[RateOutcome],
    counter_clockwise: &[RateOutcome],
) -> Vec<String> {
    let rms = |outcomes: &[RateOutcome]| {
        let mut square = MeanSquare::default();
        outcomes.iter().filter_map(|outcome| outcome.estimate_rms_mdeg).for_each(|mdeg| square.add(mdeg));
        hundredths_or_dash(square.root_of_some())
    };
    let all = || clockwise.iter().chain(counter_clockwise).map(|outcome| outcome.stated);
    let shares = || all().filter_map(|stated| stated.beyond_3_sigma);
    let beyond_3 = shares().sum::<f64>() / real(shares().count().max(1));
    let beyond_5 = all().map(|stated| stated.good_beyond_5_sigma).sum::<u64>();
    let worst_mdeg = all().map(|stated| stated.good_beyond_5_sigma_worst_mdeg).fold(0.0, f64::max);
    vec![
        format!("`{filter}`"),
        ticks.to_string(),
        rms(clockwise),
        rms(counter_clockwise),
        format!("{:.2} %", 100.0 * beyond_3),
        beyond_5.to_string(),
        if beyond_5 > 0 { format!("{worst_mdeg:.0}") } else { "-".to_owned() },
    ]
}
