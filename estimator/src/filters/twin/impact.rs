//! From a measured impact to a kick: the regime, the stator filter, or neither.

use motor_model::{Real, Time};

use super::measured_impact::ExplainedImpact;
use super::{KickRecord, MeasuredImpact, MisfitMonitor, TwinFilter, TwinTuning, Uncertain};
use crate::innovation::{ContactInnovation, ImpactInnovation, Rejection, Verdict};

/// A longer time without samples, in s, leaves open which pair was in contact, and where: a quarter of mode A's period.
const LONGEST_WITHIN_S: f64 = 31e-6;

/// Without drive the first jump below this ends the updates of the stator, in m/s: a rotor that lands chatters and
/// slides, which the contact measurements do not describe. Assumed.
const LANDING_M_S: f64 = 1e-2;

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
        self.stator_follows &= self.drive.mode().is_some() || impact.jump_m_s > T::from_f64(LANDING_M_S);
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
        let uniform_s2 = impact.within_s * impact.within_s * T::from_f64(1.0 / 12.0);
        let (instant_s2, beside_m_s) = (self.told.instant_s2(uniform_s2), self.tuning.tooth_velocity_m_s);
        let updated = self.stator.update_by_impact(impact, instant_s2, self.told.pair(), beside_m_s);
        let (contact, misfit) = match &updated {
            Ok(explained) => (explained.innovation, Some(explained.misfit)),
            Err(unassociated) => {
                let misfit = (!impact.may_be_noise()).then_some(T::from_f64(UNASSOCIATED_MISFIT));
                (unassociated.innovation, misfit)
            }
        };
        let contradicts = misfit.is_some_and(|misfit| self.misfit.note(misfit));
        self.review_kick_use(at);
        if contradicts || !self.stator.is_sound_after(&contact) {
            self.contradict(at);
            self.review_kick_use(at);
            return (self.unexplained_kick(at, impact), contact, Verdict::Restarted);
        }
        let explained = match updated {
            Ok(explained) => explained,
            Err(unassociated) => {
                self.raise_at_midpoint(impact);
                let kick = if impact.may_be_noise() {
                    self.unassociated_kick(at, impact, unassociated.excess_misfit)
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
        let (c, s) = (self.tuning.without_stator.kick_per_jump_rad_m, self.per_radius_m);
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
            ..KickRecord::default()
        }
    }

    /// Variance of the kicks by impacts below the detector's threshold. Where those are many, as under a rotor that
    /// hops on a weakly driven stator, the detected ones fit the model badly, so it grows with the mean misfit.
    pub(super) fn undetected_rad2_s2(&self) -> T {
        let TwinTuning { without_stator, chatter_rad2_s2, undetected_part2, .. } = &self.tuning;
        let threshold_rad_s = without_stator.kick_per_jump_rad_m * self.detector.threshold_m_s();
        let part2 = *undetected_part2 * (self.misfit.variance_inflation() - T::one());
        *chatter_rad2_s2 + part2 * threshold_rad_s * threshold_rad_s
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
    use motor_model::{DriveCommand, DriveMode, MotorParams};

    use super::*;
    use crate::filter::AngleFilter as _;
    use crate::filters::twin::CheckedMotor;
    use crate::filters::twin::states::{HEIGHT, INSTANT};
    use crate::filters::twin::tests::filter;
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

    /// A jump of 0.05 m/s over `within_s`, of a rotor that fell.
    fn jump(within_s: f64) -> MeasuredImpact<f64> {
        MeasuredImpact {
            before_m_s: -0.02,
            jump_m_s: 0.05,
            jump_m2_s2: 4e-8,
            within_s,
            behind_s: 0.0,
            drift_m_s: 0.0,
        }
    }

    /// An impact anywhere in 30 us is compared with the model, one in 32 us is not: its kick is unexplained, the motion
    /// is forgotten, and it counts in the middle of the time, since when the rotor has risen.
    #[test]
    fn exact_an_impact_in_a_long_gap_does_not_update_the_stator() {
        for (micros, compared) in [(30, true), (32, false)] {
            let mut filter = filter::<f64>();
            filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
            let before = filter.stator.clone();
            let within_s = 1e-6 * f64::from(micros);
            let innovation = filter.take_impact(Time::from_micros(1000), &jump(within_s));
            assert_eq!(innovation.is_some(), compared, "{micros}");
            if !compared {
                let risen_m = filter.stator.height_m - before.height_m;
                assert!((risen_m - 0.5 * within_s * 0.05).abs() < 1e-15, "{risen_m}");
                let wider = |state: usize| {
                    filter.stator.covariance.variances()[state] > 10.0 * before.covariance.variances()[state]
                };
                assert!((HEIGHT..INSTANT).all(wider));
                assert!(filter.stator.parameters == before.parameters);
            }
        }
    }

    /// Without drive a jump of 12 mm/s updates the stator, one of 8 mm/s is the weight's and ends that, so that the
    /// next of 12 mm/s does not. When the drive goes on, the stator follows again, and its motion is not known.
    #[test]
    fn exact_a_rotor_that_lands_does_not_update_the_stator() {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::OFF);
        let mut compared = |micros: u64, jump_m_s: f64| {
            let impact = MeasuredImpact { jump_m_s, ..jump(5e-6) };
            filter.take_impact(Time::from_micros(micros), &impact).is_some()
        };
        assert_eq!(
            [compared(1000, 0.012), compared(2000, 0.008), compared(3000, 0.012)],
            [true, false, false]
        );
        let before = filter.stator.covariance.variances();
        filter.drive(Time::from_micros(4000), DriveCommand::full(DriveMode::B));
        let after = filter.stator.covariance.variances();
        assert!((HEIGHT..INSTANT).all(|state| after[state] > 2.0 * before[state]), "{before} {after}");
        assert!(filter.take_impact(Time::from_micros(5000), &jump(5e-6)).is_some());
    }
}
