use super::*;
use crate::drive::DriveMode;
use crate::energy::EnergyLedger;
use crate::params::Parameter;
use nalgebra::Vector3;

fn motor(step_s: f64, impact_rule: ImpactRule) -> (Motor<f64>, MotorSetup) {
    let setup = MotorSetup { impact_rule, ..MotorSetup::with_step(step_s) };
    (Motor::try_new(&MotorParams::nominal(), &setup).unwrap(), setup)
}

/// Driven in both modes and strongly enough to bounce and to ride, then left to come to rest on the teeth: what is
/// stored is what has flowed in, less what was lost. The ledger's quadrature and rounding leave 1e-9 of the turnover.
#[test]
fn law_energy_is_balanced() {
    for rule in [ImpactRule::Located, ImpactRule::EndOfStep] {
        for step_s in [1e-6, 5e-6] {
            let (motor, setup) = motor(step_s, rule);
            let mut ledger = EnergyLedger::try_new(&MotorParams::nominal(), &setup).unwrap();
            let (mut state, mut in_contact) = (MotorState::default(), 0);
            let weak = DriveCommand::try_new(DriveMode::C, 0.3).unwrap();
            for (command, time_s) in [
                (DriveCommand::full(DriveMode::B), 0.03),
                (DriveCommand::full(DriveMode::C), 0.03),
                (weak, 0.05),
                (DriveCommand::OFF, 0.04),
            ] {
                for _ in 0..(time_s / step_s) as u32 {
                    motor.step_with(&mut state, command, &mut ledger);
                    in_contact += u32::from(state.in_contact != [false; 2]);
                }
            }
            let flows = ledger.flows();
            let off = (ledger.stored_j(&state) - flows.net_j()) / flows.turnover_j();
            assert!(off.abs() < 1e-9, "{rule:?} {step_s}: {off:e} {flows:?}");
            assert_eq!(in_contact > 1000, rule == ImpactRule::Located, "{in_contact}");
        }
    }
}

/// A rotor that spins on teeth at rest is braked by `mu m g R / J`, 6e-3 rad/s a step, and turns by the mean of its
/// rates; the drag on the rotation is far less. Angles are kept to 1.5e-9 rad.
#[test]
fn exact_a_braked_rotor_turns_by_the_mean_of_its_rates() {
    let (motor, _) = motor(5e-6, ImpactRule::Located);
    let mut state = MotorState::default();
    for _ in 0..4000 {
        motor.step(&mut state, DriveCommand::OFF);
    }
    assert!(state.in_contact == [true; 2], "{state:?}");
    state.rotor.rate_rad_s = 15.0;
    let mut braked = 0;
    for _ in 0..2000 {
        let before = state.rotor;
        motor.step(&mut state, DriveCommand::OFF);
        let rotor = &state.rotor;
        let turned: f64 = rotor.angle.angle().radians_since(before.angle.angle());
        let expected = 0.5 * 5e-6 * (before.rate_rad_s + rotor.rate_rad_s);
        assert!((turned - expected).abs() < 3.2e-9, "{turned} {expected}");
        braked += u32::from(rotor.rate_rad_s < before.rate_rad_s - 3e-3);
    }
    assert!(braked > 100, "{braked}");
}

/// A rotor 0.2 um above teeth at rest that falls with 0.1 m/s meets them after 2 us; gravity adds 2e-11 m.
#[test]
fn exact_a_located_impact_tells_its_time() {
    let (motor, _) = motor(5e-6, ImpactRule::Located);
    let mut state = MotorState::<f64>::default();
    (state.rotor.height_m, state.rotor.velocity_m_s) = (2e-7, -0.1);
    let impacts = motor.step(&mut state, DriveCommand::OFF);
    let before_end_s = impacts.first().map(|impact| impact.before_end_s);
    assert!(before_end_s.is_some_and(|seconds| (seconds - 3e-6).abs() < 1e-9), "{before_end_s:?}");
}

/// Of two teeth that both are above the rotor at the end of a step, the one that is further above has struck.
#[test]
fn exact_the_deeper_tooth_strikes_first() {
    let (motor, _) = motor(1e-6, ImpactRule::EndOfStep);
    for (mode_b_m, expected) in [(5e-6, 0), (-5e-6, 1)] {
        let mut state = MotorState::<f64>::default();
        state.modes.displacement_m = Vector3::new(10e-6, mode_b_m, 0.0);
        state.modes.velocity_m_s.x = 0.2;
        let impacts = motor.step(&mut state, DriveCommand::OFF);
        assert_eq!(impacts.first().map(|impact| impact.pair), Some(expected));
        assert!(motor.gap_m(&state) > -1e-12, "{:e}", motor.gap_m(&state));
    }
}

/// In a step of more than half a turn of the fastest mode no impact can be located: it is at the end of the step.
#[test]
fn dual_impacts_of_an_unresolved_motor_are_at_the_end_of_the_step() {
    let fastest_hz = MotorParams::nominal().get(Parameter::ModeCFrequency);
    for (step_s, same) in [(0.51 / fastest_hz, true), (0.4 / fastest_hz, false)] {
        let [located, at_end] = [ImpactRule::Located, ImpactRule::EndOfStep].map(|rule| {
            let (motor, _) = motor(step_s, rule);
            let mut state = MotorState::default();
            for _ in 0..1000 {
                motor.step(&mut state, DriveCommand::full(DriveMode::B));
            }
            state
        });
        assert_eq!(located == at_end, same, "{step_s:e}");
    }
}

/// Two impacts in one step come in the order of time, so that no tooth is found above the rotor when it strikes. The
/// polynomial that stands for a gap is exact to the sixth power of the step: at 1 us to far below a nanometre.
#[test]
fn law_a_located_impact_has_no_gap() {
    for step_s in [1e-6, 5e-6] {
        let (motor, _) = motor(step_s, ImpactRule::Located);
        let (mut state, mut impacts) = (MotorState::default(), 0);
        for n in 0..(0.1 / step_s) as u32 {
            let mode = if n % 20_000 < 10_000 { DriveMode::B } else { DriveMode::C };
            for impact in &motor.step(&mut state, DriveCommand::full(mode)) {
                let in_time = (0.0..=step_s).contains(&impact.before_end_s);
                assert!(impact.gap_m.abs() < 1e-9 && in_time, "{step_s:e}: {impact:?}");
                impacts += 1;
            }
        }
        assert!(impacts > 50, "{impacts}");
    }
}
