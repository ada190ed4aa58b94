//! The kick of an impact that the stator filter does not explain: from the mode of the drive, or from friction alone.
//!
//! ```text
//! mode B       towards the tooth's rate in pure mode B, at most c dv; the rest is noise
//! mode C       of unknown sign, variance (c dv)^2 times a part
//! drive off    clamp(S - rate, -c dv, c dv),   S = 0 +- k sqrt(v^2 + (a dv)^2)
//! ```
//!
//! `c` is the largest kick per jump, `k` the tooth's rate per rise in mode B, `a` the approach per jump; the parts of
//! the noise are those of [`crate::ImpactAidedTuning`].
//!
//! With the drive off the stator moves as little as the impacts are small. Friction then brakes a sliding rotor and
//! never accelerates it: the friction of its weight acts in the same sense a thousand times, which a noise of unknown
//! sign would not describe. Half of a resting rotor's weight is undetected and appears as the flight's drift; it adds
//! to the largest kick.

use motor_model::{DriveMode, Real, Time};

use super::{KickRecord, MeasuredImpact, TwinFilter, Uncertain};

/// Excess misfit at which an unassociated jump is a false alarm in half of the cases. Found by simulation of motors
/// drawn within the tolerances.
const EVEN_ODDS_EXCESS: f64 = 600.0;

impl<T: Real> TwinFilter<T> {
    /// The kick of an impact whose tooth is not known.
    pub(super) fn unexplained_kick(&self, at: Time, impact: &MeasuredImpact<T>) -> KickRecord<T> {
        let constants = &self.tuning.without_stator;
        let square = |x: T| x * x;
        let uncertain = |value: T, variance: T| Uncertain { value, variance };
        let c = constants.kick_per_jump_rad_m;
        let threshold_rad_s = c * self.detector.threshold_m_s();
        let approach_m_s = constants.approach_per_jump * impact.jump_m_s;
        let by_jump_rad_s = c * impact.jump_m_s;
        let bound_rad2_s2 = square(by_jump_rad_s) + square(threshold_rad_s);
        let (kick_max_rad_s, tooth_rate_rad_s, unknown_rad2_s2) = match self.drive.mode() {
            Some(DriveMode::B) => {
                let towards_rad_s = constants.turn_per_rise_rad_m * (impact.before_m_s + approach_m_s);
                (by_jump_rad_s, uncertain(towards_rad_s, T::zero()), constants.unexplained_b * bound_rad2_s2)
            }
            Some(DriveMode::C) => (T::zero(), Uncertain::default(), constants.unexplained * bound_rad2_s2),
            None => {
                let drift_m_s = if impact.drift_m_s > T::zero() { impact.drift_m_s } else { T::zero() };
                let swing_m2_s2 = square(impact.before_m_s) + square(approach_m_s);
                let tooth = uncertain(T::zero(), square(constants.turn_per_rise_rad_m) * swing_m2_s2);
                (by_jump_rad_s + c * drift_m_s, tooth, square(threshold_rad_s))
            }
        };
        KickRecord {
            at,
            kick_max_rad_s: uncertain(kick_max_rad_s, c * c * impact.jump_m2_s2),
            tooth_rate_rad_s,
            unknown_rad2_s2,
            ..KickRecord::default()
        }
    }

    /// The kick of a jump that was taken for noise: of unknown sign, the smaller the worse it fits both pairs.
    pub(super) fn unassociated_kick(
        &self,
        at: Time,
        impact: &MeasuredImpact<T>,
        excess_misfit: T,
    ) -> KickRecord<T> {
        let kick_max_rad_s = self.tuning.without_stator.kick_per_jump_rad_m * impact.jump_m_s;
        let trusted = if self.misfit.is_trusted() { excess_misfit } else { T::zero() };
        let excess = trusted * T::from_f64(1.0 / EVEN_ODDS_EXCESS);
        KickRecord::of_unknown_sign(
            at,
            T::from_f64(0.5) * kick_max_rad_s * kick_max_rad_s / (T::one() + excess * excess),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::twin::tests::filter;

    /// An impact of 0.05 m/s after a flight that drifted upwards by 0.01 m/s, from impacts too small to be detected.
    fn impact() -> MeasuredImpact<f64> {
        MeasuredImpact {
            before_m_s: -0.02,
            jump_m_s: 0.05,
            jump_m2_s2: 4e-8,
            within_s: 5e-6,
            behind_s: 0.0,
            drift_m_s: 0.01,
        }
    }

    /// Without drive the teeth brake by what all impacts of the flight may give: the detected one and those before it.
    #[test]
    fn exact_undetected_impacts_brake_too() {
        let filter = filter::<f64>();
        let kick = filter.unexplained_kick(Time::ZERO, &impact());
        let c = filter.tuning.without_stator.kick_per_jump_rad_m;
        let expected = c * (0.05 + 0.01);
        assert!((kick.kick_max_rad_s.value / expected - 1.0).abs() < 1e-12, "{kick:?}");
        let falling = MeasuredImpact { drift_m_s: -0.01, ..impact() };
        let kick = filter.unexplained_kick(Time::ZERO, &falling);
        assert!((kick.kick_max_rad_s.value / (c * 0.05) - 1.0).abs() < 1e-12);
    }

    /// A jump that both pairs misfit: the kick's variance is half of the largest kick's square, and half of that where
    /// noise is as probable as an impact. It is taken for noise only by a stator that is trusted.
    #[test]
    fn exact_a_jump_that_may_be_noise_kicks_by_its_odds() {
        let mut filter = filter::<f64>();
        let largest = filter.tuning.without_stator.kick_per_jump_rad_m * 0.05;
        let mut part = |excess_misfit: f64, trusted: bool| {
            if !trusted {
                filter.misfit = crate::filters::twin::MisfitMonitor::on_probation();
            }
            let kick = filter.unassociated_kick(Time::ZERO, &impact(), excess_misfit);
            kick.unknown_rad2_s2 / (largest * largest)
        };
        for (excess_misfit, trusted, expected) in
            [(0.0, true, 0.5), (EVEN_ODDS_EXCESS, true, 0.25), (EVEN_ODDS_EXCESS, false, 0.5)]
        {
            let own = part(excess_misfit, trusted);
            assert!((own - expected).abs() < 1e-12, "{excess_misfit} {trusted}: {own}");
        }
    }
}
