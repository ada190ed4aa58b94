//! An instant of contact: impacts one after the other, the end of chattering, sustained contact.
//!
//! An impact is that of the motor model (10-13c): restitution across the contact, recoil of the modes, and friction
//! that at most stops the slip. Pairs that touch at the same instant have their impacts in sequence, the fastest
//! approach first, until none approaches. With `e < 1` the impacts of a resting rotor follow each other in ever shorter
//! flights. They come to an end after the time
//!
//! ```text
//! sum of 2 v e^k / a = 2 v / (a (1 - e)) ,    a: acceleration of the teeth towards the rotor
//! ```
//!
//! The series is taken as ended when the last impact of a pair approaches with no more than [`CAPTURE_M_S`] and the
//! normal force of its tooth is positive. An impulse through the teeth sets the gap's velocity, below 1e-9 m/s, to
//! zero, and sustained contact begins. The motion left out is a rise of `v^2 / 2 a`, below 1e-19 m at `a = 9.81`.

use super::events::{ContactEvent, ContactEventKind, ReferenceObserver};
use super::friction::Rotation;
use super::state::ReferenceState;
use super::system::{Contact, Drive, System, Vertical};

/// Largest speed of approach that ends chattering.
pub const CAPTURE_M_S: f64 = 1e-9;
/// Largest gap that counts as closed: the rounding of a height of 0.5 mm.
pub const TOUCH_M: f64 = 1e-19;
/// Largest number of impacts at one instant.
const SEQUENCE_MAX: u32 = 1000;

/// What an instant of contact depends on.
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
    /// Applies impacts of the pairs of `touching` until none approaches, and decides which of them stay in contact.
    pub fn settle(
        &self,
        state: &mut ReferenceState,
        mut touching: Contact,
        observer: &mut impl ReferenceObserver,
    ) {
        let mut vertical = state.vertical();
        let mut impacts = 0;
        let mut sustained = loop {
            let approaches = [0, 1].map(|p| self.system.approach_m_s(&vertical, p));
            let first = if approaches[1] > approaches[0] { [1, 0] } else { [0, 1] };
            let fast = first.into_iter().find(|&p| touching[p] && approaches[p] > CAPTURE_M_S);
            let next = if let Some(p) = fast {
                p
            } else {
                let slow = [0, 1].map(|p| touching[p] && approaches[p] >= -CAPTURE_M_S);
                let sustained = self.system.sustained(&vertical, self.drive, state.phase_turns, slow);
                // A slow approach of a pair that does not stay in contact is an impact too.
                match (0..2).find(|&p| slow[p] && !sustained[p] && approaches[p] > 0.0) {
                    Some(p) => p,
                    None => break sustained,
                }
            };
            impacts += 1;
            if impacts > SEQUENCE_MAX {
                // Only a tie within rounding leads here: all pairs stay in contact.
                break touching;
            }
            self.apply_impact(state, &mut vertical, next, observer);
        };
        // Sustained contact with one tooth must not drive the rotor into the other. If it would, no pair stays in
        // contact, and the next impact follows.
        let mut held = vertical;
        self.system.project(&mut held, sustained);
        let driven = |p: usize| touching[p] && !sustained[p] && self.system.approach_m_s(&held, p) > 0.0;
        if driven(0) || driven(1) {
            sustained = [false, false];
        }
        for p in 0..2 {
            let parts = touching[p] && !sustained[p];
            state.roots_at_start[p] = if !parts {
                0
            } else if self.system.approach_m_s(&vertical, p) < 0.0 {
                1
            } else {
                2
            };
            touching[p] = sustained[p];
        }
        self.system.project(&mut vertical, sustained);
        for p in (0..2).filter(|&p| sustained[p] && !state.contact[p]) {
            observer.event(&ContactEvent { time_s: state.time_s, pair: p, kind: ContactEventKind::Capture });
        }
        for p in (0..2).filter(|&p| !sustained[p] && state.contact[p]) {
            observer.event(&ContactEvent { time_s: state.time_s, pair: p, kind: ContactEventKind::Detach });
        }
        state.contact = sustained;
        state.set_vertical(&vertical);
    }

    /// One impact of pair `p`.
    fn apply_impact(
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
        let slip_m_s = tooth.tangential_velocity(&vertical.modes)
            - rotation.radius_m * state.rate_rad_s
            - tooth.sway * rise_m_s;
        let normal_impulse_n_s = self.system.rotor_mass_kg * rise_m_s;
        let limit_m_s = rotation.friction * normal_impulse_n_s / rotation.tangential_mass_kg;
        state.rate_rad_s += slip_m_s.clamp(-limit_m_s, limit_m_s) / rotation.radius_m;
        self.system.apply_impulse(vertical, p, rise_m_s);
        let kind = ContactEventKind::Impact { approach_m_s };
        observer.event(&ContactEvent { time_s: state.time_s, pair: p, kind });
    }
}
