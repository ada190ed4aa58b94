//! Drive commands: mode, amplitude and frequency offset of the coil's current.
//!
//! The coil's field forces one of the two driven modes, never both:
//!
//! ```text
//! a_n(t) = amplitude F_n sin(phase(t)),   F_n = 2 zeta_n w_n^2 A_n                    (7b, 7c)
//! ```
//!
//! so that amplitude 1 at resonance makes the steady amplitude equal the measured antinode amplitude `A_n`. The
//! phase is one integer accumulator: it is continuous through changes of frequency and amplitude and constant
//! while the drive is off, so a burst of whole cycles does not change it.

use crate::error::OutOfBounds;

/// A mode that the coil can drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveMode {
    /// Mode B, 6.30 kHz: turns the rotor clockwise (positive).
    B,
    /// Mode C, 7.46 kHz: turns the rotor counter-clockwise (negative).
    C,
}

/// A valid drive command. Off by default.
#[derive(Clone, Copy, Debug)]
pub struct DriveCommand {
    mode: Option<DriveMode>,
    amplitude: f32,
    frequency_offset_hz: f32,
}

/// Bit by bit: this suffices for a step to detect a new command, and is cheaper than comparing floats.
impl PartialEq for DriveCommand {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.mode == other.mode
            && self.amplitude.to_bits() == other.amplitude.to_bits()
            && self.frequency_offset_hz.to_bits() == other.frequency_offset_hz.to_bits()
    }
}

impl Eq for DriveCommand {}

impl Default for DriveCommand {
    fn default() -> Self {
        Self::OFF
    }
}

impl DriveCommand {
    /// No field.
    pub const OFF: Self = Self { mode: None, amplitude: 0.0, frequency_offset_hz: 0.0 };

    /// Largest amplitude, as a fraction of the drive at which Table 1's amplitudes were measured (8 Oe).
    pub const AMPLITUDE_MAX: f32 = 1.0;

    /// Largest magnitude of the frequency offset: over 20 % of either resonance.
    pub const FREQUENCY_OFFSET_MAX_HZ: f32 = 2000.0;

    /// Full drive of `mode` at its nominal frequency.
    pub const fn full(mode: DriveMode) -> Self {
        Self { mode: Some(mode), amplitude: Self::AMPLITUDE_MAX, frequency_offset_hz: 0.0 }
    }

    /// Drive of `mode` with `amplitude` in `0..=AMPLITUDE_MAX`, at its nominal frequency.
    ///
    /// # Errors
    /// When the amplitude is outside its bounds or NaN.
    pub fn try_new(mode: DriveMode, amplitude: f32) -> Result<Self, OutOfBounds> {
        OutOfBounds::check("drive.amplitude", f64::from(amplitude), 0.0, f64::from(Self::AMPLITUDE_MAX), "")?;
        Ok(Self { mode: Some(mode), amplitude, frequency_offset_hz: 0.0 })
    }

    /// Drive of `mode` with `amplitude` limited to `0..=AMPLITUDE_MAX` (NaN counts as 0): for a control loop, which
    /// saturates where a user's input is refused.
    #[must_use]
    pub fn saturating(mode: DriveMode, amplitude: f32) -> Self {
        // In comparisons: the microcontroller calls a function for `f32::min`.
        let amplitude = if amplitude >= Self::AMPLITUDE_MAX {
            Self::AMPLITUDE_MAX
        } else if amplitude > 0.0 {
            amplitude
        } else {
            0.0
        };
        Self { mode: Some(mode), amplitude, frequency_offset_hz: 0.0 }
    }

    /// The same drive `offset_hz` above (below, if negative) the mode's nominal frequency.
    ///
    /// # Errors
    /// When the magnitude exceeds [`Self::FREQUENCY_OFFSET_MAX_HZ`] or is NaN.
    pub fn with_frequency_offset(self, offset_hz: f32) -> Result<Self, OutOfBounds> {
        let max = f64::from(Self::FREQUENCY_OFFSET_MAX_HZ);
        OutOfBounds::check("drive.frequency_offset_hz", f64::from(offset_hz), -max, max, "Hz")?;
        Ok(Self { frequency_offset_hz: offset_hz, ..self })
    }

    /// The same with an offset limited to [`Self::FREQUENCY_OFFSET_MAX_HZ`] in magnitude (NaN counts as 0): for a
    /// control loop, as [`Self::saturating`].
    #[must_use]
    pub fn with_saturating_offset(self, offset_hz: f32) -> Self {
        let max = Self::FREQUENCY_OFFSET_MAX_HZ;
        let offset_hz = if offset_hz >= max {
            max
        } else if offset_hz <= -max {
            -max
        } else if offset_hz.is_nan() {
            0.0
        } else {
            offset_hz
        };
        Self { frequency_offset_hz: offset_hz, ..self }
    }

    /// The driven mode; `None` when the drive is off.
    #[inline]
    pub const fn mode(self) -> Option<DriveMode> {
        self.mode
    }

    /// Amplitude, 0 when off.
    #[inline]
    pub const fn amplitude(self) -> f32 {
        self.amplitude
    }

    /// Offset from the mode's nominal drive frequency.
    #[inline]
    pub const fn frequency_offset_hz(self) -> f32 {
        self.frequency_offset_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_bounds_are_enforced_and_named() {
        for bad in [-0.1, 1.000_001, f32::NAN, f32::INFINITY] {
            let error = DriveCommand::try_new(DriveMode::B, bad).unwrap_err();
            assert_eq!((error.key, error.min, error.max), ("drive.amplitude", 0.0, 1.0));
        }
        assert!(DriveCommand::full(DriveMode::C).with_frequency_offset(2000.5).is_err());
        assert!(DriveCommand::full(DriveMode::C).with_frequency_offset(f32::NAN).is_err());
        for (asked_hz, given_hz) in
            [(30.5, 30.5), (-2000.5, -2000.0), (f32::INFINITY, 2000.0), (f32::NAN, 0.0), (2000.0, 2000.0)]
        {
            let command = DriveCommand::full(DriveMode::C).with_saturating_offset(asked_hz);
            assert_eq!(command.frequency_offset_hz().to_bits(), f32::to_bits(given_hz), "{asked_hz}");
        }
    }

    #[test]
    fn exact_saturation() {
        for (asked, given) in [(f32::NAN, 0.0), (-3.0, 0.0), (0.25, 0.25), (7.0, 1.0)] {
            let amplitude = DriveCommand::saturating(DriveMode::B, asked).amplitude();
            assert!((amplitude - given).abs() < f32::EPSILON);
        }
    }
}
