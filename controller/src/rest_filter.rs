//! What is known of a resting rotor's angle across bursts.
//!
//! While it is struck, a filter forgets where the rotor was: after the drive it measures anew. But a short burst turns the rotor by little more or less than foreseen,
//! so what was known before, moved on by the forecast, is as good as a measurement of its own. A second of measuring is then not lost to a correction of a milli-degree.
//! This holds for steps and walks, which a motor repeats, and still for nudges, whose factor is a family of its own.
//!
//! Angle `a` and the factors `s` of both families ([`crate::map_correction`]) are one Kalman filter, since the motor that steps too far does so every time. With `m` the signed
//! turn of the map, `P` the variance of the angle, `c` its covariance with each factor, `Q` those of the factors, and `b`, `R` what was measured since:
//!
//! ```text
//! burst of family f:   a += s_f m,      P += m^2 Q_ff + 2 m c_f + noise,    c_g += m Q_fg
//! at rest:             a += (b - a) P / (P + R),      s_g += (b - a) c_g / (P + R),      and their covariances less what that explains
//! ```
//!
//! What is measured must be independent of what was known: only when the filter's variance has been [`FORGOTTEN`] times the one before is what it
//! knows new. And where they contradict each other the burst did something else: what was foreseen is dropped, and the factor doubted.

use estimator::Estimate;
use motor_model::{Angle, DriveMode};

use crate::map_correction::{Forecast, MapCorrection};
use crate::response_map::{Burst, Family, direction};

/// How many times the variance before the burst the filter's must have been since.
const FORGOTTEN: f32 = 9.0;
/// Difference squared per its variance beyond which the forecast is dropped.
const CONTRADICTION: f32 = 12.0;

/// Angle of a rotor at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resting {
    /// The angle.
    pub angle: Angle,
    /// Its variance in rad^2.
    pub angle_rad2: f32,
}

/// A resting rotor's angle, and how its error goes with those of the factors.
#[derive(Clone, Copy, Debug)]
struct Known {
    resting: Resting,
    /// Covariance in rad with the factors of steps and walks.
    shared_rad: [f32; 2],
}

/// A burst, what was known before it, and what was foreseen.
#[derive(Clone, Copy, Debug)]
struct Entry {
    family: Family,
    burst: Burst,
    before: Resting,
    forecast: Forecast,
    after: Known,
    forgotten: bool,
    compared: bool,
}

/// What has been measured since a burst beside what was foreseen of it.
struct Meeting {
    /// Measured less foreseen, in rad.
    apart_rad: f32,
    /// Variance of that in rad^2.
    apart_rad2: f32,
    /// The filter's part of it.
    measured_rad2: f32,
}

/// How a burst compared with its forecast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstComparison {
    /// The mode.
    pub mode: DriveMode,
    /// Foreseen turn in rad, in the direction of the mode.
    pub foreseen_rad: f32,
    /// Measured turn in rad, in the direction of the mode.
    pub turned_rad: f32,
    /// Variance of the measured turn in rad^2.
    pub turned_rad2: f32,
}

/// The last burst, if what came before it still counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct RestFilter {
    entry: Option<Entry>,
}

impl Entry {
    /// `None` where the forecast does not count.
    fn meet(&self, estimate: &Estimate<f32>) -> Option<Meeting> {
        // What these turn is too far from a normal law, and too much, to be a measurement.
        if !self.forgotten || matches!(self.family, Family::Stride | Family::Throw) {
            return None;
        }
        let Resting { angle, angle_rad2 } = self.after.resting;
        let apart_rad: f32 = estimate.angle.radians_since(angle);
        let apart_rad2 = angle_rad2 + estimate.angle_rad2;
        let agree = apart_rad * apart_rad <= CONTRADICTION * apart_rad2;
        agree.then_some(Meeting { apart_rad, apart_rad2, measured_rad2: estimate.angle_rad2 })
    }

    /// The turn as measured in the direction of the mode, and its variance.
    fn turned(&self, estimate: &Estimate<f32>) -> (f32, f32) {
        let turned_rad =
            direction(self.family.mode()) * estimate.angle.radians_since::<f32>(self.before.angle);
        (turned_rad, self.before.angle_rad2 + estimate.angle_rad2)
    }
}

impl RestFilter {
    /// Forgets everything: the drive was more than a burst, or the estimate was lost.
    pub fn close(&mut self) {
        self.entry = None;
    }

    /// Enters a burst that begins now, on `estimate`, in a motor of that `correction`.
    pub fn enter(
        &mut self,
        family: Family,
        burst: Burst,
        forecast: Forecast,
        estimate: &Estimate<f32>,
        correction: &MapCorrection,
    ) {
        let Known { resting: before, shared_rad } = self.known(estimate);
        let signed = direction(family.mode());
        let turn = Angle::from_radians(signed * forecast.turn_rad);
        let [with_step, with_walk] = shared_rad;
        let own_rad = match family {
            Family::Step => with_step,
            Family::Walk => with_walk,
            Family::Stride | Family::Nudge | Family::Throw => 0.0,
        };
        let signed_rad = signed * burst.turn_rad;
        let foreseen_rad2 = before.angle_rad2 + forecast.turn_rad2 + 2.0 * signed_rad * own_rad;
        let [step, walk] = correction.covariances(family);
        let after = Known {
            // Rounding, and a limit that a factor met, must not make it better known than one measured burst does.
            resting: Resting {
                angle: before.angle.plus(turn),
                angle_rad2: foreseen_rad2.max(0.25 * before.angle_rad2),
            },
            shared_rad: [with_step + signed_rad * step, with_walk + signed_rad * walk],
        };
        self.entry =
            Some(Entry { family, burst, before, forecast, after, forgotten: false, compared: false });
    }

    /// Watches the filter forget; for every tick.
    pub fn watch(&mut self, estimate: &Estimate<f32>) {
        if let Some(entry) = &mut self.entry {
            entry.forgotten |= estimate.angle_rad2 > FORGOTTEN * entry.before.angle_rad2;
        }
    }

    fn known(&self, estimate: &Estimate<f32>) -> Known {
        let measured = Resting { angle: estimate.angle, angle_rad2: estimate.angle_rad2 };
        let Some((entry, met)) = self.entry.as_ref().and_then(|entry| Some((entry, entry.meet(estimate)?)))
        else {
            return Known { resting: measured, shared_rad: [0.0; 2] };
        };
        let Known { resting: Resting { angle, angle_rad2 }, shared_rad } = entry.after;
        let (part, left) = (angle_rad2 / met.apart_rad2, met.measured_rad2 / met.apart_rad2);
        Known {
            resting: Resting {
                angle: angle.plus(Angle::from_radians(met.apart_rad * part)),
                angle_rad2: met.measured_rad2 * part,
            },
            shared_rad: shared_rad.map(|shared| shared * left),
        }
    }

    /// Where the rotor rests, by what was known before the last burst and what was measured since.
    pub fn resting(&self, estimate: &Estimate<f32>) -> Resting {
        self.known(estimate).resting
    }

    /// What the last burst, as it is measured by now, teaches of a motor of that `correction`.
    pub fn taught(&self, estimate: &Estimate<f32>, correction: &MapCorrection) -> MapCorrection {
        let mut taught = *correction;
        if let Some(entry) = self.entry.as_ref().filter(|entry| entry.forgotten) {
            let met = entry.meet(estimate);
            if let Some(met) = &met {
                taught.follow(entry.after.shared_rad, met.apart_rad, met.apart_rad2);
            }
            if met.is_none() || entry.family == Family::Nudge {
                let (turned_rad, turned_rad2) = entry.turned(estimate);
                taught.learn(entry.family, &entry.burst, turned_rad, turned_rad2);
            }
        }
        taught
    }

    /// Compares the last burst with its forecast; once a burst.
    pub fn compare(&mut self, estimate: &Estimate<f32>) -> Option<BurstComparison> {
        let entry = self.entry.as_mut().filter(|entry| entry.forgotten && !entry.compared)?;
        entry.compared = true;
        let (turned_rad, turned_rad2) = entry.turned(estimate);
        Some(BurstComparison {
            mode: entry.family.mode(),
            foreseen_rad: entry.forecast.turn_rad,
            turned_rad,
            turned_rad2,
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use motor_model::Time;

    /// Of a rotor at rest.
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
        let mut ledger = RestFilter::default();
        let forecast = Forecast { turn_rad: 1e-3_f32.to_radians(), turn_rad2: estimate(0.0, 0.3).angle_rad2 };
        let step = Family::Step.burst(1e-3_f32.to_radians(), 1.0).unwrap();
        ledger.enter(Family::Step, step, forecast, &estimate(10.0, 0.4), &MapCorrection::default());
        ledger
    }

    #[test]
    fn exact_two_equal_witnesses_meet_half_way() {
        let mut ledger = stepped();
        ledger.watch(&estimate(0.0, 100.0));
        let Resting { angle, angle_rad2 } = ledger.resting(&estimate(10.0, 0.5));
        assert!((angle.degrees() - 9.5e-3).abs() < 2e-7, "{}", angle.degrees());
        assert!((angle_rad2 / estimate(0.0, 0.5).angle_rad2 - 0.5).abs() < 1e-4);
    }

    /// A filter that has not forgotten has the old knowledge in it: to add it again would count it twice.
    #[test]
    fn law_nothing_counts_twice() {
        let mut ledger = stepped();
        ledger.watch(&estimate(0.0, 0.6));
        let seen = estimate(10.0, 0.5);
        let measured = Resting { angle: seen.angle, angle_rad2: seen.angle_rad2 };
        assert_eq!(ledger.resting(&seen), measured);
        assert_eq!(ledger.taught(&seen, &MapCorrection::default()), MapCorrection::default());
        ledger.watch(&estimate(0.0, 100.0));
        assert_ne!(ledger.resting(&seen), measured);
        ledger.close();
        assert_eq!(ledger.resting(&seen), measured);
    }

    /// What a throw or a stride turns is not known well enough to carry anything over.
    #[test]
    fn law_only_fine_bursts_carry_over() {
        for family in Family::ALL {
            let mut ledger = stepped();
            if let Some(entry) = &mut ledger.entry {
                entry.family = family;
                entry.forgotten = true;
            }
            let seen = estimate(9.5, 0.5);
            let carried = ledger.resting(&seen).angle_rad2 < 0.99 * seen.angle_rad2;
            assert_eq!(carried, !matches!(family, Family::Stride | Family::Throw), "{family:?}");
        }
    }

    #[test]
    fn law_a_contradiction_drops_the_forecast() {
        let mut ledger = stepped();
        ledger.watch(&estimate(0.0, 100.0));
        let elsewhere = estimate(14.0, 0.5);
        assert_eq!(ledger.resting(&elsewhere).angle, elsewhere.angle);
    }

    #[test]
    fn exact_a_burst_is_compared_once() {
        let mut ledger = stepped();
        ledger.watch(&estimate(0.0, 100.0));
        let comparison = ledger.compare(&estimate(8.0, 0.3)).unwrap();
        assert!((comparison.turned_rad.to_degrees() - 2e-3).abs() < 1e-6);
        assert!((comparison.turned_rad2 / estimate(0.0, 0.5).angle_rad2 - 1.0).abs() < 1e-4);
        assert_eq!(ledger.compare(&estimate(8.0, 0.3)), None);
    }

    /// The same bursts and measurements through three states in `f64`, written out as matrices.
    #[test]
    fn dual_angle_and_factors_are_one_kalman_filter() {
        use nalgebra::{Matrix3, RowVector3, Vector3};

        let mut correction = MapCorrection::default();
        let mut ledger = RestFilter::default();
        let [[step, across], [_, walk]] =
            [Family::Step, Family::Walk].map(|family| correction.covariances(family).map(f64::from));
        let mut seen = estimate(30.0, 0.6);
        let mut x = Vector3::new(1e-3 * 30_f64.to_radians(), 1.0, 1.0);
        let mut p = Matrix3::new(f64::from(seen.angle_rad2), 0.0, 0.0, 0.0, step, across, 0.0, across, walk);
        for (family, wanted_mdeg, seen_mdeg, sigma_mdeg) in
            [(Family::Walk, 15.0, 16.0, 0.9), (Family::Step, 5.0, 10.2, 0.5), (Family::Step, 2.0, 7.8, 0.3)]
        {
            let burst = family.burst((1e-3_f32 * wanted_mdeg).to_radians(), 1.0).unwrap();
            correction = ledger.taught(&seen, &correction);
            let forecast = correction.forecast(family, &burst);
            ledger.enter(family, burst, forecast, &seen, &correction);
            ledger.watch(&estimate(0.0, 1000.0));
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
        let resting = ledger.resting(&seen);
        assert!((resting.angle.degrees() - x[0].to_degrees()).abs() < 2e-7);
        assert!((f64::from(resting.angle_rad2) / p[(0, 0)] - 1.0).abs() < 1e-3);
        let taught = ledger.taught(&seen, &correction);
        for (family, place) in [(Family::Step, 1), (Family::Walk, 2)] {
            assert!((f64::from(taught.scale(family)) - x[place]).abs() < 1e-4, "{family:?}");
            let variance = f64::from(taught.covariances(family)[place - 1]);
            assert!((variance / p[(place, place)] - 1.0).abs() < 1e-3, "{family:?}");
        }
    }
}
