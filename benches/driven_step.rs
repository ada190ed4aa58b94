//! What a driven step costs where the compiler can build it into the caller's loop: one call site a precision, as in a program that
//! simulates one motor. `twin.rs` has many, so there each step is a call, its state goes through memory, and it costs half as much again.

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use motor_model::{DriveCommand, DriveMode, ImpactRule, Motor, MotorParams, MotorSetup, MotorState, Real};

/// Steps of a batch: 10 ms of flight, in which a rotor that starts 10 mm up stays up.
const STEPS: u32 = 10_000;

/// Full drive, the rotor so high above the teeth that it never meets them.
fn driven_step<T: Real>(group: &mut BenchmarkGroup<'_, WallTime>, precision: &str) {
    for (rule, name) in [(ImpactRule::EndOfStep, "end of step"), (ImpactRule::Located, "located")] {
        let setup = MotorSetup { impact_rule: rule, ..MotorSetup::with_step(1e-6) };
        let motor = Motor::<T>::try_new(&MotorParams::nominal(), &setup).expect("the nominal motor");
        let mut aloft = MotorState::default();
        aloft.rotor.height_m = T::from_f64(0.01);
        let command = black_box(DriveCommand::full(DriveMode::B));
        group.bench_function(format!("impacts {name}/{precision}"), |bencher| {
            bencher.iter_batched(
                || aloft,
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
