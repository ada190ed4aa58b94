//! What is identified: parameters of the true motor, each with what is known of it before.
//!
//! Before any recording a parameter has the tolerance from which motors are drawn, `width` times as wide about its
//! middle. Drag is the same in every drawn motor; here it is as unknown as its order of magnitude.

use motor_model::params::{ParameterSpec, Tolerance};
use motor_model::{Parameter, TiltingParameter, math};
use rand_core::Rng;
use rand_distr::{Distribution as _, StandardNormal, Uniform};

use crate::scene::{RotorModel, Scene, SceneError};

/// What is known of a parameter before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prior {
    /// Normal, cut off at two standard deviations.
    Normal {
        /// Its middle.
        mean: f64,
        /// Its standard deviation before the cut.
        sd: f64,
    },
    /// Uniform between two values.
    Uniform(f64, f64),
}

/// Standard deviation of a standard normal that is cut off at two.
const CUT_SD: f64 = 0.879_626;

/// Largest drag that is considered, per that of Table 1.
const DRAG_PER_NOMINAL: f64 = 10.0;

impl Prior {
    /// A draw.
    pub fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> f64 {
        match *self {
            Self::Normal { mean, sd } => {
                // Bounded: 64 refusals have probability 1e-86.
                let inside = (0..64).map(|_| StandardNormal.sample(rng)).find(|draw: &f64| draw.abs() <= 2.0);
                mean + sd * inside.unwrap_or(0.0)
            }
            Self::Uniform(low, high) => {
                Uniform::new_inclusive(low, high).map_or(low, |uniform| uniform.sample(rng))
            }
        }
    }

    /// Mean.
    pub fn mean(&self) -> f64 {
        match *self {
            Self::Normal { mean, .. } => mean,
            Self::Uniform(low, high) => 0.5 * (low + high),
        }
    }

    /// Standard deviation.
    pub fn sd(&self) -> f64 {
        match *self {
            Self::Normal { sd, .. } => CUT_SD * sd,
            Self::Uniform(low, high) => (high - low) / math::sqrt(12.0),
        }
    }

    /// Smallest and largest value.
    pub fn bounds(&self) -> [f64; 2] {
        match *self {
            Self::Normal { mean, sd } => [mean - 2.0 * sd, mean + 2.0 * sd],
            Self::Uniform(low, high) => [low, high],
        }
    }

    /// Logarithm of the density, up to a constant; minus infinity outside of the bounds.
    pub fn log_density(&self, value: f64) -> f64 {
        let [low, high] = self.bounds();
        match *self {
            _ if !(low..=high).contains(&value) => f64::NEG_INFINITY,
            Self::Normal { mean, sd } => -0.5 * ((value - mean) / sd) * ((value - mean) / sd),
            Self::Uniform(..) => 0.0,
        }
    }

    /// The density.
    pub fn density(&self, value: f64) -> f64 {
        let [low, high] = self.bounds();
        let mass = match *self {
            // Of a normal distribution 95.45 % lie within two standard deviations.
            Self::Normal { sd, .. } => 0.9545 * sd * math::sqrt(std::f64::consts::TAU),
            Self::Uniform(..) => high - low,
        };
        math::exp(self.log_density(value)) / mass
    }

    /// The prior of a parameter of this spec in motors of a design with the value `design`.
    fn of(spec: &ParameterSpec, design: f64, width: f64) -> Option<Self> {
        let scale = if spec.nominal.abs() > 0.0 { (design / spec.nominal).abs() } else { 1.0 };
        let cut = |low: f64, high: f64| Self::Uniform(low.max(spec.min), high.min(spec.max));
        match spec.tolerance {
            Tolerance::Normal(tolerance) => {
                Some(Self::Normal { mean: design, sd: 0.5 * scale * width * tolerance })
            }
            Tolerance::Uniform(low, high) => {
                let (middle, half) = (0.5 * scale * (low + high), 0.5 * scale * width * (high - low));
                Some(cut(middle - half, middle + half))
            }
            Tolerance::Exact if spec.key == Parameter::TangentialDrag.spec().key => {
                Some(Self::Uniform(0.0, DRAG_PER_NOMINAL * design))
            }
            Tolerance::Exact => None,
        }
    }
}

/// A parameter that is identified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknown {
    /// Key of the design.
    pub key: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// What is known of it before.
    pub prior: Prior,
}

impl Unknown {
    /// A value in standard deviations of the prior from its mean.
    pub fn standard(&self, value: f64) -> f64 {
        (value - self.prior.mean()) / self.prior.sd()
    }

    /// The value that is so many standard deviations from the mean.
    pub fn value(&self, standard: f64) -> f64 {
        self.prior.mean() + standard * self.prior.sd()
    }
}

/// The parameters of a scene's motor of which anything is unknown; those of a rotor that tilts, if it does.
///
/// # Errors
/// When the scene sets a key that its rotor does not use.
pub fn unknowns(scene: &Scene, width: f64) -> Result<Vec<Unknown>, SceneError> {
    let params = scene.motor_params();
    let of = |spec: ParameterSpec, design: f64| {
        let prior = Prior::of(&spec, design, width)?;
        Some(Unknown { key: spec.key, unit: spec.unit, meaning: spec.meaning, prior })
    };
    let of_motor =
        Parameter::ALL.into_iter().filter_map(|parameter| of(parameter.spec(), params.get(parameter)));
    let mut unknowns: Vec<Unknown> = of_motor.collect();
    if RotorModel::of(scene)? != RotorModel::HeightOnly {
        let params = scene.tilting_params();
        unknowns.extend(
            TiltingParameter::ALL
                .into_iter()
                .filter_map(|parameter| of(parameter.spec(), params.get(parameter))),
        );
    }
    Ok(unknowns)
}

/// The scene of a motor that has `values` of `unknowns` and the design's of everything else. Nothing of the true motor
/// of `scene` is left in it.
///
/// # Errors
/// When the model refuses a value.
pub fn motor_scene(
    scene: &Scene,
    unknowns: &[Unknown],
    values: &[f64],
    seed: u64,
) -> Result<Scene, SceneError> {
    let mut scene = scene.without_plant_overrides();
    scene.set("plant.parameters", "nominal")?;
    scene.set("plant.step_s", STEP_S)?;
    scene.set("seed", &seed.to_string())?;
    for (unknown, value) in unknowns.iter().zip(values) {
        scene.set(&format!("plant.{}", unknown.key), &value.to_string())?;
    }
    Ok(scene)
}

/// Step of the motors that are drawn: with located impacts it gives the rates of finer steps (docs/results/step.md).
const STEP_S: &str = "5e-6";
