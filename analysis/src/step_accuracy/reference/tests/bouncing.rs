//! Impacts: the bouncing ball, conservation at an impact, the energy of a run.

use core::f64::consts::TAU;

use motor_model::params::Parameter;
use motor_model::{DriveCommand, DriveMode, math};

use super::super::Reference;
use super::super::events::{ContactEvent, ContactEventKind, ReferenceObserver};
use super::super::state::ReferenceState;
use super::super::system::Segment;
use super::{Events, params, reference, rigid};

/// A ball dropped from `h` on a rigid floor has its impacts at `t0 (1 + 2 e + ... + 2 e^k)`, `t0 = sqrt(2 h / g)`, with
/// the speeds `sqrt(2 g h) e^k`. It is at rest from `t0 (1 + e) / (1 - e)`.
#[test]
fn exact_bouncing_ball_and_its_accumulation() {
    for e in [0.3, 0.6, 0.9] {
        let motor = reference(&rigid(&[(Parameter::Restitution, e)]));
        let mut state = ReferenceState { height_m: 1e-5, ..ReferenceState::default() };
        let mut events = Events::default();
        let fall_s = math::sqrt(2.0 * 1e-5 / 9.81);
        motor.run(&mut state, DriveCommand::OFF, 25.0 * fall_s, &mut events).unwrap();

        let (mut time_s, mut speed, mut flight_s) = (fall_s, 9.81 * fall_s, 2.0 * e * fall_s);
        let impacts = events.impacts();
        // Both pairs touch at once, but the impact of the first one lifts the rotor off.
        // After an impact of 14 mm/s the floor itself moves at about 4e-11 m/s, so impacts are compared down to 1 um/s.
        for &(at_s, approach) in &impacts {
            if speed < 1e-6 {
                break;
            }
            assert!((at_s - time_s).abs() < 1e-7 * time_s, "{e}: {at_s} {time_s}");
            assert!((approach - speed).abs() < 1e-6 * speed + 1e-9, "{e}: {approach} {speed}");
            time_s += flight_s;
            speed *= e;
            flight_s *= e;
        }
        assert!(speed < 1e-6, "{e}: the series was compared down to {speed}");
        let rest_s = events.first(ContactEventKind::Capture).unwrap();
        let expected_s = fall_s * (1.0 + e) / (1.0 - e);
        // The impacts left out below 1e-9 m/s, the floor's 4e-11 m/s, and the finite stiffness of the floor.
        let cut_off_s = 2.0 * 3e-9 / (9.81 * (1.0 - e));
        let most_s = cut_off_s + 1e-8 * expected_s;
        assert!((rest_s - expected_s).abs() < most_s, "{e}: {rest_s} {expected_s}");
        assert_eq!(state.contact, [true, true]);
    }
}

/// One impact: momentum of rotor and piston mode, generalised momenta of B and C, restitution, stick-limited friction.
#[test]
fn law_momentum_and_restitution() {
    let p = params(&[]);
    let motor = reference(&p);
    let (m_r, m_s) = (p.get(Parameter::RotorMass), p.get(Parameter::StatorMass));
    let mut state = ReferenceState { velocity_m_s: -0.1, rate_rad_s: -20.0, ..ReferenceState::default() };
    state.modes.displacement_m.y = 1e-6;
    state.modes.velocity_m_s.z = 0.2;
    let [tooth, _] = motor.system.teeth;
    state.height_m = tooth.height(&state.modes);
    let before = state;
    let mut events = Events::default();
    motor.run(&mut state, DriveCommand::OFF, 0.0, &mut events).unwrap();

    assert_eq!(events.0.len(), 1);
    let relative = |s: &ReferenceState| s.velocity_m_s - tooth.vertical_velocity(&s.modes);
    assert!((relative(&state) + 0.6 * relative(&before)).abs() < 1e-16);
    let rise = state.velocity_m_s - before.velocity_m_s;
    let jump = state.modes.velocity_m_s - before.modes.velocity_m_s;
    assert!(rise > 0.0);
    assert!((m_r * rise + m_s * jump.x).abs() < 1e-15 * m_r * rise);
    assert!((m_r * rise * tooth.shape.y + 0.5 * m_s * jump.y).abs() < 1e-15 * m_r * rise);
    assert!((m_r * rise * tooth.shape.z + 0.5 * m_s * jump.z).abs() < 1e-15 * m_r * rise);
    let torque_impulse = p.get(Parameter::RotorInertia) * (state.rate_rad_s - before.rate_rad_s);
    let most = p.get(Parameter::Friction) * m_r * rise * p.get(Parameter::ToothRadius);
    assert!((torque_impulse - most).abs() < 1e-12 * most, "sliding at mu N");
}

/// The energy balance of stator and vertical motion.
struct EnergyBalance<'a> {
    motor: &'a Reference,
    frequency_hz: f64,
    net_j: f64,
    turnover_j: f64,
}

impl EnergyBalance<'_> {
    fn add(&mut self, energy_j: f64) {
        self.net_j += energy_j;
        self.turnover_j += energy_j.abs();
    }
}

/// Gauss-Legendre on 0..1.
const NODES: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

impl ReferenceObserver for EnergyBalance<'_> {
    fn segment(&mut self, start: &ReferenceState, segment: &Segment, end: f64) {
        let system = &self.motor.system;
        let drive = system.modes[2].drive_acceleration_m_s2();
        for (node, weight) in NODES {
            let (tau, dt) = (node * end, weight * end * segment.duration_s);
            let at = segment.at(tau);
            let turns = start.phase_turns + self.frequency_hz * segment.duration_s * tau;
            let sine = math::sin_cos(TAU * turns).0;
            self.add(system.modes[2].mass_kg * drive * sine * at.modes.velocity_m_s.z * dt);
            for (n, mode) in system.modes.iter().enumerate() {
                let v = at.modes.velocity_m_s[n];
                self.add(-mode.mass_kg * 2.0 * mode.damping_ratio * mode.natural_rad_s * v * v * dt);
            }
            let v = at.velocity_m_s;
            self.add(-system.rotor_mass_kg * system.vertical_damping_per_s * v * v * dt);
        }
    }

    fn event(&mut self, event: &ContactEvent) {
        if let ContactEventKind::Impact { approach_m_s, .. } = event.kind {
            let system = &self.motor.system;
            let shape = system.teeth[event.pair].shape;
            let compliance: f64 = (0..3).map(|n| shape[n] * shape[n] / system.modes[n].mass_kg).sum();
            let mass_kg = 1.0 / (1.0 / system.rotor_mass_kg + compliance);
            self.add(-0.5 * (1.0 - 0.6 * 0.6) * mass_kg * approach_m_s * approach_m_s);
        }
    }
}

/// Stored energy against drive work less damping and impact losses, from rest through contact, bounces and full speed.
#[test]
fn law_energy_balance() {
    let motor = reference(&params(&[]));
    let mut state = ReferenceState::default();
    let mut balance = EnergyBalance { motor: &motor, frequency_hz: 7460.0, net_j: 0.0, turnover_j: 0.0 };
    motor.run(&mut state, DriveCommand::full(DriveMode::C), 0.03, &mut balance).unwrap();
    let system = &motor.system;
    let modal = (0..3).map(|n| {
        let mode = &system.modes[n];
        let (g, v) = (state.modes.displacement_m[n] * mode.natural_rad_s, state.modes.velocity_m_s[n]);
        0.5 * mode.mass_kg * (g * g + v * v)
    });
    let rotor = system.rotor_mass_kg
        * (0.5 * state.velocity_m_s * state.velocity_m_s + system.gravity_m_s2 * state.height_m);
    let stored = modal.sum::<f64>() + rotor;
    assert!(state.contact == [false, false], "it has left the teeth");
    assert!(stored > 1e-9);
    assert!((stored - balance.net_j).abs() < 1e-11 * balance.turnover_j, "{stored} {}", balance.net_j);
}
