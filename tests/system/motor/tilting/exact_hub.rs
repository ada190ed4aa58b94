//! The pin: the angle of the tilt stop, what rolling costs, the couple of a stop.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{
    ContactPlace, DriveCommand, Freedom, Parameter, TiltingParameter, TiltingSetup, TiltingState,
};
use nalgebra::Vector2;

use super::{at_end, in_space, motor, tilting};

/// In the middle of the hole both edges meet the pin at the tilt `eta_c` with `(l/2) eta_c + (a/2) eta_c^2 = c`.
#[test]
fn exact_angle_of_the_tilt_stop() {
    for (clearance, length) in
        [(5e-6, 350e-6), (7e-6, 350e-6), (20e-6, 350e-6), (20e-6, 3e-3), (50e-6, 350e-6)]
    {
        let hole =
            tilting(&[(TiltingParameter::HubClearance, clearance), (TiltingParameter::HubLength, length)]);
        let motor = motor(&(in_space(&[]), hole), &TiltingSetup::with_step(1e-6));
        let (a, half) = (1e-3 + clearance, 0.5 * length);
        let stop = ((half * half + 2.0 * a * clearance).sqrt() - half) / a;
        let gaps = |tilt: f64| {
            let mut state = TiltingState::<f64>::default();
            state.tilt.slope = Vector2::new(0.6, -0.8) * tilt;
            [ContactPlace::UpperEdge, ContactPlace::LowerEdge]
                .map(|edge| motor.gap_m(&state, edge).expect("there is a pin"))
        };
        for gap in gaps(stop) {
            assert!(gap.abs() < 1e-17, "{gap:e}");
        }
        assert!(gaps(0.99 * stop).iter().all(|gap| *gap > 0.0));
        assert!(gaps(1.01 * stop).iter().all(|gap| *gap < 0.0));
    }
}

/// A level rotor that meets the pin with one edge and sticks there rolls: of its spin it gives up `m r^2 / (J + m
/// r^2)`, nearly 9 % (r: radius of the hole, `J` that of a thin rotor without length of hole).
#[test]
fn exact_rolling_on_the_pin_gives_up_a_part_of_the_spin() {
    let (radius, clearance) = (1e-3, 7e-6);
    let hole = tilting(&[
        (TiltingParameter::HubClearance, clearance),
        (TiltingParameter::HubFriction, 1e3),
        (TiltingParameter::HubRestitution, 0.0),
        // A disc without thickness: both edges are one, at the mass centre.
        (TiltingParameter::HubLength, 0.0),
    ]);
    let motor = motor(&(in_space(&[]), hole), &at_end(1e-7));
    let mut state = TiltingState::<f64>::default();
    state.rotor.height_m = 1e-2;
    state.rotor.rate_rad_s = 10.0;
    state.shift.displacement_m.x = clearance - 1e-9;
    state.shift.velocity_m_s.x = 0.05;
    let contacts = motor.step(&mut state, DriveCommand::OFF);
    assert!(!contacts.is_empty());
    let a = radius + clearance;
    let given_up = 46e-6 * a * a / (4.59e-10 + 46e-6 * a * a);
    let lost = 1.0 - state.rotor.rate_rad_s / 10.0;
    // The contact is found up to a step too deep: 5e-9 m in 1e-3 m.
    assert!((lost / given_up - 1.0).abs() < 1e-4, "{lost} {given_up}");
    assert!((given_up - 0.09).abs() < 0.005, "{given_up}");
    // Rolling: the point of contact stands still.
    let slip = state.shift.velocity_m_s.y - a * state.rotor.rate_rad_s;
    assert!(
        slip.abs() < 1e-4 * 10.0 * a || (slip + 2.0 * a * state.rotor.rate_rad_s).abs() < 1e-4 * 10.0 * a,
        "{slip}"
    );
}

/// The stop reverses the tilt to `-e_h` of it. Both edges carry `I (1 + e_h) q / (2 l)`, `l = l_h/2 + a eta_c`.
#[test]
fn exact_couple_of_the_tilt_stop() {
    let hole = tilting(&[(TiltingParameter::HubClearance, 7e-6), (TiltingParameter::HubFriction, 0.0)]);
    let inertia = 4.59e-10 / 2.0 + 46e-6 * 350e-6 * 350e-6 / 12.0;
    let (a, half, rate) = (1.007e-3, 175e-6, 9.0);
    let stop = ((half * half + 2.0 * a * 7e-6_f64).sqrt() - half) / a;
    for freedom in [Freedom::Full, Freedom::WithoutShift] {
        let setup = TiltingSetup { freedom, ..TiltingSetup::with_step(1e-6) };
        let motor = motor(&(in_space(&[(Parameter::Friction, 0.0)]), hole), &setup);
        let mut state = TiltingState::<f64>::default();
        state.rotor.height_m = 1e-2;
        state.tilt.slope.y = stop - 4e-6;
        state.tilt.rate_rad_s.y = rate;
        let contacts = motor.step(&mut state, DriveCommand::OFF);
        let impulses: Vec<_> = contacts.iter().map(|contact| contact.normal_impulse_n_s).collect();
        let each = inertia * 1.5 * rate / (2.0 * (half + a * stop));
        assert_eq!(impulses.len(), 2, "{freedom:?} {contacts:?}");
        for impulse in impulses {
            assert!((impulse / each - 1.0).abs() < 1e-9, "{freedom:?} {impulse} {each}");
        }
        assert!((state.tilt.rate_rad_s.y + 0.5 * rate).abs() < 1e-9, "{freedom:?}");
    }
}
