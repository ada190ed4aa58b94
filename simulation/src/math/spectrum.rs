//! Spectrum of a sampled motion, and its largest line below a limit.
//!
//! The amplitude at bin k is `2 |X_k| / N` of the discrete Fourier transform, without the mean and without a window:
//! a sine of amplitude A at a bin has amplitude A.
//!
//! Every frequency and amplitude of impacts is read this way, from the last [`SAMPLES_MAX`] samples at
//! [`SAMPLE_RATE_HZ`], below [`LIMIT_HZ`]. The vertical motion is chaotic and its spectrum broad. The amplitude of
//! the largest line falls with the length of the record, so that it is meaningful only with a stated length.

use std::collections::VecDeque;
use std::sync::Arc;

use super::count::real;
use motor_model::math;
use rustfft::algorithm::{BluesteinsAlgorithm, Radix4};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};

/// Samples per second.
pub const SAMPLE_RATE_HZ: f64 = 20_000.0;
/// Longest record that is transformed.
pub const SAMPLES_MAX: usize = 16_384;
/// Highest frequency of impacts; lines of the drive and above are no impacts.
pub const LIMIT_HZ: f64 = 5000.0;

/// The transform of `count` values. The whole tail is a power of two; Bluestein's algorithm takes any other count by a
/// transform of a power of two. The library's planner knows more ways: a fifth of this crate's code would be theirs.
fn transform(count: usize) -> Arc<dyn Fft<f64>> {
    let radix_4 = |length| Radix4::new(length, FftDirection::Forward);
    if count.is_power_of_two() {
        Arc::new(radix_4(count))
    } else {
        Arc::new(BluesteinsAlgorithm::new(count, Arc::new(radix_4((2 * count - 1).next_power_of_two()))))
    }
}

/// The last samples of a signal.
#[derive(Clone, Debug, Default)]
pub struct Tail {
    samples: VecDeque<f64>,
}

impl Tail {
    /// Adds a sample, and drops the oldest when there are more than [`SAMPLES_MAX`].
    pub fn push(&mut self, sample: f64) {
        if self.samples.len() == SAMPLES_MAX {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    /// Number of samples held.
    #[expect(clippy::len_without_is_empty, reason = "nobody asks")]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// The spectrum of the samples held.
    pub fn spectrum(&self, sample_rate_hz: f64) -> Spectrum {
        Spectrum::of(self.samples.iter().copied(), sample_rate_hz)
    }
}

/// A line of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralLine {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Amplitude, in the unit of the signal.
    pub amplitude: f64,
}

/// Amplitudes at the bins from 0 to half the sample rate.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// One line a bin; the first is at frequency 0, where the mean is removed.
    pub lines: Vec<SpectralLine>,
}

impl Spectrum {
    /// The spectrum of `samples`.
    pub fn of(samples: impl IntoIterator<Item = f64>, sample_rate_hz: f64) -> Self {
        Self::of_values(samples.into_iter().map(Complex::from).collect(), sample_rate_hz)
    }

    fn of_values(mut values: Vec<Complex<f64>>, sample_rate_hz: f64) -> Self {
        let count = values.len();
        if count == 0 {
            return Self { lines: Vec::new() };
        }
        let mean = values.iter().sum::<Complex<f64>>() / real(count);
        for value in &mut values {
            *value -= mean;
        }
        transform(count).process(&mut values);
        let scale = 2.0 / real(count);
        let line = |(bin, value): (usize, &Complex<f64>)| SpectralLine {
            frequency_hz: real(bin) * sample_rate_hz / real(count),
            amplitude: scale * math::sqrt(value.norm_sqr()),
        };
        Self { lines: values.iter().enumerate().take(count / 2 + 1).map(line).collect() }
    }

    /// The largest line above 0 and below `limit_hz`.
    pub fn largest_below(&self, limit_hz: f64) -> Option<SpectralLine> {
        let candidates = self.lines.iter().skip(1).take_while(|line| line.frequency_hz < limit_hz);
        candidates.copied().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    fn sine(frequency_hz: f64, amplitude: f64, time_s: f64) -> f64 {
        amplitude * math::sin_cos(TAU * frequency_hz * time_s).0
    }

    /// Bin 360 of 16384 at 20 kHz, with a larger line above 5 kHz, a smaller one below, and a mean.
    #[test]
    fn exact_a_sine_at_a_bin_shows_its_amplitude() {
        let bin_hz = SAMPLE_RATE_HZ / 16_384.0;
        let mut tail = Tail::default();
        for index in 0..20_000_u32 {
            let t = f64::from(index) / SAMPLE_RATE_HZ;
            let motion = sine(360.0 * bin_hz, 1.48e-3, t)
                + sine(90.0 * bin_hz, 1e-3, t)
                + sine(6111.0 * bin_hz, 1.0, t);
            tail.push(7.0 + motion);
        }
        assert_eq!(tail.len(), SAMPLES_MAX);
        let largest = tail.spectrum(SAMPLE_RATE_HZ).largest_below(LIMIT_HZ).unwrap();
        assert!((largest.frequency_hz - 439.453_125).abs() < 1e-9);
        assert!((largest.amplitude - 1.48e-3).abs() < 1e-12);
    }

    /// Every count by itself, against the sum that defines the transform: powers of two, primes and products. Forty
    /// terms below 1, each rounded a few times, are right to 1e-13.
    #[test]
    fn exact_amplitudes_are_those_of_the_defining_sum() {
        for count in 1..=40_u32 {
            let samples: Vec<f64> = (0..count).map(|i| f64::from((i * 7919 + 13) % 1049) / 1049.0).collect();
            let mean = samples.iter().sum::<f64>() / f64::from(count);
            for (bin, line) in (0..).zip(Spectrum::of(samples.iter().copied(), f64::from(count)).lines) {
                let (mut re, mut im) = (0.0, 0.0);
                for (i, sample) in (0..).zip(&samples) {
                    let (sin, cos) = math::sin_cos(TAU * f64::from(bin * i % count) / f64::from(count));
                    re += (sample - mean) * cos;
                    im -= (sample - mean) * sin;
                }
                let amplitude = 2.0 / f64::from(count) * math::sqrt(re * re + im * im);
                assert!((line.frequency_hz - f64::from(bin)).abs() < 1e-12);
                assert!(
                    (line.amplitude - amplitude).abs() < 1e-13,
                    "{count}: {} for {amplitude}",
                    line.amplitude
                );
            }
        }
    }

    /// Parseval for a real signal of odd length: mean square = half the sum of the squared amplitudes.
    #[test]
    fn law_energy_is_that_of_the_lines() {
        let samples: Vec<f64> = (0..1001_u32).map(|i| f64::from((i * 7919) % 104_729) / 104_729.0).collect();
        let mean = samples.iter().sum::<f64>() / 1001.0;
        let power = samples.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 1001.0;
        let lines = Spectrum::of(samples.iter().copied(), 1.0).lines;
        let of_lines = lines.iter().map(|line| 0.5 * line.amplitude * line.amplitude).sum::<f64>();
        assert!((of_lines / power - 1.0).abs() < 1e-12);
    }

    #[test]
    fn exact_nothing_in_nothing() {
        assert_eq!(Tail::default().spectrum(1.0).largest_below(1.0), None);
        assert_eq!(Spectrum::of([1.0].into_iter(), 1.0).largest_below(1.0), None);
    }
}
