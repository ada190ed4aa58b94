//! Keys of the drawing of a stator, from which finite elements make its modes. No run of a motor reads them.

use stator::drawing::table::{NUMBERS, SPREAD_SEED_KEY, WORDS};

use crate::scene::{Kind, Setting};

/// The settings of a drawing: one for each of its numbers and words, and the seed of the springs' spread.
pub const SETTINGS: &[Setting] = &ALL;

const ALL: [Setting; NUMBERS.len() + WORDS.len() + 1] = {
    let mut all = [Setting {
        key: SPREAD_SEED_KEY,
        unit: "",
        kind: Kind::Integer { default: 0, min: 0, max: u64::MAX },
        meaning: "names the random numbers of stator.spring_spread",
    }; NUMBERS.len() + WORDS.len() + 1];
    let mut number = 0;
    while number < NUMBERS.len() {
        let field = NUMBERS[number];
        let kind = Kind::Number { default: field.default, min: field.min, max: field.max };
        all[number] = Setting { key: field.key, unit: field.unit, kind, meaning: field.meaning };
        number += 1;
    }
    let mut word = 0;
    while word < WORDS.len() {
        let field = WORDS[word];
        let kind = Kind::Choice { default: field.default, of: field.of };
        all[NUMBERS.len() + word] = Setting { key: field.key, unit: "", kind, meaning: field.meaning };
        word += 1;
    }
    all
};
