//! What is told of the sample period at hand, and what the filter does with it.

use heapless::{Deque, Vec};
use motor_model::{Real, Time};

use super::super::modes_at::entries;
use super::super::states::{MASS_RATIO, Row};
use super::super::{KickRecord, MeasuredImpact, TwinFilter, Uncertain};
use super::{ToldKick, ToldParts, TrueContact};
use crate::vibrometer::impact_detector::VibrometerEvent;
use crate::vibrometer::motion::Motion;

/// Contacts that wait for their sample at most: those of ten periods of a plant that is stepped at 1 us.
const WAITING_MAX: usize = 64;
/// Variance of a jump that is told, in m^2/s^2: 1 um/s, far below every noise, and above what `f32` loses.
const JUMP_TOLD_M2_S2: f64 = 1e-12;
/// Variance of an instant that is told, in s^2: 1 ns, to which times are kept.
const INSTANT_TOLD_S2: f64 = 1e-18;

/// What has been told and, of it, what belongs to the sample period at hand.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct ToldPeriod<T> {
    pub(super) parts: ToldParts,
    waiting: Deque<TrueContact<T>, WAITING_MAX>,
    /// The impact that the vibrometer detects; `None` where it detects none, or a false one.
    detected: Option<TrueContact<T>>,
    /// Whether the vibrometer detects an impact.
    detects: bool,
    /// The other contacts.
    others: Vec<TrueContact<T>, WAITING_MAX>,
    /// The jump that was measured or told.
    jump_m_s: Uncertain<T>,
}

impl<T: Real> ToldPeriod<T> {
    /// Keeps a contact until its sample comes. Of too many the oldest go: their sample was lost.
    pub(super) fn tell(&mut self, contact: &TrueContact<T>) {
        if self.is_told() {
            if self.waiting.is_full() {
                self.waiting.pop_front();
            }
            // There is room now.
            let _ = self.waiting.push_back(*contact);
        }
    }

    /// Whether anything is told.
    pub(in super::super) fn is_told(&self) -> bool {
        self.parts != ToldParts::default()
    }

    /// Whether the filter is told that the impact at hand was none.
    pub(in super::super) fn is_false_alarm(&self) -> bool {
        let ToldParts { pair, small_impacts, .. } = self.parts;
        self.detected.is_none() && (small_impacts || pair && self.others.is_empty())
    }

    /// Whether the filter is told that a pair of teeth struck, so that the rotor does not ride.
    pub(in super::super) fn bounces(&self) -> bool {
        self.parts.pair && self.detected.is_some()
    }

    /// The pair of teeth of the impact at hand; `None` where it is not told.
    pub(in super::super) fn pair(&self) -> Option<u8> {
        let tooth = self.detected.and_then(|detected| detected.tooth);
        tooth.filter(|_| self.parts.pair).map(|tooth| tooth.pair)
    }

    /// Variance of its instant, which is `untold_s2` where it is not told.
    pub(in super::super) fn instant_s2(&self, untold_s2: T) -> T {
        let told = self.parts.instant && self.detected.is_some();
        if told { T::from_f64(INSTANT_TOLD_S2) } else { untold_s2 }
    }

    /// Takes the contacts of the period that ends at `until`.
    fn begin(&mut self, until: Time, detects: bool) {
        (self.detected, self.detects) = (None, detects);
        self.others.clear();
        while let Some(contact) = self.waiting.pop_front_if(|contact| contact.at <= until) {
            let largest = self.detected.is_none_or(|largest| contact.jump_m_s > largest.jump_m_s);
            let other = if detects && contact.tooth.is_some() && largest {
                self.detected.replace(contact)
            } else {
                Some(contact)
            };
            // There are no more than have waited.
            let _ = other.map(|other| self.others.push(other));
        }
    }

    /// Sum of the jumps of the other contacts until then.
    fn others_m_s(&self, until: Time) -> T {
        let others = self.others.iter().filter(|other| other.at <= until);
        others.fold(T::zero(), |sum, other| sum + other.jump_m_s)
    }

    /// Puts what is told of an impact, in the period that ends at `until`, in the place of what was measured of it.
    pub(in super::super) fn measured(
        &mut self,
        until: Time,
        gravity_m_s2: T,
        mut impact: MeasuredImpact<T>,
    ) -> MeasuredImpact<T> {
        let Some(detected) = self.detected else { return impact };
        let back_s: T = until.seconds_since(detected.at);
        let (earlier_m_s, all_m_s) = (self.others_m_s(detected.at), self.others_m_s(until));
        if self.parts.jump {
            // Without small impacts the jump is that of all together, from before the first.
            impact.before_m_s = detected.before_m_s - earlier_m_s - gravity_m_s2 * back_s;
            impact.jump_m_s = detected.jump_m_s + all_m_s;
            impact.jump_m2_s2 = T::from_f64(JUMP_TOLD_M2_S2);
        }
        if self.parts.small_impacts {
            impact.before_m_s += earlier_m_s;
            impact.jump_m_s -= all_m_s;
        }
        if self.parts.instant {
            // The middle of the time within which it was is the instant.
            impact.within_s = T::from_f64(2.0) * back_s;
        }
        self.jump_m_s = Uncertain { value: impact.jump_m_s, variance: impact.jump_m2_s2 };
        impact
    }
}

impl<T: Real> TwinFilter<T> {
    /// Takes what was told of the period that ends at `until`, up to the impact that the vibrometer detects.
    pub(in super::super) fn begin_told_period(&mut self, until: Time, event: VibrometerEvent<T>) {
        if !self.told.is_told() {
            return;
        }
        let detects = matches!(event, VibrometerEvent::Impact { .. })
            && !self.detector.has_fault()
            && self.watch.motion(until) != Motion::Quiet;
        self.told.begin(until, detects);
        let limit = self.told.detected.map_or(until, |detected| detected.at);
        self.take_small_impacts(Time::ZERO, limit, until);
    }

    /// Takes the rest of it.
    pub(in super::super) fn end_told_period(&mut self, until: Time) {
        if let Some(detected) = self.told.detected.take() {
            self.take_small_impacts(detected.at.plus_nanos(1), until, until);
        }
    }

    /// Puts what is told of the impact at hand into its kick. Where the filter has not explained the impact, the kick
    /// by a tooth of known velocity follows from the jump, beside what the vibrometer does not detect.
    pub(in super::super) fn improve_as_told(&self, kick: &mut KickRecord<T>) {
        let ToldPeriod { parts, detected, jump_m_s, .. } = &self.told;
        let Some(detected) = detected.filter(|_| !kick.told.is_small()) else { return };
        let Some(tooth) = detected.tooth else { return };
        let c = self.tuning.without_stator.kick_per_jump_rad_m;
        if parts.instant {
            (kick.at, kick.at_s2) = (detected.at, T::zero());
        }
        kick.told.friction = parts.friction.then(|| tooth.kick_per_jump_rad_m / c);
        if parts.tooth_velocity {
            kick.told.tooth_velocity = true;
            kick.tooth_rate_rad_s = Uncertain { value: tooth.rate_rad_s, variance: T::zero() };
            if !kick.refinable {
                let &Uncertain { value, variance } = jump_m_s;
                kick.kick_max_rad_s = Uncertain { value: c * value, variance: c * c * variance };
                kick.unknown_rad2_s2 = self.undetected_rad2_s2();
            }
        }
    }

    /// Takes the contacts that the vibrometer does not detect, `from` then `to` then, of the period that ends at
    /// `until`: the recoil of each, and one kick for all.
    fn take_small_impacts(&mut self, from: Time, to: Time, until: Time) {
        if !self.told.parts.small_impacts {
            return;
        }
        let mut small = self.told.others.clone();
        small.retain(|other| (from..=to).contains(&other.at));
        let Some(newest) = small.iter().map(|other| other.at).max() else { return };
        if self.watch.motion(until) != Motion::Quiet {
            self.stator.advance(until, self.drive);
            small.iter().for_each(|other| self.take_recoil(other, until));
        }
        let kick_rad_s = small.iter().fold(T::zero(), |sum, other| sum + other.kick_rad_s);
        let at = self.kicks.back().map_or(newest, |kick| kick.at.max(newest));
        let mut kick = KickRecord::of_unknown_sign(at, T::zero());
        kick.told = ToldKick { small_rad_s: Some(kick_rad_s), ..ToldKick::default() };
        self.record_kick(kick);
    }

    /// Applies the recoil of a tooth's small impact to the stator. The samples of a flight show the jump to the height;
    /// those of an impact do not.
    fn take_recoil(&mut self, other: &TrueContact<T>, until: Time) {
        let Some(tooth) = other.tooth else { return };
        let (stator, back_s): (_, T) = (&mut self.stator, until.seconds_since(other.at));
        let recoil = stator.tooth(tooth.pair.into(), &Row::zeros()).recoil;
        let mass_ratio = T::one() + stator.parameters.get(MASS_RATIO).copied().unwrap_or_default();
        let since_s = back_s - stator.behind_s(until);
        let responses = stator.oscillators.each_ref().map(|oscillator| oscillator.after(since_s));
        let height_m = if self.told.detects { back_s * other.jump_m_s } else { T::zero() };
        let blow = recoil * (mass_ratio * other.jump_m_s);
        stator.move_by(entries(&responses, height_m, &blow, |r| [-r.s, -r.s_rate]));
    }
}
