//! Bias and noise of the vibrometer, learnt from a rotor that the camera shows at rest.
//!
//! ```text
//! m <- m + (v - m) / n,    s^2 <- s^2 + ((v - m)^2 - s^2) / n,    n = 1, 2, ... up to 20,000
//! ```
//!
//! | what | is used instead of the description | probability by chance, at each sample |
//! |---|---|---|
//! | bias m | when `m^2 > 36 s^2 / n` after a thousand samples, and from then on | 2e-9 |
//! | noise s | when `s^2` differs by half from that assumed, after a thousand samples | eleven standard errors |
//!
//! While the rotor runs it goes on bouncing between the teeth and the height h of its highest flight. So the mean of
//! its vertical velocity over a time T is the bias, within
//!
//! ```text
//! h / T,    h = v^2 / 2 g        v: the fastest sample of the time, of each two neighbours the slower one
//! ```
//!
//! 2 mm/s over a quarter of a second at 0.1 m/s. When that mean differs from the bias in use by a tenth more than that,
//! and by a millimetre a second, it is used. It is over time, not over samples, so that lost samples leave it as it is.
//! A time in which a sample was refused, or in which none came for a millisecond, does not count.
//!
//! Nothing is learnt in the first 20 ms of rest, while the stator rings down.

use motor_model::{Real, Time, math};

/// Samples over which mean and variance are taken: 0.1 s at 200 kHz.
const SAMPLES_MAX: f64 = 20_000.0;
/// Samples before anything is used.
const SAMPLES_MIN: f64 = 1000.0;
/// Samples from which on outliers are left out.
const SAMPLES_OF_A_SCALE: f64 = 100.0;
/// Square of the standard deviations beyond which a sample is left out.
const OUTLIER: f64 = 64.0;
/// Square of the standard errors from which on a bias is one.
const SIGNIFICANT: f64 = 36.0;
/// Factor between learnt and assumed variance from which on the learnt one is used.
const DIFFERS: f64 = 1.5;
/// Factor of the variance by which the noise in use is changed at least.
const NOTICEABLE: f64 = 1.1;
/// Time over which the mean of a running rotor is taken, in ns, and the least bias that it shows, in m/s.
const RUNNING_NANOS: u32 = 250_000_000;
const RUNNING_M_S: f64 = 1e-3;
/// The bias shows beyond so many times `h / T`: a sum over samples is off by half a sample at either end.
const HEIGHT_MARGIN: f64 = 1.1;
/// Longest time between two samples of that mean, in ns.
const GAP_NANOS: u32 = 1_000_000;
/// Time at rest before anything is learnt, in ns.
const RINGING_NANOS: u64 = 20_000_000;

/// Mean and variance of the samples at rest, and what is used of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Calibration<T> {
    gravity_m_s2: T,
    assumed_m2_s2: T,
    samples: T,
    mean_m_s: T,
    variance_m2_s2: T,
    /// What the vibrometer shows of a rotor at rest, in m/s; 0 until it is significant.
    pub(super) bias_m_s: T,
    /// Standard deviation of a sample, in m/s: as assumed, until another is learnt.
    pub(super) noise_m_s: T,
    /// From when on samples are learnt from; `None` while the rotor may move.
    from: Option<Time>,
    /// Since when the mean of the running rotor is taken.
    running_from: Option<Time>,
    /// The newest sample of the running rotor.
    newest: Time,
    /// The integral of its velocity over time.
    height_m: T,
    /// Speed of the last sample, and the fastest of the time: of each two neighbours the slower one.
    last_m_s: T,
    fastest_m_s: T,
}

impl<T: Real> Calibration<T> {
    pub(crate) fn new(assumed_m_s: T, gravity_m_s2: T) -> Self {
        let assumed_m2_s2 = assumed_m_s * assumed_m_s;
        Self { gravity_m_s2, assumed_m2_s2, noise_m_s: assumed_m_s, ..Self::default() }
    }

    /// The samples since do not count for the mean of the running rotor.
    pub(crate) fn interrupt(&mut self) {
        self.running_from = None;
    }

    /// Averages a sample of a running rotor.
    pub(crate) fn run(&mut self, velocity_m_s: T, at: Time) {
        let speed_m_s = velocity_m_s.abs();
        let slower_m_s = speed_m_s.at_most(self.last_m_s);
        let since = at.nanos_soon_after(self.newest, GAP_NANOS);
        (self.newest, self.last_m_s) = (at, speed_m_s);
        let (Some(from), Some(since)) = (self.running_from, since) else {
            (self.running_from, self.height_m, self.fastest_m_s) = (Some(at), T::zero(), T::zero());
            return;
        };
        self.height_m += velocity_m_s * (T::from_i32(since.cast_signed()) * T::from_f64(1e-9));
        self.fastest_m_s = slower_m_s.at_least(self.fastest_m_s);
        if at.nanos_soon_after(from, RUNNING_NANOS - 1).is_none() {
            self.judge_run(at.seconds_since(from));
        }
    }

    /// Uses the mean of the running rotor, if it shows a bias.
    #[cold]
    fn judge_run(&mut self, time_s: T) {
        self.running_from = None;
        let mean_m_s = self.height_m / time_s;
        let off_m_s = (mean_m_s - self.bias_m_s).abs();
        // Without gravity the height is not known, and nothing is learnt.
        let height_factor = T::from_f64(2.0 / HEIGHT_MARGIN) * self.gravity_m_s2;
        let beyond_height = off_m_s * time_s * height_factor > self.fastest_m_s * self.fastest_m_s;
        if off_m_s > T::from_f64(RUNNING_M_S) && beyond_height {
            self.bias_m_s = mean_m_s;
        }
    }

    /// Whether the rotor is at rest at `now`, by the camera.
    pub(crate) fn note_rest(&mut self, resting: bool, now: Time) {
        self.from = if resting { self.from.or(Some(now.plus_nanos(RINGING_NANOS))) } else { None };
    }

    /// Whether a sample taken at `at` is one to learn from.
    pub(crate) fn learns(&self, at: Time) -> bool {
        self.from.is_some_and(|from| at >= from)
    }

    /// Learns from a sample of a rotor at rest; returns whether bias or noise have changed.
    #[inline(never)]
    pub(crate) fn learn(&mut self, velocity_m_s: T) -> bool {
        let n = T::from_f64;
        let off_m_s = velocity_m_s - self.mean_m_s;
        let square = off_m_s * off_m_s;
        if self.samples > n(SAMPLES_OF_A_SCALE) && square > n(OUTLIER) * self.variance_m2_s2 + n(1e-12) {
            return false;
        }
        if self.samples < n(SAMPLES_MAX) {
            self.samples += T::one();
        }
        let weight = T::one() / self.samples;
        self.mean_m_s += weight * off_m_s;
        if self.samples > T::one() {
            self.variance_m2_s2 += weight * (square - self.variance_m2_s2);
        }
        self.samples >= n(SAMPLES_MIN) && self.adopt()
    }

    /// Uses what differs from the description.
    fn adopt(&mut self) -> bool {
        let n = T::from_f64;
        let significant = self.mean_m_s * self.mean_m_s * self.samples > n(SIGNIFICANT) * self.variance_m2_s2;
        let biased = self.bias_m_s.abs() > T::zero();
        let mut changed = significant && !biased;
        if significant || biased {
            self.bias_m_s = self.mean_m_s;
        }
        let differs = |x: T, y: T, factor: f64| x > n(factor) * y || y > n(factor) * x;
        let as_assumed = !differs(self.variance_m2_s2, self.assumed_m2_s2, DIFFERS);
        let best_m2_s2 = if as_assumed { self.assumed_m2_s2 } else { self.variance_m2_s2 };
        if differs(best_m2_s2, self.noise_m_s * self.noise_m_s, NOTICEABLE) {
            self.noise_m_s = T::from_f32(math::sqrt_f32(best_m2_s2.to_f32()));
            changed = true;
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// What is learnt in 0.2 s of a vibrometer of this bias and noise that was assumed to have none and 0.2 mm/s.
    fn learnt(bias_m_s: f64, noise_m_s: f64, seed: u64) -> Calibration<f32> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut calibration = Calibration::<f32>::new(2e-4, 9.81);
        for n in 0..40_000 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            // Every thousandth sample is a wrong one.
            let wrong = if n % 1000 == 999 { 0.3 } else { 0.0 };
            calibration.learn((bias_m_s + noise_m_s * noise + wrong) as f32);
        }
        calibration
    }

    /// Bias within six standard errors over 20,000 samples, noise within a tenth.
    #[test]
    fn law_bias_and_noise_are_learnt() {
        for (bias_m_s, noise_m_s) in [(1e-3, 2e-4), (0.05, 2e-4), (-3e-3, 1e-2), (0.01, 5e-5), (0.0, 2e-3)] {
            for seed in 0..5 {
                let learnt = learnt(bias_m_s, noise_m_s, seed);
                let error = (f64::from(learnt.bias_m_s) - bias_m_s).abs();
                assert!(error < 6.0 * noise_m_s / 141.0, "{bias_m_s} {noise_m_s} {error}");
                let noise = f64::from(learnt.noise_m_s) / noise_m_s;
                assert!((noise - 1.0).abs() < 0.1, "{bias_m_s} {noise_m_s} {noise}");
            }
        }
    }

    /// A rotor that bounces by 60 um at 500 a second: a bias of 3 mm/s is found to 0.4, none is not.
    #[test]
    fn law_a_bias_is_learnt_while_the_rotor_runs() {
        for bias_m_s in [3e-3, 0.0] {
            let mut calibration = Calibration::<f32>::new(2e-4, 9.81);
            for n in 0..120_000_u64 {
                let flight = (n % 400) as f64 / 400.0;
                let shown = bias_m_s + 0.1 * (1.0 - 2.0 * flight);
                calibration.run(shown as f32, Time::from_micros(5 * n));
            }
            let learnt = f64::from(calibration.bias_m_s);
            assert!((learnt - bias_m_s).abs() < 4e-4, "{bias_m_s} {learnt}");
            assert!(bias_m_s > 0.0 || learnt.to_bits() == 0);
        }
    }

    /// A rotor that is thrown up by 0.1 m/s every 20 ms, to half a millimetre, shows no bias wherever in a flight the
    /// time ends; a bias above h / T is found.
    #[test]
    fn law_a_high_flight_is_no_bias() {
        for (bias_m_s, length) in [(0.0, 4000), (0.0, 4079), (0.0, 4200), (5e-3, 4079)] {
            let mut calibration = Calibration::<f32>::new(2e-4, 9.81);
            for n in 0..400_000_u64 {
                let shown = bias_m_s + 9.81 * 5e-6 * (0.5 * length as f64 - (n % length) as f64);
                calibration.run(shown as f32, Time::from_micros(5 * n));
            }
            let learnt = f64::from(calibration.bias_m_s);
            assert!((learnt - bias_m_s).abs() < 0.5e-3 / 0.25, "{length} {bias_m_s} {learnt}");
            assert!(bias_m_s > 0.0 || learnt.to_bits() == 0, "{length} {learnt}");
        }
    }

    /// Samples lost for 0.1 s, and a third of them lost at any time, show no bias: what the rotor moves meanwhile is
    /// not one.
    #[test]
    fn law_lost_samples_are_no_bias() {
        for lost in [|n: u64| (20_000..40_000).contains(&n), |n: u64| n.wrapping_mul(0x9E37_79B9) % 97 < 32] {
            let mut calibration = Calibration::<f32>::new(2e-4, 9.81);
            for n in (0..200_000_u64).filter(|&n| !lost(n)) {
                // Flights of 2.1 ms to a height of 5 um and of 7.9 ms to 76 um, in turn.
                let phase = n % 2000;
                let (of, length) = if phase < 420 { (phase, 420.0) } else { (phase - 420, 1580.0) };
                let shown = 9.81 * 5e-6 * (0.5 * length - of as f64);
                calibration.run(shown as f32, Time::from_micros(5 * n));
            }
            assert_eq!(calibration.bias_m_s.to_bits(), 0, "{}", calibration.bias_m_s);
        }
    }

    /// A vibrometer that is as described is used as described, to the bit.
    #[test]
    fn exact_nothing_changes_where_the_description_is_right() {
        for seed in 0..20 {
            let learnt = learnt(0.0, 2e-4, seed);
            assert_eq!((learnt.bias_m_s.to_bits(), learnt.noise_m_s.to_bits()), (0, 2e-4_f32.to_bits()));
        }
    }
}
