//! The linearisation against central differences of the motor itself.

use super::STATES;
use crate::params::Parameter;
use crate::{
    AmplitudeVariation, Angle, AngleAccumulator, DriveCommand, DriveMode, FrictionLaw, Motor, MotorParams,
    MotorSetup, MotorState,
};

const STEP_S: f64 = 2e-6;
/// What is shifted for the differences: far above the rounding of a step, far below what bends the map.
const SHIFTS: [f64; STATES] = [1e-10, 1e-6, 1e-10, 1e-6, 1e-10, 1e-6, 1e-10, 1e-6, 1e-8, 1e-4];

fn motor(friction_law: FrictionLaw, friction: f64) -> Motor<f64> {
    let params = MotorParams::nominal()
        .with(Parameter::Friction, friction)
        .and_then(|params| params.with(Parameter::TangentialDrag, 1e-4))
        .unwrap();
    let variation = AmplitudeVariation { pairs: [0.02, -0.03] };
    Motor::try_new(&params, &MotorSetup { friction_law, variation, ..MotorSetup::with_step(STEP_S) }).unwrap()
}

fn shifted(state: &MotorState<f64>, x: usize, by: f64) -> MotorState<f64> {
    let mut state = *state;
    match x {
        6 => state.rotor.height_m += by,
        7 => state.rotor.velocity_m_s += by,
        8 => state.rotor.angle.turn_by_radians(by),
        9 => state.rotor.rate_rad_s += by,
        mode if mode % 2 == 0 => state.modes.displacement_m[mode / 2] += by,
        mode => state.modes.velocity_m_s[mode / 2] += by,
    }
    state
}

/// The change from one state to another, in the order of the states.
fn between(from: &MotorState<f64>, to: &MotorState<f64>) -> [f64; STATES] {
    let (g, v) = (
        to.modes.displacement_m - from.modes.displacement_m,
        to.modes.velocity_m_s - from.modes.velocity_m_s,
    );
    let (a, b) = (&from.rotor, &to.rotor);
    let residual_rad =
        (b.angle.residual_units() - a.angle.residual_units()) / AngleAccumulator::<f64>::UNITS_PER_RADIAN;
    let angle_rad = b.angle.angle().radians_since::<f64>(a.angle.angle()) + residual_rad;
    [
        g.x,
        v.x,
        g.y,
        v.y,
        g.z,
        v.z,
        b.height_m - a.height_m,
        b.velocity_m_s - a.velocity_m_s,
        angle_rad,
        b.rate_rad_s - a.rate_rad_s,
    ]
}

/// The columns of the derivative of a step by central differences; `None` where a shift changes the number of impacts.
fn differences(
    motor: &Motor<f64>,
    start: &MotorState<f64>,
    command: DriveCommand,
    impacts: usize,
) -> Option<[[f64; STATES]; STATES]> {
    let columns: heapless::Vec<_, STATES> = (0..STATES)
        .map(|x| {
            let mut ends = [shifted(start, x, -SHIFTS[x]), shifted(start, x, SHIFTS[x])];
            for end in &mut ends {
                if motor.step(end, command).len() != impacts {
                    return None;
                }
            }
            Some(between(&ends[0], &ends[1]).map(|change| change / (2.0 * SHIFTS[x])))
        })
        .collect::<Option<_>>()?;
    columns.into_array().ok()
}

/// Largest error of the derivative's entries, each measured in the units of [`SHIFTS`], per the largest entry of its column.
fn largest_error(columns: &[[f64; STATES]], carry: impl Fn(&[f64; STATES]) -> [f64; STATES]) -> f64 {
    let mut largest = 0.0_f64;
    for (x, expected) in columns.iter().enumerate() {
        let mut unit = [0.0; STATES];
        unit[x] = 1.0;
        let carried = carry(&unit);
        let scale = (0..STATES).map(|y| (expected[y] / SHIFTS[y]).abs()).fold(0.0, f64::max);
        for y in 0..STATES {
            largest = largest.max((carried[y] - expected[y]).abs() / SHIFTS[y] / scale);
        }
    }
    largest
}

#[test]
fn dual_free_flow_is_the_derivative_of_a_step() {
    let motor = motor(FrictionLaw::Coulomb, 0.4);
    let mut start = MotorState::default();
    start.rotor.height_m = 1e-3;
    start.rotor.rate_rad_s = 12.0;
    start.modes.velocity_m_s.y = 0.5;
    let columns = differences(&motor, &start, DriveCommand::full(DriveMode::B), 0).unwrap();
    let error = largest_error(&columns, |dx| motor.free_flow(1.0).carry(dx));
    assert!(error < 1e-6, "{error:e}");
}

/// What was found among the impacts of a run: sticking and slipping ones of each pair.
#[derive(Debug, Default)]
struct Found {
    stick: [u32; 2],
    slip: [u32; 2],
}

/// Every step of a run with one impact in it: flow to the impact, saltation, flow to the end, against differences of the step.
fn compare(motor: &Motor<f64>, mode: DriveMode, limit: f64) -> Found {
    let command = DriveCommand::full(mode);
    let (mut state, mut found) = (MotorState::default(), Found::default());
    state.rotor.angle = AngleAccumulator::at(Angle::from_degrees(30.0));
    for _ in 0..300_000 {
        let start = state;
        let impacts = motor.step(&mut state, command);
        let [impact] = impacts.as_slice() else { continue };
        let part = 1.0 - impact.before_end_s / STEP_S;
        // A slow approach bends the map within a shift; an impact at the step's end may leave it.
        let smooth = impact.approach_m_s > 0.05 && part > 0.02 && part < 0.98;
        if start.pressed != [false; 2] || state.pressed != [false; 2] || !smooth {
            continue;
        }
        let Some(columns) = differences(motor, &start, command, 1) else { continue };
        let forcing = motor.modes().forcing(command);
        let mut before = start;
        before.forcing = forcing;
        before.phase = forcing.phase_at(start.phase, part);
        let phasors = [&forcing.phasor(start.phase), &forcing.phasor(before.phase)];
        motor.modes().part(part).advance(&mut before.modes, &forcing, phasors);
        motor.flight().part(part).advance::<crate::WholeMotor>(&mut before.rotor);
        let saltation = motor.saltation(impact.pair, &before).unwrap();
        let (to, from) = (motor.free_flow(part), motor.free_flow(1.0 - part));
        let error = largest_error(&columns, |dx| from.carry(&saltation.carry(&to.carry(dx))));
        assert!(error < limit, "{error:e} {impact:?}");
        let sticks = saltation.tangential.row[9] < -0.5;
        let count = if sticks { &mut found.stick } else { &mut found.slip };
        count[usize::from(impact.pair)] += 1;
    }
    found
}

#[test]
fn dual_saltation_is_the_derivative_of_a_step_with_an_impact() {
    let cases = [
        (FrictionLaw::Coulomb, 0.4, DriveMode::B),
        (FrictionLaw::Coulomb, 0.2, DriveMode::C),
        (FrictionLaw::Paper, 0.4, DriveMode::B),
        (FrictionLaw::Paper, 0.05, DriveMode::B),
    ];
    for (law, friction, mode) in cases {
        let found = compare(&motor(law, friction), mode, 1e-6);
        let ([stick_0, stick_1], [slip_0, slip_1]) = (found.stick, found.slip);
        let least = stick_0.min(stick_1).min(slip_0).min(slip_1);
        assert!(
            least >= 1 && stick_0 + stick_1 >= 10 && slip_0 + slip_1 >= 10,
            "{law:?} {friction} {found:?}"
        );
    }
}

#[test]
fn exact_matrix_and_vectors_are_the_same_map() {
    let motor = motor(FrictionLaw::Coulomb, 0.4);
    let mut before = MotorState::default();
    before.modes.velocity_m_s.y = 0.6;
    before.rotor.velocity_m_s = -0.1;
    let saltation = motor.saltation(0, &before).unwrap();
    let deviation = core::array::from_fn::<f64, STATES, _>(|i| 1.0 + 0.3 * i as f64);
    let (carried, rows) = (saltation.carry(&deviation), saltation.matrix());
    for (row, carried) in rows.iter().zip(carried) {
        let full: f64 = row.iter().zip(&deviation).map(|(a, b)| a * b).sum();
        assert!((full - carried).abs() < 1e-12 * carried.abs().max(1.0));
    }
    before.rotor.velocity_m_s = 5.0;
    assert!(motor.saltation(0, &before).is_none(), "tooth and rotor part");
}
