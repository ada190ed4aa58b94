//! What a board is told before a run, and what it keeps of it over a loss of power.
//!
//! ```text
//! --forget: Forget ---+
//!                     v          the same digest: nothing          --keep, unless it keeps this one
//! Hello ---------> Digest? --+------------------------------> task ------------------------------> Keep
//!                            +--> Instruments ... MapEnd --->
//! ```
//!
//! A board begins a session with the description that it keeps. Where its digest is that of the scene's description,
//! the board has it already.
//!
//! A scene that names no filter gets the best that the instruments as described allow, the error of the clock included,
//! or the next simpler one that the board was built with.

use estimator::CameraDescription;
use link::{BoardFault, DescriptionDigest, HostMessage, KeptDescription};
use motor_model::Angle;
use serde::Serialize;

use super::SerialError;
use super::report_period::ReportPeriod;
use super::session::BoardSession;
use super::task::BoardTask;
use super::task_filter::{filter, is_without, with_filter, with_simpler_filter};
use crate::board::pil::{acknowledgement, description, filter_name, filter_named};
use simulation::scene::Scene;

/// Messages that the line may lose, or their answers, before the host gives up.
const LOSSES_MAX: u32 = 8;

/// What becomes of the description that the board keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keeping {
    /// It stays as it is.
    #[default]
    Untouched,
    /// That of this run takes its place.
    Keep,
    /// It is forgotten before this run is described.
    Forget,
}

/// The description of a run's bench on the board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DescriptionFigures {
    /// Its digest ([`DescriptionDigest`]) in sixteen digits.
    pub digest: String,
    /// Whether the board was told it: not where it had it already.
    pub sent: bool,
    /// Whether the board keeps it, and no other, over a loss of power.
    pub kept: bool,
    /// The filter of the task.
    pub filter: &'static str,
    /// Root mean square error in us of the clock that stamps frames, as the filter is told.
    pub clock_error_us: u16,
}

/// What a board is told before a run.
pub(super) struct Preparation {
    /// The messages that describe the bench.
    pub description: Vec<HostMessage>,
    /// The task, where there is one.
    pub task: Option<HostMessage>,
    /// The camera's angle that is the zero, where there is one. A session begins with 0.
    pub zero: Option<Angle>,
    /// How often the board is to report, where it is asked to.
    pub reports: Option<ReportPeriod>,
    /// Whether the scene names no filter: a board without the task's may take a simpler one.
    pub any_filter: bool,
}

impl Preparation {
    /// Of `task` in `scene`. The board reports as often as it does by itself.
    ///
    /// # Errors
    /// When the scene's map is for another design.
    pub(super) fn of(task: BoardTask, scene: &Scene) -> Result<Self, SerialError> {
        let mut description = task.preparation(scene)?;
        let asked = description.pop();
        Ok(Self {
            description,
            task: asked,
            zero: task.zero(scene),
            reports: None,
            any_filter: scene.choice("estimator.filter") == "best",
        })
    }

    /// The same that tells the filter of an error of the clock of `micros`, root mean square. What a scene says of a
    /// camera with a clock of its own counts where it is more. Where the scene names no filter, the task has the best
    /// for such a clock.
    pub(super) fn with_clock_error(mut self, micros: u16) -> Self {
        for message in &mut self.description {
            if let HostMessage::Instruments(instruments) = message {
                let camera = &mut instruments.camera;
                camera.clock_sd_micros = camera.clock_sd_micros.max(micros);
                if self.any_filter {
                    let best = filter_named(instruments.best_filter().name());
                    self.task = self.task.and_then(|task| with_filter(&task, best));
                }
            }
        }
        self
    }

    /// The camera as it is described.
    pub(super) fn camera(&self) -> CameraDescription {
        camera(&self.description)
    }
}

/// The camera of a description; a board that was described none has the default.
fn camera(description: &[HostMessage]) -> CameraDescription {
    let told = description.iter().find_map(|message| match message {
        HostMessage::Instruments(instruments) => Some(instruments.camera),
        _ => None,
    });
    told.unwrap_or_default()
}

/// Tells the board what the run needs. `see` gets what the board kept before, where it has a place for that.
///
/// # Errors
/// When the board refuses a message, or does not answer.
pub(super) fn prepare(
    session: &mut BoardSession,
    Preparation { description, mut task, zero, reports, any_filter }: Preparation,
    keeping: Keeping,
    see: impl FnOnce(KeptDescription),
) -> Result<DescriptionFigures, SerialError> {
    let digest = DescriptionDigest::of(description.iter().cloned())?;
    let clock_error_us = camera(&description).clock_sd_micros;
    let found = session.digests()?;
    if let Some(found) = found {
        see(found.kept);
    }
    let forgets = keeping == Keeping::Forget;
    let sent = forgets || found.is_none_or(|found| found.in_force != digest);
    let is_kept = !forgets && found.is_some_and(|found| found.kept == KeptDescription::Whole { digest });
    let keeps = keeping == Keeping::Keep && !is_kept;
    let forget = forgets.then_some(HostMessage::Forget);
    let zero = zero.map(|zero| HostMessage::Zero { angle_units: Some(zero.units()) });
    let reports = reports.map(|period| HostMessage::ReportPeriod { ticks: period.ticks() });
    let keep = keeps.then_some(HostMessage::Keep);
    let before: Vec<_> = forget.into_iter().chain(description.iter().filter(|_| sent).cloned()).collect();
    let after: Vec<_> = zero.into_iter().chain(reports).chain(keep).collect();
    while let Err(error) = upload(session, &[&before[..], task.as_slice(), &after].concat()) {
        task = match error {
            SerialError::Refused { ref fault, .. } if any_filter && is_without(fault) => {
                Some(task.as_ref().and_then(with_simpler_filter).ok_or(error)?)
            }
            error => return Err(error),
        };
    }
    let filter = task.as_ref().and_then(filter).map_or("none", filter_name);
    let (digest, kept) = (format!("{digest:016x}"), is_kept || keeps);
    Ok(DescriptionFigures { digest, sent, kept, filter, clock_error_us })
}

/// Lets the board at a port keep the description of the bench of `scene`, with its map, over a loss of power. The
/// filter is told of an error of the clock of `clock_error_us`, as in the run before ([`DescriptionFigures`]).
///
/// # Errors
/// When there is no board, it has no place for a description, or refuses this one.
pub fn keep(
    port: &str,
    baud: u32,
    scene: &Scene,
    clock_error_us: u16,
) -> Result<DescriptionFigures, SerialError> {
    let description = description(scene)?;
    let preparation = Preparation { description, task: None, zero: None, reports: None, any_filter: false }
        .with_clock_error(clock_error_us);
    let mut session = BoardSession::open(port, baud)?;
    prepare(&mut session, preparation, Keeping::Keep, |_| ())
}

/// Tells the board `messages`. The line may lose a frame or its answer: the board is told it again. One that has
/// started anew is told everything again.
pub(super) fn upload(session: &mut BoardSession, messages: &[HostMessage]) -> Result<(), SerialError> {
    let (mut next, mut losses) = (0, 0);
    while let Some(message) = messages.get(next) {
        match session.ask(message, what(message), &acknowledgement(message)) {
            Ok(()) => {
                next += 1;
                continue;
            }
            Err(SerialError::Unanswered { .. }) if losses < LOSSES_MAX => next = told_again(messages, next),
            Err(SerialError::Refused { fault: BoardFault::UnknownSession { .. }, .. })
                if losses < LOSSES_MAX =>
            {
                session.hello()?;
                next = 0;
            }
            Err(error) => return Err(error),
        }
        losses += 1;
    }
    Ok(())
}

/// Where the board is told again, when message `lost` or its answer was lost: the message itself, but of a response map
/// its beginning. Rows are put after those that came before, so rows that the board has would come twice.
fn told_again(messages: &[HostMessage], lost: usize) -> usize {
    let part = messages.get(lost);
    if !matches!(part, Some(HostMessage::MapRows(_) | HostMessage::MapLearnt(_) | HostMessage::MapEnd(_))) {
        return lost;
    }
    let before = messages.get(..lost).unwrap_or_default();
    before.iter().rposition(|message| *message == HostMessage::MapBegin).unwrap_or(lost)
}

/// What a message is, for its refusal.
fn what(message: &HostMessage) -> &'static str {
    match message {
        HostMessage::Instruments(_) => "the instruments",
        HostMessage::Timing { .. } => "the timing",
        HostMessage::MotorParameter(_) => "a parameter of the motor",
        HostMessage::MapBegin | HostMessage::MapRows(_) | HostMessage::MapEnd(_) => "the response map",
        HostMessage::ConfigureRate(_) => "the rate",
        HostMessage::ConfigureExperiments(_) => "the experiments",
        HostMessage::Zero { .. } => "the zero",
        HostMessage::ReportPeriod { .. } => "the period of reports",
        HostMessage::Keep => "to keep the description",
        HostMessage::Forget => "to forget its description",
        _ => "the move",
    }
}

#[cfg(test)]
mod tests {
    use controller::{LoopTiming, ResponseMap};
    use estimator::Instruments;
    use link::description_messages;
    use motor_model::{MotorParams, Parameter};

    use super::*;

    /// The filter is told of the clock's error, or of a greater one of a camera's own clock: 349 us. Nothing else of
    /// the description changes.
    #[test]
    fn exact_the_error_of_the_clock_is_described() {
        for (sets, told, micros) in [
            (&[][..], 0, 0),
            (&[], 200, 200),
            (&["camera.clock_offset_s=0.1"], 200, 349),
            (&["camera.clock_offset_s=0.1"], 500, 500),
        ] {
            let sets: Vec<String> = sets.iter().map(|&set: &&str| set.to_owned()).collect();
            let scene = Scene::of_sets(&sets).unwrap();
            let of = || Preparation::of(BoardTask::Move, &scene).unwrap();
            let described = of().with_clock_error(told);
            assert_eq!(described.camera().clock_sd_micros, micros, "{sets:?} {told}");
            let assumed = CameraDescription { clock_sd_micros: micros, ..of().camera() };
            assert_eq!(described.camera(), assumed);
            let changed = described.description.iter().zip(&of().description).filter(|(a, b)| a != b).count();
            assert_eq!(changed, usize::from(micros != of().camera().clock_sd_micros));
        }
    }

    /// Filters that take impacts allow 100 us. A filter that the scene names stays.
    #[test]
    fn exact_the_filter_is_the_best_for_the_clock_as_it_is_told() {
        for (named, told, expected) in [
            ("best", 0, "twin"),
            ("best", 100, "twin"),
            ("best", 200, "constant_rate"),
            ("twin", 200, "twin"),
            ("impact_aided", 0, "impact_aided"),
        ] {
            let scene = Scene::of_sets(&[format!("estimator.filter={named}")]).unwrap();
            for task in [BoardTask::Move, BoardTask::Rate, BoardTask::Commission] {
                let told_board = Preparation::of(task, &scene).unwrap().with_clock_error(told);
                let found = told_board.task.as_ref().and_then(filter).map(filter_name);
                assert_eq!(found, Some(expected), "{named} {told} {task:?}");
            }
        }
    }

    /// Of the map everything from its beginning, of all else the message alone.
    #[test]
    fn exact_a_lost_message_is_told_again_and_a_map_from_its_beginning() {
        let design = MotorParams::nominal().with(Parameter::ModeBFrequency, 6250.0).unwrap();
        let map = ResponseMap::table_1();
        let messages: Vec<HostMessage> = description_messages(
            &design,
            Instruments::default(),
            LoopTiming { latency_ticks: 3, decision_ticks: 2 },
            Some(map),
        )
        .collect();
        let begin = messages.iter().position(|message| *message == HostMessage::MapBegin).unwrap();
        assert_eq!(begin, 4);
        for lost in 0..messages.len() {
            assert_eq!(told_again(&messages, lost), lost.min(begin), "{lost}");
        }
    }
}
