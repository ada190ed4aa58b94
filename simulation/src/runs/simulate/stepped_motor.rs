//! The motors that the open loop steps, in either precision: with a rotor that moves up and down, or with one that
//! tilts.

use motor_model::{
    DriveCommand, Impacts, Motor, MotorState, Real, RotorState, TiltingContacts, TiltingMotor, TiltingState,
};

use super::{FAST_APPROACH_M_S, MotorSample, OpenLoopRun};
use crate::runs::RunError;
use crate::world::pose::Pose;

/// Contacts of a step that approached faster than [`FAST_APPROACH_M_S`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FastContacts {
    /// With teeth.
    pub(super) teeth: u64,
    /// Of the hole's edges with the pin.
    pub(super) hub: u64,
}

/// A motor with its state.
pub(super) trait SteppedMotor<T: Real> {
    /// One step.
    fn step(&mut self, drive: DriveCommand) -> FastContacts;

    /// Steps taken.
    fn steps(&self) -> u64;

    /// Length of a step in s.
    fn step_s(&self) -> f64;

    /// Height, angle and their rates.
    fn rotor(&self) -> &RotorState<T>;

    /// Shift of its mass centre, and tilt; `None` of a rotor that has neither.
    fn pose(&self) -> Option<Pose>;

    /// Heights of the first two teeth, which stand for both pairs.
    fn tooth_heights_m(&self) -> [f64; 2];

    /// The motion at present.
    #[expect(clippy::cast_precision_loss, reason = "step counts stay below 2^53")]
    fn sample(&self, drive: DriveCommand) -> MotorSample {
        let rotor = self.rotor();
        MotorSample {
            time_s: self.steps() as f64 * self.step_s(),
            height_m: rotor.height_m.to_f64(),
            velocity_m_s: rotor.velocity_m_s.to_f64(),
            angle_deg: rotor.angle.angle().degrees(),
            rate_rad_s: rotor.rate_rad_s.to_f64(),
            tooth_heights_m: self.tooth_heights_m(),
            pose: self.pose(),
            drive,
        }
    }
}

/// The height-only motor.
pub(super) struct HeightOnlyMotor<T: Real> {
    motor: Motor<T>,
    state: MotorState<T>,
}

impl<T: Real> HeightOnlyMotor<T> {
    /// That of a run, at rest.
    pub(super) fn new(run: &OpenLoopRun) -> Result<Self, RunError> {
        Ok(Self { motor: Motor::try_new(&run.params, &run.setup())?, state: MotorState::default() })
    }
}

impl<T: Real> SteppedMotor<T> for HeightOnlyMotor<T> {
    #[inline]
    fn step(&mut self, drive: DriveCommand) -> FastContacts {
        let impacts: Impacts<T> = self.motor.step(&mut self.state, drive);
        let fast_approach = T::from_f64(FAST_APPROACH_M_S);
        let fast = impacts.iter().map(|impact| u64::from(impact.approach_m_s > fast_approach));
        FastContacts { teeth: fast.sum(), hub: 0 }
    }

    fn steps(&self) -> u64 {
        self.state.steps
    }

    fn step_s(&self) -> f64 {
        self.motor.step_s()
    }

    fn rotor(&self) -> &RotorState<T> {
        &self.state.rotor
    }

    fn pose(&self) -> Option<Pose> {
        None
    }

    fn tooth_heights_m(&self) -> [f64; 2] {
        self.motor.teeth().each_ref().map(|pair| pair.height(&self.state.modes).to_f64())
    }
}

/// The tilting motor.
pub(super) struct TiltingSteppedMotor<T: Real> {
    motor: TiltingMotor<T>,
    state: TiltingState<T>,
}

impl<T: Real> TiltingSteppedMotor<T> {
    /// That of a run, at rest.
    pub(super) fn new(run: &OpenLoopRun) -> Result<Self, RunError> {
        let motor = TiltingMotor::try_new(&run.params, &run.tilting, &run.tilting_setup())?;
        Ok(Self { motor, state: TiltingState::default() })
    }
}

impl<T: Real> SteppedMotor<T> for TiltingSteppedMotor<T> {
    #[inline]
    fn step(&mut self, drive: DriveCommand) -> FastContacts {
        let contacts: TiltingContacts<T> = self.motor.step(&mut self.state, drive);
        let mut fast = FastContacts::default();
        let fast_approach = T::from_f64(FAST_APPROACH_M_S);
        for contact in
            contacts.iter().filter(|contact| !contact.sustained && contact.approach_m_s > fast_approach)
        {
            fast.teeth += u64::from(contact.place.is_tooth());
            fast.hub += u64::from(contact.place.is_hub());
        }
        fast
    }

    fn steps(&self) -> u64 {
        self.state.steps
    }

    fn step_s(&self) -> f64 {
        self.motor.step_s()
    }

    fn rotor(&self) -> &RotorState<T> {
        &self.state.rotor
    }

    fn pose(&self) -> Option<Pose> {
        Some(Pose::of_tilting(&self.state, 0.0))
    }

    fn tooth_heights_m(&self) -> [f64; 2] {
        let TiltingState { modes, stator_tilt, .. } = &self.state;
        let [first, second, ..] = self.motor.teeth();
        [first, second].map(|tooth| tooth.height(modes, stator_tilt).to_f64())
    }
}
