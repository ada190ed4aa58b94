//! Steps in which the rotor stays at the pin and meets nothing new: the scheme of `located`, for the rotor alone.
//!
//! The pin does not move the stator, whose motion is then the free one. A closed edge acts along three directions: its
//! normal `n`, `t` round the pin, and up along it. With the rates `v` of height, `s` of shift, `p` of slope and `W`
//! clockwise, and the height `h` and the arm `r` of the edge from the mass centre, their speeds are:
//!
//! ```text
//! n . (s - h p)        t . (s - h p) + c_t W        v + r . p + c_u W
//! c_t = -(r x t + h eta x t),   c_u = eta x r       the spin is about the tilted axis
//! ```
//!
//! The tests that nothing else is met are cheap ones. Where one of them fails the step is left to `located`.

use nalgebra::Vector2;

use super::contact::{ContactPlace, ContactPlaces};
use super::edge_pair::{edge_friction, edge_pushes};
use super::energy::TiltingLedger;
use super::friction_circle::within_circle;
use super::hub::Edge;
use super::located::{MODAL_FLOOR, OPEN_M};
use super::rigid_body::{RotorMobility, Twist, cross};
use super::{TiltingContact, TiltingContacts, TiltingMotion, TiltingMotor, TiltingState};
use crate::math::Real;

/// An edge of the hole that is closed at the pin.
#[derive(Clone, Copy, Debug)]
struct PinContact<T> {
    edge: Edge<T>,
    /// `t`.
    round: Vector2<T>,
    /// `r`.
    arm: Vector2<T>,
    /// `c_t` and `c_u`.
    turns: [T; 2],
    /// Change of each speed per impulse.
    compliances: [T; 3],
}

/// What an edge did.
#[derive(Clone, Copy, Debug)]
struct PinImpulses<T> {
    /// Speed along the normal before and after.
    speeds: [T; 2],
    normal_n_s: T,
    /// Slip before friction.
    slip: [T; 2],
    along_n_s: [T; 2],
}

impl<T: Real> PinContact<T> {
    #[inline]
    fn new(
        edge: Edge<T>,
        pin_radius_m: T,
        eta: &Vector2<T>,
        shift: &Vector2<T>,
        mobility: &RotorMobility<T>,
    ) -> Self {
        let (n, h) = (edge.normal, edge.height_m);
        let round = Vector2::new(-n.y, n.x);
        let arm = n * pin_radius_m - shift;
        let turns = [-(cross(&arm, &round) + h * cross(eta, &round)), cross(eta, &arm)];
        let [turn_round, turn_up] = turns;
        let across = (mobility.shift + mobility.slope * (h * h)) * n.dot(&n);
        let compliances = [
            across,
            across + mobility.turn * (turn_round * turn_round),
            mobility.rise + mobility.turn * (turn_up * turn_up) + mobility.slope * arm.dot(&arm),
        ];
        Self { edge, round, arm, turns, compliances }
    }

    /// Speed along the normal.
    #[inline]
    fn speed(&self, motion: &Twist<T>) -> T {
        self.edge.normal.dot(&motion.shift) - self.edge.height_m * self.edge.normal.dot(&motion.slope)
    }

    /// Speeds round the pin and along it.
    #[inline]
    fn slip(&self, motion: &Twist<T>) -> [T; 2] {
        let [turn_round, turn_up] = self.turns;
        let across = self.round.dot(&motion.shift) - self.edge.height_m * self.round.dot(&motion.slope);
        [across + turn_round * motion.turn, motion.rise + self.arm.dot(&motion.slope) + turn_up * motion.turn]
    }

    #[inline]
    fn push(&self, impulse: T, mobility: &RotorMobility<T>, motion: &mut Twist<T>) {
        motion.shift += self.edge.normal * (mobility.shift * impulse);
        motion.slope -= self.edge.normal * (mobility.slope * self.edge.height_m * impulse);
    }

    #[inline]
    fn rub(&self, [round, up]: [T; 2], mobility: &RotorMobility<T>, motion: &mut Twist<T>) {
        let [turn_round, turn_up] = self.turns;
        motion.rise += mobility.rise * up;
        motion.turn += mobility.turn * (turn_round * round + turn_up * up);
        motion.shift += self.round * (mobility.shift * round);
        motion.slope +=
            self.arm * (mobility.slope * up) - self.round * (mobility.slope * self.edge.height_m * round);
    }

    fn record(&self, place: ContactPlace, did: &PinImpulses<T>) -> TiltingContact<T> {
        let [before, _] = did.speeds;
        TiltingContact {
            place,
            sustained: true,
            before_end_s: T::zero(),
            approach_m_s: -before,
            normal_impulse_n_s: did.normal_n_s,
            tangential_impulse_n_s: did.along_n_s,
            slip_m_s: did.slip,
            gap_m: self.edge.gap_m,
        }
    }

    /// Twice the heat of friction.
    #[inline]
    fn heat(&self, did: &PinImpulses<T>, motion: &Twist<T>) -> T {
        let ([slip_0, slip_1], [after_0, after_1]) = (did.slip, self.slip(motion));
        let [t_0, t_1] = did.along_n_s;
        -t_0 * (slip_0 + after_0) - t_1 * (slip_1 + after_1)
    }
}

/// The contacts of a step at the pin.
pub(super) struct AtPin<T> {
    first: Option<TiltingContact<T>>,
    second: Option<TiltingContact<T>>,
}

impl<T: Real> AtPin<T> {
    /// As a list. It is made of what is there: a whole list is a thousand bytes to copy.
    #[inline]
    pub(super) fn listed(&self) -> TiltingContacts<T> {
        let mut list = TiltingContacts::new();
        match (self.first, self.second) {
            (Some(first), Some(second)) => {
                let _ = list.push(first);
                let _ = list.push(second);
            }
            (Some(only), None) | (None, Some(only)) => {
                let _ = list.push(only);
            }
            (None, None) => (),
        }
        list
    }
}

/// One closed edge, and what it did.
type Pinned<T> = (ContactPlace, PinContact<T>, PinImpulses<T>);

impl<T: Real> TiltingMotor<T> {
    /// Takes the step of a rotor that is at the pin and nowhere else, if it meets nothing else. Otherwise the state
    /// stays.
    #[inline(never)]
    pub(super) fn rub_at_pin<const SHIFTS: bool, L: TiltingLedger<T>>(
        &self,
        state: &mut TiltingState<T>,
        ledger: &mut L,
    ) -> Option<AtPin<T>> {
        let mut end = self.free_end::<SHIFTS>(state);
        let mut motion = end.velocities().rotor;
        let contact = |place| {
            let (eta, shift) = (&end.tilt.slope, &end.shift.displacement_m);
            PinContact::new(
                self.hub.edge(place, &end),
                self.hub.pin_radius_m,
                eta,
                shift,
                &self.mobility.rotor,
            )
        };
        let (upper, lower) = (ContactPlace::UpperEdge, ContactPlace::LowerEdge);
        if state.in_contact.contains(upper) && state.in_contact.contains(lower) {
            let pins = [contact(upper), contact(lower)];
            let did = self.press_both::<SHIFTS>(&pins, &mut motion);
            let ([pin_0, pin_1], [did_0, did_1]) = (pins, did);
            let pinned = [(upper, pin_0, did_0), (lower, pin_1, did_1)];
            self.end_at_pin::<SHIFTS, L>(state, &mut end, &motion, &pinned, None, ledger)
        } else {
            let (place, other) =
                if state.in_contact.contains(upper) { (upper, lower) } else { (lower, upper) };
            let pin = contact(place);
            let did = self.press_one(&pin, &mut motion);
            // Without shift the upper edge stands for both.
            let open = (SHIFTS || other == upper).then_some(other);
            self.end_at_pin::<SHIFTS, L>(state, &mut end, &motion, &[(place, pin, did)], open, ledger)
        }
    }

    /// One edge: its normal impulse, then friction.
    #[inline]
    fn press_one(&self, pin: &PinContact<T>, motion: &mut Twist<T>) -> PinImpulses<T> {
        let mobility = &self.mobility.rotor;
        let [across, round, up] = pin.compliances;
        let before = pin.speed(motion);
        let asked = -(before + self.pressing.bias(ContactPlace::UpperEdge, pin.edge.gap_m, before));
        let normal_n_s = if asked > T::zero() && across > T::zero() { asked / across } else { T::zero() };
        pin.push(normal_n_s, mobility, motion);
        let (after, slip) = (pin.speed(motion), pin.slip(motion));
        let limit = self.hub.friction * normal_n_s;
        let mut along_n_s = [T::zero(); 2];
        if limit > T::zero() {
            let (t_0, t_1) = within_circle(slip, [round, up], limit);
            along_n_s = [t_0, t_1];
            pin.rub(along_n_s, mobility, motion);
        }
        PinImpulses { speeds: [before, after], normal_n_s, slip, along_n_s }
    }

    /// Both edges: their normal impulses, then friction, as `contact_set` does.
    #[inline]
    fn press_both<const SHIFTS: bool>(
        &self,
        pins: &[PinContact<T>; 2],
        motion: &mut Twist<T>,
    ) -> [PinImpulses<T>; 2] {
        let mobility = &self.mobility.rotor;
        let [pin_0, pin_1] = pins;
        let [[d_00, round_0, up_0], [d_11, round_1, up_1]] = [pin_0.compliances, pin_1.compliances];
        let (h_0, h_1) = (pin_0.edge.height_m, pin_1.edge.height_m);
        let stiffness = mobility.shift + mobility.slope * (h_0 * h_1);
        let d_01 = pin_0.edge.normal.dot(&pin_1.edge.normal) * stiffness;
        let before = [pin_0.speed(motion), pin_1.speed(motion)];
        let pushes = self.pushes::<SHIFTS>(pins, before, [d_00, d_11, d_01]);
        let [push_0, push_1] = pushes;
        pin_0.push(push_0, mobility, motion);
        pin_1.push(push_1, mobility, motion);
        let after = [pin_0.speed(motion), pin_1.speed(motion)];
        let slips = [pin_0.slip(motion), pin_1.slip(motion)];
        let ([turn_0, lift_0], [turn_1, lift_1]) = (pin_0.turns, pin_1.turns);
        let between = [
            pin_0.round.dot(&pin_1.round) * stiffness + mobility.turn * (turn_0 * turn_1),
            mobility.rise + mobility.turn * (lift_0 * lift_1) + mobility.slope * pin_0.arm.dot(&pin_1.arm),
        ];
        let limits = pushes.map(|push| self.hub.friction * push);
        let along = edge_friction(slips, [[round_0, up_0], [round_1, up_1]], between, limits);
        let slipping = *motion;
        let [along_0, along_1] = along;
        pin_0.rub(along_0, mobility, motion);
        pin_1.rub(along_1, mobility, motion);
        let ([before_0, before_1], [after_0, after_1], [slip_0, slip_1]) = (before, after, slips);
        let mut did_0 =
            PinImpulses { speeds: [before_0, after_0], normal_n_s: push_0, slip: slip_0, along_n_s: along_0 };
        let mut did_1 =
            PinImpulses { speeds: [before_1, after_1], normal_n_s: push_1, slip: slip_1, along_n_s: along_1 };
        if pin_0.heat(&did_0, motion) + pin_1.heat(&did_1, motion) < T::zero() {
            *motion = slipping;
            (did_0.along_n_s, did_1.along_n_s) = ([T::zero(); 2], [T::zero(); 2]);
        }
        [did_0, did_1]
    }

    /// The normal impulses of both edges: without a bias that would gain energy.
    #[inline]
    fn pushes<const SHIFTS: bool>(
        &self,
        [pin_0, pin_1]: &[PinContact<T>; 2],
        [w_0, w_1]: [T; 2],
        compliances: [T; 3],
    ) -> [T; 2] {
        let zero = T::zero();
        let [d_00, d_11, d_01] = compliances;
        if d_00 <= zero || d_11 <= zero {
            return [zero; 2];
        }
        let bias_0 = self.pressing.bias(ContactPlace::UpperEdge, pin_0.edge.gap_m, w_0);
        let bias_1 = self.pressing.bias(ContactPlace::UpperEdge, pin_1.edge.gap_m, w_1);
        let pushes = edge_pushes([w_0 + bias_0, w_1 + bias_1], compliances, !SHIFTS);
        let [p_0, p_1] = pushes;
        let twice_gain =
            p_0 * (w_0 + w_0 + d_00 * p_0 + d_01 * p_1) + p_1 * (w_1 + w_1 + d_01 * p_0 + d_11 * p_1);
        if twice_gain <= zero {
            return pushes;
        }
        let closing = |bias: T| if bias < zero { zero } else { bias };
        edge_pushes([w_0 + closing(bias_0), w_1 + closing(bias_1)], compliances, !SHIFTS)
    }

    /// Makes of the free end the end of a step in which `pinned` acted and after which the rotor moves with `motion`;
    /// `None` where something else may be met, such as the edge `open`.
    #[expect(clippy::inline_always, reason = "a call would move the state through memory")]
    #[inline(always)]
    fn end_at_pin<const SHIFTS: bool, L: TiltingLedger<T>>(
        &self,
        state: &mut TiltingState<T>,
        end: &mut TiltingMotion<T>,
        motion: &Twist<T>,
        pinned: &[Pinned<T>],
        open: Option<ContactPlace>,
        ledger: &mut L,
    ) -> Option<AtPin<T>> {
        end.modes.drop_below(T::from_f64(MODAL_FLOOR));
        end.set_rotor_evenly(motion, self.step);
        let edges = [ContactPlace::UpperEdge, ContactPlace::LowerEdge].map(|place| self.hub.edge(place, end));
        let [upper, lower] = &edges;
        if let Some(place) = open {
            let edge = if place == ContactPlace::UpperEdge { upper } else { lower };
            if !self.stays_open(edge, state, end) {
                return None;
            }
        }
        if !self.clear.teeth_are_far::<SHIFTS>(&end.place(), self.step) {
            return None;
        }
        if L::RECORDS {
            ledger.motion(state, T::one());
        }
        end.in_contact = ContactPlaces::NONE;
        let half_s = T::from_f64(0.5) * self.step;
        let mut at_pin = AtPin { first: None, second: None };
        for (place, pin, did) in pinned {
            let [before, after] = did.speeds;
            let pushes = did.normal_n_s > T::zero();
            // What hardly opens is still closed.
            if pushes || pin.edge.gap_m + half_s * (after - before) <= T::from_f64(OPEN_M) {
                end.in_contact = end.in_contact.with(*place);
            }
            if pushes {
                let contact = pin.record(*place, did);
                if L::RECORDS {
                    ledger.contact(&contact, after, pin.slip(motion), [T::zero(); 2]);
                }
                let AtPin { first, second } = &mut at_pin;
                *if *place == ContactPlace::UpperEdge { first } else { second } = Some(contact);
            }
        }
        if !end.in_contact.is_empty() {
            self.lift_out_of_edges::<SHIFTS>(&edges, end);
        }
        if L::RECORDS {
            let free = self.free_end::<SHIFTS>(state);
            ledger.moved(&free.under(&state.forcing), &end.under(&state.forcing));
        }
        state.move_to(end);
        Some(at_pin)
    }

    /// Moves the rotor out of the pin at both edges at once, as `end_of_step` does.
    #[inline]
    fn lift_out_of_edges<const SHIFTS: bool>(
        &self,
        [upper, lower]: &[Edge<T>; 2],
        end: &mut TiltingMotion<T>,
    ) {
        if upper.gap_m >= T::zero() && lower.gap_m >= T::zero() {
            return;
        }
        let mobility = &self.mobility.rotor;
        let compliance = |one: &Edge<T>, other: &Edge<T>| {
            one.normal.dot(&other.normal)
                * (mobility.shift + mobility.slope * (one.height_m * other.height_m))
        };
        let compliances = [compliance(upper, upper), compliance(lower, lower), compliance(upper, lower)];
        let [d_00, d_11, _] = compliances;
        if d_00 <= T::zero() || d_11 <= T::zero() {
            return;
        }
        let moves = edge_pushes([upper.gap_m, lower.gap_m], compliances, !SHIFTS);
        for (edge, by) in [upper, lower].into_iter().zip(moves) {
            end.shift.displacement_m += edge.normal * (mobility.shift * by);
            end.tilt.slope -= edge.normal * (mobility.slope * edge.height_m * by);
        }
    }

    /// Whether `edge` is farther open at the end of a step than it can have moved in it.
    #[inline]
    fn stays_open(&self, edge: &Edge<T>, start: &TiltingState<T>, end: &TiltingMotion<T>) -> bool {
        let size = |v: &Vector2<T>| v.x.abs() + v.y.abs();
        let larger = |a: T, b: T| if b > a { b } else { a };
        let shifts = larger(size(&start.shift.velocity_m_s), size(&end.shift.velocity_m_s));
        let tilts = larger(size(&start.tilt.rate_rad_s), size(&end.tilt.rate_rad_s));
        // The height of the edge's contact changes little: half as much again.
        let speed = shifts + T::from_f64(1.5) * edge.height_m.abs() * tilts;
        edge.gap_m > self.step * speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::{DriveCommand, DriveMode};
    use crate::params::{MotorParams, Parameter, TiltingParameter, TiltingParams};
    use crate::tilting::{Freedom, NoTiltingLedger, TiltingSetup, TiltingVariation};

    /// Every step at the pin of a third of a second in mode B beside the same step by `located`, which solves all
    /// contacts of all places: to rounding, which a determinant of one thousandth multiplies by a thousand.
    #[test]
    fn dual_a_step_at_the_pin_is_that_of_all_contacts() {
        let params = MotorParams::nominal()
            .with(Parameter::Friction, 0.15)
            .and_then(|set| set.with(Parameter::VerticalDamping, 0.9e-3))
            .unwrap();
        let tilting = TiltingParams::nominal()
            .with(TiltingParameter::HubClearance, 7e-6)
            .and_then(|set| set.with(TiltingParameter::PinSlope, 1e-3))
            .unwrap();
        let variation =
            TiltingVariation { amplitudes: [0.004, -0.003, 0.002, -0.005], ..TiltingVariation::default() };
        for freedom in [Freedom::Full, Freedom::WithoutShift] {
            let setup = TiltingSetup { variation, freedom, ..TiltingSetup::with_step(1e-6) };
            let motor = TiltingMotor::<f64>::try_new(&params, &tilting, &setup).unwrap();
            let mut state = TiltingState::default();
            let mut compared = [0; 3];
            for _ in 0..300_000 {
                if state.in_contact.is_at_pin() {
                    let (mut alone, mut all) = (state, state);
                    let (taken, contacts) = if freedom == Freedom::Full {
                        let taken = motor.rub_at_pin::<true, _>(&mut alone, &mut NoTiltingLedger);
                        (taken, motor.step_near::<true, _>(&mut all, &mut NoTiltingLedger))
                    } else {
                        let taken = motor.rub_at_pin::<false, _>(&mut alone, &mut NoTiltingLedger);
                        (taken, motor.step_near::<false, _>(&mut all, &mut NoTiltingLedger))
                    };
                    if let Some(taken) = taken {
                        let number = taken.listed().len();
                        compared[number] += 1;
                        assert_eq!((number, alone.in_contact), (contacts.len(), all.in_contact), "{state:?}");
                        // At the rim and at the pin.
                        let velocities = |state: &TiltingState<f64>| {
                            let TiltingState { rotor, tilt, shift, .. } = state;
                            [
                                rotor.velocity_m_s,
                                1e-3 * rotor.rate_rad_s,
                                3e-3 * tilt.rate_rad_s.x,
                                3e-3 * tilt.rate_rad_s.y,
                                shift.velocity_m_s.x,
                                shift.velocity_m_s.y,
                            ]
                        };
                        for (one, other) in velocities(&alone).into_iter().zip(velocities(&all)) {
                            assert!((one - other).abs() < 1e-12, "{freedom:?} {one:e} {other:e} {state:?}");
                        }
                        // 3e-17 m, at the teeth as well.
                        assert!((alone.rotor.height_m - all.rotor.height_m).abs() < 3e-17);
                        assert!((alone.tilt.slope - all.tilt.slope).amax() < 1e-14);
                        assert!((alone.shift.displacement_m - all.shift.displacement_m).amax() < 3e-17);
                        assert_eq!((alone.modes, alone.stator_tilt), (all.modes, all.stator_tilt));
                    }
                }
                motor.step(&mut state, DriveCommand::full(DriveMode::B));
            }
            let [_, one, both] = compared;
            assert!(both > 10_000 && (one > 1000 || freedom != Freedom::Full), "{freedom:?} {compared:?}");
        }
    }
}
