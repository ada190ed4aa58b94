//! A point of the course of a held rate.

use estimator::Health;

use crate::runs::rotor_tilt::TiltFigures;

/// A point of the course of a rate, every 5 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatePoint {
    /// Time in s.
    pub time_s: f64,
    /// Rate asked for in deg/s.
    pub asked_deg_s: f64,
    /// True rate, over the time since the last point, in deg/s.
    pub rate_deg_s: f64,
    /// True angle less reference in degrees.
    pub off_deg: f64,
    /// Amplitude, negative in mode C.
    pub drive: f64,
    /// Tilt and shift since the last point, of a rotor that tilts.
    pub tilt: Option<TiltFigures>,
    /// Health of the estimate.
    pub health: Health,
}
