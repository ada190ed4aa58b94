//! Repeats of one measurement: their mean, and how far they lie apart.
//!
//! The variance of a repeat is estimated from what is expected of it and from what was seen, by the conjugate prior of
//! a normal variable of unknown variance (scaled inverse chi-square):
//!
//! ```text
//! variance = (nu0 expected + sum (x - mean)^2) / (nu0 + n - 1),      variance of the mean = variance / n
//! ```

/// Repeats that the expected variance counts for, `nu0`. An assumption: spreads differ between motors by a factor of
/// two, and so does the variance of four repeats.
pub(super) const EXPECTED_REPEATS: f32 = 4.0;

/// Repeats of one measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Repeats {
    count: u16,
    mean: f32,
    /// Sum of squares about the mean.
    squares: f32,
    /// Mean variance of the measurement itself.
    noise: f32,
}

impl Repeats {
    /// Adds `value`, measured with the variance `noise`. No more than 65,535 are counted.
    pub fn add(&mut self, value: f32, noise: f32) {
        let Some(count) = self.count.checked_add(1) else { return };
        let before = value - self.mean;
        self.count = count;
        self.mean += before / f32::from(count);
        self.squares += before * (value - self.mean);
        self.noise += (noise - self.noise) / f32::from(count);
    }

    /// How many.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Their mean; 0 of none.
    pub fn mean(&self) -> f32 {
        self.mean
    }

    /// Sum of squares about the mean.
    pub fn squares(&self) -> f32 {
        self.squares
    }

    /// Degrees of freedom of [`Self::squares`].
    pub fn freedom(&self) -> f32 {
        f32::from(self.count.saturating_sub(1))
    }

    /// Mean variance of the measurement itself.
    pub fn noise(&self) -> f32 {
        self.noise
    }

    /// Variance of one repeat, of which `expected` is expected beside the measurement's own.
    pub fn variance(&self, expected: f32) -> f32 {
        (EXPECTED_REPEATS * (expected + self.noise) + self.squares) / (EXPECTED_REPEATS + self.freedom())
    }

    /// Variance of the mean; `None` of none.
    pub fn mean_variance(&self, expected: f32) -> Option<f32> {
        (self.count > 0).then(|| self.variance(expected) / f32::from(self.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1, 2, 3 and 6: mean 3, squares 14. With 0.5 expected and 0.25 of noise: (4 * 0.75 + 14) / 7, a quarter of it.
    #[test]
    fn exact_mean_and_variances() {
        let mut repeats = Repeats::default();
        assert_eq!(repeats.mean_variance(1.0), None);
        for value in [1.0, 2.0, 3.0, 6.0] {
            repeats.add(value, 0.25);
        }
        assert_eq!((repeats.count(), repeats.freedom()), (4, 3.0));
        assert!((repeats.mean() - 3.0).abs() < 1e-6 && (repeats.squares() - 14.0).abs() < 1e-5);
        assert!((repeats.mean_variance(0.5).unwrap() - 17.0 / 28.0).abs() < 1e-6);
    }
}
