//! Statistics of tilt, shift and hub over the samples of a run.

use motor_model::{DriveCommand, DriveMode, math};
use serde::Serialize;

use super::MotorSample;
use crate::math::count::real;
use crate::math::spectrum::{LIMIT_HZ, Tail};

/// Distance from the axis of the point whose vertical velocity is that of the rim: the paper's vibrometer reaches it.
pub const RIM_RADIUS_M: f64 = 3.8e-3;

/// What a rotor that tilts did, from the end of settling on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TiltSummary {
    /// Root of the mean square of the tilt.
    pub tilt_rms_mrad: f64,
    /// Largest tilt of a sample.
    pub tilt_max_mrad: f64,
    /// Root of the mean square of the distance of the rotor's mass centre from the axis.
    pub shift_rms_m: f64,
    /// Contacts of the hole's edges with the pin that approach faster than 1 mm/s.
    pub hub_contacts_per_s: f64,
    /// Amplitude of the largest line below 5 kHz of the vertical velocity at [`RIM_RADIUS_M`]; 0 without an impact.
    pub rim_amplitude_m_s: f64,
    /// Share of the samples in which the rotor turns against the sense of the mode that is driven.
    pub reversed_share: f64,
}

/// The sums from which it comes.
#[derive(Clone, Debug, Default)]
pub(super) struct TiltSums {
    samples: u64,
    square_rad2: f64,
    max_rad: f64,
    shift_m2: f64,
    reversed: u64,
    rim: Tail,
}

impl TiltSums {
    /// Adds a sample of a rotor that tilts; nothing of one that does not.
    pub(super) fn add(&mut self, sample: &MotorSample) {
        let Some(pose) = &sample.pose else { return };
        let tilt_rad = pose.tilt_rad();
        self.samples += 1;
        self.square_rad2 += tilt_rad * tilt_rad;
        self.max_rad = self.max_rad.max(tilt_rad);
        let [x_m, y_m] = pose.shift_m;
        self.shift_m2 += x_m * x_m + y_m * y_m;
        self.reversed += u64::from(sample.rate_rad_s * sense(sample.drive) < 0.0);
        self.rim.push(sample.velocity_m_s + pose.vertical_velocity([RIM_RADIUS_M, 0.0], sample.rate_rad_s));
    }

    /// The summary; `None` without samples. `hub_per_s` are the fast contacts with the pin, and `collided` is whether
    /// an impact counted.
    pub(super) fn summary(&self, sample_rate_hz: f64, hub_per_s: f64, collided: bool) -> Option<TiltSummary> {
        let mean = |sum: f64| sum / real(self.samples);
        let line = || self.rim.spectrum(sample_rate_hz).largest_below(LIMIT_HZ);
        let rim = if collided { line() } else { None };
        (self.samples > 0).then(|| TiltSummary {
            tilt_rms_mrad: 1e3 * math::sqrt(mean(self.square_rad2)),
            tilt_max_mrad: 1e3 * self.max_rad,
            shift_rms_m: math::sqrt(mean(self.shift_m2)),
            hub_contacts_per_s: hub_per_s,
            rim_amplitude_m_s: rim.map_or(0.0, |line| line.amplitude),
            reversed_share: mean(real(self.reversed)),
        })
    }
}

/// The sense in which a mode turns the rotor, clockwise positive; 0 without a drive.
fn sense(drive: DriveCommand) -> f64 {
    match drive.mode() {
        Some(DriveMode::B) => 1.0,
        Some(DriveMode::C) => -1.0,
        None => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::world::pose::Pose;

    /// A tilt that swings along x as a sine of 98 Hz, 80 periods of the record, and 10 mrad, a rotor on a circle of 3
    /// um, a quarter of the time backwards: all in closed form.
    #[test]
    fn exact_statistics_of_a_known_motion() {
        let (mut sums, rate_hz) = (TiltSums::default(), 20_000.0);
        let line_hz = 80.0 * rate_hz / 16_384.0;
        for n in 0..16_384_u32 {
            let (s, c) = math::sin_cos(TAU * line_hz * f64::from(n) / rate_hz);
            let (s_3, c_3) = math::sin_cos(0.3 * f64::from(n));
            let pose = Pose {
                shift_m: [3e-6 * c_3, 3e-6 * s_3],
                slope: [0.01 * s, 0.0],
                slope_rate_s: [0.01 * TAU * line_hz * c, 0.0],
            };
            sums.add(&MotorSample {
                time_s: f64::from(n) / rate_hz,
                height_m: 0.0,
                velocity_m_s: 0.0,
                angle_deg: 0.0,
                rate_rad_s: if n % 4 == 0 { 1.0 } else { -1.0 },
                tooth_heights_m: [0.0; 2],
                pose: Some(pose),
                drive: DriveCommand::full(DriveMode::C),
            });
        }
        let summary = sums.summary(rate_hz, 7.0, true).unwrap();
        let expected = [10.0 / math::sqrt(2.0), 10.0, 3.0, 7.0, 3.8 * 0.01 * TAU * line_hz, 0.25];
        let TiltSummary { tilt_rms_mrad, tilt_max_mrad, shift_rms_m, .. } = summary;
        let TiltSummary { hub_contacts_per_s, rim_amplitude_m_s, reversed_share, .. } = summary;
        let found = [
            tilt_rms_mrad,
            tilt_max_mrad,
            1e6 * shift_rms_m,
            hub_contacts_per_s,
            1e3 * rim_amplitude_m_s,
            reversed_share,
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            // The shift in the rotor's own velocity at the spot is 3 um beside 3.8 mm.
            assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
        }
        assert!(TiltSums::default().summary(rate_hz, 0.0, true).is_none());
    }
}
