//! The places of the page of results.

use super::damping::{measured, sweep, thermoelastic};
use super::members::{Ensemble, QUANTITIES, Quantity};
use super::sweeps::{SweepEffort, Sweeps};
use super::{Solver, StatorStudyError};
use crate::report::chart::Figure;
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use simulation::scene::Scene;

/// What the page is made of.
#[derive(Clone, Debug)]
pub struct StatorPage {
    sweeps: Sweeps,
    flat: Ensemble,
}

fn named(name: &str) -> Quantity {
    QUANTITIES.into_iter().find(|quantity| quantity.name == name).unwrap_or(QUANTITIES[0])
}

/// By how many per cent `now` is above `before`.
fn percent(now: f64, before: f64) -> String {
    format!("{:+.1}", 100.0 * (now / before - 1.0))
}

impl StatorPage {
    /// Solves the default stator and its neighbours, and takes the ensemble that is kept.
    ///
    /// # Errors
    /// When CalculiX gives no result.
    pub fn run(effort: SweepEffort, solver: &Solver) -> Result<Self, StatorStudyError> {
        let sweeps = Sweeps::run(effort, solver)?;
        Ok(Self { sweeps, flat: Ensemble::kept()? })
    }

    /// Pictures with their files.
    pub fn pictures(&self) -> Vec<(String, Figure)> {
        let mut pictures = self.sweeps.pictures();
        pictures.push(("stator_ensemble.svg".to_owned(), self.flat.picture()));
        pictures.push(("stator_sweep.svg".to_owned(), sweep(&Scene::default())));
        pictures
    }

    /// Mean and standard deviation of a quantity over the ensemble.
    fn spread(&self, name: &str, digits: usize) -> String {
        let spread = self.flat.spread(named(name));
        format!("{:.digits$} +- {:.digits$}", spread.mean, spread.sd)
    }

    /// Every published figure of the paper's finite elements and vibrometer, with ours.
    fn paper_table(&self) -> String {
        let (flat, stressed) = (&self.sweeps.flat.figures, &self.sweeps.stressed.figures);
        let mut table = Table::new(&["what", "paper", "ensemble, flat", "default, with stress", "verdict"]);
        let mut row = |cells: [&str; 5]| table.push(cells.iter().map(|&cell| cell.to_owned()).collect());
        let change = |now: f64, before: f64| format!("{} %", percent(now, before));
        let (b, c) = (stressed.b.frequency_hz, stressed.c.frequency_hz);
        let both = format!("B {}, C {}", change(b, flat.b.frequency_hz), change(c, flat.c.frequency_hz));
        row(["change by stress", "raises them", "-", &both, "contradiction"]);
        let flat_bow = self.spread("bow", 0);
        row(["bow, um", "77, 70 measured", &flat_bow, &self.stressed_bow(), "agrees with 70"]);
        let order = "A, tilt, B, C";
        row(["order of the modes", order, order, order, "agrees"]);
        let [a, b, c] = [stressed.a, stressed.b, stressed.c].map(|mode| format!("{:.0}", mode.frequency_hz));
        let not_fitted = format!("{a}, {b}, {c}");
        row(["f of A, B, C, Hz", "2150, 6300, 7460", "fitted", &not_fitted, "met by a fit"]);
        let (tilt, tilt_stressed) =
            (self.spread("f of the lower tilt", 0), format!("{:.0}", stressed.tilt[0].frequency_hz));
        row(["f of the tilting modes, Hz", "between A and B", &tilt, &tilt_stressed, "agrees"]);
        row(["thickness, um", "70 +- 10", &self.thickness(), "-", "agrees with the foil"]);
        let mass = self.spread("stator mass", 1);
        row(["stator mass, mg", "10.7 +- 1.0", &mass, "-", "a tenth heavier"]);
        let tuned = "-2.5 to -3 tuned";
        let [shift_b, shift_c] = stressed.mode_shift_deg.map(|shift| format!("{shift:.1}"));
        row(["mode shift of B, deg", tuned, &self.spread("mode shift of B", 1), &shift_b, "same size"]);
        row(["mode shift of C, deg", tuned, &self.spread("mode shift of C", 1), &shift_c, "agrees"]);
        let ratios = |of: &stator::modes::StatorFigures| {
            format!("{:.2}, {:.2}", of.antinode_over_tooth[0], of.antinode_over_tooth[1])
        };
        row(["antinode over tooth", "1.22, 1.73", &ratios(flat), &ratios(stressed), "agrees within 15 %"]);
        let tooth = self.spread("effective tooth mass", 2);
        row(["effective tooth mass, mg", "3.57", &tooth, "-", "18 % heavier"]);
        row(["damping ratio of B and C", "0.0063, 0.0075", "-", "-", "not computed"]);
        row(["amplitude at the teeth, um", "20.72, 1.81", "-", "-", "not computed"]);
        table.markdown()
    }

    /// Silicon and foil together, um.
    fn thickness(&self) -> String {
        let total = Quantity {
            name: "total",
            unit: "um",
            of: |member| 1e6 * (member.silicon_thickness_m + member.foil_thickness_m),
        };
        let spread = self.flat.spread(total);
        format!("{:.0} +- {:.0}", spread.mean, spread.sd)
    }

    /// The bow of the default drawing with large deflections, um.
    fn stressed_bow(&self) -> String {
        format!("{:.0}", 1e6 * self.sweeps.stressed.figures.bow_m)
    }

    fn mesh_table(&self) -> String {
        let mut table = Table::new(&["longest edge, mm", "A", "tilt", "B", "C"]);
        let Some((_, finest)) = self.sweeps.mesh.last() else { return String::new() };
        for (size, f) in &self.sweeps.mesh {
            let cells = [
                percent(f.a.frequency_hz, finest.a.frequency_hz),
                percent(f.tilt[0].frequency_hz, finest.tilt[0].frequency_hz),
                percent(f.b.frequency_hz, finest.b.frequency_hz),
                percent(f.c.frequency_hz, finest.c.frequency_hz),
            ];
            table.push(std::iter::once(format!("{:.2}", 1e3 * size)).chain(cells).collect());
        }
        table.markdown()
    }

    /// What stands in the page.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let (flat, stressed) = (&self.sweeps.flat.figures, &self.sweeps.stressed.figures);
        let [b, _] = measured(&Scene::default());
        let thermal = thermoelastic(&self.sweeps.flat, flat.b.frequency_hz);
        let [ring, ring_stressed] = self.sweeps.free_ring_hz;
        vec![
            ("change_a", percent(stressed.a.frequency_hz, flat.a.frequency_hz)),
            ("change_tilt", percent(stressed.tilt[0].frequency_hz, flat.tilt[0].frequency_hz)),
            ("change_b", percent(stressed.b.frequency_hz, flat.b.frequency_hz)),
            ("change_c", percent(stressed.c.frequency_hz, flat.c.frequency_hz)),
            ("change_ring", percent(ring_stressed, ring)),
            ("tilt_flat", self.spread("f of the lower tilt", 0)),
            ("bow_flat", self.spread("bow", 0)),
            ("bow_stressed", self.stressed_bow()),
            ("exponent_b", self.spread("exponent of B", 2)),
            ("exponent_c", self.spread("exponent of C", 2)),
            ("members", self.flat.met().count().to_string()),
            ("shift_b_toothless", format!("{:.3}", self.sweeps.toothless.mode_shift_deg[0].abs())),
            ("shift_c_toothless", format!("{:.3}", self.sweeps.toothless.mode_shift_deg[1].abs())),
            ("shift_b", format!("{:.1}", flat.mode_shift_deg[0])),
            ("shift_c", format!("{:.1}", flat.mode_shift_deg[1])),
            ("thermoelastic", format!("{thermal:.1e}")),
            ("damping_b", format!("{}", b.damping_ratio)),
            ("damping_factor", format!("{:.0}", b.damping_ratio / thermal)),
            ("table_paper", self.paper_table()),
            ("table_modes", self.sweeps.flat.mode_table().markdown()),
            ("table_stressed_modes", self.sweeps.stressed.mode_table().markdown()),
            ("table_ensemble", self.flat.table().markdown()),
            ("table_mesh", self.mesh_table()),
        ]
    }
}
