//! Single contacts: recoil of one tooth and of a pair, momentum and angular momentum.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{ContactPlace, Parameter, TiltingContact, TiltingParameter, TiltingSetup, TiltingState};
use nalgebra::Vector2;

use super::{Sets, UNEQUAL, at_end, in_space, motor, own_stator, slow_in_b, step_and_flight, tilting};

const STATOR: f64 = 10.7e-6;
const ROTOR: f64 = 46e-6;
const SPIN_INERTIA: f64 = 4.59e-10;
const INERTIA: f64 = SPIN_INERTIA / 2.0 + ROTOR * 350e-6 * 350e-6 / 12.0;
const RADIUS: f64 = 3.063e-3;

/// Jump of a tooth's height over an impact.
fn tooth_jump(
    sets: &Sets,
    setup: &TiltingSetup,
    k: usize,
    from: &TiltingState<f64>,
    to: &TiltingState<f64>,
) -> f64 {
    let motor = motor(sets, setup);
    let tooth = &motor.teeth()[k];
    tooth.shape.dot(&(to.modes.velocity_m_s - from.modes.velocity_m_s))
        + tooth.outward.dot(&(to.stator_tilt.velocity_m_s - from.stator_tilt.velocity_m_s))
}

/// A blow P on one tooth moves it by `5 P / m_s`, two equal blows of P/2 on a pair by `3 P / m_s`, the paper's recoil
/// (8b, 12a).
#[test]
fn exact_recoil_of_one_tooth_and_of_a_pair() {
    check_recoil(&(in_space(&[]), tilting(&[])), [5.0, 3.0]);
}

/// With modal masses of the stator's own, by `P sum phi_n^2 / M_n` over all five modes and over A, B and C, which is
/// the recoil of the height-only motor: with `th_B = 26.065` and `th_C = 29.665` degrees,
///
/// ```text
/// 1/0.9 + sin^2(2 th_B)/0.56 + cos^2(2 th_C)/0.68 = 2.606538,     + 1/0.54 = 4.458390
/// ```
#[test]
fn exact_recoil_with_modal_masses_of_its_own() {
    let (params, tilting) = own_stator();
    let still = [Parameter::Gravity, Parameter::VerticalDamping, Parameter::TangentialDrag];
    let params = still.into_iter().fold(params, |params, of| params.with(of, 0.0).expect("none of it"));
    let wide = tilting.with(TiltingParameter::HubClearance, 20e-6).expect("wide");
    let angle = |deg: f64| (2.0 * deg).to_radians();
    let th = 90.0 - 62.635 + 1.3;
    let pair = 1.0 / 0.9 + angle(th - 2.6).sin().powi(2) / 0.56 + angle(th + 1.0).cos().powi(2) / 0.68;
    check_recoil(&(params, wide), [pair + 1.0 / 0.54, pair]);
}

/// A blow on one tooth moves it by the first of `times` `P / m_s`, equal blows on a pair by the second.
fn check_recoil(sets: &Sets, [of_one, of_pair]: [f64; 2]) {
    let setup = at_end(1e-7);
    let teeth = *motor(sets, &setup).teeth();
    let mut pair = TiltingState::<f64>::default();
    pair.rotor.velocity_m_s = -0.1;
    // Modes A and B lift the first pair; the other one is down.
    pair.modes.displacement_m.y = 1e-6;
    pair.rotor.height_m = 1e-6 * teeth[0].shape.y;
    let mut one = pair;
    // Low at tooth 0 alone: the plane turns about the opposite tooth.
    one.tilt.slope = teeth[0].outward * -1e-3;
    one.rotor.height_m += 1e-3 * RADIUS;
    for (start, places, times) in [(pair, vec![0, 2], of_pair), (one, vec![0], of_one)] {
        let (before, after, contacts) = step_and_flight(sets, &setup, &start);
        let struck: Vec<_> = contacts.iter().map(|contact| contact.place).collect();
        let expected: Vec<_> = places.iter().map(|&tooth| ContactPlace::Tooth(tooth)).collect();
        assert_eq!(struck, expected);
        let impulse: f64 = contacts.iter().map(|contact| contact.normal_impulse_n_s).sum();
        let jump = tooth_jump(sets, &setup, 0, &before, &after);
        assert!((jump / (-times * impulse / STATOR) - 1.0).abs() < 1e-12, "{jump}");
        // Restitution along the gap.
        let closing = contacts[0].approach_m_s;
        let opened = after.rotor.velocity_m_s - before.rotor.velocity_m_s
            + (after.tilt.rate_rad_s - before.tilt.rate_rad_s).dot(&(teeth[0].outward * RADIUS))
            - before.tilt.slope.dot(&(after.shift.velocity_m_s - before.shift.velocity_m_s))
            - jump;
        let friction: f64 = contacts.iter().map(|c| c.tangential_impulse_n_s[0].abs()).sum();
        if friction <= 0.0 {
            assert!((opened / (1.6 * closing) - 1.0).abs() < 1e-9, "{opened} {closing}");
        }
    }
}

/// Impulse on the rotor as a vector, and where it acts, from the lateral position of the mass centre.
fn impulse_and_arm(
    sets: &Sets,
    at: &TiltingState<f64>,
    contact: &TiltingContact<f64>,
) -> ([f64; 3], [f64; 3]) {
    let (x, y) = (at.shift.displacement_m.x, at.shift.displacement_m.y);
    let (sx, sy) = (at.tilt.slope.x, at.tilt.slope.y);
    let (p, [t_0, t_1]) = (contact.normal_impulse_n_s, contact.tangential_impulse_n_s);
    match contact.place {
        ContactPlace::Tooth(k) => {
            let angle = (sets.0.effective_tooth_angle_deg() + 90.0 * f64::from(k)).to_radians();
            let (sin, cos) = angle.sin_cos();
            let flat = [-sx * p + t_0 * sin + t_1 * cos, -sy * p - t_0 * cos + t_1 * sin];
            let up = p + t_0 * (sx * sin - sy * cos) + t_1 * (sx * cos + sy * sin);
            ([flat[0], flat[1], up], [RADIUS * cos - x, RADIUS * sin - y, 0.0])
        }
        ContactPlace::UpperEdge | ContactPlace::LowerEdge => {
            let level = if contact.place == ContactPlace::UpperEdge { 175e-6 } else { -175e-6 };
            let d = Vector2::new(x - level * sx, y - level * sy);
            let away = d / d.norm();
            let hole = 1e-3 + sets.1.get(TiltingParameter::HubClearance);
            let turn = hole * (sx * away.x + sy * away.y) * (sy * away.x - sx * away.y) / d.norm();
            let (sin, cos) = turn.atan().sin_cos();
            let n = [-cos * away.x + sin * away.y, -cos * away.y - sin * away.x];
            (
                [p * n[0] - t_0 * n[1], p * n[1] + t_0 * n[0], t_1],
                [1e-3 * n[0] - x, 1e-3 * n[1] - y, level - hole * (sx * away.x + sy * away.y)],
            )
        }
        _ => panic!("there is no floor and no ceiling"),
    }
}

/// Over every contact of a run in both modes: what the rotor gains in momentum and in angular momentum about the pin is
/// what contacts give it, and mode A loses what the teeth give.
#[test]
fn law_momentum_and_angular_momentum_over_every_contact() {
    use motor_model::{DriveCommand, DriveMode};
    let sets = slow_in_b();
    let setup = TiltingSetup { variation: UNEQUAL, ..at_end(4e-7) };
    let (running, free) = (
        motor(&sets, &setup),
        motor(&(sets.0, sets.1.with(TiltingParameter::HubClearance, 1.0).expect("wide")), &setup),
    );
    for mode in [DriveMode::B, DriveMode::C] {
        let mut state = TiltingState::<f64>::default();
        let (mut teeth, mut edges) = (0, 0);
        for _ in 0..400_000 {
            let command = DriveCommand::full(mode);
            let mut flown = state;
            flown.rotor.height_m += 0.1;
            free.step(&mut flown, command);
            flown.rotor.height_m -= 0.1;
            let contacts = running.step(&mut state, command);
            if contacts.is_empty() {
                continue;
            }
            let (mut force, mut vertical, mut scale) = ([0.0; 3], 0.0, 0.0);
            let mut by_teeth = 0.0;
            for contact in &contacts {
                let (impulse, arm) = impulse_and_arm(&sets, &flown, contact);
                for (sum, part) in force.iter_mut().zip(impulse) {
                    *sum += part;
                    scale += part.abs();
                }
                let (px, py) = (arm[0] + flown.shift.displacement_m.x, arm[1] + flown.shift.displacement_m.y);
                vertical += px * impulse[1] - py * impulse[0];
                if contact.place.is_tooth() {
                    by_teeth += contact.normal_impulse_n_s;
                    teeth += 1;
                } else {
                    edges += 1;
                }
            }
            let gained = [
                ROTOR * (state.shift.velocity_m_s.x - flown.shift.velocity_m_s.x),
                ROTOR * (state.shift.velocity_m_s.y - flown.shift.velocity_m_s.y),
                ROTOR * (state.rotor.velocity_m_s - flown.rotor.velocity_m_s),
            ];
            for (gained, given) in gained.into_iter().zip(force) {
                // The edge's normal is a unit vector to the fourth order of its turn, 0.3 rad at most.
                assert!((gained - given).abs() < 4e-3 * scale, "{mode:?}: {gained:e} {given:e} {contacts:?}");
            }
            assert!(
                (STATOR * (state.modes.velocity_m_s.x - flown.modes.velocity_m_s.x) + by_teeth).abs()
                    < 1e-9 * scale
            );
            // About the vertical axis: spin, orbit, and the nutation's share.
            let (eta, shift) = (&flown.tilt.slope, &flown.shift.displacement_m);
            let cross = |a: &Vector2<f64>, b: &Vector2<f64>| a.x * b.y - a.y * b.x;
            let turned = -SPIN_INERTIA * (state.rotor.rate_rad_s - flown.rotor.rate_rad_s)
                + ROTOR * cross(shift, &(state.shift.velocity_m_s - flown.shift.velocity_m_s))
                + INERTIA * cross(eta, &(state.tilt.rate_rad_s - flown.tilt.rate_rad_s));
            // Second order in the slopes is left out.
            let second = eta.norm_squared() + 4e-3;
            assert!((turned - vertical).abs() < second * scale * RADIUS, "{mode:?}: {turned:e} {vertical:e}");
        }
        assert!(teeth > 100, "{mode:?} {teeth} {edges}");
        assert!(mode == DriveMode::C || edges > 100, "{edges}");
    }
}
