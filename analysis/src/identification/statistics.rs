//! A recording reduced to statistics: what is regular in a motion that is chaotic.
//!
//! | part | statistics |
//! |---|---|
//! | steady drive, camera | mean rate, its spread over 5 ms; of several marks shift, its largest, residual |
//! | steady drive, vibrometer | size of the velocity and its shape; structure function `S(tau)`; impacts; flight |
//! | impacts | number a second, mean and spread of jump and interval, velocity after per velocity before |
//! | flight | acceleration and its change with the velocity: gravity and film damping |
//! | after a drive | energy in windows of the time since, angle turned since |
//! | bare stator | frequency, decay and amplitude of each ring-down; frequency, damping and peak of each sweep |
//!
//! ```text
//! S(tau) = mean of (v(t + tau) - v(t))^2
//! ```
//!
//! has the information of the spectrum, and thus of the line of the hopping, in values that vary smoothly with the
//! parameters. Sizes of a chaotic motion are logarithms.

mod camera;
mod flight;
mod stator;

use super::measured::Measured;
use super::parts::{Parts, Span};
use simulation::scene::Scene;

/// A statistic.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistic {
    /// Which part and what, as `b:1 mean rate`.
    pub name: String,
    /// Its value.
    pub value: f64,
}

/// Takes statistics of one part.
struct Taker<'a> {
    part: &'a str,
    taken: &'a mut Vec<Statistic>,
}

impl Taker<'_> {
    /// Takes one. What is not finite, because there was nothing to average, is 0.
    fn take(&mut self, what: &str, value: f64) {
        let value = if value.is_finite() { value } else { 0.0 };
        self.taken.push(Statistic { name: format!("{} {what}", self.part), value });
    }
}

/// The statistics of a recording: of the same parts always the same, in the same order. `scene` is that of the
/// recording, which knows its instruments and its drive's frequencies.
pub fn statistics(scene: &Scene, parts: &Parts, measured: &Measured) -> Vec<Statistic> {
    let mut taken = Vec::new();
    let is_stator = scene.choice("record.model") == "stator";
    let noise_m_s = scene.number("ldv.noise_m_s");
    if is_stator {
        for kind in &parts.coasting {
            stator::ring_down(scene, kind, measured, &mut Taker { part: &kind.name, taken: &mut taken });
        }
        for (number, sweep) in parts.sweeps.iter().enumerate() {
            let part = format!("sweep {}", number + 1);
            stator::sweep(scene, sweep, measured, &mut Taker { part: &part, taken: &mut taken });
        }
        return taken;
    }
    for kind in &parts.driven {
        let mut taker = Taker { part: &kind.name, taken: &mut taken };
        if parts.has_camera {
            camera::driven(&kind.spans, measured, &mut taker);
        }
        if parts.has_marks {
            camera::marks(&kind.spans, measured, &mut taker);
        }
        if parts.has_vibrometer {
            flight::driven(&kind.spans, measured, noise_m_s, &mut taker);
        }
    }
    for kind in &parts.coasting {
        let mut taker = Taker { part: &kind.name, taken: &mut taken };
        if parts.has_camera {
            camera::coasting(&kind.spans, measured, &mut taker);
        }
        if parts.has_vibrometer {
            flight::coasting(&kind.spans, measured, &mut taker);
        }
    }
    taken
}

/// The values within a span, of values at these instants.
fn within<'v, V>(at_s: &[f64], values: &'v [V], (from, until): Span) -> &'v [V] {
    let first = at_s.partition_point(|at| *at < from);
    let last = at_s.partition_point(|at| *at < until);
    values.get(first..last).unwrap_or_default()
}

/// Windows of the time since the drive ended, in s; those beyond `length` are left out.
fn windows_since(length_s: f64) -> impl Iterator<Item = (usize, Span)> {
    const EDGES_MS: [f64; 8] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
    let spans = EDGES_MS.windows(2).map(|edge| (1e-3 * edge[0], 1e-3 * edge[1]));
    let spans: Vec<Span> = spans.take_while(|span| span.1 <= length_s * (1.0 + 1e-9)).collect();
    spans.into_iter().enumerate()
}

/// Length of the shortest span.
fn shortest(spans: &[Span]) -> f64 {
    spans.iter().map(|(from, until)| until - from).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests;
