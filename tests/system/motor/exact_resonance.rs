//! The driven stator against closed forms: resonance, response against frequency, ring-up, ring-down.
//!
//! In steady motion `g = Im(X e^(i phase))` and `g' / w = Re(X e^(i phase))`, so one state and its phase give the whole
//! complex amplitude `X`, and every instant is a test.
//!
//! Rounding: an oscillator forgets at the rate `zeta w_n`, so two units in the last place a step (state and
//! coefficients), always the same way, pile up to `2 epsilon / (zeta w_n h)` of the amplitude. That, 16 units for the
//! gain, and 1e-12 for the yardstick's own rounding of a thousand radians is what the tests allow; in `f32` at 0.25 us
//! it is 0.4 %.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{
    DriveCommand, DriveMode, DriveTuning, MotorParams, Parameter, Phase, Real, Stator, StatorState,
};

use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{changed, epsilon, steps_in};
use crate::support::oscillator::{Force, Oscillator, assert_motion_close, motion_of};

/// A stator and where it is.
struct Swept<T: Real> {
    stator: Stator<T>,
    state: StatorState<T>,
    step_s: f64,
}

impl<T: Real> Swept<T> {
    fn at_rest(params: &MotorParams, step_s: f64) -> Self {
        let stator = Stator::try_new(params, DriveTuning::Resonant, step_s).expect("a valid stator");
        Self { stator, state: StatorState::default(), step_s }
    }

    fn step(&mut self, command: DriveCommand) {
        self.stator.step(&mut self.state, command);
    }

    fn run(&mut self, command: DriveCommand, time_s: f64) {
        for _ in 0..steps_in(time_s, self.step_s) {
            self.step(command);
        }
    }

    /// `X`, if the motion is steady at `rad_s`.
    fn complex_amplitude(&self, mode: DriveMode, rad_s: f64) -> (f64, f64) {
        let (g, v) = motion_of(&self.state.modes, mode);
        let (sin, cos) = radians(self.state.phase).sin_cos();
        (v / rad_s * cos + g * sin, g * cos - v / rad_s * sin)
    }
}

#[expect(clippy::cast_precision_loss, reason = "1e-16 of a turn")]
fn radians(phase: Phase) -> f64 {
    phase.units() as f64 / 18_446_744_073_709_551_616.0 * TAU
}

/// What rounding may pile up to, as a share of the amplitude.
fn rounding<T: Real>(oscillator: &Oscillator, step_s: f64) -> f64 {
    1e-12 + epsilon::<T>() * (16.0 + 2.0 / (oscillator.decay_per_s() * step_s))
}

/// Long enough for the transient to fall below 1e-13.
fn until_steady_s(oscillator: &Oscillator) -> f64 {
    30.0 / oscillator.decay_per_s()
}

/// Steps from fine to coarse, one that divides the drive period exactly, and one near half of it.
fn step_lengths_s(oscillator: &Oscillator) -> [f64; 6] {
    let period = TAU / oscillator.natural_rad_s;
    [0.25e-6, 1e-6, 10e-6, 50e-6, period / 8.0, 0.499 * period]
}

#[test]
fn exact_steady_amplitude_at_resonance_is_the_antinodes() {
    for mode in [DriveMode::B, DriveMode::C] {
        let oscillator = Oscillator::of(&MotorParams::nominal(), mode);
        let (re, im) = oscillator.response(oscillator.natural_rad_s);
        assert_close(re.hypot(im), oscillator.antinode_m, Within::relative(1e-12), "H at resonance");
        for (share, step_s) in
            [1.0, 0.3].into_iter().flat_map(|share| step_lengths_s(&oscillator).map(|step_s| (share, step_s)))
        {
            check_response::<f64>(mode, share, step_s, &[0.0]);
            check_response::<f32>(mode, share, step_s, &[0.0]);
        }
    }
}

/// Fine steps keep the resonance in `f32`: rounding errors of either sign pile up as a random walk over the `1 / (zeta
/// w h)` steps that the oscillator remembers, to `epsilon / sqrt(zeta w h)`. A propagator that had lost digits near 1
/// would be ten times worse.
#[test]
fn exact_fine_steps_keep_the_resonance_in_f32() {
    let params = MotorParams::nominal();
    for mode in [DriveMode::B, DriveMode::C] {
        let oscillator = Oscillator::of(&params, mode);
        for step_s in [0.1e-6, 0.25e-6, 1e-6] {
            let mut stator = Swept::<f32>::at_rest(&params, step_s);
            stator.run(DriveCommand::full(mode), until_steady_s(&oscillator));
            let share = epsilon::<f32>() * (16.0 + 2.0 / (oscillator.decay_per_s() * step_s).sqrt());
            for _ in 0..1000 {
                stator.step(DriveCommand::full(mode));
                let (g, v) = motion_of(&stator.state.modes, mode);
                let amplitude = g.hypot(v / oscillator.natural_rad_s);
                let what = format!("{mode:?} at {step_s:e} s");
                assert_close(amplitude, oscillator.antinode_m, Within::relative(share), what);
            }
        }
    }
}

/// The teeth then move as Table 1 says they were measured: 20.72 um in B, 1.81 um in C, at the measured tooth angle.
#[test]
fn exact_tooth_amplitudes_are_those_of_table_1() {
    let params = changed(&[(Parameter::ModeShift, 0.0)]);
    for (mode, tooth_amplitude_m) in [(DriveMode::B, 20.72e-6), (DriveMode::C, 1.81e-6)] {
        let oscillator = Oscillator::of(&params, mode);
        let mut stator = Swept::<f64>::at_rest(&params, 1e-6);
        stator.run(DriveCommand::full(mode), until_steady_s(&oscillator));
        let tooth = crate::support::tooth::Tooth::of(&params, 0, 0.0);
        let u = tooth.height_m(&stator.state.modes);
        let v = tooth.vertical_velocity_m_s(&stator.state.modes) / oscillator.natural_rad_s;
        assert_close(u.hypot(v), tooth_amplitude_m, Within::relative(1e-10), format_args!("{mode:?}"));
    }
}

fn check_response<T: Real>(mode: DriveMode, amplitude: f32, step_s: f64, offsets_hz: &[f32]) {
    let params = MotorParams::nominal();
    let oscillator = Oscillator::of(&params, mode);
    let at_resonance = DriveCommand::try_new(mode, amplitude).expect("a valid amplitude");
    for &offset_hz in offsets_hz {
        let command = at_resonance.with_frequency_offset(offset_hz).expect("a valid offset");
        let rad_s = oscillator.natural_rad_s + TAU * f64::from(offset_hz);
        let (re, im) = oscillator.response(rad_s);
        let (re, im) = (f64::from(amplitude) * re, f64::from(amplitude) * im);
        let mut stator = Swept::<T>::at_rest(&params, step_s);
        stator.run(command, until_steady_s(&oscillator));
        for _ in 0..20 {
            stator.step(command);
            let (x_re, x_im) = stator.complex_amplitude(mode, rad_s);
            let what = format!("{mode:?} {offset_hz} Hz off at {step_s:e} s");
            let share = rounding::<T>(&oscillator, step_s);
            // Off resonance the same force is balanced by stiffness: errors stay those of full amplitude at worst.
            let allowed = share * (f64::from(amplitude) * oscillator.antinode_m).min(50.0 * re.hypot(im));
            assert_close(
                x_re.hypot(x_im),
                re.hypot(im),
                Within::absolute(allowed),
                format!("{what}, amplitude"),
            );
            let lag = (x_im * re - x_re * im).atan2(x_re * re + x_im * im);
            assert_close(lag, 0.0, Within::absolute(allowed / re.hypot(im)), format!("{what}, phase"));
        }
    }
}

/// Beside the resonance of either mode, whose half widths are 40 and 56 Hz, and far from it.
const OFFSETS_HZ: [f32; 11] = [-2000.0, -700.0, -150.0, -40.0, -3.5, 0.0, 3.5, 40.0, 150.0, 700.0, 2000.0];

/// Amplitude and phase against frequency, over +-2 kHz, against `H = 1 / (w_n^2 - w^2 + 2 i zeta w_n w)`.
#[test]
fn exact_amplitude_and_phase_against_frequency() {
    for mode in [DriveMode::B, DriveMode::C] {
        for step_s in [1e-6, 10e-6, 50e-6] {
            check_response::<f64>(mode, 1.0, step_s, &OFFSETS_HZ);
            check_response::<f32>(mode, 1.0, step_s, &OFFSETS_HZ);
        }
    }
}

/// From rest for `time_s`, transient and all, and then down again.
fn check_ring_up_and_down<T: Real>(
    params: &MotorParams,
    mode: DriveMode,
    step_s: f64,
    offset_hz: f32,
    time_s: f64,
) {
    let oscillator = Oscillator::of(params, mode);
    let command = DriveCommand::full(mode).with_frequency_offset(offset_hz).expect("a valid offset");
    let rad_s = oscillator.natural_rad_s + TAU * f64::from(offset_hz);
    let mut stator = Swept::<T>::at_rest(params, step_s);
    let steps = steps_in(time_s, step_s);
    // Half a unit a step, all one way, where the oscillator forgets less than that.
    let piled_up = 1e-12 + epsilon::<T>() * (16.0 + 0.5 * f64::from(steps));
    let share = rounding::<T>(&oscillator, step_s).min(piled_up);
    let force = Force { amplitude: 1.0, rad_s, phase_rad: 0.0 };
    for step in 1..=steps {
        stator.step(command);
        let expected = oscillator.closed_form((0.0, 0.0), force, f64::from(step) * step_s);
        assert_motion_close(motion_of(&stator.state.modes, mode), expected, &oscillator, share, "ring-up");
    }
    let start = motion_of(&stator.state.modes, mode);
    let silent = Force { amplitude: 0.0, ..force };
    for step in 1..=steps {
        stator.step(DriveCommand::OFF);
        let expected = oscillator.closed_form(start, silent, f64::from(step) * step_s);
        assert_motion_close(motion_of(&stator.state.modes, mode), expected, &oscillator, share, "ring-down");
    }
}

#[test]
fn exact_ring_up_and_ring_down() {
    let params = MotorParams::nominal();
    for mode in [DriveMode::B, DriveMode::C] {
        for step_s in [1e-6, 10e-6, 50e-6] {
            for offset_hz in [0.0, 90.0, -1300.0] {
                check_ring_up_and_down::<f64>(&params, mode, step_s, offset_hz, 0.02);
                check_ring_up_and_down::<f32>(&params, mode, step_s, offset_hz, 0.02);
            }
        }
    }
}

/// A drive beside the resonance of a lightly damped stator, whose free oscillation decays at 4 a second: drive and free
/// oscillation beat, eight times.
#[test]
fn exact_beating_of_the_stator() {
    let light = [Parameter::ModeBDampingRatio, Parameter::ModeCDampingRatio].map(|zeta| (zeta, 1e-4));
    let params = changed(&light);
    for mode in [DriveMode::B, DriveMode::C] {
        for step_s in [1e-6, 10e-6, 20e-6] {
            for offset_hz in [40.0_f32, -40.0, 90.0] {
                let time_s = 8.0 / f64::from(offset_hz.abs());
                check_ring_up_and_down::<f64>(&params, mode, step_s, offset_hz, time_s);
                check_ring_up_and_down::<f32>(&params, mode, step_s, offset_hz, time_s);
            }
        }
    }
}
