//! Energy ledger: every flow of energy of a run, recorded beside it; tests check that the balance closes.
//!
//! ```text
//! stored = sum 1/2 M_n (g_n'^2 + w_n^2 g_n^2) + 1/2 m_r v_z^2 + m_r g z + 1/2 J rate^2
//! M_A = m_s,   M_B = M_C = m_s / 2   in the paper
//!
//! d(stored) = supplied + reaction left out + lift
//!           - modal damping - squeeze film - drag - normal loss - friction loss - sustained contact loss
//! ```
//!
//! Each term comes from its own law, none from the balance:
//!
//! ```text
//! supplied        integral M_n a_n(t) g_n' dt          modal damping  integral M_n 2 zeta_n w_n g_n'^2 dt
//! squeeze film    integral b_z v_z^2 dt                drag           integral b_th R_t^2 rate^2 dt
//! normal loss     1/2 (1 - e^2) (u' - v_z)^2 / (1/m_r + sum phi_n^2 / M_n)    a collision of two free bodies
//! friction loss   I_t (slip before + slip after) / 2   reaction left out  I_t s'
//! lift            m_r g (-gap)
//! sustained contact loss   -m_r a_p (gap after - gap before)   of a contact with the constant acceleration a_p
//! ```
//!
//! The *reaction left out*: in the PMM the tangential impulse `I_t` acts on the rotor but not on the teeth. This term
//! is the work that the teeth would have to do. The *lift* is what the rule of the end of the step adds when it puts
//! the rotor back on a tooth. The *sustained contact loss* is the work of a constant force on a gap that is not quite
//! constant. Lift and sustained contact loss vanish with the step.
//!
//! The integrals over the modes are five-point Gauss-Legendre sums over the exact motion, in pieces of at most 0.75
//! rad of the fastest mode or drive: their error is below 1e-10 of the term, in steps up to 1 ms. The integrals of
//! squeeze film and drag, which can stop the rotor within a step, are closed forms.

mod quadrature;
mod steady_drive;

pub(crate) use quadrature::GAUSS_LEGENDRE;
use quadrature::{Piece, pieces};
use steady_drive::SteadyDrive;

use crate::error::OutOfBounds;
use crate::friction::SustainedFriction;
use crate::impact::Impact;
use crate::math::{self, Real};
use crate::modes::{DriveTuning, Mode};
use crate::motor::{MotorSetup, MotorState};
use crate::params::{MotorParams, Parameter};
use crate::rotor::tangential_damping_per_s;
use crate::teeth::ToothPair;

/// Receives what happens in a step, in order. [`EnergyLedger`] records energies; other implementations can record
/// impacts.
pub trait Ledger<T: Real> {
    /// The fraction `part` of a step passes from `state` on, with the drive in force and without an impact, while the
    /// pairs of teeth push the rotor up with the constant accelerations `push_m_s2`.
    fn motion(&mut self, state: &MotorState<T>, part: T, push_m_s2: [T; 2]);
    /// An impact took `before` to `after`.
    fn impact(&mut self, before: &MotorState<T>, after: &MotorState<T>, impact: &Impact<T>);
    /// The rotor was raised by `height_m`.
    fn lift(&mut self, height_m: T);
    /// Teeth in sustained contact pushed the rotor with `push_m_s2` and acted on it by `friction`, while the gaps
    /// went from `before_m` to `after_m`.
    fn sustained_contact(
        &mut self,
        before_m: [T; 2],
        after_m: [T; 2],
        push_m_s2: [T; 2],
        friction: &[SustainedFriction<T>; 2],
    );
}

/// Records nothing, at no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoLedger;

impl<T: Real> Ledger<T> for NoLedger {
    #[inline]
    fn motion(&mut self, _: &MotorState<T>, _: T, _: [T; 2]) {}
    #[inline]
    fn impact(&mut self, _: &MotorState<T>, _: &MotorState<T>, _: &Impact<T>) {}
    #[inline]
    fn lift(&mut self, _: T) {}
    #[inline]
    fn sustained_contact(&mut self, _: [T; 2], _: [T; 2], _: [T; 2], _: &[SustainedFriction<T>; 2]) {}
}

/// Energies in J since the ledger was made, each positive as its name says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyFlows {
    /// Work of the coil's field on the modes.
    pub supplied_j: f64,
    /// Work of the teeth on the rotor that the PMM does not take from the teeth.
    pub reaction_left_out_j: f64,
    /// Potential energy created by lifting a rotor found inside a tooth.
    pub lift_j: f64,
    /// Lost to the damping of modes A, B and C.
    pub modal_damping_j: f64,
    /// Lost to the squeeze film under the rotor.
    pub squeeze_film_j: f64,
    /// Lost to the drag on the rotation.
    pub drag_j: f64,
    /// Lost to restitution at impacts.
    pub normal_loss_j: f64,
    /// Lost to slip, at impacts and in sustained contact.
    pub friction_loss_j: f64,
    /// Lost to sustained contacts whose gap was not quite constant.
    pub sustained_contact_loss_j: f64,
}

impl EnergyFlows {
    /// The change of the stored energy that the flows add up to.
    pub fn net_j(&self) -> f64 {
        self.supplied_j + self.reaction_left_out_j + self.lift_j
            - (self.modal_damping_j
                + self.squeeze_film_j
                + self.drag_j
                + self.normal_loss_j
                + self.friction_loss_j
                + self.sustained_contact_loss_j)
    }

    /// Sum of the magnitudes: the scale of an imbalance.
    pub fn turnover_j(&self) -> f64 {
        [
            self.supplied_j,
            self.reaction_left_out_j,
            self.lift_j,
            self.modal_damping_j,
            self.squeeze_film_j,
            self.drag_j,
            self.normal_loss_j,
            self.friction_loss_j,
            self.sustained_contact_loss_j,
        ]
        .iter()
        .map(|flow| flow.abs())
        .sum()
    }
}

/// The energy ledger of one motor, in `f64` for a motor of either precision.
///
/// ```
/// use motor_model::{DriveCommand, DriveMode, EnergyLedger, Motor, MotorParams, MotorSetup, MotorState};
///
/// let (params, setup) = (MotorParams::nominal(), MotorSetup::with_step(1e-6));
/// let motor = Motor::<f64>::try_new(&params, &setup)?;
/// let mut ledger = EnergyLedger::try_new(&params, &setup)?;
/// let mut state = MotorState::default();
/// for _ in 0..20_000 {
///     motor.step_with(&mut state, DriveCommand::full(DriveMode::B), &mut ledger);
/// }
/// let flows = ledger.flows();
/// assert!((ledger.stored_j(&state) - flows.net_j()).abs() < 1e-9 * flows.turnover_j());
/// # Ok::<(), motor_model::OutOfBounds>(())
/// ```
#[derive(Clone, Debug)]
pub struct EnergyLedger {
    params: MotorParams,
    modes: [Mode; 3],
    teeth: [ToothPair<f64>; 2],
    tuning: DriveTuning,
    step_s: f64,
    /// Pieces into which the quadrature cuts a step.
    pieces: u8,
    /// One of a whole step.
    piece: Piece,
    flows: EnergyFlows,
}

impl EnergyLedger {
    /// A ledger for the motor of these parameters and this set-up.
    ///
    /// # Errors
    /// When mode A is damped beyond 0.99 of critical.
    pub fn try_new(params: &MotorParams, setup: &MotorSetup) -> Result<Self, OutOfBounds> {
        let modes = Mode::all(params)?;
        let pieces = pieces(&modes, setup);
        Ok(Self {
            params: *params,
            modes,
            teeth: ToothPair::both(params, &setup.variation),
            tuning: setup.tuning,
            step_s: setup.step_s,
            pieces,
            piece: Piece::new(&modes, setup.step_s / f64::from(pieces)),
            flows: EnergyFlows::default(),
        })
    }

    /// The flows so far.
    pub fn flows(&self) -> EnergyFlows {
        self.flows
    }

    /// Energy stored in modes and rotor, from zero at rest at height zero.
    pub fn stored_j<T: Real>(&self, state: &MotorState<T>) -> f64 {
        let modal: f64 = (self.modes.iter())
            .zip(&state.modes.displacement_m)
            .zip(&state.modes.velocity_m_s)
            .map(|((mode, g), v)| {
                let (wg, v) = (mode.natural_rad_s * g.to_f64(), v.to_f64());
                0.5 * mode.mass_kg * (v * v + wg * wg)
            })
            .sum();
        let rotor = &state.rotor;
        let (z, v, rate) = (rotor.height_m.to_f64(), rotor.velocity_m_s.to_f64(), rotor.rate_rad_s.to_f64());
        let mass = self.params.get(Parameter::RotorMass);
        modal
            + mass * (0.5 * v * v + self.params.get(Parameter::Gravity) * z)
            + 0.5 * self.params.get(Parameter::RotorInertia) * rate * rate
    }

    /// Damping loss of each mode and work of the drive over the fraction `part` of a step.
    fn modal_flows<T: Real>(&mut self, state: &MotorState<T>, part: f64, push_m_s2: [f64; 2]) {
        let g = state.modes.displacement_m.map(Real::to_f64);
        let v = state.modes.velocity_m_s.map(Real::to_f64);
        let drive = SteadyDrive::of(&self.modes, self.tuning, state, self.step_s, part);
        let piece_s = part * self.step_s / f64::from(self.pieces);
        let piece = if part < 1.0 { &Piece::new(&self.modes, piece_s) } else { &self.piece };
        let ([first, second], [push_0, push_1]) = (&self.teeth, push_m_s2);
        let recoil = first.recoil * push_0 + second.recoil * push_1;
        let states = g.iter().zip(&v).zip(&recoil);
        for (index, (mode, ((g, v), recoil))) in self.modes.iter().zip(states).enumerate() {
            let driven = drive.as_ref().filter(|drive| drive.mode_index == index);
            // Free motion is about the equilibrium that constant pushes displace; the steady motion under the drive
            // is subtracted.
            let equilibrium = -recoil / (mode.natural_rad_s * mode.natural_rad_s);
            let (g_steady, v_steady) = driven.map_or((0.0, 0.0), |drive| drive.motion(0.0));
            let mut free = (g - equilibrium - g_steady, v - v_steady);
            let damping = 2.0 * mode.damping_ratio * mode.natural_rad_s * mode.mass_kg;
            for done in 0..self.pieces {
                for (rows, (node, weight)) in piece.velocity_rows.iter().zip(GAUSS_LEGENDRE) {
                    let (dt, at) = (weight * piece_s, (f64::from(done) + node) / f64::from(self.pieces));
                    let Some([vg, vv]) = rows.get(index) else { continue };
                    let mut velocity = vg * free.0 + vv * free.1;
                    if let Some(drive) = driven {
                        velocity += drive.motion(at).1;
                        self.flows.supplied_j += mode.mass_kg * drive.acceleration(at) * velocity * dt;
                    }
                    self.flows.modal_damping_j += damping * velocity * velocity * dt;
                }
                let Some([[gg, gv], [vg, vv]]) = piece.whole.get(index) else { continue };
                free = (gg * free.0 + gv * free.1, vg * free.0 + vv * free.1);
            }
        }
    }

    /// Losses of the rotor over the fraction `part` of a step, pushed up with the constant acceleration `push_m_s2`.
    fn rotor_flows<T: Real>(&mut self, state: &MotorState<T>, part: f64, push_m_s2: f64) {
        let v = state.rotor.velocity_m_s.to_f64();
        let rate = state.rotor.rate_rad_s.to_f64();
        let damping = self.params.get(Parameter::VerticalDamping);
        let k = damping / self.params.get(Parameter::RotorMass);
        let downward = self.params.get(Parameter::Gravity) - push_m_s2;
        let span_s = part * self.step_s;
        // The square of v(t) = v exp(-k t) - downward t m1(k t), integrated term by term.
        let x = k * span_s;
        let fall = span_s * math::decay_mean(x);
        let square = v * v * span_s * math::decay_mean(2.0 * x) - v * downward * fall * fall
            + downward * downward * span_s * span_s * span_s * math::decay_square_mean(x);
        self.flows.squeeze_film_j += damping * square;
        // b_th R_t^2 times the integral of rate^2, which decays at twice the rate's own.
        let k = tangential_damping_per_s(&self.params);
        let inertia = self.params.get(Parameter::RotorInertia);
        self.flows.drag_j += inertia * k * rate * rate * span_s * math::decay_mean(2.0 * k * span_s);
    }
}

impl<T: Real> Ledger<T> for EnergyLedger {
    fn motion(&mut self, state: &MotorState<T>, part: T, push_m_s2: [T; 2]) {
        let (part, [push_0, push_1]) = (part.to_f64(), push_m_s2.map(Real::to_f64));
        self.modal_flows(state, part, [push_0, push_1]);
        self.rotor_flows(state, part, push_0 + push_1);
    }

    fn sustained_contact(
        &mut self,
        before_m: [T; 2],
        after_m: [T; 2],
        push_m_s2: [T; 2],
        friction: &[SustainedFriction<T>; 2],
    ) {
        for ((before, after), push) in before_m.into_iter().zip(after_m).zip(push_m_s2) {
            let opened_m = after.to_f64() - before.to_f64();
            self.flows.sustained_contact_loss_j -=
                self.params.get(Parameter::RotorMass) * push.to_f64() * opened_m;
        }
        let radius = self.params.get(Parameter::ToothRadius);
        let tangential_mass = self.params.get(Parameter::RotorInertia) / (radius * radius);
        for friction in friction {
            self.flows.reaction_left_out_j += tangential_mass * friction.work_m2_s2.to_f64();
            self.flows.friction_loss_j += tangential_mass * friction.heat_m2_s2.to_f64();
        }
    }

    fn impact(&mut self, before: &MotorState<T>, after: &MotorState<T>, impact: &Impact<T>) {
        let [first, second] = &self.teeth;
        let tooth = if impact.pair == 0 { first } else { second };
        let approach = impact.approach_m_s.to_f64();
        let restitution = self.params.get(Parameter::Restitution);
        // 1/m_r + sum phi_n^2 / M_n: velocity of approach per normal impulse.
        let compliance = 1.0 / self.params.get(Parameter::RotorMass)
            + (self.modes.iter().zip(&tooth.shape)).map(|(mode, phi)| phi * phi / mode.mass_kg).sum::<f64>();
        self.flows.normal_loss_j +=
            0.5 * (1.0 - restitution * restitution) * approach * approach / compliance;

        let impulse = impact.tangential_impulse_n_s.to_f64();
        let radius = self.params.get(Parameter::ToothRadius);
        let turned = radius * (after.rotor.rate_rad_s.to_f64() - before.rotor.rate_rad_s.to_f64());
        // After the recoil: friction comes after the normal impulse.
        let risen = after.rotor.velocity_m_s.to_f64() - before.rotor.velocity_m_s.to_f64();
        let tooth_speed = tooth.lever.dot(&before.modes.velocity_m_s.map(Real::to_f64)) - tooth.sway * risen;
        let slip = tooth_speed - radius * before.rotor.rate_rad_s.to_f64();
        self.flows.friction_loss_j += impulse * (slip - 0.5 * turned);
        self.flows.reaction_left_out_j += impulse * tooth_speed;
    }

    fn lift(&mut self, height_m: T) {
        self.flows.lift_j +=
            self.params.get(Parameter::RotorMass) * self.params.get(Parameter::Gravity) * height_m.to_f64();
    }
}
