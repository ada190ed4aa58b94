//! A second integrator of the same motor, event-driven and in `f64`, exact to rounding: the reference for the fixed
//! step.
//!
//! It shares parameters and geometry with `motor_model`, and no line of its step. In the order of the data:
//!
//! | module | what it is |
//! |---|---|
//! | [`series`] | power series in time, and the first instant at which one falls through zero, no root missed |
//! | [`system`] | stator and rotor between two events, with no, one or two pairs of teeth in contact |
//! | [`contact`] | an instant of contact: impacts in sequence, the end of chattering, sustained contact |
//! | [`friction`] | the rotor's rotation between two events: free, slipping, sticking |
//! | [`tie_breaking`] | events at the same instant to within rounding |
//! | [`state`], [`events`] | the state, and the events that an observer gets |
//!
//! # Method
//!
//! 1. The motion is expanded in powers of time about the present, to order 20, over the time in which the fastest
//!    oscillation turns by one radian (20 us). The terms left out are below 1e-19 of those kept.
//! 2. The first event of the expansion is found: a gap that closes, or a normal force that ends.
//! 3. The rotation of the rotor follows, with its own switchings. It does not act back on the rest.
//! 4. The state moves to the event, which [`contact`] resolves. A gap that has just opened is zero to rounding. Its
//!    series is divided by time. So the contact that has just ended is not found again, and the next one is found
//!    however soon it is.
//!
//! An event is placed to about 1e-16 of a step, plus the rounding of the gap over its rate (1e-21 m over the approach):
//! 1e-18 s at 1 mm/s. The only approximation in chattering and contact is the end of the geometric series of impacts.
//! The motor itself is chaotic: two trajectories that differ in the last bit agree for a few dozen impacts. Beyond that
//! only statistics can be compared.
//!
//! A drive command holds over one [`Reference::run`]. The phase continues from one run to the next. It does not change
//! while the drive is off.

pub mod contact;
pub mod events;
pub mod friction;
pub mod series;
pub mod state;
pub mod system;
pub mod tie_breaking;

#[cfg(test)]
mod tests;

use motor_model::params::Parameter;
use motor_model::{AmplitudeVariation, DriveCommand, MotorParams, OutOfBounds};

use contact::{ContactInstant, TOUCH_M};
use events::{ContactEvent, ContactEventKind, ReferenceObserver};
use friction::Rotation;
use simulation::runs::RunError;
use state::ReferenceState;
use system::{Contact, Drive, Segment, System};
use tie_breaking::TieBreaker;

/// A motor for the reference integrator. It is immutable and serves any number of states.
#[derive(Clone, Debug)]
pub struct Reference {
    system: System,
    rotation: Rotation,
    restitution: f64,
}

/// The first event of a segment.
enum Next {
    Impact,
    Detachment(usize),
    End,
}

impl Reference {
    /// The motor of `params` with this `variation` of its tooth amplitudes, driven at resonance, with Coulomb friction.
    ///
    /// # Errors
    /// When mode A is damped beyond 0.99 of critical.
    pub fn try_new(params: &MotorParams, variation: &AmplitudeVariation) -> Result<Self, OutOfBounds> {
        let radius_m = params.get(Parameter::ToothRadius);
        let tangential_mass_kg = params.get(Parameter::RotorInertia) / (radius_m * radius_m);
        Ok(Self {
            system: System::try_new(params, variation)?,
            rotation: Rotation {
                radius_m,
                tangential_mass_kg,
                damping_per_s: params.get(Parameter::TangentialDrag) / tangential_mass_kg,
                friction: params.get(Parameter::Friction),
            },
            restitution: params.get(Parameter::Restitution),
        })
    }

    /// The nominal motor.
    ///
    /// # Errors
    /// Never, unless the bounds of the parameters are changed.
    pub fn nominal(variation: &AmplitudeVariation) -> Result<Self, OutOfBounds> {
        Self::try_new(&MotorParams::nominal(), variation)
    }

    /// Runs `state` for `duration_s` under `command`.
    ///
    /// A rotor inside a tooth is first raised to the tooth's height, as in the fixed-step model.
    ///
    /// # Errors
    /// When events follow each other at one instant without end.
    pub fn run(
        &self,
        state: &mut ReferenceState,
        command: DriveCommand,
        duration_s: f64,
        observer: &mut impl ReferenceObserver,
    ) -> Result<(), RunError> {
        let drive = self.system.drive(command);
        let longest_s = 1.0 / self.system.fastest_rate_per_s(&drive).max(self.rotation.damping_per_s);
        let instant = ContactInstant {
            system: &self.system,
            rotation: &self.rotation,
            restitution: self.restitution,
            drive: &drive,
        };
        self.raise_out_of_teeth(state);
        // The drive may have changed, so contacts are decided again.
        let touching = self.touching(state);
        if touching != [false, false] {
            instant.settle(state, touching, observer);
        }

        let start_s = state.time_s;
        let mut elapsed_s = 0.0;
        let mut ties = TieBreaker::default();
        while elapsed_s < duration_s {
            let remaining_s = duration_s - elapsed_s;
            let h = longest_s.min(remaining_s);
            let segment = self.system.expand(&state.vertical(), &drive, state.phase_turns, state.contact, h);
            let (end, next) = match ties.ignored_part() {
                Some(part) => (part, Next::End),
                None => self.next(state, &segment),
            };
            ties.record_advance(end)?;
            observer.segment(state, &segment, end);
            let last = end >= 1.0 && h >= remaining_s;
            elapsed_s = if last { duration_s } else { elapsed_s + h * end };
            self.advance(state, &segment, end, &drive)?;
            state.time_s = start_s + elapsed_s;
            match next {
                Next::End => {}
                Next::Detachment(p) => {
                    state.contact[p] = false;
                    state.roots_at_start[p] = 3;
                    observer.event(&ContactEvent {
                        time_s: state.time_s,
                        pair: p,
                        kind: ContactEventKind::Detach,
                    });
                }
                Next::Impact => {
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
            let (series, event) = if state.contact[p] {
                (segment.normal_force_per_mass_m_s2[p], Next::Detachment(p))
            } else {
                let gap = segment.gap(&self.system.teeth[p]);
                (gap.without_root_at_start(state.roots_at_start[p]), Next::Impact)
            };
            if let Some(tau) = series.first_descent(end) {
                (end, next) = (tau, event);
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
    ) -> Result<(), RunError> {
        if end > 0.0 {
            let v = self.rotation.radius_m * state.rate_rad_s;
            let (v, arc_m) = self.rotation.over(&self.system, segment, end, v)?;
            state.rate_rad_s = v / self.rotation.radius_m;
            state.angle_rad += arc_m / self.rotation.radius_m;
            let turns = state.phase_turns + drive.frequency_hz * segment.duration_s * end;
            state.phase_turns = turns - turns.floor();
            let mut vertical = segment.at(end);
            self.system.project(&mut vertical, state.contact);
            state.set_vertical(&vertical);
            state.roots_at_start = [0; 2];
        }
        Ok(())
    }

    /// The pairs whose gap is zero.
    fn touching(&self, state: &ReferenceState) -> Contact {
        let vertical = state.vertical();
        [0, 1].map(|p| {
            state.contact[p] || state.roots_at_start[p] > 0 || self.system.gap_m(&vertical, p) <= TOUCH_M
        })
    }

    /// Raises a rotor that is inside a tooth.
    fn raise_out_of_teeth(&self, state: &mut ReferenceState) {
        let vertical = state.vertical();
        let lowest_m = self.system.gap_m(&vertical, 0).min(self.system.gap_m(&vertical, 1));
        if lowest_m < 0.0 {
            state.height_m -= lowest_m;
        }
    }
}
