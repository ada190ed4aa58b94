//! Each of thousands of impacts against the laws of collision, with teeth and masses written down again in the test.
//!
//! ```text
//! vertical momentum       M_n d(g_n') = -phi_n P,   m_r d(v_z) = P,   M_A = m_s, M_B = M_C = m_s / 2 in the paper
//! restitution             v_z+ - u'+ = e (u' - v_z)
//! angular impulse         J d(rate) = R_t I_t,   |I_t| <= c P,   of the slip's sign, never past the stick point
//! slip                    of the tooth as its recoil leaves it: s' - sum psi_n phi_n P / M_n
//! ```
//!
//! The state just before the impacts of a step is made by hand from the free motion of modes and rotor.

use motor_model::{
    AmplitudeVariation, DriveCommand, DriveMode, FrictionLaw, Impact, MotorParams, MotorSetup, MotorState,
    Parameter, Real,
};

use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{Bench, at_end_of_step, changed, epsilon, steps_in};
use crate::support::tooth::{Tooth, velocities};

/// What a run of impacts contained.
#[derive(Debug, Default)]
struct Tally {
    impacts: u32,
    sliding: u32,
    sticking: u32,
    in_pairs: u32,
}

/// The laws that one motor's impacts are held against.
struct Laws {
    params: MotorParams,
    teeth: [Tooth; 2],
    friction_law: FrictionLaw,
    /// Rounding of the motor's precision.
    epsilon: f64,
}

impl Laws {
    fn of<T: Real>(params: &MotorParams, setup: &MotorSetup) -> Self {
        let [first, second] = setup.variation.pairs;
        Self {
            params: *params,
            teeth: [Tooth::of(params, 0, first), Tooth::of(params, 1, second)],
            friction_law: setup.friction_law,
            epsilon: epsilon::<T>(),
        }
    }

    fn get(&self, parameter: Parameter) -> f64 {
        self.params.get(parameter)
    }

    fn tooth<T: Real>(&self, impact: &Impact<T>) -> &Tooth {
        &self.teeth[usize::from(impact.pair)]
    }

    /// Momentum lost by each mode and gained by the rotor is that of the impacts, one or two.
    fn check_momentum<T: Real>(&self, before: &MotorState<T>, after: &MotorState<T>, impacts: &[Impact<T>]) {
        let (v, v_after) = (velocities(&before.modes), velocities(&after.modes));
        let mass = self.get(Parameter::RotorMass);
        let (v_z, v_z_after) = (before.rotor.velocity_m_s.to_f64(), after.rotor.velocity_m_s.to_f64());
        let total: f64 = impacts.iter().map(|impact| impact.normal_impulse_n_s.to_f64()).sum();
        let speeds = v.iter().chain(&v_after).chain([&v_z, &v_z_after]).map(|speed| speed.abs()).sum::<f64>();
        let rounding = 4.0 * self.epsilon * speeds;
        let rise = total / mass;
        assert_close(
            v_z_after - v_z,
            rise,
            Within { rtol: 4.0 * self.epsilon, atol: rounding },
            "rotor's momentum",
        );
        for mode in 0..3 {
            let kick: f64 = (impacts.iter())
                .map(|impact| {
                    let tooth = self.tooth(impact);
                    tooth.shape()[mode] * impact.normal_impulse_n_s.to_f64() / tooth.modal_mass_kg()[mode]
                })
                .sum();
            let within = Within { rtol: 4.0 * self.epsilon, atol: rounding };
            assert_close(v_after[mode] - v[mode], -kick, within, format_args!("momentum of mode {mode}"));
        }
        // The pseudo-rigid body takes the rotor's whole momentum with the opposite sign, whatever the pairs do.
        let stator = self.teeth[0].modal_mass_kg()[0] * (v_after[0] - v[0]);
        let rotor = mass * (v_z_after - v_z);
        let atol = rounding * (mass + self.get(Parameter::StatorMass));
        assert_close(stator + rotor, 0.0, Within::absolute(atol), "momentum of stator and rotor");
    }

    /// Velocities across the contact of a single impact.
    fn check_restitution<T: Real>(&self, before: &MotorState<T>, after: &MotorState<T>, impact: &Impact<T>) {
        let tooth = self.tooth(impact);
        let closing = |state: &MotorState<T>| {
            tooth.vertical_velocity_m_s(&state.modes) - state.rotor.velocity_m_s.to_f64()
        };
        let speeds =
            velocities(&before.modes).iter().chain(&velocities(&after.modes)).map(|v| v.abs()).sum::<f64>()
                + before.rotor.velocity_m_s.to_f64().abs();
        let within = Within::absolute(16.0 * self.epsilon * speeds);
        let approach = closing(before);
        assert!(impact.approach_m_s > T::zero());
        assert_close(impact.approach_m_s.to_f64(), approach, within, "approach");
        assert_close(-closing(after), self.get(Parameter::Restitution) * approach, within, "restitution");
    }

    /// A pair that touches and approaches is struck in the same step, after the other one if need be.
    fn check_none_is_missed<T: Real>(
        &self,
        before: &MotorState<T>,
        after: &MotorState<T>,
        impacts: &[Impact<T>],
    ) {
        let gaps = [0, 1]
            .map(|pair: usize| before.rotor.height_m.to_f64() - self.teeth[pair].height_m(&before.modes));
        // The deeper pair comes first, and the other's impact may set it approaching again: that is for the next step.
        let last = usize::from(gaps[1] > gaps[0]);
        let rounding = 1e-4 * self.epsilon;
        if gaps[last] < -rounding && impacts.iter().all(|impact| usize::from(impact.pair) != last) {
            let tooth = &self.teeth[last];
            let closing = tooth.vertical_velocity_m_s(&after.modes) - after.rotor.velocity_m_s.to_f64();
            assert!(closing <= 16.0 * self.epsilon, "pair {last} touches and approaches at {closing:e} m/s");
        }
    }

    /// Rotation and friction of a single impact; true if the tooth slid.
    fn check_friction<T: Real>(
        &self,
        before: &MotorState<T>,
        after: &MotorState<T>,
        impact: &Impact<T>,
    ) -> bool {
        let tooth = self.tooth(impact);
        let radius = self.get(Parameter::ToothRadius);
        let inertia = self.get(Parameter::RotorInertia);
        let (rate, rate_after) = (before.rotor.rate_rad_s.to_f64(), after.rotor.rate_rad_s.to_f64());
        let tooth_speed = tooth.tangential_velocity_m_s(&before.modes);
        let tooth_speed_after = tooth.tangential_velocity_m_s(&after.modes);
        let speeds = velocities(&before.modes).iter().map(|v| v.abs()).sum::<f64>() + (radius * rate).abs();
        let rounding = 16.0 * self.epsilon * speeds;
        let within = Within::absolute(rounding);

        let (normal, tangential) =
            (impact.normal_impulse_n_s.to_f64(), impact.tangential_impulse_n_s.to_f64());
        let slip = tooth_speed + tooth.sway_per_n_s() * normal - radius * rate;
        assert_close(impact.slip_m_s.to_f64(), slip, within, "slip");
        assert_close(tooth_speed_after, slip + radius * rate, within, "tangential velocity after the recoil");
        let push = radius * (rate_after - rate);
        assert_close(push, radius * radius * tangential / inertia, within, "angular impulse");

        let mu = self.get(Parameter::Friction);
        let coefficient = match self.friction_law {
            FrictionLaw::Coulomb => mu,
            FrictionLaw::Paper => {
                let across = tooth.tangential_displacement_m(&before.modes).abs();
                mu.min(across / tooth.height_m(&before.modes).abs())
            }
        };
        // |s / u| of a tooth near its rest position is known to no better than its displacements are.
        let displacement_rounding = 16.0 * self.epsilon / coefficient.min(1.0);
        let limit = coefficient * normal * radius * radius / inertia;
        let limit_within = Within { rtol: displacement_rounding.min(0.1), atol: rounding };
        assert!(
            push.abs() <= limit || limit_within.holds(push.abs(), limit),
            "friction {push:e} beyond {limit:e}"
        );
        assert!(push * slip >= 0.0 || push.abs() <= rounding, "friction against the slip");
        let slip_after = slip - push;
        if slip.abs() <= limit {
            // Enough friction: it sticks, and stops there.
            assert!(
                slip_after.abs() <= rounding || limit_within.holds(slip.abs(), limit),
                "stuck at {slip_after:e}"
            );
            false
        } else {
            assert_close(push.abs(), limit, limit_within, "sliding friction");
            assert!(slip_after * slip >= 0.0 || slip_after.abs() <= rounding, "thrown past the tooth");
            true
        }
    }
}

fn check_run<T: Real>(params: &MotorParams, setup: &MotorSetup, mode: DriveMode, time_s: f64) -> Tally {
    let mut bench = Bench::<T>::new(params, setup);
    let laws = Laws::of::<T>(params, setup);
    let mut tally = Tally::default();
    for _ in 0..steps_in(time_s, setup.step_s) {
        let (before, impacts) = bench.step(DriveCommand::full(mode));
        let after = &bench.state;
        if impacts.is_empty() {
            assert_eq!(before.modes, after.modes);
            assert_eq!(before.rotor.velocity_m_s, after.rotor.velocity_m_s);
            continue;
        }
        laws.check_momentum(&before, after, &impacts);
        laws.check_none_is_missed(&before, after, &impacts);
        if let [impact] = impacts.as_slice() {
            laws.check_restitution(&before, after, impact);
            if laws.check_friction(&before, after, impact) {
                tally.sliding += 1;
            } else {
                tally.sticking += 1;
            }
        } else {
            tally.in_pairs += 1;
        }
        tally.impacts += 1;
    }
    tally
}

/// Both modes, both friction laws, pairs that differ.
fn check_everywhere<T: Real>() {
    for (mode, time_s) in [(DriveMode::B, 4.0), (DriveMode::C, 1.5)] {
        for friction_law in [FrictionLaw::Coulomb, FrictionLaw::Paper] {
            let setup = MotorSetup {
                friction_law,
                variation: AmplitudeVariation { pairs: [0.013, -0.02] },
                ..at_end_of_step(2e-6)
            };
            let tally = check_run::<T>(&MotorParams::nominal(), &setup, mode, time_s);
            assert!(tally.impacts > 900, "{mode:?} {friction_law:?}: {tally:?}");
            assert!(tally.sliding > 50, "{mode:?} {friction_law:?}: {tally:?}");
        }
    }
}

#[test]
fn law_momentum_restitution_and_friction_at_each_impact() {
    check_everywhere::<f64>();
}

#[test]
fn law_momentum_restitution_and_friction_at_each_impact_in_f32() {
    check_everywhere::<f32>();
}

/// A heavy rotor dropped flat on still teeth meets both pairs in one step: the first impact throws the other pair up.
fn check_both_pairs_in_one_step<T: Real>(share: f64) {
    let params = MotorParams::nominal();
    let mut bench = Bench::<T>::new(&params, &at_end_of_step(1e-6));
    bench.state.rotor.height_m = T::from_f64(100e-6);
    let (_, impacts) = bench.until_impact(DriveCommand::OFF, 100_000);
    let [first, second] = impacts.as_slice() else { panic!("{impacts:?}") };
    assert_eq!((first.pair, second.pair), (0, 1));
    // The impulse `P` on one pair moves the other's teeth by -sum phi_n phi_n' P / M_n = -(1 - 2) P / m_s: up, by P /
    // m_s.
    let (rotor, stator) = (params.get(Parameter::RotorMass), params.get(Parameter::StatorMass));
    let impulse = first.normal_impulse_n_s.to_f64();
    let approach = impulse / stator + first.approach_m_s.to_f64() - impulse / rotor;
    assert_close(
        second.approach_m_s.to_f64(),
        approach,
        Within::relative(share),
        "approach of the second pair",
    );
}

#[test]
fn law_both_pairs_strike_in_one_step() {
    check_both_pairs_in_one_step::<f64>(1e-9);
    check_both_pairs_in_one_step::<f32>(1e-5);
}

/// Two shifts and three modal masses, twice as far from the paper's as finite elements have them.
fn modal_masses() -> Vec<(Parameter, f64)> {
    vec![
        (Parameter::ModeBExtraShift, 2.6),
        (Parameter::ModeAMassFraction, 0.9),
        (Parameter::ModeBMassFraction, 0.56),
        (Parameter::ModeCMassFraction, 0.68),
    ]
}

/// With much friction every strike sticks; with none the rotor never turns; with a light rotor the recoil hardly
/// matters and with a heavy one it is nearly everything.
#[test]
fn law_impacts_at_extreme_parameters() {
    for (changes, sticks) in [
        (vec![(Parameter::Friction, 1e6)], Some(true)),
        (vec![(Parameter::Friction, 0.0)], Some(false)),
        (vec![(Parameter::Restitution, 0.0)], None),
        (vec![(Parameter::Restitution, 1.0)], None),
        (vec![(Parameter::RotorMass, 1e-7), (Parameter::RotorInertia, 1e-12)], None),
        (vec![(Parameter::RotorMass, 1e-3), (Parameter::RotorInertia, 1e-8)], None),
        (vec![(Parameter::ModeShift, 8.0)], None),
        (modal_masses(), None),
        ([modal_masses(), vec![(Parameter::Friction, 1e6)]].concat(), Some(true)),
    ] {
        let params = changed(&changes);
        for mode in [DriveMode::B, DriveMode::C] {
            for step_s in [0.9e-6, 3.3e-6, 13e-6] {
                let variation = AmplitudeVariation { pairs: [-0.03, 0.03] };
                let setup = MotorSetup { variation, ..at_end_of_step(step_s) };
                check_run::<f64>(&params, &setup, mode, 0.1);
                check_run::<f32>(&params, &setup, mode, 0.1);
            }
            let tally = check_run::<f64>(&params, &at_end_of_step(2e-6), mode, 0.3);
            assert!(tally.impacts > 10, "{changes:?} {mode:?} {tally:?}");
            match sticks {
                Some(true) => assert_eq!(tally.sliding, 0, "{changes:?} {mode:?}"),
                Some(false) => assert_eq!(tally.sticking, 0, "{changes:?} {mode:?}"),
                None => {}
            }
        }
    }
}
