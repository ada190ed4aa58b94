//! Whether neighbouring innovations have a common sign: the frames' evidence against a process that is too sure (F18).
//!
//! The innovations of a consistent filter are white. Where the kicks of a filter are wrong, or less certain than it
//! says, each innovation is within the camera's noise, but their mean is not. With weights of `1 / n` for the newest,
//! the mean of n white innovations of variance S has the variance `S / (2 n - 1)`, so
//!
//! ```text
//! m <- m + (nu - m) / n,    T <- T + ((2 n - 1) m^2 / S - T) / N        T = 1 if they are white, n: 3.2 ms, N: 25.6 ms
//! ```
//!
//! Of frames that are noisier than the camera says, with a mean z of `nu^2 / S` above 2, `S z / 2` stands for S: then T
//! is 2 if they are white. A wrong kick makes z large as well, but its error stays.
//!
//! T is about the mean of 16 squares. It exceeds 8 in a consistent filter once in 10^18 times N. Quantisation is not
//! white where the rotor turns slowly, and kicks are not normal: of motors that the model describes T reaches 5.

use motor_model::Real;

use crate::camera::track_tuning::TrackTuning;

/// T beyond which the innovations are no longer white.
const COLOURED: f64 = 8.0;

/// Running mean of the innovations, and of its square per its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InnovationCorrelation<T> {
    mean_rad: T,
    /// T, and the square of the mean per its variance after the last innovation.
    square: T,
    pub(crate) last_square: Option<T>,
}

impl<T: Real> InnovationCorrelation<T> {
    pub(crate) fn white() -> Self {
        Self { mean_rad: T::zero(), square: T::one(), last_square: None }
    }

    /// Takes in an innovation; `per_variance` is one over its variance, as it is or as the frames show it.
    pub(crate) fn take(&mut self, innovation_rad: T, per_variance: T, tuning: &TrackTuning<T>) {
        self.mean_rad += (innovation_rad - self.mean_rad) * tuning.per_neighbours;
        let square = self.mean_rad * self.mean_rad * per_variance * tuning.independent_neighbours;
        self.square += (square - self.square) * tuning.per_residual_frames;
        self.last_square = Some(square);
    }

    /// Whether neighbours have a common sign more often than chance allows.
    pub(crate) fn is_coloured(&self) -> bool {
        self.square > T::from_f64(COLOURED)
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;

    /// Whether T exceeds its limit at any of `frames` innovations of variance 1, with an error that lasts for 32 frames
    /// with either sign beside.
    fn coloured(error: f64, frames: u32) -> Option<u32> {
        let (tuning, mut rng) = (TrackTuning::<f64>::default(), Pcg64::seed_from_u64(7));
        let mut correlation = InnovationCorrelation::white();
        (0..frames).find(|frame| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let sign = if (frame / 32) % 2 == 0 { 1.0 } else { -1.0 };
            correlation.take(noise + sign * error, 1.0, &tuning);
            correlation.is_coloured()
        })
    }

    /// White innovations stay white for 30 s. An error of two standard deviations that lasts for 32 frames, within the
    /// gate of each, is told: its mean swings by `2 tanh(1/2)`, so that T goes towards `63 * 0.85 / 3 = 18`.
    #[test]
    fn law_a_common_sign_is_told_and_noise_is_not() {
        assert_eq!(coloured(0.0, 300_000), None);
        assert!(coloured(2.0, 512).is_some());
    }

    #[test]
    fn exact_no_number_is_coloured_by_itself() {
        let tuning = TrackTuning::<f32>::default();
        let mut correlation = InnovationCorrelation::white();
        (0..1000).for_each(|_| correlation.take(0.0, f32::INFINITY, &tuning));
        assert!(!correlation.is_coloured());
    }
}
