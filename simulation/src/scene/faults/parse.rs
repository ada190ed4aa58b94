//! Reading the word of a fault. An error names the word, the column and what is possible there.

use std::str::FromStr;

use motor_model::{DriveMode, Time};

use super::words::{FaultArgument, FaultValue, FaultWord, WORDS};
use super::{Fault, FaultKind};
use crate::math::plain_number::plain;
use crate::scene::setting::{self, Value};
use crate::scene::{Kind, Setting};

/// Latest time of a fault in s.
const TIME_MAX_S: f64 = 1e5;
/// Most marks that a camera tracks.
const MARKS_MAX: u8 = 16;

/// Why the word of a fault is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("fault {word}, column {column}: {problem}")]
pub struct FaultWordError {
    /// The word as given.
    pub word: String,
    /// Where it goes wrong, in characters and from 1.
    pub column: usize,
    /// What is wrong there.
    pub problem: String,
    /// What is possible there.
    pub possible: String,
}

/// What is wrong, where in bytes, and what is possible.
type Refusal = (usize, String, String);

impl FromStr for Fault {
    type Err = FaultWordError;

    fn from_str(word: &str) -> Result<Self, FaultWordError> {
        parse(word).map_err(|(at, problem, possible)| FaultWordError {
            word: word.to_owned(),
            column: word.get(..at).map_or(0, |before| before.chars().count()) + 1,
            problem,
            possible,
        })
    }
}

fn parse(text: &str) -> Result<Fault, Refusal> {
    let (head, time) = match text.split_once('@') {
        Some((head, time)) => (head, Some((head.len() + 1, time))),
        None => (text, None),
    };
    let (thing, rest) = match head.split_once(':') {
        Some((thing, rest)) => (thing, Some((thing.len() + 1, rest))),
        None => (head, None),
    };
    let (thing_name, mark) = thing_and_mark(thing)?;
    let of_thing = || WORDS.iter().filter(|word| word.thing == thing_name);
    let patterns = || {
        let patterns: Vec<String> = of_thing().map(FaultWord::pattern).collect();
        patterns.join(", ").replace("markN", thing)
    };
    let (at, rest) = rest.ok_or_else(|| (head.len(), format!("{thing} lacks how it fails"), patterns()))?;
    let (what, value) = match rest.split_once(':') {
        Some((what, value)) => (what, Some((at + what.len() + 1, value))),
        None => (rest, None),
    };
    let word = of_thing().find(|word| word.what == what || (!word.alias.is_empty() && word.alias == what));
    let word = word.ok_or_else(|| {
        let problem = if what.is_empty() {
            format!("{thing} lacks how it fails")
        } else {
            format!("{what} is no fault of {thing}")
        };
        (at, problem, patterns())
    })?;
    let argument = argument(word, mark, value, head.len())?;
    let kind = (word.kind)(argument);
    let (from, until) = times(kind, time)?;
    Ok(Fault { kind, from, until })
}

/// What fails, and the number of the mark if it is one.
fn thing_and_mark(thing: &str) -> Result<(&str, u8), Refusal> {
    let known = |name: &str| WORDS.iter().any(|word| word.thing == name);
    let possible = format!("camera, mark1 to mark{MARKS_MAX}, ldv, drive, stator, rotor, hub");
    if let Some(number) = thing.strip_prefix("mark") {
        return match number.parse::<u8>() {
            Ok(mark) if (1..=MARKS_MAX).contains(&mark) && !number.starts_with(['+', '0']) => {
                Ok(("mark", mark))
            }
            _ => Err((0, format!("{thing} is no mark"), format!("mark1 to mark{MARKS_MAX}"))),
        };
    }
    if known(thing) {
        return Ok((thing, 0));
    }
    let problem = if thing.is_empty() {
        "it lacks what fails".to_owned()
    } else {
        format!("{thing} is nothing that fails")
    };
    Err((0, problem, possible))
}

/// The value in `text`, or its default.
fn argument(
    word: &'static FaultWord,
    mark: u8,
    text: Option<(usize, &str)>,
    end: usize,
) -> Result<FaultArgument, Refusal> {
    let mut argument = FaultArgument { number: 0.0, mode: None, mark };
    let pattern = || word.pattern();
    match (word.value, text) {
        (FaultValue::None | FaultValue::Mode, None) => {}
        (FaultValue::None, Some((at, value))) => {
            return Err((at - 1, format!("{} takes no value, and :{value} is one", word.what), pattern()));
        }
        (FaultValue::Mode, Some((_, "b"))) => argument.mode = Some(DriveMode::B),
        (FaultValue::Mode, Some((_, "c"))) => argument.mode = Some(DriveMode::C),
        (FaultValue::Mode, Some((at, value))) => {
            return Err((at, format!("{value} is no mode"), "b or c".to_owned()));
        }
        (FaultValue::Number { key, optional }, None) => match setting::find(key).kind.resolved() {
            Kind::Number { default, .. } if optional => argument.number = default,
            _ => return Err((end, format!("{} lacks its value", word.what), pattern())),
        },
        (FaultValue::Number { key, .. }, Some((at, value))) => {
            let setting = Setting { key: word.what, ..setting::find(key) };
            match setting.parse(value) {
                Ok(Value::Number(number)) => argument.number = number,
                Ok(_) => {}
                Err(error) => return Err((at, error.to_string(), pattern())),
            }
        }
    }
    Ok(argument)
}

/// Beginning and end.
fn times(kind: FaultKind, text: Option<(usize, &str)>) -> Result<(Time, Time), Refusal> {
    let Some((at, text)) = text else { return Ok((Time::ZERO, Fault::NEVER)) };
    let is_instant = matches!(kind, FaultKind::Jolt(_));
    let possible = if is_instant { "@FROM, in s" } else { "@FROM, @FROM.., @..UNTIL or @FROM..UNTIL, in s" };
    let (from, until) = match text.split_once("..") {
        None => (text, None),
        Some((from, _)) if is_instant => {
            return Err((at + from.len(), "it happens at one time".to_owned(), possible.to_owned()));
        }
        Some((from, until)) => (from, Some((at + from.len() + 2, until))),
    };
    let read = |at: usize, text: &str| time(text).map_err(|problem| (at, problem, possible.to_owned()));
    let open = |text: &str| text.trim().is_empty();
    let begins = match until {
        Some((_, until)) if open(from) && !open(until) => Time::ZERO,
        _ => read(at, from)?,
    };
    let ends = match until {
        Some((at, until)) if !open(until) => (at, read(at, until)?),
        _ => return Ok((begins, Fault::NEVER)),
    };
    if ends.1 <= begins {
        let problem = format!(
            "the fault ends at {} s and begins at {} s",
            super::seconds(ends.1),
            super::seconds(begins)
        );
        return Err((ends.0, problem, possible.to_owned()));
    }
    Ok((begins, ends.1))
}

/// A time in s, rounded to the nanosecond.
fn time(text: &str) -> Result<Time, String> {
    let seconds: f64 = match text.parse() {
        Ok(seconds) if !f64::is_nan(seconds) => seconds,
        _ if text.is_empty() => return Err("a time is missing".to_owned()),
        _ => return Err(format!("{text} is not a time in s")),
    };
    if !(0.0..=TIME_MAX_S).contains(&seconds) {
        return Err(format!("{} s is outside its bounds 0 to {} s", plain(seconds), plain(TIME_MAX_S)));
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 1e14 ns, not negative"
    )]
    Ok(Time::from_nanos((seconds * 1e9).round() as u64))
}
