//! What a move will take, said before it starts: its error, its time and the spread of that, from the instruments, the
//! response map and the tolerance.
//!
//! ```text
//! time to measure to s         t = (R T / v) atanh(x) / x,    v = s^2 - floor,    x = sqrt(g R T) / v
//!                              R: variance of a frame, T: their period, g: growth of the variance at rest
//! way                          cruise: distance / rate, and a look after each time that the drive may be on at most;
//!                              burst by burst: each leaves its spread of its turn, and is driven whole
//! a look after each drive      until rest, and frames until half of what a coarse drive has left is known; what is
//!                              measured between steps and walks counts at the end
//! at the end                   1.3 times that to the tolerance, 1.6 times below the shortest step, and four rests:
//!                              some of the corrections lose what was known
//! ```
//!
//! The variance `P` of a resting rotor's angle obeys `P' = g - P^2 / (R T)`. The solution that begins with nothing
//! known is `P = sqrt(g R T) coth(sqrt(g / (R T)) t)`. So no time is enough for `x >= 1`. For a small x the time is
//! that of `n = R / v` frames.
//!
//! The target counts as reached at a risk of 3.6 % at most ([`crate::situation::Confidence`]), so the error promised to
//! 95 % of the moves is the tolerance. A tolerance is refused when floor or growth does not let it be known, and
//! when fewer than 95 % of the moves would end before the deadline.

use core::fmt;

use estimator::{Instruments, RESTING_GROWTH_RAD2_S};
use motor_model::{DriveMode, math};

use crate::drive_plan::frames_follow;
use crate::positioning::PositioningTuning;
use crate::response_map::{Burst, Family, ResponseMap};
use crate::target::Limits;

/// What a move will take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveForecast {
    /// Error in rad within which 95 % of the moves end.
    pub error_rad: f32,
    /// Expected time in s.
    pub time_s: f32,
    /// Standard deviation of that over motors, in s.
    pub time_sd_s: f32,
    /// Its part that measures to the tolerance, in s.
    pub measuring_s: f32,
    /// Frames that are measured for that.
    pub frames: f32,
    /// Drives until the target is near enough to be measured to the tolerance.
    pub drives: u32,
}

/// A tolerance that cannot be met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// The tolerance asked for, in rad.
    pub tolerance_rad: f32,
    /// The least tolerance that can be met before the deadline, in rad; `None` if not even ten degrees can.
    pub least_rad: Option<f32>,
    /// The time that it takes, in s.
    pub time_s: f32,
}

/// Largest tolerance that is searched, in rad: ten degrees.
const TOLERANCE_MAX_RAD: f32 = 0.1745;
/// Halvings of the search: from ten degrees to a tenth of the smallest tolerance, and to a thousandth of that.
const HALVINGS: u32 = 40;
/// Most drives from the longest burst to the target: each leaves at most 0.9 of what was left.
const NEAR_DRIVES_MAX: u32 = 200;
/// Frames measured in all, per frames that the tolerance needs: a correction loses a part of what was known before it.
/// From `host-sim positioning-trials`.
const MEASURED_TWICE: f32 = 1.3;
/// Standard deviation of the time, per time measured. From the same.
const MEASURING_SPREAD: f32 = 0.45;
/// The same where the shortest step turns by more than the tolerance: a rotor that comes too near has to begin the
/// approach again. The times have a long tail, so the deviation is the one with which 95 % of the moves are in time.
/// From `host-sim positioning-trials --tolerance 0.0001 --set camera.marks=8`.
const MEASURED_BELOW_THE_SHORTEST: f32 = 1.6;
const SPREAD_BELOW_THE_SHORTEST: f32 = 0.85;
/// Part of a look's time by which looks differ. An assumption.
const LOOK_SPREAD: f32 = 0.5;
/// Time in s from the end of a drive until rest is concluded, beside frames: coast and ring-down, as a vibrometer shows
/// them, and by the design alone.
const RUN_OUT_S: f32 = 0.02;
const RUN_OUT_UNSEEN_S: f32 = 0.035;
/// Corrections near the target, beside the drives of the way. From `host-sim positioning-trials`: ten drives in the
/// median.
const CORRECTIONS: f32 = 4.0;
/// Frames that conclude rest: four, and two until the first of a rotor at rest is there. An assumption.
const REST_FRAMES: f32 = 6.0;
/// Part of its spread to which the angle after a drive is measured before the next.
const LOOK_PART: f32 = 0.5;
/// Floors, in variances, by which what is needed must exceed the floor, so that a target can be told from its
/// neighbours.
const FLOORS: f32 = 2.0;

/// Sums over the way.
#[derive(Clone, Copy, Default)]
struct Way {
    /// Drives, and the looks at which a cruise is cut, whose number spreads over motors as the time of the cruise.
    drive_s: f32,
    look_s: f32,
    /// Standard deviation over motors of the time of the bursts that are as long as the map has them, in s.
    far_sd_s: f32,
    drives: u32,
}

impl MoveForecast {
    /// The forecast of a move by `distance_rad`, clockwise positive, to within `tolerance_rad`.
    ///
    /// # Errors
    /// When the tolerance cannot be met by these instruments, or not before the deadline.
    pub fn try_new(
        instruments: &Instruments,
        map: &ResponseMap,
        limits: &Limits,
        distance_rad: f32,
        tolerance_rad: f32,
    ) -> Result<Self, Unreachable> {
        let deadline_s = limits.deadline_s();
        let tuning = PositioningTuning { limits: *limits, ..PositioningTuning::new(instruments) };
        let of = |tolerance_rad| Self::of(instruments, map, &tuning, distance_rad, tolerance_rad);
        if let Some(forecast) = of(tolerance_rad)
            && forecast.time_95_s() <= deadline_s
        {
            return Ok(forecast);
        }
        let (mut refused_rad, mut least) = (tolerance_rad, None);
        let (mut most_rad, mut halvings) = (TOLERANCE_MAX_RAD, 0);
        while halvings < HALVINGS {
            let middle_rad = if halvings == 0 { most_rad } else { math::sqrt_f32(refused_rad * most_rad) };
            if halvings > 0 && (middle_rad <= refused_rad || middle_rad >= most_rad) {
                break;
            }
            match of(middle_rad).filter(|forecast| forecast.time_95_s() <= deadline_s) {
                Some(forecast) => (most_rad, least) = (middle_rad, Some(forecast)),
                None if halvings == 0 => break,
                None => refused_rad = middle_rad,
            }
            halvings += 1;
        }
        Err(Unreachable {
            tolerance_rad,
            least_rad: least.map(|forecast| forecast.error_rad),
            time_s: least.map_or(0.0, |forecast| forecast.time_s),
        })
    }

    /// Time in s within which 95 % of the moves end: expected, and 1.65 standard deviations.
    pub fn time_95_s(&self) -> f32 {
        self.time_s + 1.65 * self.time_sd_s
    }

    /// `None` where floor or growth is too high for the tolerance, or no drive of the map leads to the target.
    // Never inlined: a microcontroller has room for one copy.
    #[inline(never)]
    fn of(
        instruments: &Instruments,
        map: &ResponseMap,
        tuning: &PositioningTuning,
        distance_rad: f32,
        tolerance_rad: f32,
    ) -> Option<Self> {
        let enough_rad = tuning.confidence.sigma_enough_rad(tolerance_rad);
        let enough_rad2 = enough_rad * enough_rad;
        if enough_rad2 < FLOORS * tuning.floor_rad2 {
            return None;
        }
        let camera = &instruments.camera;
        #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
        let (frame_rad2, period_s) = (camera.variance_rad2() as f32, camera.period_s() as f32);
        let run_out_s = if instruments.vibrometer.is_some() { RUN_OUT_S } else { RUN_OUT_UNSEEN_S };
        let rest_s = run_out_s + REST_FRAMES * period_s + tuning.frame_wait_s();
        let shortest_step = map.range_rad(Family::Step, tuning.limits.amplitude_max);
        let (measured, measuring_spread) =
            if shortest_step.is_some_and(|(shortest, _)| shortest > tolerance_rad) {
                (MEASURED_BELOW_THE_SHORTEST, SPREAD_BELOW_THE_SHORTEST)
            } else {
                (MEASURED_TWICE, MEASURING_SPREAD)
            };
        let frames = frames(frame_rad2, period_s, enough_rad2 - tuning.floor_rad2)?.max(1.0) * measured;
        let look_s = |left_rad: Option<f32>| {
            let frames = left_rad.map_or(0.0, |left_rad| {
                let known_rad = LOOK_PART * left_rad;
                (frame_rad2 / (known_rad * known_rad)).min(frames)
            });
            rest_s + period_s * frames
        };
        let way = way(map, tuning, distance_rad, enough_rad, look_s)?;
        let measuring_s = frames * period_s;
        // A rotor that is there already is only measured.
        let corrections = if way.drives > 0 { CORRECTIONS } else { 0.0 };
        let looks_s = way.look_s + corrections * rest_s;
        let spread_s2 = [measuring_spread * measuring_s, LOOK_SPREAD * looks_s, rest_s, way.far_sd_s]
            .map(|part_s| part_s * part_s)
            .into_iter()
            .sum::<f32>();
        Some(Self {
            error_rad: tolerance_rad,
            time_s: rest_s + way.drive_s + looks_s + measuring_s,
            time_sd_s: math::sqrt_f32(spread_s2 + way.drive_s * way.drive_s * RATE_SPREAD * RATE_SPREAD),
            measuring_s,
            frames,
            drives: way.drives,
        })
    }
}

/// Frames of variance `frame_rad2`, one every `period_s`, until the angle of a resting rotor has the variance
/// `wanted_rad2`; `None` where it never has. See the head of this module.
#[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
fn frames(frame_rad2: f32, period_s: f32, wanted_rad2: f32) -> Option<f32> {
    let least_rad2 = math::sqrt_f32(RESTING_GROWTH_RAD2_S as f32 * period_s * frame_rad2);
    let x = least_rad2 / wanted_rad2;
    let longer =
        if x < NO_GROWTH { 1.0 } else { 0.5 * math::ln(f64::from((1.0 + x) / (1.0 - x))) as f32 / x };
    (x < 1.0).then_some(frame_rad2 / wanted_rad2 * longer)
}

/// Least variance that is reached, per variance wanted, below which growth takes no time: less than 1e-4 of it.
const NO_GROWTH: f32 = 0.015;

/// Standard deviation of the time of a cruise over motors, per time. From the map: 8 % in mode B, 21 % in mode C.
const RATE_SPREAD: f32 = 0.2;

/// The way to within `enough_rad` of the target, drive by drive.
fn way(
    map: &ResponseMap,
    tuning: &PositioningTuning,
    distance_rad: f32,
    enough_rad: f32,
    look_s: impl Fn(Option<f32>) -> f32,
) -> Option<Way> {
    let mode = if distance_rad > 0.0 { DriveMode::B } else { DriveMode::C };
    let amplitude_max = tuning.limits.amplitude_max;
    let mut way = Way::default();
    let mut left_rad = distance_rad.abs();
    let cruise = map
        .cruise_within(mode, amplitude_max, left_rad)
        .filter(|cruise| left_rad >= map.cruise_from_rad(mode).max(cruise.room_rad()))
        .filter(|cruise| frames_follow(cruise, tuning.frame_wait_s()));
    if let Some(cruise) = cruise {
        let cruise_s = left_rad / cruise.rate_rad_s.abs();
        let cuts = floored(cruise_s / tuning.limits.on_max_s());
        way.drives = cuts.saturating_add(1);
        left_rad = cruise.coast_sd_rad.min(0.3 * left_rad);
        let look_s = look_s(Some(left_rad));
        way.drive_s = cruise_s + real(cuts) * look_s;
        way.look_s = look_s;
    } else {
        left_rad = far(map, tuning, mode, left_rad, &look_s, &mut way)?;
    }
    let mut near_drives = 0;
    while left_rad > enough_rad && near_drives < NEAR_DRIVES_MAX {
        near_drives += 1;
        let Some((family, burst)) = burst(map, mode, amplitude_max, left_rad) else { break };
        let spread_rad = math::sqrt_f32(
            burst.motors_sd_rad * burst.motors_sd_rad + burst.repeat_sd_rad * burst.repeat_sd_rad,
        );
        way.drive_s += burst.seconds();
        way.drives = way.drives.saturating_add(1);
        // At least a tenth of the way is gone with each: else the map has no burst for it.
        left_rad = ((left_rad - burst.turn_rad).max(0.0) + spread_rad).min(0.9 * left_rad);
        let fine = matches!(family, Family::Step | Family::Walk);
        way.look_s += look_s((!fine).then_some(left_rad));
    }
    Some(way)
}

/// The part of the way beyond the longest burst of the map, by such bursts; the distance that they leave. `None` where
/// the mode has none.
///
/// The relative spread of its time over motors is that of the turn. An assumption: in a design of four times the mass,
/// whose turns spread by as much as their mean, the slowest of six motors takes twice the mean time.
fn far(
    map: &ResponseMap,
    tuning: &PositioningTuning,
    mode: DriveMode,
    left_rad: f32,
    look_s: impl Fn(Option<f32>) -> f32,
    way: &mut Way,
) -> Option<f32> {
    let near = [Family::Step, Family::Walk]
        .iter()
        .filter_map(|family| map.range_rad(*family, tuning.limits.amplitude_max))
        .any(|(_, longest_rad)| left_rad <= longest_rad);
    if near {
        return Some(left_rad);
    }
    // A map may be without strides.
    let longest = [coarse(mode), Family::Walk, Family::Step]
        .into_iter()
        .filter(|family| family.mode() == mode)
        .find_map(|family| map.burst(family, f32::INFINITY, tuning.limits.amplitude_max))?;
    let drives = floored((left_rad - longest.turn_rad) / longest.turn_rad);
    let bursts = real(drives);
    let burst_s = longest.seconds();
    let look_s = look_s(Some(longest.turn_rad));
    let spread = longest.motors_sd_rad / longest.turn_rad;
    way.drive_s += bursts * burst_s;
    way.look_s += bursts * look_s;
    way.far_sd_s = bursts * (burst_s + look_s) * spread;
    way.drives = way.drives.saturating_add(drives);
    Some(left_rad - bursts * longest.turn_rad)
}

/// Whole drives in `drives`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, and a part is dropped"
)]
fn floored(drives: f32) -> u32 {
    drives as u32
}

/// `drives` in single precision.
#[expect(clippy::cast_precision_loss, reason = "a time needs no more than single precision")]
fn real(drives: u32) -> f32 {
    drives as f32
}

/// The family of the longest bursts of `mode`.
fn coarse(mode: DriveMode) -> Family {
    match mode {
        DriveMode::B => Family::Throw,
        DriveMode::C => Family::Stride,
    }
}

/// The burst for `left_rad`: the coarse family of the mode, then the fine ones of mode C, from which the target is
/// approached last.
fn burst(map: &ResponseMap, mode: DriveMode, amplitude_max: f32, left_rad: f32) -> Option<(Family, Burst)> {
    [Family::Step, Family::Walk, coarse(mode)]
        .into_iter()
        .filter_map(|family| {
            let (_, longest_rad) = map.range_rad(family, amplitude_max)?;
            Some((left_rad <= longest_rad, (family, map.burst(family, left_rad, amplitude_max)?)))
        })
        .reduce(|finer, coarser| if finer.0 { finer } else { coarser })
        .map(|(_, burst)| burst)
}

impl fmt::Display for Unreachable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tolerance_rad, least_rad, time_s } = self;
        write!(f, "a tolerance of {:.5} deg cannot be met before the deadline", tolerance_rad.to_degrees())?;
        match least_rad {
            Some(least_rad) => write!(f, "; {:.5} deg takes {time_s:.1} s", least_rad.to_degrees()),
            None => write!(f, ", and no tolerance up to 10 deg can"),
        }
    }
}

impl core::error::Error for Unreachable {}

#[cfg(test)]
mod tests;
