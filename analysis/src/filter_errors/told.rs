//! What a filter is told of the truth: partial genies. The twin is told parts ([`estimator::ToldParts`]),
//! `impact_aided` the sign of each kick.
//!
//! The truth is that of the plant, step by step. What no impact of a tooth explains of a step's change of the rate, as
//! a sustained contact or the hub, is a contact without a tooth at the end of the step.

use estimator::{
    AngleFilter, CameraFrame, CheckedMotor, FilterKind, ImpactAided, ImpactAidedTuning, LdvSample,
    SignedKick, ToldParts, TrueContact, TrueTooth, TwinFilter, TwinTuning,
};
use motor_model::{Parameter, Time};
use serde::{Deserialize, Serialize};
use simulation::runs::RunError;
use simulation::scene::{Scene, SceneError};
use simulation::world::instruments::assumed;
use simulation::world::plant::{Plant, ToothImpact};
use simulation::world::rig::PlantStep;

use super::phase_sums::{PhaseSums, add_innovation};
use super::timeline::TimelinePhase;

/// Change of the rate in a step, in rad/s, from which on it is told: below it is drag and rounding.
const LEAST_KICK_RAD_S: f64 = 1e-9;

/// A part of the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ToldPart {
    /// The tangential velocity of the tooth at each impact.
    ToothVelocity,
    /// When each impact was between two samples of the vibrometer.
    Instant,
    /// The rotor's vertical velocity before each impact, and its jump.
    Jump,
    /// Which pair of teeth struck, or that none did.
    Pair,
    /// The friction.
    Friction,
    /// Kick and recoil of the impacts that the vibrometer does not detect.
    SmallImpacts,
    /// The sign of each kick, to `impact_aided`, which has no other part that could be told.
    KickSign,
}

/// Several of them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToldSet(Vec<ToldPart>);

impl ToldPart {
    /// Those that a twin is told.
    pub const OF_TWIN: [Self; 6] =
        [Self::ToothVelocity, Self::Instant, Self::Jump, Self::Pair, Self::Friction, Self::SmallImpacts];

    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::ToothVelocity,
        Self::Instant,
        Self::Jump,
        Self::Pair,
        Self::Friction,
        Self::SmallImpacts,
        Self::KickSign,
    ];

    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Self::ToothVelocity => "tooth-velocity",
            Self::Instant => "instant",
            Self::Jump => "jump",
            Self::Pair => "pair",
            Self::Friction => "friction",
            Self::SmallImpacts => "small-impacts",
            Self::KickSign => "kick-sign",
        }
    }

    /// What it tells, for a user.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::ToothVelocity => "The tangential velocity of the tooth at each impact",
            Self::Instant => "When each impact was between two samples of the vibrometer",
            Self::Jump => "The rotor's vertical velocity before each impact, and its jump",
            Self::Pair => "Which pair of teeth struck, or that none did",
            Self::Friction => "The friction",
            Self::SmallImpacts => "Kick and recoil of the impacts that the vibrometer does not detect",
            Self::KickSign => "The sign of each kick, to impact_aided instead of the twin",
        }
    }
}

impl ToldSet {
    /// Of the twin each of `parts` alone, then all but each, then all; then that of `impact_aided`.
    pub fn of_budget(parts: &[ToldPart]) -> Vec<Self> {
        let mut distinct: Vec<ToldPart> = Vec::new();
        for part in parts {
            if !distinct.contains(part) {
                distinct.push(*part);
            }
        }
        let of_other = distinct.iter().position(|part| *part == ToldPart::KickSign);
        let of_other = of_other.map(|place| Self(vec![distinct.remove(place)]));
        let singly = distinct.iter().map(|&part| Self(vec![part]));
        let without =
            |left_out: &ToldPart| Self(distinct.iter().copied().filter(|part| part != left_out).collect());
        let mut sets: Vec<Self> = singly.collect();
        if distinct.len() > 2 {
            sets.extend(distinct.iter().map(without));
        }
        if distinct.len() > 1 {
            sets.push(Self(distinct));
        }
        sets.extend(of_other);
        sets
    }

    /// The words, joined by `+`.
    pub fn name(&self) -> String {
        let words: Vec<&str> = self.0.iter().map(|part| part.name()).collect();
        words.join("+")
    }

    /// The filter that is told them.
    pub fn filter(&self) -> &'static str {
        if self.0.contains(&ToldPart::KickSign) { "impact_aided" } else { "twin" }
    }

    /// The same for the twin.
    fn parts(&self) -> ToldParts {
        let has = |part| self.0.contains(&part);
        ToldParts {
            tooth_velocity: has(ToldPart::ToothVelocity),
            instant: has(ToldPart::Instant),
            jump: has(ToldPart::Jump),
            pair: has(ToldPart::Pair),
            friction: has(ToldPart::Friction),
            small_impacts: has(ToldPart::SmallImpacts),
        }
    }
}

/// Refuses a scene whose filters would be told nothing.
///
/// # Errors
/// When no vibrometer of the scene shows single impacts.
pub fn check(scene: &Scene) -> Result<(), SceneError> {
    if assumed(scene).best_filter() == FilterKind::Twin {
        return Ok(());
    }
    Err(SceneError::Conflict {
        conflict: "--told, and no vibrometer that shows single impacts: a filter then has none to be told of"
            .to_owned(),
        hint: "leave --told out, or see ldv.installed, ldv.noise_m_s and ldv.sample_rate_hz".to_owned(),
    })
}

/// A kick of a told sign, of friction that bounds four of five: the slip is uniform up to five times what friction
/// stops, so that the mean is 0.9 of the largest kick and the mean square 0.87.
const SIGNED_KICK: SignedKick<f32> = SignedKick { mean: 0.9, variance: 0.06 };

/// A filter that can be told something.
enum Tellable {
    Twin(Box<TwinFilter<f32>>),
    ImpactAided(Box<ImpactAided<f32>>),
}

/// A filter that is told parts of the truth, and its errors.
pub(super) struct ToldFilter {
    pub(super) set: ToldSet,
    filter: Tellable,
    pub(super) sums: PhaseSums,
}

impl ToldFilter {
    pub(super) fn new(set: &ToldSet, scene: &Scene) -> Result<Self, RunError> {
        let (design, instruments) = (scene.motor_params(), assumed(scene));
        let filter = if set.filter() == "twin" {
            let motor = CheckedMotor::try_new(&design)?;
            let twin = TwinFilter::new(&motor, &TwinTuning::new(&design, &instruments));
            Tellable::Twin(Box::new(twin.with_told(set.parts())))
        } else {
            let filter = ImpactAided::new(&ImpactAidedTuning::new(&design, &instruments));
            Tellable::ImpactAided(Box::new(filter.with_told_signs(SIGNED_KICK)))
        };
        Ok(Self { set: set.clone(), filter, sums: PhaseSums::default() })
    }

    pub(super) fn filter(&self) -> &dyn AngleFilter<f32> {
        match &self.filter {
            Tellable::Twin(filter) => filter.as_ref(),
            Tellable::ImpactAided(filter) => filter.as_ref(),
        }
    }

    pub(super) fn filter_mut(&mut self) -> &mut dyn AngleFilter<f32> {
        match &mut self.filter {
            Tellable::Twin(filter) => filter.as_mut(),
            Tellable::ImpactAided(filter) => filter.as_mut(),
        }
    }

    /// Tells what truly happened.
    pub(super) fn tell(&mut self, contact: &TrueContact<f32>) {
        match &mut self.filter {
            Tellable::Twin(filter) => filter.tell(contact),
            Tellable::ImpactAided(filter) => filter.tell(contact),
        }
    }

    /// Takes in what has arrived.
    pub(super) fn take(
        &mut self,
        samples: &[LdvSample],
        frames: &[CameraFrame],
        phase: Option<TimelinePhase>,
    ) {
        for sample in samples {
            if let (Some(innovation), Some(phase)) = (self.filter_mut().update_ldv(sample), phase) {
                self.sums[phase as usize].impact(&innovation);
            }
        }
        for frame in frames {
            let innovation = self.filter_mut().update_camera(frame);
            add_innovation(&mut self.sums, phase, &innovation);
        }
    }
}

/// What truly happened in a step, in the order of time, after which `plant` is as it is.
pub(super) fn contacts_of(step: &PlantStep, plant: &Plant) -> Vec<TrueContact<f32>> {
    let (before, after) = (&step.before, &step.after);
    if !step.touched || before.rate_rad_s.to_bits() == after.rate_rad_s.to_bits() {
        return Vec::new();
    }
    let impacts = plant.tooth_impacts();
    let step_s: f64 = after.at.seconds_since(before.at);
    let mut velocity_m_s = before.velocity_m_s;
    let mut rest_rad_s = after.rate_rad_s - before.rate_rad_s;
    let mut contacts: Vec<TrueContact<f32>> = (0_u64..)
        .zip(&impacts)
        .map(|(place, impact)| {
            let at = before_end(after.at, impact.before_end_s, impacts.len() as u64 - place);
            let contact = of_tooth(at, velocity_m_s, impact);
            velocity_m_s += impact.jump_m_s;
            rest_rad_s -= impact.kick_rad_s;
            contact
        })
        .collect();
    if rest_rad_s.abs() > LEAST_KICK_RAD_S {
        let free_m_s = velocity_m_s - plant.params().get(Parameter::Gravity) * step_s;
        contacts.push(TrueContact {
            at: after.at,
            tooth: None,
            before_m_s: single(velocity_m_s),
            jump_m_s: single(after.velocity_m_s - free_m_s),
            kick_rad_s: single(rest_rad_s),
        });
    }
    contacts
}

fn of_tooth(at: Time, before_m_s: f64, impact: &ToothImpact) -> TrueContact<f32> {
    let tooth = TrueTooth {
        pair: impact.pair,
        rate_rad_s: single(impact.tooth_rate_rad_s),
        kick_per_jump_rad_m: single(impact.kick_per_jump_rad_m),
    };
    TrueContact {
        at,
        tooth: Some(tooth),
        before_m_s: single(before_m_s),
        jump_m_s: single(impact.jump_m_s),
        kick_rad_s: single(impact.kick_rad_s),
    }
}

/// The instant `before_end_s` before `end`, and at least `apart` ns before it: contacts at one instant stay in their
/// order.
fn before_end(end: Time, before_end_s: f64, apart: u64) -> Time {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within a step")]
    let nanos = (1e9 * before_end_s).round() as u64;
    Time::from_nanos(end.nanos().saturating_sub(nanos.max(apart)))
}

#[expect(clippy::cast_possible_truncation, reason = "the filter's precision")]
fn single(x: f64) -> f32 {
    x as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::{DriveCommand, DriveMode};
    use simulation::world::rig::Rig;

    #[test]
    fn exact_a_budget_tells_each_part_all_but_each_and_all() {
        use ToldPart::{Instant, Jump, Pair};
        let names = |parts: &[ToldPart]| -> Vec<String> {
            ToldSet::of_budget(parts).iter().map(ToldSet::name).collect()
        };
        assert_eq!(names(&[Jump, Jump]), ["jump"]);
        assert_eq!(names(&[Jump, Pair]), ["jump", "pair", "jump+pair"]);
        let expected =
            ["jump", "pair", "instant", "pair+instant", "jump+instant", "jump+pair", "jump+pair+instant"];
        assert_eq!(names(&[Jump, Pair, Instant]), expected);
        assert!(names(&[]).is_empty());
        // Told to another filter, and never with the twin's.
        assert_eq!(names(&[ToldPart::KickSign, Jump, Pair]), ["jump", "pair", "jump+pair", "kick-sign"]);
        let filters: Vec<_> = ToldSet::of_budget(&ToldPart::ALL).iter().map(ToldSet::filter).collect();
        assert_eq!(filters.iter().filter(|filter| **filter == "twin").count(), 13);
        assert_eq!(filters.last(), Some(&"impact_aided"));
    }

    /// Of both rotors, in both modes: the contacts of a step are in the order of time and within it, their kicks add up
    /// to its change of the rate, and a tooth gives the kick of friction, `clamp(S - rate, -c dv, c dv)`.
    #[test]
    fn law_the_contacts_are_the_whole_change_of_the_rate() {
        for (rotor, mode) in [
            ("height_only", DriveMode::B),
            ("height_only", DriveMode::C),
            ("tilting", DriveMode::B),
            ("tilting", DriveMode::C),
        ] {
            let scene = Scene::of_sets(&[format!("plant.rotor={rotor}")]).unwrap();
            let mut rig = Rig::new(&scene).unwrap();
            let (mut teeth, mut told_rad_s) = (0, 0.0);
            for _ in 0..10_000 {
                rig.tick_in_steps(DriveCommand::full(mode), &mut |step, plant| {
                    let contacts = contacts_of(step, plant);
                    let mut last = step.before.at;
                    let mut rate_rad_s = step.before.rate_rad_s;
                    for contact in &contacts {
                        assert!(contact.at >= last && contact.at <= step.after.at, "{step:?} {contact:?}");
                        last = contact.at;
                        let kick_rad_s = f64::from(contact.kick_rad_s);
                        if let Some(tooth) = contact.tooth {
                            let most_rad_s = f64::from(tooth.kick_per_jump_rad_m * contact.jump_m_s);
                            let law =
                                (f64::from(tooth.rate_rad_s) - rate_rad_s).clamp(-most_rad_s, most_rad_s);
                            // Single precision of a rate of tens of rad/s.
                            assert!((law - kick_rad_s).abs() < 1e-5, "{rotor} {law} {contact:?}");
                            teeth += 1;
                        }
                        rate_rad_s += kick_rad_s;
                        told_rad_s += kick_rad_s;
                    }
                    assert!((rate_rad_s - step.after.rate_rad_s).abs() < 1e-5, "{step:?} {contacts:?}");
                });
            }
            let turned_rad_s = rig.plant().rotor().rate_rad_s;
            assert!((told_rad_s - turned_rad_s).abs() < 1e-3, "{rotor}: {told_rad_s} {turned_rad_s}");
            assert!(teeth > 20, "{rotor}: {teeth}");
        }
    }

    #[test]
    fn exact_without_impacts_to_be_told_of_nothing_can_be_told() {
        let checked = |set: &str| check(&Scene::of_sets(&[set.to_owned()]).unwrap()).is_ok();
        assert!(checked("camera.marks=1"));
        assert!(!checked("ldv.installed=no") && !checked("ldv.noise_m_s=0.01"));
    }
}
