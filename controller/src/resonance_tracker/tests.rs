//! The tracker by itself, on a rotor whose rate falls beside a resonance as [`super`] says, and ripples.

extern crate std;

use nalgebra::{Matrix2, RowVector2, Vector2};
use rand_core::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::*;

/// What a test waits for between two looks, in ns: every time of the tracker is a multiple of it.
const STEP_NANOS: u64 = 1_000_000;

/// A rotor that turns at `part` of the map's rate where the drive meets the resonance, at `resonance_hz`.
struct Rotor {
    tracker: ResonanceTracker,
    command: DriveCommand,
    resonance_hz: f32,
    part: f32,
    angle_rad: f64,
    millis: u64,
    random: rand_pcg::Pcg64Mcg,
    /// How long the drive was beside the offset, and how long it was on, in steps.
    beside: u64,
}

impl Rotor {
    fn new(mode: DriveMode, part: f32, seed: u64) -> Self {
        Self {
            tracker: ResonanceTracker::of(ResponseMap::table_1()),
            command: DriveCommand::full(mode),
            resonance_hz: 0.0,
            part,
            angle_rad: 0.0,
            millis: 0,
            random: rand_pcg::Pcg64Mcg::seed_from_u64(seed),
            beside: 0,
        }
    }

    fn mode(&self) -> DriveMode {
        self.command.mode().unwrap()
    }

    fn half_width_hz(&self) -> f32 {
        self.tracker.mode(self.mode()).half_width_hz
    }

    /// The offset of the resonance from the tracker's, in half widths.
    fn error(&self) -> f32 {
        (self.resonance_hz - self.tracker.mode(self.mode()).offset.hz) / self.half_width_hz()
    }

    fn run(&mut self, seconds: f32) {
        let map = ResponseMap::table_1();
        let strongest = map.strongest_cruise(self.mode(), 1.0).unwrap();
        for _ in 0..(1e3 * seconds) as u64 {
            let now = Time::from_nanos(self.millis * STEP_NANOS);
            let estimate = Estimate {
                at: now,
                angle: Angle::from_degrees(self.angle_rad.to_degrees()),
                rate_rad_s: 0.0,
                angle_rad2: 0.0,
                angle_rate_rad2_s: 0.0,
                rate_rad2_s2: 0.0,
                resting: false,
            };
            let tuned = self.tracker.tune(map, now, self.command, Some(&estimate));
            self.beside += u64::from(self.tracker.side != Side::At);
            let beside = (tuned.frequency_offset_hz() - self.resonance_hz) / (2.0 * self.half_width_hz());
            // White, so that a mean over 60 ms ripples as it should.
            let white: f32 = StandardNormal.sample(&mut self.random);
            let ripple = (RIPPLE * RATE_S / 1e-3).sqrt() * white;
            let rate_rad_s = self.part * strongest.rate_rad_s * (-beside * beside).exp() * (1.0 + ripple);
            self.angle_rad += 1e-3 * f64::from(rate_rad_s);
            self.millis += 1;
        }
    }
}

/// Beside a resonance by this part of a half width a rotor loses a tenth of its rate: `2 sqrt(ln(1 / 0.9))`.
const A_TENTH: f32 = 0.65;

/// A resonance that jumps by up to 1 % of 6.3 kHz is followed within three seconds, until a tenth of the rate is lost
/// at most. One of twenty rotors may be worse for a while: the offset is known to a fifth of a half width, and ripples.
#[test]
fn law_the_drive_follows_a_resonance_that_moves() {
    for mode in [DriveMode::B, DriveMode::C] {
        for half_widths in [-1.5, -1.1, 1.1, 1.5] {
            let late = (0..20).filter(|&seed| {
                let mut rotor = Rotor::new(mode, 1.0, seed);
                rotor.run(1.0);
                rotor.resonance_hz = half_widths * rotor.half_width_hz();
                rotor.run(3.0);
                rotor.error().abs() > A_TENTH
            });
            let late = late.count();
            assert!(late <= 1, "{mode:?}, {half_widths} half widths: {late} of 20");
        }
    }
}

/// A minute's drift of 1 % costs a tenth of the rate at most, in the mean.
#[test]
fn law_the_drive_follows_a_resonance_that_drifts() {
    for rate in [-1.0, 1.0] {
        for seed in 0..5 {
            let mut rotor = Rotor::new(DriveMode::B, 1.0, seed);
            let (mut parts, mut count) = (0.0, 0.0);
            for _ in 0..630 {
                rotor.run(0.1);
                rotor.resonance_hz += 0.1 * rate;
                parts += (-0.25 * rotor.error() * rotor.error()).exp();
                count += 1.0;
            }
            assert!(parts / count > 0.9, "{rate} Hz/s, seed {seed}: {}", parts / count);
        }
    }
}

/// A motor that is slow for another reason is searched once: of ten seconds less than three are driven beside the
/// offset, and that stays where a tenth of the rate is lost at most.
#[test]
fn law_a_motor_that_is_slow_is_searched_once() {
    for seed in 0..10 {
        let mut rotor = Rotor::new(DriveMode::B, 0.6, seed);
        rotor.run(10.0);
        assert!(rotor.beside > 150, "seed {seed}: not searched");
        assert!(rotor.beside < 3_000, "seed {seed}: {} ms", rotor.beside);
        assert!(rotor.error().abs() < A_TENTH, "seed {seed}: {}", rotor.error());
    }
}

/// A motor as the map says is driven at its frequency: for five seconds nine of ten are never driven beside it.
#[test]
fn law_a_motor_as_the_map_says_is_left_alone() {
    let searched = (0..30).filter(|&seed| {
        let mut rotor = Rotor::new(DriveMode::B, 1.0, seed);
        rotor.run(5.0);
        rotor.beside > 0
    });
    let searched = searched.count();
    assert!(searched <= 3, "{searched} of 30");
}

/// A rate that no detuning explains, a rotor that turns back, and a drive below the strongest: nothing is searched.
#[test]
fn exact_what_no_detuning_explains_is_not_searched() {
    for part in [0.3, 0.02, 0.0, -0.5] {
        let mut rotor = Rotor::new(DriveMode::B, part, 1);
        rotor.run(5.0);
        assert_eq!((rotor.beside, rotor.error().to_bits() << 1), (0, 0), "{part}");
    }
    let mut rotor = Rotor::new(DriveMode::B, 0.6, 1);
    rotor.command = DriveCommand::saturating(DriveMode::B, 0.9);
    rotor.run(5.0);
    assert_eq!(rotor.beside, 0);
}

/// A drive that lasts no longer than a burst is at the offset, also where that is not known.
#[test]
fn exact_a_burst_is_never_driven_beside_the_resonance() {
    let map = ResponseMap::table_1();
    let mut rotor = Rotor::new(DriveMode::B, 0.6, 1);
    rotor.run(0.5);
    assert!(!rotor.tracker.mode(DriveMode::B).is_known() && rotor.beside > 0);
    for _ in 0..20 {
        let now = Time::from_nanos(rotor.millis * STEP_NANOS);
        rotor.tracker.tune(map, now, DriveCommand::OFF, None);
        rotor.beside = 0;
        // The longest throw of the map is 21 ms long.
        rotor.run(0.021);
        assert_eq!(rotor.beside, 0);
    }
}

/// Without an estimate nothing is measured; a drive that goes off and on is measured anew.
#[test]
fn exact_a_rate_is_measured_without_a_break() {
    let map = ResponseMap::table_1();
    let mut rotor = Rotor::new(DriveMode::B, 0.6, 1);
    for round in 0..50 {
        rotor.run(0.1);
        let now = Time::from_nanos(rotor.millis * STEP_NANOS);
        let command = if round % 2 == 0 { DriveCommand::OFF } else { rotor.command };
        rotor.tracker.tune(map, now, command, None);
    }
    assert_eq!((rotor.beside, rotor.tracker.mode(DriveMode::B).recent.count.to_bits()), (0, 0));
}

/// Beside a Kalman filter of both offsets in double precision, over pairs in either mode.
#[test]
fn dual_a_pair_is_an_update_of_both_offsets() {
    let mut tracker = ResonanceTracker::of(ResponseMap::table_1());
    let half_widths = [DriveMode::B, DriveMode::C].map(|mode| f64::from(tracker.mode(mode).half_width_hz));
    assert!((half_widths[0] - 39.69).abs() < 1e-5 && (half_widths[1] - 55.95).abs() < 1e-5, "by Table 1");
    for _ in 0..COUNT_MIN as u32 {
        tracker.take_rate(DriveMode::B, 0.5);
    }
    let [b, c] = half_widths.map(|half_width| f64::from(UNKNOWN) * half_width);
    let mut state = Vector2::zeros();
    let mut covariance = Matrix2::new(b * b, 0.9 * b * c, 0.9 * b * c, c * c);
    for (mode, contrast) in
        [(DriveMode::B, 0.3), (DriveMode::C, -0.1), (DriveMode::B, 0.12), (DriveMode::C, 0.2)]
    {
        tracker.take_contrast(mode, contrast);
        let (contrast, index) = (f64::from(contrast), usize::from(mode == DriveMode::C));
        let mut row = RowVector2::zeros();
        row[index] = 0.375 / half_widths[index];
        let noise = 0.5 * f64::from(RIPPLE) + 0.25 * contrast * contrast;
        let gain = covariance * row.transpose() / ((row * covariance * row.transpose())[0] + noise);
        state += gain * contrast;
        covariance -= gain * row * covariance;
        for (index, offset) in tracker.offsets().iter().enumerate() {
            assert!((f64::from(offset.hz) - state[index]).abs() < 1e-3, "{mode:?} {offset:?} {state}");
            let variance = covariance[(index, index)];
            assert!(
                (f64::from(offset.hz2) / variance - 1.0).abs() < 1e-4,
                "{mode:?} {offset:?} {covariance}"
            );
        }
        assert!((f64::from(tracker.shared_hz2) - covariance[(0, 1)]).abs() < 1e-3 * b * c, "{mode:?}");
    }
}

/// What a map knows is driven from the first tick on, and told once.
#[test]
fn exact_a_known_resonance_is_driven_and_told_once() {
    let table_1 = ResponseMap::table_1();
    let resonances = [(58.0, 49.0), (-20.0, 4.0)].map(|(hz, hz2)| ResonanceOffset { hz, hz2 });
    let map = table_1
        .with_learnt(crate::map_correction::LearntFactors::new(&MapCorrection::of(table_1), resonances))
        .unwrap();
    let mut tracker = ResonanceTracker::of(&map);
    assert_eq!((tracker.take_moved(), tracker.take_moved()), (Some(resonances), None));
    for (mode, hz) in [(DriveMode::B, 58.0_f32), (DriveMode::C, -20.0)] {
        let tuned = tracker.tune(&map, Time::ZERO, DriveCommand::saturating(mode, 0.4), None);
        assert_eq!(tuned, DriveCommand::saturating(mode, 0.4).with_saturating_offset(hz));
    }
    assert_eq!(ResonanceTracker::of(table_1).take_moved(), None);
}
