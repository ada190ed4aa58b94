//! Exposure blur: a frame shows the mean angle over its exposure.
//!
//! The angle is summed up while the shutter is open, by the trapezoidal rule over the plant's steps, in integers:
//!
//! ```text
//! mean = first + integral of (angle - first) over the exposure / exposure
//! ```
//!
//! An exposure begins at the end of the one before it at the earliest.

use motor_model::{Angle, Time};

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
    seen: Angle,
    /// Twice the integral of the angle less the first, in units of 2^-32 turn times ns.
    twice: i128,
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
    pub(super) fn open(&mut self, at: Time, angle: Angle) {
        self.open = Some(OpenShutter { opened_at: at, first: angle, seen_at: at, seen: angle, twice: 0 });
    }

    /// Takes the angle at a step, if the shutter is open.
    pub(super) fn look(&mut self, at: Time, angle: Angle) {
        if let Some(open) = &mut self.open {
            let [before, after] = [open.seen, angle].map(|angle| i128::from(angle.minus(open.first).units()));
            open.twice += (before + after) * i128::from(at.nanos_since(open.seen_at));
            (open.seen_at, open.seen) = (at, angle);
        }
    }

    /// Closes the shutter at `at`, when the rotor stands at `angle`: the mean over the exposure, and how long ago its
    /// middle was.
    #[expect(clippy::cast_possible_truncation, reason = "a mean of angles")]
    pub(super) fn close(&mut self, at: Time, angle: Angle) -> (Angle, u64) {
        self.look(at, angle);
        let Some(OpenShutter { opened_at, first, twice, .. }) = self.open.take() else { return (angle, 0) };
        let length_nanos = at.nanos_since(opened_at);
        if length_nanos == 0 {
            return (angle, 0);
        }
        let twice_length = 2 * i128::from(length_nanos);
        // Relative to the last angle and rounded towards it.
        let mean = (twice - twice_length * i128::from(angle.minus(first).units())) / twice_length;
        (angle.plus(Angle::from_units(mean as i64)), length_nanos.div_ceil(2))
    }
}
