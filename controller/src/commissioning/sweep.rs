//! A sweep of the drive's frequency in steps, and the power that the vibrometer shows at each.
//!
//! ```text
//! offset -150, -125, ... 150 Hz:   wait until the last frequency has rung down, then measure in parts
//! ```
//!
//! The stator rings with `1 / (zeta w)`, 4.0 ms in mode B and 2.8 ms in mode C of Table 1. After [`WAIT_NANOS`] what is
//! left of the last frequency is below a thousandth.
//!
//! The drive is full. A weaker one leaves the rotor on the teeth, which then moves too little for the vibrometer: below
//! a tenth of the drive it shows nothing.

use estimator::LdvSample;
use motor_model::{DriveCommand, DriveMode, Time};

use super::resonance::{SWEEP_POINTS_MAX, SweepPoint};

/// Frequencies of a sweep.
const POINTS: u16 = 13;
/// Distance of two frequencies in Hz: a third of a half width.
const STEP_HZ: f32 = 25.0;
/// Time in ns after a change of the frequency in which nothing is measured: ten times the ring-down of mode B, and the
/// memory of the impacts.
const WAIT_NANOS: u64 = 40_000_000;
/// Time in ns of a part.
const PART_NANOS: u64 = 20_000_000;
/// Parts at each frequency.
const PARTS: u16 = 6;

/// Sums over samples.
#[derive(Clone, Copy, Debug, Default)]
struct SampleSums {
    count: u32,
    sum: f32,
    squares: f32,
}

impl SampleSums {
    /// Variance of the samples in m^2/s^2, less `noise`.
    #[expect(clippy::cast_precision_loss, reason = "some thousand samples")]
    fn power(&self, noise_m2_s2: f32) -> Option<f32> {
        let count = self.count as f32;
        (self.count > 1).then(|| {
            let mean = self.sum / count;
            (self.squares / count - mean * mean - noise_m2_s2).max(1e-3 * noise_m2_s2)
        })
    }
}

/// A sweep of one mode.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    mode: DriveMode,
    amplitude: f32,
    noise_m2_s2: f32,
    point: u16,
    since: Time,
    part: u16,
    sums: SampleSums,
    /// Sum of the powers of the parts of this point, and of their squares.
    powers: [f32; 2],
    measured: u16,
    points: [SweepPoint; SWEEP_POINTS_MAX],
    count: usize,
}

impl Sweep {
    /// A sweep of `mode` at `amplitude` from `now` on, under a vibrometer of noise `noise_m_s`.
    pub fn new(mode: DriveMode, amplitude: f32, noise_m_s: f32, now: Time) -> Self {
        Self {
            mode,
            amplitude,
            noise_m2_s2: noise_m_s * noise_m_s,
            point: 0,
            since: now,
            part: 0,
            sums: SampleSums::default(),
            powers: [0.0; 2],
            measured: 0,
            points: [SweepPoint::default(); SWEEP_POINTS_MAX],
            count: 0,
        }
    }

    /// The mode.
    pub fn mode(&self) -> DriveMode {
        self.mode
    }

    /// The points that are measured by now.
    pub fn points(&self) -> &[SweepPoint] {
        self.points.get(..self.count).unwrap_or_default()
    }

    fn offset_hz(&self) -> f32 {
        STEP_HZ * (f32::from(self.point) - f32::from(POINTS / 2))
    }

    /// The drive.
    pub fn command(&self) -> DriveCommand {
        DriveCommand::saturating(self.mode, self.amplitude).with_saturating_offset(self.offset_hz())
    }

    /// Takes a sample. One that is no finite number does not count.
    pub fn hear(&mut self, sample: &LdvSample) {
        let ready = sample.taken_at.nanos_since(self.since) >= WAIT_NANOS;
        if ready && sample.taken_at >= self.since && sample.velocity_m_s.is_finite() {
            self.sums.count += 1;
            self.sums.sum += sample.velocity_m_s;
            self.sums.squares += sample.velocity_m_s * sample.velocity_m_s;
        }
    }

    /// Goes on to the next part or frequency when it is due; whether the sweep is over.
    pub fn advance(&mut self, now: Time) -> bool {
        if now.nanos_since(self.since) < WAIT_NANOS + u64::from(self.part + 1) * PART_NANOS {
            return false;
        }
        if let Some(power) = self.sums.power(self.noise_m2_s2) {
            let [sum, squares] = &mut self.powers;
            *sum += power;
            *squares += power * power;
            self.measured += 1;
        }
        self.sums = SampleSums::default();
        self.part += 1;
        if self.part < PARTS {
            return false;
        }
        self.keep_point();
        (self.powers, self.measured, self.part, self.since) = ([0.0; 2], 0, 0, now);
        self.point += 1;
        self.point >= POINTS
    }

    fn keep_point(&mut self) {
        if self.measured < 2 {
            return;
        }
        let [sum, squares] = self.powers;
        let number = f32::from(self.measured);
        let power_m2_s2 = sum / number;
        let variance = (squares - sum * power_m2_s2).max(0.0) / (number - 1.0);
        let point = SweepPoint {
            offset_hz: self.offset_hz(),
            power_m2_s2,
            relative_variance: variance / (number * power_m2_s2 * power_m2_s2).max(f32::MIN_POSITIVE),
        };
        if let Some(place) = self.points.get_mut(self.count) {
            *place = point;
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    /// A vibrometer of 1 kHz that shows a square wave of 3 mm/s beside a bias: the power is that of the wave.
    #[test]
    fn exact_power_is_the_variance_of_what_is_heard() {
        let mut sweep = Sweep::new(DriveMode::C, 1.0, 1e-3, Time::ZERO);
        let mut now = Time::ZERO;
        let mut over = false;
        let mut offsets = Vec::new();
        while !over {
            now = now.plus_nanos(1_000_000);
            let sign = if (now.nanos() / 1_000_000).is_multiple_of(2) { 1.0 } else { -1.0 };
            sweep.hear(&LdvSample { taken_at: now, velocity_m_s: 0.01 + sign * 3e-3 });
            sweep.hear(&LdvSample { taken_at: now, velocity_m_s: f32::NAN });
            offsets.push(sweep.command().frequency_offset_hz());
            over = sweep.advance(now);
        }
        assert_eq!(now.nanos(), 13 * 160_000_000);
        offsets.dedup();
        let expected: Vec<f32> = (0..13).map(|index| 25.0 * (index as f32 - 6.0)).collect();
        assert_eq!(offsets, expected);
        assert_eq!(sweep.points().len(), 13);
        for point in sweep.points() {
            assert!((point.power_m2_s2 / 8e-6 - 1.0).abs() < 0.02, "{point:?}");
            assert!(point.relative_variance < 1e-3, "{point:?}");
        }
    }

    /// Without samples there is no point, and the sweep ends all the same.
    #[test]
    fn law_a_silent_vibrometer_gives_no_points() {
        let mut sweep = Sweep::new(DriveMode::B, 1.0, 1e-3, Time::ZERO);
        let ended = (1..4000_u64).find(|millis| sweep.advance(Time::from_nanos(millis * 1_000_000)));
        assert_eq!(ended, Some(13 * 160));
        assert!(sweep.points().is_empty());
    }
}
