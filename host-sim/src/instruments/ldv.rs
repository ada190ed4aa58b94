//! A laser-Doppler vibrometer on the rotor: its vertical velocity at one point, with white noise.
//!
//! Default noise: 0.2 mm/s a sample at 200,000 samples/s, that is 0.6 um/s per root hertz, the order of a vibrometer of the paper's
//! kind on a coarse range.

use std::collections::VecDeque;

use estimator::LdvSample;
use motor_model::Time;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::chance::{self, Source};
use crate::scene::{Kind, Scene, Setting};

/// The vibrometer's settings.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "ldv.sample_rate_hz",
        unit: "Hz",
        kind: Kind::Number { default: 200_000.0, min: 10_000.0, max: 1e6 },
        meaning: "samples a second",
    },
    Setting {
        key: "ldv.noise_m_s",
        unit: "m/s",
        kind: Kind::Number { default: 2e-4, min: 0.0, max: 1.0 },
        meaning: "standard deviation of a sample's noise",
    },
];

/// The vibrometer, and the samples not yet read.
#[derive(Clone, Debug)]
pub struct Ldv {
    noise_m_s: f64,
    noise: Pcg64,
    unread: VecDeque<LdvSample>,
}

impl Ldv {
    /// The vibrometer of a scene.
    pub fn new(scene: &Scene) -> Self {
        Self {
            noise_m_s: scene.number("ldv.noise_m_s"),
            noise: chance::stream(scene.seed(), Source::Ldv),
            unread: VecDeque::new(),
        }
    }

    /// Takes a sample.
    pub fn sample(&mut self, now: Time, velocity_m_s: f64) {
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        #[expect(clippy::cast_possible_truncation, reason = "the instrument delivers f32")]
        let velocity_m_s = (velocity_m_s + self.noise_m_s * noise) as f32;
        self.unread.push_back(LdvSample { taken_at: now, velocity_m_s });
    }

    /// The oldest sample not yet read.
    pub fn read(&mut self) -> Option<LdvSample> {
        self.unread.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_noise_has_its_standard_deviation_and_no_bias() {
        let mut ldv = Ldv::new(&Scene::default());
        let n = 40_000;
        for i in 0..n {
            ldv.sample(Time::from_micros(5 * i), 0.1);
        }
        let errors: Vec<f64> =
            std::iter::from_fn(|| ldv.read()).map(|s| f64::from(s.velocity_m_s) - 0.1).collect();
        assert_eq!(errors.len(), 40_000);
        let mean = errors.iter().sum::<f64>() / 4e4;
        let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / 4e4;
        assert!(mean.abs() < 4.0 * 2e-4 / 200.0, "{mean}");
        assert!((mean_square / 4e-8 - 1.0).abs() < 0.03, "{mean_square}");
    }
}
