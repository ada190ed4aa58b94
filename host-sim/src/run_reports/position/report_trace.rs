//! What the report on a move shows beside its picture: innovations, health, phases, and some impacts up close.

use std::ops::ControlFlow;

use controller::{PositioningPhase, Wait};
use estimator::{Health, Innovation, LdvSample, Verdict};
use motor_model::{Time, math};

use simulation::runs::record::{Observer, RunRecord, Task};

/// Frames kept at most; of more, every second is removed.
const FRAMES_MAX: usize = 20_000;
/// Ticks that are kept of the impacts up close: 4 ms. They begin with the first impact that comes as long after the
/// first drive began, when the stator has its full amplitude, or with the first drive if it is shorter.
const CLOSE_TICKS: usize = 400;
/// More ticks are kept until there are so many impacts, [`APART_TICKS`] apart; 50 ms at most.
const CLOSE_IMPACTS: usize = 6;
const APART_TICKS: usize = 10;
const CLOSE_TICKS_MAX: usize = 5000;
/// Of normal innovations 4.6 % are larger.
const BOUND_SIGMAS: f64 = 2.0;

/// A frame of the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameInnovation {
    pub(crate) at_s: f64,
    /// Measurement less prediction.
    pub(crate) innovation_mdeg: f64,
    /// Standard deviation predicted for that.
    pub(crate) sigma_mdeg: f64,
    pub(crate) used: bool,
}

/// The rotor in a tick up close.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CloseTick {
    pub(crate) at_s: f64,
    pub(crate) rate_rad_s: f64,
    pub(crate) velocity_m_s: f64,
    pub(crate) driven: bool,
}

/// The course of a move for its report.
#[derive(Debug, Default)]
pub(crate) struct ReportTrace {
    pub(crate) frames: Vec<FrameInnovation>,
    frames_seen: u64,
    frames_per_kept: u64,
    pub(crate) rejected: u64,
    pub(crate) restarted: u64,
    /// Frames whose innovation was predicted, and those of them beyond two standard deviations.
    pub(crate) predicted: u64,
    pub(crate) beyond_2_sigma: u64,
    /// When the health changed, and what it changed to.
    pub(crate) healths: Vec<(f64, Health)>,
    /// The same of what the controller did.
    pub(crate) phases: Vec<(f64, &'static str)>,
    /// The ticks up close, and the vibrometer's samples, in m/s.
    pub(crate) close: Vec<CloseTick>,
    pub(crate) samples: Vec<(f64, f64)>,
    /// The impacts among these ticks, with the vertical velocity after each.
    pub(crate) impacts: Vec<(f64, f64)>,
    /// The last standard deviation of the angle that was reported.
    pub(crate) sigma_mdeg: Option<f64>,
    /// Ticks since the first drive began.
    driven_ticks: usize,
    /// Whether the ticks up close begin with the next impact.
    awaits_impact: bool,
    /// Impacts among them, and the place of the last one.
    close_impacts: usize,
    last_impact: Option<usize>,
}

impl Observer for ReportTrace {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        let at_s = record.at.seconds_since(Time::ZERO);
        if let Some(frame) = &record.innovation {
            self.take_frame(frame);
        }
        if self.healths.last().is_none_or(|(_, last)| *last != record.health) {
            self.healths.push((at_s, record.health));
        }
        if let Task::Position(phase) = record.task {
            let phase = phase_words(phase);
            if self.phases.last().is_none_or(|(_, last)| *last != phase) {
                self.phases.push((at_s, phase));
            }
        }
        self.take_close(at_s, record);
        if let Some(estimate) = &record.estimate {
            self.sigma_mdeg = Some(mdeg(math::sqrt(f64::from(estimate.angle_rad2))));
        }
        ControlFlow::Continue(())
    }
}

impl ReportTrace {
    fn take_close(&mut self, at_s: f64, record: &RunRecord) {
        let driven = record.applied.mode().is_some();
        if self.driven_ticks == 0 && !driven {
            return;
        }
        if self.driven_ticks == CLOSE_TICKS && driven {
            self.close.clear();
            self.samples.clear();
            self.impacts.clear();
            (self.close_impacts, self.last_impact) = (0, None);
            self.awaits_impact = true;
        }
        self.driven_ticks += 1;
        self.awaits_impact &= record.impacts.is_empty();
        let Some(truth) = record.truth.filter(|_| !self.awaits_impact && !self.has_all_close()) else {
            return;
        };
        let (rate_rad_s, velocity_m_s) = (truth.rate_rad_s, truth.velocity_m_s);
        if !record.impacts.is_empty() {
            let place = self.close.len();
            self.close_impacts +=
                usize::from(self.last_impact.is_none_or(|last| place - last >= APART_TICKS));
            self.last_impact = Some(place);
        }
        self.close.push(CloseTick { at_s, rate_rad_s, velocity_m_s, driven });
        let seconds = |at: Time| at.seconds_since(Time::ZERO);
        let sample = |sample: &LdvSample| (seconds(sample.taken_at), f64::from(sample.velocity_m_s));
        self.samples.extend(record.ldv_samples.iter().map(sample));
        self.impacts.extend(record.impacts.iter().map(|impact| (seconds(impact.at), impact.velocity_m_s[1])));
    }

    /// Whether enough ticks up close are kept.
    fn has_all_close(&self) -> bool {
        let ticks = self.close.len();
        ticks >= CLOSE_TICKS_MAX || ticks >= CLOSE_TICKS && self.close_impacts >= CLOSE_IMPACTS
    }

    fn take_frame(&mut self, frame: &Innovation<f32>) {
        self.rejected += u64::from(matches!(frame.verdict, Verdict::Rejected(_)));
        self.restarted += u64::from(frame.verdict == Verdict::Restarted);
        let Some(square) = frame.normalised_squared() else { return };
        self.predicted += 1;
        self.beyond_2_sigma += u64::from(f64::from(square) > BOUND_SIGMAS * BOUND_SIGMAS);
        self.frames_per_kept = self.frames_per_kept.max(1);
        if self.frames_seen.is_multiple_of(self.frames_per_kept) {
            if self.frames.len() == FRAMES_MAX {
                let mut index = 0;
                self.frames.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.frames_per_kept *= 2;
            }
            self.frames.push(FrameInnovation {
                at_s: frame.taken_at.seconds_since(Time::ZERO),
                innovation_mdeg: mdeg(f64::from(frame.innovation_rad)),
                sigma_mdeg: mdeg(math::sqrt(f64::from(frame.variance_rad2))),
                used: frame.verdict == Verdict::Used,
            });
        }
        self.frames_seen += 1;
    }
}

fn mdeg(rad: f64) -> f64 {
    1e3 * rad.to_degrees()
}

/// What the controller does in a phase.
const fn phase_words(phase: PositioningPhase) -> &'static str {
    match phase {
        PositioningPhase::Waiting(_) => "waiting for an estimate",
        PositioningPhase::Cruise { .. } => "cruise",
        PositioningPhase::Burst { .. } => "burst",
        PositioningPhase::Brake { .. } => "brake",
        PositioningPhase::Settling(Wait::Rest) => "waiting for rest",
        PositioningPhase::Settling(Wait::Turning) => "still turning",
        PositioningPhase::Settling(Wait::Measuring { .. }) => "measuring",
        PositioningPhase::Settling(Wait::MeasuringUnrested { .. }) => "measuring without rest",
        PositioningPhase::Holding => "holding",
        PositioningPhase::Stopped(_) => "given up",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::runs::position;
    use simulation::scene::Scene;

    /// The motion up close begins with an impact, and has several.
    #[test]
    fn exact_the_motion_up_close_begins_with_an_impact() {
        let sets = ["position.to_deg=37", "plant.rotor=tilting"].map(str::to_owned);
        let mut trace = ReportTrace::default();
        let run = position::run_with(&Scene::of_sets(&sets).unwrap(), |run, moment| {
            trace.observe(&run.record(moment))?;
            if trace.driven_ticks > CLOSE_TICKS && trace.has_all_close() {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        assert!(run.unwrap().is_break());
        let (first, impact) = (trace.close.first().unwrap(), trace.impacts.first().unwrap());
        assert!(first.driven && (0.0..1e-5).contains(&(first.at_s - impact.0)), "{first:?} {impact:?}");
        assert!(trace.close_impacts >= CLOSE_IMPACTS && trace.close.len() <= CLOSE_TICKS_MAX);
    }
}
