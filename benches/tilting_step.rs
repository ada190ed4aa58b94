//! Time of a step of the tilting motor beside the height-only one, in both modes and at rest, with and without shift.
//!
//! Steps are of 0.4 us, where rates are converged, and of 1 us.
//!
//! The parameters are those of a tight hub and slippery teeth, at which mode B rubs on the pin most of the time.

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use motor_model::{
    DriveCommand, DriveMode, Freedom, Motor, MotorParams, MotorSetup, MotorState, Parameter, Real,
    TiltingMotor, TiltingParameter, TiltingParams, TiltingSetup, TiltingState, TiltingVariation,
};

/// Lengths of a step in s, with their names and the steps before the first batch: 0.2 s.
const LENGTHS: [(f64, &str, u32); 2] = [(0.4e-6, "0.4 us", 500_000), (1e-6, "1 us", 200_000)];
/// Steps of a batch: long enough for the rare impacts.
const STEPS: u32 = 200_000;

fn sets() -> (MotorParams, TiltingParams) {
    let params =
        [(Parameter::Friction, 0.15), (Parameter::VerticalDamping, 0.9e-3), (Parameter::ModeShift, 1.25)]
            .into_iter()
            .fold(MotorParams::nominal(), |set, (parameter, value)| {
                set.with(parameter, value).expect("within bounds")
            });
    let tilting = [
        (TiltingParameter::HubClearance, 7e-6),
        (TiltingParameter::StatorTiltFrequency, 5000.0),
        (TiltingParameter::ToothRockingExponent, 2.0),
    ]
    .into_iter()
    .fold(TiltingParams::nominal(), |set, (parameter, value)| {
        set.with(parameter, value).expect("within bounds")
    });
    (params, tilting)
}

#[inline(never)]
fn run_height_only<T: Real>(
    motor: &Motor<T>,
    state: &mut MotorState<T>,
    command: DriveCommand,
    steps: u32,
) -> usize {
    (0..steps).map(|_| motor.step(state, black_box(command)).len()).sum()
}

#[inline(never)]
fn run<T: Real>(
    motor: &TiltingMotor<T>,
    state: &mut TiltingState<T>,
    command: DriveCommand,
    steps: u32,
) -> usize {
    (0..steps).map(|_| motor.step(state, black_box(command)).len()).sum()
}

fn steps_in<T: Real>(criterion: &mut Criterion, precision: &str) {
    let mut group = criterion.benchmark_group("tilting step");
    group
        .throughput(Throughput::Elements(u64::from(STEPS)))
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(500));
    for length in LENGTHS {
        for (name, command) in [
            ("steady mode B", DriveCommand::full(DriveMode::B)),
            ("steady mode C", DriveCommand::full(DriveMode::C)),
            ("at rest", DriveCommand::OFF),
        ] {
            steps_under::<T>(&mut group, length, &format!("{name}, {}/{precision}", length.1), command);
        }
    }
    group.finish();
}

/// The height-only motor and both forms of the tilting one under one command.
fn steps_under<T: Real>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    (step_s, _, settling): (f64, &str, u32),
    name: &str,
    command: DriveCommand,
) {
    let (params, tilting) = sets();
    let variation =
        TiltingVariation { amplitudes: [0.004, -0.003, 0.002, -0.005], ..TiltingVariation::default() };
    let motor = Motor::<T>::try_new(&params, &MotorSetup::with_step(step_s)).expect("valid");
    let mut start = MotorState::default();
    run_height_only(&motor, &mut start, command, settling);
    group.bench_function(format!("height only, {name}"), |bencher| {
        let routine = |state: &mut MotorState<T>| run_height_only(&motor, state, command, STEPS);
        bencher.iter_batched_ref(|| start, routine, BatchSize::SmallInput);
    });
    for (form, freedom) in [("full", Freedom::Full), ("without shift", Freedom::WithoutShift)] {
        let setup = TiltingSetup { freedom, variation, ..TiltingSetup::with_step(step_s) };
        let motor = TiltingMotor::<T>::try_new(&params, &tilting, &setup).expect("valid");
        let mut start = TiltingState::default();
        run(&motor, &mut start, command, settling);
        group.bench_function(format!("{form}, {name}"), |bencher| {
            let routine = |state: &mut TiltingState<T>| run(&motor, state, command, STEPS);
            bencher.iter_batched_ref(|| start, routine, BatchSize::SmallInput);
        });
    }
}

fn steps(criterion: &mut Criterion) {
    steps_in::<f64>(criterion, "f64");
    steps_in::<f32>(criterion, "f32");
}

criterion_group!(benches, steps);
criterion_main!(benches);
