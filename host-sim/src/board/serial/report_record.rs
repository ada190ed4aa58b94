//! What the board reports as records of a run, with the frames that go with it.
//!
//! A report tells of one tick in many ([`super::report_period`]), so most frames are in no report: their records have
//! no innovation. Times count from arming.

use controller::PositioningPhase;
use controller::commissioning::{CommissioningEnd, ExperimentPhase};
use controller::rate::RateStop;
use estimator::{CameraFrame, Estimate, Health, Innovation};
use link::numbering::PhaseRecord;
use link::{RatePhase, RateRecord, TickRecord};
use motor_model::{Angle, DriveCommand, Time, math};

use simulation::runs::record::{Impact, RunRecord, Task, Truth};

/// Makes records of reports.
#[derive(Debug)]
pub(super) struct ReportRecords {
    begun_at: Time,
    /// Sent and not in a record yet, in the board's time.
    frames: Vec<CameraFrame>,
}

impl ReportRecords {
    /// The records of a run that begins at `begun_at` of the board's time.
    pub(super) fn new(begun_at: Time) -> Self {
        Self { begun_at, frames: Vec::new() }
    }

    /// Takes a frame that was sent.
    pub(super) fn sent(&mut self, frame: CameraFrame) {
        self.frames.push(frame);
    }

    /// Gives the records of a report at `at` of the board's time to `observe`.
    pub(super) fn report(
        &mut self,
        at: Time,
        report: &Reported,
        truth: Option<Truth>,
        impacts: &[Impact],
        mut observe: impl FnMut(&RunRecord),
    ) {
        let mut record = RunRecord {
            at: self.since_begin(at),
            truth: None,
            impacts: &[],
            ldv_samples: &[],
            camera_frame: None,
            marked: None,
            innovation: None,
            estimate: None,
            health: report.health,
            asked: report.asked,
            applied: report.applied,
            task: report.task,
        };
        let told = report.innovation.map(|innovation| innovation.taken_at);
        let mut told_of = None;
        for sent in std::mem::take(&mut self.frames) {
            let frame = CameraFrame { exposed_at: self.since_begin(sent.exposed_at), ..sent };
            if told == Some(sent.exposed_at) {
                told_of = Some(frame);
            } else {
                record.camera_frame = Some(frame);
                observe(&record);
            }
        }
        record.camera_frame = told_of;
        record.innovation = told_of
            .and(report.innovation)
            .map(|innovation| Innovation { taken_at: self.since_begin(innovation.taken_at), ..innovation });
        record.truth = truth;
        record.impacts = impacts;
        record.estimate =
            report.estimate.map(|estimate| Estimate { at: self.since_begin(estimate.at), ..estimate });
        observe(&record);
    }

    /// Time since arming.
    pub(super) fn since_begin(&self, at: Time) -> Time {
        Time::from_nanos(at.nanos().saturating_sub(self.begun_at.nanos()))
    }
}

/// A report of the board, its numbers decoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reported {
    pub(super) estimate: Option<Estimate<f32>>,
    pub(super) health: Health,
    pub(super) innovation: Option<Innovation<f32>>,
    pub(super) asked: DriveCommand,
    pub(super) applied: DriveCommand,
    pub(super) phase: PhaseRecord,
    pub(super) task: Task,
    /// When the cruise, burst or brake under way began; of a rate, since when the command is given.
    pub(super) since: Option<Time>,
}

impl Reported {
    /// The report in `record`; `None` if a number in it has no meaning in this version.
    pub(super) fn of(record: &TickRecord) -> Option<Self> {
        let innovation = match &record.camera {
            None => None,
            Some(camera) => Some(Innovation {
                source: camera.source.value()?,
                taken_at: Time::from_nanos(camera.taken_nanos),
                innovation_rad: camera.innovation_rad,
                variance_rad2: camera.variance_rad2,
                verdict: camera.verdict.value()?,
            }),
        };
        let estimate = record.estimate.map(|estimate| Estimate {
            at: Time::from_nanos(estimate.at_nanos),
            angle: Angle::from_units(estimate.angle_units),
            rate_rad_s: estimate.rate_rad_s,
            angle_rad2: estimate.angle_rad2,
            angle_rate_rad2_s: estimate.angle_rate_rad2_s,
            rate_rad2_s2: estimate.rate_rad2_s2,
            resting: estimate.resting,
        });
        let (health, phase) = (record.health.value()?, record.phase.value()?);
        Some(Self {
            estimate,
            health,
            innovation,
            asked: record.command.command()?,
            applied: record.applied.command()?,
            phase,
            task: task(phase, health, record.rate),
            since: (record.since_nanos > 0).then(|| Time::from_nanos(record.since_nanos)),
        })
    }
}

/// The standard deviation in degrees of a variance in rad^2.
pub(super) fn sd_deg(rad2: f32) -> f64 {
    math::sqrt(f64::from(rad2)).to_degrees()
}

fn task(phase: PhaseRecord, health: Health, rate: Option<RateRecord>) -> Task {
    match phase {
        PhaseRecord::Rate(RatePhase::Waiting | RatePhase::Following) => {
            let (wanted_rad_s, units) =
                rate.map_or((f32::NAN, None), |rate| (rate.wanted_rad_s, rate.reference_units));
            Task::Rate { wanted_rad_s, reference: units.map(Angle::from_units), stopped: None }
        }
        PhaseRecord::Rate(RatePhase::Over) => Task::Told("Over"),
        PhaseRecord::Rate(RatePhase::Stopped(why)) => Task::Told(match why {
            RateStop::Stuck => "Stopped(Stuck)",
            RateStop::WrongWay => "Stopped(WrongWay)",
            RateStop::EndOfTravel => "Stopped(EndOfTravel)",
            RateStop::DrivenTooLong => "Stopped(DrivenTooLong)",
            RateStop::NoEstimate => "Stopped(NoEstimate)",
        }),
        PhaseRecord::Experiment(phase) => Task::Told(match phase {
            ExperimentPhase::Resting => "Resting",
            ExperimentPhase::Sweeping => "Sweeping",
            ExperimentPhase::Cruising => "Cruise",
            ExperimentPhase::Bursting => "Burst",
            ExperimentPhase::Ready => "Ready",
            ExperimentPhase::Ended(CommissioningEnd::Enough) => "Ended(Enough)",
            ExperimentPhase::Ended(CommissioningEnd::TimeOver) => "Ended(TimeOver)",
            ExperimentPhase::Ended(CommissioningEnd::NoEstimate) => "Ended(NoEstimate)",
            ExperimentPhase::Ended(CommissioningEnd::NeverRests) => "Ended(NeverRests)",
            ExperimentPhase::Ended(CommissioningEnd::EndOfTravel) => "Ended(EndOfTravel)",
        }),
        PhaseRecord::Waiting => Task::Position(PositioningPhase::Waiting(health)),
        PhaseRecord::Cruise => Task::Told("Cruise"),
        PhaseRecord::Burst => Task::Told("Burst"),
        PhaseRecord::Settling => Task::Told("Settling"),
        PhaseRecord::Brake => Task::Told("Brake"),
        PhaseRecord::Holding => Task::Position(PositioningPhase::Holding),
        PhaseRecord::Stopped(why) => Task::Position(PositioningPhase::Stopped(why)),
    }
}

#[cfg(test)]
mod tests {
    use controller::{RateReport, TickReport};
    use estimator::{Rejection, Source, Verdict};
    use motor_model::DriveMode;

    use super::*;

    fn report(camera: Option<Innovation<f32>>) -> TickReport {
        let at = Time::from_nanos(5_000_000);
        let angle = Angle::from_degrees(-3.0);
        let estimate = Estimate {
            at,
            angle,
            rate_rad_s: 1.5,
            angle_rad2: 1e-9,
            angle_rate_rad2_s: 1e-8,
            rate_rad2_s2: 1e-3,
            resting: true,
        };
        TickReport {
            estimate: Some(estimate),
            health: Health::Good,
            camera,
            command: DriveCommand::full(DriveMode::C),
            applied: DriveCommand::OFF,
            phase: PositioningPhase::Brake { mode: DriveMode::C, since: Time::from_nanos(4_000_000) },
        }
    }

    /// What went over the wire is what the board has.
    #[test]
    fn exact_a_report_comes_back() {
        let innovation = Innovation {
            source: Source::Camera,
            taken_at: Time::from_nanos(4_900_000),
            innovation_rad: -1e-3,
            variance_rad2: 1e-6,
            verdict: Verdict::Rejected(Rejection::Gate),
        };
        let sent = report(Some(innovation));
        let received = Reported::of(&TickRecord::from(&sent)).unwrap();
        assert_eq!((received.estimate, received.innovation), (sent.estimate, Some(innovation)));
        assert_eq!(
            (received.health, received.asked, received.applied),
            (sent.health, sent.command, sent.applied)
        );
        assert_eq!((received.phase, received.since), (PhaseRecord::Brake, Some(Time::from_nanos(4_000_000))));
        assert_eq!(received.task.word(), "Brake");
    }

    /// The same of a rate: what is asked of the rotor while it follows, and a word once the drive is off for good.
    #[test]
    fn exact_a_report_of_a_rate_comes_back() {
        let TickReport { estimate, health, camera, command, applied, .. } = report(None);
        let reference = Some(Angle::from_degrees(-2.5));
        let since = Time::from_nanos(4_500_000);
        let sent = RateReport {
            estimate,
            health,
            camera,
            command,
            applied,
            wanted_rad_s: -1.25,
            reference,
            since,
            stopped: None,
        };
        let received = |report: &RateReport| Reported::of(&TickRecord::from(report)).unwrap();
        let following = received(&sent);
        assert_eq!(following.task, Task::Rate { wanted_rad_s: -1.25, reference, stopped: None });
        assert_eq!((following.estimate, following.since), (estimate, Some(since)));
        for (why, word) in [
            (RateStop::Stuck, "Stopped(Stuck)"),
            (RateStop::WrongWay, "Stopped(WrongWay)"),
            (RateStop::EndOfTravel, "Stopped(EndOfTravel)"),
            (RateStop::DrivenTooLong, "Stopped(DrivenTooLong)"),
            (RateStop::NoEstimate, "Stopped(NoEstimate)"),
        ] {
            let stopped = received(&RateReport { stopped: Some(why), ..sent });
            assert_eq!(stopped.phase, PhaseRecord::Rate(RatePhase::Stopped(why)));
            assert_eq!(stopped.task.word(), word);
        }
    }

    /// Every frame is in one record, in order; that which the report tells of has the innovation.
    #[test]
    fn exact_frames_stand_once_and_times_count_from_arming() {
        let mut records = ReportRecords::new(Time::from_nanos(1_000_000));
        let frame = |nanos| CameraFrame::new(Time::from_nanos(nanos), Angle::from_units(nanos.cast_signed()));
        for nanos in [2_000_000, 3_000_000, 4_000_000] {
            records.sent(frame(nanos));
        }
        let taken_at = Time::from_nanos(3_000_000);
        let innovation = Innovation {
            source: Source::Camera,
            taken_at,
            innovation_rad: 0.0,
            variance_rad2: 1.0,
            verdict: Verdict::Used,
        };
        let told = Reported::of(&TickRecord::from(&report(Some(innovation)))).unwrap();
        let mut seen = Vec::new();
        records.report(Time::from_nanos(5_000_000), &told, None, &[], |record| {
            seen.push((
                record.at.nanos(),
                record.camera_frame.map(|frame| frame.exposed_at.nanos()),
                record.innovation.map(|innovation| innovation.taken_at.nanos()),
                record.estimate.map(|estimate| estimate.at.nanos()),
            ));
        });
        assert_eq!(
            seen,
            [
                (4_000_000, Some(1_000_000), None, None),
                (4_000_000, Some(3_000_000), None, None),
                (4_000_000, Some(2_000_000), Some(2_000_000), Some(4_000_000)),
            ]
        );
        let untold = Reported::of(&TickRecord::from(&report(None))).unwrap();
        let mut frames = Vec::new();
        records.report(Time::from_nanos(6_000_000), &untold, None, &[], |record| {
            frames.push(record.camera_frame);
        });
        assert_eq!(frames, [None]);
    }
}
