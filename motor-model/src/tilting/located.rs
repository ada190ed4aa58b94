//! Contacts where they happen inside a step.
//!
//! The rest of the step is tried without new contacts. Each gap between its ends is the cubic with the exact gap and
//! gap rate there; its error is below `(w h)^4 A / 384`, that is 2e-13 m at 1 us and 1e-9 m at 10 us in mode B. The
//! first gap that closes ends the trial: the motion goes there exactly, all closed contacts are solved together, and
//! the rest is tried again, a bounded number of times. What is still closed then is kept shut to the end of the step.
//!
//! A contact whose rebound would be too short to resolve stays: it becomes *sustained*. Sustained contacts act with
//! constant forces over a span. With `w` the rates of their gaps at its end, `h` its length and `k` a small number,
//!
//! ```text
//! w+ = w- + D P,  positions follow by h/2 times the change of velocity        w-, gap: without the forces
//! w_i+ + k gap_i+ / (step) >= 0   perp   P_i >= 0                             gap+ = gap + (h/2) (w+ - w-)
//! ```
//!
//! with friction from those P. The error is of second order in the span. A contact with `P = 0` and a gap is open
//! again. A rotor too deep in the pin is moved out at once, at both edges together: a speed that closes the gap would
//! do work on a rotor that rolls round the pin.
//!
//! At the end of a step no gap is below minus
//!
//! ```text
//! tooth   J h^3 / (12 k),   J = sum w_n^2 V_n               V_n: speed amplitude of mode n
//! edge    0.3 a h |eta| |eta'| + min((h u)^2 / (2 c), h u)      u: speed of the hole's centre at the edge
//! circle  the tooth's and h R |eta'| min(h |eta'| / |eta|, 2) / (2 k)      at floor and ceiling
//! ```
//!
//! plus rounding, for friction up to 1: the error of constant forces over a span, of which `k` returns in a step, and
//! what the normal turns in one step.

use super::contact::{ContactPlace, ContactPlaces};
use super::contact_set::ContactSet;
use super::energy::TiltingLedger;
use super::{Freedom, TiltingContacts, TiltingMotion, TiltingMotor};
use crate::contact::GapCurve;
use crate::math::Real;
use crate::modes::{Forcing, Phasor};

/// Most instants of contact in a step.
const INSTANTS_MAX: u8 = 12;
/// Most times that the contacts are gathered which are then kept shut.
const SHUT_ROUNDS: u8 = 4;
/// Part of a gap that a sustained contact closes in a step.
const GAP_RETURN: f64 = 0.05;
/// Shortest rebound that is resolved, as a part of a step: at a tooth, floor or ceiling, and at the pin. There the
/// other edge may press a rotor back as fast as it rebounds, so that a step would begin as the one before.
const REST_FLIGHT: f64 = 0.25;
const REST_FLIGHT_AT_PIN: f64 = 1.0;
/// Gap below which another contact is closed at the instant of a first one, in m. From the fourth instant of a step on
/// it grows tenfold from one to the next: two contacts that strike in turn then meet at once.
const TOUCH_M: f64 = 1e-10;
const TOUCH_MAX_M: f64 = 1e-7;
const TOUCH_GROWS: u8 = 3;
/// Gap from which on a sustained contact that carries nothing is open, in m.
pub(super) const OPEN_M: f64 = 1e-11;
/// Modal displacements (m) and velocities (m/s) are rounded to multiples of about 1e-16 of this in sustained contact,
/// so that no subnormal numbers arise in a long rest.
pub(super) const MODAL_FLOOR: f64 = 1e-20;

/// By what speed a sustained contact has to part: `k gap+ / step <= w+` solved for `w+`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressing<T> {
    return_per_s: T,
    half_k: T,
    share: T,
}

impl<T: Real> Pressing<T> {
    /// Over the last `span_s` of a step.
    #[inline]
    pub(super) fn new(span_s: T, step_s: T) -> Self {
        let return_per_s = T::from_f64(GAP_RETURN) / step_s;
        let half_k = T::from_f64(0.5) * return_per_s * span_s;
        Self { return_per_s, half_k, share: T::one() / (T::one() + half_k) }
    }

    /// The bias of a contact with this gap and the speed `speed` without the contact.
    #[inline]
    pub(super) fn bias(&self, place: ContactPlace, gap_m: T, speed: T) -> T {
        // A rotor too deep in the pin is put back below: a speed for that would feed a motion along the pin.
        if place.is_hub() && gap_m < T::zero() {
            T::zero()
        } else {
            (self.return_per_s * gap_m - self.half_k * speed) * self.share
        }
    }
}

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
        let mut set = ContactSet::new();
        let mut touch_m = T::from_f64(TOUCH_M);
        for instant in 0..INSTANTS_MAX {
            if instant >= TOUCH_GROWS && touch_m < T::from_f64(TOUCH_MAX_M) {
                touch_m *= T::from_f64(10.0);
            }
            let free = *end;
            self.sustain(&here, end, left * self.step, &mut set);
            let Some((next, at)) = self.next_contact(&here, end, left) else {
                ledger.motion(&here.under(forcing), left);
                report_sustained(forcing, &free, end, &set, T::zero(), contacts, ledger);
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
                self.sustain(&before, &mut here, part * self.step, &mut set);
                ledger.motion(&before.under(forcing), part);
                let before_end_s = (T::one() - done) * self.step;
                report_sustained(forcing, &free, &here, &set, before_end_s, contacts, ledger);
            }
            left -= part;
            phasor = Some(to);
            self.meet(forcing, &mut here, &next, touch_m, left * self.step, contacts, ledger);
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
        let teeth_are_clear = self.teeth_are_clear(from, to, span_s);
        for place in ContactPlace::ALL {
            if teeth_are_clear && place.is_tooth() {
                continue;
            }
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
                let flight = T::from_f64(if place.is_hub() { REST_FLIGHT_AT_PIN } else { REST_FLIGHT });
                let brief =
                    rebound_m_s + rebound_m_s <= flight * closing_m_s || is_pressed_in(from, place, at);
                first = Some((NextContact { place, brief }, at));
            }
        }
        first
    }

    /// Whether no tooth can be met between two instants, as far as a cheap test tells.
    fn teeth_are_clear(&self, from: &TiltingMotion<T>, to: &TiltingMotion<T>, span_s: T) -> bool {
        if self.freedom == Freedom::Full {
            self.clear.teeth_are_clear::<true>(&from.place(), &to.place(), span_s)
        } else {
            self.clear.teeth_are_clear::<false>(&from.place(), &to.place(), span_s)
        }
    }

    /// Solves all contacts that are closed at the instant of `next`, or open by less than `touch_m`.
    #[expect(clippy::too_many_arguments, reason = "an instant of contact, and the records of it")]
    fn meet<L: TiltingLedger<T>>(
        &self,
        forcing: &Forcing<T>,
        motion: &mut TiltingMotion<T>,
        next: &NextContact,
        touch_m: T,
        before_end_s: T,
        contacts: &mut TiltingContacts<T>,
        ledger: &mut L,
    ) {
        let zero = T::zero();
        let mut set = ContactSet::new();
        let mut velocities = motion.velocities();
        let mut stays = motion.in_contact;
        // Teeth that strike in turn open again between their blows, and come to rest together. Edges that strike in
        // turn keep their rebounds: those carry the motion at the pin.
        let in_turn = touch_m > T::from_f64(TOUCH_M);
        for place in ContactPlace::ALL {
            let sustained = motion.in_contact.contains(place);
            let Some((gap_m, rate_m_s)) = self.gap_at(motion, place) else { continue };
            let chosen =
                place == next.place || (self.freedom != Freedom::Full && is_other_edge(place, next.place));
            let touches = gap_m <= touch_m && (rate_m_s < zero || (in_turn && !place.is_hub()));
            if !(sustained || chosen || touches) {
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
        set.report(&velocities, false, before_end_s, contacts, ledger);
        // Found too deep by rounding and by the error of the cubic.
        let mut inside = ContactPlaces::NONE;
        for solved in &set.contacts {
            if solved.contact.gap_m < zero {
                inside = inside.with(solved.contact.place);
            }
        }
        if !inside.is_empty() {
            let before = motion.under(forcing);
            self.lift_out(motion, inside);
            if L::RECORDS {
                ledger.moved(&before, &motion.under(forcing));
            }
        }
    }

    /// Applies the sustained contacts of `from` to `to`, the free motion `span_s` later. What they did is in `set`.
    #[inline]
    fn sustain(
        &self,
        from: &TiltingMotion<T>,
        to: &mut TiltingMotion<T>,
        span_s: T,
        set: &mut ContactSet<T>,
    ) {
        set.contacts.clear();
        if !from.in_contact.is_empty() {
            self.press(from.in_contact, to, span_s, set);
        }
    }

    /// Presses the contacts `places` shut over the last `span_s`.
    fn press(&self, places: ContactPlaces, to: &mut TiltingMotion<T>, span_s: T, set: &mut ContactSet<T>) {
        let pressing = Pressing::new(span_s, self.step);
        set.contacts.clear();
        to.modes.drop_below(T::from_f64(MODAL_FLOOR));
        let mut velocities = to.velocities();
        for place in ContactPlace::ALL {
            if !places.contains(place) {
                continue;
            }
            let Some(contact) = self.contact_at(to, place) else { continue };
            let speed = contact.normal.speed(&velocities);
            let bias = pressing.bias(place, contact.gap_m, speed);
            set.add(contact, bias, &velocities);
        }
        set.solve(&self.mobility, &mut velocities, self.freedom != Freedom::Full);
        to.set_velocities_evenly(&velocities, &self.follow, span_s / self.step, span_s);
        to.in_contact = ContactPlaces::NONE;
        let half_s = T::from_f64(0.5) * span_s;
        for solved in &set.contacts {
            // What hardly opens is still closed: of four teeth at rest one carries nothing.
            let moved_m = half_s * (solved.speed_after - solved.speed_before);
            if solved.normal_n_s > T::zero() || solved.contact.gap_m + moved_m <= T::from_f64(OPEN_M) {
                to.in_contact = to.in_contact.with(solved.contact.place);
            }
        }
        if !to.in_contact.at_hub().is_empty() {
            self.lift_out_of_pin(to);
        }
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
        ledger.motion(&here.under(forcing), left);
        let free = *end;
        let mut closed = here.in_contact.and(self.closed_at(end));
        let mut set = ContactSet::new();
        // What one contact presses on the rotor may close another.
        for _ in 0..SHUT_ROUNDS {
            *end = free;
            self.press(closed, end, left * self.step, &mut set);
            let more = closed.and(self.closed_at(end));
            if more == closed {
                break;
            }
            closed = more;
        }
        report_sustained(forcing, &free, end, &set, T::zero(), contacts, ledger);
    }

    /// Where the gap is closed.
    fn closed_at(&self, motion: &TiltingMotion<T>) -> ContactPlaces {
        ContactPlace::ALL.into_iter().fold(ContactPlaces::NONE, |closed, place| {
            let is_closed = self.gap_at(motion, place).is_some_and(|(gap_m, _)| gap_m <= T::zero());
            if is_closed { closed.with(place) } else { closed }
        })
    }

    fn restitution(&self, place: ContactPlace) -> T {
        let [tooth, _, _, _] = &self.teeth;
        if place.is_hub() { self.hub.restitution } else { tooth.restitution }
    }
}

/// Reports what the sustained contacts of a span did.
fn report_sustained<T: Real, L: TiltingLedger<T>>(
    forcing: &Forcing<T>,
    free: &TiltingMotion<T>,
    end: &TiltingMotion<T>,
    set: &ContactSet<T>,
    before_end_s: T,
    contacts: &mut TiltingContacts<T>,
    ledger: &mut L,
) {
    if !set.contacts.is_empty() {
        set.report(&end.velocities(), true, before_end_s, contacts, ledger);
        if L::RECORDS {
            ledger.moved(&free.under(forcing), &end.under(forcing));
        }
    }
}

/// Whether the edge `place`, met at the start of a span, was pressed there by the friction of the other edge, which is
/// in sustained contact: both are wedged, and a rebound would end at once.
fn is_pressed_in<T: Real>(from: &TiltingMotion<T>, place: ContactPlace, at: T) -> bool {
    let other = match place {
        ContactPlace::UpperEdge => ContactPlace::LowerEdge,
        ContactPlace::LowerEdge => ContactPlace::UpperEdge,
        _ => return false,
    };
    at <= T::zero() && from.in_contact.contains(other)
}

/// Whether both are edges of the hole.
fn is_other_edge(a: ContactPlace, b: ContactPlace) -> bool {
    a.is_hub() && b.is_hub()
}
