//! Contacts where they happen inside a step.
//!
//! The rest of the step is tried without new contacts. Each gap between its ends is the cubic with the exact gap and
//! gap rate there; its error is below `(w h)^4 A / 384`, that is 2e-13 m at 1 us and 1e-9 m at 10 us in mode B. The first
//! gap that closes ends the trial: the motion goes there exactly, all closed contacts are solved together, and the rest
//! is tried again, a bounded number of times. What is still closed then is kept shut to the end of the step.
//!
//! A contact whose rebound would be too short to resolve stays: it becomes *sustained*. Sustained contacts act with
//! constant forces over a span. With `w` the rates of their gaps at its end, `h` its length and `k` a small number,
//!
//! ```text
//! w+ = w- + D P,  positions follow by h/2 times the change of velocity        w-, gap: without the forces
//! w_i+ + k gap_i+ / h >= 0   perp   P_i >= 0                                  gap+ = gap + (h/2) (w+ - w-)
//! ```
//!
//! with friction from those P. The error is of second order in the span. A contact with `P = 0` is open again.

use super::contact::{ContactPlace, ContactPlaces};
use super::contact_set::ContactSet;
use super::energy::TiltingLedger;
use super::{Freedom, TiltingContacts, TiltingMotion, TiltingMotor};
use crate::contact::GapCurve;
use crate::math::Real;
use crate::modes::{Forcing, Phasor};

/// Most instants of contact in a step.
const INSTANTS_MAX: u8 = 6;
/// Part of a gap that a sustained contact closes in a span.
const GAP_RETURN: f64 = 0.05;
/// Shortest rebound that is resolved, as a part of a step.
const REST_FLIGHT: f64 = 0.25;
/// Gap below which another contact is closed at the instant of a first one, in m.
const TOUCH_M: f64 = 1e-10;
/// Modal displacements (m) and velocities (m/s) are rounded to multiples of about 1e-16 of this in sustained contact,
/// so that no subnormal numbers arise in a long rest.
const MODAL_FLOOR: f64 = 1e-20;

/// The next contact of a trial.
struct NextContact {
    place: ContactPlace,
    /// Whether it would open for too short a time.
    brief: bool,
}

impl<T: Real> TiltingMotor<T> {
    /// Finds and applies the contacts of a step. `end` is the free end of the step and becomes the true one.
    #[inline(never)]
    pub(super) fn locate_contacts<L: TiltingLedger<T>>(
        &self,
        forcing: &Forcing<T>,
        start: &TiltingMotion<T>,
        end: &mut TiltingMotion<T>,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        let end_phase = end.phase;
        let (mut here, mut left) = (*start, T::one());
        let mut phasor = None;
        for _ in 0..INSTANTS_MAX {
            let free = *end;
            let pushed = self.sustain(&here, end, left * self.step);
            let Some((next, at)) = self.next_contact(&here, end, left) else {
                ledger.motion(&here.under(forcing), left);
                self.report_sustained(forcing, &free, end, pushed.as_ref(), T::zero(), contacts, ledger);
                return;
            };
            let part = at * left;
            let from = *phasor.get_or_insert_with(|| forcing.phasor(start.phase));
            let done = T::one() - left + part;
            let there = forcing.phase_at(start.phase, done);
            let to = forcing.phasor(there);
            if part > T::zero() {
                let before = here;
                self.fly(forcing, &mut here, part, [&from, &to]);
                here.phase = there;
                let free = here;
                let pushed = self.sustain(&before, &mut here, part * self.step);
                ledger.motion(&before.under(forcing), part);
                let before_end_s = (T::one() - done) * self.step;
                self.report_sustained(forcing, &free, &here, pushed.as_ref(), before_end_s, contacts, ledger);
            }
            left -= part;
            phasor = Some(to);
            self.meet(&mut here, &next, left * self.step, contacts, ledger);
            *end = here;
            if left <= T::zero() {
                end.phase = end_phase;
                return;
            }
            self.fly(forcing, end, left, [&to, &forcing.phasor(end_phase)]);
            end.phase = end_phase;
        }
        self.shut(forcing, &here, end, left, contacts, ledger);
    }

    /// Free flight over the fraction `part` of a step.
    fn fly(&self, forcing: &Forcing<T>, motion: &mut TiltingMotion<T>, part: T, phasors: [&Phasor<T>; 2]) {
        self.modes.part(part).advance(&mut motion.modes, forcing, phasors);
        self.stator_tilt.part(part).advance(&mut motion.stator_tilt);
        let rate = motion.rotor.rate_rad_s;
        let lean = self.lean.part(part);
        if self.freedom == Freedom::Full {
            lean.advance::<true>(&mut motion.tilt, &mut motion.shift, rate);
        } else {
            lean.advance::<false>(&mut motion.tilt, &mut motion.shift, rate);
        }
        self.flight.part(part).advance(&mut motion.rotor);
    }

    /// The first contact that closes between `from` and `to`, the fraction `part` of a step apart, and when.
    fn next_contact(
        &self,
        from: &TiltingMotion<T>,
        to: &TiltingMotion<T>,
        part: T,
    ) -> Option<(NextContact, T)> {
        let span_s = part * self.step;
        let mut first: Option<(NextContact, T)> = None;
        for place in ContactPlace::ALL {
            // Without shift both edges meet the pin at once.
            let doubled = place == ContactPlace::LowerEdge && self.freedom != Freedom::Full;
            if from.in_contact.contains(place) || doubled {
                continue;
            }
            let Some((gap_1, rate_1)) = self.gap_at(to, place) else { continue };
            let Some((gap_0, rate_0)) = self.gap_at(from, place) else { continue };
            let Some(at) = GapCurve::cubic([gap_0, gap_1], [rate_0, rate_1], span_s).first_descent() else {
                continue;
            };
            if first.as_ref().is_none_or(|(_, earliest)| at < *earliest) {
                // The closing acceleration of the gap over a whole step.
                let closing_m_s = (rate_0 - rate_1) / part;
                let approach_m_s = (rate_0 + at * (rate_1 - rate_0)).abs();
                let restitution = self.restitution(place);
                let rebound_m_s = restitution * approach_m_s;
                let brief = rebound_m_s + rebound_m_s <= T::from_f64(REST_FLIGHT) * closing_m_s;
                first = Some((NextContact { place, brief }, at));
            }
        }
        first
    }

    /// Solves all contacts that are closed at the instant of `next`.
    fn meet<L: TiltingLedger<T>>(
        &self,
        motion: &mut TiltingMotion<T>,
        next: &NextContact,
        before_end_s: T,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        let zero = T::zero();
        let mut set = ContactSet::new();
        let mut velocities = motion.velocities();
        let mut stays = motion.in_contact;
        for place in ContactPlace::ALL {
            let sustained = motion.in_contact.contains(place);
            let Some((gap_m, rate_m_s)) = self.gap_at(motion, place) else { continue };
            let chosen =
                place == next.place || (self.freedom != Freedom::Full && is_other_edge(place, next.place));
            if !(sustained || chosen || (gap_m <= T::from_f64(TOUCH_M) && rate_m_s < zero)) {
                continue;
            }
            let Some(contact) = self.contact_at(motion, place) else { continue };
            let speed = contact.normal.speed(&velocities);
            let brief = chosen && next.brief;
            let rests = sustained || brief;
            let bias = if rests || speed >= zero { zero } else { contact.restitution * speed };
            if brief {
                stays = stays.with(place);
            }
            set.add(contact, bias, &velocities);
        }
        set.solve(&self.mobility, &mut velocities, self.freedom != Freedom::Full);
        motion.set_velocities(&velocities);
        motion.in_contact = ContactPlaces::NONE;
        for solved in &set.contacts {
            // One that another contact presses open is free.
            let opens = solved.normal_n_s <= zero && solved.speed_after > zero;
            if stays.contains(solved.contact.place) && !opens {
                motion.in_contact = motion.in_contact.with(solved.contact.place);
            }
        }
        self.report(&set, &velocities, false, before_end_s, contacts, ledger);
    }

    /// Applies the sustained contacts of `from` to `to`, the free motion `span_s` later. Returns what they did.
    #[inline]
    fn sustain(
        &self,
        from: &TiltingMotion<T>,
        to: &mut TiltingMotion<T>,
        span_s: T,
    ) -> Option<ContactSet<T>> {
        if from.in_contact.is_empty() {
            return None;
        }
        Some(self.press(from.in_contact, to, span_s))
    }

    /// Presses the contacts `places` shut over the last `span_s`.
    fn press(&self, places: ContactPlaces, to: &mut TiltingMotion<T>, span_s: T) -> ContactSet<T> {
        let half_k = T::from_f64(0.5 * GAP_RETURN);
        let (return_per_s, share) =
            (T::from_f64(GAP_RETURN) / span_s, T::from_f64(1.0 / (1.0 + 0.5 * GAP_RETURN)));
        let mut set = ContactSet::new();
        to.modes.drop_below(T::from_f64(MODAL_FLOOR));
        let mut velocities = to.velocities();
        for place in ContactPlace::ALL {
            if !places.contains(place) {
                continue;
            }
            let Some(contact) = self.contact_at(to, place) else { continue };
            let speed = contact.normal.speed(&velocities);
            let bias = (return_per_s * contact.gap_m - half_k * speed) * share;
            set.add(contact, bias, &velocities);
        }
        set.solve(&self.mobility, &mut velocities, self.freedom != Freedom::Full);
        to.set_velocities_evenly(&velocities, span_s);
        to.in_contact = ContactPlaces::NONE;
        for solved in &set.contacts {
            if solved.normal_n_s > T::zero() {
                to.in_contact = to.in_contact.with(solved.contact.place);
            }
        }
        set
    }

    /// After too many instants: keeps every gap that is closed at the end of the step shut.
    fn shut<L: TiltingLedger<T>>(
        &self,
        forcing: &Forcing<T>,
        here: &TiltingMotion<T>,
        end: &mut TiltingMotion<T>,
        left: T,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        let mut closed = here.in_contact;
        for place in ContactPlace::ALL {
            if self.gap_at(end, place).is_some_and(|(gap_m, _)| gap_m <= T::zero()) {
                closed = closed.with(place);
            }
        }
        ledger.motion(&here.under(forcing), left);
        let free = *end;
        let pushed = self.press(closed, end, left * self.step);
        self.report_sustained(forcing, &free, end, Some(&pushed), T::zero(), contacts, ledger);
    }

    #[expect(clippy::too_many_arguments, reason = "a span of sustained contact, and the records of it")]
    fn report_sustained<L: TiltingLedger<T>>(
        &self,
        forcing: &Forcing<T>,
        free: &TiltingMotion<T>,
        end: &TiltingMotion<T>,
        pushed: Option<&ContactSet<T>>,
        before_end_s: T,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        if let Some(set) = pushed {
            self.report(set, &end.velocities(), true, before_end_s, contacts, ledger);
            if L::RECORDS {
                ledger.moved(&free.under(forcing), &end.under(forcing));
            }
        }
    }

    fn restitution(&self, place: ContactPlace) -> T {
        let [tooth, _, _, _] = &self.teeth;
        if place.is_hub() { self.hub.restitution } else { tooth.restitution }
    }
}

/// Whether both are edges of the hole.
fn is_other_edge(a: ContactPlace, b: ContactPlace) -> bool {
    a.is_hub() && b.is_hub()
}
