//! The plan of a calibration: a pilot, and from what it shows the rates and their times that tell the scale factor
//! best.
//!
//! How strongly a rotor goes round cones depends on the motor, on the mode and on the amplitude. On a rotor that tilts
//! it grows with the second to fifth power of the rate: at 120 deg/s in mode B it is thirty to eighty times the
//! gyroscope's random walk, at 30 deg/s a fifth of it to three times as much. On a level rotor there is none. So the
//! plan begins with a pilot: a rest, and a turn at the scene's rate and at a slower one to either side. What it shows
//! gives a law of coning by the rate ([`ConingLaw`]), and this the rates and times of the rest ([`turn_design`]). The
//! turns come in some rounds, so that what drifts slowly is not taken for a part of the rate. The data of the pilot are
//! fitted with the others.
//!
//! A pilot has some eight intervals of a drive: it knows the strength of coning to half of itself, and misses a weak
//! one that the reference hides. Where the plan shall be as long as an error takes, it is not trusted with the whole:
//! the motor is judged again at the latest when it has turned for twice the time, by all that it has turned, and the
//! plan ends once the fit states what is wanted.
//!
//! The gyroscope of the pilot is the first on its motor; all others on the same motor make the same turns.

use serde::Serialize;

use super::calibration::{Bench, intervals};
use super::schedule::TurnSchedule;
use super::turning::{TurningMotor, TurningRun};
use analysis::gyroscope_fit::turn_design::{self, TurnRate};
use analysis::gyroscope_fit::{CalibrationFit, ConingLaw, FitInterval};
use simulation::math::statistics::NORMAL_95;
use simulation::runs::RunError;
use simulation::scene::Scene;
use simulation::world::instruments::gyroscope::Gyroscope;

/// Rounds of rest, turn, rest and turn back.
const CYCLES: u32 = 3;
/// Rates that are considered, in parts of the scene's: the steps of Renard's series R10.
const LADDER: [f64; 8] = [1.0, 0.8, 0.63, 0.5, 0.4, 0.315, 0.25, 0.2];
/// Error of the scale factor that is wanted in 95 % of the calibrations.
pub const WANTED_PPM: f64 = 10.0;

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

/// Rest, the rates that were turned, and those of [`LADDER`] that the motor can reach, with their noise by the law of
/// coning.
fn rates(
    schedule: &TurnSchedule,
    bench: &Bench,
    gyroscope: &Gyroscope,
    law: &ConingLaw,
    intervals: &[FitInterval],
) -> Vec<TurnRate> {
    let noise_deg2_s = |rate_deg_s| gyroscope.noise().white_deg2_s() + law.strength_deg2_s(rate_deg_s);
    let turned = |(place, asked_deg_s): (usize, f64)| {
        let of_drive = || intervals.iter().filter(move |interval| interval.drive == place);
        let turned_s: f64 = of_drive().map(|interval| interval.span.length_s()).sum();
        let mean = |of: fn(&FitInterval) -> f64| of_drive().map(of).sum::<f64>() / turned_s;
        let rate_deg_s = mean(|interval| interval.turned_deg);
        (turned_s > 0.0).then(|| TurnRate {
            asked_deg_s,
            rate_deg_s,
            nonlinear_deg_s: bench.unknowns.nonlinearity * mean(|interval| interval.cubed_deg),
            noise_deg2_s: noise_deg2_s(if place == 0 { 0.0 } else { rate_deg_s }),
            turned_s,
        })
    };
    let asked = [0.0].into_iter().chain(schedule.drives_deg_s());
    let mut rates: Vec<TurnRate> = asked.enumerate().filter_map(turned).collect();
    for fastest_deg_s in schedule.fastest_deg_s {
        let is = |rate: &&TurnRate, asked_deg_s: f64| rate.asked_deg_s.total_cmp(&asked_deg_s).is_eq();
        let Some(fastest) = rates.iter().find(|rate| is(rate, fastest_deg_s)).copied() else { continue };
        for asked_deg_s in LADDER.map(|part| part * fastest_deg_s) {
            let part = asked_deg_s / fastest.rate_deg_s;
            let is_new = !rates.iter().any(|rate| is(&rate, asked_deg_s));
            if is_new && (0.0..1.0).contains(&part) {
                rates.push(TurnRate {
                    asked_deg_s,
                    rate_deg_s: asked_deg_s,
                    nonlinear_deg_s: fastest.nonlinear_deg_s * part * part * part,
                    noise_deg2_s: noise_deg2_s(asked_deg_s),
                    turned_s: 0.0,
                });
            }
        }
    }
    rates
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
            plan = seen.map(|seen| Self::of(&seen.rates, schedule.duration_s, asked));
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
    fn of(rates: &[TurnRate], seen_s: f64, asked: &TurnSchedule) -> Self {
        let enough_s = asked.within_ppm.and_then(|within_ppm| turn_design::needed_s(rates, within_ppm));
        let duration_s = asked.next_look_s(seen_s, enough_s);
        let (found, sigma) = turn_design::best(rates, duration_s - seen_s);
        let of = |side: usize| (rates[found.rates[side]].asked_deg_s, found.shares[side]);
        Self {
            seen_s,
            duration_s,
            clockwise: of(0),
            counter_clockwise: of(1),
            predicted_ppm: 1e6 * sigma,
            within_95_ppm: 1e6 * sigma * NORMAL_95,
            needed_s: turn_design::needed_s(rates, WANTED_PPM),
        }
    }
}

/// What a motor has shown until now, by a fit to all that it has turned.
struct Seen {
    rates: Vec<TurnRate>,
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
        let rates = rates(schedule, &bench, &gyroscope, &fit.coning_law, &intervals);
        let has = |is: fn(f64) -> bool| rates.iter().any(|rate| is(rate.asked_deg_s));
        let tells = has(|rate| rate.abs() <= 0.0) && has(|rate| rate > 0.0) && has(|rate| rate < 0.0);
        tells.then(|| Self { rates, sigma_ppm: 1e6 * fit.scale_sigma() })
    }

    /// Whether 95 % of scale factors are as good as is asked.
    fn is_enough(&self, asked: &TurnSchedule) -> bool {
        asked.within_ppm.is_some_and(|within_ppm| NORMAL_95 * self.sigma_ppm <= within_ppm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The motor is judged again when the error wanted is promised, at twice the time seen at the latest, a tenth of it
    /// later at the earliest, and at the end of the time asked for. Without an error wanted that is the only look.
    #[test]
    fn exact_a_plan_lasts_as_long_as_is_needed() {
        let rates = [0.0, 100.0, -100.0].map(|rate_deg_s| TurnRate {
            asked_deg_s: rate_deg_s,
            rate_deg_s,
            nonlinear_deg_s: 0.0,
            noise_deg2_s: 6.25e-6,
            turned_s: 1e-9,
        });
        let four_s = turn_design::needed_s(&rates, 20.0).unwrap();
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
            let plan = TurnPlan::of(&rates, seen_s, &asked(duration_s, within_ppm));
            assert!((plan.duration_s / until_s - 1.0).abs() < 1e-9, "{seen_s} {until_s}: {plan:?}");
        }
    }
}
