//! The parts of a recording that have statistics: drives of one kind together, what follows each kind, sweeps.
//!
//! What has statistics follows from the drives and the instruments alone, so that every motor under the same drives has
//! the same statistics.

use motor_model::{DriveCommand, DriveMode};

use super::measured::Measured;
use simulation::runs::recording::DriveCourse;

/// From and until, in s.
pub type Span = (f64, f64);

/// Time after a drive begins that has no statistics: several ring-ups of the stator.
const SETTLE_S: f64 = 0.03;
/// Shortest drive that has statistics.
const DRIVEN_MIN_S: f64 = 0.02;
/// Shortest time without drive that has statistics.
const COAST_MIN_S: f64 = 0.01;
/// Most kinds of drive that have statistics: those that last longest.
const KINDS_MAX: usize = 6;
/// Fewest frequencies of a sweep.
const SWEEP_MIN: usize = 20;

/// A kind of part, and where it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// Name, as `b:1`.
    pub name: String,
    /// The drive, or the one before.
    pub command: DriveCommand,
    /// Its parts.
    pub spans: Vec<Span>,
}

/// The parts of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// Steady drives, each without its beginning.
    pub driven: Vec<Kind>,
    /// Without drive, after each kind of drive.
    pub coasting: Vec<Kind>,
    /// Sweeps: pieces of one frequency each, with their drives.
    pub sweeps: Vec<Vec<(DriveCommand, Span)>>,
    /// Whether there are vibrometer samples.
    pub has_vibrometer: bool,
    /// Whether there are frames.
    pub has_camera: bool,
    /// Whether frames have several marks.
    pub has_marks: bool,
}

impl Parts {
    /// The parts of what was measured under `course`.
    pub fn of(course: &DriveCourse, measured: &Measured) -> Self {
        let pieces = pieces(course);
        let (mut driven, mut coasting, mut sweeps) = (Vec::new(), Vec::new(), Vec::new());
        for same_drive in pieces.chunk_by(|(a, _), (b, _)| is_swept(*a, *b)) {
            if same_drive.len() >= SWEEP_MIN {
                sweeps.push(same_drive.to_vec());
            }
        }
        let mut before = None;
        for &(command, (from, until)) in &pieces {
            let length = until - from;
            if command.mode().is_some() {
                if length >= DRIVEN_MIN_S {
                    let settled = from + SETTLE_S.min(0.5 * length);
                    add(&mut driven, &name(command), command, (settled, until));
                }
                before = Some(command);
            } else if let Some(before) = before.filter(|_| length >= COAST_MIN_S) {
                add(&mut coasting, &format!("after {}", name(before)), before, (from, until));
            }
        }
        Self {
            driven: longest(driven),
            coasting: longest(coasting),
            sweeps,
            has_vibrometer: !measured.at_s.is_empty(),
            has_camera: !measured.frames.is_empty(),
            has_marks: measured.frames.iter().any(|frame| frame.marks_m.is_some()),
        }
    }

    /// Whether nothing has statistics. Of a bare stator steady drives have none, of a whole motor sweeps.
    pub fn is_empty(&self, of_stator: bool) -> bool {
        let has_camera = self.has_camera && !of_stator;
        let other = if of_stator { self.sweeps.is_empty() } else { self.driven.is_empty() };
        (self.coasting.is_empty() && other) || !(self.has_vibrometer || has_camera)
    }
}

/// Times of one command each.
fn pieces(course: &DriveCourse) -> Vec<(DriveCommand, Span)> {
    let seconds = |at: motor_model::Time| at.seconds_since::<f64>(motor_model::Time::ZERO);
    let mut pieces: Vec<(DriveCommand, Span)> = Vec::new();
    for (number, change) in course.changes.iter().enumerate() {
        let until = course.changes.get(number + 1).map_or(course.until, |next| next.from);
        let span = (seconds(change.from), seconds(until));
        match pieces.last_mut() {
            Some((command, last)) if *command == change.command => last.1 = span.1,
            _ if span.1 > span.0 => pieces.push((change.command, span)),
            _ => {}
        }
    }
    pieces
}

/// Whether one frequency follows the other in a sweep.
fn is_swept(a: DriveCommand, b: DriveCommand) -> bool {
    let same = a.mode().is_some() && a.mode() == b.mode();
    same && a.amplitude().to_bits() == b.amplitude().to_bits() && a != b
}

fn name(command: DriveCommand) -> String {
    let mode = if command.mode() == Some(DriveMode::B) { "b" } else { "c" };
    let (amplitude, offset_hz) = (command.amplitude(), command.frequency_offset_hz());
    if offset_hz.to_bits() == 0 {
        format!("{mode}:{amplitude}")
    } else {
        format!("{mode}:{amplitude}{offset_hz:+} Hz")
    }
}

fn add(kinds: &mut Vec<Kind>, name: &str, command: DriveCommand, span: Span) {
    match kinds.iter_mut().find(|kind| kind.name == name) {
        Some(kind) => kind.spans.push(span),
        None => kinds.push(Kind { name: name.to_owned(), command, spans: vec![span] }),
    }
}

/// The kinds that last longest, in the order of their beginnings.
fn longest(mut kinds: Vec<Kind>) -> Vec<Kind> {
    let length = |kind: &Kind| kind.spans.iter().map(|(from, until)| until - from).sum::<f64>();
    let mut lengths: Vec<f64> = kinds.iter().map(length).collect();
    lengths.sort_by(|a, b| b.total_cmp(a));
    if let Some(least) = lengths.get(KINDS_MAX - 1).copied() {
        kinds.retain(|kind| length(kind) >= least);
        kinds.truncate(KINDS_MAX);
    }
    kinds
}
