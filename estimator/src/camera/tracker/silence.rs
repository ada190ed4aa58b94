//! How often frames come, and how late: by that a silent camera is told.

use motor_model::Time;

/// Time between frames, and their latency.
#[derive(Clone, Copy, Debug)]
pub(super) struct Intervals {
    /// Mean time from exposure to exposure, the latest weighing most, in ns; `None` before the second frame.
    mean_nanos: Option<u64>,
    /// Time from the exposure of the last frame after which the camera is silent, in ns.
    silent_after_nanos: u64,
}

impl Default for Intervals {
    fn default() -> Self {
        Self { mean_nanos: None, silent_after_nanos: u64::MAX }
    }
}

impl Intervals {
    /// One frame in `2^MEAN_SHIFT` is the weight of the latest in the mean.
    const MEAN_SHIFT: u32 = 4;

    /// Largest interval that counts, per mean: one silence says little of the intervals after it.
    const LONGEST: u64 = 4;

    /// Takes in a frame that comes when the filter's clock shows `clock`. `before` is the exposure of the frame before
    /// it, if none came out of order.
    pub(super) fn take(&mut self, before: Option<Time>, exposed_at: Time, clock: Time) {
        if let Some(before) = before {
            let interval_nanos = exposed_at.nanos_since(before);
            self.mean_nanos = Some(self.mean_nanos.map_or(interval_nanos, |mean_nanos| {
                let counted_nanos = interval_nanos.min(mean_nanos.saturating_mul(Self::LONGEST));
                mean_nanos - (mean_nanos >> Self::MEAN_SHIFT) + (counted_nanos >> Self::MEAN_SHIFT)
            }));
        }
        if let Some(mean_nanos) = self.mean_nanos {
            let latency_nanos = clock.nanos_since(exposed_at);
            // Right for intervals below a century.
            self.silent_after_nanos = latency_nanos.wrapping_add(mean_nanos.wrapping_mul(5) / 2);
        }
    }

    /// Whether more than two and a half of the mean intervals have passed from an exposure to the next one.
    pub(super) fn is_gap(&self, before: Time, exposed_at: Time) -> bool {
        let interval_nanos = exposed_at.nanos_since(before);
        self.mean_nanos.is_some_and(|mean_nanos| interval_nanos / 5 > mean_nanos / 2)
    }

    /// Whether no frame has come for two and a half of the mean intervals since `newest_at` and the latency of the last
    /// frame.
    pub(super) fn silent(&self, newest_at: Time, now: Time) -> bool {
        now.nanos_since(newest_at) > self.silent_after_nanos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn micros(micros: u64) -> Time {
        Time::from_micros(micros)
    }

    /// Frames every 100 us, each 30 us late: silence begins 250 us after the next could have come. A pause of a second
    /// makes the next silence no longer than twice that; a camera that becomes ten times slower is told no more after
    /// 40 frames.
    #[test]
    fn exact_silence_begins_after_two_and_a_half_intervals() {
        let mut intervals = Intervals::default();
        let mut last = None;
        let mut take = |intervals: &mut Intervals, at: u64| {
            intervals.take(last.replace(micros(at)), micros(at), micros(at + 30));
        };
        take(&mut intervals, 0);
        assert!(!intervals.silent(micros(0), micros(1_000_000)), "one frame shows no interval");
        (1..=50).for_each(|frame| take(&mut intervals, 100 * frame));
        assert!(!intervals.silent(micros(5000), micros(5280)));
        assert!(intervals.silent(micros(5000), micros(5281)));
        take(&mut intervals, 1_005_000);
        assert!(intervals.silent(micros(1_005_000), micros(1_005_530)));
        (1..=40).for_each(|frame| take(&mut intervals, 1_005_000 + 1000 * frame));
        assert!(!intervals.silent(micros(1_045_000), micros(1_047_200)));
        assert!(intervals.silent(micros(1_045_000), micros(1_047_600)));
    }
}
