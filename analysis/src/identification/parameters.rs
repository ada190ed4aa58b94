//! What is identified: parameters of the true motor, each with what is known of it before.
//!
//! Before any recording a parameter has the tolerance from which motors are drawn, that of the scene or of the table,
//! `width` times as wide about its middle. Drag is the same in every drawn motor; here it is as unknown as its order of
//! magnitude.

use motor_model::params::{ParameterSpec, Tolerance};
use motor_model::{Parameter, TiltingParameter, math};
use rand_core::Rng;
use rand_distr::{Distribution as _, StandardNormal, Uniform};

use simulation::scene::{RotorModel, Scene, SceneError};

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

    /// Within `tolerance` of `design`, or less where the parameter's bounds are nearer.
    fn normal(spec: &ParameterSpec, design: f64, tolerance: f64) -> Option<Self> {
        let within = tolerance.min(design - spec.min).min(spec.max - design);
        (within > 0.0).then_some(Self::Normal { mean: design, sd: 0.5 * within })
    }

    /// The prior of a parameter of this spec in motors of a design with the value `design`.
    fn of(spec: &ParameterSpec, design: f64, width: f64) -> Option<Self> {
        let scale = if spec.nominal.abs() > 0.0 { (design / spec.nominal).abs() } else { 1.0 };
        let cut = |low: f64, high: f64| Self::Uniform(low.max(spec.min), high.min(spec.max));
        match spec.tolerance {
            Tolerance::Normal(tolerance) => Self::normal(spec, design, scale * width * tolerance),
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
        let prior = match scene.tolerance(spec.key) {
            Some(tolerance) => Prior::normal(&spec, design, width * tolerance)?,
            None => Prior::of(&spec, design, width)?,
        };
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

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::math::random_streams::{RandomSource, stream};
    use simulation::math::statistics::Spread;

    fn prior(sets: &[&str], width: f64, key: &str) -> Option<Prior> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        let scene = Scene::of_sets(&sets).unwrap();
        let unknowns = unknowns(&scene, width).unwrap();
        unknowns.into_iter().find(|unknown| unknown.key == key).map(|unknown| unknown.prior)
    }

    #[track_caller]
    fn is_about(prior: Option<Prior>, expected: Prior) {
        let numbers = |prior: Prior| match prior {
            Prior::Normal { mean, sd } => (0, [mean, sd]),
            Prior::Uniform(low, high) => (1, [low, high]),
        };
        let ((kind, found), (expected_kind, expected)) = (numbers(prior.unwrap()), numbers(expected));
        let is_close = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
        assert!(kind == expected_kind && is_close, "{prior:?} {expected:?}");
    }

    /// Tolerances of the table, which grow with the design, and those of the scene, which do not.
    #[test]
    fn exact_what_is_known_before() {
        let hz = "motor.mode_b.frequency_hz";
        is_about(prior(&[], 1.5, hz), Prior::Normal { mean: 6300.0, sd: 7.5 });
        is_about(
            prior(&["motor.mode_b.frequency_hz=3150"], 2.0, hz),
            Prior::Normal { mean: 3150.0, sd: 5.0 },
        );
        let friction = "motor.friction";
        is_about(prior(&[], 1.5, friction), Prior::Uniform(0.1, 0.7));
        let set = ["motor.friction=0.3", "plant.tolerance.motor.friction=0.04"];
        is_about(prior(&set, 1.5, friction), Prior::Normal { mean: 0.3, sd: 0.03 });
        assert_eq!(prior(&["plant.tolerance.motor.friction=0"], 1.5, friction), None);
        assert_eq!(prior(&[], 1.5, "motor.hub.clearance_m"), None, "the rotor does not tilt");
        let tilting = prior(&["plant.rotor=tilting"], 1.0, "motor.hub.clearance_m");
        is_about(tilting, Prior::Uniform(14e-6, 26e-6));
    }

    /// However wide it is, nothing is drawn that the model would refuse.
    #[test]
    fn exact_the_prior_stays_within_the_bounds_of_its_parameter() {
        let scene = Scene::of_sets(&["plant.rotor=tilting".to_owned()]).unwrap();
        let specs: Vec<ParameterSpec> = Parameter::ALL
            .map(Parameter::spec)
            .into_iter()
            .chain(TiltingParameter::ALL.map(TiltingParameter::spec))
            .collect();
        for unknown in unknowns(&scene, 10.0).unwrap() {
            let spec = specs.iter().find(|spec| spec.key == unknown.key).unwrap();
            let [low, high] = unknown.prior.bounds();
            assert!(spec.min <= low && low < high && high <= spec.max, "{unknown:?} {spec:?}");
        }
    }

    /// Mean, standard deviation and density are those of what is drawn.
    #[test]
    fn law_draws_have_the_stated_mean_and_spread() {
        const COUNT: u32 = 20_000;
        for prior in [Prior::Normal { mean: 3.0, sd: 0.5 }, Prior::Uniform(-1.0, 4.0)] {
            let mut rng = stream(1, RandomSource::IdentificationDraw);
            let drawn: Spread = (0..COUNT).map(|_| prior.draw(&mut rng)).collect();
            // Four standard deviations of a mean; of a standard deviation at most 1 / sqrt(2 n) of it.
            let error = prior.sd() / math::sqrt(f64::from(COUNT));
            assert!((drawn.mean - prior.mean()).abs() < 4.0 * error, "{drawn:?}");
            assert!((drawn.sd - prior.sd()).abs() < 4.0 * error, "{drawn:?}");
            let [low, high] = prior.bounds();
            let step = (high - low) / 1000.0;
            let middles = (0..1000).map(|number| low + (f64::from(number) + 0.5) * step);
            let mass: f64 = middles.map(|value| prior.density(value) * step).sum();
            assert!((mass - 1.0).abs() < 1e-4, "{mass}");
            assert!(prior.density(low - step) + prior.density(high + step) < 1e-300);
        }
    }
}
