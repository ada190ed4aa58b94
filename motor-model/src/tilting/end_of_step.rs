//! Contacts at the end of the step, for comparison: each is up to a step late.
//!
//! All closed contacts are solved together with restitution. Then the rotor is moved out of what it is found in, along
//! each contact's own direction and weighted with mass, which the ledger calls a lift.

use super::contact::{ContactPlace, ContactPlaces, PLACES, Velocities};
use super::contact_set::ContactSet;
use super::energy::TiltingLedger;
use super::{Freedom, TiltingContacts, TiltingMotion, TiltingMotor};
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
            if closed.contains(place)
                && let Some(contact) = self.contact_at(motion, place)
            {
                let speed = contact.normal.speed(&velocities);
                let bias = if speed < T::zero() { contact.restitution * speed } else { T::zero() };
                set.add(contact, bias, &velocities);
            }
        }
        set.solve(&self.mobility, &mut velocities, self.freedom != Freedom::Full);
        motion.set_velocities(&velocities);
        let before = motion.under(forcing);
        set.report(&velocities, false, T::zero(), contacts, ledger);
        self.lift_out(motion, closed);
        ledger.moved(&before, &motion.under(forcing));
    }

    /// Moves the rotor out of what it is found in at `places`.
    pub(super) fn lift_out(&self, motion: &mut TiltingMotion<T>, places: ContactPlaces) {
        for _ in 0..LIFT_SWEEPS {
            let mut moved = false;
            for place in ContactPlace::ALL {
                if places.contains(place) {
                    moved |= self.lift_out_of(motion, place);
                }
            }
            if !moved {
                break;
            }
        }
    }

    /// Moves the rotor out of the pin at both edges at once: they share nearly one line of action.
    pub(super) fn lift_out_of_pin(&self, motion: &mut TiltingMotion<T>) {
        let mut set = ContactSet::new();
        let mut moves = Velocities::zero();
        let mut inside = false;
        for place in [ContactPlace::UpperEdge, ContactPlace::LowerEdge] {
            if let Some(contact) = self.contact_at(motion, place) {
                inside |= contact.gap_m < T::zero();
                set.add(contact, contact.gap_m, &moves);
            }
        }
        if inside {
            set.solve_normals(&self.mobility, &mut moves, self.freedom != Freedom::Full);
            motion.move_rotor(&moves.rotor);
        }
    }

    /// Moves the rotor along the contact's direction until its gap is closed; returns whether it moved. Out of a tooth
    /// it moves up and tilts: with a shift as well a rotor at rest on a slope would creep.
    fn lift_out_of(&self, motion: &mut TiltingMotion<T>, place: ContactPlace) -> bool {
        let Some(contact) = self.contact_at(motion, place) else { return false };
        if contact.gap_m >= T::zero() {
            return false;
        }
        let normal = if place.is_tooth() { contact.normal.without_shift() } else { contact.normal };
        let mut moves = Velocities::zero();
        // Of the rotor alone: the modes keep their shape.
        let compliance = normal.coupling_on_rotor(&normal, &self.mobility);
        if compliance <= T::zero() {
            return false;
        }
        normal.push(-contact.gap_m / compliance, &self.mobility, &mut moves);
        motion.move_rotor(&moves.rotor);
        true
    }
}

const _: () = assert!(PLACES <= super::CONTACTS_PER_STEP_MAX, "the contacts of an instant can be reported");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::{MotorParams, TiltingParams};
    use crate::tilting::{TiltingSetup, TiltingState};

    /// A rotor inside one tooth is moved out until the gap is closed, to rounding of the gap's terms of micrometres: a
    /// rotor that stays inside strikes again in every step.
    #[test]
    fn exact_a_lift_closes_the_gap() {
        let (params, tilting) = (MotorParams::nominal(), TiltingParams::nominal());
        let motor = TiltingMotor::<f64>::try_new(&params, &tilting, &TiltingSetup::with_step(1e-6)).unwrap();
        let mut state = TiltingState::<f64>::default();
        state.rotor.height_m = 1e-6;
        state.tilt.slope = motor.teeth()[0].outward * -4e-4;
        state.shift.displacement_m.x = 2e-6;
        let mut motion = state.motion();
        let place = ContactPlace::Tooth(0);
        let gap_m = |motion: &TiltingMotion<f64>| motor.gap_at(motion, place).unwrap().0;
        assert!(gap_m(&motion) < -1e-7, "{:e}", gap_m(&motion));
        motor.lift_out(&mut motion, ContactPlaces::NONE.with(place));
        assert!(gap_m(&motion).abs() < 1e-20, "{:e}", gap_m(&motion));
    }
}
