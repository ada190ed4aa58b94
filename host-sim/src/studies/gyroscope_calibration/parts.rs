//! What each cause makes of the error of a calibration: known because the truth is.
//!
//! The fit is linear in the differences between gyroscope and reference. Each cause makes a difference of its own in
//! each interval, and the gains of the fit make an error of that.

use super::calibration::Bench;
use super::turning::Anchor;
use analysis::gyroscope_fit::CalibrationFit;
use motor_model::Angle;
use simulation::world::body_turn::BodyTurn;
use simulation::world::instruments::gyroscope::Gyroscope;

/// Errors of scale factor and bias in deg/s, by cause.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartsByTruth {
    /// The turn about the rotor's own axis less the one seen from above.
    pub coning: [f64; 2],
    /// The true turn seen from above less that of the reference.
    pub reference: [f64; 2],
    /// What a misaligned gyroscope shows of turns across the axis.
    pub misalignment: [f64; 2],
    /// What non-linearity adds, less what the fit explains by it.
    pub nonlinearity: [f64; 2],
    /// What scale factor and bias are off from those of the time that is wanted.
    pub temperature: [f64; 2],
}

impl PartsByTruth {
    /// Those of a fit to the intervals that are kept.
    pub fn of(gyroscope: &Gyroscope, bench: &Bench, is_kept: &[bool], fit: &CalibrationFit) -> Self {
        let (truth, turning) = (gyroscope.errors(), bench.turning);
        let (period_s, limit_deg) = (gyroscope.noise().period_s, gyroscope.limit_deg());
        let factor = 1.0 + truth.scale_at(bench.unknowns.at_s);
        let turns: Vec<BodyTurn> = turning.turns().collect();
        let sum = |pair: &[Anchor], of: &dyn Fn(usize, &BodyTurn) -> f64| -> f64 {
            let samples = pair[0].sample..pair[1].sample;
            samples.map(|sample| of(sample, &turns[sample])).sum()
        };
        let seen_deg = |pair: &[Anchor]| turn_deg(&turning.truth, pair);
        let part = |of: &dyn Fn(&[Anchor]) -> f64| {
            let kept = turning.anchors.windows(2).zip(is_kept).filter(|(_, kept)| **kept);
            fit.part(kept.map(|(pair, _)| of(pair)))
        };
        let turned_deg = |turn: &BodyTurn| turn.own_axis_deg + truth.misaligned_deg(turn);
        Self {
            coning: part(&|pair| factor * (turn_deg(&turning.sensed, pair) - seen_deg(pair))),
            reference: part(&|pair| factor * (seen_deg(pair) - pair[1].angle.minus(pair[0].angle).degrees())),
            misalignment: part(&|pair| factor * sum(pair, &|_, turn| truth.misaligned_deg(turn))),
            nonlinearity: part(&|pair| {
                sum(pair, &|_, turn| truth.nonlinear_deg(turned_deg(turn), limit_deg))
            }),
            temperature: part(&|pair| {
                sum(pair, &|sample, turn| {
                    let time_s = (simulation::math::count::real(sample) + 0.5) * period_s;
                    let warmer = bench.unknowns.warmer(time_s);
                    warmer * (truth.warm_up.scale * turned_deg(turn) + truth.warm_up.bias_deg_s * period_s)
                })
            }),
        }
    }

    /// The sum over the causes, of the scale factor (0) or of the bias (1).
    pub fn sum(&self, of: usize) -> f64 {
        let Self { coning, reference, misalignment, nonlinearity, temperature } = self;
        [coning, reference, misalignment, nonlinearity, temperature].iter().map(|part| part[of]).sum()
    }
}

/// The turn between two anchors.
fn turn_deg(of: &[Angle], pair: &[Anchor]) -> f64 {
    of[pair[1].sample].minus(of[pair[0].sample]).degrees()
}
