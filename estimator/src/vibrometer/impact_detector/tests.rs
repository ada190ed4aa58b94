use super::*;
use crate::instruments::VibrometerDescription;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

const NANOS: u64 = 5_000;

fn tuning(threshold: f64) -> ImpactDetectorTuning<f64> {
    ImpactDetectorTuning {
        threshold,
        ..ImpactDetectorTuning::new(&MotorParams::nominal(), &VibrometerDescription::default())
    }
}

fn sample(n: u64, velocity_m_s: f64) -> LdvSample {
    LdvSample { taken_at: Time::from_nanos(n * NANOS), velocity_m_s: velocity_m_s as f32 }
}

/// Velocity in flight after n samples, in closed form.
fn flight(tuning: &ImpactDetectorTuning<f64>, start: f64, n: u64) -> f64 {
    let terminal = tuning.gravity_m_s2 / tuning.damping_per_s;
    (start + terminal) * (-tuning.damping_per_s * 5e-6 * n as f64).exp() - terminal
}

/// A rotor that bounces, 4 ms each time, under a vibrometer of some scale and noise.
struct Bouncing {
    detector: ImpactDetector<f64>,
    /// The film's true damping per that assumed.
    damping_factor: f64,
    noise_m_s: f64,
    /// The part of its fall that pushes by the teeth below the threshold take away, once it falls with 0.6 of its first
    /// speed.
    pushed: f64,
    rng: Pcg64,
    bounces: u64,
}

impl Bouncing {
    fn new(damping_factor: f64, noise_m_s: f64, seed: u64) -> Self {
        let (detector, rng) = (ImpactDetector::new(tuning(5.0)), Pcg64::seed_from_u64(seed));
        Self { detector, damping_factor, noise_m_s, pushed: 0.0, rng, bounces: 0 }
    }

    /// So many bounces at a vibrometer of `scale`; the first and the last of them after which a wrong scale was told.
    fn bounce(&mut self, bounces: u64, scale: f64) -> Option<(u64, u64)> {
        let assumed = tuning(5.0);
        let truth =
            ImpactDetectorTuning { damping_per_s: self.damping_factor * assumed.damping_per_s, ..assumed };
        let mut told = None;
        for bounce in 0..bounces {
            for n in 0..800 {
                let noise: f64 = StandardNormal.sample(&mut self.rng);
                let (free_m_s, pushed_from_m_s) = (flight(&truth, 0.02, n), -0.012_f64);
                let velocity_m_s = free_m_s + self.pushed * (pushed_from_m_s - free_m_s).max(0.0);
                let shown_m_s = scale * velocity_m_s + self.noise_m_s * noise;
                let shown = sample(800 * self.bounces + n + 1, shown_m_s);
                let scaled = self.detector.scaled(&shown);
                self.detector.observe(&scaled);
            }
            self.bounces += 1;
            if self.detector.fault == Some(Reason::VibrometerScale) {
                told = Some((told.map_or(bounce, |(first, _)| first), bounce));
            }
        }
        told
    }

    /// Errors of scale and damping, the second per the assumed damping.
    fn errors(&self, scale: f64) -> [f64; 2] {
        let assumed = tuning(5.0).damping_per_s;
        [
            self.detector.scale / scale - 1.0,
            self.detector.tuning.damping_per_s / assumed - self.damping_factor,
        ]
    }
}

/// Without noise, scale and damping are found from the fall alone, whatever they are: to a part in a thousand, and to a
/// hundredth, after 60 flights, which have 10^4 times the information of the prior.
#[test]
fn exact_scale_and_damping_follow_from_the_fall() {
    for (scale, damping_factor) in [(1.0, 1.0), (1.1, 1.0), (0.85, 0.2), (1.0, 0.17), (1.2, 0.5)] {
        let mut bouncing = Bouncing::new(damping_factor, 0.0, 1);
        bouncing.bounce(60, scale);
        let [of_scale, of_damping] = bouncing.errors(scale);
        assert!(
            of_scale.abs() < 1e-3 && of_damping.abs() < 1e-2,
            "{scale} {damping_factor}: {:?}",
            [of_scale, of_damping]
        );
    }
}

/// 100 motors of any damping, 40 flights each: the scale is no worse known than the information says, and its standard
/// deviation at most three times too large, since the noise of innovations is not independent beyond the window. The
/// mean of 100 squares of normals is below 1.45 at the 99.9 % level.
#[test]
fn law_the_scale_is_no_worse_known_than_said() {
    let mut squares = 0.0;
    for seed in 0..100 {
        let mut bouncing = Bouncing::new(0.17 + 0.0083 * seed as f64, 2e-4, seed);
        bouncing.bounce(40, 1.03);
        let [error, _] = bouncing.errors(1.03);
        squares += error * error / bouncing.detector.free_fall.scale_variance();
    }
    let mean = squares / 100.0;
    assert!((0.11..1.45).contains(&mean), "{mean}");
}

/// A scale off by a half is told by ten flights, told no more after forty, and corrected to a hundredth; the same when
/// it is right again. One that is off by less than a tenth is corrected without a word.
#[test]
fn law_a_wrong_scale_is_told_and_corrected() {
    for wrong in [0.5, 0.67, 1.5] {
        let mut bouncing = Bouncing::new(0.6, 2e-4, 5);
        for scale in [1.0, wrong, 1.0] {
            let told = bouncing.bounce(60, scale);
            let changed = bouncing.bounces > 60;
            assert_eq!(told.is_some_and(|(first, _)| first < 10), changed, "{wrong} {scale}: {told:?}");
            assert!(told.is_none_or(|(_, last)| last < 40), "{wrong} {scale}: {told:?}");
            assert!(bouncing.errors(scale)[0].abs() < 0.01, "{wrong} {scale}: {:?}", bouncing.errors(scale));
        }
    }
    for scale in [0.92, 1.08] {
        let mut bouncing = Bouncing::new(0.6, 2e-4, 6);
        assert_eq!(bouncing.bounce(60, scale), None, "{scale}");
        assert!(bouncing.errors(scale)[0].abs() < 0.01);
    }
}

/// A clock that starts again in the middle of a flight: scale, damping and their information are to the bit what they
/// were, and later flights teach as without it. A wrong scale that was told is told until later flights prove it.
#[test]
fn law_what_flights_have_taught_survives_times_that_start_again() {
    let (mut bouncing, mut undisturbed) = (Bouncing::new(0.6, 2e-4, 8), Bouncing::new(0.6, 2e-4, 8));
    for of in [&mut bouncing, &mut undisturbed] {
        of.bounce(60, 1.2);
    }
    let taught = |detector: &ImpactDetector<f64>| {
        let FreeFall { wrong, .. } = detector.free_fall;
        (detector.scale, detector.tuning.damping_per_s, detector.free_fall.scale_variance(), wrong)
    };
    // The jump ends the flight before. The one that it begins would teach a scale of a fourth more.
    let first = 800 * bouncing.bounces;
    let scaled = bouncing.detector.scaled(&sample(first + 1, 0.03));
    bouncing.detector.observe(&scaled);
    let before = taught(&bouncing.detector);
    for n in 2..200 {
        let scaled = bouncing.detector.scaled(&sample(first + n, 1.5 * flight(&tuning(5.0), 0.02, n)));
        assert_eq!(bouncing.detector.observe(&scaled), VibrometerEvent::Flight);
    }
    bouncing.detector.start_again();
    assert_eq!(taught(&bouncing.detector), before);
    assert_eq!((bouncing.detector.newest, bouncing.detector.fault), (None, None));
    bouncing.bounces = 0;
    for of in [&mut bouncing, &mut undisturbed] {
        assert_eq!(of.bounce(20, 1.2), None);
    }
    let [one, other] = [&bouncing, &undisturbed].map(|of| of.errors(1.2)[0]);
    assert!(one.abs() < 0.01 && (one - other).abs() < 0.01, "{one} {other}");
    let mut wrong = Bouncing::new(0.6, 2e-4, 9);
    wrong.bounce(30, 1.0);
    while wrong.detector.fault != Some(Reason::VibrometerScale) {
        wrong.bounce(1, 0.5);
        assert!(wrong.bounces < 60, "not told");
    }
    wrong.detector.start_again();
    assert_eq!(wrong.detector.fault, Some(Reason::VibrometerScale));
}

/// Small pushes at the end of each flight, near the teeth, take 0.3 of the fall away: that part does not count.
#[test]
fn law_pushes_near_the_teeth_are_no_wrong_scale() {
    let mut bouncing = Bouncing::new(0.6, 2e-4, 7);
    bouncing.pushed = 0.3;
    assert_eq!(bouncing.bounce(60, 1.0), None);
    assert!(bouncing.errors(1.0)[0].abs() < 0.01, "{:?}", bouncing.errors(1.0));
}

/// A rotor that lies on the teeth does not fall, and small hops are no flights: nothing is learnt.
#[test]
fn law_sustained_contact_teaches_nothing() {
    let mut detector = ImpactDetector::new(tuning(5.0));
    let mut normal = StandardNormal.sample_iter(Pcg64::seed_from_u64(3));
    for n in 1..=100_000 {
        let noise: f64 = normal.next().unwrap();
        detector.observe(&sample(n, 2e-4 * noise));
    }
    assert_eq!(detector.scale.to_bits(), 1.0_f64.to_bits());
    assert_eq!(detector.fault, None);
}

/// Q(3) = 1.350e-3 on the upper side, in half a million samples of flight: 675, standard deviation 26.
#[test]
fn exact_false_alarms_are_the_normal_tail() {
    let tuning = tuning(3.0);
    let mut normal = StandardNormal.sample_iter(Pcg64::seed_from_u64(1));
    let mut alarms = 0;
    for run in 0..1000_u64 {
        let mut detector = ImpactDetector::new(tuning);
        for n in 0..501 {
            let noise: f64 = normal.next().unwrap();
            let at = run * 1000 + n + 1;
            let event = detector.observe(&sample(at, flight(&tuning, 0.04, n) + 2e-4 * noise));
            alarms += u32::from(matches!(event, VibrometerEvent::Impact { .. }));
        }
    }
    assert!((675 - 4 * 26..=675 + 4 * 26).contains(&alarms), "{alarms}");
}

/// Detection against jump size after a long flight, where `p = 1 / (2 n - 1)`: Q(k - dv / (sigma sqrt(1 + p))).
#[test]
fn exact_detection_probability_against_jump_size() {
    let tuning = tuning(5.0);
    let mut normal = StandardNormal.sample_iter(Pcg64::seed_from_u64(2));
    let sigma = 2e-4 * (1.0 + 1.0 / 79.0_f64).sqrt();
    // k - dv / sigma and its upper tail.
    for (off, expected) in [(1.0, 0.158_655), (0.0, 0.5), (-1.0, 0.841_345), (-3.0, 0.998_650)] {
        let jump = sigma * (5.0 - off);
        let runs = 2000_u32;
        let mut found = 0.0;
        for run in 0..u64::from(runs) {
            let mut detector = ImpactDetector::new(tuning);
            for n in 0..=250 {
                let noise: f64 = normal.next().unwrap();
                let jumped = if n == 250 { jump } else { 0.0 };
                let velocity = flight(&tuning, 0.01, n) + jumped + 2e-4 * noise;
                let event = detector.observe(&sample(run * 1000 + n + 1, velocity));
                found += f64::from(n == 250 && matches!(event, VibrometerEvent::Impact { .. }));
            }
        }
        let error = (expected * (1.0 - expected) / f64::from(runs)).sqrt();
        assert!((found / f64::from(runs) - expected).abs() < 4.0 * error, "{off} {found}");
    }
}

/// A rotor that leaves an impact at `v` is `v t - g t^2 / 2` above it when it is struck again, but for the film's
/// damping of some percent and half a sample's time. From a gap, or from a fall, the height is not known.
#[test]
fn exact_an_impact_tells_its_height_above_the_last_one() {
    let heights = |first_m_s: f64, gap: u64| {
        let mut detector = ImpactDetector::new(tuning(5.0));
        let mut heights = heapless::Vec::<f64, 4>::new();
        let mut observe = |n, velocity_m_s| {
            if let VibrometerEvent::Impact { height_m, .. } = detector.observe(&sample(n, velocity_m_s)) {
                heights.push(height_m).unwrap();
            }
        };
        (0..100).for_each(|n| observe(n + 1, flight(&tuning(5.0), -first_m_s, n)));
        (100..300).for_each(|n| observe(n + 1, flight(&tuning(5.0), first_m_s, n - 100)));
        (300..400).for_each(|n| observe(n + 1 + gap, flight(&tuning(5.0), first_m_s, n - 300)));
        heights
    };
    let risen_m = 0.05 * 1e-3 - 0.5 * 9.81 * 1e-6;
    let of_flight = heights(0.05, 0);
    assert_eq!(of_flight.len(), 2);
    assert!(of_flight[0].abs() < f64::EPSILON, "the flight before did not begin at an impact");
    assert!((of_flight[1] / risen_m - 1.0).abs() < 0.05, "{} {risen_m}", of_flight[1]);
    assert_eq!(heights(0.05, 1000), [0.0]);
}

/// The jump's size is unbiased and as good as said: variance `sigma^2 (1 + 1/20)` after twenty samples.
#[test]
fn exact_jump_size() {
    let tuning = tuning(5.0);
    let mut normal = StandardNormal.sample_iter(Pcg64::seed_from_u64(3));
    let (mut sum, mut square_sum, runs) = (0.0, 0.0, 4000_u32);
    for run in 0..u64::from(runs) {
        let mut detector = ImpactDetector::new(tuning);
        for n in 0..=20 {
            let noise: f64 = normal.next().unwrap();
            let jumped = if n == 20 { 0.03 } else { 0.0 };
            let velocity = flight(&tuning, -0.02, n) + jumped + 2e-4 * noise;
            if let VibrometerEvent::Impact { before_m_s, jump_m_s, .. } =
                detector.observe(&sample(run * 1000 + n + 1, velocity))
            {
                assert_eq!(n, 20);
                assert!((before_m_s - flight(&tuning, -0.02, 20)).abs() < 3e-4);
                sum += jump_m_s - 0.03;
                square_sum += (jump_m_s - 0.03).powi(2);
            }
        }
    }
    let expected = 4e-8 * (1.0 + 1.0 / 20.0);
    assert!((sum / f64::from(runs)).abs() < 4.0 * (expected / f64::from(runs)).sqrt(), "{sum}");
    // A variance from 4,000 normals is known to 2.2 %.
    assert!((square_sum / f64::from(runs) / expected - 1.0).abs() < 0.09, "{square_sum}");
}

#[test]
fn law_old_samples_change_nothing_and_falls_are_no_impacts() {
    let mut detector = ImpactDetector::new(tuning(5.0));
    assert_eq!(detector.observe(&sample(1, 0.0)), VibrometerEvent::Gap(0.0));
    assert_eq!(detector.observe(&sample(2, 0.0)), VibrometerEvent::Flight);
    let before = detector.flight.velocity_m_s;
    assert_eq!(detector.observe(&sample(2, 0.5)), VibrometerEvent::Rejected, "a duplicate");
    assert_eq!(detector.observe(&sample(1, 0.5)), VibrometerEvent::Rejected, "out of order");
    assert!((detector.flight.velocity_m_s - before).abs() <= 0.0);
    assert_eq!(detector.observe(&sample(3, -0.5)), VibrometerEvent::Flight);
    let event = detector.observe(&sample(4, -0.5));
    assert!(matches!(event, VibrometerEvent::Fall { drop_m_s } if (drop_m_s - 0.5).abs() < 1e-3));
    assert_eq!(detector.observe(&sample(5, -0.5)), VibrometerEvent::Flight);
    assert!(matches!(detector.observe(&sample(6, -0.4)), VibrometerEvent::Impact { .. }));
    assert!(matches!(detector.observe(&sample(1000, 0.9)), VibrometerEvent::Gap(_)));
}

/// Three samples that are too high by 0.1 m/s: an impact, and a fall as large at the second one after them. For 50 ms
/// from then on the fault holds.
#[test]
fn exact_a_fall_shows_that_samples_were_wrong() {
    let tuning = tuning(5.0);
    let mut detector = ImpactDetector::new(tuning);
    let mut observe = |n: u64| {
        let wrong = if (100..103).contains(&n) { 0.1 } else { 0.0 };
        (detector.observe(&sample(n, flight(&tuning, 0.05, n) + wrong)), detector.fault)
    };
    for n in 1..=104 {
        let (event, fault) = observe(n);
        match n {
            100 => {
                assert!(
                    matches!(event, VibrometerEvent::Impact { jump_m_s, .. } if (jump_m_s - 0.1).abs() < 1e-4)
                );
            }
            104 => {
                assert!(matches!(event, VibrometerEvent::Fall { drop_m_s } if (drop_m_s - 0.1).abs() < 1e-3));
            }
            _ => {
                assert!(matches!(event, VibrometerEvent::Flight | VibrometerEvent::Gap(_)), "{n}: {event:?}");
            }
        }
        assert_eq!(fault.is_some(), n == 104);
    }
    let right_again = (105..20_000).find(|&n| observe(n).1.is_none());
    assert_eq!(right_again, Some(104 + ImpactDetector::<f64>::ERRATIC_NANOS / NANOS));
}

/// Falls of 0.1 m/s, at 1 s and so many ms after it: those that come while an earlier one counts show a rotor that
/// tilts, and the fault holds for 300 ms after the last. A fall by itself counts for 50 ms.
#[test]
fn exact_falls_that_go_on_count_for_longer() {
    let tuning = tuning(5.0);
    let ends_after_ms = |falls_ms: &[u64]| {
        let mut detector = ImpactDetector::new(tuning);
        let per_ms = 1_000_000 / NANOS;
        let of_fall =
            |n: u64| falls_ms.iter().any(|ms| (0..3).contains(&n.wrapping_sub(1000 * per_ms + ms * per_ms)));
        let last = (1000 + falls_ms.iter().max().unwrap()) * per_ms;
        let mut until = last;
        for n in 1..last + 2000 * per_ms {
            let wrong = if of_fall(n) { 0.1 } else { 0.0 };
            detector.observe(&sample(n, flight(&tuning, 0.05, n) + wrong));
            until = if detector.has_fault() { n } else { until };
        }
        (until - last) / per_ms
    };
    assert_eq!(ends_after_ms(&[0]), 50);
    assert_eq!(ends_after_ms(&[0, 40]), 300);
    assert_eq!(ends_after_ms(&[0, 40, 300]), 300);
    assert_eq!(ends_after_ms(&[0, 60]), 50);
    assert_eq!(ends_after_ms(&[0, 40, 360]), 50);
}

/// A single fall, beyond what a jump counts at most, is no proof of the sign. A small fall, as a wrong scale makes of
/// gravity, is no wrong sample.
#[test]
fn law_a_single_fall_is_no_wrong_sign_and_a_small_one_nothing() {
    let tuning = tuning(5.0);
    let after = |drop_m_s: f64| {
        let mut detector = ImpactDetector::new(tuning);
        for n in 1..200 {
            let fallen = if n < 100 { 0.0 } else { drop_m_s };
            detector.observe(&sample(n, flight(&tuning, 0.05, n) - fallen));
        }
        detector.fault
    };
    assert_eq!(after(0.11), Some(Reason::VibrometerErratic));
    assert_eq!(after(0.004), None);
}

/// In sustained contact the rotor does not fall: `g t` of velocity is missing, which is detected within 50 samples.
#[test]
fn law_a_rotor_in_sustained_contact_is_detected() {
    let mut detector = ImpactDetector::new(tuning(5.0));
    let impacts =
        (1..=400).filter(|&n| matches!(detector.observe(&sample(n, 0.0)), VibrometerEvent::Impact { .. }));
    let count = impacts.count();
    assert!((400 / 60..=400 / 30).contains(&count), "{count}");
}

/// Flights of 8 ms, shown with the wrong sign: each impact is a fall of some 0.07 m/s, whose square is half of the 0.01
/// m^2/s^2 from which the sum starts, and more. The first shows wrong samples, the second a wrong sign.
#[test]
fn exact_a_wrong_sign_is_told_by_the_second_fall() {
    let tuning = tuning(5.0);
    let fall_m_s = 0.04 - flight(&tuning, 0.04, 1600);
    assert!((0.005..0.009).contains(&(fall_m_s * fall_m_s)), "{fall_m_s}");
    let mut detector = ImpactDetector::new(tuning);
    let told = [0, 1, 2].map(|bounce| {
        for n in 0..1600 {
            detector.observe(&sample(1600 * bounce + n + 1, -flight(&tuning, 0.04, n)));
        }
        detector.fault
    });
    assert_eq!(told, [None, Some(Reason::VibrometerErratic), Some(Reason::VibrometerInverted)]);
}

/// Height and jump of a flight that begins with an upward velocity of 20 mm/s after a fall of 10 mm/s and more, 200
/// samples long: the integral of the velocity in flight from the first sample on. The next impact begins both anew.
#[test]
fn exact_height_and_jump_are_those_of_the_last_flight() {
    let tuning = tuning(5.0);
    let mut detector = ImpactDetector::new(tuning);
    for n in 0..200 {
        detector.observe(&sample(n + 1, flight(&tuning, -0.01, n)));
    }
    for n in 0..=200 {
        detector.observe(&sample(n + 201, flight(&tuning, 0.02, n)));
    }
    let jump_m_s = 0.02 - flight(&tuning, -0.01, 200);
    assert!((detector.jump_m_s - jump_m_s).abs() < 1e-6, "{} {jump_m_s}", detector.jump_m_s);
    let terminal = tuning.gravity_m_s2 / tuning.damping_per_s;
    let duration_s = 200.0 * 5e-6;
    let kept = (-tuning.damping_per_s * duration_s).exp();
    let height_m = (0.02 + terminal) * (1.0 - kept) / tuning.damping_per_s - terminal * duration_s;
    // The sum of 200 samples is off by half of one step of the velocity's change in them.
    let off_m = 0.5 * 5e-6 * (0.02 - flight(&tuning, 0.02, 200)) + 1e-9;
    assert!((detector.flight.height_m - height_m).abs() < off_m, "{} {height_m}", detector.flight.height_m);
    detector.observe(&sample(402, 0.05));
    let jump_m_s = 0.05 - flight(&tuning, 0.02, 201);
    assert!(detector.flight.height_m.abs() < 1e-12 && (detector.jump_m_s - jump_m_s).abs() < 1e-6);
}
