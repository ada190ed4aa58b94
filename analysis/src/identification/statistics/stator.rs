//! Statistics of a bare stator: ring-downs and sweeps, each fitted by least squares.
//!
//! ```text
//! ring-down   v(t) = exp(-d t) (a cos w t + b sin w t) + c
//! sweep       |v|(w) = A / sqrt(1 + ((w - w_0) / d)^2)           near the resonance, slowly swept
//! ```
//!
//! with the decay `d = zeta w_0`. What a sweep of finite speed and the approximation near the resonance leave out shows
//! in every motor alike, and the emulator learns it.

use std::f64::consts::TAU;

use motor_model::{DriveCommand, DriveMode, math};

use super::{Taker, within};
use crate::identification::measured::Measured;
use crate::identification::parts::{Kind, Span};
use crate::least_squares::{Fitted, damped_oscillation, fit};
use simulation::math::statistics::{Accumulator, Line};
use simulation::runs::recording::design_frequency_hz;
use simulation::scene::Scene;

/// Longest part of a ring-down that is fitted, in s: several of its decay times.
const RING_DOWN_MAX_S: f64 = 0.02;
/// Length of a stretch over which the oscillation is averaged for the first guess.
const STRETCH_S: f64 = 5e-4;

/// Frequency of the drive in Hz.
fn drive_hz(scene: &Scene, command: DriveCommand) -> f64 {
    let mode = command.mode().unwrap_or(DriveMode::B);
    design_frequency_hz(&scene.motor_params(), mode) + f64::from(command.frequency_offset_hz())
}

/// Resonance curve and its derivatives by resonance, decay (both in rad/s) and peak.
fn resonance(w: f64, [w_0, d, peak]: &[f64; 3]) -> (f64, [f64; 3]) {
    let x = (w - w_0) / d;
    let share = 1.0 / math::sqrt(1.0 + x * x);
    let by_x = -peak * x * share * share * share;
    (peak * share, [-by_x / d, -by_x * x / d, share])
}

/// The oscillation at `w` rad/s within a span as its two amplitudes; time counts from the beginning of the span.
fn phasor(measured: &Measured, span: Span, w: f64) -> [f64; 2] {
    let at_s = within(&measured.at_s, &measured.at_s, span);
    let velocity = within(&measured.at_s, &measured.velocity_m_s, span);
    let (mut count, mut sums) = (0.0, [0.0; 2]);
    for (at, v) in at_s.iter().zip(velocity) {
        let (sin, cos) = math::sin_cos(w * (at - span.0));
        count += 1.0;
        sums[0] += v * cos;
        sums[1] += v * sin;
    }
    sums.map(|sum| 2.0 * sum / f64::max(count, 1.0))
}

/// A fitted ring-down of `span`, of a mode near `w` rad/s.
fn fitted_ring_down(measured: &Measured, span: Span, w: f64) -> Option<Fitted<5>> {
    let (from, until) = (span.0, span.1.min(span.0 + RING_DOWN_MAX_S));
    let (mut phases, mut sizes, mut last) = (Vec::new(), Vec::new(), 0.0);
    let mut begin = from;
    while begin + STRETCH_S <= until {
        let [cos, sin] = phasor(measured, (begin, begin + STRETCH_S), w);
        // v = a cos(w t) + b sin(w t) has the phase -atan2(b, a); each stretch counts time from its own beginning.
        let turned = math::atan2(-sin, cos) - w * (begin - from);
        let phase = turned - TAU * ((turned - last) / TAU).round();
        last = phase;
        phases.push((begin - from, phase));
        let size = math::sqrt(cos * cos + sin * sin);
        if phases.len() <= 8 {
            sizes.push((begin - from, math::ln(size + 1e-9)));
        }
        begin += STRETCH_S;
    }
    phases.truncate(8);
    let (phase, size) = (Line::through(&phases)?, Line::through(&sizes)?);
    let [a, b] = phasor(measured, (from, from + STRETCH_S), w);
    let guess = [w + phase.slope, (-size.slope).max(1.0), a, b, 0.0];
    let at_s: Vec<f64> =
        within(&measured.at_s, &measured.at_s, (from, until)).iter().map(|at| at - from).collect();
    let velocity = within(&measured.at_s, &measured.velocity_m_s, (from, until));
    Some(fit(&at_s, velocity, guess, damped_oscillation))
}

pub(super) fn ring_down(scene: &Scene, kind: &Kind, measured: &Measured, taker: &mut Taker) {
    let w = TAU * drive_hz(scene, kind.command);
    let mut sums: [Accumulator; 3] = Default::default();
    for span in &kind.spans {
        let Some(Fitted { values: [w, d, a, b, _], .. }) = fitted_ring_down(measured, *span, w) else {
            continue;
        };
        let size = math::sqrt(a * a + b * b);
        let values = [w / TAU, d, size];
        sums.iter_mut().zip(values).for_each(|(sum, value)| sum.add(value));
    }
    let [hz, decay, size] = sums.map(|sum| sum.spread().mean);
    taker.take("frequency", hz);
    taker.take("decay", decay);
    taker.take("amplitude", size);
}

pub(super) fn sweep(scene: &Scene, pieces: &[(DriveCommand, Span)], measured: &Measured, taker: &mut Taker) {
    let points = pieces.iter().map(|&(command, span)| {
        let w = TAU * drive_hz(scene, command);
        let [cos, sin] = phasor(measured, span, w);
        (w, math::sqrt(cos * cos + sin * sin))
    });
    let (w, size): (Vec<f64>, Vec<f64>) = points.unzip();
    let peak = size.iter().copied().fold(0.0, f64::max);
    let at_peak = size.iter().position(|size| *size >= peak).and_then(|at| w.get(at)).copied().unwrap_or(1.0);
    // A damping of half a percent is a first guess for any resonator of silicon with a foil.
    let Fitted { values: [w_0, d, peak], .. } = fit(&w, &size, [at_peak, 0.005 * at_peak, peak], resonance);
    taker.take("frequency", w_0 / TAU);
    taker.take("decay", d.abs());
    taker.take("amplitude", peak);
}
