//! An instant of contact: impacts one after the other, the end of chattering, and who stays on whom.
//!
//! An impact is that of the motor model (10-13c): restitution across the contact, recoil of the modes, friction that at
//! most stops the
//! slip. Several pairs that touch at the same instant strike in sequence, the fastest approach first, until none
//! approaches. With
//! `e < 1` the impacts of a resting rotor follow each other in ever shorter flights and come to an end after the time
//!
//! ```text
//! sum of 2 v e^k / a = 2 v / (a (1 - e)) ,    a: acceleration of the teeth towards the rotor
//! ```
//!
//! so when the last impact of a pair approached with no more than [`CAPTURE_M_S`] and its tooth presses on, what remains
//! of the series is
//! taken as over: the gap's velocity, below 1e-9 m/s, is set to zero by an impulse through the teeth and the contact
//! lasts. What is
//! left out is a rise of `v^2 / 2 a`, below 1e-19 m at `a = 9.81`.

use super::events::{ContactEvent, ContactEventKind, ReferenceObserver};
use super::friction::Rotation;
use super::state::ReferenceState;
use super::system::{Contact, Drive, System, Vertical};

/// Approaches up to this end chattering.
pub const CAPTURE_M_S: f64 = 1e-9;
/// Gaps up to this are closed: rounding of a height of 0.5 mm.
pub const TOUCH_M: f64 = 1e-19;
/// Most impacts in one instant.
const SEQUENCE_MAX: u32 = 1000;

/// What decides an instant of contact.
pub struct ContactInstant<'a> {
    /// Stator and rotor.
    pub system: &'a System,
    /// The rotor's rotation.
    pub rotation: &'a Rotation,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// The drive in force.
    pub drive: &'a Drive,
}

impl ContactInstant<'_> {
    /// Lets the pairs of `touching` strike until none approaches, and decides which of them stay.
    pub fn settle(
        &self,
        state: &mut ReferenceState,
        mut touching: Contact,
        observer: &mut impl ReferenceObserver,
    ) {
        let mut vertical = state.vertical();
        let mut impacts = 0;
        let mut staying = loop {
            let approaches = [0, 1].map(|p| self.system.approach_m_s(&vertical, p));
            let first = if approaches[1] > approaches[0] { [1, 0] } else { [0, 1] };
            let fast = first.into_iter().find(|&p| touching[p] && approaches[p] > CAPTURE_M_S);
            let striking = if let Some(p) = fast {
                p
            } else {
                let slow = [0, 1].map(|p| touching[p] && approaches[p] >= -CAPTURE_M_S);
                let staying = self.system.staying(&vertical, self.drive, state.phase_turns, slow);
                // A slow approach that will not stay is an impact like any other.
                match (0..2).find(|&p| slow[p] && !staying[p] && approaches[p] > 0.0) {
                    Some(p) => p,
                    None => break staying,
                }
            };
            impacts += 1;
            if impacts > SEQUENCE_MAX {
                // Only a rounded tie can go on like this: nobody leaves.
                break touching;
            }
            self.strike(state, &mut vertical, striking, observer);
        };
        // Holding the rotor on one tooth must not drive it into the other: it then flies on and strikes again.
        let mut held = vertical;
        self.system.project(&mut held, staying);
        let driven = |p: usize| touching[p] && !staying[p] && self.system.approach_m_s(&held, p) > 0.0;
        if driven(0) || driven(1) {
            staying = [false, false];
        }
        for p in 0..2 {
            let parts = touching[p] && !staying[p];
            state.roots_at_start[p] = if !parts {
                0
            } else if self.system.approach_m_s(&vertical, p) < 0.0 {
                1
            } else {
                2
            };
            touching[p] = staying[p];
        }
        self.system.project(&mut vertical, staying);
        for p in (0..2).filter(|&p| staying[p] && !state.contact[p]) {
            observer.event(&ContactEvent { time_s: state.time_s, pair: p, kind: ContactEventKind::Capture });
        }
        for p in (0..2).filter(|&p| !staying[p] && state.contact[p]) {
            observer.event(&ContactEvent { time_s: state.time_s, pair: p, kind: ContactEventKind::Detach });
        }
        state.contact = staying;
        state.set_vertical(&vertical);
    }

    /// One impact of pair `p`.
    fn strike(
        &self,
        state: &mut ReferenceState,
        vertical: &mut Vertical,
        p: usize,
        observer: &mut impl ReferenceObserver,
    ) {
        let tooth = &self.system.teeth[p];
        let rotation = self.rotation;
        let approach_m_s = self.system.approach_m_s(vertical, p);
        let rise_m_s = (1.0 + self.restitution) * approach_m_s / (1.0 + tooth.shape.dot(&tooth.recoil));
        let slip_m_s = tooth.tangential_velocity(&vertical.modes) - rotation.radius_m * state.rate_rad_s;
        let coefficient = rotation
            .coefficient(tooth.tangential_displacement(&vertical.modes), tooth.height(&vertical.modes));
        let normal_impulse_n_s = self.system.rotor_mass_kg * rise_m_s;
        let limit_m_s = coefficient * normal_impulse_n_s / rotation.tangential_mass_kg;
        let drag_m_s = slip_m_s.clamp(-limit_m_s, limit_m_s);
        state.rate_rad_s += drag_m_s / rotation.radius_m;
        self.system.push(vertical, p, rise_m_s);
        let kind = ContactEventKind::Impact {
            approach_m_s,
            normal_impulse_n_s,
            slip_m_s,
            tangential_impulse_n_s: rotation.tangential_mass_kg * drag_m_s,
        };
        observer.event(&ContactEvent { time_s: state.time_s, pair: p, kind });
    }
}
