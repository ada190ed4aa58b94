//! An experiment: a drive of the motor, and the response to it. Both are plain data, so that one program may plan and
//! another one drive.

use heapless::Vec;
use motor_model::{DriveMode, OutOfBounds};

use super::coasts::Coast;
use super::resonance::{SWEEP_POINTS_MAX, SweepPoint};
use crate::map_correction::LearntFactors;

/// Windows of a cruise.
pub const WINDOWS: usize = 8;

/// Bursts in a train at most.
pub const TRAIN_MAX: u8 = 8;

/// A drive whose response is measured, from rest to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Experiment {
    /// The drive's frequency in steps through the resonance of a mode.
    Sweep {
        /// The mode.
        mode: DriveMode,
        /// Amplitude of the drive, 0 to 1.
        amplitude: f32,
    },
    /// A drive that stays on, for the spin-up and [`WINDOWS`] windows.
    Cruise {
        /// The mode.
        mode: DriveMode,
        /// Amplitude of the drive, 0 to 1.
        amplitude: f32,
        /// Offset of the drive's frequency from the design's, in Hz.
        offset_hz: f32,
    },
    /// Bursts one after the other, each from rest; the angle is measured before the first and after the last.
    Train {
        /// The mode.
        mode: DriveMode,
        /// Amplitude of the drive, 0 to 1.
        amplitude: f32,
        /// As of a cruise.
        offset_hz: f32,
        /// Length of each in ticks.
        ticks: u32,
        /// How many, 1 to [`TRAIN_MAX`].
        count: u8,
    },
}

impl Experiment {
    /// Longest burst in ticks: 1 s.
    pub const BURST_TICKS_MAX: u32 = 100_000;

    /// The mode.
    pub fn mode(&self) -> DriveMode {
        match *self {
            Self::Sweep { mode, .. } | Self::Cruise { mode, .. } | Self::Train { mode, .. } => mode,
        }
    }

    /// Amplitude of the drive, 0 to 1.
    pub fn amplitude(&self) -> f32 {
        match *self {
            Self::Sweep { amplitude, .. }
            | Self::Cruise { amplitude, .. }
            | Self::Train { amplitude, .. } => amplitude,
        }
    }

    /// Offset of the drive's frequency from the design's, in Hz: 0 of a sweep, which has many.
    pub fn offset_hz(&self) -> f32 {
        match *self {
            Self::Sweep { .. } => 0.0,
            Self::Cruise { offset_hz, .. } | Self::Train { offset_hz, .. } => offset_hz,
        }
    }

    /// The same, checked.
    ///
    /// # Errors
    /// When the amplitude is not above 0 and at most 1, the offset exceeds [`LearntFactors::OFFSET_MAX_HZ`], a burst is
    /// empty or longer than [`Self::BURST_TICKS_MAX`], or there is none or more than [`TRAIN_MAX`] of them.
    pub fn checked(self) -> Result<Self, OutOfBounds> {
        let least = f64::from(f32::MIN_POSITIVE);
        OutOfBounds::check("experiment.amplitude", self.amplitude().into(), least, 1.0, "")?;
        let most_hz = f64::from(LearntFactors::OFFSET_MAX_HZ);
        OutOfBounds::check("experiment.offset_hz", self.offset_hz().into(), -most_hz, most_hz, "Hz")?;
        if let Self::Train { ticks, count, .. } = self {
            let ticks_max = f64::from(Self::BURST_TICKS_MAX);
            OutOfBounds::check("experiment.ticks", ticks.into(), 1.0, ticks_max, "")?;
            OutOfBounds::check("experiment.count", count.into(), 1.0, TRAIN_MAX.into(), "")?;
        }
        Ok(self)
    }
}

/// A window of a cruise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TurnWindow {
    /// Turn in rad in the direction of the mode.
    pub turned_rad: f32,
    /// Its variance in rad^2.
    pub turned_rad2: f32,
    /// Length in s.
    pub time_s: f32,
}

/// What an experiment has shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Response {
    /// Nothing: the estimate was lost in the middle of it.
    Lost,
    /// The powers at the frequencies of a sweep.
    Sweep {
        /// In the order of the frequencies.
        points: Vec<SweepPoint, SWEEP_POINTS_MAX>,
    },
    /// The windows of a cruise, and the coast after it.
    Cruise {
        /// In the order of time. Fewer than [`WINDOWS`] are those before the estimate was lost: the coast is then none,
        /// and all else 0.
        windows: Vec<TurnWindow, WINDOWS>,
        /// From the cut until rest.
        coast: Coast,
        /// Time in s from the cut until the estimate no longer says that the rotor moves.
        to_rest_s: f32,
    },
    /// The estimate was lost in a cruise, and the rotor lies where it lay before it: the drive has not turned it.
    Unmoved {
        /// The whole drive.
        window: TurnWindow,
    },
    /// The turn of a train.
    Train {
        /// In rad, in the direction of the mode.
        turned_rad: f32,
        /// Its variance in rad^2, of angles that are independent.
        turned_rad2: f32,
        /// Whether the angle after it is independent of that before: where it is not, it shows too short a turn.
        independent: bool,
        /// Time in s from the end of the last burst until rest.
        to_rest_s: f32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_bounds_of_an_experiment() {
        let mode = DriveMode::C;
        let train =
            |amplitude, ticks, count| Experiment::Train { mode, amplitude, offset_hz: 0.0, ticks, count };
        for (refused, key) in [
            (Experiment::Sweep { mode, amplitude: 0.0 }, "experiment.amplitude"),
            (Experiment::Cruise { mode, amplitude: 1.001, offset_hz: 0.0 }, "experiment.amplitude"),
            (Experiment::Cruise { mode, amplitude: 1.0, offset_hz: 250.1 }, "experiment.offset_hz"),
            (Experiment::Cruise { mode, amplitude: 1.0, offset_hz: f32::NAN }, "experiment.offset_hz"),
            (train(f32::NAN, 10, 1), "experiment.amplitude"),
            (train(1.0, 0, 1), "experiment.ticks"),
            (train(1.0, Experiment::BURST_TICKS_MAX + 1, 1), "experiment.ticks"),
            (train(1.0, 10, 0), "experiment.count"),
            (train(1.0, 10, TRAIN_MAX + 1), "experiment.count"),
        ] {
            assert_eq!(refused.checked().unwrap_err().key, key, "{refused:?}");
        }
        for taken in [
            Experiment::Sweep { mode, amplitude: 1.0 },
            Experiment::Cruise { mode, amplitude: 0.01, offset_hz: -250.0 },
            train(1.0, 1, 1),
            train(0.5, Experiment::BURST_TICKS_MAX, TRAIN_MAX),
        ] {
            assert_eq!(taken.checked(), Ok(taken));
        }
    }
}
