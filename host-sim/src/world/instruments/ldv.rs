//! A laser-Doppler vibrometer (LDV) on the rotor: its vertical velocity at one point, with white noise.
//!
//! Default noise: 0.2 mm/s a sample at 200,000 samples/s, that is 0.6 um/s per root hertz, the order of a vibrometer of
//! the paper's kind on a coarse range.
//!
//! ```text
//! sample = clamp((1 + gain error) velocity + bias + noise + outlier, -range, range)
//! ```
//!
//! Off unless a scene sets them:
//!
//! | what | model |
//! |---|---|
//! | gain error and bias | of the decoder |
//! | outlier, drop-out | of the speckle: a Gaussian error; a sample that does not exist |
//! | saturation | the range clamps the sample |
//! | loss | samples within the outage do not exist |
//! | fault, from one time to another | the last value again, zeros, the wrong sign, or no number |

use std::collections::VecDeque;

use estimator::LdvSample;
use motor_model::Time;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::FaultWindow;
use crate::math::random_streams::{self, RandomFault, RandomSource};
use crate::scene::Scene;

/// What a faulty vibrometer delivers.
#[derive(Clone, Copy, Debug)]
enum LdvFault {
    /// The last value before the fault.
    Stuck,
    Zeros,
    /// The velocity's negative.
    Inverted,
    NotANumber,
}

/// The vibrometer, with the samples that are not yet read.
#[derive(Clone, Debug)]
pub struct Ldv {
    noise_m_s: f64,
    noise: Pcg64,
    drop: RandomFault,
    outlier: RandomFault,
    outlier_m_s: f64,
    range_m_s: f64,
    gain: f64,
    bias_m_s: f64,
    outage: FaultWindow,
    fault: Option<(LdvFault, FaultWindow)>,
    /// The last value without a fault.
    shown_m_s: f32,
    unread: VecDeque<LdvSample>,
}

impl Ldv {
    /// The vibrometer of a scene.
    pub fn new(scene: &Scene) -> Self {
        let seed = scene.seed();
        let fault = |source, probability| RandomFault::new(seed, source, scene.number(probability));
        let range_m_s = scene.number("ldv.range_m_s");
        Self {
            noise_m_s: scene.number("ldv.noise_m_s"),
            noise: random_streams::stream(seed, RandomSource::Ldv),
            drop: fault(RandomSource::LdvDrop, "ldv.drop_probability"),
            outlier: RandomFault::in_bursts(
                seed,
                RandomSource::LdvOutlier,
                scene.number("ldv.outlier_probability"),
                scene.number("ldv.outlier_burst_samples"),
            ),
            outlier_m_s: scene.number("ldv.outlier_m_s"),
            range_m_s: if range_m_s > 0.0 { range_m_s } else { f64::INFINITY },
            gain: 1.0 + scene.number("ldv.gain_error"),
            bias_m_s: scene.number("ldv.bias_m_s"),
            outage: FaultWindow::of(scene, "ldv.lost_from_s", "ldv.lost_until_s"),
            fault: Self::fault(scene),
            shown_m_s: 0.0,
            unread: VecDeque::new(),
        }
    }

    fn fault(scene: &Scene) -> Option<(LdvFault, FaultWindow)> {
        let fault = match scene.choice("ldv.fault") {
            "stuck" => LdvFault::Stuck,
            "zeros" => LdvFault::Zeros,
            "inverted" => LdvFault::Inverted,
            "not_a_number" => LdvFault::NotANumber,
            _ => return None,
        };
        Some((fault, FaultWindow::of(scene, "ldv.fault_from_s", "ldv.fault_until_s")))
    }

    /// The value that is delivered, with the fault at `now` if there is one.
    fn with_fault(&mut self, now: Time, velocity_m_s: f32) -> f32 {
        match self.fault.filter(|(_, span)| span.covers(now)) {
            Some((LdvFault::Stuck, _)) => self.shown_m_s,
            Some((LdvFault::Zeros, _)) => 0.0,
            Some((LdvFault::Inverted, _)) => -velocity_m_s,
            Some((LdvFault::NotANumber, _)) => f32::NAN,
            None => {
                self.shown_m_s = velocity_m_s;
                velocity_m_s
            }
        }
    }

    /// Takes a sample.
    pub fn sample(&mut self, now: Time, velocity_m_s: f64) {
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        let outlier = self.outlier.occurs().map_or(0.0, |rng| StandardNormal.sample(rng));
        if self.drop.occurs().is_some() || self.outage.covers(now) {
            return;
        }
        let shown_m_s =
            self.gain * velocity_m_s + self.bias_m_s + self.noise_m_s * noise + self.outlier_m_s * outlier;
        #[expect(clippy::cast_possible_truncation, reason = "the instrument delivers f32")]
        let velocity_m_s = shown_m_s.clamp(-self.range_m_s, self.range_m_s) as f32;
        let velocity_m_s = self.with_fault(now, velocity_m_s);
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

    /// Samples of a rotor that rises at `velocity_m_s`, every 5 us.
    fn shown(sets: &[&str], velocity_m_s: f64, n: u64) -> Vec<LdvSample> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        let mut ldv = Ldv::new(&Scene::load(None, &sets).unwrap());
        (0..n).for_each(|i| ldv.sample(Time::from_micros(5 * i), velocity_m_s));
        std::iter::from_fn(|| ldv.read()).collect()
    }

    #[test]
    fn exact_gain_bias_and_range() {
        for (sets, given, expected) in [
            (["ldv.gain_error=0.02", "ldv.bias_m_s=0"], 0.1, 0.102),
            (["ldv.gain_error=-0.1", "ldv.bias_m_s=0.003"], 0.1, 0.093),
            (["ldv.range_m_s=0.05", "ldv.bias_m_s=0"], 0.1, 0.05),
            (["ldv.range_m_s=0.05", "ldv.gain_error=0.5"], -0.1, -0.05),
            (["ldv.range_m_s=0.05", "ldv.bias_m_s=0.01"], 0.02, 0.03),
        ] {
            let seen = shown(&[sets[0], sets[1], "ldv.noise_m_s=0"], given, 1)[0].velocity_m_s;
            assert!((f64::from(seen) - expected).abs() < 1e-8, "{sets:?}: {seen}");
        }
    }

    #[test]
    fn law_drop_outs_and_outliers_have_their_frequency_and_size() {
        let kept = shown(&["ldv.drop_probability=0.25"], 0.0, 40_000).len();
        assert!(kept.abs_diff(30_000) < 350, "{kept}");
        let sets = ["ldv.noise_m_s=0", "ldv.outlier_probability=0.1", "ldv.outlier_m_s=0.2"];
        let samples = shown(&sets, 0.0, 40_000);
        let outliers = samples.iter().filter(|sample| sample.velocity_m_s.abs() > 0.0).count();
        assert!(outliers.abs_diff(4000) < 240, "{outliers}");
        let square = |sample: &LdvSample| f64::from(sample.velocity_m_s) * f64::from(sample.velocity_m_s);
        let mean_square = samples.iter().map(square).sum::<f64>() / 4e4;
        assert!((mean_square / (0.1 * 0.04) - 1.0).abs() < 0.15, "{mean_square}");
    }

    /// From the twentieth sample to the fortieth; before and after as without a fault.
    #[test]
    fn exact_faulty_samples() {
        let good = shown(&[], 0.1, 60);
        for (fault, expected) in [
            ("ldv.fault=stuck", (|good, _| good[19].velocity_m_s) as fn(&[LdvSample], f32) -> f32),
            ("ldv.fault=zeros", |_, _| 0.0),
            ("ldv.fault=inverted", |_, value| -value),
            ("ldv.fault=not_a_number", |_, _| f32::NAN),
        ] {
            let faulty = shown(&[fault, "ldv.fault_from_s=1e-4", "ldv.fault_until_s=2e-4"], 0.1, 60);
            for (n, (faulty, right)) in faulty.iter().zip(&good).enumerate() {
                let value = right.velocity_m_s;
                let expected = if (20..40).contains(&n) { expected(&good, value) } else { value };
                assert_eq!(faulty.velocity_m_s.to_bits(), expected.to_bits(), "{fault} {n}");
            }
        }
    }

    #[test]
    fn exact_a_lost_vibrometer_delivers_nothing_of_the_loss_and_its_noise_goes_on() {
        let lost = shown(&["ldv.lost_from_s=1e-4", "ldv.lost_until_s=2e-4"], 0.1, 60);
        let without = shown(&[], 0.1, 60);
        let expected: Vec<LdvSample> =
            (0..60).filter(|i| !(20..40).contains(i)).map(|i| without[i]).collect();
        assert_eq!(lost, expected);
    }
}
