//! What a move will take, on the wire.

use controller::{MoveForecast, Unreachable};
use serde::{Deserialize, Serialize};

/// Answer to a question: what the move will take, or why it cannot be made.
pub type ForecastAnswer = Result<ForecastRecord, UnreachableRecord>;

/// [`MoveForecast`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForecastRecord {
    /// Error in rad within which 95 % of the moves end.
    pub error_rad: f32,
    /// Expected time in s.
    pub time_s: f32,
    /// Standard deviation of that over motors, in s.
    pub time_sd_s: f32,
    /// Its part that measures to the tolerance, in s.
    pub measuring_s: f32,
    /// Frames that are measured for that.
    pub frames: f32,
    /// Drives until the target is near enough to be measured to the tolerance.
    pub drives: u32,
}

impl From<MoveForecast> for ForecastRecord {
    fn from(forecast: MoveForecast) -> Self {
        let MoveForecast { error_rad, time_s, time_sd_s, measuring_s, frames, drives } = forecast;
        Self { error_rad, time_s, time_sd_s, measuring_s, frames, drives }
    }
}

impl From<ForecastRecord> for MoveForecast {
    fn from(record: ForecastRecord) -> Self {
        let ForecastRecord { error_rad, time_s, time_sd_s, measuring_s, frames, drives } = record;
        Self { error_rad, time_s, time_sd_s, measuring_s, frames, drives }
    }
}

/// [`Unreachable`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnreachableRecord {
    /// The tolerance asked for, in rad.
    pub tolerance_rad: f32,
    /// The least tolerance that can be met before the deadline, in rad; `None` if not even ten degrees can.
    pub least_rad: Option<f32>,
    /// The time that it takes, in s.
    pub time_s: f32,
}

impl From<Unreachable> for UnreachableRecord {
    fn from(Unreachable { tolerance_rad, least_rad, time_s }: Unreachable) -> Self {
        Self { tolerance_rad, least_rad, time_s }
    }
}

impl From<UnreachableRecord> for Unreachable {
    fn from(UnreachableRecord { tolerance_rad, least_rad, time_s }: UnreachableRecord) -> Self {
        Self { tolerance_rad, least_rad, time_s }
    }
}
