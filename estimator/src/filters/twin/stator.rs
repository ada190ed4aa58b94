//! The stator under measured impulses: its modes, the rotor's height over it, and the parameters that move both.
//!
//! The states are errors: of `(g, g')` in each mode and of the height z; of the last impact's instant, jump and tangential velocity; of 13 parameters and the drive's phase, which
//! the plant keeps for ever and the filter therefore learns. A mode whose stiffness, damping and drive are off by the parts `k`, `c`, `f` moves as
//!
//! ```text
//! dg'' + 2 zeta w dg' + w^2 dg  =  -w^2 g k + (a - 2 zeta w g') c + a f          a: acceleration by the drive
//! ```
//!
//! since the drive's force is `2 zeta w^2 A`: damping and amplitude are what is measured (Table 1).
//!
//! The drive's phase is the coil's at the rotor: a command that is told a tick late is 0.4 rad, a fifth of a tooth's swing. Found, it turns the model's own drive, however far.
//!
//! The height is the sum of the vibrometer's samples: its variance grows by `sigma^2 h^2` a sample, 28 nm in 4 ms.

use motor_model::{
    DriveTuning, ModalState, Mode, MotorParams, OutOfBounds, Parameter, Phase, Real, Stator, StatorState,
    Time, ToothPair,
};
use nalgebra::{Matrix2, SVector, Vector3};

use super::oscillator::Oscillator;
use super::passage::{Felt, Passed, STRIDE};
use super::tuning::TwinTuning;
use crate::factorised::transition::Blocks2;
use crate::factorised::ud_covariance::{NoiseSource, UdCovariance};

/// Errors of the stator, of the last impact, and of the parameters.
pub(super) const STATES: usize = 24;
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
/// Part by which the amplitude of the first pair of teeth is off; that of the second follows.
pub(super) const SCALES: usize = 20;
/// By how much the teeth's angle is off, in rad.
pub(super) const ANGLE: usize = 22;
/// By how much the drive is ahead of where it is believed to be in its cycle, in rad.
pub(super) const AHEAD: usize = 23;

/// Where each mode's parameters begin, and how many there are.
const MODAL_PLACES: [(usize, usize); 3] = [(MODAL, 2), (MODAL + 2, 3), (MODAL + 5, 3)];

pub(super) type Errors<T> = SVector<T, STATES>;

/// Period at which the stator is stepped, that of the vibrometer.
pub(super) const PERIOD_NANOS: u64 = 5_000;
pub(super) const PERIOD_S: f64 = 5e-6;

/// The stator as the filter believes it to be.
#[derive(Clone, Debug)]
pub(super) struct StatorBelief<T: Real> {
    pub(super) model: Stator<T>,
    pub(super) state: StatorState<T>,
    pub(super) at: Option<Time>,
    /// Whether nothing has happened since [`Self::settle`].
    pub(super) settled: bool,
    pub(super) oscillators: [Oscillator<T>; 3],
    /// Sine and cosine of the drive's phase.
    pub(super) phasor: [T; 2],
    pub(super) step: [Matrix2<T>; 3],
    /// The same over [`STRIDE`] periods.
    pub(super) strides: [Matrix2<T>; 3],
    pub(super) height_m: T,
    /// Errors of the parameters so far found, as parts; the other entries are not used.
    pub(super) found: Errors<T>,
    /// What each mode has felt since the covariance was last carried.
    pub(super) felt: [Felt<T>; 3],
    pub(super) waited_s: T,
    /// Periods since the last stride, and what has passed in them.
    pub(super) periods: u8,
    pub(super) passed: Passed<T>,
    pub(super) covariance: UdCovariance<T, STATES>,
    /// Variances at the start.
    at_start: Errors<T>,
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
            settled: false,
            oscillators: modes.each_ref().map(Oscillator::new),
            phasor: [T::zero(), T::one()],
            step: modes.map(|mode| propagator(&mode, PERIOD_S)),
            strides: modes.map(|mode| propagator(&mode, PERIOD_S * f64::from(STRIDE))),
            height_m: T::zero(),
            found: Errors::zeros(),
            felt: [Felt::nothing(); 3],
            waited_s: T::zero(),
            periods: 0,
            passed: Passed::default(),
            covariance: UdCovariance::from_diagonal(&at_rest(tuning)),
            at_start: at_rest(tuning),
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

    /// Motion and parameters are no longer believed: those of the start, in the drive's phase now.
    #[inline(never)]
    pub(super) fn begin_anew(&mut self) {
        (self.state.modes, self.height_m, self.jump_m_s) = (ModalState::default(), T::zero(), T::zero());
        self.found = Errors::zeros();
        self.covariance = UdCovariance::from_diagonal(&self.at_start);
        (self.periods, self.passed) = (0, Passed::default());
        self.begin_carrying();
        self.forget_motion();
    }

    /// Goes back to `to`, if the time reached is later: the drive's phase with it, modes and height as they are.
    pub(super) fn rewind(&mut self, to: Time) {
        let Some(at) = self.at.filter(|at| *at > to) else { return };
        let periods = at.nanos_since(to).div_ceil(PERIOD_NANOS);
        let turned = self.state.forcing.increment().units().wrapping_mul(periods);
        self.turn(Phase::from_units(turned.wrapping_neg()));
        self.at = Some(Time::from_nanos(at.nanos().saturating_sub(periods * PERIOD_NANOS)));
    }

    /// What struck the rotor is unknown: modes and height can be anything that they can be, the parameters remain.
    #[inline(never)]
    pub(super) fn forget_motion(&mut self) {
        self.carry();
        self.settled = false;
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
        if self.settled {
            return;
        }
        self.carry();
        self.settled = true;
        self.state.modes = ModalState::default();
        self.height_m = T::zero();
        let still = T::from_f64(1e-8);
        for state in (HEIGHT..INSTANT).rev() {
            self.covariance.replace_state(state, still * still);
        }
    }

    /// Something happens to a stator that lay still.
    pub(super) fn unsettle(&mut self) {
        self.settled = false;
    }

    /// Carries the covariance to the present.
    #[inline(never)]
    pub(super) fn carry(&mut self) {
        if self.periods > 0 {
            self.stride();
        }
        if self.waited_s <= T::zero() {
            return;
        }
        let [a, b, c] = self.felt.map(|felt| felt.flow);
        self.covariance.carry_first::<8, 4>(&Blocks2([Matrix2::identity(), a, b, c]));
        for (m, (felt, (first, count))) in self.felt.iter().zip(MODAL_PLACES).enumerate() {
            let slopes = [felt.stiffness, felt.damping, felt.amplitude];
            for (state, slope) in (first..first + count).zip(slopes).chain([(AHEAD, felt.turn)]) {
                self.covariance.add_effect(state, MODES + 2 * m, &[slope.x, slope.y]);
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
        self.covariance.add_noise(&sources);
        self.begin_carrying();
    }

    /// The covariance is that of the present.
    fn begin_carrying(&mut self) {
        self.felt = [Felt::nothing(); 3];
        self.waited_s = T::zero();
    }

    /// Corrects everything by `errors`.
    pub(super) fn correct(&mut self, errors: &Errors<T>) {
        let [[_, height, g_a, v_a, g_b, v_b, g_c, v_c, _, jump, ..]] = errors.data.0;
        self.state.modes.displacement_m += Vector3::new(g_a, g_b, g_c);
        self.state.modes.velocity_m_s += Vector3::new(v_a, v_b, v_c);
        self.height_m += height;
        self.jump_m_s += jump;
        let found = self.found.as_mut_slice().get_mut(MODAL..AHEAD).unwrap_or_default();
        for (found, &error) in found.iter_mut().zip(errors.as_slice().get(MODAL..).unwrap_or_default()) {
            *found += error;
        }
        self.turn(phase_of(errors.as_slice().get(AHEAD).copied().unwrap_or_default()));
    }

    /// Whether it is still a stator: finite, and within a hundred times what any drive does.
    ///
    /// Amplitudes are bounded, not momentary values, so that what is sound stays so until the next impact; and parameters, so that the modes as they are stepped
    /// cannot feed themselves: a stiffness off by `k` adds `(k w h)^2 / 4` a period to the amplitude, which the damping must outweigh.
    pub(super) fn is_sound(&self) -> bool {
        let bounded = |limit: f64| move |x: &T| x.abs() < T::from_f64(limit);
        let modes = &self.state.modes;
        let motions = modes.displacement_m.iter().zip(modes.velocity_m_s.iter());
        let swings = self.oscillators.iter().zip(motions).map(|(oscillator, (&g, &v))| {
            oscillator.stiffness_per_s2 * g * g + v * v - oscillator.stiffness_per_s2 * T::from_f64(1e-6)
        });
        let [_, _, _, _, _, _, _, _, _, _, k_a, _, k_b, _, _, k_c, ..] = self.found.data.0[0];
        // Asked this way round, so that NaN is unsound.
        swings.into_iter().all(|beyond| beyond < T::zero())
            && bounded(1.0)(&self.height_m)
            && self.found.iter().all(bounded(0.9))
            && [k_a, k_b, k_c].iter().all(bounded(0.25))
            && bounded(1e6)(&self.covariance.trace())
    }

    /// Takes in the last impact's jump as it is now better known.
    #[inline(never)]
    pub(super) fn refine(&mut self, jump_m_s: T, variance_m2_s2: T) -> Errors<T> {
        self.carry();
        let mut errors = Errors::zeros();
        let innovation = jump_m_s - self.jump_m_s;
        let _ = self.covariance.update_state::<JUMP>(variance_m2_s2, innovation, &mut errors);
        self.correct(&errors);
        errors
    }
}

fn propagator<T: Real>(mode: &Mode, time_s: f64) -> Matrix2<T> {
    let [[gg, gv], [vg, vv]] = mode.propagator(time_s);
    Matrix2::new(gg, gv, vg, vv).map(T::from_f64)
}

/// An angle in rad as a phase, to 2^-30 of a turn; kept within half a turn of zero.
fn phase_of<T: Real>(ahead_rad: T) -> Phase {
    let turns = (ahead_rad * T::from_f64(1.0 / core::f64::consts::TAU)).clamp_magnitude(T::from_f64(0.5));
    let units = i64::from((turns * T::from_f64(1_073_741_824.0)).whole()) << 34;
    Phase::from_units(units.cast_unsigned())
}

/// Variances of a stator at rest whose parameters are known to their tolerance.
fn at_rest<T: Real>(tuning: &TwinTuning<T>) -> Errors<T> {
    let still = T::from_f64(1e-8);
    let [k_a, k_b, k_c] = tuning.tolerance.stiffness;
    let [c_a, c_b, c_c] = tuning.tolerance.damping;
    let [f_b, f_c] = tuning.tolerance.amplitude;
    let (recoil, restitution) = (tuning.tolerance.recoil, tuning.tolerance.restitution);
    let (pair, angle) = (tuning.tolerance.pair, tuning.tolerance.tooth_angle_rad);
    let parameters = [
        k_a,
        c_a,
        k_b,
        c_b,
        f_b,
        k_c,
        c_c,
        f_c,
        recoil,
        restitution,
        pair,
        pair,
        angle,
        tuning.tolerance.phase_rad,
    ];
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
