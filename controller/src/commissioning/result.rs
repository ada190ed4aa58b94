//! What commissioning gives out: the motor's map with what was found, or why the motor is not fit for use.

use core::fmt;

use estimator::ResonanceOffset;
use motor_model::DriveMode;

use super::Commissioning;
use super::commissioned_map::commissioned_map;
use super::evidence::CommissioningEvidence;
use super::experimenter::LOST_MAX;
use super::findings::{FindingKind, Findings};
use super::map_factors::{MapFactors, Measured};
use super::resonance::Resonance;
use crate::map_correction::{LearntFactors, MapCorrection};
use crate::move_forecast::MoveForecast;
use crate::response_map::{Family, MapError, ResponseMap};
use crate::target::Limits;

/// Move in rad by which the fitness is judged, either way: a quarter turn.
const MOVE_RAD: f32 = core::f32::consts::FRAC_PI_2;
/// Its tolerance in rad: a tenth of a degree, so that the instruments do not count.
const TOLERANCE_RAD: f32 = 1.745e-3;

/// How commissioning ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CommissioningEnd {
    /// Another measurement would save next to nothing.
    Enough,
    /// The time was over.
    TimeOver,
    /// There was no usable estimate for too long, or too often.
    NoEstimate,
    /// The rotor did not come to rest with the drive off.
    NeverRests,
    /// A drive led out of the travel.
    EndOfTravel,
}

/// Why a motor is not fit for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unfit {
    /// It was not measured: there was no usable estimate for too long.
    NoEstimate,
    /// It was not measured: the estimate was lost in one drive after the other, or in most of a mode that seems dead.
    LostWhenDriven {
        /// The mode of the last of them, or that mode.
        mode: DriveMode,
    },
    /// It does not come to rest with the drive off.
    NeverRests,
    /// The time was over before any drive was measured.
    NotMeasured,
    /// The travel ended before any drive was measured.
    NoTravel,
    /// A mode turns it in the direction of the other.
    OtherWay {
        /// The mode.
        mode: DriveMode,
    },
    /// Neither mode turns it.
    NothingTurns,
    /// Mode C makes no fine step, without which no target is approached.
    NoSteps {
        /// What was found of the mode, if a test tells it.
        why: Option<FindingKind>,
    },
    /// By its drives a quarter turn ends in time neither way.
    TooSlow,
    /// Its rows make no map.
    NoMap(MapError),
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoEstimate => f.write_str("the instruments gave no usable estimate of the driven rotor"),
            Self::LostWhenDriven { mode } => write!(
                f,
                "mode {mode:?} turns the rotor as no estimate follows: it is lost in one drive after the other"
            ),
            Self::NeverRests => f.write_str("the rotor does not come to rest within 3 s with the drive off"),
            Self::NotMeasured => f.write_str("the time was over before any drive was measured"),
            Self::NoTravel => f.write_str("the end of the travel was reached before any drive was measured"),
            Self::OtherWay { mode: DriveMode::B } => f.write_str("mode B turns the rotor counter-clockwise"),
            Self::OtherWay { mode: DriveMode::C } => f.write_str("mode C turns the rotor clockwise"),
            Self::NothingTurns => f.write_str("neither mode turns the rotor"),
            Self::NoSteps { why: Some(FindingKind::Dead) } => {
                f.write_str("mode C is dead: without its fine steps no target is approached")
            }
            Self::NoSteps { why: Some(FindingKind::OtherWay) } => f.write_str(
                "mode C turns the rotor clockwise: without its fine steps no target is approached",
            ),
            Self::NoSteps { .. } => f.write_str(
                "mode C makes no fine step that turns the rotor for certain, so no target is approached",
            ),
            Self::TooSlow => f.write_str("a quarter turn takes it longer than 60 s either way"),
            Self::NoMap(error) => write!(f, "its drives make no map: {error}"),
        }
    }
}

impl core::error::Error for Unfit {}

/// A motor that was commissioned.
#[derive(Clone, Copy, Debug)]
pub struct Commissioned {
    /// Its map; or why it is not fit for use.
    pub map: Result<ResponseMap, Unfit>,
    /// How it ended.
    pub end: CommissioningEnd,
    /// Motor time in s.
    pub time_s: f32,
    /// The resonances of modes B and C; `None` of one that no sweep has shown.
    pub resonances: [Option<Resonance>; 2],
    /// What the prior's authors did not foresee.
    pub findings: Findings,
    /// The factors on the prior map.
    pub factors: MapFactors,
    /// What was measured.
    pub evidence: CommissioningEvidence,
}

impl Commissioning {
    /// What has come of it after `time_s` of motor time, in units of the rows of `prior`, when it ends with `end`.
    pub fn result(&self, prior: &ResponseMap, end: CommissioningEnd, time_s: f32) -> Commissioned {
        let findings = Findings::of(prior, &self.evidence);
        Commissioned {
            map: self.fit_map(prior, end, &findings),
            end,
            time_s,
            resonances: self.resonances,
            findings,
            factors: Measured { map: prior, evidence: &self.evidence }.factors(),
            evidence: self.evidence,
        }
    }

    /// Whether all cruises of `mode` that were driven lose the estimate.
    fn loses_all(&self, prior: &ResponseMap, mode: DriveMode) -> bool {
        let of_mode = prior.cruises().iter().enumerate().filter(|(_, cruise)| cruise.mode == mode);
        let found = of_mode.map(|(index, _)| self.evidence.cruise(index));
        let mut driven = found.filter(|found| found.runs.saturating_add(found.unseen) > 0).peekable();
        driven.peek().is_some() && driven.all(|found| found.is_lost())
    }

    fn fit_map(
        &self,
        prior: &ResponseMap,
        end: CommissioningEnd,
        findings: &Findings,
    ) -> Result<ResponseMap, Unfit> {
        if let Some(finding) = findings.iter().find(|finding| finding.kind == FindingKind::OtherWay) {
            return Err(Unfit::OtherWay { mode: finding.mode });
        }
        match end {
            CommissioningEnd::NoEstimate => {
                let (lost, mode) = self.lost;
                return Err(if lost >= LOST_MAX {
                    Unfit::LostWhenDriven { mode }
                } else {
                    Unfit::NoEstimate
                });
            }
            CommissioningEnd::NeverRests => return Err(Unfit::NeverRests),
            CommissioningEnd::TimeOver if self.evidence.rows_measured() == 0 => {
                return Err(Unfit::NotMeasured);
            }
            CommissioningEnd::EndOfTravel if self.evidence.rows_measured() == 0 => {
                return Err(Unfit::NoTravel);
            }
            CommissioningEnd::TimeOver | CommissioningEnd::EndOfTravel | CommissioningEnd::Enough => (),
        }
        // The other mode may seem dead too, by windows in which the rotor stuck.
        let lost = || [DriveMode::B, DriveMode::C].into_iter().find(|mode| self.loses_all(prior, *mode));
        if let Some(mode) = findings.dead_by_losses().or_else(lost) {
            return Err(Unfit::LostWhenDriven { mode });
        }
        if findings.iter().filter(|finding| finding.kind == FindingKind::Dead).count() == 2 {
            return Err(Unfit::NothingTurns);
        }
        let mut map = commissioned_map(prior, &self.evidence).map_err(Unfit::NoMap)?;
        let resonances = [DriveMode::B, DriveMode::C].map(|mode| self.resonance_offset(mode));
        if resonances != [ResonanceOffset::NONE; 2] {
            let factors = LearntFactors::new(&MapCorrection::of(&map), resonances);
            map.set_learnt(factors).map_err(Unfit::NoMap)?;
        }
        if !findings.is_of_use(DriveMode::C) || map.bursts(Family::Step).is_empty() {
            let why =
                findings.iter().find(|finding| finding.mode == DriveMode::C).map(|finding| finding.kind);
            return Err(Unfit::NoSteps { why });
        }
        let limits = Limits { amplitude_max: Self::AMPLITUDE_MAX, ..Limits::default() };
        let in_time = |distance_rad| {
            MoveForecast::try_new(&self.instruments, &map, &limits, distance_rad, TOLERANCE_RAD).is_ok()
        };
        if in_time(MOVE_RAD) || in_time(-MOVE_RAD) { Ok(map) } else { Err(Unfit::TooSlow) }
    }
}
