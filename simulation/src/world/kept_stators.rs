//! The stators that are kept with the program, of finite elements: each may be that of a true motor.
//!
//! They meet the three published frequencies, with springs, teeth and materials that are not published
//! ([`stator::members`]). A stator comes whole: its tilting modes, exponents, modal masses, mode shifts, mass and
//! thickness go together.

use std::sync::LazyLock;

use motor_model::params::Parameter;
use motor_model::{MotorParams, OutOfBounds, TiltingParameter, TiltingParams};
use rand_distr::{Distribution as _, Uniform};
use stator::ensemble::Member;

use crate::math::random_streams::{RandomSource, stream};

/// Keys and values of the motor that follow from a member, which its radii, its teeth's height and angle do not tell.
pub fn member_keys(member: &Member) -> [(&'static str, f64); 17] {
    let m = member;
    let fraction = |modal_mass_kg: f64| modal_mass_kg / m.stator_mass_kg;
    let tilt_hz = 0.5 * (m.frequency_t1_hz + m.frequency_t2_hz);
    [
        ("motor.stator_thickness_m", m.foil_thickness_m + m.silicon_thickness_m),
        ("motor.mode_shift_deg", m.mode_shift_c_deg),
        ("motor.mode_b.extra_shift_deg", m.mode_shift_b_deg - m.mode_shift_c_deg),
        ("motor.mode_a.frequency_hz", m.frequency_a_hz),
        ("motor.mode_b.frequency_hz", m.frequency_b_hz),
        ("motor.mode_c.frequency_hz", m.frequency_c_hz),
        ("motor.mode_a.mass_fraction", fraction(m.modal_mass_a_kg)),
        ("motor.mode_b.mass_fraction", fraction(m.modal_mass_b_kg)),
        ("motor.mode_c.mass_fraction", fraction(m.modal_mass_c_kg)),
        ("motor.stator_tilt.frequency_hz", tilt_hz),
        ("motor.stator_tilt.split", (m.frequency_t2_hz - m.frequency_t1_hz).abs() / tilt_hz),
        ("motor.stator_tilt.mass_fraction", fraction(m.modal_mass_t_kg)),
        ("motor.stator_tilt.rocking_exponent", m.exponent_t),
        ("motor.mode_a.rocking_exponent", m.exponent_a),
        ("motor.tooth_rocking_exponent", m.exponent_b),
        ("motor.mode_c.extra_rocking_exponent", m.exponent_c - m.exponent_b),
        ("motor.stator_mass_kg", m.stator_mass_kg),
    ]
}

/// A stator that is kept.
#[derive(Clone, Debug)]
pub struct KeptStator {
    /// Whether its modes are those about the state that bonding leaves.
    pub is_stressed: bool,
    /// Keys and values of a motor that has it.
    pub keys: [(&'static str, f64); 17],
}

/// All that meet the frequencies: flat ones, then stressed ones.
static KEPT: LazyLock<Vec<KeptStator>> = LazyLock::new(|| {
    let of = |is_stressed: bool| {
        // A damaged table has no members: a test reads both.
        let members = stator::members::kept(is_stressed).unwrap_or_default();
        let met = members.into_iter().filter(|member| member.met);
        met.map(move |member| KeptStator { is_stressed, keys: member_keys(&member) })
    };
    of(false).chain(of(true)).collect()
});

/// All that meet the frequencies: flat ones, then stressed ones.
pub fn all() -> &'static [KeptStator] {
    &KEPT
}

/// The one that a seed draws for the true motor; each is as likely.
pub fn of_seed(seed: u64) -> Option<&'static KeptStator> {
    let place = Uniform::new(0, KEPT.len()).ok()?.sample(&mut stream(seed, RandomSource::StatorDraw));
    KEPT.get(place)
}

impl KeptStator {
    /// The value of a key of the motor; NaN of one that the stator does not tell.
    pub fn get(&self, key: &str) -> f64 {
        self.keys.iter().find(|(of, _)| *of == key).map_or(f64::NAN, |(_, value)| *value)
    }

    /// The same motor with this stator. Frequencies of A, B and C stay: those of the stator are the published ones,
    /// to which it was fitted, and those of a motor differ from them.
    ///
    /// # Errors
    /// When a value is outside of its bounds, which a test excludes.
    pub fn in_motor(
        &self,
        mut params: MotorParams,
        mut tilting: TiltingParams,
    ) -> Result<(MotorParams, TiltingParams), OutOfBounds> {
        for (key, value) in self.keys.into_iter().filter(|(key, _)| !FITTED.contains(key)) {
            if let Some(parameter) = Parameter::from_key(key) {
                params = params.with(parameter, value)?;
            } else if let Some(parameter) = TiltingParameter::from_key(key) {
                tilting = tilting.with(parameter, value)?;
            }
        }
        Ok((params, tilting))
    }
}

/// What a stator was fitted to.
const FITTED: [&str; 3] =
    ["motor.mode_a.frequency_hz", "motor.mode_b.frequency_hz", "motor.mode_c.frequency_hz"];

/// Whether a kept stator tells the value of this key of the motor, and a motor takes it from there.
pub fn tells(key: &str) -> bool {
    !FITTED.contains(&key) && KEPT.first().is_some_and(|kept| kept.keys.iter().any(|(of, _)| *of == key))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, SceneError};
    use crate::world::plant::Plant;

    fn plant(sets: &[&str]) -> Result<Plant, SceneError> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        Plant::draw(&Scene::of_sets(&sets)?)
    }

    /// A true motor has all values of one kept stator, and every other value of the motor without it.
    #[test]
    fn exact_a_true_motor_has_a_kept_stator_whole() {
        for rotor in ["height_only", "tilting"] {
            let sets = ["seed=5", &format!("plant.rotor={rotor}")];
            let (without, with) = (
                plant(&sets).unwrap(),
                plant(&[&sets[..], &["plant.stator=finite_elements"]].concat()).unwrap(),
            );
            let kept = of_seed(5).unwrap();
            for parameter in Parameter::ALL {
                let key = parameter.spec().key;
                let expected = if tells(key) { kept.get(key) } else { without.params().get(parameter) };
                assert_eq!(with.params().get(parameter).to_bits(), expected.to_bits(), "{key}");
            }
            let (Some(without), Some(with)) = (without.tilting_params(), with.tilting_params()) else {
                assert_eq!(rotor, "height_only");
                continue;
            };
            for parameter in TiltingParameter::ALL {
                let key = parameter.spec().key;
                let expected = if tells(key) { kept.get(key) } else { without.get(parameter) };
                assert_eq!(with.get(parameter).to_bits(), expected.to_bits(), "{key}");
            }
        }
    }

    /// Each stator is as likely, flat or stressed: of 320 seeds each of 32 has 10 on average, and none of them none
    /// (32 exp(-10) = 0.0015) or more than 27 (Poisson, 1e-6 each).
    #[test]
    fn law_every_kept_stator_is_drawn() {
        let mut counts = vec![0; all().len()];
        let per_stator = 10;
        for seed in 0..per_stator * all().len() as u64 {
            let kept = of_seed(seed).unwrap();
            let place = all().iter().position(|other| std::ptr::eq(other, kept)).unwrap();
            counts[place] += 1;
        }
        assert!(all().iter().any(|kept| kept.is_stressed) && all().iter().any(|kept| !kept.is_stressed));
        assert!(counts.iter().all(|count| (1..=27).contains(count)), "{counts:?}");
    }

    /// A value of one's own for what the stator tells is refused by its name, of what it does not tell is taken.
    #[test]
    fn law_a_value_beside_the_stator_s_is_refused() {
        for key in ["stator_mass_kg=11e-6", "stator_tilt.frequency_hz=3000"] {
            let error = plant(&[
                "plant.rotor=tilting",
                "plant.stator=finite_elements",
                &format!("plant.motor.{key}"),
            ]);
            let error = error.unwrap_err().to_string();
            assert!(error.contains(&format!("plant.motor.{}", key.split('=').next().unwrap())), "{error}");
        }
        let given = plant(&["plant.stator=finite_elements", "plant.motor.mode_b.frequency_hz=6350"]).unwrap();
        assert!((given.params().get(Parameter::ModeBFrequency) - 6350.0).abs() < 1e-9);
    }

    /// Every member of both tables is a motor's stator, within the bounds of the keys.
    #[test]
    fn law_every_kept_stator_is_a_motor_s() {
        for stressed in [false, true] {
            assert!(stator::members::kept(stressed).unwrap().len() > 4);
        }
        for kept in all() {
            kept.in_motor(MotorParams::nominal(), TiltingParams::nominal()).unwrap();
        }
    }
}
