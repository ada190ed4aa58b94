//! The targets for error and cost of the fixed-step model, and whether they are met.
//!
//! Costs at equal error are compared along the curves of cost against error. Located impacts at 10 us have some error.
//! The finer step at which end-of-step impacts have the same error is interpolated in the logarithms. If no step
//! reaches that error, the cost of the finest step is a lower bound. Where an error is statistical, the comparison
//! favours end-of-step impacts: located impacts count with at least the half width of their interval, end-of-step
//! impacts with their error less the half width.

use motor_model::{DriveMode, ImpactRule, math};
use serde::Serialize;

use super::comparison::StepAccuracy;
use analysis::step_accuracy::bursts::BURSTS;
use analysis::step_accuracy::impact_map::ImpactMapErrors;
use analysis::step_accuracy::method::TARGET_STEP_S;
use analysis::step_accuracy::method_row::MethodRow;
use analysis::step_accuracy::peers::{PEER_STEP_S, PeerRow};
use analysis::step_accuracy::steady_motion::{CONDITIONS, Deviation};
use simulation::runs::simulate::Precision;

/// Steps, and the largest relative error allowed at each.
pub const ERROR_LIMITS: [(f64, f64); 2] = [(TARGET_STEP_S, 0.02), (20e-6, 0.05)];
/// Largest time that a step may take on average in steady motion.
pub const STEP_LIMIT_NS: f64 = 15.0;
/// Least ratio of the costs of end-of-step and located impacts at equal error.
pub const COST_RATIO: f64 = 10.0;
/// Least speed on the ball on the plate, in times real time.
pub const TIMES_REAL_TIME: f64 = 400.0;
/// Least ratio of that speed to the speed of the fastest of the other crates.
pub const FASTER_THAN_CRATES: f64 = 5.0;

/// A target, and whether it is met.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TargetResult {
    /// The target in words.
    pub target: String,
    /// The result in words.
    pub found: String,
    /// Whether the target is met.
    pub met: bool,
    /// Whether the target is a time on one machine.
    #[serde(skip)]
    pub timed: bool,
}

/// One of the errors of an impact map.
type ErrorOf = fn(&ImpactMapErrors) -> f64;

impl TargetResult {
    fn timed(target: String, found: String, met: bool) -> Self {
        Self { target, found, met, timed: true }
    }
}

/// A point of a curve: cost in ns per simulated ms, error, half width of the error's interval.
type Point = (f64, f64, f64);

/// The ratio of the costs of end-of-step and located impacts at equal error, for one kind of error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostRatio {
    /// Kind of error.
    pub error: String,
    /// Cost of end-of-step impacts over cost of located ones.
    pub times: f64,
    /// Whether `times` is a lower bound, because no step of end-of-step impacts reaches the error.
    pub at_least: bool,
}

impl StepAccuracy {
    /// The row of this method.
    pub fn row(&self, impact_rule: ImpactRule, precision: Precision, step_s: f64) -> Option<&MethodRow> {
        self.curve(impact_rule, precision).find(|row| row.method.has_step(step_s))
    }

    /// The rows of this rule and precision, from the fine to the coarse step.
    pub fn curve(&self, impact_rule: ImpactRule, precision: Precision) -> impl Iterator<Item = &MethodRow> {
        self.rows.iter().filter(move |row| row.method.is(impact_rule, precision))
    }

    /// The fixed-step model on the ball on the plate: its rows of [`Self::peers`].
    pub fn plate_curve(
        &self,
        impact_rule: ImpactRule,
        precision: Precision,
    ) -> impl Iterator<Item = &PeerRow> {
        self.peers
            .iter()
            .filter(move |row| row.method.is_some_and(|method| method.is(impact_rule, precision)))
    }

    /// Speed of the model with located impacts in `f64` on the ball on the plate at the peers' step, in times real
    /// time.
    pub fn plate_times_real_time(&self) -> Option<f64> {
        let mut curve = self.plate_curve(ImpactRule::Located, Precision::F64);
        let row = curve.find(|row| row.method.is_some_and(|method| method.has_step(PEER_STEP_S)))?;
        Some(row.cost?.times_real_time)
    }

    /// All targets.
    pub fn target_results(&self) -> Vec<TargetResult> {
        let mut all = Vec::new();
        for precision in [Precision::F64, Precision::F32] {
            for (step_s, limit) in ERROR_LIMITS {
                if let Some(row) = self.row(ImpactRule::Located, precision, step_s) {
                    all.extend(error_targets(row, limit));
                }
            }
        }
        all.extend(self.step_costs());
        all.push(self.cost_ratio_result());
        all.extend(self.ball_on_plate());
        all
    }

    fn step_costs(&self) -> Vec<TargetResult> {
        let at = |precision| self.row(ImpactRule::Located, precision, TARGET_STEP_S);
        let (Some(double), Some(single)) = (at(Precision::F64), at(Precision::F32)) else {
            return Vec::new();
        };
        let mut all = Vec::new();
        for (index, mode) in ["B", "C"].into_iter().enumerate() {
            let (double_ns, single_ns) = (double.cost[index].ns_per_step, single.cost[index].ns_per_step);
            let most =
                format!("located f64 at 10 us: a step of mode {mode} takes at most {STEP_LIMIT_NS} ns");
            all.push(TargetResult::timed(most, format!("{double_ns:.1} ns"), double_ns <= STEP_LIMIT_NS));
            let no_more = format!("located f32 at 10 us: a step of mode {mode} takes no more than in f64");
            all.push(TargetResult::timed(no_more, format!("{single_ns:.1} ns"), single_ns <= double_ns));
        }
        all
    }

    fn cost_ratio_result(&self) -> TargetResult {
        let all = self.cost_ratios();
        let least = all.iter().min_by(|a, b| a.times.total_cmp(&b.times));
        TargetResult {
            target: format!(
                "located at 10 us: at equal error at least {COST_RATIO} times cheaper than end of step"
            ),
            found: least.map_or_else(String::new, |least| {
                let bound = if least.at_least { "at least " } else { "" };
                let kept = all.iter().filter(|one| one.times >= COST_RATIO).count();
                let (times, error, count) = (least.times, &least.error, all.len());
                format!("{kept} of {count} kinds of error; {bound}{times:.1} times for the {error}")
            }),
            met: least.is_some_and(|least| least.times >= COST_RATIO),
            timed: true,
        }
    }

    /// The ratios of costs against located impacts at 10 us in `f64`, one for each kind of error.
    pub fn cost_ratios(&self) -> Vec<CostRatio> {
        let mut all = Vec::new();
        for (index, mode) in ["B", "C"].into_iter().enumerate() {
            let cost = move |row: &MethodRow| row.cost[index].ns_per_ms;
            let kinds: [(&str, ErrorOf); 3] = [
                ("time of the next impact", |map| map.first_impact_rms_s),
                ("velocity after the impact that follows", |map| map.velocity_rms_m_s),
                ("rotor rate after the impact that follows", |map| map.rate_rms_rad_s),
            ];
            all.extend(kinds.into_iter().filter_map(|(kind, error)| {
                let point = |row: &MethodRow| (cost(row), error(&row.impact_map[index]), 0.0);
                self.cost_ratio(format!("{kind} in {mode}"), point)
            }));
        }
        for (index, condition) in CONDITIONS.iter().enumerate() {
            let mode = usize::from(condition.mode == DriveMode::C);
            let point = move |row: &MethodRow, deviation: Deviation| {
                (row.cost[mode].ns_per_ms, deviation.relative.abs(), deviation.half_width)
            };
            all.extend(self.cost_ratio(format!("mean rate in {}", condition.name()), |row| {
                point(row, row.steady[index].rate)
            }));
            if condition.collides {
                all.extend(self.cost_ratio(format!("impacts per second in {}", condition.name()), |row| {
                    point(row, row.steady[index].impacts.unwrap_or(row.steady[index].rate))
                }));
            }
        }
        all.extend(self.cost_ratio("displacement of bursts".to_owned(), |row| {
            (0.5 * (row.cost[0].ns_per_ms + row.cost[1].ns_per_ms), row.worst_burst(), 0.0)
        }));
        all
    }

    fn cost_ratio(&self, error: String, point: impl Fn(&MethodRow) -> Point) -> Option<CostRatio> {
        let located = point(self.row(ImpactRule::Located, Precision::F64, TARGET_STEP_S)?);
        let curve: Vec<Point> = self.curve(ImpactRule::EndOfStep, Precision::F64).map(point).collect();
        let (cost, at_least) = cost_at(&curve, located.1.max(located.2))?;
        Some(CostRatio { error, times: cost / located.0, at_least })
    }

    fn ball_on_plate(&self) -> Vec<TargetResult> {
        let times = |row: &PeerRow| row.cost.map(|cost| cost.times_real_time);
        let Some(ours) = self.plate_times_real_time() else { return Vec::new() };
        let crates = self.peers.iter().filter(|row| row.is_crate).filter_map(times);
        let fastest = crates.fold(0.0, f64::max);
        let least =
            format!("ball on a plate, located f64 at 5 us: at least {TIMES_REAL_TIME} times real time");
        let mut all = vec![TargetResult::timed(least, format!("{ours:.0} times"), ours >= TIMES_REAL_TIME)];
        if fastest > 0.0 {
            let (ratio, least) = (ours / fastest, FASTER_THAN_CRATES);
            let target =
                format!("ball on a plate: at least {least} times as fast as the fastest of the Rust crates");
            all.push(TargetResult::timed(target, format!("{ratio:.1} times"), ratio >= least));
        }
        all
    }
}

/// The targets of error of a row with located impacts.
fn error_targets(row: &MethodRow, limit: f64) -> Vec<TargetResult> {
    let named = |of: &dyn Fn(usize) -> Option<Deviation>| -> Vec<(String, f64, f64)> {
        let all = CONDITIONS.iter().enumerate().filter_map(|(index, condition)| {
            of(index).map(|found| (condition.name(), found.relative, found.half_width))
        });
        all.collect()
    };
    let bursts = BURSTS.iter().zip(&row.bursts);
    let bursts = bursts.map(|(burst, error)| (burst.name(), error.relative, 0.0)).collect();
    [
        ("mean rate", named(&|index| Some(row.steady[index].rate))),
        ("impacts per second", named(&|index| row.steady[index].impacts)),
        ("displacement of bursts", bursts),
    ]
    .into_iter()
    .map(|(quantity, found)| {
        let method = format!("located {} at {:.0} us", row.method.precision.name(), 1e6 * row.method.step_s);
        let worst = found.into_iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let (name, relative, half_width) = worst.unwrap_or_default();
        let interval =
            if half_width > 0.0 { format!(" +- {:.2}", 100.0 * half_width) } else { String::new() };
        TargetResult {
            target: format!("{method}: {quantity} within {:.0} %", 100.0 * limit),
            found: format!("{:+.2}{interval} % at worst ({name})", 100.0 * relative),
            met: relative.abs() <= limit,
            timed: false,
        }
    })
    .collect()
}

/// The cost on `curve`, given from the fine to the coarse step, at which the error is `error`. Where no step reaches
/// `error`: the cost of the finest step and `true`, a lower bound.
fn cost_at(curve: &[Point], error: f64) -> Option<(f64, bool)> {
    let reaches = |&&(_, found, half_width): &&Point| found - half_width <= error;
    let fine = curve.iter().take_while(reaches).count();
    let Some(&(cost, found, half_width)) = curve.get(fine.wrapping_sub(1)) else {
        return curve.first().map(|&(cost, ..)| (cost, true));
    };
    let (found, next) = (found.max(half_width), curve.get(fine));
    let Some(&(coarse_cost, coarse_found, _)) =
        next.filter(|next| found < error && found > 0.0 && next.1 > error)
    else {
        return Some((cost, false));
    };
    let part = (error / found).log10() / (coarse_found / found).log10();
    Some((cost * math::exp(part * (coarse_cost / cost).log10() * core::f64::consts::LN_10), false))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error 1 at cost 100, 10 at cost 10: error 10^0.5 costs 10^1.5.
    #[test]
    fn exact_cost_by_interpolation_of_logarithms() {
        let curve = [(100.0, 1.0, 0.0), (10.0, 10.0, 0.0), (1.0, 100.0, 0.0)];
        let (cost, at_least) = cost_at(&curve, math::sqrt(10.0)).unwrap();
        assert!((cost - 10.0 * math::sqrt(10.0)).abs() < 1e-9 && !at_least);
        assert_eq!(cost_at(&curve, 0.5), Some((100.0, true)));
        assert_eq!(cost_at(&curve, 1000.0), Some((1.0, false)));
        assert_eq!(cost_at(&[], 1.0), None);
    }

    /// A small error at a coarse step counts only if all finer steps have one too.
    #[test]
    fn exact_cost_ignores_a_small_error_at_a_coarse_step_only() {
        let curve = [(100.0, 2.0, 0.0), (10.0, 0.1, 0.0)];
        assert_eq!(cost_at(&curve, 1.0), Some((100.0, true)));
    }

    /// The half width is subtracted from the error.
    #[test]
    fn exact_cost_gives_the_benefit_of_the_interval() {
        let curve = [(100.0, 2.0, 3.0), (10.0, 5.0, 1.0)];
        assert_eq!(cost_at(&curve, 1.0), Some((100.0, false)));
    }
}
