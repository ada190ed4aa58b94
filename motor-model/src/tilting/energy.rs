//! Energy of the tilting motor: every flow, each from its own law; tests check that the balance closes.
//!
//! ```text
//! stored = sum 1/2 M_n (g_n'^2 + w_n^2 g_n^2) + 1/2 m_r (v_z^2 + x'^2 + y'^2) + m_r g z + 1/2 I |eta'|^2 + 1/2 J W^2
//! n = A, B, C, T1, T2
//!
//! d(stored) = supplied + reaction left out + lift - modal damping - squeeze film - drag - normal loss - friction loss
//!
//! normal loss     -sum P (w- + w+) / 2        friction loss    -sum T (q- + q+) / 2
//! reaction left out   sum T (speed of the tooth)     squeeze film    integral of b_z v_z^2 + b_t |eta'|^2
//! ```
//!
//! The *lift* is the energy of the moves by which positions follow a contact that acts throughout a span, or by which a
//! rotor is put back on a tooth. It vanishes with the step.

use super::rigid_body::{tilt_damping_n_m_s, transverse_inertia_kg_m2};
use super::stator_tilt::stator_tilt_modes;
use super::{TiltingContact, TiltingSetup, TiltingState};
use crate::energy::{EnergyLedger, Ledger};
use crate::error::OutOfBounds;
use crate::math::{self, Real};
use crate::modes::Mode;
use crate::motor::{MotorSetup, MotorState};
use crate::params::{MotorParams, Parameter, TiltingParams};

/// Receives what happens in a step, in order. [`TiltingEnergyLedger`] records energies.
pub trait TiltingLedger<T: Real> {
    /// Whether it wants the records of contacts.
    const RECORDS: bool;
    /// The fraction `part` of a step passes from `state` on, with the drive in force and without contact.
    fn motion(&mut self, state: &TiltingState<T>, part: T);
    /// A contact acted: its gap's rate became `opening_m_s` and then, by friction, its slip `slip_after_m_s`, while the
    /// surface moved with `surface_m_s` along the tangential directions.
    fn contact(
        &mut self,
        contact: &TiltingContact<T>,
        opening_m_s: T,
        slip_after_m_s: [T; 2],
        surface_m_s: [T; 2],
    );
    /// Positions moved from those of `before` to those of `after`, at once; velocities do not count.
    fn moved(&mut self, before: &TiltingState<T>, after: &TiltingState<T>);
}

/// Records nothing, at no cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoTiltingLedger;

impl<T: Real> TiltingLedger<T> for NoTiltingLedger {
    const RECORDS: bool = false;
    #[inline]
    fn motion(&mut self, _: &TiltingState<T>, _: T) {}
    #[inline]
    fn contact(&mut self, _: &TiltingContact<T>, _: T, _: [T; 2], _: [T; 2]) {}
    #[inline]
    fn moved(&mut self, _: &TiltingState<T>, _: &TiltingState<T>) {}
}

/// Energies in J since the ledger was made, each positive as its name says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TiltingEnergyFlows {
    /// Work of the coil's field on the modes.
    pub supplied_j: f64,
    /// Work of the teeth on the rotor by friction, which is not taken from the teeth.
    pub reaction_left_out_j: f64,
    /// Energy of moves of position.
    pub lift_j: f64,
    /// Lost to the damping of modes A, B, C and of the tilting modes.
    pub modal_damping_j: f64,
    /// Lost to the squeeze film, by height and by tilt.
    pub squeeze_film_j: f64,
    /// Lost to the drag on the rotation.
    pub drag_j: f64,
    /// Lost along the normals of contacts at the teeth.
    pub normal_loss_j: f64,
    /// Lost to slip at the teeth.
    pub friction_loss_j: f64,
    /// Lost along the normals of contacts at pin, floor and ceiling.
    pub hub_normal_loss_j: f64,
    /// Lost to slip at pin, floor and ceiling.
    pub hub_friction_loss_j: f64,
}

impl TiltingEnergyFlows {
    /// The change of the stored energy that the flows add up to.
    pub fn net_j(&self) -> f64 {
        self.supplied_j + self.reaction_left_out_j + self.lift_j
            - (self.modal_damping_j
                + self.squeeze_film_j
                + self.drag_j
                + self.normal_loss_j
                + self.friction_loss_j
                + self.hub_normal_loss_j
                + self.hub_friction_loss_j)
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
            self.hub_normal_loss_j,
            self.hub_friction_loss_j,
        ]
        .iter()
        .map(|flow| flow.abs())
        .sum()
    }
}

/// The energy ledger of one tilting motor, in `f64` for a motor of either precision.
///
/// ```
/// use motor_model::{
///     DriveCommand, DriveMode, MotorParams, TiltingEnergyLedger, TiltingMotor, TiltingParams, TiltingSetup,
///     TiltingState,
/// };
///
/// let (params, tilting) = (MotorParams::nominal(), TiltingParams::nominal());
/// let setup = TiltingSetup::with_step(1e-6);
/// let motor = TiltingMotor::<f64>::try_new(&params, &tilting, &setup)?;
/// let mut ledger = TiltingEnergyLedger::try_new(&params, &tilting, &setup)?;
/// let mut state = TiltingState::default();
/// for _ in 0..20_000 {
///     motor.step_with(&mut state, DriveCommand::full(DriveMode::B), &mut ledger);
/// }
/// let flows = ledger.flows();
/// assert!((ledger.stored_j(&state) - flows.net_j()).abs() < 1e-9 * flows.turnover_j());
/// # Ok::<(), motor_model::OutOfBounds>(())
/// ```
#[derive(Clone, Debug)]
pub struct TiltingEnergyLedger {
    /// Modes A, B, C, height and spin: as in the height-only motor.
    axial: EnergyLedger,
    params: MotorParams,
    modes: [Mode; 3],
    pair: [Mode; 2],
    transverse_inertia_kg_m2: f64,
    tilt_damping_n_m_s: f64,
    step_s: f64,
    flows: TiltingEnergyFlows,
}

impl TiltingEnergyLedger {
    /// A ledger for the motor of these parameters and this set-up.
    ///
    /// # Errors
    /// When mode A is damped beyond 0.99 of critical.
    pub fn try_new(
        params: &MotorParams,
        tilting: &TiltingParams,
        setup: &TiltingSetup,
    ) -> Result<Self, OutOfBounds> {
        let axial = MotorSetup { tuning: setup.tuning, ..MotorSetup::with_step(setup.step_s) };
        Ok(Self {
            axial: EnergyLedger::try_new(params, &axial)?,
            params: *params,
            modes: Mode::all(params)?,
            pair: stator_tilt_modes(params, tilting),
            transverse_inertia_kg_m2: transverse_inertia_kg_m2(params, tilting),
            tilt_damping_n_m_s: tilt_damping_n_m_s(params, tilting),
            step_s: setup.step_s,
            flows: TiltingEnergyFlows::default(),
        })
    }

    /// The flows so far.
    pub fn flows(&self) -> TiltingEnergyFlows {
        let axial = self.axial.flows();
        TiltingEnergyFlows {
            supplied_j: axial.supplied_j,
            modal_damping_j: self.flows.modal_damping_j + axial.modal_damping_j,
            squeeze_film_j: self.flows.squeeze_film_j + axial.squeeze_film_j,
            drag_j: axial.drag_j,
            ..self.flows
        }
    }

    /// Energy stored in modes and rotor, from zero at rest at height zero.
    pub fn stored_j<T: Real>(&self, state: &TiltingState<T>) -> f64 {
        let square = |x: &nalgebra::Vector2<T>| x.iter().map(|x| x.to_f64() * x.to_f64()).sum::<f64>();
        let pair = &state.stator_tilt;
        let of_pair = (self.pair.iter().zip(&pair.displacement_m).zip(&pair.velocity_m_s))
            .map(|((mode, g), v)| {
                let (wg, v) = (mode.natural_rad_s * g.to_f64(), v.to_f64());
                0.5 * mode.mass_kg * (v * v + wg * wg)
            })
            .sum::<f64>();
        self.axial.stored_j(&axial(state))
            + of_pair
            + 0.5 * self.transverse_inertia_kg_m2 * square(&state.tilt.rate_rad_s)
            + 0.5 * self.params.get(Parameter::RotorMass) * square(&state.shift.velocity_m_s)
    }
}

/// What the height-only motor has of a state.
fn axial<T: Real>(state: &TiltingState<T>) -> MotorState<T> {
    MotorState {
        steps: 0,
        phase: state.phase,
        modes: state.modes,
        rotor: state.rotor,
        forcing: state.forcing,
        in_contact: [false; 2],
    }
}

/// Nodes and weights of the Gauss-Legendre rule of order 10 on 0..1.
const GAUSS_LEGENDRE: [(f64, f64); 5] = crate::energy::GAUSS_LEGENDRE;

impl<T: Real> TiltingLedger<T> for TiltingEnergyLedger {
    const RECORDS: bool = true;

    fn motion(&mut self, state: &TiltingState<T>, part: T) {
        self.axial.motion(&axial(state), part, [T::zero(); 2]);
        let span_s = part.to_f64() * self.step_s;
        // |eta'| decays, whatever its direction does.
        let per_s = self.tilt_damping_n_m_s / self.transverse_inertia_kg_m2;
        let rate = state.tilt.rate_rad_s.map(Real::to_f64);
        self.flows.squeeze_film_j +=
            self.tilt_damping_n_m_s * rate.dot(&rate) * span_s * math::decay_mean(2.0 * per_s * span_s);
        let of_pair = (state.stator_tilt.displacement_m.iter()).zip(&state.stator_tilt.velocity_m_s);
        for (mode, (g, v)) in self.pair.iter().zip(of_pair) {
            let damping = 2.0 * mode.damping_ratio * mode.natural_rad_s * mode.mass_kg;
            for (node, weight) in GAUSS_LEGENDRE {
                let [_, [vg, vv]] = mode.propagator(span_s * node);
                let velocity = g.to_f64() * vg + v.to_f64() * vv;
                self.flows.modal_damping_j += damping * velocity * velocity * weight * span_s;
            }
        }
    }

    fn contact(
        &mut self,
        contact: &TiltingContact<T>,
        opening_m_s: T,
        slip_after_m_s: [T; 2],
        surface_m_s: [T; 2],
    ) {
        let opening = opening_m_s.to_f64() - contact.approach_m_s.to_f64();
        let normal_loss = -0.5 * contact.normal_impulse_n_s.to_f64() * opening;
        let (mut heat, mut work) = (0.0, 0.0);
        let ways = (contact.tangential_impulse_n_s.into_iter().zip(contact.slip_m_s))
            .zip(slip_after_m_s.into_iter().zip(surface_m_s));
        for ((impulse, slip), (slip_after, surface)) in ways {
            let impulse = impulse.to_f64();
            heat -= 0.5 * impulse * (slip.to_f64() + slip_after.to_f64());
            work += impulse * surface.to_f64();
        }
        self.flows.reaction_left_out_j += work;
        if contact.place.is_tooth() {
            self.flows.normal_loss_j += normal_loss;
            self.flows.friction_loss_j += heat;
        } else {
            self.flows.hub_normal_loss_j += normal_loss;
            self.flows.hub_friction_loss_j += heat;
        }
    }

    fn moved(&mut self, before: &TiltingState<T>, after: &TiltingState<T>) {
        let weight = self.params.get(Parameter::RotorMass) * self.params.get(Parameter::Gravity);
        self.flows.lift_j += weight * (after.rotor.height_m.to_f64() - before.rotor.height_m.to_f64());
        let elastic = |mode: &Mode, from: T, to: T| {
            let (from, to) = (from.to_f64(), to.to_f64());
            0.5 * mode.mass_kg * mode.natural_rad_s * mode.natural_rad_s * (to - from) * (to + from)
        };
        let modal = (self.modes.iter())
            .zip(before.modes.displacement_m.iter().zip(&after.modes.displacement_m))
            .map(|(mode, (from, to))| elastic(mode, *from, *to));
        let pair = (self.pair.iter())
            .zip(before.stator_tilt.displacement_m.iter().zip(&after.stator_tilt.displacement_m))
            .map(|(mode, (from, to))| elastic(mode, *from, *to));
        self.flows.lift_j += modal.sum::<f64>() + pair.sum::<f64>();
    }
}
