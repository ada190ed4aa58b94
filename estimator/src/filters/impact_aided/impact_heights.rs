//! Impacts at heights that no tooth reaches: the evidence of a rotor that tilts.
//!
//! A rotor that moves in height alone is struck by the teeth, whose crests go up and down by the amplitude A of mode B
//! at most. So between two impacts it has risen or fallen by less than A: it meets the teeth in the upper half of their
//! swing. The middle of a rotor that tilts is struck at any height, by a tooth beside it:
//!
//! | impacts beyond A | of |
//! |---|---|
//! | fewer than one in 3,000, most of them where the drive changes | a rotor that moves in height alone |
//! | one in 10 to one in 50 | a rotor that tilts, mode B |
//!
//! The cumulative sum of the logarithm of their likelihood ratio (F22; Page, Biometrika 41, 100, 1954) tells one from
//! the other:
//!
//! ```text
//! beyond:  |h| > A + 2 t dv,  |h + h'| > A + 2 t dv  and  dv > 1.5 d
//! S <- max(0, S + ln(p1 / p0)) if beyond, else max(0, S + ln((1 - p1) / (1 - p0)));   S > 9: a rotor that tilts
//! ```
//!
//! with the height `h` above the last impact and `h'` of that one, the jump dv, the detector's threshold d, and the
//! time t between samples, in which an impact may have been at any instant. A single wrong sample seems an impact in
//! flight and makes h and the next one large, but not their sum. False alarms are no larger than d, and 1.5 d of a
//! vibrometer that is half as noisy again as described. A bias b of the vibrometer adds b times the time of a flight:
//! one of 1.5 mm/s or more shows a tilt that is none, until rest has taught it.

use motor_model::Real;

/// `ln(p1 / p0)`, and `ln((1 - p1) / (1 - p0))`, for the shares `p0 = 0.0003` and `p1 = 0.05` of the impacts.
const BEYOND: f64 = 5.116;
const WITHIN: f64 = -0.050_993;

/// S that shows a rotor that tilts: two impacts beyond reach in some 20.
const TILTS: f64 = 9.0;

/// The heights of the impacts so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImpactHeights<T> {
    /// The height of the last impact above that before it, in m; 0 where it is not known.
    last_m: T,
    /// S.
    sum: T,
}

impl<T: Real> ImpactHeights<T> {
    pub(super) fn new() -> Self {
        Self { last_m: T::zero(), sum: T::zero() }
    }

    /// Takes an impact `height_m` above the last one, where the teeth reach `reach_m`; it is `sure` if it is no false
    /// alarm. Whether the rotor tilts; then the evidence begins anew.
    pub(super) fn show_tilt(&mut self, height_m: T, reach_m: T, sure: bool) -> bool {
        let since_before_m = height_m + core::mem::replace(&mut self.last_m, height_m);
        let beyond = sure && height_m.abs() > reach_m && since_before_m.abs() > reach_m;
        self.sum = (self.sum + T::from_f64(if beyond { BEYOND } else { WITHIN })).at_least(T::zero());
        let tilts = self.sum > T::from_f64(TILTS);
        if tilts {
            self.sum = T::zero();
        }
        tilts
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Bernoulli, Distribution as _};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;

    const REACH_M: f64 = 20e-6;

    /// Share of the impacts that are beyond reach, of a rotor that moves in height alone and of one that tilts.
    const P0: f64 = 3e-4;
    const P1: f64 = 0.05;

    /// Takes impacts in turn; the number of the first that shows a rotor that tilts.
    fn first_shown(heights_m: impl IntoIterator<Item = f64>) -> Option<usize> {
        let mut heights = ImpactHeights::<f64>::new();
        heights_m.into_iter().position(|height_m| heights.show_tilt(height_m, REACH_M, true))
    }

    #[test]
    fn dual_the_steps_of_the_sum_are_the_logarithms_of_the_ratio() {
        assert!((BEYOND - (P1 / P0).ln()).abs() < 1e-3);
        assert!((WITHIN - ((1.0 - P1) / (1.0 - P0)).ln()).abs() < 1e-6);
    }

    /// The second impact beyond reach shows it, up to 24 impacts after the first, and then the evidence begins anew.
    /// Impacts within reach never do, nor does a wrong sample in flight, after which the rotor comes down to where it
    /// was.
    #[test]
    fn exact_two_impacts_beyond_reach_show_a_rotor_that_tilts() {
        let with_between = |between: usize| {
            let within = core::iter::repeat_n(1e-6, between);
            first_shown(core::iter::once(30e-6).chain(within).chain([-30e-6]))
        };
        assert_eq!((with_between(0), with_between(1), with_between(20)), (None, Some(2), Some(21)));
        assert_eq!(with_between(40), None);
        let mut heights = ImpactHeights::<f64>::new();
        assert_eq!([(); 4].map(|()| heights.show_tilt(30e-6, REACH_M, true)), [false, true, false, true]);
        assert_eq!(first_shown(core::iter::repeat_n([19e-6, -19e-6], 1000).flatten()), None);
        assert_eq!(first_shown([60e-6, -61e-6]), None);
        let mut of_false_alarms = ImpactHeights::<f64>::new();
        assert!(!(0..1000).any(|_| of_false_alarms.show_tilt(30e-6, REACH_M, false)));
    }

    /// Impacts beyond reach at random. With the share of a rotor that tilts the sum passes the limit after 48 impacts
    /// on average, if only pairs less than 25 apart counted: the first comes after 20, then each pair is near enough
    /// with the chance `1 - 0.95^24 = 0.71`, and `20 / 0.71 = 28`. Three that are farther apart make it sooner. With
    /// the share of one that does not tilt, pairs come once in `1 / (24 p0^2) = 460,000`: more than two in 100,000
    /// have a chance of 0.001.
    #[test]
    fn law_a_rotor_that_tilts_is_told_from_one_that_does_not() {
        let mut rng = Pcg64::seed_from_u64(5);
        let mut impacts_until_shown = |share: f64, most: usize| {
            let beyond = Bernoulli::new(share).unwrap();
            let heights_m = (0..most).map(|_| if beyond.sample(&mut rng) { 50e-6 } else { 1e-6 });
            first_shown(heights_m).map(|first| first + 1)
        };
        let delays = (0..400).map(|_| impacts_until_shown(P1, 100_000).expect("a rotor that tilts"));
        let mean = delays.sum::<usize>() as f64 / 400.0;
        assert!(mean > 30.0 && mean < 54.0, "{mean}");
        let alarms = (0..100).filter(|_| impacts_until_shown(P0, 1000).is_some()).count();
        assert!(alarms <= 2, "{alarms}");
    }
}
