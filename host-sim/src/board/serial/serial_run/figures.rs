//! What is told of an armed run: in its middle, and when it has ended.

use controller::map_correction::LearntFactors;
use motor_model::{DriveCommand, Time};

use super::super::clock_bound::bound_nanos;
use super::super::host_clock::{host_nanos, seconds};
use super::super::outcome::{ClockFigures, CounterFigures, LineFigures, SerialOutcome, SessionFigures};
use super::super::plant::PlantInTheLoop;
use super::super::progress::Progress;
use super::super::report_record::sd_deg;
use super::ArmedRun;
use simulation::runs::record::mode_word;

impl ArmedRun {
    /// What is known in the middle of the run; the load of the line is that of the last `seconds_since`.
    pub(super) fn progress(&mut self, seconds_since: f64) -> Progress {
        let baud = self.session.baud();
        let load = [0, 1].map(|way| self.session.load[way].read(seconds_since, baud));
        let last = self.last.as_ref();
        let reported = last.map(|(_, reported)| reported);
        let applied = reported.map_or(DriveCommand::OFF, |reported| reported.applied);
        let estimate = reported.and_then(|reported| reported.estimate);
        let now = host_nanos();
        Progress {
            at_s: last.map_or(0.0, |(at, _)| self.records.since_begin(*at).seconds_since(Time::ZERO)),
            angle_deg: estimate.map(|estimate| (estimate.angle.degrees(), sd_deg(estimate.angle_rad2))),
            goal: self.task.goal(),
            phase: reported.map_or_else(|| "armed".to_owned(), |reported| reported.task.word().into_owned()),
            health: reported
                .map_or_else(|| "not known".to_owned(), |reported| format!("{:?}", reported.health)),
            drive: (mode_word(applied), applied.amplitude()),
            reports: self.reports,
            load,
            clock_us: self.session.clock().map(|clock| 1e-3 * bound_nanos(&clock, now)),
            clock_told_us: self.description.clock_error_us,
        }
    }

    /// What became of the run.
    pub(super) fn outcome(
        mut self,
        host_s: f64,
        stop_acknowledged: bool,
        learnt: Option<LearntFactors>,
    ) -> SerialOutcome {
        let (at, reported) = self.last.map_or((None, None), |(at, reported)| (Some(at), Some(reported)));
        let truth = self.plant.as_ref().and_then(PlantInTheLoop::truth).map(|truth| truth.since(self.zero));
        let counters = self.session.counters();
        let now = host_nanos();
        let clock = self.session.clock().zip(self.session.shortest_nanos());
        let baud = self.session.baud();
        let [to, from] = self.session.load.map(|load| load.mean(host_s, baud));
        let session = SessionFigures {
            duration_s: at.map_or(0.0, |at| self.records.since_begin(at).seconds_since(Time::ZERO)),
            host_s,
            stop_acknowledged,
            board: self.identity,
            description: self.description,
            clock: clock.map(|(clock, shortest)| ClockFigures {
                uncertainty_us: 1e-3 * bound_nanos(&clock, now),
                drift_ppm: clock.drift().map(|drift| 1e6 * drift),
                drift_uncertainty_ppm: clock.drift_uncertainty().map(|bound| 1e6 * bound),
                round_trip_us: 1e6 * seconds(shortest),
            }),
            line: LineFigures {
                baud,
                load_to_board: to,
                load_from_board: from,
                frames_sent: self.frames_sent,
                frame_bytes: self.frame_bytes,
                frames_early: self.frames_early,
                frames_old: self.frames.left_out,
                reports: self.reports,
                lost_from_board: self.session.lost,
            },
            counters: counters.map(CounterFigures::from),
        };
        SerialOutcome { task: self.task.figures(reported.as_ref(), truth), session, learnt }
    }
}
