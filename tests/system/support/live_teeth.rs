//! A rotor dropped or thrown on teeth whose motion is known in closed form, and when it meets them: by bisection.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{DriveMode, MotorParams, MotorState, Parameter, Phase, Real};

use crate::support::motors::changed;
use crate::support::oscillator::{Force, Motion, Oscillator};
use crate::support::tooth::Tooth;

/// Gravity of all these scenes in m/s^2.
pub const GRAVITY_M_S2: f64 = 9.81;

/// A rotor of a microgram on a stator of a kilogram: the recoil is 3e-9 of the impact.
#[track_caller]
pub fn on_rigid_floor(restitution: f64) -> MotorParams {
    changed(&[
        (Parameter::RotorMass, 1e-9),
        (Parameter::StatorMass, 1.0),
        (Parameter::VerticalDamping, 0.0),
        (Parameter::TangentialDrag, 0.0),
        (Parameter::Restitution, restitution),
    ])
}

/// Where `function`, positive at 0, falls below zero for the only time before `until`: by bisection.
#[track_caller]
pub fn descent(function: impl Fn(f64) -> f64, until: f64) -> f64 {
    let (mut early, mut late) = (0.0, until);
    assert!(function(early) > 0.0 && function(late) < 0.0, "one descent before {until}");
    for _ in 0..80 {
        let middle = 0.5 * (early + late);
        if function(middle) > 0.0 { early = middle } else { late = middle }
    }
    0.5 * (early + late)
}

/// Both pairs in the steady motion of a fully driven mode, the rotor thrown down from `height_m` without gravity or
/// damping, faster than any tooth falls: each pair is met once.
pub struct LiveTeeth {
    oscillator: Oscillator,
    mode: DriveMode,
    force: Force,
    start: Motion,
    shapes: [f64; 2],
    height_m: f64,
    down_m_s: f64,
}

/// The first contact of the rotor with a pair.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// 0 or 1.
    pub pair: u8,
    /// After the throw.
    pub time_s: f64,
    /// Of the tooth, upward.
    pub tooth_velocity_m_s: f64,
}

impl LiveTeeth {
    /// Nominal teeth at a phase of the drive; the throw is from 45 to 57 um (mode C) or 80 to 92 um (B), which is above
    /// them.
    pub fn thrown_at(params: &MotorParams, mode: DriveMode, index: u32, of: u32) -> Self {
        let oscillator = Oscillator::of(params, mode);
        let phase_turns = (f64::from(index) + 0.37) / f64::from(of);
        let force = Force { amplitude: 1.0, rad_s: oscillator.natural_rad_s, phase_rad: TAU * phase_turns };
        let (sin, cos) = force.phase_rad.sin_cos();
        let start = (-oscillator.antinode_m * cos, oscillator.antinode_m * oscillator.natural_rad_s * sin);
        let (reach_m, mode_index) = match mode {
            DriveMode::B => (80e-6, 1),
            DriveMode::C => (45e-6, 2),
        };
        Self {
            oscillator,
            mode,
            force,
            start,
            shapes: [0, 1].map(|pair| Tooth::of(params, pair, 0.0).shape()[mode_index]),
            // No multiple of any step.
            height_m: reach_m + 12e-6 * (f64::from(index) * 0.618).fract(),
            down_m_s: -1.5,
        }
    }

    /// Speed at which gap and tooth close at the least, in m/s, and the amplitude of the teeth in m.
    pub fn slowest_approach_m_s(&self) -> f64 {
        -self.down_m_s - self.oscillator.natural_rad_s * self.tooth_amplitude_m()
    }

    /// Amplitude of the teeth in m.
    pub fn tooth_amplitude_m(&self) -> f64 {
        self.oscillator.antinode_m * self.shapes[0].abs()
    }

    /// The rotor's velocity before the contact.
    pub fn down_m_s(&self) -> f64 {
        self.down_m_s
    }

    /// Natural frequency of the driven mode.
    pub fn natural_rad_s(&self) -> f64 {
        self.oscillator.natural_rad_s
    }

    /// Puts a motor into the state at the throw.
    pub fn set<T: Real>(&self, state: &mut MotorState<T>) {
        state.phase = Phase::from_turns(self.force.phase_rad / TAU);
        let (g, v) = (T::from_f64(self.start.0), T::from_f64(self.start.1));
        match self.mode {
            DriveMode::B => (state.modes.displacement_m.y, state.modes.velocity_m_s.y) = (g, v),
            DriveMode::C => (state.modes.displacement_m.z, state.modes.velocity_m_s.z) = (g, v),
        }
        state.rotor.height_m = T::from_f64(self.height_m);
        state.rotor.velocity_m_s = T::from_f64(self.down_m_s);
    }

    /// The pair that is met first.
    #[track_caller]
    pub fn first_contact(&self) -> Contact {
        let [first, second] = [0, 1].map(|pair| self.contact_with(pair));
        if first.time_s < second.time_s { first } else { second }
    }

    fn contact_with(&self, pair: u8) -> Contact {
        let shape = self.shapes[usize::from(pair)];
        let tooth = |t: f64| {
            let (g, v) = self.oscillator.closed_form(self.start, self.force, t);
            (shape * g, shape * v)
        };
        let time_s = descent(|t| self.height_m + self.down_m_s * t - tooth(t).0, 1e-4);
        Contact { pair, time_s, tooth_velocity_m_s: tooth(time_s).1 }
    }
}
