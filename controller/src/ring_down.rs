//! The stator after a drive: it rings on, and spoils a burst that begins meanwhile.
//!
//! A mode of frequency `f` and damping ratio `zeta` that is no longer driven rings down with the time constant (C8)
//!
//! ```text
//! tau = 1 / (2 pi f zeta)        4.0 ms in mode B of Table 1, 2.8 ms in mode C
//! ```
//!
//! The rotor may lie still long before the stator does: after a nudge the filter says so within one `tau`. What is left
//! then of mode B, whose motion is ten times that of mode C, changes the turn of a step that begins by a third. So a
//! burst begins [`TIME_CONSTANTS`] after the last drive, and measuring goes on meanwhile.

use core::f32::consts::TAU;

use motor_model::{DriveMode, MotorParams, Parameter, Time};

/// Time constants until the stator counts as quiet: a fiftieth of its motion is left. It then changes the turn of a
/// step by no more than what forecasts are wrong by, in height-only motors and in those of set F
/// (`law_a_step_on_a_quiet_stator_turns_as_forecast`). Three are too few in set F.
const TIME_CONSTANTS: f32 = 4.0;

/// The ring-down after the last drive.
#[derive(Clone, Copy, Debug)]
pub struct RingDown {
    /// From the beginning of the last tick of a drive in mode B, and in mode C, in ns.
    nanos: [u32; 2],
    until: Time,
}

impl RingDown {
    /// In a motor of that design, which may have been driven in mode B until `now`.
    pub fn new(design: &MotorParams, now: Time) -> Self {
        use Parameter::{ModeBDampingRatio, ModeBFrequency, ModeCDampingRatio, ModeCFrequency};
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a time needs no more than single precision; it is positive, and saturates at four seconds"
        )]
        let nanos = [(ModeBFrequency, ModeBDampingRatio), (ModeCFrequency, ModeCDampingRatio)].map(
            |(frequency, damping_ratio)| {
                let turns_per_s = (design.get(frequency) * design.get(damping_ratio)) as f32;
                (crate::TICK_NANOS as u32).saturating_add((1e9 * TIME_CONSTANTS / TAU / turns_per_s) as u32)
            },
        );
        let [clockwise, _] = nanos;
        // The last tick of that drive has ended.
        Self { nanos, until: now.plus_nanos(u64::from(clockwise).saturating_sub(crate::TICK_NANOS)) }
    }

    /// The drive is on in `mode` in the tick that begins at `now`.
    ///
    /// Little is left of the other mode: a cruise or a brake that begins while it rings lasts longer than that.
    pub fn drive(&mut self, mode: DriveMode, now: Time) {
        let [clockwise, counter_clockwise] = self.nanos;
        let nanos = match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        };
        self.until = now.plus_nanos(nanos.into());
    }

    /// Whether the stator is quiet.
    pub fn is_over(&self, now: Time) -> bool {
        now >= self.until
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 by hand: 4 / (2 pi 6300 Hz 0.0063) = 16.040 ms, 4 / (2 pi 7460 Hz 0.0075) = 11.378 ms, after the tick in
    /// which the drive was on.
    #[test]
    fn exact_the_ring_down_of_table_1() {
        let mut ring_down = RingDown::new(&MotorParams::nominal(), Time::ZERO);
        let is_over = |ring_down: &RingDown, us: u64| ring_down.is_over(Time::from_nanos(1_000 * us));
        assert!(!is_over(&ring_down, 16_039) && is_over(&ring_down, 16_040));
        ring_down.drive(DriveMode::C, Time::from_nanos(20_000_000));
        assert!(!is_over(&ring_down, 31_388) && is_over(&ring_down, 31_389));
        ring_down.drive(DriveMode::B, Time::from_nanos(40_000_000));
        assert!(!is_over(&ring_down, 56_049) && is_over(&ring_down, 56_050));
    }

    /// A stator of a tenth of the damping rings ten times as long.
    #[test]
    fn exact_the_ring_down_is_that_of_the_design() {
        let damped = |ratio| MotorParams::nominal().with(Parameter::ModeBDampingRatio, ratio).unwrap();
        let over_us = |design: &MotorParams| {
            let ring_down = RingDown::new(design, Time::ZERO);
            (0..1_000_000).find(|us| ring_down.is_over(Time::from_nanos(1_000 * us))).unwrap()
        };
        let [usual, long] = [0.0063, 0.00063].map(|ratio| over_us(&damped(ratio)));
        assert!(long.abs_diff(10 * usual) <= 10, "{usual} {long}");
    }

    /// A stator that hardly rings down at all is not waited for beyond four seconds.
    #[test]
    fn exact_the_ring_down_saturates() {
        for ratio in [0.0, 1e-9, 2e-5] {
            let design = MotorParams::nominal().with(Parameter::ModeBDampingRatio, ratio).unwrap();
            let ring_down = RingDown::new(&design, Time::ZERO);
            assert!(!ring_down.is_over(Time::from_nanos(4_000_000_000)), "{ratio}");
            assert!(ring_down.is_over(Time::from_nanos(5_100_000_000)), "{ratio}");
        }
    }
}
