//! The drive by hand: what is asked, and what was seen of it.

use controller::TICK_NANOS;
use motor_model::{DriveCommand, OutOfBounds};
use serde::{Deserialize, Serialize};

use crate::observation::VelocitySums;
use crate::tick_record::CommandRecord;

/// A drive by hand: no filter, no camera, no target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jog {
    /// Mode, level and offset of the frequency. Off is none.
    pub command: CommandRecord,
    /// Time for which it is on, in ns: a tick to [`Self::DURATION_MAX_S`].
    pub duration_nanos: u64,
}

impl Jog {
    /// Longest time in s: a motor that somebody looks at must not run away from him.
    pub const DURATION_MAX_S: f64 = 1.0;

    /// The drive, and the whole ticks that the duration takes.
    ///
    /// # Errors
    /// When there is no such mode, or level, offset or duration are out of bounds. The keys are those of a scene.
    pub fn checked(&self) -> Result<(DriveCommand, u64), OutOfBounds> {
        let Self { command: CommandRecord { mode, amplitude, frequency_offset_hz }, duration_nanos } = *self;
        let no_mode =
            OutOfBounds { key: "jog.mode", value: mode.number().into(), min: 1.0, max: 2.0, unit: "" };
        let mode = mode.value().flatten().ok_or(no_mode)?;
        OutOfBounds::check("jog.level", amplitude.into(), 0.0, DriveCommand::AMPLITUDE_MAX.into(), "")?;
        let offset_max_hz = f64::from(DriveCommand::FREQUENCY_OFFSET_MAX_HZ);
        let offset_hz = f64::from(frequency_offset_hz);
        OutOfBounds::check("jog.offset_hz", offset_hz, -offset_max_hz, offset_max_hz, "Hz")?;
        #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
        let [duration_s, tick_s] = [duration_nanos, TICK_NANOS].map(|nanos| nanos as f64 / 1e9);
        OutOfBounds::check("jog.duration_s", duration_s, tick_s, Self::DURATION_MAX_S, "s")?;
        let command = DriveCommand::try_new(mode, amplitude)?.with_frequency_offset(frequency_offset_hz)?;
        Ok((command, duration_nanos.div_ceil(TICK_NANOS)))
    }
}

/// What a board saw of a jog that was over with its duration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JogReport {
    /// Ticks for which the drive was on.
    pub ticks: u32,
    /// What the amplifier applied in the last of them.
    pub applied: CommandRecord,
    /// The vibrometer meanwhile. A converter at the board has two samples a tick, and fewer when some were out of
    /// its range.
    pub velocity: VelocitySums,
}

#[cfg(test)]
mod tests {
    use motor_model::DriveMode;

    use super::*;
    use crate::numbering::Coded;

    fn jog(command: CommandRecord, duration_nanos: u64) -> Jog {
        Jog { command, duration_nanos }
    }

    /// Every bound, at both of its ends, and what is just beyond.
    #[test]
    fn exact_bounds_of_a_jog() {
        let full = CommandRecord::from(DriveCommand::full(DriveMode::C));
        let refused = |jog: Jog| jog.checked().unwrap_err().key;
        assert_eq!(jog(full, 1_000_000_000).checked(), Ok((DriveCommand::full(DriveMode::C), 100_000)));
        assert_eq!(jog(full, 10_000).checked().unwrap().1, 1);
        assert_eq!(jog(full, 10_001).checked().unwrap().1, 2);
        for duration_nanos in [0, 9_999, 1_000_000_001, u64::MAX] {
            assert_eq!(refused(jog(full, duration_nanos)), "jog.duration_s", "{duration_nanos}");
        }
        for amplitude in [0.0, 1.0] {
            assert!(jog(CommandRecord { amplitude, ..full }, 10_000).checked().is_ok());
        }
        for amplitude in [-0.1, 1.01, f32::NAN] {
            assert_eq!(refused(jog(CommandRecord { amplitude, ..full }, 10_000)), "jog.level", "{amplitude}");
        }
        for frequency_offset_hz in [-2000.1, 2000.1, f32::NAN] {
            assert_eq!(refused(jog(CommandRecord { frequency_offset_hz, ..full }, 10_000)), "jog.offset_hz");
        }
        let offset = CommandRecord { frequency_offset_hz: -2000.0, ..full };
        let taken_hz = jog(offset, 10_000).checked().unwrap().0.frequency_offset_hz();
        assert!((taken_hz + 2000.0).abs() < 1e-3, "{taken_hz}");
        for mode in [None.into(), Coded::from_number(3)] {
            assert_eq!(refused(jog(CommandRecord { mode, ..full }, 10_000)), "jog.mode");
        }
    }
}
