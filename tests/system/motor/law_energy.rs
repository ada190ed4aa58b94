//! The account of energy: it closes, and its single lines are what closed forms say.
//!
//! In `f64` the books close to 1e-9 of the turnover at any step: the ledger's quadrature, five nodes of order 10, goes
//! in pieces over which the fastest mode turns by 0.75 rad at most.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{
    AmplitudeVariation, DriveCommand, DriveMode, DriveTuning, EnergyFlows, EnergyLedger, FrictionLaw,
    ImpactRule, Motor, MotorParams, MotorSetup, MotorState, Parameter, Real,
};

use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::motors::{at_end_of_step, changed, command, epsilon, motor, steps_in};
use crate::support::oscillator::Oscillator;

/// A motor whose energy is accounted for from a given state on.
pub struct Accounted<T: Real> {
    motor: Motor<T>,
    ledger: EnergyLedger,
    /// Where it is.
    pub state: MotorState<T>,
    stored_at_start_j: f64,
}

impl<T: Real> Accounted<T> {
    /// The account is opened at `state`.
    pub fn from(params: &MotorParams, setup: &MotorSetup, state: MotorState<T>) -> Self {
        let ledger = EnergyLedger::try_new(params, setup).expect("a valid motor");
        let stored_at_start_j = ledger.stored_j(&state);
        Self { motor: motor(params, setup), ledger, state, stored_at_start_j }
    }

    /// Runs under one command and returns the number of impacts.
    pub fn run(&mut self, command: DriveCommand, time_s: f64) -> u32 {
        (0..steps_in(time_s, self.motor.step_s()))
            .map(|_| {
                let impacts = self.motor.step_with(&mut self.state, command, &mut self.ledger);
                u32::try_from(impacts.len()).expect("few")
            })
            .sum()
    }

    /// The flows so far.
    pub fn flows(&self) -> EnergyFlows {
        self.ledger.flows()
    }

    /// Imbalance as a share of the turnover.
    pub fn imbalance(&self) -> f64 {
        let gained = self.ledger.stored_j(&self.state) - self.stored_at_start_j;
        (gained - self.flows().net_j()) / self.flows().turnover_j()
    }
}

/// Drive B and C, detuned, off, walking on teeth in sustained contact, bursts.
fn schedule() -> Vec<(DriveCommand, f64)> {
    let mut schedule = vec![
        (DriveCommand::full(DriveMode::B), 0.05),
        (DriveCommand::full(DriveMode::C), 0.05),
        (command(DriveMode::B, 0.4, 60.0), 0.02),
        (command(DriveMode::C, 0.8, -1500.0), 0.02),
        (DriveCommand::OFF, 0.05),
        (command(DriveMode::C, 0.3, 0.0), 0.1),
        (command(DriveMode::B, 0.1, 0.0), 0.1),
        (command(DriveMode::C, 0.5, 0.0), 0.05),
    ];
    for _ in 0..5 {
        schedule.push((DriveCommand::full(DriveMode::B), 1e-3));
        schedule.push((DriveCommand::OFF, 4e-3));
    }
    schedule
}

fn setup(step_s: f64) -> MotorSetup {
    MotorSetup { variation: AmplitudeVariation { pairs: [0.01, -0.015] }, ..at_end_of_step(step_s) }
}

fn check_books<T: Real>(params: &MotorParams, setup: &MotorSetup, share: f64, what: &str) {
    let mut start = MotorState::<T>::default();
    start.rotor.height_m = T::from_f64(5e-6);
    start.rotor.rate_rad_s = T::from_f64(-2.0);
    let mut accounted = Accounted::from(params, setup, start);
    for (command, time_s) in schedule() {
        accounted.run(command, time_s);
        let what = format!("{what}, {:e} s, {command:?}: {:?}", setup.step_s, accounted.flows());
        assert_close(accounted.imbalance(), 0.0, Within::absolute(share), what);
    }
}

/// Motors whose energy goes different ways.
fn motors() -> Vec<(&'static str, MotorParams)> {
    use Parameter::{
        Friction, Gravity, ModeAMassFraction, ModeBDampingRatio, ModeBExtraShift, ModeBMassFraction,
        ModeCMassFraction, ModeShift, Restitution, TangentialDrag, VerticalDamping,
    };
    let own_masses = [
        (ModeBExtraShift, 2.6),
        (ModeAMassFraction, 0.9),
        (ModeBMassFraction, 0.56),
        (ModeCMassFraction, 0.68),
    ];
    vec![
        ("nominal", changed(&[])),
        ("no squeeze film", changed(&[(VerticalDamping, 0.0)])),
        ("thick squeeze film", changed(&[(VerticalDamping, 0.5)])),
        ("gravity reversed", changed(&[(Gravity, -9.81)])),
        ("no gravity", changed(&[(Gravity, 0.0)])),
        ("elastic", changed(&[(Restitution, 1.0)])),
        ("plastic", changed(&[(Restitution, 0.0)])),
        ("rough", changed(&[(Friction, 100.0)])),
        ("smooth", changed(&[(Friction, 0.0)])),
        ("dragging", changed(&[(TangentialDrag, 1e-3)])),
        ("heavily damped B", changed(&[(ModeBDampingRatio, 0.9)])),
        ("shifted modes", changed(&[(ModeShift, 10.0)])),
        ("modal masses of its own", changed(&own_masses)),
    ]
}

#[test]
fn law_energy_account_closes() {
    for (what, params) in motors() {
        for step_s in [1e-6, 10e-6, 20e-6, 50e-6, 200e-6] {
            check_books::<f64>(&params, &setup(step_s), 1e-9, what);
        }
    }
    check_books::<f64>(&MotorParams::nominal(), &setup(0.25e-6), 1e-9, "nominal");
}

/// With located impacts and teeth in sustained contact the books close as well.
#[test]
fn law_energy_account_closes_with_located_impacts() {
    for (what, params) in motors() {
        for step_s in [1e-6, 10e-6, 20e-6, 50e-6, 200e-6] {
            let setup = MotorSetup { impact_rule: ImpactRule::Located, ..setup(step_s) };
            check_books::<f64>(&params, &setup, 1e-9, what);
        }
    }
}

#[test]
fn law_energy_account_closes_for_other_setups() {
    for impact_rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
        for friction_law in [FrictionLaw::Coulomb, FrictionLaw::Paper] {
            for tuning in [DriveTuning::Resonant, DriveTuning::Fixed { b_hz: 6278.3, c_hz: 7501.0 }] {
                let setup = MotorSetup { impact_rule, friction_law, tuning, ..setup(5e-6) };
                check_books::<f64>(&MotorParams::nominal(), &setup, 1e-9, "nominal");
            }
        }
    }
}

/// In `f32` a step, or a span of sustained contact within it, rounds each state by half a unit, of which the modes lose
/// `2 zeta w h` of their energy in the same time. Errors that all go one way add up to `epsilon / (zeta w h)` of the
/// turnover.
#[test]
fn law_energy_account_closes_in_f32_to_rounding() {
    for (what, params) in
        [("nominal", changed(&[])), ("no squeeze film", changed(&[(Parameter::VerticalDamping, 0.0)]))]
    {
        for (impact_rule, step_s) in [
            (ImpactRule::EndOfStep, 1e-6_f64),
            (ImpactRule::EndOfStep, 10e-6),
            (ImpactRule::Located, 1e-6),
            (ImpactRule::Located, 5e-6),
            (ImpactRule::Located, 10e-6),
            (ImpactRule::Located, 20e-6),
        ] {
            let decay = Oscillator::of(&params, DriveMode::B).decay_per_s();
            let span_s = if impact_rule == ImpactRule::Located { step_s.min(4e-6) } else { step_s };
            let share = epsilon::<f32>() / (decay * span_s);
            assert_between(share, 1e-6, 1e-3, "a bound that can fail");
            check_books::<f32>(&params, &MotorSetup { impact_rule, ..setup(step_s) }, share, what);
        }
    }
}

/// Rotor out of contact, steady state at resonance: supplied power = modal damping = 1/2 M (2 zeta w) (w A)^2.
#[test]
fn exact_supplied_power_and_modal_damping_in_steady_state() {
    let params = MotorParams::nominal();
    for mode in [DriveMode::B, DriveMode::C] {
        let oscillator = Oscillator::of(&params, mode);
        for step_s in [1e-6, 10e-6, 50e-6, 200e-6] {
            let within = Within::relative(1e-9);
            let mut start = MotorState::<f64>::default();
            start.rotor.height_m = 1.0;
            let mut settled = Accounted::from(&params, &setup(step_s), start);
            settled.run(DriveCommand::full(mode), 40.0 / oscillator.decay_per_s());
            let mut steady = Accounted::from(&params, &setup(step_s), settled.state);
            // 0.1 s is 630 periods of B and 746 of C.
            steady.run(DriveCommand::full(mode), 0.1);
            let speed = oscillator.natural_rad_s * oscillator.antinode_m;
            let power = 0.5 * (10.7e-6 / 2.0) * 2.0 * oscillator.decay_per_s() * speed * speed;
            let flows = steady.flows();
            assert_close(flows.supplied_j, 0.1 * power, within, format_args!("{mode:?} supplied"));
            assert_close(flows.modal_damping_j, 0.1 * power, within, format_args!("{mode:?} damping"));
        }
    }
}

/// Mode A rung by hand: all of `1/2 m_s (v^2 + w^2 g^2)` goes into its damping.
#[test]
fn exact_ring_down_of_mode_a_dissipates_its_energy() {
    let params = MotorParams::nominal();
    let mut start = MotorState::<f64>::default();
    start.rotor.height_m = 1.0;
    start.modes.displacement_m.x = 3e-6;
    start.modes.velocity_m_s.x = -0.02;
    let mut accounted = Accounted::from(&params, &setup(5e-6), start);
    accounted.run(DriveCommand::OFF, 0.05);
    let natural = TAU * 2150.0;
    let stored = 0.5 * 10.7e-6 * (0.02 * 0.02 + natural * natural * 9e-12);
    assert_close(accounted.flows().modal_damping_j, stored, Within::relative(1e-9), "energy of mode A");
}

/// A fall through the squeeze film: the loss is what potential energy did not become speed.
#[test]
fn exact_squeeze_film_takes_what_a_fall_loses() {
    for damping in [3.6e-3, 0.6e-3] {
        let params = changed(&[(Parameter::VerticalDamping, damping)]);
        let mut start = MotorState::<f64>::default();
        start.rotor.height_m = 0.01;
        let mut accounted = Accounted::from(&params, &setup(10e-6), start);
        let impacts = accounted.run(DriveCommand::OFF, 0.03);
        assert_eq!(impacts, 0);
        let (m, g, t) = (46e-6, 9.81, 0.03);
        let k = damping / m;
        // v = -(g/k)(1 - exp(-k t)), so the integral of v^2 is (g/k)^2 (t - 2 (1 - e)/k + (1 - e^2)/2k), e = exp(-k t).
        let e = (-k * t).exp();
        let square = (g / k) * (g / k) * (t - 2.0 * (1.0 - e) / k + (1.0 - e * e) / (2.0 * k));
        assert_close(
            accounted.flows().squeeze_film_j,
            damping * square,
            Within::relative(1e-9),
            "squeeze film",
        );
    }
}

/// Rotation slowed by drag alone loses `1/2 J (rate0^2 - rate^2)`.
#[test]
fn exact_drag_takes_the_rotation() {
    let drag = 20.0 * 4.59e-10 / (3.063e-3 * 3.063e-3);
    let params = changed(&[(Parameter::TangentialDrag, drag), (Parameter::Gravity, 0.0)]);
    let mut start = MotorState::<f64>::default();
    start.rotor.height_m = 1e-3;
    start.rotor.rate_rad_s = 12.0;
    let mut accounted = Accounted::from(&params, &setup(10e-6), start);
    accounted.run(DriveCommand::OFF, 0.05);
    let lost = 0.5 * 4.59e-10 * 144.0 * (1.0 - (-2.0 * 20.0 * 0.05_f64).exp());
    assert_close(accounted.flows().drag_j, lost, Within::relative(1e-9), "drag");
}

/// The first impact of a drop on still teeth: `1/2 (1 - e^2) m_eff v^2` with `1 / m_eff = 1 / m_r + 3 / m_s`; a
/// spinning rotor loses `I_t (slip + slip after) / 2` on top, and the lift is the weight times the depth found. The
/// rotor is light: a heavy one would meet the other pair, which the impact throws up, in the same step.
#[test]
fn exact_losses_of_a_drop_on_still_teeth() {
    let mass = 1e-6;
    let params = changed(&[
        (Parameter::RotorMass, mass),
        (Parameter::VerticalDamping, 0.0),
        (Parameter::TangentialDrag, 0.0),
    ]);
    let setup = at_end_of_step(1e-6);
    let mut start = MotorState::<f64>::default();
    start.rotor.height_m = 100e-6;
    start.rotor.rate_rad_s = 30.0;
    let mut accounted = Accounted::from(&params, &setup, start);
    let mut impacts = motor_model::Impacts::new();
    while impacts.is_empty() && accounted.state.steps < 100_000 {
        impacts = accounted.motor.step_with(&mut accounted.state, DriveCommand::OFF, &mut accounted.ledger);
    }
    assert_eq!(impacts.len(), 1);
    let time_s = f64::from(u32::try_from(accounted.state.steps).expect("few")) * 1e-6;
    let speed = 9.81 * time_s;
    let depth = 0.5 * 9.81 * time_s * time_s - 100e-6;
    let effective = 1.0 / (1.0 / mass + 3.0 / 10.7e-6);
    let flows = accounted.flows();
    let normal = 0.5 * (1.0 - 0.36) * effective * speed * speed;
    assert_close(flows.normal_loss_j, normal, Within::relative(1e-9), "normal loss");
    assert_close(flows.lift_j, mass * 9.81 * depth, Within { rtol: 1e-6, atol: 1e-22 }, "lift");
    let impulse = 1.6 * effective * speed;
    let tangential = 0.4 * impulse;
    let (slip, radius, inertia) = (30.0 * 3.063e-3, 3.063e-3, 4.59e-10);
    let slip_after = slip - tangential * radius * radius / inertia;
    assert!(slip_after > 0.0, "the scene is meant to slide");
    assert_close(
        flows.friction_loss_j,
        tangential * 0.5 * (slip + slip_after),
        Within::relative(1e-9),
        "friction",
    );
    assert_close(flows.reaction_left_out_j, 0.0, Within::absolute(1e-25), "still teeth do no work");
}

/// What feeds the rotation in full drive is only the reaction left out less the friction: `1/2 J rate^2` accounted
/// alone.
#[test]
fn law_rotation_is_fed_by_friction_alone() {
    for mode in [DriveMode::B, DriveMode::C] {
        let params = MotorParams::nominal();
        let mut accounted = Accounted::from(&params, &setup(2e-6), MotorState::<f64>::default());
        accounted.run(DriveCommand::full(mode), 0.3);
        let flows = accounted.flows();
        let rotation = 0.5 * 4.59e-10 * accounted.state.rotor.rate_rad_s * accounted.state.rotor.rate_rad_s;
        let fed = flows.reaction_left_out_j - flows.friction_loss_j - flows.drag_j;
        assert_close(
            fed,
            rotation,
            Within { rtol: 1e-9, atol: 1e-9 * flows.friction_loss_j },
            format_args!("{mode:?}"),
        );
        assert!(flows.friction_loss_j > 0.0 && flows.normal_loss_j > 0.0 && flows.lift_j > 0.0);
    }
}
