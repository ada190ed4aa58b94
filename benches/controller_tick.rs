//! Time of the controller's decision in a tick, for each phase: [`Positioning::decide`] on a given estimate, without
//! filter and instruments.

use std::hint::black_box;

use controller::{Limits, Positioning, PositioningPhase, PositioningTuning, ResponseMap, TICK_NANOS, Target};
use criterion::{Criterion, criterion_group, criterion_main};
use estimator::{Estimate, Health, Reason};
use motor_model::{Angle, Time};

/// The estimate of a rotor at `angle_deg`, with a standard deviation of `sigma_mdeg`.
fn estimate(at: Time, angle_deg: f64, sigma_mdeg: f32, resting: bool) -> Estimate<f32> {
    let sigma_rad = (1e-3 * sigma_mdeg).to_radians();
    Estimate {
        at,
        angle: Angle::from_degrees(angle_deg),
        rate_rad_s: if resting { 0.0 } else { 10.0 },
        angle_rad2: sigma_rad * sigma_rad,
        angle_rate_rad2_s: 0.0,
        rate_rad2_s2: 1e-4,
        resting,
    }
}

/// A phase of positioning, and the target and estimate that lead to it.
struct Case {
    name: &'static str,
    target_deg: f64,
    sigma_mdeg: f32,
    resting: bool,
    health: Health,
    is_in_phase: fn(&PositioningPhase) -> bool,
}

const UNUSABLE: Health = Health::Unusable(Reason::FramesRefused);

const CASES: [Case; 7] = [
    Case {
        name: "waiting",
        target_deg: 90.0,
        sigma_mdeg: 10.0,
        resting: false,
        health: UNUSABLE,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Waiting(_)),
    },
    Case {
        name: "cruise",
        target_deg: 90.0,
        sigma_mdeg: 10.0,
        resting: false,
        health: Health::Good,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Cruise { .. }),
    },
    Case {
        name: "cruise near the target",
        target_deg: 3.0,
        sigma_mdeg: 10.0,
        resting: false,
        health: Health::Good,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Cruise { .. }),
    },
    Case {
        name: "burst",
        target_deg: -0.1,
        sigma_mdeg: 1.0,
        resting: false,
        health: Health::Good,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Burst { .. }),
    },
    Case {
        name: "settling, in motion",
        target_deg: 90.0,
        sigma_mdeg: 10.0,
        resting: false,
        health: Health::Good,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Settling(_)),
    },
    Case {
        name: "settling, planning a step",
        target_deg: -0.002,
        sigma_mdeg: 1.0,
        resting: true,
        health: Health::Good,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Settling(_)),
    },
    Case {
        name: "holding",
        target_deg: 0.0,
        sigma_mdeg: 0.1,
        resting: true,
        health: Health::Good,
        is_in_phase: |phase| matches!(phase, PositioningPhase::Holding),
    },
];

/// The state machine before a decision that leads to the phase of the case, with the estimate and the time of that
/// decision.
fn prepared(case: &Case) -> (Positioning, Estimate<f32>, Time) {
    let target = Target::try_new(case.target_deg, 0.0005).expect("a target");
    let limits = Limits { deadline_nanos: u64::MAX, ..Limits::default() };
    let tuning = PositioningTuning { limits, ..PositioningTuning::default() };
    let mut positioning = Positioning::new(ResponseMap::table_1(), target, tuning, Time::ZERO);
    if !case.name.starts_with("settling") {
        // An estimate at rest, precise enough to begin.
        positioning.decide(
            ResponseMap::table_1(),
            Time::ZERO,
            Some(&estimate(Time::ZERO, 0.0, 0.1, true)),
            Health::Good,
        );
    }
    let now = Time::from_nanos(TICK_NANOS);
    (positioning, estimate(now, 0.0, case.sigma_mdeg, case.resting), now)
}

fn ticks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("controller tick");
    for case in &CASES {
        let (positioning, estimate, now) = prepared(case);
        let mut after = positioning;
        after.decide(ResponseMap::table_1(), now, Some(&estimate), case.health);
        assert!((case.is_in_phase)(&after.phase()), "{}: {:?}", case.name, after.phase());
        group.bench_function(case.name, |bencher| {
            bencher.iter(|| {
                let mut positioning = black_box(positioning);
                positioning.decide(
                    ResponseMap::table_1(),
                    black_box(now),
                    black_box(Some(&estimate)),
                    case.health,
                )
            });
        });
    }
    group.finish();
}

criterion_group!(benches, ticks);
criterion_main!(benches);
