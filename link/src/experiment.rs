//! Experiments on the wire: how they are configured, what is ordered, and what they have shown.
//!
//! ```text
//! host:  ConfigureExperiments, Arm        Experiment(1)          Response          Experiment(2)   ...   Stop
//! board: Configured, Armed     reports ... ExperimentTaken  ...  Response  ...    ExperimentTaken
//!                               Ready                       Ready
//! ```
//!
//! Experiments are numbered from 1. The same order twice is one order, and a response stays until the next order: where
//! a frame is lost, the host asks again.

use controller::commissioning::ExperimentTuning;
use controller::commissioning::coasts::Coast;
use controller::commissioning::experiment::{Experiment, Response, TurnWindow, WINDOWS};
use controller::commissioning::resonance::{SWEEP_POINTS_MAX, SweepPoint};
use estimator::Instruments;
use heapless::Vec;
use motor_model::{DriveMode, OutOfBounds};
use serde::{Deserialize, Serialize};

use crate::limits;
use crate::message::FilterKind;
use crate::numbering::Coded;

/// Experiments, instead of a move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExperimentsConfiguration {
    /// The filter to estimate by.
    pub filter: FilterKind,
    /// Time after arming at which they end, in ns, at most [`Self::TIME_MAX_S`].
    pub time_max_nanos: u64,
    /// Least and greatest angle in degrees between which the rotor may be driven, bounds as in
    /// [`controller::Travel::try_new`]; `None` for any.
    pub travel_deg: Option<(f64, f64)>,
    /// Strongest drive that may be ordered, 0 to 1; `None` for full drive.
    pub amplitude_max: Option<f32>,
}

impl ExperimentsConfiguration {
    /// Longest time in s: an hour.
    pub const TIME_MAX_S: f64 = 3600.0;

    /// The tuning for `instruments`.
    ///
    /// # Errors
    /// When the time or a limit is out of bounds.
    pub fn checked(&self, instruments: &Instruments) -> Result<ExperimentTuning, OutOfBounds> {
        limits::check_s("experiment.time_max_s", self.time_max_nanos, (0.0, Self::TIME_MAX_S))?;
        let (travel, amplitude_max) =
            (limits::travel(self.travel_deg)?, limits::amplitude_max(self.amplitude_max)?);
        Ok(ExperimentTuning::new(instruments)
            .with_time_max(self.time_max_nanos)
            .with_limits(travel, amplitude_max))
    }
}

/// An order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExperimentRecord {
    /// One more than that of the order before; 1 of the first after arming.
    pub number: u16,
    /// The mode; off is none.
    pub mode: Coded<Option<DriveMode>>,
    /// Amplitude of the drive, above 0 and at most 1.
    pub amplitude: f32,
    /// Offset of the drive's frequency from the design's, in Hz; 0 of a sweep.
    pub offset_hz: f32,
    /// Which drive.
    pub drive: ExperimentDrive,
}

/// The drive of an experiment, see [`Experiment`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ExperimentDrive {
    /// [`Experiment::Sweep`]
    Sweep,
    /// [`Experiment::Cruise`]
    Cruise,
    /// [`Experiment::Train`]
    Train {
        /// Length of each burst in ticks.
        ticks: u32,
        /// How many, 1 to [`controller::commissioning::experiment::TRAIN_MAX`].
        count: u8,
    },
}

impl ExperimentRecord {
    /// The order of `experiment`.
    pub fn new(number: u16, experiment: &Experiment) -> Self {
        let (amplitude, drive) = match *experiment {
            Experiment::Sweep { amplitude, .. } => (amplitude, ExperimentDrive::Sweep),
            Experiment::Cruise { amplitude, .. } => (amplitude, ExperimentDrive::Cruise),
            Experiment::Train { amplitude, ticks, count, .. } => {
                (amplitude, ExperimentDrive::Train { ticks, count })
            }
        };
        let offset_hz = experiment.offset_hz();
        Self { number, mode: Some(experiment.mode()).into(), amplitude, offset_hz, drive }
    }

    /// The experiment.
    ///
    /// # Errors
    /// When there is no such mode, or a number is out of bounds.
    pub fn checked(&self) -> Result<Experiment, OutOfBounds> {
        let Self { mode, amplitude, offset_hz, drive, .. } = *self;
        let no_mode =
            OutOfBounds { key: "experiment.mode", value: mode.number().into(), min: 1.0, max: 2.0, unit: "" };
        let mode = mode.value().flatten().ok_or(no_mode)?;
        match drive {
            ExperimentDrive::Sweep => Experiment::Sweep { mode, amplitude },
            ExperimentDrive::Cruise => Experiment::Cruise { mode, amplitude, offset_hz },
            ExperimentDrive::Train { ticks, count } => {
                Experiment::Train { mode, amplitude, offset_hz, ticks, count }
            }
        }
        .checked()
    }
}

/// What an experiment has shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResponseRecord {
    /// Its number.
    pub number: u16,
    /// [`Response`] on the wire.
    pub shown: ShownRecord,
}

/// [`Response`] on the wire, with the same fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ShownRecord {
    /// [`Response::Lost`]
    Lost,
    /// [`Response::Sweep`]: offset in Hz, power in m^2/s^2 and relative variance of each point.
    Sweep(Vec<[f32; 3], SWEEP_POINTS_MAX>),
    /// [`Response::Cruise`]
    Cruise {
        /// Turn in rad, its variance in rad^2 and length in s of each window.
        windows: Vec<[f32; 3], WINDOWS>,
        /// Rate at the cut in rad/s, its variance in rad^2/s^2, turn from the cut until rest in rad, its variance in
        /// rad^2 and the covariance of turn and rate in rad^2/s.
        coast: [f32; 5],
        /// Time from the cut until rest in s.
        to_rest_s: f32,
    },
    /// [`Response::Train`]
    Train {
        /// Turn in rad.
        turned_rad: f32,
        /// Its variance in rad^2.
        turned_rad2: f32,
        /// Whether the angle after it is independent of that before.
        independent: bool,
        /// Time from the end of the last burst until rest in s.
        to_rest_s: f32,
    },
    /// [`Response::Unmoved`]: turn in rad, its variance in rad^2 and length in s of the drive.
    Unmoved([f32; 3]),
}

/// What `of` makes of each of `values`. Unlike collecting, this has no panic for an iterator that is too long.
fn each<T, U, const N: usize>(values: &Vec<T, N>, of: impl Fn(&T) -> U) -> Vec<U, N> {
    let mut made = Vec::new();
    for value in values {
        // Never full: as many as there were.
        let _ = made.push(of(value));
    }
    made
}

fn window_record(window: &TurnWindow) -> [f32; 3] {
    [window.turned_rad, window.turned_rad2, window.time_s]
}

fn window_of(&[turned_rad, turned_rad2, time_s]: &[f32; 3]) -> TurnWindow {
    TurnWindow { turned_rad, turned_rad2, time_s }
}

impl From<&Response> for ShownRecord {
    fn from(response: &Response) -> Self {
        match response {
            Response::Lost => Self::Lost,
            Response::Unmoved { window } => Self::Unmoved(window_record(window)),
            Response::Sweep { points } => Self::Sweep(each(points, |point| {
                [point.offset_hz, point.power_m2_s2, point.relative_variance]
            })),
            Response::Cruise { windows, coast, to_rest_s } => Self::Cruise {
                windows: each(windows, window_record),
                coast: [
                    coast.rate_rad_s,
                    coast.rate_rad2_s2,
                    coast.turned_rad,
                    coast.turned_rad2,
                    coast.turned_rate_rad2_s,
                ],
                to_rest_s: *to_rest_s,
            },
            &Response::Train { turned_rad, turned_rad2, independent, to_rest_s } => {
                Self::Train { turned_rad, turned_rad2, independent, to_rest_s }
            }
        }
    }
}

impl From<&ShownRecord> for Response {
    fn from(record: &ShownRecord) -> Self {
        match record {
            ShownRecord::Lost => Self::Lost,
            ShownRecord::Unmoved(window) => Self::Unmoved { window: window_of(window) },
            ShownRecord::Sweep(points) => Self::Sweep {
                points: each(points, |&[offset_hz, power_m2_s2, relative_variance]| SweepPoint {
                    offset_hz,
                    power_m2_s2,
                    relative_variance,
                }),
            },
            &ShownRecord::Cruise {
                ref windows,
                coast: [rate_rad_s, rate_rad2_s2, turned_rad, turned_rad2, turned_rate_rad2_s],
                to_rest_s,
            } => Self::Cruise {
                windows: each(windows, window_of),
                coast: Coast { rate_rad_s, rate_rad2_s2, turned_rad, turned_rad2, turned_rate_rad2_s },
                to_rest_s,
            },
            &ShownRecord::Train { turned_rad, turned_rad2, independent, to_rest_s } => {
                Self::Train { turned_rad, turned_rad2, independent, to_rest_s }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use controller::Travel;

    use super::*;

    /// An order comes back as it was, and its refusals name what is wrong.
    #[test]
    fn exact_an_order_comes_back() {
        let mode = DriveMode::B;
        for experiment in [
            Experiment::Sweep { mode, amplitude: 1.0 },
            Experiment::Cruise { mode: DriveMode::C, amplitude: 0.25, offset_hz: 31.5 },
            Experiment::Train { mode, amplitude: 0.5, offset_hz: -63.0, ticks: 120, count: 8 },
        ] {
            let record = ExperimentRecord::new(3, &experiment);
            assert_eq!((record.number, record.checked()), (3, Ok(experiment)));
            let off = ExperimentRecord { mode: None.into(), ..record };
            assert_eq!(off.checked().unwrap_err().key, "experiment.mode");
            let none = ExperimentRecord { amplitude: f32::NAN, ..record };
            assert_eq!(none.checked().unwrap_err().key, "experiment.amplitude");
        }
    }

    #[test]
    fn exact_a_response_comes_back() {
        let window = TurnWindow { turned_rad: 0.5, turned_rad2: 1e-9, time_s: 0.05 };
        let point = SweepPoint { offset_hz: -25.0, power_m2_s2: 1e-6, relative_variance: 0.01 };
        for response in [
            Response::Lost,
            Response::Unmoved { window },
            Response::Sweep { points: [point; 13].into_iter().collect() },
            Response::Cruise {
                windows: [window; WINDOWS].into_iter().collect(),
                coast: Coast {
                    rate_rad_s: 16.0,
                    rate_rad2_s2: 1e-3,
                    turned_rad: 0.1,
                    turned_rad2: 1e-8,
                    turned_rate_rad2_s: -1e-6,
                },
                to_rest_s: 0.02,
            },
            Response::Train { turned_rad: -0.1, turned_rad2: 1e-8, independent: true, to_rest_s: 0.01 },
        ] {
            assert_eq!(Response::from(&ShownRecord::from(&response)), response);
        }
    }

    #[test]
    fn exact_time_and_limits_have_bounds() {
        const ANY: ExperimentsConfiguration = ExperimentsConfiguration {
            filter: FilterKind::ConstantRate,
            time_max_nanos: 60_000_000_000,
            travel_deg: None,
            amplitude_max: None,
        };
        let instruments = Instruments::default();
        let default = ExperimentTuning::new(&instruments);
        let time = |time_max_nanos| ExperimentsConfiguration { time_max_nanos, ..ANY };
        let travel = |travel_deg| ExperimentsConfiguration { travel_deg: Some(travel_deg), ..ANY };
        let amplitude = |amplitude| ExperimentsConfiguration { amplitude_max: Some(amplitude), ..ANY };
        let tenth = Travel::try_new(-36.0, 36.0).unwrap();
        for (taken, tuning) in [
            (ANY, default),
            (time(5), default.with_time_max(5)),
            (travel((-36.0, 36.0)), default.with_limits(tenth, 1.0)),
            (amplitude(0.0), default.with_limits(Travel::FREE, 0.0)),
            (amplitude(1.0), default),
        ] {
            assert_eq!(taken.checked(&instruments).unwrap(), tuning, "{taken:?}");
        }
        for (refused, key) in [
            (time(3_600_000_000_001), "experiment.time_max_s"),
            (travel((f64::NAN, 1.0)), "travel.least_deg"),
            (travel((2.0, 1.0)), "travel.greatest_deg"),
            (amplitude(1.01), "limits.amplitude_max"),
            (amplitude(f32::NAN), "limits.amplitude_max"),
        ] {
            assert_eq!(refused.checked(&instruments).unwrap_err().key, key, "{refused:?}");
        }
    }
}
