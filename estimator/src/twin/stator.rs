//! The stator under measured impulses: its modes, the rotor's height over it, and the parameters that move both.
//!
//! The states are errors: of `(g, g')` in each mode and of the height z; of the last impact's instant, jump and tangential velocity; and of ten parameters, which
//! the plant keeps for ever and the filter therefore learns. A mode whose stiffness, damping and drive are off by the parts `k`, `c`, `f` moves as
//!
//! ```text
//! dg'' + 2 zeta w dg' + w^2 dg  =  -w^2 g k + (a - 2 zeta w g') c + a f          a: acceleration by the drive
//! ```
//!
//! since the drive's force is `2 zeta w^2 A`: damping and amplitude are what is measured (Table 1). The modes themselves are stepped with the parameters as
//! estimated; the effect of each parameter since the covariance was last carried forward is kept beside them, two numbers each.
//!
//! The height is the sum of the vibrometer's samples: its variance grows by `sigma^2 h^2` a sample, 28 nm in 4 ms.

use motor_model::{
    DriveCommand, DriveMode, DriveTuning, ModalState, Mode, MotorParams, OutOfBounds, Parameter, Phase, Real,
    Stator, StatorState, Time, ToothPair,
};
use nalgebra::{Matrix2, SVector, Vector2, Vector3};

use super::oscillator::Oscillator;
use super::tuning::TwinTuning;
use crate::factors::{NoiseSource, UdCovariance};
use crate::transition::{Blocks2, UpperTriangular};

/// Errors of the stator, of the last impact, and of the parameters.
pub(super) const STATES: usize = 20;
/// Tangential velocity of the tooth at the last impact.
pub(super) const TOOTH: usize = 0;
/// Height of the rotor.
pub(super) const HEIGHT: usize = 1;
/// Displacement of mode A; its velocity and the other modes' follow.
pub(super) const MODES: usize = 2;
/// Instant of the last impact, counted later.
pub(super) const INSTANT: usize = 8;
/// Jump of the rotor's velocity at the last impact.
pub(super) const JUMP: usize = 9;
/// Stiffness, damping and drive of A (which has no drive), B and C.
pub(super) const MODAL: usize = 10;
/// Part by which the mass ratio is off.
pub(super) const RECOIL: usize = 18;
/// Part by which `1 / (1 + e)` is off.
pub(super) const APPROACH: usize = 19;

/// Where each mode's parameters begin, and how many there are.
const MODAL_PLACES: [(usize, usize); 3] = [(MODAL, 2), (MODAL + 2, 3), (MODAL + 5, 3)];

pub(super) type Errors<T> = SVector<T, STATES>;

/// Period at which the stator is stepped, that of the vibrometer.
pub(super) const PERIOD_NANOS: u64 = 5_000;
pub(super) const PERIOD_S: f64 = 5e-6;

/// A time without news longer than this is not stepped through: the modes are begun anew.
const LONGEST_NANOS: u64 = 10_000_000;

/// The stator as the filter believes it to be.
#[derive(Clone, Debug)]
pub(super) struct StatorBelief<T: Real> {
    model: Stator<T>,
    pub(super) state: StatorState<T>,
    at: Option<Time>,
    pub(super) oscillators: [Oscillator<T>; 3],
    /// Acceleration by the drive now, in m/s^2.
    pub(super) drive_m_s2: Vector3<T>,
    step: [Matrix2<T>; 3],
    pub(super) height_m: T,
    /// Errors of the parameters so far found, as parts; the other entries are not used.
    pub(super) found: Errors<T>,
    /// Effect of each mode's parameters on it since the covariance was last carried.
    slopes: [[Vector2<T>; 3]; 3],
    /// Flow since then.
    flow: [Matrix2<T>; 3],
    waited_s: T,
    pub(super) covariance: UdCovariance<T, STATES>,
    /// The last impact's jump as believed.
    pub(super) jump_m_s: T,
    /// `(1 + r) / (1 + e)`.
    pub(super) approach_per_jump: T,
    /// `r / (1 + r)`.
    pub(super) recoil_share: T,
    /// Velocity variance fed per second into each mode, in m^2/s^3.
    fed_m2_s3: [T; 3],
    /// Variance fed per second into the height, in m^2/s.
    height_m2_s: T,
}

impl<T: Real> StatorBelief<T> {
    /// The stator of `params` at rest.
    pub(super) fn try_new(params: &MotorParams, tuning: &TwinTuning<T>) -> Result<Self, OutOfBounds> {
        let modes = Mode::all(params)?;
        let r = 3.0 * params.mass_ratio();
        let fed = |mode: &Mode| {
            // Mode A is not driven; B and C leave it some micrometres.
            let speed = mode.natural_rad_s
                * if mode.antinode_amplitude_m > 2e-6 { mode.antinode_amplitude_m } else { 2e-6 };
            let part = tuning.contact.fed_part;
            part * part * T::from_f64(4.0 * mode.damping_ratio * mode.natural_rad_s * speed * speed)
        };
        let square = |x: T| x * x;
        Ok(Self {
            model: Stator::try_new(params, DriveTuning::Resonant, PERIOD_S)?,
            state: StatorState::default(),
            at: None,
            oscillators: modes.each_ref().map(Oscillator::new),
            drive_m_s2: Vector3::zeros(),
            step: modes.map(|mode| {
                let [[gg, gv], [vg, vv]] = mode.propagator(PERIOD_S);
                Matrix2::new(gg, gv, vg, vv).map(T::from_f64)
            }),
            height_m: T::zero(),
            found: Errors::zeros(),
            slopes: [[Vector2::zeros(); 3]; 3],
            flow: [Matrix2::identity(); 3],
            waited_s: T::zero(),
            covariance: UdCovariance::from_diagonal(&at_rest(tuning)),
            jump_m_s: T::zero(),
            approach_per_jump: T::from_f64((1.0 + r) / (1.0 + params.get(Parameter::Restitution))),
            recoil_share: T::from_f64(r / (1.0 + r)),
            fed_m2_s3: modes.each_ref().map(fed),
            height_m2_s: square(tuning.detector.noise_m_s) * T::from_f64(PERIOD_S),
        })
    }

    pub(super) fn teeth(&self) -> &[ToothPair<T>; 2] {
        self.model.teeth()
    }

    /// Moves the stator to `to` under `command`.
    pub(super) fn advance(&mut self, to: Time, command: DriveCommand) {
        let mut at = *self.at.get_or_insert(to);
        let behind = to.nanos_since(at);
        if behind > LONGEST_NANOS {
            let periods = behind / PERIOD_NANOS;
            let turned = self.state.forcing.increment().units().wrapping_mul(periods);
            self.state.phase = self.state.phase.advanced(Phase::from_units(turned));
            at = at.plus_nanos(periods * PERIOD_NANOS);
            self.forget_motion();
        }
        while to.nanos_since(at) >= PERIOD_NANOS {
            self.wait(command);
            at = at.plus_nanos(PERIOD_NANOS);
        }
        self.at = Some(at);
    }

    /// Motion and parameters are no longer believed: those of the `start`, in the drive's phase now.
    pub(super) fn begin_anew(&mut self, start: &Self) {
        let (at, phase, forcing) = (self.at, self.state.phase, self.state.forcing);
        let drive_m_s2 = self.drive_m_s2;
        self.clone_from(start);
        (self.at, self.state.phase, self.state.forcing) = (at, phase, forcing);
        self.drive_m_s2 = drive_m_s2;
        self.forget_motion();
    }

    /// Goes back to `to`, if the time reached is later: the drive's phase with it, modes and height as they are.
    pub(super) fn rewind(&mut self, to: Time) {
        let Some(at) = self.at.filter(|at| *at > to) else { return };
        let periods = at.nanos_since(to).div_ceil(PERIOD_NANOS);
        let turned = self.state.forcing.increment().units().wrapping_mul(periods);
        self.state.phase = self.state.phase.advanced(Phase::from_units(turned.wrapping_neg()));
        self.at = Some(Time::from_nanos(at.nanos().saturating_sub(periods * PERIOD_NANOS)));
    }

    /// What struck the rotor is unknown: modes and height can be anything that they can be, the parameters remain.
    pub(super) fn forget_motion(&mut self) {
        self.carry();
        let square = |x: f64| T::from_f64(x * x);
        // As far as a driven motor goes: 30 um and 1 m/s, and a flight of 1 ms.
        let spread = [
            (MODES, 3e-5),
            (MODES + 1, 0.4),
            (MODES + 2, 2e-5),
            (MODES + 3, 0.8),
            (MODES + 4, 3e-6),
            (MODES + 5, 0.2),
        ];
        for (state, deviation) in spread {
            self.covariance.add_rank_one(&unit(state), square(deviation));
        }
        self.covariance.add_rank_one(&unit(HEIGHT), square(5e-5));
    }

    /// The rotor lies on the teeth and nothing moves: motion and height are known, whatever was thought of them; the parameters remain.
    pub(super) fn settle(&mut self) {
        self.carry();
        self.state.modes = ModalState::default();
        self.height_m = T::zero();
        let still = T::from_f64(1e-8);
        for state in (HEIGHT..INSTANT).rev() {
            self.covariance.renew(state, still * still);
        }
    }

    /// A period passes.
    fn wait(&mut self, command: DriveCommand) {
        let (half, h) = (T::from_f64(0.5), T::from_f64(PERIOD_S));
        let (before, drive_before) = (self.state.modes, self.drive_m_s2);
        self.model.step(&mut self.state, command);
        self.drive_m_s2 = self.drive(command);
        let g = (before.displacement_m + self.state.modes.displacement_m) * half;
        let v = (before.velocity_m_s + self.state.modes.velocity_m_s) * half;
        let drive = (drive_before + self.drive_m_s2) * half;
        let mut push = Vector3::zeros();
        let modes = self.oscillators.iter().zip(&self.step).zip(g.iter().zip(v.iter()).zip(drive.iter()));
        let kept = self.slopes.iter_mut().zip(&mut self.flow).zip(MODAL_PLACES).zip(push.iter_mut());
        for (((oscillator, step), ((&g, &v), &drive)), (((slopes, flow), (first, count)), push)) in
            modes.zip(kept)
        {
            let response = [-oscillator.stiffness_per_s2 * g, drive - oscillator.damping_per_s * v, drive];
            let found = self.found.iter().skip(first).take(count);
            for ((slope, response), &found) in slopes.iter_mut().zip(response).zip(found) {
                *slope = step * *slope + Vector2::new(half * h * h * response, h * response);
                *push += found * response;
            }
            *flow = step * *flow;
        }
        self.state.modes.displacement_m += push * (half * h * h);
        self.state.modes.velocity_m_s += push * h;
        self.waited_s += h;
    }

    fn drive(&self, command: DriveCommand) -> Vector3<T> {
        let (sin, _) = self.state.phase.sin_cos::<T>();
        let [_, b, c] = &self.oscillators;
        let (amplitude, zero) = (T::from_f32(command.amplitude()) * sin, T::zero());
        match command.mode() {
            Some(DriveMode::B) => Vector3::new(zero, b.drive_m_s2 * amplitude, zero),
            Some(DriveMode::C) => Vector3::new(zero, zero, c.drive_m_s2 * amplitude),
            None => Vector3::zeros(),
        }
    }

    /// Carries the covariance to the present.
    pub(super) fn carry(&mut self) {
        let [a, b, c] = self.flow;
        self.covariance.carry_first::<8, 4>(&Blocks2([Matrix2::identity(), a, b, c]));
        for (m, (slopes, (first, count))) in self.slopes.iter().zip(MODAL_PLACES).enumerate() {
            for (state, slope) in (first..first + count).zip(slopes) {
                let mut effect = Errors::zeros();
                for (entry, &s) in effect.iter_mut().skip(MODES + 2 * m).zip(slope.iter()) {
                    *entry = s;
                }
                self.covariance.add_effect(state, &effect);
            }
        }
        let [a, b, c] = self.fed_m2_s3.map(|fed| fed * self.waited_s);
        let noise = |state: usize, variance: T| NoiseSource { gain: unit(state), variance };
        let sources = [
            noise(MODES + 1, a),
            noise(MODES + 3, b),
            noise(MODES + 5, c),
            noise(HEIGHT, self.height_m2_s * self.waited_s),
        ];
        self.covariance.predict(&UpperTriangular(nalgebra::SMatrix::identity()), &sources);
        self.flow = [Matrix2::identity(); 3];
        self.slopes = [[Vector2::zeros(); 3]; 3];
        self.waited_s = T::zero();
    }

    /// Corrects everything by `errors`.
    pub(super) fn correct(&mut self, errors: &Errors<T>) {
        let [[_, height, g_a, v_a, g_b, v_b, g_c, v_c, _, jump, ..]] = errors.data.0;
        self.state.modes.displacement_m += Vector3::new(g_a, g_b, g_c);
        self.state.modes.velocity_m_s += Vector3::new(v_a, v_b, v_c);
        self.height_m += height;
        self.jump_m_s += jump;
        for (found, &error) in self.found.iter_mut().zip(errors.iter()).skip(MODAL) {
            *found += error;
        }
    }

    /// Whether it is still a stator: finite, and within a hundred times what any drive does.
    pub(super) fn is_sound(&self) -> bool {
        let bounded = |limit: f64| move |x: &T| x.abs() < T::from_f64(limit);
        self.state.modes.displacement_m.iter().all(bounded(1e-3))
            && self.state.modes.velocity_m_s.iter().all(bounded(50.0))
            && bounded(1.0)(&self.height_m)
            && self.found.iter().all(bounded(0.9))
            && self.covariance.variances().iter().all(bounded(1e6))
    }

    /// Takes in the last impact's jump as it is now better known.
    pub(super) fn refine(&mut self, jump_m_s: T, variance_m2_s2: T) -> Errors<T> {
        self.carry();
        let mut errors = Errors::zeros();
        let innovation = jump_m_s - self.jump_m_s;
        let _ = self.covariance.update_state::<JUMP>(variance_m2_s2, innovation, &mut errors);
        self.correct(&errors);
        errors
    }
}

/// Variances of a stator at rest whose parameters are known to their tolerance.
fn at_rest<T: Real>(tuning: &TwinTuning<T>) -> Errors<T> {
    let still = T::from_f64(1e-8);
    let [k_a, k_b, k_c] = tuning.tolerance.stiffness;
    let [c_a, c_b, c_c] = tuning.tolerance.damping;
    let [f_b, f_c] = tuning.tolerance.amplitude;
    let (recoil, restitution) = (tuning.tolerance.recoil, tuning.tolerance.restitution);
    let parameters = [k_a, c_a, k_b, c_b, f_b, k_c, c_c, f_c, recoil, restitution];
    let mut deviations = Errors::repeat(still);
    for (entry, p) in deviations.iter_mut().skip(MODAL).zip(parameters) {
        *entry = p;
    }
    deviations.component_mul(&deviations)
}

/// The unit vector of a state.
pub(super) fn unit<T: Real>(state: usize) -> Errors<T> {
    let mut unit = Errors::zeros();
    if let Some(entry) = unit.get_mut(state) {
        *entry = T::one();
    }
    unit
}
