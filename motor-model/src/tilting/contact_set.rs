//! The closed contacts of an instant, solved together: normal impulses by complementarity, then friction.
//!
//! With the speeds `w` along the normals before (-) and after (+), for every closed contact i (Newton's restitution):
//!
//! ```text
//! w+ = w- + D P,     0 <= P_i   perp   w_i+ + b_i >= 0,     b_i = e_i min(w_i-, 0)
//! ```
//!
//! Up to four contacts that all press are one linear system (`all_pressing`). Others are solved by projected
//! Gauss-Seidel on the velocities themselves. The two edges of the hole share nearly the same line of action, which
//! would converge slowly: they are one block, solved exactly. Several contacts with different restitutions could gain
//! energy under Newton's rule. The gain is `sum P_i (w_i+ + w_i-) / 2`; where it is positive, the contacts are solved
//! again without restitution, which minimises the energy.
//!
//! Friction then takes up the slip `q` of each contact in both directions along its surface (Coulomb):
//!
//! ```text
//! T_i = -q_i / (d_i + m),     m = 0, or so large that |T| = mu P      the least energy within the circle |T| <= mu P
//! ```
//!
//! in turn, until nothing changes. Friction never gains energy either: its heat `-sum T (q- + q+) / 2` is checked, and
//! friction that would cool is left out.

use heapless::Vec;

use super::all_pressing::{self, impulses_if_all_press};
use super::contact::{Contact, ContactPlace, Mobility, PLACES, Velocities};
use super::edge_pair::{push_edges, rub_edges};
use super::energy::TiltingLedger;
use super::friction_circle::within_circle;
use super::rigid_body::Twist;
use super::{TiltingContact, TiltingContacts};
use crate::math::Real;

/// Most sweeps over the normal impulses.
const NORMAL_SWEEPS: u8 = 40;
/// Most sweeps over friction.
const FRICTION_SWEEPS: u8 = 20;
/// The sweeps end when no impulse changes by more than this share of the largest. Single precision takes all of them:
/// with fewer, a rotor at rest turns by two units of the angle in a tenth of a second.
const SETTLED: f64 = 1e-13;
const FRICTION_SETTLED: f64 = 1e-6;

/// What one contact did.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solved<T> {
    pub(super) contact: Contact<T>,
    /// `w-`.
    pub(super) speed_before: T,
    /// `w+`, before friction.
    pub(super) speed_after: T,
    /// `b`.
    pub(super) bias: T,
    /// `P`.
    pub(super) normal_n_s: T,
    /// Speed of the surface in both directions along it: friction does not change it.
    surface: [T; 2],
    /// Slip of the rotor over the surface before friction.
    pub(super) slip: [T; 2],
    /// `T`.
    pub(super) along_n_s: [T; 2],
}

/// The closed contacts of an instant.
#[derive(Clone, Debug)]
pub(super) struct ContactSet<T> {
    pub(super) contacts: Vec<Solved<T>, PLACES>,
}

impl<T: Real> ContactSet<T> {
    pub(super) fn new() -> Self {
        Self { contacts: Vec::new() }
    }

    /// Adds a closed contact that has to part with at least the speed `-bias`.
    pub(super) fn add(&mut self, contact: Contact<T>, bias: T, velocities: &Velocities<T>) {
        let speed = contact.normal.speed(velocities);
        let zero = T::zero();
        let solved = Solved {
            contact,
            speed_before: speed,
            speed_after: speed,
            bias,
            normal_n_s: zero,
            surface: [zero; 2],
            slip: [zero; 2],
            along_n_s: [zero; 2],
        };
        // There are as many entries as places.
        let _ = self.contacts.push(solved);
    }

    /// Reports what a solved set did.
    pub(super) fn report<L: TiltingLedger<T>>(
        &self,
        velocities: &Velocities<T>,
        sustained: bool,
        before_end_s: T,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        for solved in &self.contacts {
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

    /// Applies normal impulses and friction to `velocities`.
    pub(super) fn solve(&mut self, mobility: &Mobility<T>, velocities: &mut Velocities<T>, both_edges: bool) {
        let before = *velocities;
        self.solve_normals(mobility, velocities, both_edges);
        if self.contacts.len() > 1 && self.normal_gain() > T::zero() {
            *velocities = before;
            for solved in &mut self.contacts {
                solved.normal_n_s = T::zero();
                if solved.bias < T::zero() {
                    solved.bias = T::zero();
                }
            }
            self.solve_normals(mobility, velocities, both_edges);
        }
        self.solve_friction(mobility, velocities);
    }

    /// Change of the energy by the normal impulses.
    fn normal_gain(&self) -> T {
        let half = T::from_f64(0.5);
        self.contacts.iter().fold(T::zero(), |sum, solved| {
            sum + half * solved.normal_n_s * (solved.speed_before + solved.speed_after)
        })
    }

    /// Applies normal impulses alone.
    pub(super) fn solve_normals(
        &mut self,
        mobility: &Mobility<T>,
        velocities: &mut Velocities<T>,
        both_edges: bool,
    ) {
        if let [only] = self.contacts.as_mut_slice() {
            only.push_alone(mobility, velocities);
            only.speed_after = only.contact.normal.speed(velocities);
            return;
        }
        let first_edge = self.edges();
        if let ([upper, lower], Some(_)) = (self.contacts.as_mut_slice(), first_edge) {
            push_edges(upper, lower, mobility, velocities, both_edges);
            upper.speed_after = upper.contact.normal.speed(velocities);
            lower.speed_after = lower.contact.normal.speed(velocities);
            return;
        }
        if first_edge.is_none()
            && self.contacts.len() <= all_pressing::MOST
            && let Some(impulses) = impulses_if_all_press(&self.contacts, mobility)
        {
            for (solved, impulse) in self.contacts.iter_mut().zip(impulses) {
                solved.set_normal(impulse, mobility, velocities);
            }
        } else {
            self.sweep_normals(mobility, velocities, both_edges, first_edge);
        }
        for solved in &mut self.contacts {
            solved.speed_after = solved.contact.normal.speed(velocities);
        }
    }

    /// Projected Gauss-Seidel.
    pub(super) fn sweep_normals(
        &mut self,
        mobility: &Mobility<T>,
        velocities: &mut Velocities<T>,
        both_edges: bool,
        first_edge: Option<usize>,
    ) {
        for _ in 0..NORMAL_SWEEPS {
            let (mut largest, mut change) = (T::zero(), T::zero());
            for index in 0..self.contacts.len() {
                if first_edge == Some(index) {
                    if let Some([upper, lower]) = self.contacts.get_mut(index..index + 2) {
                        let changed = push_edges(upper, lower, mobility, velocities, both_edges);
                        change = max(change, changed);
                        largest = max(largest, max(upper.normal_n_s, lower.normal_n_s));
                    }
                } else if first_edge.is_none_or(|first| index != first + 1)
                    && let Some(solved) = self.contacts.get_mut(index)
                {
                    change = max(change, solved.push_alone(mobility, velocities));
                    largest = max(largest, solved.normal_n_s);
                }
            }
            if change <= T::from_f64(SETTLED) * largest {
                break;
            }
        }
    }

    /// Where the pair of edges begins, if both are closed: they are neighbours.
    fn edges(&self) -> Option<usize> {
        let upper =
            self.contacts.iter().position(|solved| solved.contact.place == ContactPlace::UpperEdge)?;
        let next = self.contacts.get(upper + 1)?;
        (next.contact.place == ContactPlace::LowerEdge).then_some(upper)
    }

    fn solve_friction(&mut self, mobility: &Mobility<T>, velocities: &mut Velocities<T>) {
        let before = velocities.rotor;
        for solved in &mut self.contacts {
            solved.surface = solved.contact.along.each_ref().map(|way| way.surface_speed(velocities));
            solved.slip = solved.slip_of(&before);
        }
        let both = self.edges().is_some();
        if let ([upper, lower], true) = (self.contacts.as_mut_slice(), both) {
            rub_edges(upper, lower, mobility, velocities);
            if self.friction_heat(&velocities.rotor) < T::zero() {
                velocities.rotor = before;
                for solved in &mut self.contacts {
                    solved.along_n_s = [T::zero(); 2];
                }
            }
            return;
        }
        let sweeps = if self.contacts.len() > 1 { FRICTION_SWEEPS } else { 1 };
        for _ in 0..sweeps {
            let (mut largest, mut change) = (T::zero(), T::zero());
            for solved in &mut self.contacts {
                change = max(change, solved.rub(mobility, &mut velocities.rotor));
                largest = max(largest, solved.contact.friction * solved.normal_n_s);
            }
            if change <= T::from_f64(FRICTION_SETTLED) * largest {
                break;
            }
        }
        if self.contacts.len() > 1 && self.friction_heat(&velocities.rotor) < T::zero() {
            velocities.rotor = before;
            for solved in &mut self.contacts {
                solved.along_n_s = [T::zero(); 2];
            }
        }
    }

    /// Heat of friction, twice.
    fn friction_heat(&self, rotor: &Twist<T>) -> T {
        self.contacts.iter().fold(T::zero(), |sum, solved| {
            let [first, second] = solved.slip_of(rotor);
            let ([slip_0, slip_1], [t_0, t_1]) = (solved.slip, solved.along_n_s);
            sum - t_0 * (slip_0 + first) - t_1 * (slip_1 + second)
        })
    }
}

#[inline]
fn max<T: Real>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

impl<T: Real> Solved<T> {
    /// Corrects this contact's normal impulse; returns the size of the change.
    #[inline]
    fn push_alone(&mut self, mobility: &Mobility<T>, velocities: &mut Velocities<T>) -> T {
        let normal = &self.contact.normal;
        if normal.compliance <= T::zero() {
            return T::zero();
        }
        let asked = self.normal_n_s - (normal.speed(velocities) + self.bias) / normal.compliance;
        self.set_normal(max(asked, T::zero()), mobility, velocities)
    }

    #[inline]
    pub(super) fn set_normal(&mut self, to: T, mobility: &Mobility<T>, velocities: &mut Velocities<T>) -> T {
        let change = to - self.normal_n_s;
        if change != T::zero() {
            self.contact.normal.push(change, mobility, velocities);
            self.normal_n_s = to;
        }
        change.abs()
    }

    /// Slip of a rotor that moves with `rotor`.
    #[inline]
    fn slip_of(&self, rotor: &Twist<T>) -> [T; 2] {
        let ([first, second], [surface_0, surface_1]) = (&self.contact.along, self.surface);
        [first.rotor_speed(rotor) - surface_0, second.rotor_speed(rotor) - surface_1]
    }

    /// Corrects this contact's friction; returns the size of the change.
    fn rub(&mut self, mobility: &Mobility<T>, rotor: &mut Twist<T>) -> T {
        let limit = self.contact.friction * self.normal_n_s;
        let zero = T::zero();
        let [first, second] = &self.contact.along;
        let [t_0, t_1] = self.along_n_s;
        if limit <= zero {
            return zero;
        }
        // The slip that there would be without this contact's own friction.
        let (d_0, d_1) = (first.compliance, second.compliance);
        let [slip_0, slip_1] = self.slip_of(rotor);
        let (q_0, q_1) = (slip_0 - d_0 * t_0, slip_1 - d_1 * t_1);
        let (to_0, to_1) = within_circle([q_0, q_1], [d_0, d_1], limit);
        let (by_0, by_1) = (to_0 - t_0, to_1 - t_1);
        first.push_rotor(by_0, mobility, rotor);
        second.push_rotor(by_1, mobility, rotor);
        self.along_n_s = [to_0, to_1];
        max(by_0.abs(), by_1.abs())
    }
}
