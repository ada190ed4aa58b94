//! Time of a driven step that the compiler inlines into the caller's loop.
//!
//! There is one call site for each precision, as in a program that simulates one motor. `motor_step.rs` has many call
//! sites: there a step is a call, its state is in memory, and it takes half as much time again.

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use motor_model::{DriveCommand, DriveMode, ImpactRule, Motor, MotorParams, MotorSetup, MotorState, Real};

/// Steps of a batch: 10 ms, in which a rotor that starts at a height of 10 mm stays in flight.
const STEPS: u32 = 10_000;

/// Full drive, with the rotor so high above the teeth that there is no impact.
fn driven_step<T: Real>(group: &mut BenchmarkGroup<'_, WallTime>, precision: &str) {
    for (rule, name) in [(ImpactRule::EndOfStep, "end of step"), (ImpactRule::Located, "located")] {
        let setup = MotorSetup { impact_rule: rule, ..MotorSetup::with_step(1e-6) };
        let motor = Motor::<T>::try_new(&MotorParams::nominal(), &setup).expect("the nominal motor");
        let mut in_flight = MotorState::default();
        in_flight.rotor.height_m = T::from_f64(0.01);
        let command = black_box(DriveCommand::full(DriveMode::B));
        group.bench_function(format!("impacts {name}/{precision}"), |bencher| {
            bencher.iter_batched(
                || in_flight,
                |mut state| {
                    let mut impacts = 0;
                    for _ in 0..STEPS {
                        impacts += motor.step(&mut state, command).len();
                    }
                    assert_eq!(impacts, 0);
                    state
                },
                BatchSize::SmallInput,
            );
        });
    }
}

fn driven_steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("driven step without impact");
    group.throughput(Throughput::Elements(u64::from(STEPS)));
    driven_step::<f64>(&mut group, "f64");
    driven_step::<f32>(&mut group, "f32");
    group.finish();
}

criterion_group!(benches, driven_steps);
criterion_main!(benches);
