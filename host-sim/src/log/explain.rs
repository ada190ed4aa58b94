//! A log in words: when and why frames were refused, the filter restarted, the health changed, the move went on or
//! stopped; of a recording without a filter, which drives there were.
//!
//! Frames refused one after the other for one reason are one event, and so is a row of bursts with their rests. What
//! comes back within [`BRIEF_S`], again and again, is one event with a count. If there are still more than
//! [`LINES_MAX`] events, the same in longer and longer intervals are one.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use motor_model::Time;
use serde::Serialize;

use super::channels;
use super::error::LogError;
use super::reader::{self, LogMessage, LogPart};
use super::words::{drive_sentence, health_sentence, phase_sentence, refusal_sentence};
use crate::report::key_figure::KeyFigure;
use simulation::math::count::real;

/// Frames refused within so many s of each other belong together.
const TOGETHER_S: f64 = 2e-3;
/// A health or a drive that comes back within so many s is told once.
const BRIEF_S: f64 = 5e-3;
/// More events than these are told together.
const LINES_MAX: usize = 60;

/// What happened, from one time to another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogEvent {
    /// When it began.
    pub from_s: f64,
    /// When it ended.
    pub until_s: f64,
    /// `frames`, `health`, `phase`, `drive` or `end`.
    pub what: &'static str,
    /// How often: frames that were refused, bursts, and otherwise the same as `times`.
    pub count: u64,
    /// How many times the same happened in turn with other things, which are told as one event.
    pub times: u64,
    /// How long it lasted in all of these, in s.
    pub lasted_s: f64,
    /// A sentence.
    pub sentence: String,
}

/// A log in words.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The command that was logged.
    pub logged_command: String,
    /// The filter that ran; `none` of a recording.
    pub filter: String,
    /// Length of the log.
    pub duration_s: f64,
    /// How the run ended: whole, interrupted or no room; `null` if the log is cut.
    pub ended: Option<String>,
    /// Frames that arrived.
    pub frames: u64,
    /// Frames used.
    pub frames_used: u64,
    /// Frames refused.
    pub frames_refused: u64,
    /// What happened, in order.
    pub events: Vec<LogEvent>,
    /// Where the log is damaged; `null` if it is whole.
    pub damage: Option<String>,
}

/// An event, and what makes its sentence.
#[derive(Debug)]
struct Told {
    event: LogEvent,
    says: Says,
}

/// Events that say the same can be told as one.
#[derive(Clone, Debug, PartialEq)]
enum Says {
    /// Frames refused with this verdict; the largest innovation squared over its variance.
    Refused(String, f64),
    /// A drive: mode and amplitude; its least and its largest offset from the design's frequency in Hz.
    Drive(String, [f32; 2]),
    /// Bursts.
    Bursts,
    /// The sentence itself.
    Sentence(String),
}

/// Events under way.
#[derive(Debug)]
struct Story<'a> {
    command: &'a str,
    /// Whether a filter ran.
    has_filter: bool,
    told: Vec<Told>,
    refused: Option<Told>,
    health: Option<Told>,
    phase: Option<(Told, String)>,
    drive: Option<Told>,
    frames: u64,
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
    let mut story = Story::new(&head.command, head.filter != "none");
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
    let Story { frames, used: frames_used, refused_count: frames_refused, last_s: duration_s, .. } = story;
    let events = story.end(ended.as_deref());
    Ok(Explanation {
        logged_command: head.command,
        filter: head.filter,
        duration_s,
        ended,
        frames,
        frames_used,
        frames_refused,
        events,
        damage,
    })
}

impl Told {
    fn new(at_s: f64, what: &'static str, says: Says) -> Self {
        let event = LogEvent {
            from_s: at_s,
            until_s: at_s,
            what,
            count: 1,
            times: 1,
            lasted_s: 0.0,
            sentence: String::new(),
        };
        Self { event, says }
    }

    fn sentence(at_s: f64, what: &'static str, sentence: impl Into<String>) -> Self {
        Self::new(at_s, what, Says::Sentence(sentence.into()))
    }

    fn end(&mut self, at_s: f64) {
        self.event.until_s = self.event.until_s.max(at_s);
        self.event.lasted_s = self.event.until_s - self.event.from_s;
    }

    /// What tells it from events that say something else.
    fn name(&self) -> (&'static str, String) {
        let words = match &self.says {
            Says::Refused(words, _) | Says::Drive(words, _) | Says::Sentence(words) => words.as_str(),
            Says::Bursts => "",
        };
        (self.event.what, words.to_owned())
    }

    /// Takes in a later event of the same name.
    fn absorb(&mut self, other: Self) {
        let (event, later) = (&mut self.event, other.event);
        event.until_s = event.until_s.max(later.until_s);
        event.count += later.count;
        event.times += later.times;
        event.lasted_s += later.lasted_s;
        match (&mut self.says, other.says) {
            (Says::Refused(_, largest), Says::Refused(_, more)) => *largest = largest.max(more),
            (Says::Drive(_, [least, most]), Says::Drive(_, [low, high])) => {
                (*least, *most) = (least.min(low), most.max(high));
            }
            _ => {}
        }
    }

    /// The event with its sentence.
    fn told(self) -> LogEvent {
        let Self { mut event, says } = self;
        event.sentence = match says {
            Says::Sentence(sentence) => sentence,
            Says::Refused(verdict, largest) => {
                refusal_sentence(&verdict, event.count, motor_model::math::sqrt(largest))
            }
            Says::Drive(drive, offsets_hz) => drive_sentence(&drive, offsets_hz),
            Says::Bursts if event.count == 0 => phase_sentence("Settling").0,
            Says::Bursts => {
                let bursts = if event.count == 1 { "burst" } else { "bursts" };
                format!("{} {bursts}, with rest and measuring between", event.count)
            }
        };
        event
    }
}

/// The events in order, those of one name told as one where the later begins within `gap_s` of the end of the earlier,
/// and `folds` says so of the later.
fn folded(events: Vec<Told>, gap_s: f64, folds: impl Fn(&LogEvent) -> bool) -> Vec<Told> {
    let mut kept: Vec<Told> = Vec::new();
    let mut places: HashMap<(&'static str, String), usize> = HashMap::new();
    for told in events {
        let name = told.name();
        let earlier = places
            .get(&name)
            .and_then(|place| kept.get_mut(*place))
            .filter(|earlier| told.event.from_s - earlier.event.until_s < gap_s && folds(&told.event));
        if let Some(earlier) = earlier {
            earlier.absorb(told);
        } else {
            places.insert(name, kept.len());
            kept.push(told);
        }
    }
    kept
}

impl<'a> Story<'a> {
    /// That of a log of `command`, before its first message.
    fn new(command: &'a str, has_filter: bool) -> Self {
        Self {
            command,
            has_filter,
            told: Vec::new(),
            refused: None,
            health: None,
            phase: None,
            drive: None,
            frames: 0,
            used: 0,
            refused_count: 0,
            started: false,
            last_s: 0.0,
            stopped: false,
        }
    }

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
            LogMessage::Drive(drive) => {
                self.last_s = self.last_s.max(at_s);
                self.change_drive(at_s, &drive);
            }
            LogMessage::CameraFrame(_) => {
                self.frames += 1;
                self.last_s = self.last_s.max(at_s);
            }
            LogMessage::Truth(_) | LogMessage::Estimate(_) | LogMessage::VibrometerSample(_) => {
                self.last_s = self.last_s.max(at_s);
            }
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
        self.told.push(Told::sentence(at_s, "frames", sentence));
    }

    fn refuse(&mut self, at_s: f64, verdict: &str, normalised_squared: f64) {
        self.refused_count += 1;
        let next = Told::new(at_s, "frames", Says::Refused(verdict.to_owned(), normalised_squared));
        if let Some(refused) = &mut self.refused
            && refused.name() == next.name()
            && at_s - refused.event.until_s < TOGETHER_S
        {
            refused.absorb(next);
            refused.event.times = 1;
            refused.end(at_s);
            return;
        }
        let ended = self.refused.replace(next);
        self.told.extend(ended);
    }

    fn change_health(&mut self, at_s: f64, health: &str) {
        if self.has_filter {
            let begun = Told::sentence(at_s, "health", health_sentence(health));
            let ended = self.health.replace(begun);
            self.tell(ended, at_s);
        }
    }

    /// The drives of a recording; those of a controller follow from its phases.
    fn change_drive(&mut self, at_s: f64, drive: &channels::Drive) {
        if self.has_filter {
            return;
        }
        let mode = match drive.mode.as_str() {
            "off" => "drive off".to_owned(),
            mode => format!("drive: mode {mode} at {} of full amplitude", drive.amplitude),
        };
        let begun = Told::new(at_s, "drive", Says::Drive(mode, [drive.frequency_offset_hz; 2]));
        match &mut self.drive {
            // A sweep is one drive.
            Some(drive) if drive.name() == begun.name() => {
                drive.absorb(begun);
                drive.event.times = 1;
            }
            _ => {
                let ended = self.drive.replace(begun);
                self.tell(ended, at_s);
            }
        }
    }

    fn change_phase(&mut self, at_s: f64, phase: &str) {
        self.stopped |= phase.starts_with("Stopped");
        let (sentence, group) = match (phase, self.command) {
            ("None", "record") => ("no controller: the drives are given beforehand".to_owned(), phase),
            ("None", "replay") => ("no controller: a filter is given a recorded run".to_owned(), phase),
            _ => phase_sentence(phase),
        };
        let bursts = u64::from(phase == "Burst");
        if let Some((last, last_group)) = &mut self.phase
            && last_group == group
        {
            last.end(at_s);
            last.event.count += bursts;
            return;
        }
        let begun = if group == "bursts" {
            let mut begun = Told::new(at_s, "phase", Says::Bursts);
            begun.event.count = bursts;
            begun
        } else {
            Told::sentence(at_s, "phase", sentence)
        };
        let ended = self.phase.replace((begun, group.to_owned()));
        self.tell(ended.map(|(told, _)| told), at_s);
    }

    /// Keeps what has ended.
    fn tell(&mut self, ended: Option<Told>, at_s: f64) {
        self.told.extend(ended.map(|mut ended| {
            ended.end(at_s);
            ended
        }));
    }

    fn end(mut self, ended: Option<&str>) -> Vec<LogEvent> {
        let last_s = self.last_s;
        let refused = self.refused.take();
        self.told.extend(refused);
        let phase = self.phase.take().map(|(phase, _)| phase);
        for last in [phase, self.health.take(), self.drive.take()] {
            self.tell(last, last_s);
        }
        let sentence = match ended {
            Some("whole") if self.stopped => "the controller has given up, and the run ends",
            Some("whole") => "the run ends as it should",
            Some("interrupted") => "the run was interrupted here",
            Some("no room") => "the disk was full here",
            _ => "the log breaks off here",
        };
        // Of what begins together the longest comes first.
        self.told.sort_by(|a, b| {
            let [a, b] = [&a.event, &b.event];
            a.from_s.total_cmp(&b.from_s).then(b.until_s.total_cmp(&a.until_s))
        });
        let brief = |event: &LogEvent| event.what == "health" || event.what == "drive";
        let mut told = folded(self.told, BRIEF_S, brief);
        let mut gap_s = BRIEF_S;
        while told.len() > LINES_MAX && gap_s < 2.0 * last_s {
            told = folded(told, gap_s, |_| true);
            gap_s *= 2.0;
        }
        told.push(Told::sentence(last_s, "end", sentence));
        told.into_iter().map(Told::told).collect()
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
        if self.filter == "none" {
            writeln!(f, "frames             {} arrived, no filter ran", self.frames)?;
        } else {
            writeln!(
                f,
                "frames             {} used, {} refused ({share:.1} %)",
                self.frames_used, self.frames_refused
            )?;
        }
        if let Some(damage) = &self.damage {
            writeln!(f, "damage             {damage}; read up to there")?;
        }
        for event in &self.events {
            let LogEvent { from_s, until_s, times, lasted_s, sentence, .. } = event;
            let until = if until_s > from_s { format!("to {until_s:.4} s") } else { String::new() };
            let times = match times {
                0 | 1 => String::new(),
                times if *lasted_s > 0.0 => format!(" ({times} times, {lasted_s:.4} s in all)"),
                times => format!(" ({times} times)"),
            };
            writeln!(f, "{from_s:>9.4} s {until:<12}  {sentence}{times}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
