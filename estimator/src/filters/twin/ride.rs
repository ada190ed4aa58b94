//! Whether the rotor bounces on the teeth or rides on them.
//!
//! Weakly driven teeth throw the rotor so low that a dozen blows below the detector's threshold `d` carry most of its weight; what is heard as one blow then is the sum of several,
//! some `d` high, by both pairs of teeth. Taken for one tooth's it would kick the rate by `c d` and teach the stator nonsense. In truth the teeth that carry the
//! rotor pull it to and fro within a period, and friction holds its rate to that of the drive's mean: kicks cancel to a fifth of `c d`.
//!
//! The mean over the blows of what is heard, less what the flight before has been moved by unheard (never much in free flight), tells:
//!
//! ```text
//! (dv - moved) / d    0.9 to 1.1 riding,    2 and more bouncing; blows beyond 8 count as 8, so that one wrong sample does not end a ride
//! ```

use motor_model::{Real, Time};

use super::TwinFilter;
use super::contact::Blow;
use super::driven::Strike;

/// Blows over which the mean is taken: 3 ms of a ride.
const BLOWS: f64 = 32.0;
/// Mean below which a rotor that bounced rides, and above which one that rode bounces.
const RIDING_BELOW: f64 = 1.3;
const BOUNCING_ABOVE: f64 = 1.5;
/// Most that a blow counts.
const BLOW_MOST: f64 = 8.0;
/// Mean assumed at the start: what begins from rest is a bounce until it is known better.
const AT_START: f64 = 4.0;

/// A ridden blow below this, per the threshold, is the weight's; what it is beyond kicks as in mode C.
const RIDDEN_MOST: f64 = 1.4;

/// Running mean of the blows per the detector's threshold, and what follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ride<T> {
    mean: T,
    riding: bool,
}

impl<T: Real> Ride<T> {
    /// Of a rotor that has not been struck.
    pub(super) fn new() -> Self {
        Self { mean: T::from_f64(AT_START), riding: false }
    }

    /// Takes a blow in: its jump, how far the flight before had been moved below the threshold, and that; all in m/s.
    pub(super) fn note(&mut self, jump_m_s: T, unheard_m_s: T, threshold_m_s: T) {
        let blow = ((jump_m_s - unheard_m_s) / threshold_m_s).clamp_magnitude(T::from_f64(BLOW_MOST));
        self.mean += (blow - self.mean) * T::from_f64(1.0 / BLOWS);
        let limit = if self.riding { BOUNCING_ABOVE } else { RIDING_BELOW };
        self.riding = self.mean < T::from_f64(limit);
    }

    /// Whether the rotor rides.
    pub(super) fn is_riding(&self) -> bool {
        self.riding
    }
}

impl<T: Real> TwinFilter<T> {
    /// Whether the rotor rides on the teeth. Where that ends it is within a swing of them, and the stator has been struck by nobody knows what.
    pub(super) fn rides(&mut self, blow: &Blow<T>) -> bool {
        let rode = self.ride.is_riding();
        if self.drive.mode().is_some() {
            self.ride.note(blow.jump_m_s, blow.unheard_m_s, self.detector.threshold_m_s());
        } else {
            self.ride = Ride::new();
        }
        let rides = self.ride.is_riding();
        if rode && !rides {
            self.stator.height_m = T::zero();
            self.stator.forget_motion();
        }
        rides
    }

    /// The kick of a blow under a rotor that rides on the teeth.
    pub(super) fn ridden(&self, at: Time, blow: &Blow<T>) -> Strike<T> {
        let square = |x: T| x * x;
        let threshold_m_s = self.detector.threshold_m_s();
        let weight_m_s = T::from_f64(RIDDEN_MOST) * threshold_m_s;
        let beyond_m2_s2 =
            if blow.jump_m_s > weight_m_s { square(blow.jump_m_s) - square(weight_m_s) } else { T::zero() };
        let unknown_m2_s2 =
            self.tuning.ridden_part2 * square(threshold_m_s) + self.aided.unexplained * beyond_m2_s2;
        Strike::unknown(at, square(self.limit_per_jump_rad_m) * unknown_m2_s2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After n blows of b the mean is `b + (4 - b) (31/32)^n`: below 1.3 for b = 1 from n = 73 on, and from there above 1.5 by the first blow of 8, but not by one of 7.
    #[test]
    fn exact_a_ride_begins_and_ends_by_the_mean() {
        let mut ride = Ride::<f64>::new();
        let begun = (1..1000).find(|_| {
            ride.note(2e-3, 1e-3, 1e-3);
            ride.is_riding()
        });
        assert_eq!(begun, Some(73));
        let (mut by_seven, mut by_many) = (ride, ride);
        by_seven.note(7e-3, 0.0, 1e-3);
        by_many.note(1.0, 0.0, 1e-3);
        assert!(by_seven.is_riding() && !by_many.is_riding());
    }

    /// What is no number ends a ride, and begins none.
    #[test]
    fn law_nonsense_is_no_ride() {
        for (jump, unheard) in [(f64::NAN, 0.0), (f64::INFINITY, f64::INFINITY), (0.0, f64::NAN)] {
            let mut ride = Ride::<f64>::new();
            (0..1000).for_each(|_| ride.note(jump, unheard, 1e-3));
            assert!(!ride.is_riding(), "{jump} {unheard}");
        }
    }
}
