//! The stator of the true motor without its rotor, and a vibrometer on one of its teeth.
//!
//! The tooth is of the first pair. Its amplitude has the variation of this run, as it would have under a rotor. The
//! coil drives modes B and C alone, so that mode A stays at rest.

use controller::TICK_NANOS;
use estimator::LdvSample;
use motor_model::{AmplitudeVariation, DriveCommand, Stator, StatorState, Time};

use crate::math::count::real;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::faults::FaultKind;
use crate::scene::{Scene, SceneError};
use crate::world::instruments::{self, Ldv};
use crate::world::plant::Plant;
use crate::world::rig::tick_steps;
use crate::world::rotor_path::{RotorPath, RotorPoint};

/// A stator without a rotor, and the vibrometer.
#[derive(Clone, Debug)]
pub struct BareStator {
    stator: Stator<f64>,
    state: StatorState<f64>,
    /// Amplitude of the tooth per that of the design.
    tooth: f64,
    tick_steps: u64,
    steps: u64,
    step_nanos: f64,
    seen: RotorPoint,
    ldv: Ldv,
}

impl BareStator {
    /// The stator of the motor that the scene's seed names, at rest.
    ///
    /// # Errors
    /// When the model refuses the motor, or the scene sets what a stator without a rotor does not have.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        refuse_what_is_not_there(scene)?;
        instruments::check(scene)?;
        let step_s = scene.number("plant.step_s");
        let plant = Plant::draw(scene)?;
        let mut variation = random_streams::stream(scene.seed(), RandomSource::AmplitudeVariation);
        let [first, _] = AmplitudeVariation::draw(plant.params(), &mut variation).pairs;
        Ok(Self {
            stator: Stator::try_new(plant.params(), plant.tuning(), step_s)?,
            state: StatorState::default(),
            tooth: 1.0 + first,
            tick_steps: tick_steps(step_s)?,
            steps: 0,
            step_nanos: 1e9 * step_s,
            seen: RotorPoint::default(),
            ldv: Ldv::new(scene),
        })
    }

    /// A tick of the loop under `command`; its end.
    pub fn tick(&mut self, command: DriveCommand) -> Time {
        for _ in 0..self.tick_steps {
            self.stator.step(&mut self.state, command);
            self.steps += 1;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "2^53 ns are months")]
            let at = Time::from_nanos((real(self.steps) * self.step_nanos).round() as u64);
            let [tooth, _] = self.stator.teeth();
            let velocity_m_s = self.tooth * tooth.vertical_velocity(&self.state.modes);
            let until = RotorPoint { at, velocity_m_s, ..RotorPoint::default() };
            self.ldv.follow(&RotorPath { from: self.seen, until, struck: false });
            self.seen = until;
        }
        Time::from_nanos(self.steps / self.tick_steps * TICK_NANOS)
    }

    /// The oldest vibrometer sample not yet read.
    pub fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.read()
    }
}

/// There is no rotor for a camera to look at, and the faults of the motor are those of a whole one.
fn refuse_what_is_not_there(scene: &Scene) -> Result<(), SceneError> {
    let refused = |what: &str| SceneError::NotRead {
        refusal: format!("record.model = stator does not use {what}"),
        hint: "record.model=motor uses it".to_owned(),
    };
    let of_rotor = |key: &&str| ["camera.", "fault."].iter().any(|table| key.starts_with(table));
    if let Some(key) = scene.keys_set().find(of_rotor) {
        return Err(refused(key));
    }
    let faults = scene.faults();
    match faults.iter().find(|fault| !matches!(fault.kind, FaultKind::Vibrometer(_))) {
        Some(fault) => Err(refused(&fault.to_string())),
        None => Ok(()),
    }
}
