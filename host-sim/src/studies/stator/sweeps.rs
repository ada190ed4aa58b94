//! One stator with one value changed at a time: thickness, stem, mesh, stress, teeth.

use stator::fit::FITTED_KEYS;
use stator::modes::StatorFigures;
use stator::solver::Solver;
use stator::{Drawing, Springs};

use super::members::{Ensemble, solve_each};
use super::{SolvedStator, StatorStudyError};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::statistics::Spread;

/// How much is solved.
#[derive(Clone, Copy, Debug)]
pub struct SweepEffort {
    /// Factors of thickness and stem.
    pub factors: &'static [f64],
    /// Sizes of the mesh, m, the finest last.
    pub meshes_m: &'static [f64],
    /// Mesh of everything else, m.
    pub mesh_m: f64,
}

/// A mode in a picture: its name, its colour and its frequency in Hz.
type DrawnMode = (&'static str, Colour, fn(&StatorFigures) -> f64);

/// The modes of a picture.
const DRAWN_MODES: [DrawnMode; 4] = [
    ("A", Colour::Green, |f| f.a.frequency_hz),
    ("tilt", Colour::Purple, |f| f.tilt[0].frequency_hz),
    ("B", Colour::Vermilion, |f| f.b.frequency_hz),
    ("C", Colour::Blue, |f| f.c.frequency_hz),
];

impl SweepEffort {
    /// Enough points for a line.
    pub const FULL: Self = Self {
        factors: &[0.8, 0.9, 1.0, 1.1, 1.2],
        meshes_m: &[0.8e-3, 0.6e-3, 0.5e-3, 0.4e-3, 0.3e-3, 0.2e-3],
        mesh_m: 0.4e-3,
    };
    /// Enough to fill every place.
    pub const QUICK: Self = Self { factors: &[0.9, 1.1], meshes_m: &[1.2e-3, 0.9e-3], mesh_m: 0.9e-3 };
}

/// The default stator and its neighbours.
#[derive(Clone, Debug)]
pub struct Sweeps {
    /// As it is, flat.
    pub flat: SolvedStator,
    /// The same drawing with the stress of bonding.
    pub stressed: SolvedStator,
    /// The same, with silicon as thick as that of the kept stators with the stress of bonding: they meet the
    /// frequencies.
    pub thicker: SolvedStator,
    /// Without teeth.
    pub toothless: StatorFigures,
    /// The ring alone, free: frequencies of its two lowest modes of order 2, flat and stressed, in Hz.
    pub free_ring_hz: [f64; 2],
    /// Value, m, and figures.
    pub thickness: Vec<(f64, StatorFigures)>,
    /// Value, m, and figures.
    pub stem: Vec<(f64, StatorFigures)>,
    /// Size, m, and figures.
    pub mesh: Vec<(f64, StatorFigures)>,
}

/// `drawing` with `key` at `value`.
fn with(drawing: &Drawing, key: &str, value: f64) -> Drawing {
    let mut changed = *drawing;
    if let Some(number) = changed.numbers.value_mut(key) {
        *number = value;
    }
    changed
}

/// Mean thickness of the silicon of the kept stators with the stress of bonding, m.
fn stressed_silicon_m() -> Result<f64, StatorStudyError> {
    let kept = Ensemble::kept(true)?;
    let spread: Spread = kept.met().map(|member| member.silicon_thickness_m).collect();
    Ok(spread.mean)
}

impl Sweeps {
    /// Solves all of them.
    ///
    /// # Errors
    /// When CalculiX gives no result.
    pub fn run(effort: SweepEffort, solver: &Solver) -> Result<Self, StatorStudyError> {
        let drawing = with(&Drawing::default(), "stator.mesh_size_m", effort.mesh_m);
        let along =
            |key: &'static str, values: &[f64]| -> Result<Vec<(f64, StatorFigures)>, StatorStudyError> {
                let drawings: Vec<Drawing> = values.iter().map(|value| with(&drawing, key, *value)).collect();
                Ok(values.iter().copied().zip(solve_each(&drawings, solver)?).collect())
            };
        let n = &drawing.numbers;
        let times = |value: f64| effort.factors.iter().map(|factor| factor * value).collect::<Vec<f64>>();
        let ring = |stressed| -> Result<f64, StatorStudyError> {
            let mut ring = with(&drawing, "stator.tooth_radial_m", 0.0);
            (ring.springs, ring.clamp, ring.stressed) = (Springs::None, stator::Clamp::Nothing, stressed);
            let solution = stator::solution::Solution::of(&ring, solver)?;
            let lowest = solution.modes.iter().find(|mode| mode.order == 2);
            Ok(lowest.map_or(f64::NAN, |mode| mode.frequency_hz))
        };
        let stressed = Drawing { stressed: true, ..drawing };
        let silicon_m = stressed_silicon_m()?;
        Ok(Self {
            flat: SolvedStator::as_drawn(&drawing, solver)?,
            stressed: SolvedStator::as_drawn(&stressed, solver)?,
            thicker: SolvedStator::as_drawn(&with(&stressed, FITTED_KEYS[0], silicon_m), solver)?,
            toothless: StatorFigures::of(&with(&drawing, "stator.tooth_radial_m", 0.0), solver)?,
            free_ring_hz: [ring(false)?, ring(true)?],
            thickness: along(FITTED_KEYS[0], &times(n.silicon_thickness_m))?,
            stem: along(FITTED_KEYS[2], &times(n.spring_stem_m))?,
            mesh: along("stator.mesh_size_m", effort.meshes_m)?,
        })
    }

    /// Pictures with their files.
    pub fn pictures(&self) -> Vec<(String, Figure)> {
        vec![
            ("stator_modes.svg".to_owned(), self.flat.shapes()),
            ("stator_bow.svg".to_owned(), self.bow()),
            ("stator_sweeps.svg".to_owned(), self.dependence()),
            ("stator_mesh.svg".to_owned(), self.convergence()),
        ]
    }

    /// Height over the outer rim along the radius.
    fn bow(&self) -> Figure {
        let profile = |solved: &SolvedStator| -> Vec<(f64, f64)> {
            let heights = solved.solution.cooled_profile();
            let rim = heights.last().map_or(0.0, |(_, height)| *height);
            heights.into_iter().map(|(r, height)| (1e3 * r, 1e6 * (height - rim))).collect()
        };
        let inner = 1e3 * self.flat.drawing.numbers.inner_radius_m;
        let panel =
            Panel::new("Mean height around the ring", Axis::new("radius (mm)"), Axis::new("height (um)"))
                .series(Series::line(profile(&self.flat)).colour(Colour::Blue).label("linear"))
                .series(
                    Series::line(profile(&self.stressed)).colour(Colour::Vermilion).label("large deflection"),
                )
                .series(
                    Series::points(vec![(inner, 70.0)])
                        .colour(Colour::Black)
                        .label("paper, measured")
                        .width(3.5),
                )
                .series(
                    Series::points(vec![(inner, 77.0)])
                        .colour(Colour::Grey)
                        .label("paper, computed")
                        .width(3.5),
                );
        Figure::new("Bow of the stator after bonding").panel(panel)
    }

    fn lines(panel: Panel, points: &[(f64, StatorFigures)], scale: f64) -> Panel {
        let mut panel = panel;
        for (name, colour, of) in DRAWN_MODES {
            let line: Vec<(f64, f64)> =
                points.iter().map(|(value, f)| (scale * value, 1e-3 * of(f))).collect();
            panel = panel.series(Series::line(line.clone()).colour(colour).label(name));
            panel = panel.series(Series::points(line).colour(colour).width(2.2));
        }
        panel
    }

    fn dependence(&self) -> Figure {
        let panel =
            |title, label| Panel::new(title, Axis::new(label), Axis::new("frequency (kHz)")).height(280);
        let thickness = panel("Against the thickness of the silicon", "thickness (um)");
        let stem = panel("Against the stem of the springs", "length (mm)");
        Figure::new("What decides the frequencies")
            .panel(Self::lines(thickness, &self.thickness, 1e6))
            .panel(Self::lines(stem, &self.stem, 1e3))
    }

    /// By how much each size of the mesh is above the finest.
    fn convergence(&self) -> Figure {
        let Some((_, finest)) = self.mesh.last() else { return Figure::new("No meshes") };
        let axis = Axis::new("longest edge of a brick (mm)");
        let mut panel =
            Panel::new("Frequency over that of the finest mesh", axis, Axis::new("difference (%)"));
        for (name, colour, of) in DRAWN_MODES {
            let mut line: Vec<(f64, f64)> =
                self.mesh.iter().map(|(size, f)| (1e3 * size, 100.0 * (of(f) / of(finest) - 1.0))).collect();
            line.reverse();
            panel = panel.series(Series::line(line).colour(colour).label(name));
        }
        Figure::new("Convergence with the mesh").panel(panel)
    }
}
