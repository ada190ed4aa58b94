//! The angle of a resting rotor, estimated across bursts.
//!
//! While the drive is on, impacts turn the rotor, and the angle filter's variance grows: after the drive it measures
//! anew. But a short burst turns the rotor by nearly what is forecast. So what was known before it, moved on by the
//! forecast, is worth a measurement of its own, and a second of measuring is not lost to a correction of a
//! milli-degree. This holds for steps and walks, which a motor repeats to a percent, and still for nudges, whose
//! factor is independent of the angle.
//!
//! # State
//!
//! The angle `a` and the factors of steps and walks are one Kalman filter, since a motor whose step turns too far has
//! steps that all turn too far:
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | `a` | rad | angle at rest | none: the first measurement |
//! | 1 | `s_step` | 1 | turn of this motor's steps per turn of the map's | as in [`crate::map_correction`] |
//! | 2 | `s_walk` | 1 | the same for walks | as in [`crate::map_correction`] |
//!
//! This module holds row 0 of the covariance: the variance `P` of the angle and its covariance `c` with each factor.
//! The factors and their covariance `Q` are in [`MapCorrection`], which another target does not reset. `m` is the
//! signed turn of the map, `b` the angle measured since the burst and `R` its variance:
//!
//! ```text
//! burst of family f:   a += s_f m,      P += m^2 Q_ff + 2 m c_f + noise,    c_g += m Q_fg
//! at rest:             a += (b - a) P / (P + R),      c_g -= c_g P / (P + R),
//!                      s_g += (b - a) c_g / (P + R),  Q_gh -= c_g c_h / (P + R)
//! ```
//!
//! The right-hand sides have the values before the step.
//!
//! # Two conditions
//!
//! The measurement must be independent of what was known before. It counts as such once the angle filter's variance
//! has been [`INDEPENDENT_VARIANCES`] times the one before the burst. And an innovation beyond [`GATE`] means that the
//! burst did something else than forecast: then the forecast is dropped, and the factor is learnt from the turn alone.

use estimator::Estimate;
use motor_model::{Angle, DriveMode};

use crate::map_correction::{Forecast, MapCorrection};
use crate::response_map::{Burst, Family, direction};

/// The angle filter's estimate is independent of that before the burst once its variance was so many times as large: of
/// what was known then a ninth of the weight is left. An assumption.
const INDEPENDENT_VARIANCES: f32 = 9.0;
/// Innovation squared, per its variance, beyond which the forecast is dropped: three and a half standard deviations. An
/// assumption.
const GATE: f32 = 12.0;
/// Smallest variance of the predicted angle, per the variance before the burst. Rounding, and a factor at its bound,
/// must not make the angle better known than by one burst. An assumption.
const PREDICTED_VARIANCE_MIN: f32 = 0.25;

/// Angle of a rotor at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resting {
    /// The angle.
    pub angle: Angle,
    /// Its variance in rad^2.
    pub angle_rad2: f32,
}

/// Row 0 of the joint filter: the angle with its variance and covariances.
#[derive(Clone, Copy, Debug)]
struct AngleRow {
    resting: Resting,
    /// Covariances in rad of the angle with the factors of steps and walks.
    angle_factors_rad: [f32; 2],
}

/// The last burst: the angle before it, and the prediction of the angle after it.
#[derive(Clone, Copy, Debug)]
struct Prediction {
    family: Family,
    burst: Burst,
    before: Resting,
    forecast: Forecast,
    after: AngleRow,
    /// Whether the angle filter's estimate is independent of `before` by now.
    independent: bool,
    /// Whether [`RestFilter::compare`] has returned this burst.
    compared: bool,
}

/// Measured less predicted angle.
struct RestInnovation {
    rad: f32,
    /// Its variance.
    rad2: f32,
    /// The measurement's part of the variance.
    measured_rad2: f32,
}

/// How a burst compared with its forecast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstComparison {
    /// The mode.
    pub mode: DriveMode,
    /// Forecast turn in rad, in the direction of the mode.
    pub forecast_rad: f32,
    /// Measured turn in rad, in the direction of the mode.
    pub turned_rad: f32,
    /// Variance of the measured turn in rad^2.
    pub turned_rad2: f32,
}

/// The angle filter of a resting rotor: the prediction across the last burst, if there is one.
#[derive(Clone, Copy, Debug, Default)]
pub struct RestFilter {
    prediction: Option<Prediction>,
}

impl Prediction {
    /// The innovation of `estimate`; `None` where the prediction does not count.
    fn innovation(&self, estimate: &Estimate<f32>) -> Option<RestInnovation> {
        // The spread of strides and throws is too large, and too far from a normal law, for a prediction.
        if !self.independent || matches!(self.family, Family::Stride | Family::Throw) {
            return None;
        }
        let Resting { angle, angle_rad2 } = self.after.resting;
        let rad: f32 = estimate.angle.radians_since(angle);
        let rad2 = angle_rad2 + estimate.angle_rad2;
        let within_gate = rad * rad <= GATE * rad2;
        within_gate.then_some(RestInnovation { rad, rad2, measured_rad2: estimate.angle_rad2 })
    }

    /// The measured turn in the direction of the mode, and its variance.
    fn turned(&self, estimate: &Estimate<f32>) -> (f32, f32) {
        let turned_rad =
            direction(self.family.mode()) * estimate.angle.radians_since::<f32>(self.before.angle);
        (turned_rad, self.before.angle_rad2 + estimate.angle_rad2)
    }
}

impl RestFilter {
    /// Forgets the angle before the last burst: the drive was more than a burst, or the estimate was lost.
    pub fn forget(&mut self) {
        self.prediction = None;
    }

    /// Predicts across a burst that begins now, from `estimate`, in a motor of that `correction`.
    pub fn predict(
        &mut self,
        family: Family,
        burst: Burst,
        forecast: Forecast,
        estimate: &Estimate<f32>,
        correction: &MapCorrection,
    ) {
        let AngleRow { resting: before, angle_factors_rad } = self.angle_row(estimate);
        let signed = direction(family.mode());
        let turn = Angle::from_radians(signed * forecast.turn_rad);
        let [with_step, with_walk] = angle_factors_rad;
        let own_rad = match family {
            Family::Step => with_step,
            Family::Walk => with_walk,
            Family::Stride | Family::Nudge | Family::Throw => 0.0,
        };
        let signed_rad = signed * burst.turn_rad;
        let predicted_rad2 = before.angle_rad2 + forecast.turn_rad2 + 2.0 * signed_rad * own_rad;
        let [step, walk] = correction.covariances(family);
        let after = AngleRow {
            resting: Resting {
                angle: before.angle.plus(turn),
                angle_rad2: predicted_rad2.max(PREDICTED_VARIANCE_MIN * before.angle_rad2),
            },
            angle_factors_rad: [with_step + signed_rad * step, with_walk + signed_rad * walk],
        };
        self.prediction =
            Some(Prediction { family, burst, before, forecast, after, independent: false, compared: false });
    }

    /// Notes, in every tick, whether the angle filter has become independent of the angle before the burst.
    ///
    /// `floor_rad2` is what no frame removes of either variance.
    pub fn note_variance(&mut self, estimate: &Estimate<f32>, floor_rad2: f32) {
        if let Some(prediction) = &mut self.prediction {
            let before_rad2 = prediction.before.angle_rad2;
            let since_rad2 = estimate.angle_rad2 - floor_rad2;
            prediction.independent |= since_rad2 > INDEPENDENT_VARIANCES * (before_rad2 - floor_rad2)
                && since_rad2 > INDEPENDENT_VARIANCES * PREDICTED_VARIANCE_MIN * before_rad2;
        }
    }

    /// The angle after the update by `estimate`; the estimate itself where there is no prediction.
    fn angle_row(&self, estimate: &Estimate<f32>) -> AngleRow {
        let measured = Resting { angle: estimate.angle, angle_rad2: estimate.angle_rad2 };
        let Some((prediction, innovation)) = self
            .prediction
            .as_ref()
            .and_then(|prediction| Some((prediction, prediction.innovation(estimate)?)))
        else {
            return AngleRow { resting: measured, angle_factors_rad: [0.0; 2] };
        };
        let AngleRow { resting: Resting { angle, angle_rad2 }, angle_factors_rad } = prediction.after;
        let gain = angle_rad2 / innovation.rad2;
        let left = innovation.measured_rad2 / innovation.rad2;
        AngleRow {
            resting: Resting {
                angle: angle.plus(Angle::from_radians(innovation.rad * gain)),
                angle_rad2: innovation.measured_rad2 * gain,
            },
            angle_factors_rad: angle_factors_rad.map(|covariance| covariance * left),
        }
    }

    /// Where the rotor rests, by the prediction across the last burst and what was measured since.
    pub fn resting(&self, estimate: &Estimate<f32>) -> Resting {
        self.angle_row(estimate).resting
    }

    /// The correction after the update by the last burst, as it is measured by now.
    pub fn corrected(&self, estimate: &Estimate<f32>, correction: &MapCorrection) -> MapCorrection {
        let mut corrected = *correction;
        if let Some(prediction) = self.prediction.as_ref().filter(|prediction| prediction.independent) {
            let innovation = prediction.innovation(estimate);
            if let Some(innovation) = &innovation {
                corrected.update_joint(prediction.after.angle_factors_rad, innovation.rad, innovation.rad2);
            }
            if innovation.is_none() || prediction.family == Family::Nudge {
                let (turned_rad, turned_rad2) = prediction.turned(estimate);
                corrected.learn(prediction.family, &prediction.burst, turned_rad, turned_rad2);
            }
        }
        corrected
    }

    /// Compares the last burst with its forecast, once for each burst; `None` before it can be measured.
    pub fn compare(&mut self, estimate: &Estimate<f32>) -> Option<BurstComparison> {
        let prediction = self.prediction.as_mut();
        let prediction = prediction.filter(|prediction| prediction.independent && !prediction.compared)?;
        prediction.compared = true;
        let (turned_rad, turned_rad2) = prediction.turned(estimate);
        Some(BurstComparison {
            mode: prediction.family.mode(),
            forecast_rad: prediction.forecast.turn_rad,
            turned_rad,
            turned_rad2,
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::response_map::ResponseMap;
    use motor_model::Time;

    fn map() -> &'static ResponseMap {
        ResponseMap::table_1()
    }

    /// The estimate of a rotor at rest.
    pub(crate) fn estimate(mdeg: f64, sigma_mdeg: f32) -> Estimate<f32> {
        let sigma_rad = (1e-3 * sigma_mdeg).to_radians();
        Estimate {
            at: Time::ZERO,
            angle: Angle::from_degrees(1e-3 * mdeg),
            rate_rad_s: 0.0,
            angle_rad2: sigma_rad * sigma_rad,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 0.0,
            resting: true,
        }
    }

    /// A step of -1 +- 0.3 mdeg from 10 +- 0.4: at 9 +- 0.5 by the forecast.
    fn stepped() -> RestFilter {
        let mut filter = RestFilter::default();
        let forecast = Forecast { turn_rad: 1e-3_f32.to_radians(), turn_rad2: estimate(0.0, 0.3).angle_rad2 };
        let step = map().burst(Family::Step, 1e-3_f32.to_radians(), 1.0).unwrap();
        filter.predict(Family::Step, step, forecast, &estimate(10.0, 0.4), &MapCorrection::of(map()));
        filter
    }

    #[test]
    fn exact_prediction_and_measurement_of_equal_variance_meet_half_way() {
        let mut filter = stepped();
        filter.note_variance(&estimate(0.0, 100.0), 0.0);
        let Resting { angle, angle_rad2 } = filter.resting(&estimate(10.0, 0.5));
        assert!((angle.degrees() - 9.5e-3).abs() < 2e-7, "{}", angle.degrees());
        assert!((angle_rad2 / estimate(0.0, 0.5).angle_rad2 - 0.5).abs() < 1e-4);
    }

    /// An estimate that is not independent contains what was known before: it would count twice.
    #[test]
    fn law_no_measurement_counts_twice() {
        let mut filter = stepped();
        filter.note_variance(&estimate(0.0, 0.6), 0.0);
        let seen = estimate(10.0, 0.5);
        let measured = Resting { angle: seen.angle, angle_rad2: seen.angle_rad2 };
        assert_eq!(filter.resting(&seen), measured);
        assert_eq!(filter.corrected(&seen, &MapCorrection::of(map())), MapCorrection::of(map()));
        filter.note_variance(&estimate(0.0, 100.0), 0.0);
        assert_ne!(filter.resting(&seen), measured);
        filter.forget();
        assert_eq!(filter.resting(&seen), measured);
    }

    /// The turn of a throw or a stride is not known well enough for a prediction.
    #[test]
    fn law_only_fine_bursts_carry_over() {
        for family in Family::ALL {
            let mut filter = stepped();
            if let Some(prediction) = &mut filter.prediction {
                prediction.family = family;
                prediction.independent = true;
            }
            let seen = estimate(9.5, 0.5);
            let predicted = filter.resting(&seen).angle_rad2 < 0.99 * seen.angle_rad2;
            assert_eq!(predicted, !matches!(family, Family::Stride | Family::Throw), "{family:?}");
        }
    }

    #[test]
    fn law_an_innovation_beyond_the_gate_drops_the_forecast() {
        let mut filter = stepped();
        filter.note_variance(&estimate(0.0, 100.0), 0.0);
        let elsewhere = estimate(14.0, 0.5);
        assert_eq!(filter.resting(&elsewhere).angle, elsewhere.angle);
    }

    #[test]
    fn exact_a_burst_is_compared_once() {
        let mut filter = stepped();
        filter.note_variance(&estimate(0.0, 100.0), 0.0);
        let comparison = filter.compare(&estimate(8.0, 0.3)).unwrap();
        assert!((comparison.turned_rad.to_degrees() - 2e-3).abs() < 1e-6);
        assert!((comparison.turned_rad2 / estimate(0.0, 0.5).angle_rad2 - 1.0).abs() < 1e-4);
        assert_eq!(filter.compare(&estimate(8.0, 0.3)), None);
    }

    /// The same bursts and measurements through three states in `f64`, written out as matrices.
    #[test]
    fn dual_angle_and_factors_are_one_kalman_filter() {
        use nalgebra::{Matrix3, RowVector3, Vector3};

        let mut correction = MapCorrection::of(map());
        let mut filter = RestFilter::default();
        let [[step, across], [_, walk]] =
            [Family::Step, Family::Walk].map(|family| correction.covariances(family).map(f64::from));
        let mut seen = estimate(30.0, 0.6);
        let mut x = Vector3::new(1e-3 * 30_f64.to_radians(), 1.0, 1.0);
        let mut p = Matrix3::new(f64::from(seen.angle_rad2), 0.0, 0.0, 0.0, step, across, 0.0, across, walk);
        for (family, wanted_mdeg, seen_mdeg, sigma_mdeg) in
            [(Family::Walk, 15.0, 16.0, 0.9), (Family::Step, 5.0, 10.2, 0.5), (Family::Step, 2.0, 7.8, 0.3)]
        {
            let burst = map().burst(family, (1e-3_f32 * wanted_mdeg).to_radians(), 1.0).unwrap();
            correction = filter.corrected(&seen, &correction);
            let forecast = correction.forecast(family, &burst);
            filter.predict(family, burst, forecast, &seen, &correction);
            filter.note_variance(&estimate(0.0, 1000.0), 0.0);
            seen = estimate(seen_mdeg, sigma_mdeg);

            let (place, m) = (if family == Family::Step { 1 } else { 2 }, -f64::from(burst.turn_rad));
            let mut flow = Matrix3::identity();
            flow[(0, place)] = m;
            let noise = f64::from(forecast.turn_rad2) - m * m * p[(place, place)];
            x = flow * x;
            p = flow * p * flow.transpose();
            p[(0, 0)] += noise;
            let h = RowVector3::new(1.0, 0.0, 0.0);
            let s = p[(0, 0)] + f64::from(seen.angle_rad2);
            let k = p * h.transpose() / s;
            x += k * (1e-3 * seen_mdeg.to_radians() - x[0]);
            p -= k * h * p;
        }
        let resting = filter.resting(&seen);
        assert!((resting.angle.degrees() - x[0].to_degrees()).abs() < 2e-7);
        assert!((f64::from(resting.angle_rad2) / p[(0, 0)] - 1.0).abs() < 1e-3);
        let corrected = filter.corrected(&seen, &correction);
        for (family, place) in [(Family::Step, 1), (Family::Walk, 2)] {
            assert!((f64::from(corrected.scale(family)) - x[place]).abs() < 1e-4, "{family:?}");
            let variance = f64::from(corrected.covariances(family)[place - 1]);
            assert!((variance / p[(place, place)] - 1.0).abs() < 1e-3, "{family:?}");
        }
    }
}
