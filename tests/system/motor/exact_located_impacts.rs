//! Impacts located inside the step: instants, speeds and their sequel against closed forms.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{DriveCommand, DriveMode, EnergyLedger, MotorParams, MotorSetup, Parameter, Real};

use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::live_teeth::{GRAVITY_M_S2, LiveTeeth, descent, on_rigid_floor};
use crate::support::motors::{Bench, changed, epsilon, located, steps_in};
use crate::support::tooth::Tooth;

const STEPS_S: [f64; 5] = [1e-6, 5e-6, 10e-6, 20e-6, 50e-6];
/// Recoil of [`on_rigid_floor`], `3 m_r / m_s`: the only thing that keeps it from being rigid.
const RECOIL: f64 = 3e-9;

/// What an impact on that floor leaves of the speed.
fn rebound_share(restitution: f64) -> f64 {
    (1.0 + restitution) / (1.0 + RECOIL) - 1.0
}

/// An impact on the time line.
#[derive(Clone, Copy, Debug)]
struct TimedImpact {
    time_s: f64,
    approach_m_s: f64,
}

/// Time of the last impact of a step, from the start of the run.
#[expect(clippy::cast_precision_loss, reason = "few steps")]
fn end_s<T: Real>(bench: &Bench<T>) -> f64 {
    bench.state.steps as f64 * bench.motor.step_s()
}

/// The first `count` impacts with the drive off, those within `steps_max` steps.
fn timed_impacts<T: Real>(bench: &mut Bench<T>, count: usize, steps_max: u32) -> Vec<TimedImpact> {
    let mut found = Vec::new();
    for _ in 0..steps_max {
        let impacts = bench.motor.step(&mut bench.state, DriveCommand::OFF);
        let end_s = end_s(bench);
        found.extend(impacts.iter().map(|impact| TimedImpact {
            time_s: end_s - impact.before_end_s.to_f64(),
            approach_m_s: impact.approach_m_s.to_f64(),
        }));
        if found.len() >= count {
            break;
        }
    }
    found.truncate(count);
    found
}

fn dropped<T: Real>(params: &MotorParams, step_s: f64, drop_m: f64) -> Bench<T> {
    let mut bench = Bench::new(params, &located(step_s));
    bench.state.rotor.height_m = T::from_f64(drop_m);
    bench
}

/// Falls of about `fall_s` that end at 64 evenly spread phases of a step.
fn falls_s(fall_s: f64, step_s: f64) -> impl Iterator<Item = f64> {
    let whole = (fall_s / step_s).floor() * step_s;
    (0..64).map(move |k| whole + step_s * (f64::from(k) + 0.37) / 64.0)
}

/// `z` and `v` of a fall from rest through the squeeze film, `k = b_z / m_r`.
fn fallen(k: f64, t: f64) -> (f64, f64) {
    if k == 0.0 {
        return (-0.5 * GRAVITY_M_S2 * t * t, -GRAVITY_M_S2 * t);
    }
    let loss = -(-k * t).exp_m1();
    (-GRAVITY_M_S2 / k * (t - loss / k), -GRAVITY_M_S2 / k * loss)
}

/// First contact at every phase of the step, with and without squeeze film.
///
/// In `f64` an instant is good to 1e-12 s. In `f32` each step rounds velocity and height by half a unit at most, so
/// after `n` steps the fall is off by `(n + 8) epsilon` of itself at worst; the place in the step is rounded alike.
fn check_first_blow<T: Real>(damping_per_s: f64, fall_s: f64) {
    let params =
        on_rigid_floor(0.6).with(Parameter::VerticalDamping, damping_per_s * 1e-9).expect("in bounds");
    for step_s in STEPS_S {
        for t in falls_s(fall_s, step_s) {
            let (z, v) = fallen(damping_per_s, t);
            let mut bench = dropped::<T>(&params, step_s, -z);
            let impact = timed_impacts(&mut bench, 1, 1_000_000)[0];
            let what = format!("b/m = {damping_per_s}, {step_s:e} s, fall of {t:e} s");
            let rounding = (t / step_s + 8.0) * epsilon::<T>();
            // The quintic's share: the sixth derivative of the fall is k^4 g.
            let curve_m = damping_per_s.powi(4) * GRAVITY_M_S2 * step_s.powi(6) / 46_080.0;
            let within = Within::absolute(1e-12 - curve_m / v + rounding * (t + step_s));
            assert_close(impact.time_s, t, within, format_args!("instant, {what}"));
            assert_close(
                impact.approach_m_s,
                -v,
                Within { rtol: rounding, atol: within.atol * GRAVITY_M_S2 },
                format_args!("approach, {what}"),
            );
        }
    }
}

#[test]
fn exact_first_blow_of_a_drop_at_every_phase_of_the_step() {
    for damping_per_s in [0.0, 78.26, 3000.0] {
        for fall_s in [20e-6, 0.4e-3, 2e-3] {
            check_first_blow::<f64>(damping_per_s, fall_s);
            check_first_blow::<f32>(damping_per_s, fall_s);
        }
    }
}

/// `e^2` of the height at any step, to rounding: what was a first-order error of the end-of-step rule is gone.
#[test]
fn exact_rebound_height_is_e_squared_at_any_step() {
    for restitution in [0.1, 0.3, 0.6, 0.9, 1.0] {
        let params = on_rigid_floor(restitution);
        for step_s in STEPS_S {
            for t in falls_s(2e-3, step_s).step_by(7) {
                let drop_m = 0.5 * GRAVITY_M_S2 * t * t;
                let mut bench = dropped::<f64>(&params, step_s, drop_m);
                timed_impacts(&mut bench, 1, 1_000_000);
                let up = bench.state.rotor.velocity_m_s;
                let apex_m = bench.state.rotor.height_m + up * up / (2.0 * GRAVITY_M_S2);
                let share = rebound_share(restitution);
                assert_close(
                    apex_m,
                    share * share * drop_m,
                    Within::relative(1e-12),
                    format_args!("e = {restitution}, {step_s:e} s"),
                );
            }
        }
    }
}

/// A rotor let go 15 us above the floor, within a step of 50 us: impacts after 15, 30 and 37.5 us; the next flight, of
/// 3.75 us, is under an eighth of a step, so the rotor stays down.
#[test]
fn exact_several_blows_within_one_step() {
    let (fall_s, step_s) = (15e-6, 50e-6);
    let mut bench = dropped::<f64>(&on_rigid_floor(0.5), step_s, 0.5 * GRAVITY_M_S2 * fall_s * fall_s);
    let impacts = bench.motor.step(&mut bench.state, DriveCommand::OFF);
    assert_eq!(impacts.len(), 3, "{impacts:?}");
    for (impact, (time_s, share)) in impacts.iter().zip([(15e-6, 1.0), (30e-6, 0.5), (37.5e-6, 0.25)]) {
        assert_close(step_s - impact.before_end_s, time_s, Within::absolute(1e-12), "instant");
        // Its own recoil meets the rotor again at a relative 1e-8.
        assert_close(impact.approach_m_s, share * GRAVITY_M_S2 * fall_s, Within::relative(1e-7), "approach");
    }
    assert_ne!(bench.state.in_contact, [false; 2]);
    bench.run(DriveCommand::OFF, 5e-3);
    assert_close(bench.state.rotor.height_m, 0.0, Within::absolute(1e-14), "it lies on the floor");
}

/// Zeno: infinitely many impacts until `sqrt(2 h / g) (1 + e) / (1 - e)`. The last one told is followed by a flight `f`
/// under an eighth of a step or, where four impacts fill a step's record, under a third of one, and so comes earlier by
/// `f / (1 - e)`.
#[test]
fn exact_accumulating_blows_end_in_rest_on_time() {
    for restitution in [0.2, 0.5, 0.8, 0.9] {
        let params = on_rigid_floor(restitution);
        for step_s in STEPS_S {
            for t in falls_s(0.4e-3, step_s).step_by(5) {
                let drop_m = 0.5 * GRAVITY_M_S2 * t * t;
                let mut bench = dropped::<f64>(&params, step_s, drop_m);
                let whole_s = t * (1.0 + restitution) / (1.0 - restitution);
                // Twice the time: whatever comes later would show.
                let all: Vec<TimedImpact> =
                    timed_impacts(&mut bench, usize::MAX, steps_in(2.0 * whole_s, step_s))
                        .into_iter()
                        .filter(|impact| impact.approach_m_s > 1e-9)
                        .collect();
                // The recoil lessens e by (1 + e) of itself; twice as much again for what the floor rings with.
                let recoil_s = 6.0 * (1.0 + restitution) / (1.0 - restitution).powi(2) * RECOIL * t;
                let last = all.last().expect("it falls");
                let rest_s = step_s / 3.0 / (1.0 - restitution);
                let what = format!("e = {restitution}, {step_s:e} s, fall of {t:e} s, {} impacts", all.len());
                let short_s = whole_s - last.time_s;
                assert_between(short_s, 0.0, rest_s * 1.000_001, &what);
                for (n, impact) in (0..).zip(&all) {
                    // Flights of e^n each way add up to this.
                    let power = restitution.powi(n);
                    let time_s = t * (1.0 + 2.0 * (restitution - power * restitution) / (1.0 - restitution));
                    assert_close(
                        impact.time_s,
                        time_s,
                        Within::absolute(1e-12 + recoil_s),
                        format_args!("impact {n}, {what}"),
                    );
                }
                assert_ne!(bench.state.in_contact, [false; 2], "{what}");
                // The gap at which it came to stay is taken back by a twentieth a span of 5 us: to e^-10 of it.
                bench.run(DriveCommand::OFF, 1e-3);
                assert_close(bench.state.rotor.height_m, 0.0, Within::absolute(1e-13), &what);
                assert_close(bench.state.rotor.velocity_m_s, 0.0, Within::absolute(1e-9), &what);
            }
        }
    }
}

/// `e = 0`: one impact, and the rotor lies there.
#[test]
fn exact_plastic_drop_stays_at_once() {
    for step_s in STEPS_S {
        for t in falls_s(1e-3, step_s).step_by(9) {
            let mut bench = dropped::<f64>(&on_rigid_floor(0.0), step_s, 0.5 * GRAVITY_M_S2 * t * t);
            timed_impacts(&mut bench, 1, 100_000);
            assert_ne!(bench.state.in_contact, [false; 2], "{step_s:e} s, {t:e} s");
            let later = timed_impacts(&mut bench, usize::MAX, steps_in(5e-3, step_s));
            // The floor itself rings with 1e-9 of the speed.
            assert!(later.iter().all(|impact| impact.approach_m_s < 1e-9), "{step_s:e} s, {later:?}");
            assert_close(
                bench.state.rotor.height_m,
                0.0,
                Within::absolute(1e-13),
                format_args!("{step_s:e} s"),
            );
        }
    }
}

/// `e = 1` on a floor without damping: 5,000 impacts lose nothing, at any step.
#[test]
fn law_elastic_bouncing_keeps_its_energy() {
    let undamped = [Parameter::ModeADamping, Parameter::ModeBDampingRatio, Parameter::ModeCDampingRatio];
    let params = undamped
        .iter()
        .fold(on_rigid_floor(1.0), |params, &damping| params.with(damping, 0.0).expect("zero is in bounds"));
    for step_s in STEPS_S {
        let fall_s = 0.1e-3;
        let drop_m = 0.5 * GRAVITY_M_S2 * fall_s * fall_s;
        let mut bench = dropped::<f64>(&params, step_s, drop_m);
        let mut ledger = EnergyLedger::try_new(&params, &located(step_s)).expect("a valid motor");
        let stored_j = ledger.stored_j(&bench.state);
        let mut count = 0;
        for _ in 0..steps_in(1.0, step_s) {
            count += bench.motor.step_with(&mut bench.state, DriveCommand::OFF, &mut ledger).len();
        }
        let what = format!("{step_s:e} s, {count} impacts");
        assert_between(f64::from(u32::try_from(count).expect("few")), 4990.0, 5010.0, &what);
        let within = Within::relative(1e-9);
        assert_close(ledger.stored_j(&bench.state), stored_j, within, format_args!("stored, {what}"));
        assert_close(
            ledger.flows().normal_loss_j,
            0.0,
            Within::absolute(1e-30),
            format_args!("loss, {what}"),
        );
        assert_close(
            ledger.flows().lift_j,
            0.0,
            Within::absolute(1e-9 * stored_j),
            format_args!("lift, {what}"),
        );
    }
}

/// `e = 0.999`: the thousandth impact comes at `e^1000` of the first one's speed, but for what the floor takes and
/// rings with, at most four times its recoil an impact.
#[test]
fn exact_almost_elastic_bouncing_decays_by_e_a_blow() {
    for step_s in STEPS_S {
        let fall_s = 0.2e-3;
        let mut bench = dropped::<f64>(&on_rigid_floor(0.999), step_s, 0.5 * GRAVITY_M_S2 * fall_s * fall_s);
        let all = timed_impacts(&mut bench, 1001, 10_000_000);
        for n in [1, 10, 100, 1000] {
            assert_close(
                all[usize::try_from(n).expect("small")].approach_m_s,
                GRAVITY_M_S2 * fall_s * 0.999_f64.powi(n),
                Within::relative(4.0 * RECOIL * f64::from(n) + 1e-9),
                format_args!("impact {n} at {step_s:e} s"),
            );
        }
    }
}

/// Teeth in full steady motion of mode B and C, at 64 phases of the drive: instant and speed of the first impact.
///
/// The curve that stands for the gap is off by `(w h)^6 A / 46080` (quintic Hermite interpolation: `|f^(6)| h^6 / 720 /
/// 64`), to be divided by the approach; 1e-12 s on top for rounding.
#[test]
fn exact_first_blow_on_live_teeth() {
    let params = changed(&[(Parameter::VerticalDamping, 0.0), (Parameter::Gravity, 0.0)]);
    for mode in [DriveMode::B, DriveMode::C] {
        for k in 0..64 {
            let scene = LiveTeeth::thrown_at(&params, mode, k, 64);
            let contact = scene.first_contact();
            for step_s in [0.25e-6, 1e-6, 5e-6, 10e-6, 20e-6] {
                let mut bench = Bench::<f64>::new(&params, &located(step_s));
                scene.set(&mut bench.state);
                let (_, impacts) = bench.until_impact(DriveCommand::full(mode), 1000);
                let impact = impacts[0];
                let time_s = end_s(&bench) - impact.before_end_s;
                let curve_m = (scene.natural_rad_s() * step_s).powi(6) * scene.tooth_amplitude_m() / 46_080.0;
                let within = Within::absolute(1e-12 + curve_m / scene.slowest_approach_m_s());
                let what = format!("{mode:?}, phase {k}, {step_s:e} s");
                assert_eq!(impact.pair, contact.pair, "{what}");
                assert_close(time_s, contact.time_s, within, format_args!("instant, {what}"));
                let rad_s = scene.natural_rad_s();
                let within =
                    Within::absolute(1e-10 + within.atol * rad_s * rad_s * scene.tooth_amplitude_m());
                let approach = contact.tooth_velocity_m_s - scene.down_m_s();
                assert_close(impact.approach_m_s, approach, within, format_args!("approach, {what}"));
            }
        }
    }
}

/// Mode A lifts both pairs at once against a heavy rotor: pair 0 strikes, its recoil throws the other pair up by `m_r /
/// m_s` of the impact, which strikes at the same instant. Speeds of approach by hand, `a_p -> -e a_p` and `a_q -> a_q +
/// (m_r / m_s - 1) dv` for the other pair, `dv = (1 + e) a_p / (1 + 3 m_r / m_s)`.
fn check_both_pairs_at_one_instant<T: Real>(step_s: f64) {
    let params = changed(&[
        (Parameter::ModeADamping, 0.0),
        (Parameter::Gravity, 0.0),
        (Parameter::VerticalDamping, 0.0),
    ]);
    let (restitution, ratio) = (0.6, 46.0 / 10.7);
    let (speed, rad_s, height_m) = (0.1, TAU * 2150.0, 3e-6);
    let time_s = (height_m * rad_s / speed).asin() / rad_s;
    let approach = speed * (rad_s * time_s).cos();
    let mut bench = Bench::<T>::new(&params, &located(step_s));
    bench.state.modes.velocity_m_s.x = T::from_f64(speed);
    bench.state.rotor.height_m = T::from_f64(height_m);
    let (_, impacts) = bench.until_impact(DriveCommand::OFF, 1000);
    assert!(impacts.len() >= 2, "{impacts:?}");
    let single = size_of::<T>() == 4;
    let instant = Within::absolute(if single { 64.0 * epsilon::<T>() * time_s } else { 1e-12 });
    let speeds = Within::relative(if single { 256.0 * epsilon::<T>() } else { 1e-6 });
    let mut approaches = [approach; 2];
    for (index, impact) in impacts.iter().take(2).enumerate() {
        let what = format!("impact {index} at {step_s:e} s, {} bytes", size_of::<T>());
        let striking = index % 2;
        assert_eq!(usize::from(impact.pair), striking, "{what}");
        assert_close(end_s(&bench) - impact.before_end_s.to_f64(), time_s, instant, &what);
        assert_close(impact.approach_m_s.to_f64(), approaches[striking], speeds, &what);
        let dv = (1.0 + restitution) * approaches[striking] / (1.0 + 3.0 * ratio);
        assert_close(impact.normal_impulse_n_s.to_f64(), 46e-6 * dv, speeds, &what);
        approaches[striking] *= -restitution;
        approaches[1 - striking] += (ratio - 1.0) * dv;
    }
}

#[test]
fn exact_both_pairs_strike_at_one_instant() {
    for step_s in [1e-6, 5e-6, 10e-6, 20e-6] {
        check_both_pairs_at_one_instant::<f64>(step_s);
        check_both_pairs_at_one_instant::<f32>(step_s);
    }
}

/// A rotor that begins inside the teeth, at rest or rising: it is put on them, with the energy accounted for, and comes
/// to rest.
#[test]
fn law_initial_penetration_ends_on_the_teeth() {
    for (depth_m, velocity_m_s) in
        [(1e-9, 0.0), (5e-6, 0.0), (5e-6, -0.05), (5e-6, 0.02), (5e-6, 0.3), (1e-3, 0.0)]
    {
        for step_s in [1e-6, 10e-6, 20e-6] {
            let params = changed(&[]);
            let setup: MotorSetup = located(step_s);
            let mut bench = Bench::<f64>::new(&params, &setup);
            bench.state.rotor.height_m = -depth_m;
            bench.state.rotor.velocity_m_s = velocity_m_s;
            let mut ledger = EnergyLedger::try_new(&params, &setup).expect("a valid motor");
            let stored_j = ledger.stored_j(&bench.state);
            let what = format!("{depth_m:e} m, {velocity_m_s} m/s, {step_s:e} s");
            for step in 0..steps_in(0.4, step_s) {
                bench.motor.step_with(&mut bench.state, DriveCommand::OFF, &mut ledger);
                if step > 0 {
                    // A pair that comes up, here with 0.05 m/s at most, while the other is in sustained contact is
                    // noticed at the end of a span.
                    let depth_m = 0.05 * step_s.min(5e-6);
                    assert_between(
                        bench.motor.gap_m(&bench.state),
                        -depth_m,
                        1e-2,
                        format_args!("gap, {what}"),
                    );
                }
            }
            assert_eq!(bench.state.in_contact, [true; 2], "{what}");
            let gaps = [0, 1].map(|pair| {
                bench.state.rotor.height_m - Tooth::of(&params, pair, 0.0).height_m(&bench.state.modes)
            });
            assert_close(gaps[0], 0.0, Within::absolute(1e-9), format_args!("first gap, {what}"));
            assert_close(gaps[1], 0.0, Within::absolute(1e-9), format_args!("second gap, {what}"));
            let gained_j = ledger.stored_j(&bench.state) - stored_j;
            let flows = ledger.flows();
            assert_close(
                gained_j,
                flows.net_j(),
                Within::absolute(1e-9 * flows.turnover_j()),
                format_args!("books, {what}"),
            );
        }
    }
}

/// The closed form with a squeeze film and the bisection are those of the drop without one where both apply.
#[test]
fn dual_yardsticks_agree() {
    let time_s = descent(|t| 20e-6 + fallen(0.01, t).0, 1.0);
    // Longer by k t / 6 in the leading order.
    assert_close(time_s, (40e-6 / GRAVITY_M_S2).sqrt(), Within::relative(1e-5), "fall of 20 um");
}
