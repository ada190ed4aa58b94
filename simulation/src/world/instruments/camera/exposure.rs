//! Exposure blur: a frame shows the mean angle, shift and tilt over its exposure.
//!
//! They are summed up while the shutter is open, by the trapezoidal rule over the plant's steps, the angle in integers:
//!
//! ```text
//! mean = first + integral of (angle - first) over the exposure / exposure
//! ```
//!
//! An exposure begins at the end of the one before it at the earliest.

use motor_model::{Angle, Time};

use crate::math::count::real;
use crate::world::pose::Pose;

/// The rotor as a frame shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// Its angle, clockwise positive.
    pub angle: Angle,
    /// How it is shifted and tilted.
    pub pose: Pose,
}

/// The exposure that ends with the next frame.
#[derive(Clone, Debug)]
pub(super) struct Exposure {
    /// 0 for none.
    length_nanos: u64,
    opens_at: Time,
    open: Option<OpenShutter>,
}

/// The sum while the shutter is open.
#[derive(Clone, Copy, Debug)]
struct OpenShutter {
    opened_at: Time,
    first: Angle,
    seen_at: Time,
    seen: Shown,
    /// Twice the integral of the angle less the first, in units of 2^-32 turn times ns.
    twice: i128,
    /// Twice the integral of the pose, in units of it times ns.
    twice_pose: Pose,
}

impl Exposure {
    /// Exposures of this length, the first of which ends at `ends`.
    pub(super) fn new(length_nanos: u64, ends: Time) -> Self {
        let mut exposure = Self { length_nanos, opens_at: Time::ZERO, open: None };
        exposure.plan(Time::ZERO, ends);
        exposure
    }

    /// Plans the exposure that ends at `ends`, not before `last`, the end of the one before it.
    pub(super) fn plan(&mut self, last: Time, ends: Time) {
        self.opens_at = Time::from_nanos(ends.nanos().saturating_sub(self.length_nanos)).max(last);
    }

    /// When it is to be shown the rotor next, where its frame ends at `ends`: at once while the shutter is open.
    #[inline]
    pub(super) fn due(&self, ends: Time) -> Time {
        match self.open {
            None if self.length_nanos == 0 => ends,
            None => self.opens_at,
            Some(_) => Time::ZERO,
        }
    }

    /// When the shutter is to be opened, if it is closed and there is an exposure.
    pub(super) fn opens_at(&self) -> Option<Time> {
        (self.open.is_none() && self.length_nanos > 0).then_some(self.opens_at)
    }

    /// Opens the shutter.
    pub(super) fn open(&mut self, at: Time, shown: Shown) {
        self.open = Some(OpenShutter {
            opened_at: at,
            first: shown.angle,
            seen_at: at,
            seen: shown,
            twice: 0,
            twice_pose: Pose::LEVEL,
        });
    }

    /// Takes the rotor at a step, if the shutter is open.
    pub(super) fn look(&mut self, at: Time, shown: Shown) {
        if let Some(open) = &mut self.open {
            let [before, after] =
                [open.seen.angle, shown.angle].map(|angle| i128::from(angle.minus(open.first).units()));
            let nanos = at.nanos_since(open.seen_at);
            open.twice += (before + after) * i128::from(nanos);
            let sum = open.seen.pose.plus(&shown.pose, 1.0);
            open.twice_pose = open.twice_pose.plus(&sum, real(nanos));
            (open.seen_at, open.seen) = (at, shown);
        }
    }

    /// Closes the shutter at `at`, when the rotor stands as `shown`: the mean over the exposure, and how long ago its
    /// middle was.
    #[expect(clippy::cast_possible_truncation, reason = "a mean of angles")]
    pub(super) fn close(&mut self, at: Time, shown: Shown) -> (Shown, u64) {
        self.look(at, shown);
        let Some(OpenShutter { opened_at, first, twice, twice_pose, .. }) = self.open.take() else {
            return (shown, 0);
        };
        let length_nanos = at.nanos_since(opened_at);
        if length_nanos == 0 {
            return (shown, 0);
        }
        let twice_length = 2 * i128::from(length_nanos);
        // Relative to the last angle and rounded towards it.
        let mean = (twice - twice_length * i128::from(shown.angle.minus(first).units())) / twice_length;
        let pose = Pose::LEVEL.plus(&twice_pose, 0.5 / real(length_nanos));
        (Shown { angle: shown.angle.plus(Angle::from_units(mean as i64)), pose }, length_nanos.div_ceil(2))
    }
}
