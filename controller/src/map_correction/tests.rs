//! How bursts and cruises teach the factors of a motor.

use super::*;
use estimator::ResonanceOffset;

fn map() -> &'static ResponseMap {
    ResponseMap::table_1()
}

fn middle(family: Family) -> Burst {
    *map().middle(family).unwrap()
}

/// A map of one motor that knows its middle nudge to 2 % and the least one to a half: the forecast of a nudge is as
/// uncertain as the least one is.
#[test]
fn exact_a_nudge_is_forecast_as_badly_as_the_least_one_is_known() {
    let mut nudges = map().bursts(Family::Nudge).to_vec();
    for (row, nudge) in nudges.iter_mut().enumerate() {
        nudge.motors_sd_rad = if row == 0 { 0.5 } else { 0.02 } * nudge.turn_rad;
    }
    let bursts = Family::ALL.map(|family| match family {
        Family::Nudge => nudges.as_slice(),
        other => map().bursts(other),
    });
    let correlation = map().step_walk_correlation();
    let of_motor = ResponseMap::try_new(*map().design(), map().cruises(), bursts, correlation).unwrap();
    let correction = MapCorrection::of(&of_motor);
    let least = Burst { repeat_sd_rad: 0.0, ..*of_motor.bursts(Family::Nudge).first().unwrap() };
    let Forecast { turn_rad, turn_rad2 } = correction.forecast(Family::Nudge, &least);
    let expected = 0.25 + MapCorrection::shape(Family::Nudge);
    assert!((turn_rad2 / (turn_rad * turn_rad) / expected - 1.0).abs() < 1e-5, "{turn_rad2}");
}

/// One measurement without noise: the factor is right up to the map's spread from burst to burst and the shape.
#[test]
fn law_one_burst_teaches_its_family_and_the_related_one() {
    let mut correction = MapCorrection::of(map());
    let burst = middle(Family::Step);
    correction.learn(Family::Step, &burst, 1.3 * burst.turn_rad, 0.0);
    assert!((correction.scale(Family::Step) - 1.3).abs() < 0.03, "{correction:?}");
    let walk = correction.scale(Family::Walk);
    assert!((1.15..1.3).contains(&walk), "{walk}");
    assert!((correction.scale(Family::Throw) - 1.0).abs() < f32::EPSILON);
    let left = correction.factor(Family::Walk).variance;
    assert!(left < 0.5 * MapCorrection::of(map()).factor(Family::Walk).variance, "{correction:?}");
}

/// Bayes with two Gaussians of equal variance: half way, half the variance.
#[test]
fn exact_a_measurement_as_uncertain_as_the_factor_counts_half() {
    let mut correction = MapCorrection::of(map());
    let burst = Burst { repeat_sd_rad: 0.0, ..middle(Family::Nudge) };
    let mean = burst.turn_rad;
    let prior = correction.factor(Family::Nudge).variance;
    let noise = mean * mean * (prior - MapCorrection::shape(Family::Nudge));
    correction.learn(Family::Nudge, &burst, 1.2 * mean, noise);
    assert!((correction.scale(Family::Nudge) - 1.1).abs() < 1e-4);
    assert!((correction.factor(Family::Nudge).variance / prior - 0.5).abs() < 1e-4);
}

/// Windows of a motor at 0.15 of the map's rate: the factor is half way after the first and nearly there after
/// three. The other mode's factor stays.
#[test]
fn law_the_rate_of_a_slow_motor_is_learnt() {
    let mut correction = MapCorrection::of(map());
    let cruise = map().strongest_cruise(DriveMode::C, 1.0).unwrap();
    let rate_rad_s = -0.15 * cruise.rate_rad_s;
    correction.learn_rate(&cruise, rate_rad_s);
    assert!(correction.rate_scale(DriveMode::C) < 0.5, "{correction:?}");
    correction.learn_rate(&cruise, rate_rad_s);
    correction.learn_rate(&cruise, rate_rad_s);
    assert!((correction.rate_scale(DriveMode::C) - 0.15).abs() < 0.05, "{correction:?}");
    assert!((correction.rate_scale(DriveMode::B) - 1.0).abs() < f32::EPSILON);
    for _ in 0..3 {
        correction.learn_rate(&cruise, -cruise.rate_rad_s);
    }
    assert!(correction.rate_scale(DriveMode::C) > 0.9, "it has recovered: {correction:?}");
}

/// A drive that halves is learnt within three bursts, however small the variance of the factor was.
#[test]
fn law_a_change_beyond_the_gate_is_learnt() {
    let mut correction = MapCorrection::of(map());
    let burst = middle(Family::Step);
    for _ in 0..50 {
        correction.learn(Family::Step, &burst, burst.turn_rad, 0.0);
    }
    for _ in 0..3 {
        correction.learn(Family::Step, &burst, 0.5 * burst.turn_rad, 0.0);
    }
    assert!((correction.scale(Family::Step) - 0.5).abs() < 0.05, "{correction:?}");
}

/// Factors that are known for certain stay as they are, and finite.
#[test]
fn exact_a_certain_factor_teaches_nothing() {
    let certain = LearntFactor { value: 1.0, variance: 0.0 };
    let factors = LearntFactors {
        bursts: [certain; 5],
        step_walk_covariance: 0.0,
        rates: [certain; 2],
        resonances: [ResonanceOffset::NONE; 2],
    };
    let mut correction = MapCorrection::try_from(factors).unwrap();
    for family in [Family::Step, Family::Walk] {
        correction.learn(family, &middle(family), 1.1 * middle(family).turn_rad, 1e-20);
    }
    for family in Family::ALL {
        assert!((correction.scale(family) - 1.0).abs() < 1e-3, "{family:?} {correction:?}");
    }
}

/// Whatever turn is measured, factors stay in range and variances positive.
#[test]
fn law_any_measurement_leaves_factors_in_range() {
    let mut correction = MapCorrection::of(map());
    for turned in [1e9, -1e9, 0.0, 1e-30, f32::MAX] {
        for family in Family::ALL {
            correction.learn(family, &middle(family), turned, 1e-20);
            let LearntFactor { value, variance } = correction.factor(family);
            assert!((0.1..=4.0).contains(&value) && variance > 0.0, "{turned} {family:?} {correction:?}");
            assert!(correction.factor(Family::Step).variance > 0.0, "{correction:?}");
            assert!(correction.factor(Family::Walk).variance > 0.0, "{correction:?}");
        }
    }
}
