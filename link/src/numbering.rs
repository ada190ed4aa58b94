//! Numbers of the enumerations on the wire: one byte for each value.
//!
//! An enumeration of another crate has no number of its own that may go over a wire: its variants may be sorted anew
//! there. Each one has a table here, from which both directions are made: [`Numbered::number`] is an exhaustive match,
//! so a new variant without a number does not compile, and [`Numbered::from_number`] is its inverse. A number that
//! stands in a table is part of the protocol: it never changes its meaning while [`crate::VERSION`] stays the same.
//!
//! In a record the byte is kept as it came ([`Coded`]), so that two reports can be compared bit by bit, and a number
//! that is in no table is seen as such.

use core::fmt;
use core::marker::PhantomData;

use controller::commissioning::{CommissioningEnd, ExperimentPhase};
use controller::rate::RateStop;
use controller::response_map::{Family, MapField, MapPlace};
use controller::{PositioningPhase, StopReason};
use estimator::{Health, Reason, Rejection, Source, Verdict};
use motor_model::DriveMode;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::identity::ResetCause;
use crate::rate::RatePhase;

/// A value that goes over the wire as one byte.
pub trait Numbered: Copy {
    /// Its number.
    fn number(self) -> u8;

    /// The value of that number; `None` where the table has none.
    fn from_number(number: u8) -> Option<Self>;
}

/// Both directions of a [`Numbered`] from one table.
macro_rules! numbered {
    ($enumeration:ty { $($number:literal = [$($value:tt)+],)+ }) => {
        impl Numbered for $enumeration {
            fn number(self) -> u8 {
                match self {
                    $($($value)+ => $number,)+
                }
            }

            fn from_number(number: u8) -> Option<Self> {
                match number {
                    $($number => Some($($value)+),)+
                    _ => None,
                }
            }
        }
    };
}

numbered!(Health {
    0 = [Self::Good],
    1 = [Self::Waiting],
    2 = [Self::Degraded(Reason::VibrometerSilent)],
    3 = [Self::Unusable(Reason::VibrometerSilent)],
    4 = [Self::Degraded(Reason::FramesRefused)],
    5 = [Self::Unusable(Reason::FramesRefused)],
    6 = [Self::Degraded(Reason::Uncertain)],
    7 = [Self::Unusable(Reason::Uncertain)],
    8 = [Self::Degraded(Reason::VibrometerInverted)],
    9 = [Self::Unusable(Reason::VibrometerInverted)],
    10 = [Self::Degraded(Reason::CameraSilent)],
    11 = [Self::Unusable(Reason::CameraSilent)],
    12 = [Self::Degraded(Reason::CameraStuck)],
    13 = [Self::Unusable(Reason::CameraStuck)],
    14 = [Self::Degraded(Reason::NoiseMismatch)],
    15 = [Self::Unusable(Reason::NoiseMismatch)],
    16 = [Self::Degraded(Reason::ImpactsUnexplained)],
    17 = [Self::Unusable(Reason::ImpactsUnexplained)],
    18 = [Self::Degraded(Reason::VibrometerScale)],
    19 = [Self::Unusable(Reason::VibrometerScale)],
    20 = [Self::Degraded(Reason::VibrometerErratic)],
    21 = [Self::Unusable(Reason::VibrometerErratic)],
    22 = [Self::Degraded(Reason::VibrometerUnfit)],
    23 = [Self::Unusable(Reason::VibrometerUnfit)],
    24 = [Self::Degraded(Reason::ReferenceLost)],
    25 = [Self::Unusable(Reason::ReferenceLost)],
    26 = [Self::Degraded(Reason::TurnUnknown)],
    27 = [Self::Unusable(Reason::TurnUnknown)],
});

numbered!(Source {
    0 = [Self::Camera],
});

numbered!(Verdict {
    0 = [Self::Used],
    1 = [Self::Restarted],
    2 = [Self::Rejected(Rejection::OutOfHorizon)],
    3 = [Self::Rejected(Rejection::Gate)],
    4 = [Self::Rejected(Rejection::Repeated)],
    5 = [Self::Rejected(Rejection::Duplicate)],
    6 = [Self::Rejected(Rejection::Future)],
    7 = [Self::Rejected(Rejection::Stuck)],
});

/// The drive: off is 0.
type Driven = Option<DriveMode>;

numbered!(Driven {
    0 = [None],
    1 = [Some(DriveMode::B)],
    2 = [Some(DriveMode::C)],
});

numbered!(ResetCause {
    0 = [Self::Unknown],
    1 = [Self::Power],
    2 = [Self::Pin],
    3 = [Self::Watchdog],
    4 = [Self::Software],
    5 = [Self::Other],
    6 = [Self::Panic],
    7 = [Self::Fault],
});

numbered!(Family {
    0 = [Self::Step],
    1 = [Self::Walk],
    2 = [Self::Stride],
    3 = [Self::Nudge],
    4 = [Self::Throw],
});

numbered!(MapPlace {
    0 = [Self::Cruises],
    1 = [Self::Bursts(Family::Step)],
    2 = [Self::Bursts(Family::Walk)],
    3 = [Self::Bursts(Family::Stride)],
    4 = [Self::Bursts(Family::Nudge)],
    5 = [Self::Bursts(Family::Throw)],
});

numbered!(MapField {
    0 = [Self::Amplitude],
    1 = [Self::Ticks],
    2 = [Self::Turn],
    3 = [Self::MotorsSd],
    4 = [Self::RepeatSd],
    5 = [Self::Rate],
    6 = [Self::RateSd],
    7 = [Self::Coast],
    8 = [Self::CoastSd],
});

/// [`PositioningPhase`] on the wire, or the phase of a rate or of experiments: without what other fields of the report
/// tell already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhaseRecord {
    /// No usable estimate. The health of the report says why.
    Waiting,
    /// A cruise. The command of the report says which.
    Cruise,
    /// A burst. The command of the report says which.
    Burst,
    /// Drive off, waiting for rest and a good measurement.
    Settling,
    /// A rotor that turns on is stopped. The command of the report says by which mode.
    Brake,
    /// At the target.
    Holding,
    /// Given up, and why.
    Stopped(StopReason),
    /// A rate, and what becomes of it.
    Rate(RatePhase),
    /// Experiments, and what becomes of them.
    Experiment(ExperimentPhase),
}

impl From<PositioningPhase> for PhaseRecord {
    fn from(phase: PositioningPhase) -> Self {
        match phase {
            PositioningPhase::Waiting(_) => Self::Waiting,
            PositioningPhase::Cruise { .. } => Self::Cruise,
            PositioningPhase::Burst { .. } => Self::Burst,
            PositioningPhase::Settling(_) => Self::Settling,
            PositioningPhase::Brake { .. } => Self::Brake,
            PositioningPhase::Holding => Self::Holding,
            PositioningPhase::Stopped(why) => Self::Stopped(why),
        }
    }
}

numbered!(PhaseRecord {
    0 = [Self::Waiting],
    1 = [Self::Cruise],
    2 = [Self::Burst],
    3 = [Self::Settling],
    4 = [Self::Holding],
    5 = [Self::Stopped(StopReason::Cancelled)],
    6 = [Self::Stopped(StopReason::TimedOut)],
    7 = [Self::Stopped(StopReason::Stalled)],
    8 = [Self::Stopped(StopReason::ModeInverted)],
    9 = [Self::Stopped(StopReason::OutOfTravel)],
    10 = [Self::Stopped(StopReason::TooManyDrives)],
    11 = [Self::Stopped(StopReason::ModeBLost)],
    12 = [Self::Stopped(StopReason::ModeCLost)],
    13 = [Self::Brake],
    14 = [Self::Stopped(StopReason::KeepsTurning)],
    15 = [Self::Stopped(StopReason::NotMeasurable)],
    16 = [Self::Stopped(StopReason::NoEstimate)],
    17 = [Self::Rate(RatePhase::Waiting)],
    18 = [Self::Rate(RatePhase::Following)],
    19 = [Self::Rate(RatePhase::Over)],
    20 = [Self::Rate(RatePhase::Stopped(RateStop::Stuck))],
    21 = [Self::Rate(RatePhase::Stopped(RateStop::WrongWay))],
    22 = [Self::Rate(RatePhase::Stopped(RateStop::EndOfTravel))],
    23 = [Self::Rate(RatePhase::Stopped(RateStop::DrivenTooLong))],
    24 = [Self::Experiment(ExperimentPhase::Resting)],
    25 = [Self::Experiment(ExperimentPhase::Sweeping)],
    26 = [Self::Experiment(ExperimentPhase::Cruising)],
    27 = [Self::Experiment(ExperimentPhase::Bursting)],
    28 = [Self::Experiment(ExperimentPhase::Ready)],
    29 = [Self::Experiment(ExperimentPhase::Ended(CommissioningEnd::Enough))],
    30 = [Self::Experiment(ExperimentPhase::Ended(CommissioningEnd::TimeOver))],
    31 = [Self::Experiment(ExperimentPhase::Ended(CommissioningEnd::NoEstimate))],
    32 = [Self::Experiment(ExperimentPhase::Ended(CommissioningEnd::NeverRests))],
    33 = [Self::Rate(RatePhase::Stopped(RateStop::NoEstimate))],
    34 = [Self::Experiment(ExperimentPhase::Ended(CommissioningEnd::EndOfTravel))],
});

/// The byte of a `T` as it came over the wire. Two are equal when their bytes are.
pub struct Coded<T> {
    number: u8,
    of: PhantomData<T>,
}

impl<T: Numbered> Coded<T> {
    /// What the byte means; `None` for a number that has no meaning in this version.
    pub fn value(self) -> Option<T> {
        T::from_number(self.number)
    }
}

impl<T> Coded<T> {
    /// The byte itself.
    pub const fn number(self) -> u8 {
        self.number
    }

    /// Any byte, with a meaning or without.
    pub const fn from_number(number: u8) -> Self {
        Self { number, of: PhantomData }
    }
}

impl<T: Numbered> From<T> for Coded<T> {
    fn from(value: T) -> Self {
        Self::from_number(value.number())
    }
}

// Written out, since a derive would ask the same of `T`.
impl<T> Clone for Coded<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Coded<T> {}

impl<T> PartialEq for Coded<T> {
    fn eq(&self, other: &Self) -> bool {
        self.number == other.number
    }
}

impl<T> Eq for Coded<T> {}

/// The value as it prints itself, or the number where it has no meaning.
impl<T: Numbered + fmt::Debug> fmt::Debug for Coded<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value() {
            Some(value) => value.fmt(f),
            None => write!(f, "number {} without a meaning", self.number),
        }
    }
}

/// The same for a reader.
impl<T: Numbered + fmt::Display> fmt::Display for Coded<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value() {
            Some(value) => value.fmt(f),
            None => write!(f, "number {} without a meaning", self.number),
        }
    }
}

impl<T> Serialize for Coded<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u8(self.number)
    }
}

impl<'de, T> Deserialize<'de> for Coded<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        u8::deserialize(deserializer).map(Self::from_number)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::fmt::Debug;

    use super::*;

    /// Every number below `count` is that of one value, and no other number is.
    fn check_round_trip<T: Numbered + PartialEq + Debug>(count: u8) {
        for number in 0..=u8::MAX {
            let coded = Coded::<T>::from_number(number);
            assert_eq!(coded.value().is_some(), number < count, "{number}");
            if let Some(value) = coded.value() {
                assert_eq!((value.number(), Coded::from(value)), (number, coded), "{value:?}");
            }
        }
    }

    /// As many as the enumerations have values: 2 and twice 11 reasons, 1, 2 and 6 rejections, off and 2 modes, 6
    /// phases and 11 reasons, 3 phases of a rate and 4 reasons, 5 of experiments and 5 ends, 5 families, these and the
    /// cruises, 9 numbers.
    #[test]
    fn exact_every_value_comes_back_and_other_numbers_have_none() {
        check_round_trip::<Health>(28);
        check_round_trip::<Source>(1);
        check_round_trip::<Verdict>(8);
        check_round_trip::<Option<DriveMode>>(3);
        check_round_trip::<PhaseRecord>(35);
        check_round_trip::<Family>(5);
        check_round_trip::<MapPlace>(6);
        check_round_trip::<MapField>(9);
    }

    /// Numbers that are in use: the protocol.
    #[test]
    fn exact_numbers_of_the_protocol() {
        assert_eq!(Health::Unusable(Reason::Uncertain).number(), 7);
        assert_eq!(Health::Degraded(Reason::VibrometerErratic).number(), 20);
        assert_eq!(Verdict::Rejected(Rejection::Duplicate).number(), 5);
        assert_eq!(Some(DriveMode::C).number(), 2);
        assert_eq!(PhaseRecord::Stopped(StopReason::ModeCLost).number(), 12);
        assert_eq!(PhaseRecord::Stopped(StopReason::NoEstimate).number(), 16);
        assert_eq!(PhaseRecord::Rate(RatePhase::Stopped(RateStop::EndOfTravel)).number(), 22);
        assert_eq!(PhaseRecord::Rate(RatePhase::Stopped(RateStop::NoEstimate)).number(), 33);
        assert_eq!((Family::Throw.number(), MapPlace::Bursts(Family::Throw).number()), (4, 5));
        assert_eq!(MapField::CoastSd.number(), 8);
    }

    #[test]
    fn exact_a_code_prints_its_value_or_its_number() {
        assert_eq!(std::format!("{:?}", Coded::from(Verdict::Used)), "Used");
        let unknown = Coded::<Verdict>::from_number(99);
        assert_eq!(std::format!("{unknown:?}"), "number 99 without a meaning");
    }

    /// The wire carries the number as one byte, as a plain `u8` would be.
    #[test]
    fn exact_a_code_is_one_byte_on_the_wire() {
        let mut bytes = [0; 4];
        for number in 0..=u8::MAX {
            let coded = Coded::<Health>::from_number(number);
            assert_eq!(postcard::to_slice(&coded, &mut bytes).unwrap(), [number]);
            assert_eq!(postcard::from_bytes::<Coded<Health>>(&[number]), Ok(coded));
        }
    }
}
