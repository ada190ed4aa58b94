//! Time of a step of the motor: in flight, in steady motion of each mode, and at rest.
//!
//! Each measurement steps a copy of a prepared state, so that every batch makes the same motion. Throughput counts
//! steps: the time of an element is that of one step.

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use motor_model::{
    DriveCommand, DriveMode, EnergyLedger, ImpactRule, Motor, MotorParams, MotorSetup, MotorState, Phase,
    Real,
};

/// Step of all measurements except those in steady motion. The time does not depend on it.
const STEP_S: f64 = 1e-6;
/// Steps of a batch.
const STEPS: u16 = 10_000;

/// Both rules, with the prefix of the names of their measurements.
const RULES: [(&str, ImpactRule); 2] = [("", ImpactRule::EndOfStep), ("located ", ImpactRule::Located)];

fn motor<T: Real>(impact_rule: ImpactRule, step_s: f64) -> Motor<T> {
    let setup = MotorSetup { impact_rule, ..MotorSetup::with_step(step_s) };
    Motor::try_new(&MotorParams::nominal(), &setup).expect("the nominal motor is valid")
}

/// A rotor one metre above the teeth: it stays in flight for a batch.
fn in_flight<T: Real>() -> MotorState<T> {
    let mut state = MotorState::default();
    state.rotor.height_m = T::from_f64(1.0);
    state
}

/// The state after half a second under `command`.
fn steady<T: Real>(motor: &Motor<T>, command: DriveCommand) -> MotorState<T> {
    let mut state = MotorState::default();
    let mut time_s = 0.0;
    while time_s < 0.5 {
        motor.step(&mut state, command);
        time_s += motor.step_s();
    }
    state
}

/// Steps `state` through a batch under one command and counts the impacts: the loop of a simulation, compiled by
/// itself.
#[inline(never)]
fn run<T: Real>(motor: &Motor<T>, state: &mut MotorState<T>, command: DriveCommand) -> usize {
    (0..STEPS).map(|_| motor.step(state, black_box(command)).len()).sum()
}

/// Times a batch from a copy of `start`.
fn time_batch<T: Real>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    start: MotorState<T>,
    mut batch: impl FnMut(&mut MotorState<T>) -> usize,
) {
    group.bench_function(name, |bencher| {
        bencher.iter_batched_ref(|| start, &mut batch, BatchSize::SmallInput);
    });
}

fn steps_in<T: Real>(group: &mut BenchmarkGroup<'_, WallTime>, precision: &str) {
    for (rule_name, rule) in RULES {
        steps_under::<T>(group, rule_name, rule, precision);
    }
    let motor = motor::<T>(ImpactRule::EndOfStep, STEP_S);
    let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
    time_batch(group, &format!("command changes every step/{precision}"), in_flight(), |state| {
        (0..STEPS).map(|index| motor.step(state, black_box(if index % 2 == 0 { b } else { c })).len()).sum()
    });
    let mut ledger = EnergyLedger::try_new(&MotorParams::nominal(), &MotorSetup::with_step(STEP_S))
        .expect("the nominal motor is valid");
    time_batch(group, &format!("driven, with energy ledger/{precision}"), in_flight(), |state| {
        (0..STEPS).map(|_| motor.step_with(state, black_box(b), &mut ledger).len()).sum()
    });

    group.bench_function(format!("sine and cosine of a phase/{precision}"), |bencher| {
        let increment = Phase::from_turns(0.006_3);
        bencher.iter(|| {
            let mut phase = Phase::ZERO;
            for _ in 0..STEPS {
                phase = phase.advanced(increment);
                black_box(phase.sin_cos::<T>());
            }
        });
    });
}

/// Flight, steady motion and rest under one rule.
fn steps_under<T: Real>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    rule_name: &str,
    rule: ImpactRule,
    precision: &str,
) {
    let motor = motor::<T>(rule, STEP_S);
    let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
    assert_eq!(run(&motor, &mut in_flight(), b), 0, "in flight there is no impact");
    for (name, command) in [("driven, no impact", b), ("off, no impact", DriveCommand::OFF)] {
        time_batch(group, &format!("{rule_name}{name}/{precision}"), in_flight(), |state| {
            run(&motor, state, command)
        });
    }
    // Mode C at 0.3: the rotor rides on the teeth.
    let riding = DriveCommand::saturating(DriveMode::C, 0.3);
    for (name, command) in [
        ("steady mode B", b),
        ("steady mode C", c),
        ("mode C at 0.3", riding),
        ("at rest", DriveCommand::OFF),
    ] {
        for (label, step_s) in [("1 us", 1e-6), ("10 us", 10e-6)] {
            let motor = self::motor::<T>(rule, step_s);
            let start = steady(&motor, command);
            time_batch(group, &format!("{rule_name}{name}, {label}/{precision}"), start, |state| {
                run(&motor, state, command)
            });
        }
    }
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    group
        .throughput(Throughput::Elements(u64::from(STEPS)))
        .sample_size(20)
        .nresamples(10_000)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    steps_in::<f64>(&mut group, "f64");
    steps_in::<f32>(&mut group, "f32");
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
