//! The stator after a drive: it rings on, and spoils a burst that begins meanwhile.
//!
//! A mode of frequency `f` and damping ratio `zeta` that is no longer driven rings down with the time constant
//!
//! ```text
//! tau = 1 / (2 pi f zeta)        4.0 ms in mode B of Table 1, 2.8 ms in mode C
//! ```
//!
//! The rotor may lie still long before the stator does: after a nudge the filter says so within one `tau`. What is left
//! then of mode B, whose motion is ten times that of mode C, changes the turn of a step that begins by a third. So a
//! burst begins [`TIME_CONSTANTS`] after the last drive, and measuring goes on meanwhile.

use core::f64::consts::TAU;

use motor_model::{DriveMode, MotorParams, Parameter, Time};

/// Time constants until the stator counts as quiet: a fiftieth of its motion is left. It then changes the turn of a step
/// by no more than what forecasts are wrong by, on all plants (`law_a_step_on_a_quiet_stator_turns_as_forecast`).
const TIME_CONSTANTS: f64 = 4.0;

/// The ring-down after the last drive.
#[derive(Clone, Copy, Debug)]
pub struct RingDown {
    /// Of modes B and C, in ns.
    nanos: [u64; 2],
    until: Time,
}

impl RingDown {
    /// In a motor of that design, whose last drive, of a mode unknown, went off at `now` at the latest.
    pub fn new(design: &MotorParams, now: Time) -> Self {
        use Parameter::{ModeBDampingRatio, ModeBFrequency, ModeCDampingRatio, ModeCFrequency};
        let of = |frequency, damping_ratio| {
            let time_constant_s = 1.0 / (TAU * design.get(frequency) * design.get(damping_ratio));
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "positive, and saturates"
            )]
            let nanos = (1e9 * TIME_CONSTANTS * time_constant_s) as u64;
            nanos
        };
        let nanos = [of(ModeBFrequency, ModeBDampingRatio), of(ModeCFrequency, ModeCDampingRatio)];
        let [clockwise, counter_clockwise] = nanos;
        Self { nanos, until: now.plus_nanos(clockwise.max(counter_clockwise)) }
    }

    /// A drive of `mode` goes off.
    pub fn begin(&mut self, mode: DriveMode, now: Time) {
        let [clockwise, counter_clockwise] = self.nanos;
        let until = now.plus_nanos(match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        });
        // What is left of a drive before it may last longer.
        self.until = self.until.max(until);
    }

    /// Whether the stator is quiet.
    pub fn is_over(&self, now: Time) -> bool {
        now >= self.until
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 by hand: 4 / (2 pi 6300 Hz 0.0063) = 16.04 ms, 4 / (2 pi 7460 Hz 0.0075) = 11.38 ms.
    #[test]
    fn exact_the_ring_down_of_table_1() {
        let RingDown { nanos: [clockwise, counter_clockwise], .. } =
            RingDown::new(&MotorParams::nominal(), Time::ZERO);
        assert!((clockwise as f64 - 16.04e6).abs() < 1e4, "{clockwise}");
        assert!((counter_clockwise as f64 - 11.378e6).abs() < 1e4, "{counter_clockwise}");
    }

    /// A step soon after a nudge does not end the nudge's ring-down.
    #[test]
    fn law_the_longer_ring_down_counts() {
        let mut ring_down = RingDown::new(&MotorParams::nominal(), Time::ZERO);
        let is_over = |ring_down: &RingDown, ms: u64| ring_down.is_over(Time::from_nanos(1_000_000 * ms));
        assert!(!is_over(&ring_down, 16) && is_over(&ring_down, 17));
        ring_down.begin(DriveMode::B, Time::from_nanos(20_000_000));
        ring_down.begin(DriveMode::C, Time::from_nanos(21_000_000));
        assert!(!is_over(&ring_down, 36) && is_over(&ring_down, 37));
        ring_down.begin(DriveMode::C, Time::from_nanos(40_000_000));
        assert!(!is_over(&ring_down, 51) && is_over(&ring_down, 52));
    }
}
