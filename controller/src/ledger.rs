//! What is known of a resting rotor's angle across bursts.
//!
//! While it is struck, a filter forgets where the rotor was: after the drive it measures anew. But a short burst turns the rotor by little more or less than foreseen,
//! so what was known before, moved on by the forecast, is as good as a measurement of its own:
//!
//! ```text
//! from before:  a = a0 + turn,  variance V = P0 + variance of the turn        measured since:  b, variance P
//! together:     (a P + b V) / (P + V),  variance P V / (P + V)
//! ```
//!
//! A second of measuring is then not lost to a correction of a milli-degree. This holds for steps and walks, which a motor repeats. Both must be independent: only when the filter's variance has been [`FORGOTTEN`] times the one before is what it
//! knows new. And where they contradict each other the burst did something else: what was foreseen is dropped.

use estimator::Estimate;
use motor_model::Angle;

use crate::correction::{Correction, Forecast};
use crate::response_map::{Burst, Family, sense};

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

/// A burst, what was known before it, and what it was foreseen to do.
#[derive(Clone, Copy, Debug)]
struct Entry {
    family: Family,
    burst: Burst,
    before: Resting,
    forecast: Forecast,
    forgotten: bool,
    learnt: bool,
}

/// How a burst compared with its forecast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Foreseen turn in rad, in the sense of the mode.
    pub foreseen_rad: f32,
    /// Measured turn in rad, in the sense of the mode.
    pub turned_rad: f32,
    /// Variance of the measured turn in rad^2.
    pub turned_rad2: f32,
}

/// The last burst, if what came before it still counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    entry: Option<Entry>,
}

impl Ledger {
    /// Forgets everything: the drive was more than a burst, or the estimate was lost.
    pub fn close(&mut self) {
        self.entry = None;
    }

    /// Enters a burst that begins now.
    pub fn enter(&mut self, family: Family, burst: Burst, before: Resting, forecast: Forecast) {
        self.entry = Some(Entry { family, burst, before, forecast, forgotten: false, learnt: false });
    }

    /// Watches the filter forget; for every tick.
    pub fn watch(&mut self, estimate: &Estimate<f32>) {
        if let Some(entry) = &mut self.entry {
            entry.forgotten |= estimate.angle_rad2 > FORGOTTEN * entry.before.angle_rad2;
        }
    }

    /// Where the rotor rests, by what was known before the last burst and what was measured since.
    pub fn resting(&self, estimate: &Estimate<f32>) -> Resting {
        let measured = Resting { angle: estimate.angle, angle_rad2: estimate.angle_rad2 };
        let Some(Entry { family, before, forecast, forgotten: true, .. }) = self.entry else {
            return measured;
        };
        // What the others turn is too far from a normal law to be a measurement.
        if !matches!(family, Family::Step | Family::Walk) {
            return measured;
        }
        let turn = Angle::from_radians(sense(family.mode()) * forecast.turn_rad);
        let foreseen = before.angle.plus(turn);
        let foreseen_rad2 = before.angle_rad2 + forecast.turn_rad2;
        let apart_rad: f32 = measured.angle.radians_since(foreseen);
        let both_rad2 = foreseen_rad2 + measured.angle_rad2;
        if apart_rad * apart_rad > CONTRADICTION * both_rad2 {
            return measured;
        }
        let part = foreseen_rad2 / both_rad2;
        Resting {
            angle: foreseen.plus(Angle::from_radians(apart_rad * part)),
            angle_rad2: measured.angle_rad2 * part,
        }
    }

    /// Compares the last burst with its forecast and lets `correction` learn from it, if it is to; once a burst.
    pub fn settle(
        &mut self,
        estimate: &Estimate<f32>,
        correction: Option<&mut Correction>,
    ) -> Option<Comparison> {
        let entry = self.entry.as_mut().filter(|entry| entry.forgotten && !entry.learnt)?;
        entry.learnt = true;
        let sense = sense(entry.family.mode());
        let turned_rad = sense * estimate.angle.radians_since::<f32>(entry.before.angle);
        let turned_rad2 = entry.before.angle_rad2 + estimate.angle_rad2;
        if let Some(correction) = correction {
            correction.learn(entry.family, &entry.burst, turned_rad, turned_rad2);
        }
        Some(Comparison { foreseen_rad: entry.forecast.turn_rad, turned_rad, turned_rad2 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::Time;

    fn estimate(mdeg: f64, sigma_mdeg: f32) -> Estimate<f32> {
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
    fn stepped() -> Ledger {
        let mut ledger = Ledger::default();
        let Estimate { angle, angle_rad2, .. } = estimate(10.0, 0.4);
        let forecast = Forecast { turn_rad: 1e-3_f32.to_radians(), turn_rad2: estimate(0.0, 0.3).angle_rad2 };
        ledger.enter(Family::Step, Family::Step.bursts()[0], Resting { angle, angle_rad2 }, forecast);
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
        ledger.watch(&estimate(0.0, 100.0));
        assert_ne!(ledger.resting(&seen), measured);
        ledger.close();
        assert_eq!(ledger.resting(&seen), measured);
    }

    /// What a throw turns is not known well enough to carry anything over.
    #[test]
    fn law_only_steps_and_walks_carry_over() {
        for family in Family::ALL {
            let mut ledger = stepped();
            if let Some(entry) = &mut ledger.entry {
                entry.family = family;
                entry.forgotten = true;
            }
            let seen = estimate(9.5, 0.5);
            let carried = ledger.resting(&seen).angle_rad2 < 0.99 * seen.angle_rad2;
            assert_eq!(carried, matches!(family, Family::Step | Family::Walk), "{family:?}");
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
        let mut correction = Correction::default();
        let comparison = ledger.settle(&estimate(8.0, 0.3), Some(&mut correction)).unwrap();
        assert!((comparison.turned_rad.to_degrees() - 2e-3).abs() < 1e-6);
        assert!((comparison.turned_rad2 / estimate(0.0, 0.5).angle_rad2 - 1.0).abs() < 1e-4);
        assert!(correction.scale(Family::Step) > 1.0);
        assert_eq!(ledger.settle(&estimate(8.0, 0.3), Some(&mut correction)), None);
    }
}
