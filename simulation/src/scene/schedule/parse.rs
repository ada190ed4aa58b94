//! Reading a schedule. An error names the column and what is possible there.

use std::str::FromStr;

use motor_model::{DriveCommand, DriveMode};

use super::{DURATION_MAX_S, DURATION_MIN_S, PARTS_MAX, Schedule, SchedulePart, ScheduledDrive};
use crate::math::plain_number::plain;

/// Deepest brackets.
const DEPTH_MAX: usize = 8;
/// Bounds of a frequency in Hz.
const FREQUENCY_HZ: (f64, f64) = (1.0, 1e6);

/// Why a schedule is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("record.schedule, column {column}: {problem}")]
pub struct ScheduleError {
    /// Where it goes wrong, in characters and from 1.
    pub column: usize,
    /// What is wrong there.
    pub problem: String,
    /// What is possible there.
    pub possible: String,
}

/// What is wrong, where in bytes, and what is possible.
struct Refusal {
    at: usize,
    problem: String,
    possible: String,
}

impl FromStr for Schedule {
    type Err = ScheduleError;

    fn from_str(text: &str) -> Result<Self, ScheduleError> {
        let mut reader = Reader { text, at: 0 };
        let parts = reader.parts(0).and_then(|parts| reader.end().map(|()| parts));
        let parts = parts.and_then(|parts| short_enough(parts, text.len()));
        parts.map(|parts| Self { parts }).map_err(|Refusal { at, problem, possible }| ScheduleError {
            column: text.get(..at).map_or(0, |before| before.chars().count()) + 1,
            problem,
            possible,
        })
    }
}

/// Parts that together are no longer than a schedule may be.
fn short_enough(parts: Vec<SchedulePart>, end: usize) -> Result<Vec<SchedulePart>, Refusal> {
    let all_s: f64 = parts.iter().map(|part| part.duration_s).sum();
    if all_s <= DURATION_MAX_S {
        return Ok(parts);
    }
    Err(Refusal {
        at: end,
        problem: format!("it takes {} s in all", plain(all_s)),
        possible: format!("at most {} s", plain(DURATION_MAX_S)),
    })
}

struct Reader<'a> {
    text: &'a str,
    /// Bytes read.
    at: usize,
}

impl<'a> Reader<'a> {
    /// What is left, after spaces.
    fn rest(&mut self) -> &'a str {
        let rest = self.text.get(self.at..).unwrap_or_default();
        let trimmed = rest.trim_start();
        self.at += rest.len() - trimmed.len();
        trimmed
    }

    fn refusal(&mut self, problem: &str, possible: &str) -> Refusal {
        let rest = self.rest();
        let word = rest.split([' ', ',', '(', ')']).next().unwrap_or_default();
        let found = match (word, rest.chars().next()) {
            (_, None) => "it ends here".to_owned(),
            ("", Some(letter)) => format!("found {letter}"),
            (word, _) => format!("found {word}"),
        };
        Refusal { at: self.at, problem: format!("{problem}; {found}"), possible: possible.to_owned() }
    }

    /// Whether `token` comes next; it is read then.
    fn takes(&mut self, token: &str) -> bool {
        let is_next = self.rest().starts_with(token);
        if is_next {
            self.at += token.len();
        }
        is_next
    }

    fn expect(&mut self, token: &str, possible: &str) -> Result<(), Refusal> {
        if self.takes(token) { Ok(()) } else { Err(self.refusal(&format!("{token} is missing"), possible)) }
    }

    fn end(&mut self) -> Result<(), Refusal> {
        if self.rest().is_empty() {
            Ok(())
        } else {
            Err(self.refusal("a comma is missing", "a comma, or xCOUNT"))
        }
    }

    fn parts(&mut self, depth: usize) -> Result<Vec<SchedulePart>, Refusal> {
        let mut parts = self.repeated(depth)?;
        while self.takes(",") {
            parts.extend(self.repeated(depth)?);
            self.check_count(parts.len())?;
        }
        Ok(parts)
    }

    fn check_count(&mut self, count: usize) -> Result<(), Refusal> {
        if count <= PARTS_MAX {
            return Ok(());
        }
        Err(self.refusal(&format!("more than {PARTS_MAX} parts"), "fewer parts"))
    }

    /// A part, or parts in brackets, as often as it is repeated.
    fn repeated(&mut self, depth: usize) -> Result<Vec<SchedulePart>, Refusal> {
        let parts = if self.takes("(") {
            if depth == DEPTH_MAX {
                return Err(self.refusal("brackets are too deep", "fewer brackets"));
            }
            let parts = self.parts(depth + 1)?;
            self.expect(")", "a comma and another part, or )")?;
            parts
        } else {
            vec![self.part()?]
        };
        if !self.takes("x") {
            return Ok(parts);
        }
        let (at, count) = self.number("a count")?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
        let times = count as usize;
        #[expect(clippy::cast_precision_loss, reason = "at most PARTS_MAX")]
        let is_count = (1.0..=PARTS_MAX as f64).contains(&count) && count.fract() == 0.0;
        if !is_count {
            let problem = format!("{} is no count", plain(count));
            return Err(Refusal { at, problem, possible: format!("a whole number, 1 to {PARTS_MAX}") });
        }
        self.check_count(times.saturating_mul(parts.len()))?;
        Ok(parts.repeat(times))
    }

    fn part(&mut self) -> Result<SchedulePart, Refusal> {
        let drive = self.drive()?;
        self.expect("for", "for and a time in s, as in b:1 for 0.5")?;
        let (at, duration_s) = self.number("a time in s")?;
        within("a part of", duration_s, (DURATION_MIN_S, DURATION_MAX_S), "s", at)?;
        Ok(SchedulePart { drive, duration_s })
    }

    fn drive(&mut self) -> Result<Option<ScheduledDrive>, Refusal> {
        const POSSIBLE: &str = "off, b:AMPLITUDE, c:AMPLITUDE or brackets, as in b:0.5@6250..6350 for 2";
        if self.takes("off") {
            return Ok(None);
        }
        let mode = if self.takes("b") {
            DriveMode::B
        } else if self.takes("c") {
            DriveMode::C
        } else {
            return Err(self.refusal("no drive", POSSIBLE));
        };
        self.expect(":", POSSIBLE)?;
        let (at, amplitude) = self.number("an amplitude")?;
        within("amplitude", amplitude, (0.0, f64::from(DriveCommand::AMPLITUDE_MAX)), "", at)?;
        let frequency_hz = if self.takes("@") { Some(self.frequency_hz()?) } else { None };
        Ok(Some(ScheduledDrive { mode, amplitude, frequency_hz }))
    }

    fn frequency_hz(&mut self) -> Result<[f64; 2], Refusal> {
        let from = self.one_frequency_hz()?;
        Ok([from, if self.takes("..") { self.one_frequency_hz()? } else { from }])
    }

    fn one_frequency_hz(&mut self) -> Result<f64, Refusal> {
        let (at, hz) = self.number("a frequency in Hz")?;
        within("frequency", hz, FREQUENCY_HZ, "Hz", at)?;
        Ok(hz)
    }

    /// A number and where it begins. Two dots after it are no part of it.
    fn number(&mut self, what: &str) -> Result<(usize, f64), Refusal> {
        let rest = self.rest();
        let end = rest.find("..").unwrap_or(rest.len());
        let rest = rest.get(..end).unwrap_or_default();
        let mut length = 0;
        let mut before = ' ';
        for letter in rest.chars() {
            let is_sign = matches!(letter, '+' | '-') && (length == 0 || matches!(before, 'e' | 'E'));
            if !(letter.is_ascii_digit() || matches!(letter, '.' | 'e' | 'E') || is_sign) {
                break;
            }
            length += letter.len_utf8();
            before = letter;
        }
        match rest.get(..length).unwrap_or_default().parse::<f64>() {
            Ok(number) if number.is_finite() => {
                let at = self.at;
                self.at += length;
                Ok((at, number))
            }
            _ => Err(self.refusal(&format!("{what} is missing"), "a decimal number")),
        }
    }
}

fn within(what: &str, value: f64, bounds: (f64, f64), unit: &str, at: usize) -> Result<(), Refusal> {
    let (min, max) = bounds;
    if (min..=max).contains(&value) {
        return Ok(());
    }
    let space = if unit.is_empty() { "" } else { " " };
    Err(Refusal {
        at,
        problem: format!("{what} {}{space}{unit} is outside its bounds", plain(value)),
        possible: format!("{} to {}{space}{unit}", plain(min), plain(max)),
    })
}
