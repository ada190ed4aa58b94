//! The timeline of a run: the drive, and the phase that each part belongs to. `d` is the mode that the run is about.
//!
//! ```text
//! from rest   d drives 0.25 s   spin-up
//!             d drives 0.5 s    steady
//!             the other 0.15 s  reversal
//!             d drives 0.15 s   reversal
//!             d drives 0.2 s    (not counted: the steady motion of d sets in)
//!             off 0.1 s         stop
//!             off 0.1 s         rest after 100 ms
//!             off 0.8 s         (not counted)
//!             off 0.1 s         rest after 1 s
//! ```

use motor_model::{DriveCommand, DriveMode, Time};

/// A part of a run with a row in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimelinePhase {
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

impl TimelinePhase {
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

/// A part of the timeline: its length in ms, the drive, and the phase that it belongs to.
struct TimelinePart(u64, Driven, Option<TimelinePhase>);

/// Which mode is driven: the one that the run is about, the other, or none.
#[derive(Clone, Copy)]
enum Driven {
    Named,
    Opposite,
    Off,
}

const PARTS: [TimelinePart; 9] = [
    TimelinePart(250, Driven::Named, Some(TimelinePhase::SpinUp)),
    TimelinePart(500, Driven::Named, Some(TimelinePhase::Steady)),
    TimelinePart(150, Driven::Opposite, Some(TimelinePhase::Reversal)),
    TimelinePart(150, Driven::Named, Some(TimelinePhase::Reversal)),
    TimelinePart(200, Driven::Named, None),
    TimelinePart(100, Driven::Off, Some(TimelinePhase::Stop)),
    TimelinePart(100, Driven::Off, Some(TimelinePhase::Rest100Ms)),
    TimelinePart(800, Driven::Off, None),
    TimelinePart(100, Driven::Off, Some(TimelinePhase::Rest1S)),
];

/// When a phase is over, in ns.
pub fn end_nanos(phase: TimelinePhase) -> u64 {
    let after = PARTS.iter().rev().skip_while(|part| part.2 != Some(phase));
    after.map(|part| part.0 * 1_000_000).sum()
}

/// The drive at `now` in a run of `mode`, and the phase that the instant belongs to.
pub fn at(now: Time, mode: DriveMode) -> (DriveCommand, Option<TimelinePhase>) {
    let mut end_nanos = 0;
    for TimelinePart(ms, driven, phase) in &PARTS {
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
            (0, (c, Some(TimelinePhase::SpinUp))),
            (250, (c, Some(TimelinePhase::Steady))),
            (750, (b, Some(TimelinePhase::Reversal))),
            (900, (c, Some(TimelinePhase::Reversal))),
            (1050, (c, None)),
            (1250, (DriveCommand::OFF, Some(TimelinePhase::Stop))),
            (1350, (DriveCommand::OFF, Some(TimelinePhase::Rest100Ms))),
            (1450, (DriveCommand::OFF, None)),
            (2250, (DriveCommand::OFF, Some(TimelinePhase::Rest1S))),
            (2350, (DriveCommand::OFF, None)),
        ] {
            assert_eq!(at(Time::from_micros(1000 * ms), DriveMode::C), expected, "{ms}");
        }
        assert_eq!(end_nanos(TimelinePhase::Reversal), 1_050_000_000);
        assert_eq!(end_nanos(TimelinePhase::Rest1S), 2_350_000_000);
    }
}
