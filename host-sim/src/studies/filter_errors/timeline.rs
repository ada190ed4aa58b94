//! What every run does, and which part of it counts as what.
//!
//! ```text
//! from rest   d drives 0.25 s   spin-up
//!             d drives 0.5 s    steady
//!             the other 0.15 s  reversal
//!             d drives 0.15 s   reversal
//!             d drives 0.2 s    (not counted: d's own motion comes back)
//!             off 0.1 s         stop
//!             off 0.1 s         rest after 100 ms
//!             off 0.8 s         (not counted)
//!             off 0.1 s         rest after 1 s
//! ```

use motor_model::{DriveCommand, DriveMode, Time};

/// A part of a run about which a row of the table speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The first 0.25 s of the drive, from rest.
    SpinUp,
    /// 0.5 s of the drive that follow.
    Steady,
    /// The first 0.15 s after the drive has changed from either mode to the other.
    Reversal,
    /// The first 100 ms without drive.
    Stop,
    /// From 100 to 200 ms without drive.
    Rest100Ms,
    /// From 1 to 1.1 s without drive.
    Rest1S,
}

impl Phase {
    /// All, in the order of a run.
    pub const ALL: [Self; 6] =
        [Self::SpinUp, Self::Steady, Self::Reversal, Self::Stop, Self::Rest100Ms, Self::Rest1S];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SpinUp => "spin_up",
            Self::Steady => "steady",
            Self::Reversal => "reversal",
            Self::Stop => "stop",
            Self::Rest100Ms => "rest_100_ms",
            Self::Rest1S => "rest_1_s",
        }
    }
}

/// A stretch of a run: how long, in ms; whether the drive named, its opposite or none; what it counts as.
struct Stretch(u64, Driven, Option<Phase>);

#[derive(Clone, Copy)]
enum Driven {
    Named,
    Opposite,
    Off,
}

const STRETCHES: [Stretch; 9] = [
    Stretch(250, Driven::Named, Some(Phase::SpinUp)),
    Stretch(500, Driven::Named, Some(Phase::Steady)),
    Stretch(150, Driven::Opposite, Some(Phase::Reversal)),
    Stretch(150, Driven::Named, Some(Phase::Reversal)),
    Stretch(200, Driven::Named, None),
    Stretch(100, Driven::Off, Some(Phase::Stop)),
    Stretch(100, Driven::Off, Some(Phase::Rest100Ms)),
    Stretch(800, Driven::Off, None),
    Stretch(100, Driven::Off, Some(Phase::Rest1S)),
];

/// Length of a run in ns.
pub fn duration_nanos() -> u64 {
    STRETCHES.iter().map(|stretch| stretch.0 * 1_000_000).sum()
}

/// The drive at `now` in a run of `mode`, and what the instant counts as.
pub fn at(now: Time, mode: DriveMode) -> (DriveCommand, Option<Phase>) {
    let mut end_nanos = 0;
    for Stretch(ms, driven, phase) in &STRETCHES {
        end_nanos += ms * 1_000_000;
        if now.nanos() < end_nanos {
            let command = match driven {
                Driven::Named => DriveCommand::full(mode),
                Driven::Opposite => DriveCommand::full(opposite(mode)),
                Driven::Off => DriveCommand::OFF,
            };
            return (command, *phase);
        }
    }
    (DriveCommand::OFF, None)
}

const fn opposite(mode: DriveMode) -> DriveMode {
    match mode {
        DriveMode::B => DriveMode::C,
        DriveMode::C => DriveMode::B,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_drive_and_phase_of_instants() {
        let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
        for (ms, expected) in [
            (0, (c, Some(Phase::SpinUp))),
            (250, (c, Some(Phase::Steady))),
            (750, (b, Some(Phase::Reversal))),
            (900, (c, Some(Phase::Reversal))),
            (1050, (c, None)),
            (1250, (DriveCommand::OFF, Some(Phase::Stop))),
            (1350, (DriveCommand::OFF, Some(Phase::Rest100Ms))),
            (1450, (DriveCommand::OFF, None)),
            (2250, (DriveCommand::OFF, Some(Phase::Rest1S))),
            (2350, (DriveCommand::OFF, None)),
        ] {
            assert_eq!(at(Time::from_micros(1000 * ms), DriveMode::C), expected, "{ms}");
        }
        assert_eq!(duration_nanos(), 2_350_000_000);
    }
}
