//! Contacts at the end of the step, for comparison: each is up to a step late.
//!
//! All closed contacts are solved together with restitution. Then the rotor is moved out of what it is found in, along
//! each contact's own direction and weighted with mass, which the ledger calls a lift.

use super::contact::{ContactPlace, ContactPlaces, PLACES, Velocities};
use super::contact_set::ContactSet;
use super::energy::TiltingLedger;
use super::{Freedom, TiltingContact, TiltingContacts, TiltingMotion, TiltingMotor};
use crate::math::Real;
use crate::modes::Forcing;

/// Sweeps over the closed contacts to move the rotor out of them.
const LIFT_SWEEPS: u8 = 4;

impl<T: Real> TiltingMotor<T> {
    /// Solves the contacts that are closed in `motion` and lifts the rotor out of them.
    #[inline(never)]
    pub(super) fn contacts_at_end<L: TiltingLedger<T>>(
        &self,
        forcing: &Forcing<T>,
        motion: &mut TiltingMotion<T>,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        let mut closed = ContactPlaces::NONE;
        for place in ContactPlace::ALL {
            if self.gap_at(motion, place).is_some_and(|(gap_m, _)| gap_m <= T::zero()) {
                closed = closed.with(place);
            }
        }
        if closed.is_empty() {
            return;
        }
        let mut set = ContactSet::new();
        let mut velocities = motion.velocities();
        for place in ContactPlace::ALL {
            if closed.contains(place) {
                if let Some(contact) = self.contact_at(motion, place) {
                    let speed = contact.normal.speed(&velocities);
                    let bias = if speed < T::zero() { contact.restitution * speed } else { T::zero() };
                    set.add(contact, bias, &velocities);
                }
            }
        }
        set.solve(&self.mobility, &mut velocities, self.freedom != Freedom::Full);
        motion.set_velocities(&velocities);
        let before = motion.under(forcing);
        self.report(&set, &velocities, false, T::zero(), contacts, ledger);
        for _ in 0..LIFT_SWEEPS {
            for place in ContactPlace::ALL {
                if closed.contains(place) {
                    self.lift_out(motion, place);
                }
            }
        }
        ledger.moved(&before, &motion.under(forcing));
    }

    /// Moves the rotor along the contact's direction until its gap is closed.
    fn lift_out(&self, motion: &mut TiltingMotion<T>, place: ContactPlace) {
        let Some(contact) = self.contact_at(motion, place) else { return };
        if contact.gap_m >= T::zero() {
            return;
        }
        let mut shift = Velocities {
            rotor: super::Twist::zero(),
            modes: nalgebra::Vector3::zeros(),
            stator_tilt: nalgebra::Vector2::zeros(),
        };
        // Of the rotor alone: the modes keep their shape.
        let compliance = contact.normal.coupling(&contact.normal, &self.mobility);
        if compliance <= T::zero() {
            return;
        }
        contact.normal.push(-contact.gap_m / compliance, &self.mobility, &mut shift);
        motion.rotor.height_m += shift.rotor.rise;
        motion.shift.displacement_m += shift.rotor.shift;
        motion.tilt.slope += shift.rotor.slope;
    }

    /// Reports what a solved set did.
    pub(super) fn report<L: TiltingLedger<T>>(
        &self,
        set: &ContactSet<T>,
        velocities: &Velocities<T>,
        sustained: bool,
        before_end_s: T,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        for solved in &set.contacts {
            if solved.normal_n_s <= T::zero() {
                continue;
            }
            let contact = TiltingContact {
                place: solved.contact.place,
                sustained,
                before_end_s,
                approach_m_s: -solved.speed_before,
                normal_impulse_n_s: solved.normal_n_s,
                tangential_impulse_n_s: solved.along_n_s,
                slip_m_s: solved.slip,
                gap_m: solved.contact.gap_m,
            };
            if L::RECORDS {
                let slip_after = solved.contact.along.each_ref().map(|way| way.speed(velocities));
                let surface = solved.contact.along.each_ref().map(|way| way.surface_speed(velocities));
                ledger.contact(&contact, solved.speed_after, slip_after, surface);
            }
            // Beyond the stated number contacts are applied and not reported.
            let _ = contacts.push(contact);
        }
    }
}

const _: () = assert!(PLACES <= super::CONTACTS_PER_STEP_MAX, "the contacts of an instant can be reported");
