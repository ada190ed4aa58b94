//! The mean rate in each mode, to which the rate of a driven rotor returns between the frames of a slow camera.
//!
//! ```text
//! m <- m + w innovation / t        t: time between two frames between which the drive was on in one mode, w = 0.3
//! ```
//!
//! Frames teach once the rate is at its mean. While it goes there, from the mean of the other mode or from rest, an
//! innovation tells of the way: learnt as a mean it takes the rotor for one that turns the other way.
//!
//! Prior: 16 and -1.7 rad/s at full amplitude in modes B and C, from the model.

use motor_model::{DriveMode, Real, Time};

use crate::innovation::{Innovation, Verdict};

/// Prior in rad/s, modes B and C.
const PRIOR_RAD_S: [f64; 2] = [16.0, -1.7];
/// Weight of a frame.
const WEIGHT: f64 = 0.3;
/// Largest mean rate, in rad/s.
const MOST_RAD_S: f64 = 60.0;

/// The mean rates, and whether the drive has been on in one mode since the last frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeanRates<T> {
    /// In modes B and C, in rad/s.
    pub(super) rad_s: [T; 2],
    /// The mode in force since the frame exposed at the time beside it.
    driven: Option<(DriveMode, Time)>,
}

impl<T: Real> MeanRates<T> {
    pub(super) fn new() -> Self {
        Self { rad_s: PRIOR_RAD_S.map(T::from_f64), driven: None }
    }

    pub(super) fn note_drive(&mut self, mode: Option<DriveMode>) {
        self.driven = self.driven.filter(|(driven, _)| mode == Some(*driven));
    }

    /// Learns from a frame, while `mode` is driven. The rate is at its mean from `settled_at` on.
    pub(super) fn note_frame(&mut self, frame: &Innovation<T>, mode: Option<DriveMode>, settled_at: Time) {
        let driven = mode.filter(|_| frame.verdict != Verdict::Restarted).map(|mode| (mode, frame.taken_at));
        let since = core::mem::replace(&mut self.driven, driven);
        let (Some((driven, from)), Verdict::Used) = (since, frame.verdict) else { return };
        let seconds: T = frame.taken_at.seconds_since(from);
        let [b, c] = &mut self.rad_s;
        let mean = if driven == DriveMode::B { b } else { c };
        if seconds > T::zero() && from >= settled_at {
            let learnt = *mean + T::from_f64(WEIGHT) * frame.innovation_rad / seconds;
            // Written so that NaN is not learnt.
            if learnt.abs() < T::from_f64(MOST_RAD_S) {
                *mean = learnt;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::innovation::Source;

    fn used(millis: u64, innovation_rad: f64) -> Innovation<f64> {
        Innovation {
            source: Source::Camera,
            taken_at: Time::from_micros(1000 * millis),
            innovation_rad,
            variance_rad2: 1.0,
            verdict: Verdict::Used,
        }
    }

    /// A frame that is 10 mrad ahead after 20 ms under mode C shows a rate of 0.5 rad/s above the mean, of which a part
    /// of 0.3 is learnt, of that mode. A frame over a change of the drive teaches nothing, and so does one that would
    /// make the mean faster than any rotor's, and one of a rate that is on its way to the mean.
    #[test]
    fn exact_a_frame_teaches_a_part_of_what_it_is_ahead_by() {
        let c = Some(DriveMode::C);
        let learnt = |ahead_rad: f64, between: Option<DriveMode>, settled_millis: u64| {
            let settled_at = Time::from_micros(1000 * settled_millis);
            let mut means = MeanRates::<f64>::new();
            means.note_frame(&used(100, 0.0), c, settled_at);
            means.note_drive(between);
            means.note_frame(&used(120, ahead_rad), c, settled_at);
            let [b, c] = PRIOR_RAD_S;
            [means.rad_s[0] - b, means.rad_s[1] - c]
        };
        for (ahead_rad, between, settled_millis, expected) in [
            (0.01, c, 100, 0.15),
            (-0.01, c, 100, -0.15),
            (0.01, c, 101, 0.0),
            (0.01, None, 0, 0.0),
            (0.01, Some(DriveMode::B), 0, 0.0),
            (5.0, c, 0, 0.0),
        ] {
            let [of_b, of_c] = learnt(ahead_rad, between, settled_millis);
            assert!(
                of_b.to_bits() == 0 && (of_c - expected).abs() < 1e-12,
                "{ahead_rad} {between:?}: {of_c}"
            );
        }
    }
}
