//! A log in words: when and why frames were refused, the filter restarted, the health changed, the move went on or
//! stopped.
//!
//! Frames refused one after the other for one reason are one event, and so is a row of bursts with their rests. A
//! health that comes back within [`BRIEF_S`], again and again, is one event with a count.

use std::fmt;
use std::path::Path;

use motor_model::Time;
use serde::Serialize;

use super::error::LogError;
use super::reader::{self, LogMessage, LogPart};
use super::words::{health_sentence, phase_sentence, refusal_sentence};
use crate::report::key_figure::KeyFigure;
use simulation::math::count::real;

/// Frames refused within so many s of each other belong together.
const TOGETHER_S: f64 = 2e-3;
/// Changes of the health within so many s of each other, in s.
const BRIEF_S: f64 = 5e-3;

/// What happened, from one time to another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogEvent {
    /// When it began.
    pub from_s: f64,
    /// When it ended.
    pub until_s: f64,
    /// `frames`, `health`, `phase` or `end`.
    pub what: &'static str,
    /// How often.
    pub count: u64,
    /// A sentence.
    pub sentence: String,
}

/// A log in words.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The command that was logged.
    pub logged_command: String,
    /// The filter that ran.
    pub filter: String,
    /// Length of the log.
    pub duration_s: f64,
    /// How the run ended: whole, interrupted or no room; `null` if the log is cut.
    pub ended: Option<String>,
    /// Frames used.
    pub frames_used: u64,
    /// Frames refused.
    pub frames_refused: u64,
    /// What happened, in order.
    pub events: Vec<LogEvent>,
    /// Where the log is damaged; `null` if it is whole.
    pub damage: Option<String>,
}

/// Events under way.
#[derive(Debug, Default)]
struct Story {
    events: Vec<LogEvent>,
    /// The refused frames under way: verdict, and the largest innovation over its standard deviation.
    refused: Option<(LogEvent, String, f64)>,
    health: Option<LogEvent>,
    phase: Option<(LogEvent, String)>,
    used: u64,
    refused_count: u64,
    started: bool,
    last_s: f64,
    stopped: bool,
}

/// Explains the log at `path`. With `strict` a damaged log is an error, otherwise it is explained up to the damage.
///
/// # Errors
/// When the log cannot be read.
pub fn explain(path: &Path, strict: bool) -> Result<Explanation, LogError> {
    let (head, mut reader) = reader::open(path)?;
    let mut story = Story::default();
    let mut ended = None;
    let damage = loop {
        match reader.next_part() {
            Ok(None) => break None,
            Ok(Some(LogPart::Message(at, message))) => story.take(at.seconds_since(Time::ZERO), message),
            Ok(Some(LogPart::Ended(how))) => ended = Some(how),
            Ok(Some(LogPart::Result(_))) => {}
            Err(damage @ LogError::Damaged { .. }) if !strict => break Some(damage.to_string()),
            Err(other) => return Err(other),
        }
    };
    let (frames_used, frames_refused, duration_s) = (story.used, story.refused_count, story.last_s);
    let events = story.end(ended.as_deref());
    Ok(Explanation {
        logged_command: head.command,
        filter: head.filter,
        duration_s,
        ended,
        frames_used,
        frames_refused,
        events,
        damage,
    })
}

fn event(at_s: f64, what: &'static str, sentence: String) -> LogEvent {
    LogEvent { from_s: at_s, until_s: at_s, what, count: 1, sentence }
}

impl Story {
    fn take(&mut self, at_s: f64, message: LogMessage) {
        match message {
            LogMessage::Innovation(innovation) => {
                let ratio = f64::from(innovation.normalised_squared);
                match innovation.verdict.as_str() {
                    "Used" => self.used += 1,
                    "Restarted" => self.start(at_s),
                    verdict => self.refuse(at_s, verdict, if ratio.is_finite() { ratio } else { 0.0 }),
                }
            }
            LogMessage::Health(health) => {
                self.last_s = self.last_s.max(at_s);
                self.change_health(at_s, &health.health);
            }
            LogMessage::Task(task) => {
                self.last_s = self.last_s.max(at_s);
                self.change_phase(at_s, &task.phase);
            }
            LogMessage::Truth(_)
            | LogMessage::Estimate(_)
            | LogMessage::CameraFrame(_)
            | LogMessage::VibrometerSample(_) => self.last_s = self.last_s.max(at_s),
            _ => {}
        }
    }

    fn start(&mut self, at_s: f64) {
        let sentence = if self.started {
            "the filter starts anew from this frame, after too many refusals in a row"
        } else {
            "the filter starts from this frame"
        };
        self.started = true;
        self.events.push(event(at_s, "frames", sentence.to_owned()));
    }

    fn refuse(&mut self, at_s: f64, verdict: &str, normalised_squared: f64) {
        self.refused_count += 1;
        if let Some((event, of, largest)) = &mut self.refused
            && of == verdict
            && at_s - event.until_s < TOGETHER_S
        {
            event.until_s = event.until_s.max(at_s);
            event.count += 1;
            *largest = largest.max(normalised_squared);
            return;
        }
        self.end_refused();
        self.refused = Some((event(at_s, "frames", String::new()), verdict.to_owned(), normalised_squared));
    }

    fn end_refused(&mut self) {
        if let Some((mut event, verdict, largest)) = self.refused.take() {
            event.sentence = refusal_sentence(&verdict, event.count, motor_model::math::sqrt(largest));
            self.events.push(event);
        }
    }

    fn change_health(&mut self, at_s: f64, health: &str) {
        let sentence = health_sentence(health);
        if let Some(last) = &mut self.health {
            last.until_s = at_s;
            let last = last.clone();
            // The same two in turn are one event.
            let earlier = self.events.iter_mut().rev().filter(|event| event.what == "health").take(2);
            let twin = earlier
                .into_iter()
                .find(|event| event.sentence == last.sentence && last.from_s - event.until_s < BRIEF_S);
            match twin {
                Some(twin) => {
                    twin.until_s = last.until_s;
                    twin.count += 1;
                }
                None => self.events.push(last),
            }
        }
        self.health = Some(event(at_s, "health", sentence));
    }

    fn change_phase(&mut self, at_s: f64, phase: &str) {
        let (sentence, group) = phase_sentence(phase);
        self.stopped |= phase.starts_with("Stopped");
        if let Some((last, last_group)) = &mut self.phase {
            last.until_s = at_s;
            if last_group == group {
                last.count += u64::from(phase == "Burst");
                return;
            }
        }
        self.end_phase(at_s);
        let mut begun = event(at_s, "phase", sentence);
        begun.count = u64::from(phase == "Burst" || group != "bursts");
        self.phase = Some((begun, group.to_owned()));
    }

    fn end_phase(&mut self, at_s: f64) {
        if let Some((mut last, group)) = self.phase.take() {
            last.until_s = at_s;
            if group == "bursts" && last.count > 0 {
                let bursts = if last.count == 1 { "burst" } else { "bursts" };
                last.sentence = format!("{} {bursts}, with rest and measuring between", last.count);
            }
            self.events.push(last);
        }
    }

    fn end(mut self, ended: Option<&str>) -> Vec<LogEvent> {
        let last_s = self.last_s;
        self.end_refused();
        self.end_phase(last_s);
        if let Some(mut health) = self.health.take() {
            health.until_s = last_s;
            self.events.push(health);
        }
        let sentence = match ended {
            Some("whole") if self.stopped => "the controller has given up, and the run ends",
            Some("whole") => "the run ends as it should",
            Some("interrupted") => "the run was interrupted here",
            Some("no room") => "the disk was full here",
            _ => "the log breaks off here",
        };
        self.events.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        self.events.push(event(last_s, "end", sentence.to_owned()));
        self.events
    }
}

impl Explanation {
    /// What became of the frames: values of one run, without a measure of their chance.
    pub fn key_figures(&self) -> [KeyFigure; 2] {
        [("frames used", self.frames_used), ("frames refused", self.frames_refused)]
            .map(|(name, count)| KeyFigure::single(name, "", real(count)))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.frames_used + self.frames_refused;
        writeln!(
            f,
            "log                {}, {:.4} s, filter {}",
            self.logged_command, self.duration_s, self.filter
        )?;
        let share = 100.0 * real(self.frames_refused) / real(all.max(1));
        writeln!(
            f,
            "frames             {} used, {} refused ({share:.1} %)",
            self.frames_used, self.frames_refused
        )?;
        if let Some(damage) = &self.damage {
            writeln!(f, "damage             {damage}; read up to there")?;
        }
        for event in &self.events {
            let LogEvent { from_s, until_s, what, count, sentence } = event;
            let until = if until_s > from_s { format!("to {until_s:.4} s") } else { String::new() };
            let times =
                if *count > 1 && *what == "health" { format!(" ({count} times)") } else { String::new() };
            writeln!(f, "{from_s:>9.4} s {until:<12}  {sentence}{times}")?;
        }
        Ok(())
    }
}
