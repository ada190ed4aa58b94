//! What is unknown, what each unknown makes of an interval, and what is known of it before.
//!
//! Scale factor and bias may be anything. The others are known before by their data sheet: zero, with the key of the
//! scene as the standard deviation. Each of them is scaled to that, so that all have the variance 1.

use std::f64::consts::TAU;

use motor_model::math;
use nalgebra::DMatrix;

use super::FitInterval;
use simulation::scene::Scene;
use simulation::world::instruments::gyroscope::{GyroscopeErrors, WarmUp};

/// Unknowns in the order of the fit.
pub const SCALE: usize = 0;
/// The bias.
pub const BIAS: usize = 1;
/// Non-linearity, per its standard deviation.
pub const NONLINEARITY: usize = 2;
/// What warming up changes of scale factor and bias.
pub const WARM_UP: [usize; 2] = [3, 4];
/// What the camera's angle is off by, once and twice a turn: cosine and sine of each.
pub const CAMERA: [usize; 4] = [5, 6, 7, 8];
/// How many there are.
pub const COUNT: usize = 9;

/// What is known before of a gyroscope on its bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknowns {
    /// Standard deviation of the non-linearity.
    pub nonlinearity: f64,
    /// Standard deviations of what warming up changes, and its time constant.
    pub warm_up: WarmUp,
    /// Standard deviation of each of the camera's errors that turn with the angle, in degrees.
    pub camera_deg: f64,
    /// The time at which scale factor and bias are wanted.
    pub at_s: f64,
}

impl Unknowns {
    /// Of a scene whose plan is `duration_s` long: scale factor and bias are wanted at its middle.
    pub fn of(scene: &Scene, duration_s: f64) -> Self {
        let sizes = GyroscopeErrors::sizes(scene);
        Self {
            nonlinearity: sizes.nonlinearity,
            warm_up: sizes.warm_up,
            camera_deg: 1e-3 * scene.number("calibrate.camera_angle_mdeg"),
            at_s: 0.5 * duration_s,
        }
    }

    /// Whether the unknown may be anything: the information that there is of it before.
    pub(super) fn before(unknown: usize) -> f64 {
        if unknown == SCALE || unknown == BIAS { 0.0 } else { 1.0 }
    }

    /// A column an interval: a row an unknown, and what is shown beside the reference as the last.
    pub(super) fn columns(&self, intervals: &[FitInterval]) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(COUNT + 1, intervals.len());
        for (mut column, interval) in columns.column_iter_mut().zip(intervals) {
            let FitInterval { span, turned_deg, .. } = *interval;
            let length_s = span.length_s();
            let warmer = self.warmer(0.5 * (span.from_s + span.until_s));
            column[SCALE] = turned_deg;
            column[BIAS] = length_s;
            column[NONLINEARITY] = self.nonlinearity * interval.cubed_deg;
            column[WARM_UP[0]] = self.warm_up.scale * warmer * turned_deg;
            column[WARM_UP[1]] = self.warm_up.bias_deg_s * warmer * length_s;
            // The reference stands in the difference with the opposite sign.
            let [from, until] = [interval.angles_turn.0, interval.angles_turn.1].map(harmonics);
            for (place, unknown) in CAMERA.into_iter().enumerate() {
                column[unknown] = self.camera_deg * (from[place] - until[place]);
            }
            column[COUNT] = interval.shown_deg - turned_deg;
        }
        columns
    }

    /// The part of warming up that is made at `time_s`, less that at the time that is wanted.
    pub fn warmer(&self, time_s: f64) -> f64 {
        self.warm_up.part(time_s) - self.warm_up.part(self.at_s)
    }
}

/// Cosine and sine once and twice a turn, at a part of a turn.
fn harmonics(part: f64) -> [f64; 4] {
    let ((s1, c1), (s2, c2)) = (math::sin_cos(TAU * part), math::sin_cos(2.0 * TAU * part));
    [c1, s1, c2, s2]
}
