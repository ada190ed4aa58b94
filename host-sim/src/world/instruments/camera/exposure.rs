//! Exposure blur: a frame shows the mean angle over its exposure.

use std::collections::VecDeque;

use motor_model::Angle;

/// The angles over an exposure that ends with the frame.
#[derive(Clone, Debug)]
pub(super) struct Exposure {
    /// Length of the exposure in steps between two looks.
    steps: usize,
    middle_nanos: u64,
    /// The last `steps + 1` looks, the newest last.
    looks: VecDeque<Angle>,
}

impl Exposure {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "at most 1e8 ns in at most 1e7 steps"
    )]
    pub(super) fn new(frames: f64, period_nanos: u64, look_nanos: f64) -> Self {
        let steps = (frames * period_nanos as f64 / look_nanos).round();
        Self {
            steps: steps as usize,
            middle_nanos: (0.5 * steps * look_nanos).round() as u64,
            looks: VecDeque::new(),
        }
    }

    pub(super) fn look(&mut self, angle: Angle) {
        if self.steps > 0 {
            if self.looks.len() > self.steps {
                self.looks.pop_front();
            }
            self.looks.push_back(angle);
        }
    }

    /// The mean over the exposure that ends at `angle`, and how long ago its middle was.
    pub(super) fn shown(&self, angle: Angle) -> (Angle, u64) {
        if self.looks.len() <= self.steps || self.steps == 0 {
            return (angle, 0);
        }
        let units = |index: usize| self.looks.get(index).map_or(0, |look| look.minus(angle).units());
        let inner: i64 = (1..self.steps).map(units).sum();
        // At most 1e7 looks within half a turn each: far below 2^63.
        let twice = 2 * inner + units(0) + units(self.steps);
        let mean = twice / i64::try_from(2 * self.steps).unwrap_or(i64::MAX);
        (angle.plus(Angle::from_units(mean)), self.middle_nanos)
    }
}
