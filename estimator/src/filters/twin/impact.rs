//! From a measured impact to a kick: the regime, the stator filter, or neither.

use motor_model::{Real, Time};

use super::TwinFilter;
use super::kick_record::KickRecord;
use super::measured_impact::{ExplainedImpact, MeasuredImpact, Uncertain};
use super::misfit_monitor::MisfitMonitor;
use super::rotor::FactorKnowledge;
use super::told::ToldKick;
use crate::innovation::{ContactInnovation, ImpactInnovation, Rejection, Verdict};

/// A longer time without samples, in s, leaves open which pair was in contact, and where: a quarter of mode A's period.
const LONGEST_WITHIN_S: f64 = 31e-6;

/// What a jump that is too large for noise and fits no pair counts as in the mean misfit. Two impacts within a period
/// make some, after which the stator filter finds the motion again; twenty in a row show that it does not.
const UNASSOCIATED_MISFIT: f64 = 20.0;

impl<T: Real> TwinFilter<T> {
    /// Takes in an impact within the period that ends at `at`; returns its innovations, if the stator filter was asked.
    #[inline(never)]
    pub(super) fn take_impact(
        &mut self,
        at: Time,
        impact: &MeasuredImpact<T>,
    ) -> Option<ImpactInnovation<T>> {
        self.unrefined_jump = None;
        if self.detector.has_fault() || self.told.is_false_alarm() {
            return None;
        }
        if self.update_regime(impact) && !self.told.bounces() {
            self.record_kick(self.riding_kick(at, impact));
            return None;
        }
        self.stator_follows &=
            self.drive.mode().is_some() || impact.jump_m_s > self.tuning.contact.landing_m_s;
        if !self.stator_follows {
            self.record_kick(self.unexplained_kick(at, impact));
            return None;
        }
        if impact.within_s > T::from_f64(LONGEST_WITHIN_S) {
            self.raise_at_midpoint(impact);
            self.stator.forget_motion();
            self.record_kick(self.unexplained_kick(at, impact));
            return None;
        }
        let (kick, contact, verdict) = self.update_stator(at, impact);
        self.record_kick(kick);
        Some(ImpactInnovation { taken_at: at, contact, verdict })
    }

    /// Updates the stator filter by an impact; returns the kick, the innovations and what became of them.
    fn update_stator(
        &mut self,
        at: Time,
        impact: &MeasuredImpact<T>,
    ) -> (KickRecord<T>, ContactInnovation<T>, Verdict) {
        let refused = Verdict::Rejected(Rejection::Gate);
        let updated = self.stator.update_by_impact(impact, &self.tuning);
        let (contact, misfit) = match &updated {
            Ok(explained) => (explained.innovation, Some(explained.misfit)),
            Err(unassociated) => {
                let misfit = (!impact.may_be_noise()).then_some(T::from_f64(UNASSOCIATED_MISFIT));
                (unassociated.innovation, misfit)
            }
        };
        let contradicts = misfit.is_some_and(|misfit| self.misfit.note(misfit));
        self.review_kick_use(at);
        if contradicts || !self.stator.is_sound() {
            self.contradict(at);
            self.review_kick_use(at);
            return (self.unexplained_kick(at, impact), contact, Verdict::Restarted);
        }
        let explained = match updated {
            Ok(explained) => explained,
            Err(unassociated) => {
                self.raise_at_midpoint(impact);
                let kick = if impact.may_be_noise() {
                    self.unassociated_kick(at, impact, unassociated)
                } else {
                    self.unexplained_kick(at, impact)
                };
                return (kick, contact, refused);
            }
        };
        self.keep_learnt(at);
        self.unrefined_jump = Some(Uncertain { value: impact.jump_m_s, variance: impact.jump_m2_s2 });
        if self.misfit.accepts(explained.misfit) {
            (self.explained_kick(at, impact.within_s, &explained), contact, Verdict::Used)
        } else {
            (self.unexplained_kick(at, impact), contact, refused)
        }
    }

    /// The height after an impact at the middle of the time since the last sample, where its instant is not known.
    fn raise_at_midpoint(&mut self, impact: &MeasuredImpact<T>) {
        self.stator.height_m += T::from_f64(0.5) * impact.within_s * impact.jump_m_s;
    }

    /// The kick of an explained impact. The sample `within_s` before `at` did not show it: it is later than that one.
    fn explained_kick(&self, at: Time, within_s: T, explained: &ExplainedImpact<T>) -> KickRecord<T> {
        let (c, s) = (self.kick_per_jump_rad_m, self.per_radius_m);
        let ExplainedImpact { back, jump, tooth_velocity, .. } = *explained;
        let whole_nanos = |seconds: T| (seconds * T::from_f64(1e9)).whole();
        let back_nanos = whole_nanos(back.value).min(whole_nanos(within_s) - 1);
        KickRecord {
            at: Time::from_nanos(at.nanos().saturating_add_signed(-i64::from(back_nanos))),
            at_s2: back.variance,
            kick_max_rad_s: Uncertain { value: c * jump.value, variance: c * c * jump.variance },
            tooth_rate_rad_s: Uncertain {
                value: s * tooth_velocity.value,
                variance: s * s * tooth_velocity.variance * self.misfit.variance_inflation(),
            },
            unknown_rad2_s2: self.undetected_rad2_s2(),
            refinable: true,
            factors: FactorKnowledge::AsBefore,
            told: ToldKick::nothing(),
        }
    }

    /// Variance of the kicks by impacts below the detector's threshold. Where those are many, as under a rotor that
    /// hops on a weakly driven stator, the detected ones fit the model badly, so it grows with the mean misfit.
    pub(super) fn undetected_rad2_s2(&self) -> T {
        let threshold_rad_s = self.kick_per_jump_rad_m * self.detector.threshold_m_s();
        self.tuning.chatter_rad2_s2
            + self.tuning.undetected_part2
                * (self.misfit.variance_inflation() - T::one())
                * threshold_rad_s
                * threshold_rad_s
    }

    /// Noise variance of a vibrometer sample at the scale that was learnt.
    pub(super) fn sample_m2_s2(&self) -> T {
        self.detector.noise_m_s() * self.detector.noise_m_s()
    }

    /// Restarts the stator filter and puts it on probation: its estimates contradict the impacts.
    pub(super) fn restart_stator(&mut self) {
        self.stator.restart();
        self.misfit = MisfitMonitor::on_probation();
        self.unrefined_jump = None;
    }
}

#[cfg(test)]
mod tests {
    use motor_model::MotorParams;

    use super::*;
    use crate::filters::twin::{CheckedMotor, TwinTuning};
    use crate::instruments::Instruments;

    /// An impact at the very start of its period, between the samples at 995 and 1,000 us: the first of them did not
    /// show it, so its kick is later. One at the end acts at the second.
    #[test]
    fn exact_a_kick_is_later_than_the_sample_before_it() {
        let params = MotorParams::nominal();
        let tuning = TwinTuning::<f64>::new(&params, &Instruments::default());
        let filter = TwinFilter::new(&CheckedMotor::try_new(&params).unwrap(), &tuning);
        for (back_s, at_nanos) in [(5e-6, 995_001), (2e-6, 998_000), (0.0, 1_000_000)] {
            let known = |value: f64| Uncertain { value, variance: 0.0 };
            let innovation =
                ContactInnovation { gap_m: 0.0, gap_m2: 1.0, approach_m_s: 0.0, approach_m2_s2: 1.0 };
            let explained = ExplainedImpact {
                back: known(back_s),
                jump: known(0.05),
                tooth_velocity: known(0.02),
                innovation,
                misfit: 0.0,
            };
            let kick = filter.explained_kick(Time::from_micros(1000), 5e-6, &explained);
            assert_eq!(kick.at.nanos(), at_nanos);
        }
    }
}
