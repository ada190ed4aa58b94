//! The stator without its rotor: a tooth that is struck, the ring-down of its modes, and the sweep of a drive.
//!
//! With the shapes phi of modal mass one at the teeth, an impulse P at tooth i moves tooth j by
//!
//! ```text
//! w_j(t) = P sum over k of  phi_k(i) phi_k(j) exp(-zeta_k w_k t) sin(w_dk t) / w_dk,    w_dk = w_k sqrt(1 - zeta_k^2)
//! ```
//!
//! and a strain of the foil that swings at w, of which `F_k` is the force on mode k, by the size of
//!
//! ```text
//! sum over k of  phi_k(j) F_k / (w_k^2 - w^2 + 2 i zeta_k w_k w)
//! ```
//!
//! Damping does not come from the drawing. B and C have what the paper measured, A what its finite elements gave,
//! the tilting modes what the scene assumes.

use std::f64::consts::PI;

use motor_model::math;
use stator::drive::forces;
use stator::modes::Places;

use super::SolvedStator;
use super::driven::DrivenStator;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use crate::report::table::Table;
use simulation::scene::Scene;

/// The impulse of the pictures, N s: that of a rotor of 46 mg whose speed changes by 20 mm/s.
const IMPULSE_N_S: f64 = 1e-6;

/// A mode that rings down.
#[derive(Clone, Debug)]
pub(super) struct FreeMode {
    name: &'static str,
    natural_rad_s: f64,
    damping_ratio: f64,
    /// How its damping is known.
    known: &'static str,
    /// Shape at the teeth for a modal mass of one kilogram, 1/sqrt(kg).
    at_teeth: Vec<f64>,
    /// Force per strain in the field of both amplitudes, N/sqrt(kg); 0 of a mode that the field does not drive.
    force: f64,
}

impl FreeMode {
    /// Displacement at a time per impulse at one tooth, as seen at another, m/(N s).
    fn impulse_response(&self, struck: usize, seen: usize, t: f64) -> f64 {
        let (w, z) = (self.natural_rad_s, self.damping_ratio);
        let damped = w * math::sqrt((1.0 - z) * (1.0 + z));
        let (sin, _) = math::sin_cos(damped * t);
        self.at_teeth[struck] * self.at_teeth[seen] * math::exp(-z * w * t) * sin / damped
    }

    /// Real and imaginary part of the displacement of a tooth per strain that swings at `w`, m.
    fn sweep_response(&self, tooth: usize, w: f64) -> [f64; 2] {
        let (real, imaginary) = (
            self.natural_rad_s * self.natural_rad_s - w * w,
            2.0 * self.damping_ratio * self.natural_rad_s * w,
        );
        let scale = self.at_teeth[tooth] * self.force / (real * real + imaginary * imaginary);
        [scale * real, -scale * imaginary]
    }
}

/// The five modes of a stator with the damping of a scene; none of a stator without teeth.
pub(super) fn free_modes(solved: &SolvedStator, scene: &Scene) -> Vec<FreeMode> {
    let (Ok(places), Some(driven)) = (Places::of(&solved.solution), DrivenStator::of(solved)) else {
        return Vec::new();
    };
    let a = &solved.figures.a;
    let of_paper =
        scene.number("motor.mode_a.damping_n_s_per_m") / (4.0 * PI * a.frequency_hz * a.modal_mass_kg);
    let assumed = scene.number("motor.stator_tilt.damping_ratio");
    let [b, c] = solved.measured.map(|mode| mode.damping_ratio);
    let direction = 2.0 * driven.both[0].field_deg.to_radians();
    let modes = [
        ("A", places.a, of_paper, "finite elements of the paper"),
        ("tilt 1", places.tilt[0], assumed, "assumed"),
        ("tilt 2", places.tilt[1], assumed, "assumed"),
        ("B", places.b, b, "measured in the paper"),
        ("C", places.c, c, "measured in the paper"),
    ];
    let of = |(name, place, damping_ratio, known): (&'static str, usize, f64, &'static str)| {
        let mode = &solved.solution.modes[place];
        let [along, across] = forces(&solved.solution, &solved.drawing, mode);
        let (sin, cos) = math::sin_cos(direction);
        FreeMode {
            name,
            natural_rad_s: 2.0 * PI * mode.frequency_hz,
            damping_ratio,
            known,
            at_teeth: solved.solution.at_tips(mode).map(|(_, [_, _, w])| w).collect(),
            force: if mode.order == 2 { along * cos + across * sin } else { 0.0 },
        }
    };
    let modes: Vec<FreeMode> = modes.into_iter().map(of).collect();
    if modes.iter().any(|mode| mode.at_teeth.len() < 4) { Vec::new() } else { modes }
}

/// Height of a tooth after an impulse at another, m.
pub(super) fn struck(modes: &[FreeMode], struck: usize, seen: usize, impulse_n_s: f64, t: f64) -> f64 {
    impulse_n_s * modes.iter().map(|mode| mode.impulse_response(struck, seen, t)).sum::<f64>()
}

/// Amplitude of a tooth under a strain that swings at a frequency, m.
fn swept(modes: &[FreeMode], tooth: usize, strain: f64, frequency_hz: f64) -> f64 {
    let parts = modes.iter().map(|mode| mode.sweep_response(tooth, 2.0 * PI * frequency_hz));
    let [real, imaginary] = parts.fold([0.0, 0.0], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
    strain * math::sqrt(real * real + imaginary * imaginary)
}

/// Damping, ring-down and what an impulse at a tooth gives each mode.
pub(super) fn table(modes: &[FreeMode]) -> Table {
    let mut table =
        Table::new(&["mode", "damping ratio", "known", "falls to 1/e in, ms", "at a struck tooth, um"]);
    for mode in modes {
        let time_s = 1.0 / (mode.damping_ratio * mode.natural_rad_s);
        let amplitude = IMPULSE_N_S * mode.at_teeth[0] * mode.at_teeth[0] / mode.natural_rad_s;
        table.push(vec![
            mode.name.to_owned(),
            format!("{:.4}", mode.damping_ratio),
            mode.known.to_owned(),
            format!("{:.2}", 1e3 * time_s),
            format!("{:.2}", 1e6 * amplitude),
        ]);
    }
    table
}

/// A tooth that is struck, and the ring-down after the drive.
pub(super) fn picture(solved: &SolvedStator, modes: &[FreeMode]) -> Figure {
    let mut figure = Figure::new("Free response of the stator without its rotor");
    if modes.is_empty() {
        return figure;
    }
    let times = |end_s: f64| (0..=800).map(move |part| f64::from(part) / 800.0 * end_s);
    let axis = || Axis::new("time (ms)");
    let mut panel = Panel::new("A tooth is struck with 1 uN s", axis(), Axis::new("height (um)")).height(280);
    for (seen, name, colour) in
        [(0, "struck", Colour::Vermilion), (1, "beside it", Colour::Sky), (2, "opposite", Colour::Blue)]
    {
        let line = times(3e-3).map(|t| (1e3 * t, 1e6 * struck(modes, 0, seen, IMPULSE_N_S, t)));
        panel = panel.series(Series::line(line.collect()).colour(colour).label(name));
    }
    figure = figure.panel(panel);
    let mut panel =
        Panel::new("Envelopes after a drive at full", axis(), Axis::new("amplitude at the teeth (um)"));
    for (mode, colour) in solved.measured.iter().zip([Colour::Vermilion, Colour::Blue]) {
        let fall = |t: f64| mode.tooth_amplitude_m * math::exp(-t / mode.ring_down_s());
        let line = times(20e-3).map(|t| (1e3 * t, 1e6 * fall(t)));
        panel =
            panel.series(Series::line(line.collect()).colour(colour).label(format!("mode {}", mode.name)));
    }
    figure.panel(panel)
}

/// Amplitude at the teeth against the frequency of one strain, in the field that gives B and C what was measured.
pub(super) fn sweep(solved: &SolvedStator, modes: &[FreeMode]) -> Figure {
    let figure = Figure::new("Frequency sweep of the stator without its rotor");
    let Some(driven) = DrivenStator::of(solved).filter(|_| !modes.is_empty()) else { return figure };
    let [b, c] = solved.measured;
    let strain = driven.both[0].strain;
    let (from, to) = (0.85 * b.frequency_hz, 1.15 * c.frequency_hz);
    let at = |part: u32| from + (to - from) * f64::from(part) / 2000.0;
    let curve = (0..=2000).map(|part| (1e-3 * at(part), 1e6 * swept(modes, 0, strain, at(part)))).collect();
    let peaks = [b, c].map(|mode| (1e-3 * mode.frequency_hz, 1e6 * mode.tooth_amplitude_m)).to_vec();
    let said = format!("finite elements, {:.1} ppm at {:.1} degrees", 1e6 * strain, driven.both[0].field_deg);
    let panel = Panel::new(
        "Amplitude at a tooth",
        Axis::new("frequency (kHz)"),
        Axis::new("amplitude (um)").logarithmic(),
    )
    .height(300)
    .series(Series::line(curve).colour(Colour::Vermilion).label(said))
    .series(Series::points(peaks).colour(Colour::Black).width(3.5).label("paper, vibrometer"));
    figure.panel(panel)
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveTuning, ModalState, Mode, MotorParams, Stator, StatorState};
    use stator::solver::Solver;

    use super::*;

    /// The motor model's stator, struck at one tooth of a pair and stepped without drive, moves that tooth as the sum
    /// of modes says. Its steps are exact: what is left is rounding.
    #[test]
    fn dual_a_struck_tooth_moves_as_in_the_motor_model() {
        let params = MotorParams::nominal();
        let (step_s, impulse) = (10e-6, 1e-6);
        let stator = Stator::<f64>::try_new(&params, DriveTuning::Resonant, step_s).unwrap();
        let tooth = &stator.teeth()[0];
        let mut state = StatorState::default();
        let mut modes = Vec::new();
        for (place, mode) in Mode::all(&params).unwrap().into_iter().enumerate() {
            let mut unit = ModalState::default();
            unit.displacement_m[place] = 1.0;
            let shape = tooth.height(&unit);
            state.modes.velocity_m_s[place] = impulse * shape / mode.mass_kg;
            modes.push(FreeMode {
                name: "",
                natural_rad_s: mode.natural_rad_s,
                damping_ratio: mode.damping_ratio,
                known: "",
                at_teeth: vec![shape / math::sqrt(mode.mass_kg)],
                force: 0.0,
            });
        }
        let mut largest = 0.0_f64;
        for step in 1..=500 {
            stator.step(&mut state, DriveCommand::OFF);
            let expected = struck(&modes, 0, 0, impulse, f64::from(step) * step_s);
            largest = largest.max(expected.abs());
            let found = tooth.height(&state.modes);
            assert!((found - expected).abs() < 1e-9 * largest, "step {step}: {found} {expected}");
        }
        assert!(largest > 1e-7);
    }

    /// The struck tooth starts with the impulse over the effective tooth mass with tilting modes, on the mean of the
    /// teeth. In the field of both amplitudes the sweep has them at the modes' frequencies: each mode adds to the other
    /// what it does far from its own resonance, `2 zeta a / |1 - r^2|` with r the ratio of the frequencies.
    #[test]
    fn law_impulse_and_sweep_follow_the_figures() {
        let mut drawing = stator::Drawing::default();
        drawing.numbers.mesh_size_m = 0.8e-3;
        let solved = SolvedStator::as_drawn(&drawing, &Solver::default()).unwrap();
        let modes = free_modes(&solved, &Scene::default());
        assert_eq!(modes.len(), 5);
        let t = 1e-9;
        let speeds = (0..4).map(|tooth| struck(&modes, tooth, tooth, IMPULSE_N_S, t) / t);
        let expected = IMPULSE_N_S / solved.figures.effective_tooth_mass_with_tilt_kg;
        let mean = speeds.sum::<f64>() / 4.0;
        assert!((mean / expected - 1.0).abs() < 1e-4, "{mean} {expected}");
        let strain = DrivenStator::of(&solved).unwrap().both[0].strain;
        let frequencies = [solved.figures.b.frequency_hz, solved.figures.c.frequency_hz];
        for mode in 0..2 {
            let (own, other) = (solved.measured[mode], solved.measured[1 - mode]);
            let ratio = frequencies[mode] / frequencies[1 - mode];
            let foreign = 2.0 * other.damping_ratio * other.tooth_amplitude_m / (1.0 - ratio * ratio).abs();
            let found = swept(&modes, 0, strain, frequencies[mode]);
            // Teeth that are not quite equal: a hundredth.
            let allowed = foreign + 0.01 * own.tooth_amplitude_m;
            assert!((found - own.tooth_amplitude_m).abs() < allowed, "{found} {own:?} {allowed}");
        }
    }
}
