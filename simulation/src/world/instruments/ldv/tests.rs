//! The vibrometer against its model, fault by fault.

use super::*;
use crate::world::pose::Pose;
use crate::world::rotor_path::RotorPoint;

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
    let mut ldv = Ldv::new(&Scene::of_sets(&sets).unwrap());
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
    let expected: Vec<LdvSample> = (0..60).filter(|i| !(20..40).contains(i)).map(|i| without[i]).collect();
    assert_eq!(lost, expected);
}

/// 12 bits over +-20 mm/s: every sample is a whole number of steps of 40 mm/s / 4096, saturates at the range, and has
/// the variance of noise and of uniform quantisation. A variance of 40,000 samples is known to 0.7 %.
#[test]
fn exact_samples_of_12_bits_lie_on_the_grid_and_saturate() {
    let step = 0.04 / 4096.0;
    let sets = ["ldv.bits=12", "ldv.range_m_s=0.02", "ldv.noise_m_s=1e-5"];
    let samples = shown(&sets, 0.003_217, 40_000);
    for sample in &samples {
        let steps = f64::from(sample.velocity_m_s) / step;
        // f32 holds the sample to 2^-24 of it.
        assert!((steps - steps.round()).abs() < 1e-4, "{steps}");
    }
    let square =
        |s: &LdvSample| (f64::from(s.velocity_m_s) - 0.003_217) * (f64::from(s.velocity_m_s) - 0.003_217);
    let mean_square = samples.iter().map(square).sum::<f64>() / 4e4;
    assert!((mean_square / (1e-10 + step * step / 12.0) - 1.0).abs() < 0.03, "{mean_square}");
    for (given, expected) in [(0.5, 0.02_f32), (-0.5, -0.02)] {
        assert!(shown(&sets, given, 10).iter().all(|s| (s.velocity_m_s - expected).abs() < 1e-9));
    }
}

#[test]
fn exact_without_a_vibrometer_none_is_due() {
    let point =
        |micros| RotorPoint { at: Time::from_micros(micros), velocity_m_s: 0.1, ..RotorPoint::default() };
    for (set, samples) in [("ldv.installed=no", 0), ("ldv.installed=yes", 200)] {
        let mut ldv = Ldv::new(&Scene::of_sets(&[set.to_owned()]).unwrap());
        ldv.follow(&RotorPath { from: point(0), until: point(1000), struck: false });
        assert_eq!(std::iter::from_fn(|| ldv.read()).count(), samples, "{set}");
    }
}

/// A rotor that falls at 4 mm/s and tilts at 5 and -3 1/s: `v_z + eta' . X` at 3.8 mm and 30 degrees, `v_z` at the
/// axis.
#[test]
fn exact_the_spot_shows_the_tilt_where_it_is() {
    let point = |micros| RotorPoint {
        at: Time::from_micros(micros),
        velocity_m_s: -4e-3,
        pose: Pose { slope_rate_s: [5.0, -3.0], ..Pose::LEVEL },
        ..RotorPoint::default()
    };
    let half_root_3 = 0.5 * math::sqrt(3.0);
    let at_the_spot = -4e-3 + 3.8e-3 * (5.0 * half_root_3 - 3.0 * 0.5);
    for (sets, expected) in [
        (&["ldv.radius_m=3.8e-3", "ldv.angle_deg=30", "ldv.noise_m_s=0"][..], at_the_spot),
        (&["ldv.angle_deg=30", "ldv.noise_m_s=0"], -4e-3),
    ] {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        let mut ldv = Ldv::new(&Scene::of_sets(&sets).unwrap());
        ldv.follow(&RotorPath { from: point(0), until: point(10), struck: false });
        let shown = f64::from(ldv.read().unwrap().velocity_m_s);
        assert!((shown / expected - 1.0).abs() < 1e-6, "{sets:?}: {shown} {expected}");
    }
}

/// Within its time a vibrometer loses a third of its samples, shows 10 mm/s more, or a tenth of outliers; before it
/// none of them.
#[test]
fn law_faults_by_chance_and_an_offset_have_their_time() {
    let exact = "ldv.noise_m_s=0";
    let of = |fault: &str| shown(&[exact, &format!("faults={fault}"), "ldv.outlier_m_s=0.1"], 0.1, 40_000);
    let later =
        |samples: &[LdvSample]| samples.iter().filter(|s| s.taken_at >= Time::from_micros(100_000)).count();
    let lost = of("ldv:intermittent:0.333@0.1..");
    // Of 20,000 draws the count is known to 67.
    assert!(lost.len() - later(&lost) == 20_000 && later(&lost).abs_diff(13_340) < 268, "{}", later(&lost));
    for (n, sample) in of("ldv:offset:0.01@0.1.. ldv:offset:-0.03@0.15..").iter().enumerate() {
        let expected = if n < 20_000 {
            0.1
        } else if n < 30_000 {
            0.11
        } else {
            0.08
        };
        assert!((sample.velocity_m_s - expected).abs() < 1e-7, "{n}: {sample:?}");
    }
    let errors: Vec<f64> =
        of("ldv:outliers:0.1@0.1..").iter().map(|s| f64::from(s.velocity_m_s) - 0.1).collect();
    assert!(errors[..20_000].iter().all(|error| error.abs() < 1e-7));
    let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / 2e4;
    // 2,000 outliers: their mean square is known to 3 %, their number to 2 %.
    assert!((mean_square / (0.1 * 1e-2) - 1.0).abs() < 0.15, "{mean_square}");
}
