//! Friction in sustained contact, and the mean rates.

use motor_model::params::Parameter;
use motor_model::{AmplitudeVariation, DriveCommand, DriveMode, MotorParams};

use super::super::Reference;
use super::super::events::ReferenceObserver;
use super::super::state::ReferenceState;
use super::super::system::Segment;
use super::{params, reference};
use simulation::math::random_streams::{RandomSource, stream};

/// A rotor that turns on still teeth slows by `mu m_r g R_t / J` and stops after `rate^2 / 2` over that.
#[test]
fn exact_sliding_to_a_stop() {
    let p = params(&[(Parameter::TangentialDrag, 0.0)]);
    let motor = reference(&p);
    let mut state = ReferenceState::default();
    motor.run(&mut state, DriveCommand::OFF, 0.2, &mut ()).unwrap();
    state.rate_rad_s = 1.0;
    state.angle_rad = 0.0;
    let torque = 0.4 * p.get(Parameter::RotorMass) * 9.81 * p.get(Parameter::ToothRadius);
    let slowing = torque / p.get(Parameter::RotorInertia);
    motor.run(&mut state, DriveCommand::OFF, 1e-4, &mut ()).unwrap();
    assert!((state.rate_rad_s - (1.0 - 1e-4 * slowing)).abs() < 1e-12);
    motor.run(&mut state, DriveCommand::OFF, 0.01, &mut ()).unwrap();
    assert!(state.rate_rad_s.abs() < 1e-9);
    assert!((state.angle_rad - 0.5 / slowing).abs() < 1e-12 * 0.5 / slowing + 1e-13);
}

/// The rotation by many small explicit steps along the reference's vertical motion.
struct BruteForce<'a> {
    motor: &'a Reference,
    params: MotorParams,
    v: f64,
    arc_m: f64,
}

impl ReferenceObserver for BruteForce<'_> {
    fn segment(&mut self, _: &ReferenceState, segment: &Segment, end: f64) {
        let system = &self.motor.system;
        let radius = self.params.get(Parameter::ToothRadius);
        let mass = self.params.get(Parameter::RotorInertia) / (radius * radius);
        let mu = self.params.get(Parameter::Friction);
        let dt = segment.duration_s * end / 400.0;
        for step in 0..400 {
            let tau = end * (f64::from(step) + 0.5) / 400.0;
            let modes = segment.at(tau).modes;
            for (p, tooth) in system.teeth.iter().enumerate() {
                let most =
                    mu * system.rotor_mass_kg * segment.normal_force_per_mass_m_s2[p].at(tau) / mass * dt;
                let slip = tooth.tangential_velocity(&modes) - self.v;
                self.v += slip.clamp(-most, most);
            }
            self.arc_m += self.v * dt;
        }
    }
}

/// A burst of ten cycles in mode C at 0.3, in sustained contact, sticking and slipping.
#[test]
fn dual_a_burst_against_brute_force() {
    let params = params(&[]);
    let motor = reference(&params);
    let mut state = ReferenceState::default();
    motor.run(&mut state, DriveCommand::OFF, 0.05, &mut ()).unwrap();
    state.angle_rad = 0.0;
    let mut brute = BruteForce { motor: &motor, params, v: 0.0, arc_m: 0.0 };
    let drive = DriveCommand::try_new(DriveMode::C, 0.3).unwrap();
    motor.run(&mut state, drive, 10.0 / 7460.0, &mut brute).unwrap();
    motor.run(&mut state, DriveCommand::OFF, 0.01, &mut brute).unwrap();
    let expected = brute.arc_m / params.get(Parameter::ToothRadius);
    assert!(state.angle_rad < -1e-5, "{}", state.angle_rad);
    assert!((state.angle_rad / expected - 1.0).abs() < 2e-3, "{} {expected}", state.angle_rad);
}

/// A run divided into pieces of 7 us gives the same angle.
#[test]
fn law_pieces_make_the_whole() {
    let motor = reference(&params(&[]));
    let drive = DriveCommand::try_new(DriveMode::C, 0.3).unwrap();
    let (mut whole, mut pieces) = (ReferenceState::default(), ReferenceState::default());
    motor.run(&mut whole, drive, 7e-3, &mut ()).unwrap();
    for _ in 0..1000 {
        motor.run(&mut pieces, drive, 7e-6, &mut ()).unwrap();
    }
    assert!((whole.angle_rad / pieces.angle_rad - 1.0).abs() < 1e-9, "{whole:?} {pieces:?}");
    assert!((whole.height_m - pieces.height_m).abs() < 1e-18);
}

/// Mean rates against a fixed step of 0.1 us with five seeds of 2 s: B 15.2 +- 0.2 rad/s, C -1.53 +- 0.01. Here three
/// seeds of 2 s have a standard error of 0.2 and 0.01. The bands are four times that.
#[test]
fn regress_mean_rates() {
    for (mode, expected, band) in [(DriveMode::B, 15.2, 0.8), (DriveMode::C, -1.53, 0.04)] {
        let params = params(&[]);
        let rates = (1..=3).map(|seed| {
            let variation =
                AmplitudeVariation::draw(&params, &mut stream(seed, RandomSource::AmplitudeVariation));
            let motor = Reference::try_new(&params, &variation).unwrap();
            let mut state = ReferenceState::default();
            motor.run(&mut state, DriveCommand::full(mode), 0.5, &mut ()).unwrap();
            let start_rad = state.angle_rad;
            motor.run(&mut state, DriveCommand::full(mode), 2.0, &mut ()).unwrap();
            (state.angle_rad - start_rad) / 2.0
        });
        let mean = rates.sum::<f64>() / 3.0;
        assert!((mean - expected).abs() < band, "{mode:?}: {mean}");
    }
}

/// Degenerate motors under changing drive: no run stalls, no tooth enters the rotor.
#[test]
fn law_degenerate_motors() {
    use Parameter::{Friction, Gravity, ModeBDampingRatio, Restitution, RotorMass, VerticalDamping};
    let motors: [&[(Parameter, f64)]; 8] = [
        &[(Gravity, 0.0)],
        &[(Gravity, -9.81)],
        &[(Restitution, 0.0)],
        &[(Restitution, 0.999)],
        &[(Friction, 0.0), (Restitution, 0.0)],
        &[(Friction, 100.0), (Gravity, 100.0)],
        &[(RotorMass, 4.6e-3), (ModeBDampingRatio, 0.99)],
        &[(RotorMass, 1e-7), (VerticalDamping, 0.0)],
    ];
    for changes in motors {
        let motor = reference(&params(changes));
        let mut state = ReferenceState::default();
        for (command, duration_s) in [
            (DriveCommand::full(DriveMode::C), 5e-3),
            (DriveCommand::OFF, 1e-3),
            (DriveCommand::full(DriveMode::B), 5e-3),
            (DriveCommand::saturating(DriveMode::B, 0.1), 5e-3),
            (DriveCommand::OFF, 2e-2),
        ] {
            motor.run(&mut state, command, duration_s, &mut ()).unwrap();
            assert!(state.angle_rad.is_finite() && state.velocity_m_s.is_finite(), "{changes:?}");
            for tooth in &motor.system.teeth {
                let gap_m = state.height_m - tooth.height(&state.modes);
                assert!(gap_m > -1e-18, "{changes:?}: {gap_m}");
            }
        }
    }
}
