//! The plan of a calibration: a pilot, and from what it shows the rates and their times that tell the scale factor
//! best.
//!
//! How strongly a rotor goes round cones depends on the motor, on the mode and on the amplitude. In mode B of a rotor
//! that tilts it is up to seventy times the gyroscope's random walk, in mode C a few times, and on a level rotor
//! nothing. So the plan begins with a pilot: a rest, and a turn at the scene's rate and at a slower one to either side.
//! A fit to the pilot finds the strength `W` of each drive. Then the rest of the time is shared out. With the rates `r`
//! and the means `c` of the cubed rate as the pilot's gyroscope shows them, `q` the non-linearity and `N` the random
//! walk,
//!
//! ```text
//! M = sum over the drives of t / (N^2 + W) (r, 1, q c)(r, 1, q c)'  +  diag(0, 0, 1),      sigma = sqrt((M^-1)_11)
//! ```
//!
//! All shares of a rest, one drive clockwise and one the other way in steps of a twentieth are tried, and the least
//! sigma is taken. The reference and the drift of the bias are left out of this: they cost little, and nearly the same
//! in all plans. The turns come in some rounds, so that what drifts slowly is not taken for a part of the rate. The
//! data of the pilot are fitted with the others.
//!
//! A pilot has some eight intervals of a drive: it knows W to half of itself, and misses a weak W that the reference
//! hides. Where the plan shall be as long as an error takes, it is not trusted with the whole: the motor is judged
//! again at the latest when it has turned for twice the time, by all that it has turned, and the plan ends once the fit
//! states what is wanted.
//!
//! The gyroscope of the pilot is the first on its motor; all others on the same motor make the same turns.

use motor_model::math;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::calibration::{Bench, intervals};
use super::schedule::TurnSchedule;
use super::turning::{TurningMotor, TurningRun};
use analysis::gyroscope_fit::{CalibrationFit, FitInterval};
use simulation::math::statistics::NORMAL_95;
use simulation::runs::RunError;
use simulation::scene::Scene;
use simulation::world::instruments::gyroscope::Gyroscope;

/// Rounds of rest, turn, rest and turn back.
const CYCLES: u32 = 3;
/// The share of the time is a whole number of these parts.
const PARTS: u32 = 20;
/// Error of the scale factor that is wanted in 95 % of the calibrations.
pub const WANTED_PPM: f64 = 10.0;
/// Longest plan for which the need of time is sought, in s.
const NEEDED_MAX_S: f64 = 1e5;

/// What the pilot shows of a rate; of rest too.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::struct_field_names, reason = "all end in a unit of seconds or per second")]
pub struct PilotDrive {
    /// The rate asked for, in deg/s.
    pub asked_deg_s: f64,
    /// The rate turned, in deg/s.
    pub rate_deg_s: f64,
    /// Non-linearity of one standard deviation at this rate, in deg/s.
    pub nonlinear_deg_s: f64,
    /// Variance of the noise, random walk and coning, in deg^2 per s.
    pub noise_deg2_s: f64,
    /// Time turned already, in s.
    pub turned_s: f64,
}

/// What was planned last, and what it promises.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TurnPlan {
    /// Motor time in s from which it was planned: that of the pilot, or until a later look.
    pub seen_s: f64,
    /// Motor time in s at the end of the plan.
    pub duration_s: f64,
    /// Rate clockwise in deg/s, and the share of the time until the end for it.
    pub clockwise: (f64, f64),
    /// Rate the other way, negative, and its share.
    pub counter_clockwise: (f64, f64),
    /// Standard deviation of the scale factor that was predicted, in ppm.
    pub predicted_ppm: f64,
    /// The error that 95 % of scale factors were predicted to be within, in ppm.
    pub within_95_ppm: f64,
    /// Motor time in s after which 95 % of scale factors would be within 10 ppm; `None` where no time is enough.
    pub needed_s: Option<f64>,
}

/// Where the time goes: a drive each way and its share, the rest of the time at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shares {
    drives: [usize; 2],
    shares: [f64; 2],
}

/// Standard deviation of the scale factor when each drive turns for the time given, in s.
fn predicted(drives: &[PilotDrive], times_s: impl Fn(usize) -> f64) -> f64 {
    let mut information = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0));
    for (place, drive) in drives.iter().enumerate() {
        let row = Vector3::new(drive.rate_deg_s, 1.0, drive.nonlinear_deg_s);
        information += row * row.transpose() * ((drive.turned_s + times_s(place)) / drive.noise_deg2_s);
    }
    information.try_inverse().map_or(f64::INFINITY, |inverse| math::sqrt(inverse.m11))
}

/// The best shares of `time_s`, and the standard deviation that they promise. The first drive is rest.
fn best(drives: &[PilotDrive], time_s: f64) -> (Shares, f64) {
    let of_side = |clockwise: bool| {
        let is_of_side = move |place: &usize| (drives[*place].asked_deg_s > 0.0) == clockwise;
        (1..drives.len()).filter(is_of_side)
    };
    let mut found = (Shares { drives: [0, 0], shares: [0.0, 0.0] }, f64::INFINITY);
    for clockwise in of_side(true) {
        for counter_clockwise in of_side(false) {
            for one in 0..PARTS {
                for other in 0..PARTS - one {
                    let shares = [one, other].map(|parts| f64::from(parts) / f64::from(PARTS));
                    let tried = Shares { drives: [clockwise, counter_clockwise], shares };
                    let sigma = predicted(drives, |place| time_s * tried.share_of(place));
                    if sigma < found.1 {
                        found = (tried, sigma);
                    }
                }
            }
        }
    }
    found
}

impl Shares {
    fn share_of(&self, place: usize) -> f64 {
        match place {
            0 => 1.0 - self.shares[0] - self.shares[1],
            _ if place == self.drives[0] => self.shares[0],
            _ if place == self.drives[1] => self.shares[1],
            _ => 0.0,
        }
    }
}

/// Motor time in s after which the best plan promises 95 % of scale factors within `within_ppm`, found by halving
/// between powers of two.
fn needed_s(drives: &[PilotDrive], within_ppm: f64) -> Option<f64> {
    let pilot_s: f64 = drives.iter().map(|drive| drive.turned_s).sum();
    let wanted = 1e-6 * within_ppm / NORMAL_95;
    let enough = |time_s: f64| best(drives, time_s).1 <= wanted;
    let mut high_s = pilot_s.max(1.0);
    while !enough(high_s) {
        high_s *= 2.0;
        if high_s > NEEDED_MAX_S {
            return None;
        }
    }
    let mut low_s = if high_s > pilot_s.max(1.0) { 0.5 * high_s } else { 0.0 };
    while high_s - low_s > 0.02 * high_s {
        let middle_s = 0.5 * (low_s + high_s);
        if enough(middle_s) { high_s = middle_s } else { low_s = middle_s }
    }
    Some(pilot_s + high_s)
}

/// What a fit to a pilot shows of rest and of each drive; `None` of a drive without an interval.
fn shown(
    schedule: &TurnSchedule,
    bench: &Bench,
    gyroscope: &Gyroscope,
    fit: &CalibrationFit,
    intervals: &[FitInterval],
) -> Vec<PilotDrive> {
    let rates = [0.0].into_iter().chain(schedule.drives_deg_s());
    let drive = |(place, asked_deg_s): (usize, f64)| {
        let of_drive = || intervals.iter().filter(move |interval| interval.drive == place);
        let turned_s: f64 = of_drive().map(|interval| interval.span.length_s()).sum();
        let mean = |of: fn(&FitInterval) -> f64| of_drive().map(of).sum::<f64>() / turned_s;
        let coning_deg2_s = fit.strengths.coning_deg2_s.get(place).copied().unwrap_or(0.0);
        (turned_s > 0.0).then(|| PilotDrive {
            asked_deg_s,
            rate_deg_s: mean(|interval| interval.turned_deg),
            nonlinear_deg_s: bench.unknowns.nonlinearity * mean(|interval| interval.cubed_deg),
            noise_deg2_s: gyroscope.noise().white_deg2_s() + coning_deg2_s,
            turned_s,
        })
    };
    rates.enumerate().filter_map(drive).collect()
}

impl TurnPlan {
    /// Leads the motor of `scene` through a pilot, plans the rest of the time of `asked`, and leads it through that.
    /// With `calibrate.within_ppm` all that was turned is judged again at some looks, which plan anew, until the fit
    /// states an interval that is small enough, or the time of `asked` is over.
    ///
    /// `told` has each plan before the motor turns through it. The schedule is that of the whole run. Without a plan
    /// the scene asks for no pilot, and the schedule is that of the scene's keys; or the pilot tells nothing, and
    /// nearly half of the time goes to either side.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn turn(
        scene: &Scene,
        asked: &TurnSchedule,
        told: &impl Fn(&Self),
    ) -> Result<(TurningRun, TurnSchedule, Option<Self>), RunError> {
        let pilot = asked.pilot(scene)?;
        if pilot.segments.is_empty() {
            return Ok((TurningRun::run(scene, asked)?, asked.clone(), None));
        }
        let mut motor = TurningMotor::new(scene, &pilot)?;
        for segment in &pilot.segments {
            motor.turn(segment);
        }
        let (mut schedule, mut plan) = (pilot, None);
        while schedule.duration_s < asked.duration_s {
            let seen = Seen::of(scene, &schedule, &motor.turning);
            if seen.as_ref().is_some_and(|seen| seen.is_enough(asked)) {
                break;
            }
            plan = seen.map(|seen| Self::of(&seen.drives, schedule.duration_s, asked));
            plan.iter().for_each(told);
            let (until_s, turns) = plan.map_or_else(
                || {
                    (
                        asked.next_look_s(schedule.duration_s, None),
                        asked.fastest_deg_s.map(|rate| (rate, 0.45)),
                    )
                },
                |plan: Self| (plan.duration_s, [plan.clockwise, plan.counter_clockwise]),
            );
            let turned = schedule.segments.len();
            schedule.fill(CYCLES, until_s, turns);
            for segment in &schedule.segments[turned..] {
                motor.turn(segment);
            }
        }
        Ok((motor.turning, schedule, plan))
    }

    /// The best plan after `seen_s`, until the next look.
    fn of(drives: &[PilotDrive], seen_s: f64, asked: &TurnSchedule) -> Self {
        let enough_s = asked.within_ppm.and_then(|within_ppm| needed_s(drives, within_ppm));
        let duration_s = asked.next_look_s(seen_s, enough_s);
        let (shares, sigma) = best(drives, duration_s - seen_s);
        let of = |side: usize| (drives[shares.drives[side]].asked_deg_s, shares.shares[side]);
        Self {
            seen_s,
            duration_s,
            clockwise: of(0),
            counter_clockwise: of(1),
            predicted_ppm: 1e6 * sigma,
            within_95_ppm: 1e6 * sigma * NORMAL_95,
            needed_s: needed_s(drives, WANTED_PPM),
        }
    }
}

/// What a motor has shown until now, by a fit to all that it has turned.
struct Seen {
    drives: Vec<PilotDrive>,
    /// Standard deviation of the scale factor, as the fit states it.
    sigma_ppm: f64,
}

impl Seen {
    /// Of a motor that has turned through `schedule`; `None` where that does not tell scale factor from bias.
    fn of(scene: &Scene, schedule: &TurnSchedule, turning: &TurningRun) -> Option<Self> {
        let mut gyroscope = Gyroscope::new(scene);
        let bench = Bench::new(scene, schedule, turning);
        let samples: Vec<_> = turning.turns().map(|turn| gyroscope.sample(&turn)).collect();
        let intervals = intervals(&gyroscope, &samples, &bench).into_iter();
        let intervals: Vec<FitInterval> =
            intervals.filter(|(_, saturated)| !saturated).map(|(interval, _)| interval).collect();
        let fit = CalibrationFit::to(&intervals, &gyroscope.noise(), &bench.unknowns)?;
        let drives = shown(schedule, &bench, &gyroscope, &fit, &intervals);
        let has = |is: fn(f64) -> bool| drives.iter().any(|drive| is(drive.asked_deg_s));
        let tells = has(|rate| rate.abs() <= 0.0) && has(|rate| rate > 0.0) && has(|rate| rate < 0.0);
        tells.then(|| Self { drives, sigma_ppm: 1e6 * fit.scale_sigma() })
    }

    /// Whether 95 % of scale factors are as good as is asked.
    fn is_enough(&self, asked: &TurnSchedule) -> bool {
        asked.within_ppm.is_some_and(|within_ppm| NORMAL_95 * self.sigma_ppm <= within_ppm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(rate_deg_s: f64, noise_deg2_s: f64) -> PilotDrive {
        PilotDrive { asked_deg_s: rate_deg_s, rate_deg_s, nonlinear_deg_s: 0.0, noise_deg2_s, turned_s: 1e-9 }
    }

    /// Rest and one rate, noises `N` and `k N`: the deviation is `N sqrt(1 / t + k^2 / u) / r`, the least with times as
    /// the noises: `sigma = N (1 + k) / (r sqrt(t + u))`. With k = 3 that is a quarter of the time at rest. A drive the
    /// other way with a thousand times the noise is left.
    #[test]
    fn exact_times_are_as_the_noises() {
        let n2 = 6.25e-6;
        let drives = [drive(0.0, n2), drive(160.0, 1e6 * n2), drive(-100.0, 9.0 * n2)];
        let (shares, sigma) = best(&drives, 60.0);
        assert!((shares.share_of(0) - 0.25).abs() < 1e-9 && shares.share_of(1) < 1e-9, "{shares:?}");
        let expected = math::sqrt(n2) * 4.0 / (100.0 * math::sqrt(60.0));
        assert!((sigma / expected - 1.0).abs() < 1e-3, "{sigma} {expected}");
        // 10 ppm at 1.96 sigma.
        let needed = needed_s(&drives, WANTED_PPM).unwrap();
        let closed_form_s = n2 * 16.0 / (100.0 * 10e-6 / 1.96_f64) / (100.0 * 10e-6 / 1.96);
        assert!((needed / closed_form_s - 1.0).abs() < 0.03, "{needed} {closed_form_s}");
    }

    /// Half of the error takes four times as long. The motor is judged again when the error wanted is promised, at
    /// twice the time seen at the latest, a tenth of it later at the earliest, and at the end of the time asked for.
    /// Without an error wanted that is the only look. The search is to 2 %.
    #[test]
    fn exact_a_plan_lasts_as_long_as_is_needed() {
        let n2 = 6.25e-6;
        let drives = [drive(0.0, n2), drive(100.0, n2), drive(-100.0, n2)];
        let four_s = needed_s(&drives, 20.0).unwrap();
        assert!((needed_s(&drives, 10.0).unwrap() / (4.0 * four_s) - 1.0).abs() < 0.03, "{four_s}");
        let asked = |duration_s, within_ppm| TurnSchedule {
            duration_s,
            within_ppm,
            ..TurnSchedule::of(&Scene::default()).unwrap()
        };
        for (duration_s, within_ppm, seen_s, until_s) in [
            (1e4, Some(20.0), 0.8 * four_s, four_s),
            (1e4, Some(20.0), 0.3 * four_s, 0.6 * four_s),
            (1e4, Some(20.0), four_s, 1.1 * four_s),
            (0.9 * four_s, Some(20.0), 0.8 * four_s, 0.9 * four_s),
            (1e4, None, 0.8 * four_s, 1e4),
        ] {
            let plan = TurnPlan::of(&drives, seen_s, &asked(duration_s, within_ppm));
            assert!((plan.duration_s / until_s - 1.0).abs() < 1e-9, "{seen_s} {until_s}: {plan:?}");
        }
    }

    /// Without coning the plan is that of the random walk: half of the time to either side, `N / (mean rate sqrt(t))`.
    #[test]
    fn exact_a_level_rotor_turns_to_both_sides() {
        let n2 = 6.25e-6;
        let drives = [drive(0.0, n2), drive(160.0, n2), drive(-88.0, n2), drive(80.0, n2), drive(-40.0, n2)];
        let (shares, sigma) = best(&drives, 60.0);
        assert_eq!(shares.drives, [1, 2]);
        let spread = 0.5 * 248.0;
        let expected = math::sqrt(n2) / (spread * math::sqrt(60.0));
        // A twentieth of rest is the least.
        assert!(sigma > expected && sigma < 1.06 * expected, "{sigma} {expected}");
    }

    /// What the pilot has turned counts, also where no time is left: `N / (r sqrt(t))` of `t` at the rates r and -r.
    #[test]
    fn exact_the_time_of_the_pilot_counts() {
        let n2 = 6.25e-6;
        let turned = |rate_deg_s, turned_s| PilotDrive { turned_s, ..drive(rate_deg_s, n2) };
        let drives = [turned(0.0, 20.0), turned(100.0, 10.0), turned(-100.0, 10.0)];
        let (_, sigma) = best(&drives, 0.0);
        let expected = math::sqrt(n2) / (100.0 * math::sqrt(20.0));
        assert!((sigma / expected - 1.0).abs() < 1e-9, "{sigma} {expected}");
    }

    /// A gyroscope whose non-linearity is as large as the error that is wanted needs more than time.
    #[test]
    fn exact_no_time_is_enough_where_non_linearity_stays() {
        let mut drives = [drive(0.0, 6.25e-6), drive(160.0, 6.25e-6), drive(-160.0, 6.25e-6)];
        for drive in &mut drives {
            // 100 ppm of the rate, which two equal rates do not tell from the scale factor.
            drive.nonlinear_deg_s = 1e-4 * drive.rate_deg_s;
        }
        assert_eq!(needed_s(&drives, WANTED_PPM), None);
    }
}
