//! The faults of a run: which, how severe, from when and until when.
//!
//! ```text
//! how many    one in 7 of 10 runs, two in the others
//! which       each word that the rotor can have, equally often: hub:rub only of one that shifts on its pin
//! how severe  a part or a coefficient uniform in its bounds; else the magnitude log-uniform over the three decades
//!             below its largest, either sign where both are allowed
//! from when   uniform from the start to the time that the move is expected to take
//! until when  half of them stay; of the others the length is log-uniform from 1 ms to 1 s
//! ```

use core::f64::consts::LN_10;

use motor_model::math::exp;
use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;

use simulation::math::plain_number::plain;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::scene::faults::{FaultValue, FaultWord, WORDS};

/// Share of the runs with two faults.
const TWO: f64 = 0.3;
/// Decades of a severity, and of the length of a fault, below the largest of each.
const DECADES: f64 = 3.0;
/// The longest fault that ends.
const LONGEST_S: f64 = 1.0;

/// A draw from 0 to 1.
struct Draw(Pcg64);

impl Draw {
    fn unit(&mut self) -> f64 {
        Uniform::new(0.0, 1.0).map_or(0.5, |unit| unit.sample(&mut self.0))
    }

    /// Log-uniform over the decades below `largest`, to three digits.
    fn magnitude(&mut self, largest: f64) -> f64 {
        largest * exp(-DECADES * LN_10 * self.unit())
    }

    /// One of `count` places.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to below the count")]
    fn place(&mut self, count: usize) -> usize {
        ((self.unit() * simulation::math::count::real(count as u64)) as usize).min(count - 1)
    }
}

/// What a run has that bears on its faults.
#[derive(Clone, Copy, Debug)]
pub(super) struct Faulty {
    /// Marks that its camera tracks.
    pub marks: u64,
    /// Whether its rotor shifts on a pin.
    pub has_hub: bool,
    /// Time that its move is expected to take.
    pub expected_s: f64,
}

/// The words of the faults in the run that `seed` names. A scene takes them as they are.
pub(super) fn words(seed: u64, of: Faulty) -> Vec<String> {
    let mut draw = Draw(stream(seed, RandomSource::FaultDraw));
    let count = if draw.unit() < TWO { 2 } else { 1 };
    (0..count).map(|_| word(&mut draw, of)).collect()
}

fn word(draw: &mut Draw, Faulty { marks, has_hub, expected_s }: Faulty) -> String {
    let possible: Vec<&FaultWord> = WORDS.iter().filter(|word| has_hub || !word.needs_a_hub()).collect();
    let word = possible[draw.place(possible.len())];
    let mark = 1 + draw.place(usize::try_from(marks).unwrap_or(1));
    let thing = if word.thing == "mark" { format!("mark{mark}") } else { word.thing.to_owned() };
    let value = value(draw, word);
    let from_s = rounded(expected_s * draw.unit());
    let length_s = draw.magnitude(LONGEST_S);
    let stays = draw.unit() < 0.5;
    let time = match (word.is_instant(), stays) {
        (true, _) => format!("@{from_s}"),
        (false, true) => format!("@{from_s}.."),
        (false, false) => format!("@{from_s}..{}", rounded(from_s + length_s)),
    };
    format!("{thing}:{}{value}{time}", word.what)
}

/// To a tenth of a millisecond, so that it can be typed.
fn rounded(time_s: f64) -> f64 {
    (1e4 * time_s).round() / 1e4
}

/// The severity, or the mode, as a word has it after a colon.
fn value(draw: &mut Draw, word: &FaultWord) -> String {
    match word.value {
        FaultValue::None => String::new(),
        FaultValue::Mode => ["", ":b", ":c"][draw.place(3)].to_owned(),
        FaultValue::Number { .. } => {
            let Some((min, max)) = word.bounds() else { return String::new() };
            let negative = min < 0.0 && draw.unit() < 0.5;
            let severity = if word.has_no_unit() {
                min + (max - min) * (1e3 * draw.unit()).round() / 1e3
            } else {
                three_digits(draw.magnitude(max))
            };
            format!(":{}", plain(if negative { -severity } else { severity }))
        }
    }
}

/// Rounded to three digits, so that it can be typed.
fn three_digits(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use simulation::scene::faults::Fault;

    const TILTING: Faulty = Faulty { marks: 2, has_hub: true, expected_s: 1.5 };

    /// Of 5,000 runs of a rotor with a hub: every word is taken by a scene, each comes as often as the others to four
    /// standard deviations, half of the faults begin in the first half of the move, and half of those with a length
    /// stay.
    #[test]
    fn law_words_are_drawn_as_stated() {
        let mut counts: BTreeMap<(&str, &str), u32> = BTreeMap::new();
        let (mut faults, mut early, mut lasting, mut stay, mut two) = (0_u32, 0_u32, 0_u32, 0_u32, 0_u32);
        for seed in 0..5000 {
            let words = words(seed, TILTING);
            two += u32::from(words.len() == 2);
            for word in words {
                let fault: Fault = word.parse().unwrap_or_else(|error| panic!("{error}"));
                let named =
                    WORDS.iter().find(|known| word.starts_with(&format!("{}:{}", known.thing, known.what)));
                let marked = || {
                    let (thing, rest) = word.split_once(':').unwrap();
                    assert!(["mark1", "mark2"].contains(&thing), "{word}");
                    WORDS.iter().find(|known| known.thing == "mark" && rest.starts_with(known.what)).unwrap()
                };
                let known = named.unwrap_or_else(marked);
                *counts.entry((known.thing, known.what)).or_default() += 1;
                faults += 1;
                let (_, time) = word.split_once('@').unwrap();
                let from_s: f64 = time.split("..").next().and_then(|from| from.parse().ok()).unwrap();
                early += u32::from(from_s < 0.5 * TILTING.expected_s);
                if !known.is_instant() {
                    lasting += 1;
                    stay += u32::from(fault.until == Fault::NEVER);
                }
            }
        }
        let near = |count: u32, of: u32, share: f64| {
            let off = f64::from(count) - f64::from(of) * share;
            off * off < 16.0 * f64::from(of) * share * (1.0 - share)
        };
        assert_eq!(counts.len(), WORDS.len());
        for (word, count) in counts {
            assert!(near(count, faults, 1.0 / 26.0), "{word:?} {count} of {faults}");
        }
        assert!(near(early, faults, 0.5), "{early} of {faults}");
        assert!(near(stay, lasting, 0.5), "{stay} of {lasting}");
        assert!(near(two, 5000, TWO), "{two}");
    }

    /// The same run has the same faults.
    #[test]
    fn exact_a_seed_names_its_faults() {
        assert_eq!(words(7, TILTING), words(7, TILTING));
        assert_ne!(words(7, TILTING), words(8, TILTING));
        let level = Faulty { has_hub: false, ..TILTING };
        assert!((0..500).flat_map(|seed| words(seed, level)).all(|word| !word.starts_with("hub")));
    }
}
