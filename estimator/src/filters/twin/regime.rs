//! The regime of a driven rotor: it bounces on the teeth or rides on them.
//!
//! Weakly driven teeth throw the rotor only little: a dozen impacts below the detector's threshold `d` carry most of
//! its weight. One detected impact then is the sum of several, each some `d` in size, by both pairs of teeth. Taken as
//! one impact of one pair it would give a kick of `c d` and a wrong update of the stator. In truth the teeth that
//! carry the rotor pull it to and fro within a period, and friction holds its rate to the mean of theirs: kicks cancel
//! to a fifth of `c d`.
//!
//! The statistic is the mean over the impacts of the jump less the drift of the flight before it by undetected impacts
//! (the drift is small in free flight):
//!
//! ```text
//! (dv - drift) / d    0.9 to 1.1 riding,    2 and more bouncing            measured in simulation, modes B and C
//!
//!              mean < RIDING_BELOW
//!   bouncing ------------------------> riding: kicks of small variance and unknown sign, no update of the stator
//!      ^                                 |
//!      +---------------------------------+
//!        mean > BOUNCING_ABOVE: height 0, motion unknown;   drive off or rest: mean AT_START
//! ```

use motor_model::{Real, Time};

use super::{KickRecord, MeasuredImpact, TwinFilter};

/// Impacts over which the mean is taken: 3 ms of riding.
const AVERAGED_IMPACTS: f64 = 32.0;
/// Mean below which a bouncing rotor rides, and above which a riding one bounces: between the values above, with
/// hysteresis.
const RIDING_BELOW: f64 = 1.3;
const BOUNCING_ABOVE: f64 = 1.5;
/// Most that an impact counts, so that one wrong sample cannot end a riding regime of mean 1.
const RATIO_MAX: f64 = 8.0;
/// Mean at the start: a rotor that leaves rest counts as bouncing until the mean is lower.
const AT_START: f64 = 4.0;

/// The jump of a riding rotor up to which it is the weight's, per the threshold. What exceeds it kicks as in mode C.
const WEIGHT_MAX: f64 = 1.4;

/// Variance of the kick by an impact of a riding rotor, per the square of a kick at the detector's threshold: a fifth
/// of that kick, measured in simulation.
const RIDING_PART2: f64 = 0.04;

/// Running mean of the jumps per the detector's threshold, and the regime that follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RegimeDetector<T> {
    mean: T,
    pub(super) riding: bool,
}

impl<T: Real> RegimeDetector<T> {
    /// For a rotor at rest: it will bounce.
    pub(super) fn new() -> Self {
        Self { mean: T::from_f64(AT_START), riding: false }
    }

    /// Takes an impact in: its jump, the drift of the flight before it, and the detector's threshold; all in m/s.
    pub(super) fn note(&mut self, jump_m_s: T, drift_m_s: T, threshold_m_s: T) {
        let ratio = ((jump_m_s - drift_m_s) / threshold_m_s).clamp_magnitude(T::from_f64(RATIO_MAX));
        self.mean += (ratio - self.mean) * T::from_f64(1.0 / AVERAGED_IMPACTS);
        let limit = if self.riding { BOUNCING_ABOVE } else { RIDING_BELOW };
        self.riding = self.mean < T::from_f64(limit);
    }
}

impl<T: Real> TwinFilter<T> {
    /// Takes an impact in; returns whether the rotor rides on the teeth. Where the riding regime ends, the rotor is
    /// within a swing of the teeth, and the impacts of the stator before are not known.
    pub(super) fn update_regime(&mut self, impact: &MeasuredImpact<T>) -> bool {
        let was_riding = self.regime.riding;
        if self.drive.mode().is_some() {
            self.regime.note(impact.jump_m_s, impact.drift_m_s, self.detector.threshold_m_s());
        } else {
            self.regime = RegimeDetector::new();
        }
        let riding = self.regime.riding;
        if was_riding && !riding {
            self.stator.height_m = T::zero();
            self.stator.forget_motion();
        }
        riding
    }

    /// The kick by an impact of a riding rotor.
    pub(super) fn riding_kick(&self, at: Time, impact: &MeasuredImpact<T>) -> KickRecord<T> {
        let square = |x: T| x * x;
        let (constants, threshold_m_s) = (&self.tuning.without_stator, self.detector.threshold_m_s());
        let (jump_m_s, weight_m_s) = (impact.jump_m_s, T::from_f64(WEIGHT_MAX) * threshold_m_s);
        let excess_m2_s2 =
            if jump_m_s > weight_m_s { square(jump_m_s) - square(weight_m_s) } else { T::zero() };
        let unknown_m2_s2 =
            T::from_f64(RIDING_PART2) * square(threshold_m_s) + constants.unexplained * excess_m2_s2;
        KickRecord::of_unknown_sign(at, square(constants.kick_per_jump_rad_m) * unknown_m2_s2)
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode};

    use super::*;
    use crate::filter::AngleFilter as _;

    /// After n impacts of ratio b the mean is `b + (4 - b) (31/32)^n`: below 1.3 for b = 1 from n = 73 on, and from
    /// there above 1.5 by the first impact of 8, but not by one of 7.
    #[test]
    fn exact_the_riding_regime_begins_and_ends_by_the_mean() {
        let mut regime = RegimeDetector::<f64>::new();
        let begun = (1..1000).find(|_| {
            regime.note(2e-3, 1e-3, 1e-3);
            regime.riding
        });
        assert_eq!(begun, Some(73));
        let (mut by_seven, mut by_many) = (regime, regime);
        by_seven.note(7e-3, 0.0, 1e-3);
        by_many.note(1.0, 0.0, 1e-3);
        assert!(by_seven.riding && !by_many.riding);
    }

    /// NaN and infinity end the riding regime, and never begin it.
    #[test]
    fn law_numbers_that_are_none_do_not_make_a_rotor_ride() {
        for (jump, drift) in [(f64::NAN, 0.0), (f64::INFINITY, f64::INFINITY), (0.0, f64::NAN)] {
            let mut regime = RegimeDetector::<f64>::new();
            (0..1000).for_each(|_| regime.note(jump, drift, 1e-3));
            assert!(!regime.riding, "{jump} {drift}");
        }
    }

    /// Where a rotor leaves the riding regime it is at the teeth, whatever was integrated while it rode.
    #[test]
    fn exact_a_rotor_that_leaves_the_teeth_starts_at_them() {
        let mut filter = crate::filters::twin::tests::filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
        let threshold_m_s = filter.detector.threshold_m_s();
        (0..200).for_each(|_| filter.regime.note(threshold_m_s, 0.0, threshold_m_s));
        filter.stator.height_m = 1e-4;
        let impact = MeasuredImpact {
            before_m_s: 0.0,
            jump_m_s: threshold_m_s,
            jump_m2_s2: 4e-8,
            within_s: 5e-6,
            behind_s: 0.0,
            drift_m_s: 0.0,
        };
        assert!(filter.update_regime(&impact) && filter.stator.height_m > 0.0);
        let thrown = MeasuredImpact { jump_m_s: 1.0, ..impact };
        (0..3).for_each(|_| {
            filter.update_regime(&thrown);
        });
        assert!(!filter.regime.riding);
        assert_eq!(filter.stator.height_m.to_bits(), 0);
    }
}
