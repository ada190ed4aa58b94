//! Rotors drawn over everything that was not measured, and over the tolerances of what was: which of them explain the
//! experiment, and which value decides.
//!
//! The stator is a member of the ensembles that are kept with the program ([`kept_stators`]), drawn whole: stators
//! of finite elements, flat and with the stress of bonding, fitted to the three published frequencies, with springs,
//! teeth and materials that are not published. Its tilting modes, exponents, modal masses, mode shifts and mass go
//! together as they do in that stator. Every other value is uniform over its range. Hub bearings that were assembled
//! from silicon parts have clearances of 3.5 to 9.2 um (Demiri, Boedo, Holsen, Wear 312 (2014) 58).
//! [`rank_correlation`] of a value with a figure tells how far the one decides the other (Spearman).

use rand_distr::{Distribution, Uniform};
use serde::Serialize;

use super::MODES;
use super::measured::{MeasuredRun, QUANTITIES, agrees};
use super::variants::VARIANTS;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::math::statistics::Line;
use simulation::scene::{Scene, SceneError};
use simulation::world::kept_stators;

/// A value that is drawn.
#[derive(Clone, Copy, Debug)]
pub struct DrawnKey {
    /// Key.
    pub key: &'static str,
    /// Its name in pictures.
    pub name: &'static str,
    /// Least and largest value; `None` of one that comes with the stator.
    range: Option<(f64, f64)>,
    /// How it is known.
    pub known: Known,
}

/// How a drawn value is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// It is not: the range is what was found elsewhere, or assumed.
    Assumed,
    /// It comes with the stator, which is one of those that finite elements leave open.
    FiniteElements,
    /// It was measured, and the range is its tolerance in Table 1.
    Measured,
}

impl Known {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Assumed => "not measured",
            Self::FiniteElements => "finite elements",
            Self::Measured => "Table 1",
        }
    }
}

const fn unmeasured(key: &'static str, name: &'static str, range: (f64, f64)) -> DrawnKey {
    DrawnKey { key, name, range: Some(range), known: Known::Assumed }
}

const fn computed(key: &'static str, name: &'static str) -> DrawnKey {
    DrawnKey { key, name, range: None, known: Known::FiniteElements }
}

const fn tolerance(key: &'static str, name: &'static str, range: (f64, f64)) -> DrawnKey {
    DrawnKey { key, name, range: Some(range), known: Known::Measured }
}

/// Number of stators that are drawn from, and of those among them that are flat.
pub fn stators() -> (usize, usize) {
    let stators = kept_stators::all();
    (stators.len(), stators.iter().filter(|stator| !stator.is_stressed).count())
}

impl DrawnKey {
    /// Least and largest value.
    pub fn range(&self) -> (f64, f64) {
        self.range.unwrap_or_else(|| {
            let values = kept_stators::all().iter().map(|stator| stator.get(self.key));
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
        })
    }
}

/// Index of the clearance in [`DRAWN`].
pub const CLEARANCE: usize = 0;
/// Index of the damping ratio of mode C.
pub const DAMPING_OF_C: usize = 21;

/// What is drawn.
pub const DRAWN: [DrawnKey; 24] = [
    unmeasured("motor.hub.clearance_m", "clearance", (3e-6, 12e-6)),
    unmeasured("motor.hub.friction", "hub friction", (0.1, 0.6)),
    unmeasured("motor.hub.restitution", "hub restitution", (0.3, 0.8)),
    unmeasured("motor.friction", "tooth friction", (0.03, 0.4)),
    unmeasured("motor.vertical_damping_n_s_per_m", "film damping", (0.6e-3, 3.6e-3)),
    unmeasured("motor.stator_tilt.damping_ratio", "tilt damping", (0.01, 0.05)),
    computed("motor.stator_tilt.frequency_hz", "tilt frequency"),
    computed("motor.stator_tilt.split", "tilt split"),
    computed("motor.mode_a.rocking_exponent", "exponent of A"),
    computed("motor.stator_tilt.rocking_exponent", "exponent of tilt"),
    computed("motor.tooth_rocking_exponent", "exponent of B"),
    computed("motor.mode_c.extra_rocking_exponent", "exponent of C less B"),
    computed("motor.mode_shift_deg", "shift of C"),
    computed("motor.mode_b.extra_shift_deg", "shift B less C"),
    computed("motor.mode_a.mass_fraction", "modal mass of A"),
    computed("motor.stator_tilt.mass_fraction", "modal mass of tilt"),
    computed("motor.mode_b.mass_fraction", "modal mass of B"),
    computed("motor.mode_c.mass_fraction", "modal mass of C"),
    computed("motor.stator_mass_kg", "stator mass"),
    computed("motor.stator_thickness_m", "thickness"),
    tolerance("motor.mode_b.damping_ratio", "damping of B", (0.0043, 0.0083)),
    tolerance("motor.mode_c.damping_ratio", "damping of C", (0.0055, 0.0095)),
    tolerance("motor.mode_b.tooth_amplitude_m", "amplitude of B", (19.48e-6, 21.96e-6)),
    tolerance("motor.mode_c.tooth_amplitude_m", "amplitude of C", (1.70e-6, 1.92e-6)),
];

/// A drawn rotor and its runs.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnRotor {
    /// Its stator's place among those that are kept: flat ones, then stressed ones.
    pub stator: usize,
    /// Its values, in the order of [`DRAWN`].
    pub values: Vec<f64>,
    /// Its run in mode B and in mode C.
    pub runs: [MeasuredRun; 2],
}

/// A drawn rotor that has not run.
#[derive(Clone, Debug)]
pub struct DrawnScene {
    /// Its stator's place among those that are kept.
    pub stator: usize,
    /// Its values, in the order of [`DRAWN`].
    pub values: Vec<f64>,
    /// Its scene.
    pub scene: Scene,
}

/// The first `count` drawn rotors.
///
/// # Errors
/// When a scene is refused, which a test excludes.
pub fn draw_scenes(count: u64) -> Result<Vec<DrawnScene>, SceneError> {
    let stators = kept_stators::all();
    (1..=count)
        .map(|seed| {
            let mut rng = stream(seed, RandomSource::PlantDraw);
            let mut scene = VARIANTS[4].scene()?;
            let stator =
                Uniform::new(0, stators.len()).map_or(0, |uniform: Uniform<usize>| uniform.sample(&mut rng));
            let member = stators.get(stator);
            for (key, value) in member.iter().flat_map(|member| member.keys) {
                scene.set(key, &format!("{value:e}"))?;
            }
            let mut values = Vec::new();
            for drawn in &DRAWN {
                let value = match drawn.range {
                    Some((low, high)) => {
                        let uniform = Uniform::new_inclusive(low, high);
                        let value = uniform.map_or(low, |uniform| uniform.sample(&mut rng));
                        scene.set(drawn.key, &format!("{value:e}"))?;
                        value
                    }
                    None => member.map_or(f64::NAN, |member| member.get(drawn.key)),
                };
                values.push(value);
            }
            Ok(DrawnScene { stator, values, scene })
        })
        .collect()
}

impl DrawnRotor {
    /// Whether each figure agrees with the experiment, those of mode B first.
    pub fn agreements(&self) -> [[bool; 3]; 2] {
        let mut index = 0;
        MODES.map(|mode| {
            let run = &self.runs[index];
            index += 1;
            QUANTITIES.map(|quantity| agrees(mode, quantity, run.get(quantity)))
        })
    }

    /// How many of the six figures agree.
    pub fn figures_met(&self) -> usize {
        self.agreements().iter().flatten().filter(|agrees| **agrees).count()
    }
}

/// Spearman's rank correlation of pairs, -1 to 1; 0 where one of both does not vary.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let x = ranks(pairs.iter().map(|pair| pair.0));
    let y = ranks(pairs.iter().map(|pair| pair.1));
    let ranked: Vec<(f64, f64)> = x.into_iter().zip(y).collect();
    Line::through(&ranked).map_or(0.0, |line| line.correlation)
}

/// The rank of each value, the mean rank of equal ones.
fn ranks(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let values: Vec<f64> = values.collect();
    let rank = |value: f64| {
        values.iter().fold(0.5, |rank, other| match other.total_cmp(&value) {
            std::cmp::Ordering::Less => rank + 1.0,
            std::cmp::Ordering::Equal => rank + 0.5,
            std::cmp::Ordering::Greater => rank,
        })
    };
    values.iter().map(|&value| rank(value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranks of a rising curve are those of its argument, whatever its shape; equal values share the mean rank.
    #[test]
    fn exact_rank_correlations() {
        let curve = |f: fn(f64) -> f64| (1..20).map(|n| (f64::from(n), f(f64::from(n)))).collect::<Vec<_>>();
        assert!((rank_correlation(&curve(|x| x * x * x)) - 1.0).abs() < 1e-12);
        assert!((rank_correlation(&curve(|x| 1.0 / x)) + 1.0).abs() < 1e-12);
        assert!(rank_correlation(&curve(|_| 1.0)).abs() < 1e-12);
        assert_eq!(ranks([3.0, 1.0, 3.0].into_iter()), [2.5, 1.0, 2.5]);
        // 1 - 6 (1 + 1) / (4 (16 - 1)) for one exchange of neighbours.
        assert!((rank_correlation(&[(1.0, 1.0), (2.0, 3.0), (3.0, 2.0), (4.0, 4.0)]) - 0.8).abs() < 1e-12);
    }

    /// A stator comes whole: all its values are those of one member, and many members are drawn.
    #[test]
    fn law_a_stator_is_drawn_whole() {
        let drawn = draw_scenes(40).unwrap();
        for rotor in &drawn {
            for (key, value) in kept_stators::all()[rotor.stator].keys {
                assert!((rotor.scene.number(key) - value).abs() <= 1e-12 * value.abs(), "{key}");
            }
            for (key, value) in DRAWN.iter().zip(&rotor.values) {
                assert!((rotor.scene.number(key.key) - value).abs() <= 1e-12 * value.abs(), "{}", key.key);
            }
        }
        let mut stators: Vec<usize> = drawn.iter().map(|rotor| rotor.stator).collect();
        stators.sort_unstable();
        stators.dedup();
        // 40 draws of 32 leave a quarter of them out.
        assert!(stators.len() > 15, "{stators:?}");
        let (all, flat) = super::stators();
        assert!(flat >= 12 && all > flat);
        assert!(stators.iter().any(|stator| *stator < flat) && stators.iter().any(|stator| *stator >= flat));
    }

    #[test]
    fn law_draws_lie_in_their_ranges_and_are_scenes() {
        let drawn = draw_scenes(20).unwrap();
        assert_eq!(drawn.len(), 20);
        for (index, key) in DRAWN.iter().enumerate() {
            let values: Vec<f64> = drawn.iter().map(|rotor| rotor.values[index]).collect();
            assert!(
                values.iter().all(|value| (key.range().0..=key.range().1).contains(value)),
                "{}",
                key.key
            );
            assert!(values.windows(2).any(|pair| pair[0] < pair[1]), "{}", key.key);
            assert!((drawn[7].scene.number(key.key) / values[7] - 1.0).abs() < 1e-12);
        }
        assert_eq!(DRAWN[CLEARANCE].key, "motor.hub.clearance_m");
        assert_eq!(DRAWN[DAMPING_OF_C].key, "motor.mode_c.damping_ratio");
    }
}
