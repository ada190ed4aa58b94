//! Reduced models: what they keep moves as in the whole motor, what they leave out stands still, and their books close.

use motor_model::{
    Bouncer, DriveCommand, DriveMode, EnergyLedger, HeightOnly, ImpactRule, ModalState, Motor, MotorParams,
    MotorSetup, MotorState, OnePair, Parameter, Scope, WithoutModeA,
};

use crate::closeness::{Within, assert_close};
use crate::scene::{motor, steps_in};

const RULES: [ImpactRule; 2] = [ImpactRule::EndOfStep, ImpactRule::Located];

fn setup(impact_rule: ImpactRule) -> MotorSetup {
    MotorSetup { impact_rule, ..MotorSetup::with_step(5e-6) }
}

/// Both modes, full and weak, and a rest: blows, pressed teeth and landings.
fn schedule() -> impl Iterator<Item = DriveCommand> {
    let stretch = |mode, amplitude, time_s| {
        std::iter::repeat_n(DriveCommand::saturating(mode, amplitude), steps_in(time_s, 5e-6) as usize)
    };
    stretch(DriveMode::B, 1.0, 0.03)
        .chain(stretch(DriveMode::C, 1.0, 0.03))
        .chain(stretch(DriveMode::C, 0.3, 0.03))
        .chain(std::iter::repeat_n(DriveCommand::OFF, steps_in(0.05, 5e-6) as usize))
}

/// Runs the schedule, shows each state, and returns the imbalance of the books as a share of the turnover, and the impacts of each pair.
fn account<S: Scope>(impact_rule: ImpactRule, mut look: impl FnMut(&MotorState<f64>)) -> (f64, [u32; 2]) {
    let (params, setup) = (MotorParams::nominal(), setup(impact_rule));
    let motor = Motor::<f64, S>::try_new(&params, &setup).expect("a valid motor");
    let mut ledger = EnergyLedger::try_new_in::<S>(&params, &setup).expect("a valid motor");
    let (mut state, mut impacts_of_pair) = (MotorState::default(), [0; 2]);
    for command in schedule() {
        for impact in motor.step_with(&mut state, command, &mut ledger) {
            impacts_of_pair[usize::from(impact.pair)] += 1;
        }
        look(&state);
    }
    let flows = ledger.flows();
    ((ledger.stored_j(&state) - flows.net_j()) / flows.turnover_j(), impacts_of_pair)
}

#[track_caller]
fn check_books<S: Scope>(look: impl Fn(&MotorState<f64>)) -> [[u32; 2]; 2] {
    RULES.map(|rule| {
        let (imbalance, impacts_of_pair) = account::<S>(rule, &look);
        assert_close(imbalance, 0.0, Within::absolute(1e-9), format!("{:?}, {rule:?}", S::default()));
        assert!(impacts_of_pair[0] > 50, "{impacts_of_pair:?}");
        impacts_of_pair
    })
}

/// Nothing tangential acts on the heights: without it they are the same to the bit.
#[test]
fn dual_heights_do_not_feel_the_rotation() {
    for rule in RULES {
        let (params, setup) = (MotorParams::nominal(), setup(rule));
        let whole = motor::<f64>(&params, &setup);
        let heights = Motor::<f64, HeightOnly>::try_new(&params, &setup).expect("a valid motor");
        let (mut state, mut reduced) = (MotorState::default(), MotorState::default());
        let mut impacts = 0;
        for command in schedule() {
            let (of_whole, of_reduced) =
                (whole.step(&mut state, command), heights.step(&mut reduced, command));
            assert_eq!(of_whole.len(), of_reduced.len());
            impacts += of_whole.len();
            assert_eq!((state.modes, state.pressed), (reduced.modes, reduced.pressed));
            assert_eq!(
                (state.rotor.height_m, state.rotor.velocity_m_s),
                (reduced.rotor.height_m, reduced.rotor.velocity_m_s)
            );
        }
        assert!(impacts > 100 && state.rotor.rate_rad_s.abs() < 1.0, "{impacts}");
        assert!(state.rotor.angle.angle().degrees().abs() > 1.0, "the whole motor turned");
        assert_eq!(reduced.rotor.angle, motor_model::AngleAccumulator::default());
    }
}

#[test]
fn law_books_close_without_rotation() {
    check_books::<HeightOnly>(|state| assert!(state.rotor.rate_rad_s == 0.0));
}

#[test]
fn law_books_close_without_mode_a() {
    check_books::<WithoutModeA>(|state| {
        assert!(state.modes.displacement_m.x == 0.0 && state.modes.velocity_m_s.x == 0.0);
    });
}

#[test]
fn law_one_pair_strikes_alone() {
    for impacts_of_pair in check_books::<OnePair>(|state| assert!(!state.pressed[1])) {
        assert_eq!(impacts_of_pair[1], 0);
    }
}

#[test]
fn law_a_bouncer_has_one_mode_and_one_pair() {
    let impacts = check_books::<Bouncer>(|state| {
        let ModalState { displacement_m, velocity_m_s } = state.modes;
        assert!(displacement_m.xy().amax() == 0.0 && velocity_m_s.xy().amax() == 0.0);
        assert!(state.rotor.rate_rad_s == 0.0 && !state.pressed[1]);
    });
    assert!(impacts.iter().all(|pairs| pairs[1] == 0));
}

/// A blow on what a scope keeps: momentum is shared with the modes that move, `1 + r = 1 + (m_r / m_s) (phi_A^2 + 2 phi_B^2 + 2 phi_C^2)` over
/// those alone.
#[test]
fn exact_recoil_of_the_modes_that_move() {
    fn share<S: Scope>() -> f64 {
        let params = MotorParams::nominal();
        let motor = Motor::<f64, S>::try_new(&params, &setup(ImpactRule::Located)).expect("a valid motor");
        let mut state = MotorState::default();
        state.rotor.height_m = 1e-6;
        state.rotor.velocity_m_s = -0.2;
        let impact = loop {
            if let Some(impact) = motor.step(&mut state, DriveCommand::OFF).first() {
                break *impact;
            }
        };
        let dv = impact.normal_impulse_n_s / params.get(Parameter::RotorMass);
        dv / ((1.0 + params.get(Parameter::Restitution)) * impact.approach_m_s)
    }
    let params = MotorParams::nominal();
    let ratio = params.get(Parameter::RotorMass) / params.get(Parameter::StatorMass);
    let tooth = motor_model::ToothPair::<f64>::both(&params, &motor_model::AmplitudeVariation::default())[0];
    let squares = [1.0, 2.0 * tooth.shape.y * tooth.shape.y, 2.0 * tooth.shape.z * tooth.shape.z];
    let expected = |modes: [bool; 3]| {
        let sum: f64 = squares.iter().zip(modes).filter(|&(_, moves)| moves).map(|(square, _)| square).sum();
        1.0 / (1.0 + ratio * sum)
    };
    assert_close(share::<OnePair>(), expected([true; 3]), Within::relative(1e-12), "all modes");
    assert_close(share::<WithoutModeA>(), expected(WithoutModeA::MODES), Within::relative(1e-12), "B and C");
    assert_close(share::<Bouncer>(), expected(Bouncer::MODES), Within::relative(1e-12), "C");
}
