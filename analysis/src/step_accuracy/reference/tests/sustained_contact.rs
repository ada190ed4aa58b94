//! Sustained contact: sag and oscillation on the teeth, one pair, detachment.

use core::f64::consts::TAU;

use motor_model::params::Parameter;
use motor_model::{DriveCommand, DriveMode, math};

use super::super::events::ContactEventKind;
use super::super::state::ReferenceState;
use super::{Events, params, reference, rigid};

type Three = [f64; 3];

fn combined(x: Three, factor: f64, y: Three) -> Three {
    [x[0] + factor * y[0], x[1] + factor * y[1], x[2] + factor * y[2]]
}

fn dot(x: Three, y: Three) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// On both pairs, B and C cannot move: rotor and piston mode are one oscillator of mass `m_s + m_r` on the stiffness
/// `m_s w_A^2`, here released unloaded; it ends at `-m_r g / (m_s w_A^2)`.
#[test]
fn exact_sag_on_both_pairs() {
    let p = params(&[]);
    let motor = reference(&p);
    let (m_r, m_s) = (p.get(Parameter::RotorMass), p.get(Parameter::StatorMass));
    let stiffness = m_s * (TAU * p.get(Parameter::ModeAFrequency)) * (TAU * p.get(Parameter::ModeAFrequency));
    let sag = m_r * 9.81 / stiffness;
    let w = math::sqrt(stiffness / (m_s + m_r));
    let damping = p.get(Parameter::ModeADamping) + p.get(Parameter::VerticalDamping);
    let decay = damping / (2.0 * (m_s + m_r));
    let wd = math::sqrt(w * w - decay * decay);
    assert!((wd / TAU - 932.0).abs() < 5.0, "934 Hz = 2150 sqrt(10.7 / 56.7), less a little by damping");
    let mut state = ReferenceState::default();
    for piece in 1..=60 {
        motor.run(&mut state, DriveCommand::OFF, 1.3e-4, &mut ()).unwrap();
        let t = 1.3e-4 * f64::from(piece);
        let (sin, cos) = math::sin_cos(wd * t);
        let z = -sag * (1.0 - math::exp(-decay * t) * (cos + decay / wd * sin));
        assert!((state.height_m - z).abs() < 1e-13 * sag, "{t}: {} {z}", state.height_m);
        assert_eq!(state.contact, [true, true]);
    }
    motor.run(&mut state, DriveCommand::OFF, 0.2, &mut ()).unwrap();
    assert!((state.height_m + sag).abs() < 1e-14 * sag);
}

/// On one pair, stator and rotor obey `(M + m_r phi phi') g'' = -D g' - K g - m_r g phi - b_z phi phi' g'`: Runge-Kutta
/// with a step of 5 ns.
#[test]
fn dual_one_pair_against_runge_kutta() {
    let p = params(&[]);
    let motor = reference(&p);
    let system = &motor.system;
    let phi: Three = system.teeth[0].shape.into();
    let mass = system.modes.map(|mode| mode.mass_kg);
    let m_r = system.rotor_mass_kg;
    let acceleration = |g: Three, v: Three| -> Three {
        let u = dot(phi, v);
        let on_rotor = -m_r * (9.81 + system.vertical_damping_per_s * u);
        let force: Three = core::array::from_fn(|n| {
            let (w, zeta) = (system.modes[n].natural_rad_s, system.modes[n].damping_ratio);
            -mass[n] * (w * w * g[n] + 2.0 * zeta * w * v[n]) + on_rotor * phi[n]
        });
        // Sherman-Morrison.
        let free: Three = core::array::from_fn(|n| force[n] / mass[n]);
        let along: Three = core::array::from_fn(|n| phi[n] / mass[n]);
        combined(free, -m_r * dot(phi, free) / (1.0 + m_r * dot(phi, along)), along)
    };
    let (mut g, mut v): (Three, Three) = ([-1e-5, 1e-6, 0.0], [0.0; 3]);
    let mut state = ReferenceState::default();
    state.modes.displacement_m = g.into();
    state.height_m = dot(phi, g);
    motor.run(&mut state, DriveCommand::OFF, 1e-5, &mut ()).unwrap();
    assert_eq!(state.contact, [true, false]);
    let h = 5e-9;
    for _ in 0..2000 {
        let (v1, a1) = (v, acceleration(g, v));
        let (v2, g2) = (combined(v, 0.5 * h, a1), combined(g, 0.5 * h, v1));
        let a2 = acceleration(g2, v2);
        let (v3, g3) = (combined(v, 0.5 * h, a2), combined(g, 0.5 * h, v2));
        let a3 = acceleration(g3, v3);
        let (v4, g4) = (combined(v, h, a3), combined(g, h, v3));
        let a4 = acceleration(g4, v4);
        for n in 0..3 {
            g[n] += h / 6.0 * (v1[n] + 2.0 * v2[n] + 2.0 * v3[n] + v4[n]);
            v[n] += h / 6.0 * (a1[n] + 2.0 * a2[n] + 2.0 * a3[n] + a4[n]);
        }
    }
    for n in 0..3 {
        assert!((state.modes.displacement_m[n] - g[n]).abs() < 1e-13 * 1e-5);
        assert!((state.modes.velocity_m_s[n] - v[n]).abs() < 1e-12 * 0.1);
    }
    assert!((state.height_m - dot(phi, g)).abs() < 1e-18);
}

/// A mass on a plate that moves as `a sin wt` leaves it where `a w^2 sin wt = gravity`: at 30 degrees for
/// `a w^2 = 2 gravity`.
#[test]
fn exact_detachment_from_a_rigid_plate() {
    let w = TAU * 6300.0;
    let p = rigid(&[]);
    let amplitude = 2.0 * 9.81 / (w * w);
    let motor = reference(&p);
    let phi = motor.system.teeth[0].shape.y;
    let full = motor.system.modes[1].antinode_amplitude_m;
    // Full drive, its amplitude set by the parameter; steady motion lags the drive by a quarter turn.
    let scale = amplitude / (phi * full);
    let p = p.with(Parameter::ModeBToothAmplitude, 20.72e-6 * scale).unwrap();
    let motor = reference(&p);
    let start_turns = 5.0 / 360.0;
    let (sin, cos) = math::sin_cos(TAU * start_turns);
    let mut state = ReferenceState::default();
    state.modes.displacement_m.y = amplitude / phi * sin;
    state.modes.velocity_m_s.y = amplitude / phi * w * cos;
    state.phase_turns = start_turns + 0.25;
    state.height_m = amplitude * sin;
    state.velocity_m_s = amplitude * w * cos;
    let mut events = Events::default();
    motor.run(&mut state, DriveCommand::full(DriveMode::B), 1e-4, &mut events).unwrap();
    assert_eq!(events.first(ContactEventKind::Capture), Some(0.0));
    let detached_s = events.first(ContactEventKind::Detach).unwrap();
    assert!((detached_s - 25.0 / 360.0 / 6300.0).abs() < 1e-8 * 1e-5, "{detached_s}");
}
