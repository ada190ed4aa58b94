//! The holding of a rate, on the wire: what is asked, and what becomes of it.
//!
//! Both sides read what is asked by [`RateConfiguration::checked`], so that the host knows beforehand what the board
//! refuses.

use controller::RateReport;
use controller::rate::{Dwell, RateLimits, RateStop, RateTuning};
use estimator::Instruments;
use motor_model::OutOfBounds;
use serde::{Deserialize, Serialize};

use crate::limits::{self, TIME_MAX_S, check_s};
use crate::message::FilterKind;

/// A rate to hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateConfiguration {
    /// The filter to estimate by.
    pub filter: FilterKind,
    /// The rate in deg/s, clockwise positive; bounds as in [`Dwell::try_new`]. 0 asks for rest.
    pub rate_deg_s: f64,
    /// Time after arming for which it is held, in ns, at most [`Self::TIME_MAX_S`]. The drive is off from then on.
    pub duration_nanos: u64,
    /// What ends it before.
    pub limits: RateLimitsRecord,
}

/// [`RateLimits`] on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RateLimitsRecord {
    /// Least and greatest angle in degrees between which the rotor may be driven, bounds as in
    /// [`controller::Travel::try_new`]; `None` for any.
    pub travel_deg: Option<(f64, f64)>,
    /// Longest time with the drive on in ns, added up, at most [`RateConfiguration::TIME_MAX_S`]; `None` for any.
    pub on_max_nanos: Option<u64>,
    /// Strongest drive, 0 to 1; `None` for full drive.
    pub amplitude_max: Option<f32>,
    /// Length in ns of the windows in which the rotor is seen to follow, within [`Self::WINDOW_S`]; `None` for that
    /// which the instruments ask for.
    pub progress_window_nanos: Option<u64>,
}

impl RateConfiguration {
    /// Longest times, in s: a day.
    pub const TIME_MAX_S: f64 = TIME_MAX_S;

    /// The rate, and the tuning on a bench of `instruments`.
    ///
    /// # Errors
    /// When rate, duration or a limit is out of bounds.
    pub fn checked(&self, instruments: &Instruments) -> Result<(Dwell, RateTuning), OutOfBounds> {
        let profile = Dwell::try_new(self.rate_deg_s)?;
        check_s("rate.duration_s", self.duration_nanos, (0.0, Self::TIME_MAX_S))?;
        let tuning = RateTuning::new(instruments);
        let amplitude_max = limits::amplitude_max(self.limits.amplitude_max)?;
        Ok((profile, RateTuning { amplitude_max, limits: self.limits.within(tuning.limits)?, ..tuning }))
    }
}

impl RateLimitsRecord {
    /// Bounds of the windows in s. Within the least, the fastest camera takes a hundred frames, which tell a turn from
    /// their noise; before the end of two of the longest, nobody stops a rotor that sticks. Assumptions.
    pub const WINDOW_S: (f64, f64) = (0.01, 60.0);

    /// The limits, those of `default` where there is none here.
    fn within(&self, default: RateLimits) -> Result<RateLimits, OutOfBounds> {
        let travel = limits::travel(self.travel_deg)?;
        if let Some(on_max_nanos) = self.on_max_nanos {
            check_s("rate.on_max_s", on_max_nanos, (0.0, RateConfiguration::TIME_MAX_S))?;
        }
        if let Some(nanos) = self.progress_window_nanos {
            check_s("rate.progress_window_s", nanos, Self::WINDOW_S)?;
        }
        Ok(RateLimits {
            travel,
            on_max_nanos: self.on_max_nanos.or(default.on_max_nanos),
            progress_window_nanos: self.progress_window_nanos.unwrap_or(default.progress_window_nanos),
            ..default
        })
    }
}

/// What becomes of a rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RatePhase {
    /// No usable estimate, drive off. The health of the report says why.
    Waiting,
    /// The rotor follows the reference.
    Following,
    /// Held for as long as was asked, drive off.
    Over,
    /// Held no more, drive off, and why.
    Stopped(RateStop),
}

/// Never [`Self::Over`]: the loop of a rate has no end of its own.
impl From<&RateReport> for RatePhase {
    fn from(report: &RateReport) -> Self {
        match (report.stopped, report.reference) {
            (Some(why), _) => Self::Stopped(why),
            (None, None) => Self::Waiting,
            (None, Some(_)) => Self::Following,
        }
    }
}

/// What is asked of the rotor in a tick, on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateRecord {
    /// The rate in rad/s, clockwise positive.
    pub wanted_rad_s: f32,
    /// The angle that the rotor should have, in units of 2^-32 turn; `None` before the first usable estimate.
    pub reference_units: Option<i64>,
}

#[cfg(test)]
mod tests {
    use controller::Travel;
    use controller::rate::RATE_MAX_RAD_S;

    use super::*;

    const S: u64 = 1_000_000_000;
    const RATE: RateConfiguration = RateConfiguration {
        filter: FilterKind::ConstantRate,
        rate_deg_s: -100.0,
        duration_nanos: 2 * S,
        limits: RateLimitsRecord {
            travel_deg: None,
            on_max_nanos: None,
            amplitude_max: None,
            progress_window_nanos: None,
        },
    };

    /// Without limits of its own a rate has those of the simulation's; each limit goes to its place.
    #[test]
    fn exact_limits_go_to_their_places() {
        let instruments = Instruments::default();
        let (profile, tuning) = RATE.checked(&instruments).unwrap();
        assert_eq!((profile, tuning), (Dwell::try_new(-100.0).unwrap(), RateTuning::new(&instruments)));
        let limits = RateLimitsRecord {
            travel_deg: Some((-10.0, 20.0)),
            on_max_nanos: Some(3 * S),
            amplitude_max: Some(0.5),
            progress_window_nanos: Some(S / 2),
        };
        let (_, tuning) = RateConfiguration { limits, ..RATE }.checked(&instruments).unwrap();
        let expected = RateLimits {
            travel: Travel::try_new(-10.0, 20.0).unwrap(),
            on_max_nanos: Some(3 * S),
            progress_window_nanos: S / 2,
            ..RateTuning::new(&instruments).limits
        };
        let default = RateTuning::new(&instruments);
        assert_eq!(tuning, RateTuning { amplitude_max: 0.5, limits: expected, ..default });
    }

    /// Each number is refused by its own key, beyond either bound, and taken at it.
    #[test]
    fn exact_every_number_has_bounds() {
        let rate = |rate_deg_s| RateConfiguration { rate_deg_s, ..RATE };
        let limits = |limits| RateConfiguration { limits, ..RATE };
        let none = RateLimitsRecord::default();
        let travel =
            |least, greatest| limits(RateLimitsRecord { travel_deg: Some((least, greatest)), ..none });
        let on_max = |nanos| limits(RateLimitsRecord { on_max_nanos: Some(nanos), ..none });
        let amplitude = |amplitude| limits(RateLimitsRecord { amplitude_max: Some(amplitude), ..none });
        let window = |nanos| limits(RateLimitsRecord { progress_window_nanos: Some(nanos), ..none });
        let duration = |duration_nanos| RateConfiguration { duration_nanos, ..RATE };
        let max_deg_s = RATE_MAX_RAD_S.to_degrees();
        for (refused, key) in [
            (rate(1.001 * max_deg_s), "rate.deg_s"),
            (rate(-1.001 * max_deg_s), "rate.deg_s"),
            (rate(f64::NAN), "rate.deg_s"),
            (duration(86_401 * S), "rate.duration_s"),
            (travel(f64::NAN, 1.0), "travel.least_deg"),
            (travel(2.0, 1.0), "travel.greatest_deg"),
            (on_max(86_401 * S), "rate.on_max_s"),
            (amplitude(1.01), "limits.amplitude_max"),
            (amplitude(f32::NAN), "limits.amplitude_max"),
            (window(S / 100 - 1), "rate.progress_window_s"),
            (window(60 * S + 1000), "rate.progress_window_s"),
        ] {
            assert_eq!(refused.checked(&Instruments::default()).unwrap_err().key, key, "{refused:?}");
        }
        for taken in [
            rate(max_deg_s),
            rate(0.0),
            duration(0),
            duration(86_400 * S),
            travel(1.0, 2.0),
            on_max(0),
            on_max(86_400 * S),
            amplitude(0.0),
            amplitude(1.0),
            window(S / 100),
            window(60 * S),
        ] {
            assert!(taken.checked(&Instruments::default()).is_ok(), "{taken:?}");
        }
    }
}
