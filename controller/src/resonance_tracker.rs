//! The drive's frequency follows a resonance that drifts, by the rates that the drive gives.
//!
//! A motor that warms softens, and its resonances fall. The drive then acts beside them: 1 % beside mode B is one and a
//! half half widths, and a rotor that only rises and falls turns at half of its rate. What is to be kept is the rate,
//! so the rate itself is compared above and below the present frequency.
//!
//! # The filter (C9)
//!
//! Of each mode the offset `x` of the fastest drive from the design's resonance is estimated, with variance `P`. Near
//! it the rate falls as a Gaussian whose width is twice the half width `h = zeta f` of the stator's resonance:
//!
//! ```text
//! ln(r(c) / r(x)) = -((c - x) / 2h)^2
//!
//! pair:   r+ at x + 3h/4, r- at x - 3h/4;      g = (r+ - r-) / (r+ + r-), of mean 3 (x_true - x) / 8h
//!         H = 3 / 8h,   R = 0.127^2 / 2 + (g / 2)^2                   the slope is known by half
//!         K = P H / (H^2 P + R),   x += K g,   P -= K H P             and the other mode by the covariance
//! gate:   g^2 > 9 (H^2 P + 0.127^2 / 2):   P = (g / H)^2 first
//! drift:  P += q t                                                    while the mode is driven
//! loss:   m < v - 3 sqrt(V + s^2 / n), m > v / e, m > 3 s:   P = (1.5 h)^2 of both modes, of correlation 0.9
//! ```
//!
//! Rates `r` are means over 60 ms, per that of the map; `m` and `s^2` are mean and variance of the last `n` of them at
//! `x`, 3 to 8. The variance begins as that of Table 1's motor, as if known from two. `v` and `V` are the factor of
//! this motor's rate and its variance: as they were known when the task began, corrected by the first eight rates.
//! Pairs are driven only while `P > (h / 5)^2`. Below that a drive beside the resonance loses 1 % of its rate. When it
//! is reached `v` is what the next eight rates show: a motor that is slow for another reason is searched once.
//!
//! Only the strongest drive of the map is measured. A weaker one has rate in reserve.

use estimator::{Estimate, ResonanceOffset};
use motor_model::{Angle, DriveCommand, DriveMode, Time, math};

use crate::map_correction::{LearntFactor, MapCorrection};
use crate::response_map::{Cruise, ResponseMap};

/// Time in ns from the begin of a drive until its rate is measured: the rotor reaches it.
const SPIN_UP_NANOS: u64 = 50_000_000;
/// Time in ns from a change of the frequency until a rate is measured: four times the ring-down of mode B.
const RING_DOWN_NANOS: u64 = 16_000_000;
/// Time in ns over which a rate is measured.
const RATE_NANOS: u64 = 60_000_000;
/// The same in s.
const RATE_S: f32 = 6e-2;
/// Variance of a rate over [`RATE_S`], relative to its square, of Table 1's motor at full drive of mode B. Mode C
/// ripples less, and rotors that tilt ripple more.
const RIPPLE: f32 = 0.127 * 0.127;
/// As from how many rates [`RIPPLE`] counts.
const RIPPLE_COUNT: f32 = 2.0;
/// Fewest rates by which a loss is told, and most that a mean remembers.
const COUNT_MIN: f32 = 3.0;
const COUNT_MAX: f32 = 8.0;
/// Part by which the slope of the rate over the frequency is known.
const SLOPE_PART: f32 = 0.5;
/// `q`: growth of the variance in half widths squared a second. A minute of driving makes 20 Hz of mode B.
const DRIFT_PER_S: f32 = 4e-3;
/// Standard deviation, in half widths, of an offset of which nothing is known: 1 % of the frequency.
const UNKNOWN: f32 = 1.5;
/// Correlation of the offsets of both modes, of which nothing is known: what softens the one softens the other.
const CORRELATION: f32 = 0.9;
/// Standard deviation in half widths below which an offset is not measured.
const KNOWN: f32 = 0.2;
/// Distance of the frequencies of a pair from the offset, in half widths.
const BESIDE: f32 = 0.75;
/// Standard deviations by which a rate is too low: a normal error is, once in 700.
const LOW_SIGMAS: f32 = 3.0;
/// Part of the rate that is left two half widths beside the resonance. A slower rotor has another reason.
const LEAST_PART: f32 = 0.37;
/// Standard deviations of a single rate above which a mean has to be: pairs of rates that ripple more tell nothing.
const SMOOTH_SIGMAS: f32 = 3.0;
/// Standard deviations of a pair beyond which its offset was not as well known as thought.
const GATE_SIGMAS: f32 = 3.0;
/// Largest offset in half widths: 2.5 % of the frequency of mode B.
const OFFSET_MAX: f32 = 4.0;

/// The last rates of a mode at its offset, per that of the map.
#[derive(Clone, Copy, Debug, Default)]
struct RecentRates {
    count: f32,
    mean: f32,
    /// Variance about the mean.
    variance: f32,
}

impl RecentRates {
    fn take(&mut self, relative: f32) {
        self.count = (self.count + 1.0).min(COUNT_MAX);
        let (weight, difference) = (1.0 / self.count, relative - self.mean);
        self.mean += weight * difference;
        self.variance = (1.0 - weight) * (self.variance + weight * difference * difference);
    }

    /// Variance of one rate of a motor whose rate is `value`.
    fn ripple(&self, value: f32) -> f32 {
        (RIPPLE_COUNT * RIPPLE * value * value + self.count * self.variance) / (RIPPLE_COUNT + self.count)
    }
}

/// One mode.
#[derive(Clone, Copy, Debug)]
struct TrackedMode {
    offset: ResonanceOffset<f32>,
    half_width_hz: f32,
    recent: RecentRates,
    /// Rate of this motor per rate of the map; `None` where nothing is known of it.
    rate: Option<LearntFactor>,
    /// Whether rates at the offset have shown it.
    is_shown: bool,
}

/// The frequency at which a rate is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    /// That of the offset.
    At,
    /// The first of a pair, above the offset (`1.0`) or below (`-1.0`).
    First(f32),
    /// The second of a pair; its sign, and the rate of the first.
    Second(f32, f32),
}

/// The offsets of both modes, and the rate that is being measured.
#[derive(Clone, Copy, Debug)]
pub struct ResonanceTracker {
    modes: [TrackedMode; 2],
    /// Covariance of both offsets in Hz^2.
    shared_hz2: f32,
    /// Whether the offsets are other than what was told.
    moved: bool,
    /// The drive, without its offset and with it.
    command: DriveCommand,
    tuned: DriveCommand,
    side: Side,
    measured_from: Time,
    from: Option<Angle>,
}

impl TrackedMode {
    fn new(offset: ResonanceOffset<f32>, half_width_hz: f32, rate: LearntFactor) -> Self {
        Self { offset, half_width_hz, recent: RecentRates::default(), rate: Some(rate), is_shown: false }
    }

    fn is_known(&self) -> bool {
        let known_hz = KNOWN * self.half_width_hz;
        self.offset.hz2 <= known_hz * known_hz
    }

    fn unknown_hz2(&self) -> f32 {
        let unknown_hz = UNKNOWN * self.half_width_hz;
        unknown_hz * unknown_hz
    }

    fn move_by(&mut self, hz: f32) {
        let most_hz = OFFSET_MAX * self.half_width_hz;
        self.offset.hz = (self.offset.hz + hz).max(-most_hz).min(most_hz);
    }

    /// Takes a rate at the offset. Whether those of late are lower than this motor's.
    fn take_rate(&mut self, relative: f32) -> bool {
        self.recent.take(relative);
        let RecentRates { count, mean, .. } = self.recent;
        if let Some(LearntFactor { value, variance }) = self.rate {
            let (below, ripple) = (value - mean, self.recent.ripple(value));
            let is_lost =
                below > 0.0 && below * below > LOW_SIGMAS * LOW_SIGMAS * (variance + ripple / count);
            if is_lost {
                let is_smooth = mean * mean > SMOOTH_SIGMAS * SMOOTH_SIGMAS * ripple;
                return count >= COUNT_MIN && mean > LEAST_PART * value && is_smooth;
            }
        }
        if count >= COUNT_MAX && !self.is_shown {
            let shown = LearntFactor { value: mean, variance: self.recent.ripple(mean) / count };
            self.rate = Some(self.rate.map_or(shown, |before| before.fused(shown)));
            self.is_shown = true;
        }
        false
    }
}

impl ResonanceTracker {
    /// Of the motor that `map` describes, from what it has learnt.
    pub fn of(map: &ResponseMap) -> Self {
        let ([b, c], [width_b, width_c]) = (*map.resonances(), map.half_widths_hz());
        let [rate_b, rate_c] = MapCorrection::rates_of(map);
        Self {
            modes: [TrackedMode::new(b, width_b, rate_b), TrackedMode::new(c, width_c, rate_c)],
            shared_hz2: 0.0,
            moved: *map.resonances() != [ResonanceOffset::NONE; 2],
            command: DriveCommand::OFF,
            tuned: DriveCommand::OFF,
            side: Side::At,
            measured_from: Time::ZERO,
            from: None,
        }
    }

    fn mode(&self, mode: DriveMode) -> &TrackedMode {
        let [clockwise, counter_clockwise] = &self.modes;
        match mode {
            DriveMode::B => clockwise,
            DriveMode::C => counter_clockwise,
        }
    }

    /// That mode, and the other one.
    fn modes_from(&mut self, mode: DriveMode) -> (&mut TrackedMode, &mut TrackedMode) {
        let [clockwise, counter_clockwise] = &mut self.modes;
        match mode {
            DriveMode::B => (clockwise, counter_clockwise),
            DriveMode::C => (counter_clockwise, clockwise),
        }
    }

    /// The offsets of modes B and C.
    pub fn offsets(&self) -> [ResonanceOffset<f32>; 2] {
        self.modes.map(|tracked| tracked.offset)
    }

    /// The offsets, if they are other than what was last told here: for the filter.
    pub fn take_moved(&mut self) -> Option<[ResonanceOffset<f32>; 2]> {
        core::mem::take(&mut self.moved).then(|| self.offsets())
    }

    /// `command` at the frequency that it is to have at `now`. Without a usable estimate nothing is measured.
    pub fn tune(
        &mut self,
        map: &ResponseMap,
        now: Time,
        command: DriveCommand,
        estimate: Option<&Estimate<f32>>,
    ) -> DriveCommand {
        let is_new = command != self.command || estimate.is_none();
        let Some(mode) = command.mode() else {
            (self.command, self.tuned) = (command, command);
            return command;
        };
        if is_new {
            self.command = command;
            self.begin(now, SPIN_UP_NANOS);
        } else if now < self.measured_from {
            return self.tuned;
        }
        if let Some(estimate) = estimate.filter(|_| now >= self.measured_from) {
            self.measure(map, now, mode, estimate);
        }
        self.tuned = self.at_side(mode);
        self.tuned
    }

    /// The drive of `mode` at the frequency at which a rate is measured.
    fn at_side(&self, mode: DriveMode) -> DriveCommand {
        let tracked = self.mode(mode);
        let side = match self.side {
            Side::At => 0.0,
            Side::First(side) | Side::Second(side, _) => side,
        };
        let offset_hz = tracked.offset.hz + BESIDE * side * tracked.half_width_hz;
        self.command.with_saturating_offset(offset_hz)
    }

    /// The cruise of `map` in `mode` that is driven, if it is the strongest.
    fn strongest(&self, map: &ResponseMap, mode: DriveMode) -> Option<Cruise> {
        let strongest = map.strongest_cruise(mode, DriveCommand::AMPLITUDE_MAX);
        strongest.filter(|strongest| strongest.amplitude <= self.command.amplitude())
    }

    /// The next rate, after `wait_nanos` at the offset: a burst is never driven beside it.
    fn begin(&mut self, now: Time, wait_nanos: u64) {
        self.side = Side::At;
        (self.measured_from, self.from) = (now.plus_nanos(wait_nanos), None);
    }

    /// The begin or the end of a rate.
    #[cold]
    #[inline(never)]
    fn measure(&mut self, map: &ResponseMap, now: Time, mode: DriveMode, estimate: &Estimate<f32>) {
        let strongest = self.strongest(map, mode);
        let Some(from) = self.from else {
            if self.side == Side::At && strongest.is_some() && !self.mode(mode).is_known() {
                (self.side, self.measured_from) = (Side::First(1.0), now.plus_nanos(RING_DOWN_NANOS));
            } else {
                (self.measured_from, self.from) = (now.plus_nanos(RATE_NANOS), Some(estimate.angle));
            }
            return;
        };
        if let Some(strongest) = strongest {
            let relative = estimate.angle.radians_since::<f32>(from) / RATE_S / strongest.rate_rad_s;
            let half_width_hz = self.mode(mode).half_width_hz;
            self.modes_from(mode).0.offset.hz2 += DRIFT_PER_S * RATE_S * half_width_hz * half_width_hz;
            match self.side {
                Side::At => self.take_rate(mode, relative),
                Side::First(side) => {
                    self.side = Side::Second(-side, relative);
                    (self.measured_from, self.from) = (now.plus_nanos(RING_DOWN_NANOS), None);
                    return;
                }
                Side::Second(side, first) if relative > 0.0 && first > 0.0 => {
                    self.take_contrast(mode, side * (relative - first) / (relative + first));
                }
                Side::Second(..) => (),
            }
        }
        // The next pair begins at once.
        self.begin(now, if self.mode(mode).is_known() { RING_DOWN_NANOS } else { 0 });
    }

    /// A rate of `mode` at its offset, per that of the map.
    fn take_rate(&mut self, mode: DriveMode, relative: f32) {
        let (own, other) = self.modes_from(mode);
        if own.take_rate(relative) {
            own.recent = RecentRates::default();
            (own.offset.hz2, other.offset.hz2) = (own.unknown_hz2(), other.unknown_hz2());
            self.shared_hz2 = CORRELATION * math::sqrt_f32(own.offset.hz2 * other.offset.hz2);
        }
    }

    /// The rates above and below the offset of `mode`: their difference per their sum.
    fn take_contrast(&mut self, mode: DriveMode, contrast: f32) {
        let shared_hz2 = self.shared_hz2;
        let (own, other) = self.modes_from(mode);
        let per_hz = 0.5 * BESIDE / own.half_width_hz;
        let (ripple, slope) = (0.5 * RIPPLE, SLOPE_PART * contrast);
        let square = contrast * contrast;
        if square > GATE_SIGMAS * GATE_SIGMAS * (own.offset.hz2 * per_hz * per_hz + ripple) {
            own.offset.hz2 = square / (per_hz * per_hz);
        }
        let noise = ripple + slope * slope;
        let per_variance = 1.0 / (own.offset.hz2 * per_hz * per_hz + noise);
        let (gain, across) = (own.offset.hz2 * per_hz * per_variance, shared_hz2 * per_hz * per_variance);
        own.move_by(gain * contrast);
        other.move_by(across * contrast);
        own.offset.hz2 *= 1.0 - gain * per_hz;
        other.offset.hz2 -= across * per_hz * shared_hz2;
        if own.is_known() {
            (own.rate, own.is_shown, own.recent) = (None, false, RecentRates::default());
        }
        self.shared_hz2 *= 1.0 - gain * per_hz;
        self.moved = true;
    }
}

#[cfg(test)]
mod tests;
