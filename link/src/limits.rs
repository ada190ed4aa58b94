//! The limits within which a motor is driven, on the wire. The keys are those of a scene.

use controller::{Limits, Travel};
use motor_model::{DriveCommand, OutOfBounds};
use serde::{Deserialize, Serialize};

/// Longest time of a limit in s: a day.
pub(crate) const TIME_MAX_S: f64 = 86_400.0;

/// [`Limits`] of a move on the wire, without the deadline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MoveLimitsRecord {
    /// Least and greatest angle in degrees between which the rotor may be driven, bounds as in [`Travel::try_new`];
    /// `None` for any. The target lies between them.
    pub travel_deg: Option<(f64, f64)>,
    /// Longest time with the drive on in one cruise, burst or brake, in ns, at most a day; `None` for the default of
    /// [`Limits`].
    pub on_max_nanos: Option<u64>,
    /// Strongest drive, 0 to 1; `None` for full drive.
    pub amplitude_max: Option<f32>,
}

impl MoveLimitsRecord {
    /// The limits of a move with a deadline in ns after arming.
    ///
    /// # Errors
    /// When a limit is out of bounds.
    pub(crate) fn checked(&self, deadline_nanos: u64) -> Result<Limits, OutOfBounds> {
        let default = Limits::default();
        check_s("position.deadline_s", deadline_nanos, (0.0, TIME_MAX_S))?;
        let on_max_nanos = self.on_max_nanos.unwrap_or(default.on_max_nanos);
        check_s("limits.drive_on_s", on_max_nanos, (0.0, TIME_MAX_S))?;
        Ok(Limits {
            amplitude_max: amplitude_max(self.amplitude_max)?,
            on_max_nanos,
            travel: travel(self.travel_deg)?,
            deadline_nanos,
            ..default
        })
    }
}

/// The travel between two angles in degrees, or any.
///
/// # Errors
/// As [`Travel::try_new`].
pub(crate) fn travel(travel_deg: Option<(f64, f64)>) -> Result<Travel, OutOfBounds> {
    travel_deg.map_or(Ok(Travel::FREE), |(least_deg, greatest_deg)| Travel::try_new(least_deg, greatest_deg))
}

/// The strongest drive, full where none is told.
///
/// # Errors
/// When it is not within 0 to 1.
pub(crate) fn amplitude_max(asked: Option<f32>) -> Result<f32, OutOfBounds> {
    let most = DriveCommand::AMPLITUDE_MAX;
    let amplitude = asked.unwrap_or(most);
    OutOfBounds::check("limits.amplitude_max", amplitude.into(), 0.0, most.into(), "")?;
    Ok(amplitude)
}

/// # Errors
/// When a time in ns is not within bounds in s.
pub(crate) fn check_s(key: &'static str, nanos: u64, (min, max): (f64, f64)) -> Result<(), OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    OutOfBounds::check(key, nanos as f64 / 1e9, min, max, "s").map(|_| ())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{
        Configuration, ExperimentsConfiguration, FRAME_BYTES_MAX, FilterKind, Header, HostMessage,
        RateConfiguration, RateLimitsRecord, decode, encode,
    };

    const S: u64 = 1_000_000_000;
    const NONE: MoveLimitsRecord =
        MoveLimitsRecord { travel_deg: None, on_max_nanos: None, amplitude_max: None };
    const MOVE: Configuration = Configuration {
        filter: FilterKind::ConstantRate,
        target_deg: 90.0,
        tolerance_deg: 0.1,
        deadline_nanos: 30 * S,
        limits: NONE,
    };

    /// Without limits of its own a move has those of the controller; each limit goes to its place.
    #[test]
    fn exact_limits_of_a_move_go_to_their_places() {
        let (target, limits) = MOVE.checked().unwrap();
        assert_eq!(target, controller::Target::try_new(90.0, 0.1).unwrap());
        assert_eq!(limits, Limits { deadline_nanos: 30 * S, ..Limits::default() });
        let told = MoveLimitsRecord {
            travel_deg: Some((-10.0, 120.0)),
            on_max_nanos: Some(3 * S),
            amplitude_max: Some(0.5),
        };
        let (_, limits) = Configuration { limits: told, ..MOVE }.checked().unwrap();
        let travel = Travel::try_new(-10.0, 120.0).unwrap();
        let expected = Limits {
            amplitude_max: 0.5,
            on_max_nanos: 3 * S,
            travel,
            deadline_nanos: 30 * S,
            ..Limits::default()
        };
        assert_eq!(limits, expected);
    }

    /// Each number is refused by its own key, beyond either bound, and taken at it. A target outside of the travel is
    /// refused with the travel as its bounds.
    #[test]
    fn exact_every_limit_of_a_move_has_bounds() {
        let limits = |limits| Configuration { limits, ..MOVE };
        let travel =
            |least, greatest| limits(MoveLimitsRecord { travel_deg: Some((least, greatest)), ..NONE });
        let on_max = |nanos| limits(MoveLimitsRecord { on_max_nanos: Some(nanos), ..NONE });
        let amplitude = |amplitude| limits(MoveLimitsRecord { amplitude_max: Some(amplitude), ..NONE });
        let deadline = |deadline_nanos| Configuration { deadline_nanos, ..MOVE };
        for (refused, key) in [
            (travel(f64::NAN, 100.0), "travel.least_deg"),
            (travel(100.0, 99.0), "travel.greatest_deg"),
            (travel(-10.0, 89.0), "position.to_deg"),
            (travel(91.0, 100.0), "position.to_deg"),
            (on_max(86_401 * S), "limits.drive_on_s"),
            (amplitude(-0.1), "limits.amplitude_max"),
            (amplitude(1.01), "limits.amplitude_max"),
            (amplitude(f32::NAN), "limits.amplitude_max"),
            (deadline(86_401 * S), "position.deadline_s"),
        ] {
            assert_eq!(refused.checked().unwrap_err().key, key, "{refused:?}");
        }
        for taken in [
            travel(-10.0, 90.0),
            travel(90.0, 100.0),
            on_max(0),
            on_max(86_400 * S),
            amplitude(0.0),
            amplitude(1.0),
            deadline(86_400 * S),
        ] {
            assert!(taken.checked().is_ok(), "{taken:?}");
        }
        let outside = travel(-10.0, 80.0).checked().unwrap_err();
        assert_eq!((outside.value, outside.min, outside.max, outside.unit), (90.0, -10.0, 80.0, "deg"));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Limits of any bits, each there or not, of every task. Compared as bytes: NaN is not itself.
        #[test]
        fn law_any_limits_come_back(
            travel in prop::option::of((any::<u64>(), any::<u64>())),
            on_max_nanos in prop::option::of(any::<u64>()),
            amplitude in prop::option::of(any::<u32>()),
            window in prop::option::of(any::<u64>()),
        ) {
            let filter = FilterKind::ImpactAided;
            let travel_deg = travel.map(|(least, greatest)| (f64::from_bits(least), f64::from_bits(greatest)));
            let amplitude_max = amplitude.map(f32::from_bits);
            let limits = MoveLimitsRecord { travel_deg, on_max_nanos, amplitude_max };
            for message in [
                HostMessage::Configure(Configuration { limits, ..MOVE }),
                HostMessage::ConfigureRate(RateConfiguration {
                    filter,
                    rate_deg_s: 100.0,
                    duration_nanos: S,
                    limits: RateLimitsRecord {
                        travel_deg,
                        on_max_nanos,
                        amplitude_max,
                        progress_window_nanos: window,
                    },
                }),
                HostMessage::ConfigureExperiments(ExperimentsConfiguration {
                    filter,
                    time_max_nanos: S,
                    travel_deg,
                    amplitude_max,
                }),
            ] {
                let header = Header { session: 1, sequence: 2, ticks: 3 };
                let mut frame = [0; FRAME_BYTES_MAX];
                let length = encode(header, &message, &mut frame).unwrap();
                let mut sent = frame;
                let (_, read) = decode::<HostMessage>(&mut sent[..length]).unwrap();
                let mut again = [0; FRAME_BYTES_MAX];
                encode(header, &read, &mut again).unwrap();
                prop_assert_eq!(frame, again);
            }
        }
    }
}
