//! What a board sees of its instruments over a while in which no loop is armed.
//!
//! The board adds up, in single precision, and the host divides:
//!
//! ```text
//! mean = reference + S / n        sd^2 = (SS - S^2 / n) / n        S, SS: sums of (v - reference), (v - reference)^2
//! ```
//!
//! The reference is the first sample, so that a great mean does not hide a small spread. Of `n` samples the relative
//! rounding error of a sum is at most `n 2^-24`: 0.6 % of the 100,000 samples of a second.

use motor_model::math;
use serde::{Deserialize, Serialize};

/// Samples of a vibrometer, added up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VelocitySums {
    /// How many there were.
    pub samples: u32,
    /// The first of them in m/s, upwards positive; 0 of none.
    pub reference_m_s: f32,
    /// Sum of the differences from the reference, in m/s.
    pub sum_m_s: f32,
    /// Sum of their squares in (m/s)^2.
    pub sum_squares_m2_s2: f32,
    /// The largest magnitude of a sample, in m/s.
    pub largest_m_s: f32,
}

impl VelocitySums {
    /// Adds a sample. What is no finite number is passed over.
    #[inline]
    pub fn add(&mut self, velocity_m_s: f32) {
        if !velocity_m_s.is_finite() {
            return;
        }
        if self.samples == 0 {
            self.reference_m_s = velocity_m_s;
        }
        let difference = velocity_m_s - self.reference_m_s;
        self.samples = self.samples.saturating_add(1);
        self.sum_m_s += difference;
        self.sum_squares_m2_s2 += difference * difference;
        self.largest_m_s = self.largest_m_s.max(velocity_m_s.abs());
    }

    /// Their mean in m/s; `None` of none.
    pub fn mean_m_s(&self) -> Option<f64> {
        (self.samples > 0)
            .then(|| f64::from(self.reference_m_s) + f64::from(self.sum_m_s) / f64::from(self.samples))
    }

    /// Their standard deviation about the mean, in m/s; `None` of none.
    pub fn sd_m_s(&self) -> Option<f64> {
        let count = f64::from(self.samples);
        let mean = f64::from(self.sum_m_s) / count;
        (self.samples > 0)
            .then(|| math::sqrt((f64::from(self.sum_squares_m2_s2) / count - mean * mean).max(0.0)))
    }

    /// Their root mean square in m/s; `None` of none.
    pub fn rms_m_s(&self) -> Option<f64> {
        let (mean, sd) = self.mean_m_s().zip(self.sd_m_s())?;
        Some(math::sqrt(mean * mean + sd * sd))
    }
}

/// Camera frames, and how old they were when the loop would have taken them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraAges {
    /// How many there were.
    pub frames: u32,
    /// Time from the exposure of the youngest until its tick, in ns of the board's clock; below 0 of a frame that was
    /// stamped with a time to come; 0 of none.
    pub youngest_nanos: i64,
    /// The same of the oldest.
    pub oldest_nanos: i64,
}

impl CameraAges {
    /// Adds a frame of this age.
    #[inline]
    pub fn add(&mut self, age_nanos: i64) {
        if self.frames == 0 {
            (self.youngest_nanos, self.oldest_nanos) = (age_nanos, age_nanos);
        }
        self.frames = self.frames.saturating_add(1);
        self.youngest_nanos = self.youngest_nanos.min(age_nanos);
        self.oldest_nanos = self.oldest_nanos.max(age_nanos);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 1, 2, 3 and -6 mm/s about an offset of 0.1 m/s: mean and spread by hand. What is no number counts nowhere.
    #[test]
    fn exact_mean_spread_and_largest_of_four_samples() {
        let mut sums = VelocitySums::default();
        assert_eq!((sums.mean_m_s(), sums.sd_m_s(), sums.rms_m_s()), (None, None, None));
        for velocity_m_s in [0.101, 0.102, f32::NAN, 0.103, f32::INFINITY, 0.094] {
            sums.add(velocity_m_s);
        }
        assert_eq!((sums.samples, sums.largest_m_s), (4, 0.103));
        // The squares of 1, 2, 3 and -6 are 50 together. A sample of 0.1 m/s has 7.5e-9 m/s of rounding.
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 3e-8;
        assert!(near(sums.mean_m_s(), 0.1) && near(sums.sd_m_s(), 1e-3 * math::sqrt(12.5)), "{sums:?}");
        assert!(near(sums.rms_m_s(), math::sqrt(0.01 + 12.5e-6)), "{sums:?}");
        let mut down = VelocitySums::default();
        for velocity_m_s in [-0.2, 0.1] {
            down.add(velocity_m_s);
        }
        assert!((down.largest_m_s - 0.2).abs() < 1e-7, "{down:?}");
    }

    #[test]
    fn exact_youngest_and_oldest_frame() {
        let mut ages = CameraAges::default();
        for age_nanos in [300, -20, 100] {
            ages.add(age_nanos);
        }
        assert_eq!(ages, CameraAges { frames: 3, youngest_nanos: -20, oldest_nanos: 300 });
    }
}
