//! How angle and rate go on under the kicks that the twin tells.

use heapless::Deque;
use motor_model::{Real, Time};

use super::belief::{KickSlopes, ScaledBelief};
use super::contact::Known;
use super::tuning::TwinTuning;
use crate::camera::track::{Jitter, Process, State};
use crate::camera::track_covariance::TrackCovariance as _;
use crate::filters::impact_aided::IMPACTS_KEPT_MAX;
use crate::filters::kick::KickMoments;
use crate::vibrometer::motion::Motion;

/// An impact as the rate feels it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strike<T> {
    pub(super) at: Time,
    /// Variance of the instant, in s^2.
    pub(super) at_s2: T,
    /// Largest kick at nominal friction, `mu k dv / R_t`, in rad/s.
    pub(super) limit_rad_s: Known<T>,
    /// Rate at which the tooth would carry the rotor, `S`, in rad/s.
    pub(super) tooth_rad_s: Known<T>,
    /// What else may have kicked the rate about then, in rad^2/s^2.
    pub(super) unknown_rad2_s2: T,
    /// Whether what follows tells more of it.
    pub(super) amendable: bool,
    /// Whether it is the first under another mode than those before.
    pub(super) in_other_mode: bool,
}

/// The strikes since the oldest frame kept, in the order of time.
pub(super) type Strikes<T> = Deque<Strike<T>, IMPACTS_KEPT_MAX>;

/// The rate jumps as the twin says.
pub(super) struct Driven<'a, T> {
    pub(super) tuning: &'a TwinTuning<T>,
    pub(super) strikes: &'a Strikes<T>,
    pub(super) motion: Motion,
    /// Until when impacts would have been heard.
    pub(super) heard_until: Time,
    /// Process noise meanwhile, in rad^2/s^3.
    pub(super) between_rad2_s3: T,
    /// What is already known of the way ahead.
    pub(super) ahead: Option<&'a Ahead<T>>,
}

/// The track after all strikes known: whoever asks for the present need not go through them again, however many there are since the last frame.
///
/// The newest strike may still become better known, so the track before it is kept too. Each strike is passed under the motion in which it came.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead<T> {
    /// Where the track stood.
    pub(super) from: Time,
    resting: bool,
    /// Before the newest strike, and after it.
    settled: TwinState<T>,
    pub(super) state: TwinState<T>,
}

impl<T: Real> Ahead<T> {
    /// From the track as it is, through all strikes of the `process`; `None` if there are none after it.
    pub(super) fn of(state: &TwinState<T>, resting: bool, process: &Driven<'_, T>) -> Option<Self> {
        let first = process.first_after(state.at);
        let newest = process.strikes.len().checked_sub(1).filter(|&newest| newest >= first)?;
        let mut settled = state.copied();
        (first..newest).for_each(|strike| process.pass(&mut settled, resting, strike));
        let ahead = Self { from: state.at, resting, state: settled.copied(), settled };
        Some(ahead.after_newest(process))
    }

    /// Through one strike more.
    pub(super) fn extended(&self, process: &Driven<'_, T>) -> Self {
        let Self { from, resting, state, .. } = self;
        Self { from: *from, resting: *resting, settled: state.copied(), state: state.copied() }
            .after_newest(process)
    }

    /// The same after the newest strike has become better known.
    pub(super) fn after_newest(&self, process: &Driven<'_, T>) -> Self {
        let mut state = self.settled.copied();
        if let Some(newest) = process.strikes.len().checked_sub(1) {
            process.pass(&mut state, self.resting, newest);
        }
        Self { from: self.from, resting: self.resting, settled: self.settled.copied(), state }
    }

    /// Whether it is on the way of a track from `from` to `until`.
    fn serves(&self, from: Time, until: Time, resting: bool) -> bool {
        self.from == from && self.state.at <= until && self.resting == resting
    }
}

/// Angle and rate with what rides along.
pub(super) type TwinState<T> = State<T, ScaledBelief<T>>;

impl<T: Real> Strike<T> {
    /// One that kicks the rate nobody knows which way, with this variance.
    pub(super) fn unknown(at: Time, variance_rad2_s2: T) -> Self {
        let nothing = Known { value: T::zero(), variance: T::zero() };
        Self {
            at,
            at_s2: T::zero(),
            limit_rad_s: nothing,
            tooth_rad_s: nothing,
            unknown_rad2_s2: variance_rad2_s2,
            amendable: false,
            in_other_mode: false,
        }
    }

    fn apply(&self, state: &mut TwinState<T>) {
        let belief = &mut state.covariance;
        if self.in_other_mode {
            belief.change_mode();
        }
        let (friction, reach) = (belief.friction, belief.reach);
        let friction = if friction > T::zero() { friction } else { T::zero() };
        let (limit, tooth) = (self.limit_rad_s, self.tooth_rad_s);
        let limit_rad_s = if limit.value > T::zero() { limit.value * friction } else { T::zero() };
        let slip = reach * tooth.value - state.rate_rad_s;
        let square = |x: T| x * x;
        // Whether the teeth stick is a matter of slip and limit alike: what is not known of either blurs the corner between them.
        let [friction2, reach2] = belief.scales2();
        let slip_rad2_s2 = belief.rate_rad2_s2() + tooth.variance + reach2 * square(tooth.value);
        let limit_rad2_s2 = friction2 * square(limit.value) + square(friction) * limit.variance;
        let width = root(T::from_f64(3.0) * (slip_rad2_s2 + limit_rad2_s2));
        let kick = KickMoments::new(slip, width, limit_rad_s);
        belief.kick(&KickSlopes {
            per_rate: -kick.per_slip,
            per_friction: kick.per_limit * limit.value,
            per_reach: kick.per_slip * tooth.value,
            variance_rad2_s2: kick.scatter
                + square(kick.per_slip) * tooth.variance
                + square(kick.per_limit * friction) * limit.variance
                + self.unknown_rad2_s2,
            angle_rad2: self.at_s2 * square(kick.mean),
        });
        state.rate_rad_s += kick.mean;
    }
}

impl<T: Real> Driven<'_, T> {
    /// From one impact to the next.
    fn fly(&self, state: &mut TwinState<T>, resting: bool, until: Time) {
        let wander = self.tuning.constant_rate.wander.intensity_rad2_s3(self.motion, resting);
        if self.motion != Motion::Quiet {
            state.wander(until.min(self.heard_until), self.between_rad2_s3);
        }
        if until > state.at {
            state.wander(until, wander);
        }
    }

    /// The first strike after `from`. Most are older than the track: counted from the newest.
    fn first_after(&self, from: Time) -> usize {
        let newer = self.strikes.iter().rev().take_while(|strike| strike.at > from).count();
        self.strikes.len() - newer
    }

    /// To a strike and through it, unless the rotor lies still.
    fn pass(&self, state: &mut TwinState<T>, resting: bool, strike: usize) {
        if let Some(strike) = self.strikes.get(strike)
            && !(resting && self.motion == Motion::Quiet)
        {
            self.fly(state, resting, strike.at);
            strike.apply(state);
        }
    }
}

impl<T: Real> Process<T, ScaledBelief<T>> for Driven<'_, T> {
    fn carry(&self, state: &mut TwinState<T>, resting: bool, until: Time) {
        for index in self.first_after(state.at)..self.strikes.len() {
            if self.strikes.get(index).is_none_or(|strike| strike.at > until) {
                break;
            }
            self.pass(state, resting, index);
        }
        self.fly(state, resting, until);
    }

    #[inline]
    fn cached_state<'a>(&'a self, state: &'a TwinState<T>, resting: bool, until: Time) -> &'a TwinState<T> {
        let ahead = self.ahead.filter(|ahead| ahead.serves(state.at, until, resting));
        ahead.map_or(state, |ahead| &ahead.state)
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        let unheard = at > self.heard_until;
        if unheard { self.tuning.constant_rate.wander.jitter(self.motion) } else { Jitter::none() }
    }
}

/// Square root of what is not negative, by Newton's rule, to a part in a thousand from 1e-4 to 1e6; kept above 1e-3 and below 1e4.
fn root<T: Real>(square: T) -> T {
    let (least, most) = (T::from_f64(1e-6), T::from_f64(1e8));
    // Asked this way round, so that NaN counts as large.
    let bounded = if square < most { square } else { most };
    let bounded = if bounded > least { bounded } else { least };
    let mut root = T::one();
    while root * root > T::from_f64(4.0) * bounded {
        root *= T::from_f64(0.5);
    }
    while root * root < T::from_f64(0.25) * bounded {
        root *= T::from_f64(2.0);
    }
    for _ in 0..3 {
        root = T::from_f64(0.5) * (root + bounded / root);
    }
    root
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, AngleAccumulator};

    use super::*;

    /// A limit of 1 rad/s whose friction is known to 0.29 and a slip of 1 rad/s, exact: their difference is uniform within `w = 0.29 sqrt 3`, and the kick falls short of 1 by the mean
    /// of what it is above 0, `w / 4`; half of an error of the friction is felt.
    #[test]
    fn exact_an_unknown_friction_blurs_the_corner_between_stick_and_slip() {
        let known = |value: f64| Known { value, variance: 0.0 };
        let strike = Strike {
            limit_rad_s: known(1.0),
            tooth_rad_s: known(1.0),
            ..Strike::unknown(Time::from_nanos(1), 0.0)
        };
        let mut state = State {
            at: Time::ZERO,
            angle: AngleAccumulator::at(Angle::ZERO),
            rate_rad_s: 0.0,
            covariance: ScaledBelief::begin(0.0, 0.0, None),
        };
        let [friction2, reach2] = state.covariance.scales2();
        strike.apply(&mut state);
        let short = (3.0 * (friction2 + reach2)).sqrt() / 4.0;
        assert!((state.rate_rad_s - (1.0 - short)).abs() < 1e-3, "{}", state.rate_rad_s);
        let moved = state.covariance.rate_rad2_s2();
        let scatter = (friction2 + reach2) / 16.0;
        assert!((moved - (0.25 * (friction2 + reach2) + scatter)).abs() < 1e-3, "{moved}");
    }

    #[test]
    fn exact_root() {
        for square in [1e-6, 3e-4, 0.7, 1.0, 12.0, 4e4, 1e8_f64] {
            assert!((root(square) / square.sqrt() - 1.0).abs() < 1e-3, "{square}");
        }
        assert!((root(f64::NAN) - 1e4).abs() < 1.0 && (root(f64::INFINITY) - 1e4).abs() < 1.0);
        assert!((root(0.0_f64) - 1e-3).abs() < 1e-6);
    }
}
