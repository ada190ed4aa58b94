//! What the twin has learnt of the motor, and what is true of it.
//!
//! A motor with the values `x'` differs from its design, with the values `x`, by these parts:
//!
//! | of | truth |
//! |---|---|
//! | stiffness | `kappa = (w' / w)^2 - 1`, w: natural angular frequency |
//! | damping | `c = zeta' w' / (zeta w) - 1` |
//! | driven amplitude | `f = a' / a - 1 - c`, a: acceleration by the full drive, `2 zeta w^2 A` |
//! | mass ratio, restitution | `m = (m_r' / m_s') / (m_r / m_s) - 1`, `q = (1 + e) / (1 + e') - 1` |
//! | pairs of teeth | their variation of the amplitude; and the angle of the teeth `d = th' - th`, in rad |
//! | friction, tooth factor | kick per jump `mu m_r R_t / J`, tangential velocity per radius `L / R_t`, each less 1 |

use motor_model::{AmplitudeVariation, Mode, MotorParams, OutOfBounds, Parameter, Phase, Real, Time};

use super::super::TwinFilter;
use super::super::rotor::{FRICTION_PRIOR, TOOTH_FACTOR_PRIOR};
use super::super::states::{DRIVE_PHASE, MODE_PARAMETERS, PRIOR};

/// Number of parameters: 13 of the stator filter, then friction and tooth factor of the rotor filter.
pub const LEARNT: usize = DRIVE_PHASE - MODE_PARAMETERS + 2;

/// Their names, in the order of every list of them.
pub const LEARNT_NAMES: [&str; LEARNT] = [
    "stiffness of A",
    "damping of A",
    "stiffness of B",
    "damping of B",
    "amplitude of B",
    "stiffness of C",
    "damping of C",
    "amplitude of C",
    "mass ratio",
    "restitution",
    "first pair",
    "second pair",
    "tooth angle",
    "friction",
    "tooth factor",
];

/// What a filter says of a number that is constant in a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt {
    /// The part by which it is off the design; of the tooth angle in rad.
    pub estimate: f64,
    /// Variance of that.
    pub variance: f64,
    /// Variance that the filter starts with.
    pub prior_variance: f64,
}

/// Phase of the drive by which the twin steps its stator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearntPhase {
    /// The instant that it belongs to: that up to which the stator has been stepped.
    pub at: Time,
    /// The phase.
    pub phase: Phase,
    /// Its variance in rad^2.
    pub variance_rad2: f64,
    /// Variance that the filter starts with, in rad^2.
    pub prior_rad2: f64,
}

impl<T: Real> TwinFilter<T> {
    /// What the filter has learnt, in the order of [`LEARNT_NAMES`]; `None` before the first frame.
    pub fn learnt(&self) -> Option<[Learnt; LEARNT]> {
        let rotor = &self.tracker.track()?.state.covariance;
        let variances = self.stator.covariance.variances();
        let stator = (self.stator.parameters.iter().zip(&variances).zip(PRIOR))
            .map(|((estimate, variance), prior)| learnt(*estimate, *variance, prior));
        let [friction2, tooth_factor2] = rotor.factor_variances();
        let factors = [
            learnt(rotor.friction - T::one(), friction2, FRICTION_PRIOR),
            learnt(rotor.tooth_factor - T::one(), tooth_factor2, TOOTH_FACTOR_PRIOR),
        ];
        let mut all = stator.take(DRIVE_PHASE).skip(MODE_PARAMETERS).chain(factors);
        let none = Learnt { estimate: 0.0, variance: 0.0, prior_variance: 0.0 };
        Some(core::array::from_fn(|_| all.next().unwrap_or(none)))
    }

    /// What the filter has learnt of the drive's phase; `None` before the first sample.
    pub fn learnt_phase(&self) -> Option<LearntPhase> {
        let square = |sd: f64| sd * sd;
        Some(LearntPhase {
            at: self.stator.at?,
            phase: self.stator.state.phase,
            variance_rad2: self.stator.covariance.variance::<DRIVE_PHASE>().to_f64(),
            prior_rad2: PRIOR.get(DRIVE_PHASE).copied().map_or(0.0, square),
        })
    }
}

fn learnt<T: Real>(estimate: T, variance: T, prior: f64) -> Learnt {
    Learnt { estimate: estimate.to_f64(), variance: variance.to_f64(), prior_variance: prior * prior }
}

/// The parts by which the motor of `params`, whose teeth vary by `variation`, is off its design, in the order of
/// [`LEARNT_NAMES`].
///
/// # Errors
/// When mode A of either is damped beyond 0.99 of critical.
pub fn true_parts(
    design: &MotorParams,
    params: &MotorParams,
    variation: &AmplitudeVariation,
) -> Result<[f64; LEARNT], OutOfBounds> {
    let ([a, b, c], [a_true, b_true, c_true]) = (Mode::all(design)?, Mode::all(params)?);
    let ([k_a, c_a, _], [k_b, c_b, f_b], [k_c, c_c, f_c]) =
        (of_mode(&a, &a_true), of_mode(&b, &b_true), of_mode(&c, &c_true));
    let part = |of: fn(&MotorParams) -> f64| of(params) / of(design) - 1.0;
    let tooth_angle_deg = params.effective_tooth_angle_deg() - design.effective_tooth_angle_deg();
    let [first, second] = variation.pairs;
    let mass_ratio = part(MotorParams::mass_ratio);
    let restitution = part(|params| 1.0 / (1.0 + params.get(Parameter::Restitution)));
    let friction = part(|params| {
        params.get(Parameter::Friction)
            * params.get(Parameter::RotorMass)
            * params.get(Parameter::ToothRadius)
            / params.get(Parameter::RotorInertia)
    });
    let tooth_factor = part(|params| params.lever() / params.get(Parameter::ToothRadius));
    let d = tooth_angle_deg.to_radians();
    Ok([
        k_a,
        c_a,
        k_b,
        c_b,
        f_b,
        k_c,
        c_c,
        f_c,
        mass_ratio,
        restitution,
        first,
        second,
        d,
        friction,
        tooth_factor,
    ])
}

/// Stiffness, damping and driven amplitude; the last is no number of a mode that is not driven.
fn of_mode(design: &Mode, truth: &Mode) -> [f64; 3] {
    let frequency = truth.natural_rad_s / design.natural_rad_s;
    let damping = truth.damping_ratio / design.damping_ratio * frequency - 1.0;
    let drive = truth.drive_acceleration_m_s2() / design.drive_acceleration_m_s2();
    [frequency * frequency - 1.0, damping, drive - 1.0 - damping]
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode, DriveTuning, Stator, StatorState};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;
    use crate::filters::twin::checked_motor::{CheckedMotor, PERIOD_S};
    use crate::filters::twin::states::Row;
    use crate::filters::twin::stator::StatorFilter;
    use crate::filters::twin::tests::filter;
    use crate::filters::twin::tuning::TwinTuning;
    use crate::instruments::Instruments;

    /// The stator filter of the design, told the parts of a drawn motor, swings as that motor does: its steps are
    /// explicit in the parameters, which leaves 2 % of their effect. Teeth, mass ratio and restitution follow to the
    /// first order: what is left is quadratic in parts of at most 0.2.
    #[test]
    fn dual_a_filter_with_the_true_parts_is_the_true_motor() {
        let design = MotorParams::nominal();
        let motor = CheckedMotor::try_new(&design).unwrap();
        let tuning = DriveTuning::Fixed {
            b_hz: design.get(Parameter::ModeBFrequency),
            c_hz: design.get(Parameter::ModeCFrequency),
        };
        let mut rng = Pcg64::seed_from_u64(3);
        for mode in [DriveMode::B, DriveMode::C] {
            for _ in 0..4 {
                let params = design.draw(&mut rng);
                let variation = AmplitudeVariation::draw(&params, &mut rng);
                let parts = true_parts(&design, &params, &variation).unwrap();
                let at_rest = || {
                    StatorFilter::<f64>::at_rest(&motor, &TwinTuning::new(&design, &Instruments::default()))
                };
                let (mut untaught, mut taught) = (at_rest(), at_rest());
                for (state, part) in (MODE_PARAMETERS..DRIVE_PHASE).zip(parts) {
                    taught.parameters[state] = part;
                }
                let truth = Stator::<f64>::try_new(&params, tuning, PERIOD_S).unwrap();
                let mut state = StatorState::default();
                (0..800).for_each(|_| truth.step(&mut state, DriveCommand::full(mode)));
                for stator in [&mut untaught, &mut taught] {
                    stator.advance(Time::ZERO, DriveCommand::full(mode));
                    stator.advance(Time::from_micros(4000), DriveCommand::full(mode));
                }
                let off = |stator: &StatorFilter<f64>| {
                    (stator.state.modes.velocity_m_s - state.modes.velocity_m_s).norm()
                };
                assert!(off(&taught) < 0.02 * off(&untaught), "{} {}", off(&taught), off(&untaught));
                for (pair, of_truth) in motor_model::ToothPair::both(&params, &variation).iter().enumerate() {
                    let tooth = taught.tooth(pair, &Row::zeros());
                    let shape = (tooth.shape - of_truth.shape).norm();
                    let mass_ratio = 1.0 + taught.parameters[MODE_PARAMETERS + 8];
                    let recoil = (tooth.recoil * mass_ratio - of_truth.recoil).norm();
                    assert!(shape < 3e-4 && recoil < 4e-3, "{shape:e} {recoil:e}");
                }
                let e = params.get(Parameter::Restitution);
                let expected = (1.0 + design.get(Parameter::Restitution)) / (1.0 + e);
                assert!((parts[9] + 1.0 - expected).abs() < 1e-12);
            }
        }
    }

    /// Before any impact all is as at the start; the factors are known from the first frame on.
    #[test]
    fn exact_nothing_is_learnt_at_first() {
        use crate::filter::AngleFilter as _;
        use crate::measurement::CameraFrame;
        use motor_model::Angle;
        let mut filter = filter::<f64>();
        assert_eq!((filter.learnt(), filter.learnt_phase()), (None, None));
        filter.update_camera(&CameraFrame::new(Time::ZERO, Angle::ZERO));
        for (learnt, name) in filter.learnt().unwrap().iter().zip(LEARNT_NAMES) {
            assert!(learnt.estimate.abs() < 1e-12, "{name}");
            assert!((learnt.variance / learnt.prior_variance - 1.0).abs() < 1e-9, "{name}: {learnt:?}");
        }
    }
}
