//! A second integrator of the same motor, to judge the fixed step by: event-driven, `f64`, to rounding.
//!
//! It shares parameters and geometry with `motor_model`, and no line of its step. In the order of the data:
//!
//! | module | what it is |
//! |---|---|
//! | [`series`] | power series in time, and where one first falls through zero, without a root missed |
//! | [`system`] | stator and rotor between two events, with no, one or two pairs of teeth in contact |
//! | [`contact`] | an instant of contact: impacts in sequence, the end of chattering, who stays |
//! | [`friction`] | the rotor's turning between two events: free, sliding, sticking |
//! | [`patience`] | ties within rounding |
//!
//! # How it goes
//!
//! 1. The motion is expanded in powers of time about the present, to order 20, over the time in which the fastest
//!    oscillation turns by
//!    one radian (20 us): the terms left out are below 1e-19 of those kept.
//! 2. The first event on it is found: a gap that closes, or a normal force that ends.
//! 3. The rotor's turning follows, with its own switchings; it does not act back on the rest.
//! 4. The state moves to the event, which [`contact`] resolves. A gap just opened is known to be zero: its series is
//!    divided by time, so
//!    that the contact just left is not found again and the next, however soon, is.
//!
//! An event is placed to some 1e-16 of a step plus rounding of the gap over its rate (1e-21 m over the approach): 1e-18 s
//! at 1 mm/s. Through chattering and
//! contact nothing is approximated but the end of the geometric series of impacts. The motor itself is chaotic: two of its
//! trajectories that differ in the last bit agree for a few dozen impacts, so beyond that only statistics can be compared.
//!
//! A drive command holds over one [`Reference::run`]; the phase runs on from one to the next and stands still while the
//! drive is off.

pub mod contact;
pub mod friction;
pub mod patience;
pub mod series;
pub mod system;

#[cfg(test)]
mod tests;

use motor_model::params::Parameter;
use motor_model::{
    AmplitudeVariation, Angle, AngleAccumulator, DriveCommand, DriveTuning, FrictionLaw, ModalState,
    MotorParams, MotorState, OutOfBounds, Phase, RotorState,
};

use contact::{Instant, TOUCH_M};
use friction::Turning;
use patience::{Patience, Stalled};
use system::{Contact, Drive, Segment, System, Vertical};

/// A motor for the reference integrator: immutable, one for any number of states.
///
/// ```
/// use host_sim::reference::{Reference, ReferenceState};
/// use motor_model::{AmplitudeVariation, DriveCommand, DriveMode, DriveTuning, FrictionLaw, MotorParams};
///
/// let reference = Reference::try_new(
///     &MotorParams::nominal(),
///     &AmplitudeVariation::default(),
///     FrictionLaw::Coulomb,
///     DriveTuning::Resonant,
/// )?;
/// let mut state = ReferenceState::default();
/// reference.run(&mut state, DriveCommand::full(DriveMode::C), 0.05, &mut ())?;
/// assert!(state.rate_rad_s < -0.3, "mode C turns counter-clockwise");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Reference {
    system: System,
    turning: Turning,
    restitution: f64,
}

/// Everything that changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceState {
    /// Time since the start.
    pub time_s: f64,
    /// The stator.
    pub modes: ModalState<f64>,
    /// Height of the rotor above the teeth at rest.
    pub height_m: f64,
    /// Vertical velocity of the rotor.
    pub velocity_m_s: f64,
    /// Angle turned, clockwise positive.
    pub angle_rad: f64,
    /// Angular rate.
    pub rate_rad_s: f64,
    /// Phase of the drive, in 0..1.
    pub phase_turns: f64,
    /// Pairs of teeth in lasting contact.
    pub contact: Contact,
    /// Multiplicity of the root that each gap has now: 1 after an impact, 2 or 3 after a contact, else 0.
    roots_at_start: [usize; 2],
}

/// Something that happens at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When.
    pub time_s: f64,
    /// Which pair of teeth.
    pub pair: usize,
    /// What.
    pub kind: EventKind,
}

/// What can happen at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind {
    /// Tooth strikes rotor.
    Impact {
        /// Speed of approach, `u' - v_z`.
        approach_m_s: f64,
        /// Normal impulse on the rotor.
        normal_impulse_n_s: f64,
        /// Slip before the impact.
        slip_m_s: f64,
        /// Tangential impulse on the rotor.
        tangential_impulse_n_s: f64,
    },
    /// Chattering is over and lasting contact begins.
    Capture,
    /// Lasting contact ends: the normal force has fallen to zero.
    Detach,
}

/// Watches a run.
pub trait Observer {
    /// The motion until the next event, of which the part from 0 to `end` of the segment happens, starting at `start`.
    fn segment(&mut self, _start: &ReferenceState, _segment: &Segment, _end: f64) {}
    /// An event, as it happens.
    fn event(&mut self, _event: &Event) {}
}

/// Watches nothing.
impl Observer for () {}

/// The first event of a segment.
enum Next {
    Strike,
    Release(usize),
    End,
}

impl Reference {
    /// A motor of these parameters.
    ///
    /// # Errors
    /// When mode A is damped beyond 0.99 of critical.
    pub fn try_new(
        params: &MotorParams,
        variation: &AmplitudeVariation,
        friction_law: FrictionLaw,
        tuning: DriveTuning,
    ) -> Result<Self, OutOfBounds> {
        let radius_m = params.get(Parameter::ToothRadius);
        let tangential_mass_kg = params.get(Parameter::RotorInertia) / (radius_m * radius_m);
        Ok(Self {
            system: System::try_new(params, variation, tuning)?,
            turning: Turning {
                radius_m,
                tangential_mass_kg,
                damping_per_s: params.get(Parameter::TangentialDrag) / tangential_mass_kg,
                friction: params.get(Parameter::Friction),
                law: friction_law,
            },
            restitution: params.get(Parameter::Restitution),
        })
    }

    /// Stator and rotor.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Runs `state` for `duration_s` under `command`.
    ///
    /// A rotor found inside a tooth is first put on it, as the fixed step does.
    ///
    /// # Errors
    /// When events pile up at one instant without end.
    pub fn run(
        &self,
        state: &mut ReferenceState,
        command: DriveCommand,
        duration_s: f64,
        observer: &mut impl Observer,
    ) -> Result<(), Stalled> {
        let drive = self.system.drive(command);
        let longest_s = 1.0 / self.system.fastest_rate_per_s(&drive).max(self.turning.damping_per_s);
        let instant = Instant {
            system: &self.system,
            turning: &self.turning,
            restitution: self.restitution,
            drive: &drive,
        };
        self.lift(state);
        // The drive may have changed: whoever is on a tooth is asked again whether it stays.
        let touching = self.touching(state);
        if touching != [false, false] {
            instant.settle(state, touching, observer);
        }

        let start_s = state.time_s;
        let mut elapsed_s = 0.0;
        let mut patience = Patience::default();
        while elapsed_s < duration_s {
            let remaining_s = duration_s - elapsed_s;
            let h = longest_s.min(remaining_s);
            let segment = self.system.expand(&state.vertical(), &drive, state.phase_turns, state.contact, h);
            let (end, next) = match patience.ignored() {
                Some(part) => (part, Next::End),
                None => self.next(state, &segment),
            };
            patience.take(end)?;
            observer.segment(state, &segment, end);
            let last = end >= 1.0 && h >= remaining_s;
            elapsed_s = if last { duration_s } else { elapsed_s + h * end };
            self.advance(state, &segment, end, &drive)?;
            state.time_s = start_s + elapsed_s;
            match next {
                Next::End => {}
                Next::Release(p) => {
                    state.contact[p] = false;
                    state.roots_at_start[p] = 3;
                    observer.event(&Event { time_s: state.time_s, pair: p, kind: EventKind::Detach });
                }
                Next::Strike => {
                    let touching = self.touching(state);
                    instant.settle(state, touching, observer);
                }
            }
        }
        Ok(())
    }

    /// The first event of `segment`.
    fn next(&self, state: &ReferenceState, segment: &Segment) -> (f64, Next) {
        let (mut end, mut next) = (1.0, Next::End);
        for p in 0..2 {
            let (watched, what) = if state.contact[p] {
                (segment.push_m_s2[p], Next::Release(p))
            } else {
                let gap = segment.gap(&self.system.teeth[p]);
                (gap.without_root_at_start(state.roots_at_start[p]), Next::Strike)
            };
            if let Some(tau) = watched.first_descent(end) {
                (end, next) = (tau, what);
            }
        }
        (end, next)
    }

    /// Moves `state` to `end` of `segment`.
    fn advance(
        &self,
        state: &mut ReferenceState,
        segment: &Segment,
        end: f64,
        drive: &Drive,
    ) -> Result<(), Stalled> {
        if end > 0.0 {
            let v = self.turning.radius_m * state.rate_rad_s;
            let (v, arc_m) = self.turning.over(&self.system, segment, end, v)?;
            state.rate_rad_s = v / self.turning.radius_m;
            state.angle_rad += arc_m / self.turning.radius_m;
            let turns = state.phase_turns + drive.frequency_hz * segment.duration_s * end;
            state.phase_turns = turns - turns.floor();
            let mut vertical = segment.at(end);
            self.system.project(&mut vertical, state.contact);
            state.set_vertical(&vertical);
            state.roots_at_start = [0; 2];
        }
        Ok(())
    }

    /// Pairs whose gap is zero.
    fn touching(&self, state: &ReferenceState) -> Contact {
        let vertical = state.vertical();
        [0, 1].map(|p| {
            state.contact[p] || state.roots_at_start[p] > 0 || self.system.gap_m(&vertical, p) <= TOUCH_M
        })
    }

    /// Raises a rotor that is inside a tooth by more than rounding.
    fn lift(&self, state: &mut ReferenceState) {
        let vertical = state.vertical();
        let lowest_m = self.system.gap_m(&vertical, 0).min(self.system.gap_m(&vertical, 1));
        if lowest_m < 0.0 {
            state.height_m -= lowest_m;
        }
    }
}

impl ReferenceState {
    fn vertical(&self) -> Vertical {
        Vertical { modes: self.modes, height_m: self.height_m, velocity_m_s: self.velocity_m_s }
    }

    fn set_vertical(&mut self, vertical: &Vertical) {
        self.modes = vertical.modes;
        self.height_m = vertical.height_m;
        self.velocity_m_s = vertical.velocity_m_s;
    }
}

/// The state of a fixed-step motor, at time zero.
impl From<&MotorState<f64>> for ReferenceState {
    #[expect(clippy::cast_precision_loss, reason = "rounds to 53 bits: 1e-16 of a turn")]
    fn from(state: &MotorState<f64>) -> Self {
        let angle = &state.rotor.angle;
        let unit_rad = Angle::from_units(1).radians_since::<f64>(Angle::ZERO);
        Self {
            modes: state.modes,
            height_m: state.rotor.height_m,
            velocity_m_s: state.rotor.velocity_m_s,
            angle_rad: angle.angle().radians_since::<f64>(Angle::ZERO) + unit_rad * angle.residual_units(),
            rate_rad_s: state.rotor.rate_rad_s,
            phase_turns: state.phase.units() as f64 / 18_446_744_073_709_551_616.0,
            ..Self::default()
        }
    }
}

/// For a fixed-step motor to go on from; it counts its steps from zero.
impl From<&ReferenceState> for MotorState<f64> {
    fn from(state: &ReferenceState) -> Self {
        let whole = Angle::from_degrees(state.angle_rad.to_degrees());
        let mut angle = AngleAccumulator::at(whole);
        angle.turn_by_radians(state.angle_rad - whole.radians_since::<f64>(Angle::ZERO));
        Self {
            phase: Phase::from_turns(state.phase_turns),
            modes: state.modes,
            rotor: RotorState {
                height_m: state.height_m,
                velocity_m_s: state.velocity_m_s,
                angle,
                rate_rad_s: state.rate_rad_s,
            },
            ..Self::default()
        }
    }
}
