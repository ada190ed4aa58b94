//! Stator and rotor between two events: four coordinates, and none, one or both pairs of teeth in contact with the
//! rotor.
//!
//! With `q = (g_A, g_B, g_C, z)`, the gap of pair `p` is `z - phi_p . g`. While a set of pairs is in contact, their
//! gaps stay zero and each has a normal force `N_p = m_r n_p`:
//!
//! ```text
//! g_n'' = a_n(t) - 2 zeta_n w_n g_n' - w_n^2 g_n - sum_p rho_pn n_p
//! z''   = -gravity - (b_z / m_r) z'              + sum_p n_p          rho_p = recoil of pair p (7a-c)
//! 0     = z'' - phi_p . g''       hence       sum_q (1 + phi_p . rho_q) n_q = -(z'' - phi_p . g'') without contact
//! ```
//!
//! In every case this is linear with constant coefficients and a sinusoidal drive. So its power series in time follows
//! coefficient by coefficient, and so does that of each normal force. The step is limited only by the convergence of
//! the series: `h <= 1 / rate`, where `rate` is the fastest of the natural, drive and decay rates.

use core::f64::consts::TAU;

use motor_model::math;
use motor_model::params::Parameter;
use motor_model::{
    AmplitudeVariation, DriveCommand, DriveMode, ModalState, Mode, MotorParams, OutOfBounds, ToothPair,
};
use std::array;

use super::series::{ORDER, Series};

/// Which pairs of teeth are in sustained contact with the rotor.
pub type Contact = [bool; 2];

/// The constants of stator and rotor.
#[derive(Clone, Debug)]
pub struct System {
    /// Modes A, B, C.
    pub modes: [Mode; 3],
    /// The two pairs of teeth.
    pub teeth: [ToothPair<f64>; 2],
    /// `m_r`.
    pub rotor_mass_kg: f64,
    /// `b_z / m_r`.
    pub vertical_damping_per_s: f64,
    /// Acceleration of gravity.
    pub gravity_m_s2: f64,
    /// `1 + phi_p . rho_q`.
    coupling: [[f64; 2]; 2],
}

/// The drive under one command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Index of the driven mode in A, B, C; `None` when off.
    pub mode: Option<usize>,
    /// Amplitude of the modal acceleration.
    pub acceleration_m_s2: f64,
    /// Frequency; 0 when off, because the phase then does not change.
    pub frequency_hz: f64,
}

/// Stator and rotor at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertical {
    /// The stator.
    pub modes: ModalState<f64>,
    /// Height of the rotor.
    pub height_m: f64,
    /// Vertical velocity of the rotor.
    pub velocity_m_s: f64,
}

impl System {
    /// The system of the motor of `params`.
    ///
    /// # Errors
    /// When mode A is damped beyond 0.99 of critical.
    pub fn try_new(params: &MotorParams, variation: &AmplitudeVariation) -> Result<Self, OutOfBounds> {
        let modes = Mode::all(params)?;
        let teeth = ToothPair::both(params, variation);
        let rotor_mass_kg = params.get(Parameter::RotorMass);
        Ok(Self {
            modes,
            teeth,
            rotor_mass_kg,
            vertical_damping_per_s: params.get(Parameter::VerticalDamping) / rotor_mass_kg,
            gravity_m_s2: params.get(Parameter::Gravity),
            coupling: teeth.map(|p| teeth.map(|q| 1.0 + p.shape.dot(&q.recoil))),
        })
    }

    /// The drive of this motor under `command`.
    pub fn drive(&self, command: DriveCommand) -> Drive {
        let Some(mode) = command.mode() else {
            return Drive { mode: None, acceleration_m_s2: 0.0, frequency_hz: 0.0 };
        };
        let index = match mode {
            DriveMode::B => 1,
            DriveMode::C => 2,
        };
        Drive {
            mode: Some(index),
            acceleration_m_s2: f64::from(command.amplitude()) * self.modes[index].drive_acceleration_m_s2(),
            frequency_hz: self.modes[index].natural_rad_s / TAU + f64::from(command.frequency_offset_hz()),
        }
    }

    /// Fastest rate in the motion under `drive`.
    pub fn fastest_rate_per_s(&self, drive: &Drive) -> f64 {
        let modal = self.modes.iter().map(|mode| mode.natural_rad_s * (1.0 + mode.damping_ratio));
        modal.fold(self.vertical_damping_per_s.max(TAU * drive.frequency_hz.abs()), f64::max)
    }

    /// Gap of pair `p`.
    pub fn gap_m(&self, at: &Vertical, p: usize) -> f64 {
        at.height_m - self.teeth[p].height(&at.modes)
    }

    /// Speed of approach of tooth `p` to the rotor, `u' - v_z`.
    pub fn approach_m_s(&self, at: &Vertical, p: usize) -> f64 {
        self.teeth[p].vertical_velocity(&at.modes) - at.velocity_m_s
    }

    /// Raises the rotor's velocity by `rise_m_s` through an impulse of pair `p`. The modes recoil.
    pub fn apply_impulse(&self, at: &mut Vertical, p: usize, rise_m_s: f64) {
        at.velocity_m_s += rise_m_s;
        at.modes.velocity_m_s -= self.teeth[p].recoil * rise_m_s;
    }

    /// `n` with `sum_q (1 + phi_p . rho_q) n_q = wanted_p` over the pairs of `contact`, 0 for the others.
    fn solved_for(&self, contact: Contact, wanted: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.coupling;
        match contact {
            [false, false] => [0.0, 0.0],
            [true, false] => [wanted[0] / a, 0.0],
            [false, true] => [0.0, wanted[1] / d],
            [true, true] => {
                let determinant = a * d - b * c;
                [(d * wanted[0] - b * wanted[1]) / determinant, (a * wanted[1] - c * wanted[0]) / determinant]
            }
        }
    }

    /// Moves rotor and modes so that the gaps of the pairs of `contact` are zero in position and velocity, by the
    /// smallest change in the metric of the masses.
    pub fn project(&self, at: &mut Vertical, contact: Contact) {
        let gaps = [0, 1].map(|p| -self.gap_m(at, p));
        let approaches = [0, 1].map(|p| self.approach_m_s(at, p));
        let (shifts, pushes) = (self.solved_for(contact, gaps), self.solved_for(contact, approaches));
        for p in 0..2 {
            at.height_m += shifts[p];
            at.modes.displacement_m -= self.teeth[p].recoil * shifts[p];
            self.apply_impulse(at, p, pushes[p]);
        }
    }

    /// Which pairs of `touching` (gap and approach zero) stay in contact, by their accelerations: the one set whose
    /// pairs all have a positive normal force and from which all other pairs move away.
    pub fn sustained(&self, at: &Vertical, drive: &Drive, phase_turns: f64, touching: Contact) -> Contact {
        let (sin, _) = math::sin_cos(TAU * phase_turns);
        let (modal, vertical) = self.free_accelerations(
            drive,
            sin,
            at.modes.displacement_m.data.0[0],
            at.modes.velocity_m_s.data.0[0],
            at.velocity_m_s,
        );
        let free = self.gap_accelerations(modal, vertical - self.gravity_m_s2);
        let sets = [[true, true], [true, false], [false, true]];
        let fits = |contact: &Contact| {
            let pushes = self.solved_for(*contact, free.map(|acceleration| -acceleration));
            (0..2).all(|p| {
                let relative = free[p] + (0..2).map(|q| self.coupling[p][q] * pushes[q]).sum::<f64>();
                match (touching[p], contact[p]) {
                    (false, in_contact) => !in_contact,
                    (true, true) => pushes[p] > 0.0,
                    (true, false) => relative >= 0.0,
                }
            })
        };
        sets.into_iter().find(fits).unwrap_or([false, false])
    }

    /// Accelerations of modes and rotor without contact and gravity. They are linear in all arguments, so they hold for
    /// coefficients as for values.
    fn free_accelerations(
        &self,
        drive: &Drive,
        drive_sine: f64,
        displacement: [f64; 3],
        velocity: [f64; 3],
        rotor_velocity: f64,
    ) -> ([f64; 3], f64) {
        let mut modal = array::from_fn(|n| {
            let Mode { natural_rad_s: w, damping_ratio: zeta, .. } = self.modes[n];
            -w * (w * displacement[n] + 2.0 * zeta * velocity[n])
        });
        if let Some(n) = drive.mode {
            modal[n] += drive.acceleration_m_s2 * drive_sine;
        }
        (modal, -self.vertical_damping_per_s * rotor_velocity)
    }

    /// `z'' - phi_p . g''` of both pairs.
    fn gap_accelerations(&self, modal: [f64; 3], vertical: f64) -> [f64; 2] {
        array::from_fn(|p| vertical - (0..3).map(|n| self.teeth[p].shape[n] * modal[n]).sum::<f64>())
    }

    /// The motion of the next `duration_s` with this `contact` and without events.
    pub fn expand(
        &self,
        at: &Vertical,
        drive: &Drive,
        phase_turns: f64,
        contact: Contact,
        duration_s: f64,
    ) -> Segment {
        let h = duration_s;
        let mut displacement = at.modes.displacement_m.data.0[0].map(constant);
        let mut velocity = at.modes.velocity_m_s.data.0[0].map(constant);
        let (mut height, mut rotor_velocity) = (constant(at.height_m), constant(at.velocity_m_s));
        let mut pushes = [Series::ZERO; 2];
        let drive_angle = TAU * drive.frequency_hz * h;
        let (mut sin, mut cos) = math::sin_cos(TAU * phase_turns);
        let mut power = 0.0;
        for k in 0..=ORDER {
            let (mut modal, mut vertical) = self.free_accelerations(
                drive,
                sin,
                array::from_fn(|n| displacement[n].0[k]),
                array::from_fn(|n| velocity[n].0[k]),
                rotor_velocity.0[k],
            );
            if k == 0 {
                vertical -= self.gravity_m_s2;
            }
            let gaps = self.gap_accelerations(modal, vertical);
            let held = self.solved_for(contact, gaps.map(|gap| -gap));
            for (p, push) in held.into_iter().enumerate() {
                pushes[p].0[k] = push;
                vertical += push;
                for (n, acceleration) in modal.iter_mut().enumerate() {
                    *acceleration -= self.teeth[p].recoil[n] * push;
                }
            }
            if k == ORDER {
                break;
            }
            power += 1.0;
            let next = h / power;
            for n in 0..3 {
                displacement[n].0[k + 1] = next * velocity[n].0[k];
                velocity[n].0[k + 1] = next * modal[n];
            }
            height.0[k + 1] = next * rotor_velocity.0[k];
            rotor_velocity.0[k + 1] = next * vertical;
            (sin, cos) = (drive_angle / power * cos, -drive_angle / power * sin);
        }
        Segment {
            duration_s,
            displacement_m: displacement,
            velocity_m_s: velocity,
            rotor_height_m: height,
            rotor_velocity_m_s: rotor_velocity,
            normal_force_per_mass_m_s2: pushes,
            contact,
        }
    }
}

fn constant(value: f64) -> Series {
    let mut series = Series::ZERO;
    series.0[0] = value;
    series
}

/// The motion between two events as power series in the fraction `tau` of [`Self::duration_s`].
#[derive(Clone, Debug)]
pub struct Segment {
    /// Time at `tau = 1`. An event may end the motion earlier.
    pub duration_s: f64,
    /// `g_n`.
    pub displacement_m: [Series; 3],
    /// `g_n'`.
    pub velocity_m_s: [Series; 3],
    /// `z`.
    pub rotor_height_m: Series,
    /// `v_z`.
    pub rotor_velocity_m_s: Series,
    /// Normal force over rotor mass, `n_p = N_p / m_r`; zero for a pair out of contact.
    pub normal_force_per_mass_m_s2: [Series; 2],
    /// Pairs in contact.
    pub contact: Contact,
}

impl Segment {
    /// Stator and rotor at `tau`.
    pub fn at(&self, tau: f64) -> Vertical {
        let at = |series: &[Series; 3]| series.map(|series| series.at(tau)).into();
        Vertical {
            modes: ModalState {
                displacement_m: at(&self.displacement_m),
                velocity_m_s: at(&self.velocity_m_s),
            },
            height_m: self.rotor_height_m.at(tau),
            velocity_m_s: self.rotor_velocity_m_s.at(tau),
        }
    }

    /// `sum weights_n x_n` of modal series.
    pub fn combine(series: &[Series; 3], weights: &[f64]) -> Series {
        weights.iter().zip(series).fold(Series::ZERO, |sum, (&weight, series)| sum.plus(weight, series))
    }

    /// Gap of `tooth`.
    pub fn gap(&self, tooth: &ToothPair<f64>) -> Series {
        self.rotor_height_m.plus(-1.0, &Self::combine(&self.displacement_m, tooth.shape.as_slice()))
    }
}
