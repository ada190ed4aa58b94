//! A driven damped oscillator, solved twice: in closed form, and by a Taylor series that knows only the equation.
//!
//! ```text
//! g'' + 2 zeta w_n g' + w_n^2 g = F sin(phase),   phase' = w
//! ```
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{DriveMode, ModalState, MotorParams, Parameter, Real};

use crate::support::closeness::{Within, assert_close};
use crate::support::tooth::{displacements, velocities};

/// `(g, g')` in m and m/s.
pub type Motion = (f64, f64);

/// Constants of one oscillator.
#[derive(Clone, Copy, Debug)]
pub struct Oscillator {
    /// `w_n` in rad/s.
    pub natural_rad_s: f64,
    /// `zeta`.
    pub damping_ratio: f64,
    /// Amplitude `A_n` of the steady motion at resonance and full drive.
    pub antinode_m: f64,
}

/// A sinusoidal force, as it acts from some instant on.
#[derive(Clone, Copy, Debug)]
pub struct Force {
    /// Share of full drive.
    pub amplitude: f64,
    /// `w` in rad/s.
    pub rad_s: f64,
    /// Phase at the start in rad.
    pub phase_rad: f64,
}

impl Oscillator {
    /// Mode B or C of a motor, from Table 1: the tooth amplitudes were measured at the nominal tooth angle.
    pub fn of(params: &MotorParams, mode: DriveMode) -> Self {
        use Parameter::{
            ModeBDampingRatio, ModeBFrequency, ModeBToothAmplitude, ModeCDampingRatio, ModeCFrequency,
            ModeCToothAmplitude, ToothAngle,
        };
        let (sin, cos) = (2.0 * params.get(ToothAngle).to_radians()).sin_cos();
        let (frequency, damping, amplitude, at_tooth) = match mode {
            DriveMode::B => (ModeBFrequency, ModeBDampingRatio, ModeBToothAmplitude, sin),
            DriveMode::C => (ModeCFrequency, ModeCDampingRatio, ModeCToothAmplitude, cos),
        };
        Self {
            natural_rad_s: TAU * params.get(frequency),
            damping_ratio: params.get(damping),
            antinode_m: params.get(amplitude) / at_tooth.abs(),
        }
    }

    /// Decay rate of the free motion's amplitude, `zeta w_n`.
    pub fn decay_per_s(&self) -> f64 {
        self.damping_ratio * self.natural_rad_s
    }

    /// `F` at full drive.
    pub fn full_force_m_s2(&self) -> f64 {
        2.0 * self.damping_ratio * self.natural_rad_s * self.natural_rad_s * self.antinode_m
    }

    /// `X` of the steady motion `g = Im(X exp(i phase))` at full drive: `F / (w_n^2 - w^2 + 2 i zeta w_n w)`.
    pub fn response(&self, rad_s: f64) -> (f64, f64) {
        let re = (self.natural_rad_s - rad_s) * (self.natural_rad_s + rad_s);
        let im = 2.0 * self.damping_ratio * self.natural_rad_s * rad_s;
        let scale = self.full_force_m_s2() / (re * re + im * im);
        (scale * re, -scale * im)
    }

    /// The motion `time_s` after `start`, in closed form.
    pub fn closed_form(&self, start: Motion, force: Force, time_s: f64) -> Motion {
        let w = force.rad_s;
        let (re, im) = self.response(w);
        let (re, im) = (force.amplitude * re, force.amplitude * im);
        let steady = |phase: f64| {
            let (sin, cos) = phase.sin_cos();
            (re * sin + im * cos, w * (re * cos - im * sin))
        };
        let (g_steady, v_steady) = steady(force.phase_rad);
        let decay = self.decay_per_s();
        let damped = self.natural_rad_s * (1.0 - self.damping_ratio * self.damping_ratio).sqrt();
        let a = start.0 - g_steady;
        let b = (start.1 - v_steady + decay * a) / damped;
        let (sin, cos) = (damped * time_s).sin_cos();
        let envelope = (-decay * time_s).exp();
        let g = envelope * (a * cos + b * sin);
        let v = envelope * damped * (b * cos - a * sin) - decay * g;
        let (g_steady, v_steady) = steady(force.phase_rad + w * time_s);
        (g + g_steady, v + v_steady)
    }

    /// The motion `time_s` after `start`, by the Taylor series of the linear system in `(g, g', sin, cos)`.
    ///
    /// Steps of an eighth of the shorter period at most and 20 terms: the first left out is `(pi/4)^21 / 21!`, 1e-22.
    pub fn series(&self, start: Motion, force: Force, time_s: f64) -> Motion {
        let fastest = self.natural_rad_s.max(force.rad_s);
        let pieces = (time_s * fastest / (TAU / 8.0)).ceil().max(1.0);
        let h = time_s / pieces;
        let (sin, cos) = force.phase_rad.sin_cos();
        let mut x = [start.0, start.1, sin, cos];
        let push = force.amplitude * self.full_force_m_s2();
        let mut done = 0.0;
        while done < pieces {
            let mut term = x;
            for k in 1..=20_u32 {
                let [g, v, sin, cos] = term;
                let slope = [
                    v,
                    push * sin - 2.0 * self.decay_per_s() * v - self.natural_rad_s * self.natural_rad_s * g,
                    force.rad_s * cos,
                    -force.rad_s * sin,
                ];
                let factor = h / f64::from(k);
                term = slope.map(|part| part * factor);
                for (sum, part) in x.iter_mut().zip(term) {
                    *sum += part;
                }
            }
            done += 1.0;
        }
        (x[0], x[1])
    }
}

/// The motion of mode B or C in a state.
pub fn motion_of<T: Real>(modes: &ModalState<T>, mode: DriveMode) -> Motion {
    let index = match mode {
        DriveMode::B => 1,
        DriveMode::C => 2,
    };
    (displacements(modes)[index], velocities(modes)[index])
}

/// Compares displacement and velocity, with an error allowed as a share of the amplitude.
#[track_caller]
pub fn assert_motion_close(
    actual: Motion,
    expected: Motion,
    oscillator: &Oscillator,
    share: f64,
    what: &str,
) {
    let g = oscillator.antinode_m * share;
    assert_close(actual.0, expected.0, Within::absolute(g), format_args!("{what}, displacement"));
    let v = oscillator.natural_rad_s * g;
    assert_close(actual.1, expected.1, Within::absolute(v), format_args!("{what}, velocity"));
}

/// The yardsticks agree with each other before anything is measured with them.
#[test]
fn dual_closed_form_and_series_agree() {
    for mode in [DriveMode::B, DriveMode::C] {
        let oscillator = Oscillator::of(&MotorParams::nominal(), mode);
        for detuning in [-0.2, 0.0, 0.004, 0.2] {
            let rad_s = oscillator.natural_rad_s * (1.0 + detuning);
            let force = Force { amplitude: 0.7, rad_s, phase_rad: 2.0 };
            let start = (3e-6, -0.1);
            for time_s in [1e-7, 3e-5, 4e-3] {
                let exact = oscillator.closed_form(start, force, time_s);
                let series = oscillator.series(start, force, time_s);
                assert_motion_close(series, exact, &oscillator, 1e-12, "series against closed form");
            }
        }
    }
}
