//! What a move will take, said before it starts: its error, its time and the spread of that, from the instruments, the
//! response map and the tolerance.
//!
//! ```text
//! time to measure to s         t = (R T / v) atanh(x) / x,    v = s^2 - floor,    x = sqrt(g R T) / v
//!                              R: variance of a frame, T: their period, g: growth of the variance at rest
//! way                          cruise: distance / rate;   burst by burst: each leaves its spread of its turn
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
use crate::situation::Situation;
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
        #[expect(clippy::cast_precision_loss, reason = "a deadline needs no more than single precision")]
        let deadline_s = 1e-9 * limits.deadline_nanos as f32;
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
        let enough_rad = tuning.sigma_enough_rad(tolerance_rad);
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
        let looks_s = way.look_s + CORRECTIONS * rest_s;
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
        .filter(|cruise| left_rad >= cruise.room_rad() && frames_follow(cruise, tuning.frame_wait_s()));
    if let Some(cruise) = cruise {
        way.drive_s += left_rad / cruise.rate_rad_s.abs();
        way.drives += 1;
        left_rad = cruise.coast_sd_rad.min(0.3 * left_rad);
        way.look_s += look_s(Some(left_rad));
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
    let longest = map.burst(coarse(mode), f32::INFINITY, tuning.limits.amplitude_max)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates, and a part is dropped"
    )]
    let drives = ((left_rad - longest.turn_rad) / longest.turn_rad) as u32;
    #[expect(clippy::cast_precision_loss, reason = "a time needs no more than single precision")]
    let bursts = drives as f32;
    let burst_s = longest.seconds();
    let look_s = look_s(Some(longest.turn_rad));
    let spread = longest.motors_sd_rad / longest.turn_rad;
    way.drive_s += bursts * burst_s;
    way.look_s += bursts * look_s;
    way.far_sd_s = bursts * (burst_s + look_s) * spread;
    way.drives = way.drives.saturating_add(drives);
    Some(left_rad - bursts * longest.turn_rad)
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

impl PositioningTuning {
    /// [`Situation::sigma_enough_rad`] for a tolerance.
    fn sigma_enough_rad(&self, tolerance_rad: f32) -> f32 {
        let situation = Situation {
            remaining_rad: 0.0,
            sigma_rad: 0.0,
            tolerance_rad,
            confidence: self.confidence,
            amplitude_max: self.limits.amplitude_max,
            floor_rad2: self.floor_rad2,
            frame_wait_s: self.frame_wait_s(),
        };
        situation.sigma_enough_rad()
    }
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
mod tests {
    use super::*;
    use estimator::{CameraDescription, VibrometerDescription};

    fn instruments(frames_per_s: u64) -> Instruments {
        let period_nanos = 1_000_000_000 / frames_per_s;
        let camera =
            CameraDescription { period_nanos, latency_nanos: period_nanos, ..CameraDescription::default() };
        Instruments { camera, vibrometer: Some(VibrometerDescription::default()) }
    }

    fn forecast(
        frames_per_s: u64,
        distance_deg: f32,
        tolerance_mdeg: f32,
    ) -> Result<MoveForecast, Unreachable> {
        let limits = Limits { deadline_nanos: 30_000_000_000, ..Limits::default() };
        let tolerance_rad = (1e-3 * tolerance_mdeg).to_radians();
        MoveForecast::try_new(
            &instruments(frames_per_s),
            ResponseMap::table_1(),
            &limits,
            distance_deg.to_radians(),
            tolerance_rad,
        )
    }

    /// Frames of two marks of 17 milli-degrees each: to 0.452 of a tolerance of 1, less the floor of two marks of 0.05,
    /// and 1.3 times as many.
    #[test]
    fn exact_frames_of_the_default_camera() {
        let seen = forecast(10_000, 37.0, 1.0).unwrap();
        let frame_mdeg = 1e3 * (2e-6_f64 / 3.9e-3).to_degrees() / 6_f64.sqrt();
        let needed_mdeg2 = (0.95_f64 / 2.1).powi(2) - 0.0478_f64.powi(2) / 2.0;
        let expected = 1.3 * frame_mdeg * frame_mdeg / needed_mdeg2;
        assert!((f64::from(seen.frames) / expected - 1.0).abs() < 2e-3, "{} {expected}", seen.frames);
        assert!((f64::from(seen.measuring_s) - 1e-4 * expected).abs() < 1e-3 * expected * 1e-4 + 1e-3);
    }

    /// The variance of a rotor at rest, by its differential equation in steps of a frame: the frames until it is the
    /// one wanted, and never below the square root of growth and information.
    #[test]
    fn dual_frames_against_the_variance_frame_by_frame() {
        let camera = CameraDescription { marks: 8, ..CameraDescription::default() };
        let (frame_rad2, period_s) = (camera.variance_rad2(), camera.period_s());
        let least_rad2 = (RESTING_GROWTH_RAD2_S * frame_rad2 * period_s).sqrt();
        for part in [1.1, 1.5, 3.0, 30.0, 1000.0] {
            let wanted_rad2 = part * least_rad2;
            let (mut rad2, mut count) = (frame_rad2, 1_u32);
            while rad2 > wanted_rad2 {
                let predicted_rad2 = rad2 + RESTING_GROWTH_RAD2_S * period_s;
                rad2 = predicted_rad2 * frame_rad2 / (predicted_rad2 + frame_rad2);
                count += 1;
            }
            let found = f64::from(frames(frame_rad2 as f32, period_s as f32, wanted_rad2 as f32).unwrap());
            // A frame more or less, and single precision.
            assert!((found - f64::from(count)).abs() < 2.0 + 2e-3 * found, "{part}: {found} {count}");
        }
        assert_eq!(frames(frame_rad2 as f32, period_s as f32, 0.99 * least_rad2 as f32), None);
    }

    /// A tenth of a milli-degree: refused with two marks, whose floor is too high for it, and told with eight. It takes
    /// four times as long as twice that, and more: approaches begin again.
    #[test]
    fn law_a_tenth_of_a_milli_degree_is_told_or_refused() {
        let refused = forecast(10_000, 5.0, 0.1).unwrap_err();
        let least_mdeg = 1e3 * refused.least_rad.unwrap().to_degrees();
        // Twice the floor in variances, of 0.0338 milli-degrees, is 0.0478: times 2.1 / 0.95, 0.1057. At the shortest
        // step no approach begins again, and 17 s are enough.
        assert!((0.1057..0.1423).contains(&least_mdeg), "{least_mdeg}");
        let camera = CameraDescription { marks: 8, ..CameraDescription::default() };
        let limits = Limits { deadline_nanos: 30_000_000_000, ..Limits::default() };
        let of = |tolerance_mdeg: f32| {
            let instruments = Instruments { camera, ..Instruments::default() };
            let tolerance_rad = (1e-3 * tolerance_mdeg).to_radians();
            MoveForecast::try_new(&instruments, ResponseMap::table_1(), &limits, 0.1, tolerance_rad).unwrap()
        };
        let (fine, coarse) = (of(0.1), of(0.2));
        assert!(fine.measuring_s > 4.0 * coarse.measuring_s, "{fine:?} {coarse:?}");
        assert!(fine.time_95_s() - fine.time_s > fine.measuring_s, "{fine:?}");
    }

    /// A finer tolerance, slower frames and a longer way take longer.
    #[test]
    fn law_time_grows_with_what_is_asked() {
        let time_s = |frames_per_s, distance_deg, tolerance_mdeg| {
            forecast(frames_per_s, distance_deg, tolerance_mdeg).unwrap().time_s
        };
        for distance_deg in [-90.0, -1.0, -0.05, 0.05, 1.0, 90.0] {
            assert!(time_s(10_000, distance_deg, 0.5) > time_s(10_000, distance_deg, 1.0));
            assert!(time_s(1_000, distance_deg, 5.0) > time_s(10_000, distance_deg, 5.0));
            assert!(time_s(200, 4.0 * distance_deg, 50.0) >= time_s(200, distance_deg, 50.0));
        }
    }

    /// The tolerance that is offered instead can be met, and a little less cannot be met in time.
    #[test]
    fn law_what_is_offered_instead_is_the_least() {
        let refused = forecast(200, 37.0, 0.5).unwrap_err();
        let least_mdeg = 1e3 * refused.least_rad.unwrap().to_degrees();
        assert!(least_mdeg > 0.5, "{least_mdeg}");
        let offered = forecast(200, 37.0, least_mdeg).unwrap();
        assert!(offered.time_95_s() <= 30.0 && offered.time_95_s() > 29.0, "{offered:?}");
    }

    /// What would last longer than the deadline in more than one move of twenty is refused, and every rest takes longer
    /// without a vibrometer.
    #[test]
    fn law_a_promise_holds_before_the_deadline() {
        // 30 frames a second to a milli-degree: 920 frames in 30.6 s.
        assert!(forecast(30, 1.0, 1.0).is_err());
        let accepted = forecast(200, 1.0, 1.0).unwrap();
        assert!(accepted.time_s < accepted.time_95_s() && accepted.time_95_s() <= 30.0);
        let camera_only = Instruments { vibrometer: None, ..instruments(10_000) };
        // The mean move ends before this deadline, and not 95 % of them.
        let between_s = 0.5 * (accepted.time_s + accepted.time_95_s());
        let limits = Limits { deadline_nanos: (1e9 * between_s) as u64, ..Limits::default() };
        let (distance_rad, tolerance_rad) = (1_f32.to_radians(), 1e-3_f32.to_radians());
        let map = ResponseMap::table_1();
        assert!(MoveForecast::try_new(&instruments(200), map, &limits, distance_rad, tolerance_rad).is_err());
        let limits = Limits { deadline_nanos: 30_000_000_000, ..Limits::default() };
        let alone =
            MoveForecast::try_new(&camera_only, ResponseMap::table_1(), &limits, 0.1, tolerance_rad).unwrap();
        let both = forecast(10_000, 0.1_f32.to_degrees(), 1.0).unwrap();
        // Five rests and more, each by 15 ms.
        assert!(alone.time_s - both.time_s >= 0.075 - 1e-3, "{} {}", alone.time_s, both.time_s);
    }

    /// A camera of coarse steps and little noise has a floor: no time is enough for less.
    #[test]
    fn law_the_floor_refuses_whatever_the_deadline() {
        let camera = CameraDescription { resolution_m: 4e-6, ..CameraDescription::default() };
        let coarse = Instruments { camera, ..Instruments::default() };
        let limits = Limits { deadline_nanos: 86_400_000_000_000, ..Limits::default() };
        let of = |tolerance_mdeg: f32| {
            let tolerance_rad = (1e-3 * tolerance_mdeg).to_radians();
            MoveForecast::try_new(&coarse, ResponseMap::table_1(), &limits, 0.6, tolerance_rad)
        };
        let least_mdeg = 1e3 * of(1.0).unwrap_err().least_rad.unwrap().to_degrees();
        // The floor of two marks of 3.86 milli-degrees each, twice in variances, over 0.95 / 2.1.
        assert!((least_mdeg / (3.86 * 2.1 / 0.95) - 1.0).abs() < 0.02, "{least_mdeg}");
        assert!(of(1.01 * least_mdeg).is_ok() && of(0.99 * least_mdeg).is_err());
    }
}
