//! Teeth in sustained contact with the rotor: rest, walking, detachment, friction, with impacts located inside the
//! step.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{DriveCommand, DriveMode, Parameter, Real};

use crate::motor::law_rest::sag_m;
use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::live_teeth::{GRAVITY_M_S2, on_rigid_floor};
use crate::support::motors::{Bench, changed, epsilon, located, steps_in};
use crate::support::tooth::Tooth;

const STEPS_S: [f64; 4] = [1e-6, 5e-6, 10e-6, 20e-6];

/// Both pairs in sustained contact, the height that balances the weight, no rotation; and all of it stays so for
/// `time_s`.
///
/// In `f32` the last bits of the modes go on ringing: gap and height are good to a few units of the sag's last place,
/// and the teeth's rounded motion may carry the rotor with it, to 1e-8 rad/s.
fn check_rest<T: Real>(bench: &mut Bench<T>, time_s: f64, what: &str) {
    let single = size_of::<T>() == 4;
    let height = Within::relative(if single { 16.0 * epsilon::<T>() } else { 1e-9 });
    let rate = Within::absolute(if single { 1e-8 } else { 1e-12 });
    assert_eq!(bench.state.in_contact, [true; 2], "{what}");
    let origin = bench.state.rotor.angle.angle();
    for _ in 0..steps_in(time_s, bench.motor.step_s()) {
        let impacts = bench.motor.step(&mut bench.state, DriveCommand::OFF);
        assert!(impacts.is_empty(), "{what}: {impacts:?}");
        assert_eq!(bench.state.in_contact, [true; 2], "{what}");
        let rotor = &bench.state.rotor;
        // Pushes that did not sum to g would move it.
        assert_close(rotor.height_m.to_f64(), -sag_m(), height, format_args!("height, {what}"));
        assert_close(rotor.rate_rad_s.to_f64(), 0.0, rate, format_args!("rate, {what}"));
    }
    let turned_rad = bench.state.rotor.angle.angle().minus(origin).degrees().to_radians();
    // One unit of the integer angle besides.
    let within = Within::absolute(2e-9 + rate.atol * time_s);
    assert_close(turned_rad, 0.0, within, format_args!("creep, {what}"));
    for pair in [0, 1] {
        let tooth_m = Tooth::of(&changed(&[]), pair, 0.0).height_m(&bench.state.modes);
        let gap_m = bench.state.rotor.height_m.to_f64() - tooth_m;
        let within = Within::absolute(if single { 16.0 * epsilon::<T>() * sag_m() } else { 1e-15 });
        assert_close(gap_m, 0.0, within, format_args!("gap of pair {pair}, {what}"));
    }
}

fn check_landing<T: Real>(step_s: f64) {
    for (drop_m, rate_rad_s) in [(0.0, 0.0), (1e-9, 0.0), (50e-6, 1.0), (2e-3, -15.0)] {
        let mut bench = Bench::<T>::new(&changed(&[]), &located(step_s));
        bench.state.rotor.height_m = T::from_f64(drop_m);
        bench.state.rotor.rate_rad_s = T::from_f64(rate_rad_s);
        bench.run(DriveCommand::OFF, 0.3);
        check_rest(&mut bench, 1.0, &format!("drop of {drop_m:e} m, {step_s:e} s, {} bytes", size_of::<T>()));
    }
}

/// Dropped from any height, or simply put there: 0.3 s later the rotor lies still, and stays so.
#[test]
fn law_a_dropped_rotor_comes_to_rest() {
    for step_s in STEPS_S {
        check_landing::<f64>(step_s);
        check_landing::<f32>(step_s);
    }
}

fn check_drive_off<T: Real>(mode: DriveMode, step_s: f64) {
    let mut running = Bench::<T>::new(&changed(&[]), &located(step_s));
    running.run(DriveCommand::full(mode), 0.3);
    for phase in 0..8 {
        // Another phase of the drive and of the bounce each time.
        running.run(DriveCommand::full(mode), 0.013 + f64::from(phase) * 19.7e-6);
        let mut bench = running.clone();
        bench.run(DriveCommand::OFF, 0.3);
        let what = format!("{mode:?}, phase {phase}, {step_s:e} s, {} bytes", size_of::<T>());
        check_rest(&mut bench, 0.1, &what);
    }
}

/// From full speed to rest in 0.3 s, whenever the drive is cut.
#[test]
fn law_drive_off_from_full_speed_ends_in_rest() {
    for mode in [DriveMode::B, DriveMode::C] {
        for step_s in STEPS_S {
            check_drive_off::<f64>(mode, step_s);
            check_drive_off::<f32>(mode, step_s);
        }
    }
}

/// A plate that shakes a light rotor up and down: mode A of a stator of a kilogram, undamped and let go at its middle
/// with `A w^2 = 2.5 g`. The rotor leaves when the plate falls faster than it can, `A w^2 sin(w t) = g`.
struct ShakenPlate {
    rad_s: f64,
    amplitude_m: f64,
}

impl ShakenPlate {
    const NOMINAL: Self =
        Self { rad_s: TAU * 2150.0, amplitude_m: 2.5 * GRAVITY_M_S2 / (TAU * TAU * 2150.0 * 2150.0) };

    fn leaves_s(&self) -> f64 {
        (GRAVITY_M_S2 / (self.amplitude_m * self.rad_s * self.rad_s)).asin() / self.rad_s
    }

    fn bench<T: Real>(&self, step_s: f64) -> Bench<T> {
        let params = on_rigid_floor(0.6).with(Parameter::ModeADamping, 0.0).expect("zero is in bounds");
        let mut bench = Bench::<T>::new(&params, &located(step_s));
        let speed = T::from_f64(self.amplitude_m * self.rad_s);
        bench.state.modes.velocity_m_s.x = speed;
        bench.state.rotor.velocity_m_s = speed;
        bench.state.in_contact = [true; 2];
        bench
    }
}

/// Departure within a span (here 0.25 rad of mode C: 5 us) and a step, the flight after it with an error of second
/// order in the span.
fn check_detachment<T: Real>(step_s: f64) {
    let plate = ShakenPlate::NOMINAL;
    let mut bench = plate.bench::<T>(step_s);
    let leaves_s = plate.leaves_s();
    let (mut time_s, mut pressed_until_s) = (0.0, 0.0);
    while time_s < leaves_s + 2.0 * step_s + 10e-6 {
        let impacts = bench.motor.step(&mut bench.state, DriveCommand::OFF);
        time_s += step_s;
        if bench.state.in_contact != [false; 2] {
            pressed_until_s = time_s;
        }
        // In f32 the pairs of a rigid plate, which should move as one, may brush by a rounding.
        let brush = 1e3 * epsilon::<T>() * plate.amplitude_m * plate.rad_s;
        assert!(
            impacts.iter().all(|impact| impact.approach_m_s.to_f64() < brush),
            "{step_s:e} s: {impacts:?}"
        );
    }
    let what = format!("departure, {step_s:e} s");
    assert_between(pressed_until_s, leaves_s - step_s - 5e-6, leaves_s + step_s.min(5e-6), what);
    // Until it has risen to its highest point.
    while bench.state.rotor.velocity_m_s > T::zero() {
        bench.motor.step(&mut bench.state, DriveCommand::OFF);
        time_s += step_s;
    }
    let angle = plate.rad_s * leaves_s;
    let (z, v) = (plate.amplitude_m * angle.sin(), plate.amplitude_m * plate.rad_s * angle.cos());
    let flight_s = time_s - leaves_s;
    let span_rad = plate.rad_s * step_s.min(5e-6);
    // Second order: the force is held over a span in which the plate's acceleration changes by a part (w h) of itself.
    let share = 0.5 * span_rad * span_rad + 1e4 * epsilon::<T>();
    assert_close(
        bench.state.rotor.velocity_m_s.to_f64(),
        v - GRAVITY_M_S2 * flight_s,
        Within::absolute(share * v),
        format_args!("speed after it, {step_s:e} s"),
    );
    assert_close(
        bench.state.rotor.height_m.to_f64(),
        z + v * flight_s - 0.5 * GRAVITY_M_S2 * flight_s * flight_s,
        Within::absolute(share * plate.amplitude_m * 2.5),
        format_args!("height after it, {step_s:e} s"),
    );
}

#[test]
fn exact_detachment_from_a_shaken_plate() {
    for step_s in [0.25e-6, 1e-6, 2e-6, 5e-6, 10e-6, 20e-6] {
        check_detachment::<f64>(step_s);
        check_detachment::<f32>(step_s);
    }
}

/// Shaken with 0.9 g it never leaves; the same plate at 1.1 g throws it off.
#[test]
fn law_a_plate_below_g_keeps_the_rotor() {
    for step_s in STEPS_S {
        for (share, stays) in [(0.9, true), (1.1, false)] {
            let nominal = ShakenPlate::NOMINAL;
            let plate = ShakenPlate { amplitude_m: nominal.amplitude_m * share / 2.5, ..nominal };
            let mut bench = plate.bench::<f64>(step_s);
            let mut always = true;
            for _ in 0..steps_in(5e-3, step_s) {
                let impacts = bench.motor.step(&mut bench.state, DriveCommand::OFF);
                always &= bench.state.in_contact != [false; 2] && impacts.is_empty();
                let gap_m = bench.motor.gap_m(&bench.state);
                let within = if stays { 1e-3 * plate.amplitude_m } else { 10.0 * plate.amplitude_m };
                assert_between(
                    gap_m,
                    -1e-3 * plate.amplitude_m,
                    within,
                    format_args!("gap, {share} g, {step_s:e} s"),
                );
            }
            assert_eq!(always, stays, "{share} g, {step_s:e} s");
        }
    }
}

/// A rotor that spins on still teeth is slowed by `mu m_r g R_t / J`, exactly and at any step, and then sticks.
fn check_spin_down<T: Real>(step_s: f64, friction: f64, rate_rad_s: f64) {
    let params = changed(&[(Parameter::Friction, friction), (Parameter::TangentialDrag, 0.0)]);
    let mut bench = Bench::<T>::new(&params, &located(step_s));
    bench.run(DriveCommand::OFF, 0.3);
    bench.state.rotor.rate_rad_s = T::from_f64(rate_rad_s);
    let origin = bench.angle_rad();
    let slowing = friction * 46e-6 * GRAVITY_M_S2 * 3.063e-3 / 4.59e-10;
    let stop_s = rate_rad_s.abs() / slowing;
    let what = format!("mu = {friction}, {step_s:e} s, {} bytes", size_of::<T>());
    let mut time_s = 0.0;
    let single = size_of::<T>() == 4;
    let within = Within::absolute(if single { 1e-4 } else { 1e-9 } * rate_rad_s.abs());
    for _ in 0..steps_in(0.02, step_s) {
        bench.motor.step(&mut bench.state, DriveCommand::OFF);
        time_s += step_s;
        let expected = rate_rad_s.signum() * (rate_rad_s.abs() - slowing * time_s).max(0.0);
        assert_close(bench.state.rotor.rate_rad_s.to_f64(), expected, within, format_args!("rate, {what}"));
    }
    let turning_s = stop_s.min(time_s);
    let turned = rate_rad_s.signum() * (rate_rad_s.abs() * turning_s - 0.5 * slowing * turning_s * turning_s);
    // In the span in which it stops, the change of rate is spread evenly over the span.
    let span_s = step_s.min(5e-6);
    let last_rad = 0.5 * rate_rad_s.abs().min(slowing * span_s) * span_s;
    let rounding = if single { 1e-4 } else { 1e-7 };
    // Two contacts of enormous friction balance each other to a rounding of their limits.
    let drift_rad = epsilon::<T>() * slowing * span_s * time_s;
    let within = Within { rtol: rounding, atol: 4e-9 + last_rad + drift_rad };
    assert_close(bench.angle_rad() - origin, turned, within, format_args!("angle, {what}"));
}

#[test]
fn exact_spin_down_on_pressed_teeth() {
    for step_s in STEPS_S {
        for sense in [1.0, -1.0] {
            for friction in [0.0, 0.4, 3.0, 1e6] {
                check_spin_down::<f64>(step_s, friction, 15.0 * sense);
                check_spin_down::<f32>(step_s, friction, 15.0 * sense);
            }
        }
    }
}

/// Without weight, or with it upwards, nothing stays in contact: the rotor leaves, in free flight.
#[test]
fn law_without_weight_nothing_stays_pressed() {
    for gravity in [0.0, -GRAVITY_M_S2] {
        for step_s in STEPS_S {
            let params = changed(&[(Parameter::Gravity, gravity), (Parameter::VerticalDamping, 0.0)]);
            let mut bench = Bench::<f64>::new(&params, &located(step_s));
            bench.state.in_contact = [true; 2];
            bench.state.rotor.velocity_m_s = 0.01;
            bench.run(DriveCommand::OFF, 10e-3);
            let what = format!("g = {gravity}, {step_s:e} s");
            assert_eq!(bench.state.in_contact, [false; 2], "{what}");
            assert_close(
                bench.state.rotor.height_m,
                0.01 * 0.01 - 0.5 * gravity * 1e-4,
                Within::relative(1e-9),
                format_args!("height, {what}"),
            );
            for mode in [DriveMode::B, DriveMode::C] {
                let mut bench = Bench::<f64>::new(&params, &located(step_s));
                bench.run(DriveCommand::full(mode), 0.1);
                bench.run(DriveCommand::OFF, 0.1);
                assert_eq!(bench.state.in_contact, [false; 2], "{mode:?}, {what}");
                assert_between(bench.state.rotor.height_m, 1e-6, 1.0, format_args!("{mode:?}, {what}"));
            }
        }
    }
}

fn command(mode: DriveMode, amplitude: f32) -> DriveCommand {
    DriveCommand::try_new(mode, amplitude).expect("a valid amplitude")
}

/// Mode C at 0.3 never lifts the rotor: in sustained contact all the time, no impact, and what the contact costs is far
/// below the friction.
#[test]
fn law_walking_is_pressed() {
    for step_s in [5e-6, 10e-6, 20e-6] {
        let mut bench = Bench::<f64>::new(&changed(&[]), &located(step_s));
        bench.run(DriveCommand::OFF, 0.1);
        bench.run(command(DriveMode::C, 0.3), 0.1);
        let mut hard = 0;
        for _ in 0..steps_in(0.2, step_s) {
            let impacts = bench.motor.step(&mut bench.state, command(DriveMode::C, 0.3));
            hard += impacts.iter().filter(|impact| impact.approach_m_s > 1e-3).count();
            // 1/20 of the teeth's travel.
            assert_between(bench.motor.gap_m(&bench.state), -1e-8, 3e-8, format_args!("gap at {step_s:e} s"));
        }
        assert_eq!(hard, 0, "{step_s:e} s");
    }
}
