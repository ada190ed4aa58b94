//! A stuck camera: when it counts as one, and when it is used again.
//!
//! Tracking noise and motion change the code of the default camera with probability 0.46 or more, so 20 equal codes in
//! a row are one chance in 10^5 even for a driven rotor that does not turn. A coarser camera repeats codes by itself,
//! so the number follows from noise and resolution ([`stuck_frames`]). Then the frames with that code are taken back,
//! and refused ([`Rejection::Stuck`]) until another code comes. At rest such a row shows a lack of dither alone: a
//! camera that shows one code of a rotor that neither turned nor was driven since is used again once the rotor lies
//! quiet.
//!
//! [`stuck_frames`]: crate::camera::track_tuning::TrackTuning::stuck_frames

use motor_model::{Angle, Real};

use super::{Tracker, refused};
use crate::camera::track::State;
use crate::camera::track_covariance::TrackCovariance;
use crate::innovation::{Innovation, Rejection};
use crate::measurement::CameraFrame;

/// A camera that is stuck.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stuck {
    /// The code that it shows.
    code: Angle,
    /// Whether the rotor was known to turn when the code first came, or has been driven since.
    moved: bool,
}

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// Whether a stuck camera shows the same code as before. Another code ends the fault.
    #[cold]
    pub(super) fn still_stuck(&mut self, frame: &CameraFrame, quiet: bool) -> bool {
        let still = self.stuck.is_some_and(|stuck| stuck.code == frame.angle && (stuck.moved || !quiet));
        if !still {
            self.stuck = None;
        }
        still
    }

    /// Declares the camera stuck at the newest frame's code, and takes back the frames that brought it, as far as they
    /// are kept.
    #[cold]
    pub(super) fn declare_stuck(&mut self, innovation: (T, T)) -> Innovation<T> {
        let frame = self.newest.frame;
        while self.newest.track.same_codes > 0
            && let Some(before) = self.older.pop_back()
        {
            self.newest = before;
        }
        // A restart at the code of a camera that turns out to be stuck: the reference is as before it.
        let stuck_since = self.newest.frame.angle == frame.angle && self.older.is_empty();
        if let Some(trusted) = self.reference.trusted.take_if(|_| stuck_since) {
            self.newest = trusted;
            (self.reference.lost, self.reference.doubted) = (false, 0);
        }
        let State { rate_rad_s, covariance, .. } = &self.newest.track.state;
        let turning = *rate_rad_s * *rate_rad_s > T::from_f64(9.0) * covariance.rate_rad2_s2();
        self.stuck = Some(Stuck { code: frame.angle, moved: turning || self.driven });
        refused(&frame, innovation, Rejection::Stuck)
    }
}
