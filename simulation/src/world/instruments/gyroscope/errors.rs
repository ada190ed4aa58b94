//! What is wrong with a gyroscope beside its noise: the errors that a calibration finds, or must allow for.
//!
//! ```text
//! sample = turned + s(t) turned + q L (turned / L)^3 + b(t) T
//! turned = turned about the rotor's own axis + m_1 across_1 + m_2 across_2
//! s(t)   = s + s_w (1 - exp(-t / C)),      b(t) = b + b_w (1 - exp(-t / C))
//!
//! s: scale-factor error    b: bias    m: misalignment    q: non-linearity    L: range, as the turn in a sample
//! s_w, b_w: what warming up changes of both in the end    C: its time constant    T: sample period
//! ```
//!
//! The scale factor is that of a rate about the rotor's own axis, and the misalignment is what a rate across it adds,
//! per rate: the two cross-axis sensitivities of the usual matrix of a gyroscope's errors (Titterton and Weston,
//! Strapdown Inertial Navigation Technology, 2nd ed. 2004, chapter 8). So the cosine of the misalignment is in the
//! scale factor. Non-linearity is the error at the end of the range, as a part of the range, and grows with the cube
//! of the rate. The temperature follows its surroundings as a body of one heat capacity does. A seed draws each error
//! from a normal distribution whose standard deviation is its key.

use motor_model::math;
use rand_distr::{Distribution, StandardNormal};

use super::noise::SECONDS_PER_HOUR;
use super::seed_of;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::world::body_turn::BodyTurn;

/// The systematic errors of a gyroscope; also their standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroscopeErrors {
    /// Scale-factor error at the start, 1e-6 for 1 ppm.
    pub scale: f64,
    /// Bias at the start in deg/s.
    pub bias_deg_s: f64,
    /// Misalignment along the rotor's two axes across its own, in rad.
    pub misalignment_rad: [f64; 2],
    /// Non-linearity: error at the end of the range as a part of the range.
    pub nonlinearity: f64,
    /// What warming up changes.
    pub warm_up: WarmUp,
}

/// How scale factor and bias change with the temperature after the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmUp {
    /// Change of the scale-factor error in the end.
    pub scale: f64,
    /// Change of the bias in the end, in deg/s.
    pub bias_deg_s: f64,
    /// Time constant in s.
    pub time_s: f64,
}

impl WarmUp {
    /// The part of the change that is made after `time_s`, 0 to 1.
    pub fn part(&self, time_s: f64) -> f64 {
        -math::exp_m1(-time_s / self.time_s)
    }
}

impl GyroscopeErrors {
    /// Of the gyroscope that the scene names.
    pub(super) fn of(scene: &Scene) -> Self {
        let seed = seed_of(scene.seed(), scene);
        let [mut first, mut other] = [RandomSource::GyroscopeDraw, RandomSource::GyroscopeErrorDraw]
            .map(|source| random_streams::stream(seed, source));
        let drawn = scene.choice("gyroscope.parameters") == "drawn";
        let mut first = || if drawn { StandardNormal.sample(&mut first) } else { 1.0 };
        let mut other = || if drawn { StandardNormal.sample(&mut other) } else { 1.0 };
        let sizes = Self::sizes(scene);
        Self {
            scale: sizes.scale * first(),
            bias_deg_s: sizes.bias_deg_s * first(),
            misalignment_rad: sizes.misalignment_rad.map(|size| size * other()),
            nonlinearity: sizes.nonlinearity * other(),
            warm_up: WarmUp {
                scale: sizes.warm_up.scale * other(),
                bias_deg_s: sizes.warm_up.bias_deg_s * other(),
                time_s: sizes.warm_up.time_s,
            },
        }
    }

    /// The keys of a scene as they stand: what a data sheet says of the part.
    pub fn sizes(scene: &Scene) -> Self {
        let deg_s = |key| scene.number(key) / SECONDS_PER_HOUR;
        let ppm = |key| 1e-6 * scene.number(key);
        Self {
            scale: ppm("gyroscope.scale_factor_ppm"),
            bias_deg_s: deg_s("gyroscope.bias_deg_h"),
            misalignment_rad: [1e-3 * scene.number("gyroscope.misalignment_mrad"); 2],
            nonlinearity: ppm("gyroscope.nonlinearity_ppm"),
            warm_up: WarmUp {
                scale: ppm("gyroscope.warm_up_ppm"),
                bias_deg_s: deg_s("gyroscope.warm_up_deg_h"),
                time_s: scene.number("gyroscope.warm_up_s"),
            },
        }
    }

    /// Scale-factor error at `time_s` after the start.
    pub fn scale_at(&self, time_s: f64) -> f64 {
        self.scale + self.warm_up.scale * self.warm_up.part(time_s)
    }

    /// Bias in deg/s at `time_s` after the start.
    pub fn bias_deg_s_at(&self, time_s: f64) -> f64 {
        self.bias_deg_s + self.warm_up.bias_deg_s * self.warm_up.part(time_s)
    }

    /// What a sample of `period_s` shows in degrees without noise, when the rotor turned by `turn` about `middle_s`. At
    /// the end of the range a sample shows `limit_deg`.
    pub(super) fn shown_deg(&self, turn: &BodyTurn, middle_s: f64, period_s: f64, limit_deg: f64) -> f64 {
        let turned_deg = turn.own_axis_deg + self.misaligned_deg(turn);
        (1.0 + self.scale_at(middle_s)) * turned_deg
            + self.nonlinear_deg(turned_deg, limit_deg)
            + self.bias_deg_s_at(middle_s) * period_s
    }

    /// What misalignment shows of a turn, in degrees.
    pub fn misaligned_deg(&self, turn: &BodyTurn) -> f64 {
        let [one, other] = [0, 1].map(|axis| self.misalignment_rad[axis] * turn.across_deg[axis]);
        one + other
    }

    /// What non-linearity adds to a sample that turned by `turned_deg`, in degrees.
    pub fn nonlinear_deg(&self, turned_deg: f64, limit_deg: f64) -> f64 {
        let part = turned_deg / limit_deg;
        self.nonlinearity * limit_deg * part * part * part
    }
}
