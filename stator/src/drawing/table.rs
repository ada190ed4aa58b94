//! Every value of a drawing, as data: key, unit, value when nothing sets it, bounds, meaning and origin.

use super::{Clamp, Drawing, Silicon, Springs};

/// A number of the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberField {
    /// Key in scene files and on the command line, its unit as suffix.
    pub key: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Value when nothing sets it.
    pub default: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Meaning and origin, in one line.
    pub meaning: &'static str,
}

/// A word of the drawing, one of a few.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordField {
    /// Key in scene files and on the command line.
    pub key: &'static str,
    /// Word when nothing sets it.
    pub default: &'static str,
    /// The words allowed.
    pub of: &'static [&'static str],
    /// Meaning, in one line.
    pub meaning: &'static str,
}

macro_rules! numbers {
    ($($name:ident: $unit:literal, $default:literal, $min:literal to $max:literal, $meaning:literal;)*) => {
        /// The numbers, in the order of a scene file.
        pub const NUMBERS: &[NumberField] = &[$(NumberField {
            key: concat!("stator.", stringify!($name)),
            unit: $unit,
            default: $default,
            min: $min,
            max: $max,
            meaning: $meaning,
        }),*];

        impl Default for Numbers {
            fn default() -> Self {
                Self { $($name: $default),* }
            }
        }

        /// The numbers of a drawing, in the units of their keys.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Numbers {
            $(#[doc = $meaning] pub $name: f64,)*
        }

        impl Numbers {
            /// The values in the order of [`NUMBERS`].
            pub fn values(&self) -> [f64; NUMBERS.len()] {
                [$(self.$name),*]
            }

            /// The value of `key`, to be set; `None` for a key that is in no row of [`NUMBERS`].
            pub fn value_mut(&mut self, key: &str) -> Option<&mut f64> {
                match key {
                    $(concat!("stator.", stringify!($name)) => Some(&mut self.$name),)*
                    _ => None,
                }
            }
        }
    };
}

numbers! {
    inner_radius_m: "m", 2.125e-3, 1e-5 to 0.1,
        "inner radius of the ring; Table 1, measured";
    outer_radius_m: "m", 3.89e-3, 2e-5 to 0.2,
        "outer radius of the ring; Table 1, measured";
    foil_thickness_m: "m", 25e-6, 1e-7 to 0.01,
        "thickness of the magnetoelastic foil under the ring; the paper";
    silicon_thickness_m: "m", 53.4e-6, 1e-7 to 0.01,
        "thickness of the silicon on the foil, and of the springs; fitted to the paper's frequencies";
    tooth_radius_m: "m", 3.063e-3, 1e-5 to 0.2,
        "inner edge of the teeth, where they strike; Table 1, measured";
    tooth_height_m: "m", 260e-6, 1e-7 to 0.01,
        "height of the teeth over the silicon; Table 1, measured";
    tooth_angle_deg: "deg", 62.635, 0.0 to 90.0,
        "middle of the first tooth from the axis of the first spring; Table 1, measured";
    tooth_radial_m: "m", 0.4e-3, 0.0 to 0.1,
        "length of a tooth along the radius, 0 for no teeth; assumed, 0.2 to 0.6 mm is likely";
    tooth_tangential_m: "m", 0.4e-3, 0.0 to 0.1,
        "length of a tooth along the rim, 0 for no teeth; assumed, 0.2 to 0.6 mm is likely";
    spring_stem_m: "m", 0.478e-3, 1e-6 to 0.1,
        "length of a spring's stem, from the rim to the arms; fitted to the paper's frequencies";
    spring_stem_width_m: "m", 0.25e-3, 1e-6 to 0.1,
        "width of a spring's stem; assumed, 0.12 to 0.4 mm is likely";
    spring_arm_width_m: "m", 0.25e-3, 1e-6 to 0.1,
        "width of a spring's arms; assumed, 0.12 to 0.4 mm is likely";
    spring_half_angle_deg: "deg", 35.0, 0.5 to 44.5,
        "angle from a spring's axis to the clamped end of an arm; fitted to the paper's frequencies";
    spring_spread: "", 0.0, 0.0 to 0.1,
        "standard deviation of the arms' widths and angles about their values, as a part of them; assumed";
    crystal_angle_deg: "deg", 45.0, -90.0 to 90.0,
        "angle from the axis of the first spring to a <100> direction of the silicon; assumed, springs along <110>";
    silicon_c11_pa: "Pa", 165.7e9, 1e9 to 1e15,
        "elastic constant of crystalline silicon along a <100> direction; text-book";
    silicon_c12_pa: "Pa", 63.9e9, 0.0 to 1e15,
        "elastic constant of crystalline silicon between two <100> directions; text-book";
    silicon_c44_pa: "Pa", 79.6e9, 1e9 to 1e15,
        "elastic constant of crystalline silicon in shear; text-book";
    silicon_modulus_pa: "Pa", 148e9, 1e9 to 1e15,
        "Young's modulus of isotropic silicon; mean over the directions of a (100) wafer";
    silicon_poisson: "", 0.17, 0.0 to 0.49,
        "Poisson's ratio of isotropic silicon; mean over the directions of a (100) wafer";
    silicon_density_kg_m3: "kg/m3", 2330.0, 1.0 to 1e5,
        "density of silicon; text-book";
    silicon_expansion_per_k: "1/K", 2.6e-6, 0.0 to 1e-3,
        "thermal expansion of silicon; the paper";
    foil_modulus_pa: "Pa", 130e9, 1e9 to 1e17,
        "Young's modulus of the foil; literature, 100 to 160 GPa by field and heat treatment";
    foil_poisson: "", 0.33, 0.0 to 0.49,
        "Poisson's ratio of the foil; assumed";
    foil_density_kg_m3: "kg/m3", 7900.0, 1.0 to 1e5,
        "density of the foil; data sheet";
    foil_expansion_per_k: "1/K", 11.7e-6, 0.0 to 1e-3,
        "thermal expansion of the foil; the paper";
    field_angle_deg: "deg", 39.3, -90.0 to 90.0,
        "angle from the axis of the first spring to the magnetic field; the one that gives the paper's amplitudes";
    bonding_temperature_c: "degC", 157.0, -273.0 to 1000.0,
        "temperature at which foil and silicon were joined without stress; the paper";
    temperature_c: "degC", 20.0, -273.0 to 1000.0,
        "temperature of the stator; assumed";
    mesh_size_m: "m", 0.4e-3, 1e-6 to 0.1,
        "longest edge of a brick in the plane";
}

/// The words, in the order of a scene file.
pub const WORDS: &[WordField] = &[
    WordField {
        key: "stator.springs",
        default: "t",
        of: &["t", "l", "none"],
        meaning: "springs, four of a kind: t for a stem with two arms along the rim, l for a stem with one; assumed",
    },
    WordField {
        key: "stator.clamp",
        default: "arms",
        of: &["arms", "inner_rim", "outer_rim", "nothing"],
        meaning: "what is held: the ends of the springs' arms, a rim of the ring, or nothing; assumed",
    },
    WordField {
        key: "stator.silicon",
        default: "crystal",
        of: &["crystal", "isotropic"],
        meaning: "silicon as a cubic crystal of a (100) wafer, or with the same stiffness in every direction; assumed",
    },
    WordField {
        key: "stator.stressed",
        default: "no",
        of: &["no", "yes"],
        meaning: "whether modes are those about the state that bonding leaves, found with large deflections",
    },
];

/// Keys of the whole number that draws the spread of the springs.
pub const SPREAD_SEED_KEY: &str = "stator.spring_spread_seed";

impl Drawing {
    /// Sets the word of `key`; whether there are such a key and such a word.
    pub fn set_word(&mut self, key: &str, word: &str) -> bool {
        match (key, word) {
            ("stator.springs", "t") => self.springs = Springs::T,
            ("stator.springs", "l") => self.springs = Springs::L,
            ("stator.springs", "none") => self.springs = Springs::None,
            ("stator.clamp", "arms") => self.clamp = Clamp::Arms,
            ("stator.clamp", "inner_rim") => self.clamp = Clamp::InnerRim,
            ("stator.clamp", "outer_rim") => self.clamp = Clamp::OuterRim,
            ("stator.clamp", "nothing") => self.clamp = Clamp::Nothing,
            ("stator.silicon", "crystal") => self.silicon = Silicon::Crystal,
            ("stator.silicon", "isotropic") => self.silicon = Silicon::Isotropic,
            ("stator.stressed", "no") => self.stressed = false,
            ("stator.stressed", "yes") => self.stressed = true,
            _ => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every key sets a value of its own, every word of the table is taken, and the defaults pass every check.
    #[test]
    fn exact_keys_and_words_set_the_drawing() {
        let mut drawing = Drawing::default();
        assert!(drawing.check().is_ok(), "{:?}", drawing.check());
        for (number, field) in NUMBERS.iter().enumerate() {
            assert!(field.min <= field.default && field.default <= field.max, "{}", field.key);
            *drawing.numbers.value_mut(field.key).unwrap() = field.min;
            assert!((drawing.numbers.values()[number] - field.min).abs() < f64::EPSILON, "{}", field.key);
        }
        for field in WORDS {
            assert!(Drawing::default().set_word(field.key, field.default));
            let mut seen = Vec::new();
            for word in field.of {
                let mut drawing = Drawing::default();
                assert!(drawing.set_word(field.key, word), "{} {word}", field.key);
                assert!(!seen.contains(&drawing), "{} {word} changes nothing", field.key);
                seen.push(drawing);
            }
            assert_eq!(
                seen[field.of.iter().position(|word| *word == field.default).unwrap()],
                Drawing::default()
            );
        }
        assert!(!drawing.set_word("stator.springs", "u"));
        assert_eq!(drawing.numbers.value_mut("stator.nothing"), None);
    }
}
