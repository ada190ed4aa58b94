//! The places of the page of results.

use stator::ensemble::Member;

use super::damping::thermoelastic;
use super::driven::DrivenStator;
use super::free_response;
use super::members::Ensemble;
use super::quantities::named;
use super::sweeps::{SweepEffort, Sweeps};
use super::{Solver, StatorStudyError};
use crate::report::chart::Figure;
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use simulation::math::statistics::{Line, Spread};
use simulation::scene::Scene;

/// What the page is made of.
#[derive(Clone, Debug)]
pub struct StatorPage {
    sweeps: Sweeps,
    flat: Ensemble,
    stressed: Ensemble,
}

/// Mean and standard deviation of a quantity over an ensemble.
fn spread(ensemble: &Ensemble, name: &str, digits: usize) -> String {
    let spread = ensemble.spread(named(name));
    format!("{:.digits$} +- {:.digits$}", spread.mean, spread.sd)
}

/// A length in um.
fn micrometres(length_m: f64) -> String {
    format!("{:.0}", 1e6 * length_m)
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
        Ok(Self { sweeps, flat: Ensemble::kept(false)?, stressed: Ensemble::kept(true)? })
    }

    /// Pictures with their files.
    pub fn pictures(&self) -> Vec<(String, Figure)> {
        let mut pictures = self.sweeps.pictures();
        pictures.push(("stator_ensemble.svg".to_owned(), self.flat.picture()));
        let (solved, modes) = (&self.sweeps.flat, self.free_modes());
        pictures.push(("stator_sweep.svg".to_owned(), free_response::sweep(solved, &modes)));
        pictures.push(("stator_free_response.svg".to_owned(), free_response::picture(solved, &modes)));
        pictures
    }

    /// The modes of the default stator with the damping of the default scene.
    fn free_modes(&self) -> Vec<free_response::FreeMode> {
        free_response::free_modes(&self.sweeps.flat, &Scene::default())
    }

    /// Mean and standard deviation of a quantity over the flat ensemble.
    fn spread(&self, name: &str, digits: usize) -> String {
        spread(&self.flat, name, digits)
    }

    /// Every published figure of the paper's finite elements and vibrometer, with ours.
    fn paper_table(&self) -> String {
        let (flat, stressed) = (&self.sweeps.flat.figures, &self.sweeps.stressed.figures);
        let mut table = Table::new(&["what", "paper", "ensemble, flat", "ensemble, stressed", "verdict"]);
        let mut row = |cells: [&str; 5]| table.push(cells.iter().map(|&cell| cell.to_owned()).collect());
        let change = |now: f64, before: f64| format!("{} %", percent(now, before));
        let (b, c) = (stressed.b.frequency_hz, stressed.c.frequency_hz);
        let changes = format!("B {}, C {}", change(b, flat.b.frequency_hz), change(c, flat.c.frequency_hz));
        row(["change by stress, default", "raises them", "-", &changes, "contradiction"]);
        let mut both = |what: &str, paper: &str, name: &str, digits: usize, verdict: &str| {
            row([what, paper, &self.spread(name, digits), &spread(&self.stressed, name, digits), verdict]);
        };
        both("bow, um", "77, 70 measured", "bow", 0, "stressed near 70");
        both("f of the lower tilt, Hz", "between A and B", "f of the lower tilt", 0, "agrees");
        both("thickness with the foil, um", "70 +- 10", "thickness with the foil", 0, "flat agrees");
        both("stator mass, mg", "10.7 +- 1.0", "stator mass", 1, "10 to 17 % heavier");
        both("mode shift of B, deg", "-2.5 to -3 tuned", "mode shift of B", 1, "same size");
        both("mode shift of C, deg", "-2.5 to -3 tuned", "mode shift of C", 1, "agrees");
        both("effective tooth mass, mg", "3.57", "effective tooth mass", 2, "18 to 26 % heavier");
        let order = "A, tilt, B, C";
        row(["order of the modes", order, order, order, "agrees"]);
        row(["f of A, B, C, Hz", "2150, 6300, 7460", "fitted", "fitted", "met by a fit"]);
        let ratios = |ensemble: &Ensemble| {
            let mean = |of: fn(&Member) -> f64| ensemble.met().map(of).collect::<Spread>().mean;
            format!("{:.2}, {:.2}", mean(|m| m.antinode_over_tooth_b), mean(|m| m.antinode_over_tooth_c))
        };
        let [flat_ratios, stressed_ratios] = [&self.flat, &self.stressed].map(ratios);
        row([
            "antinode over tooth",
            "1.22, 1.73",
            &flat_ratios,
            &stressed_ratios,
            "C a tenth larger or more",
        ]);
        row(["damping ratio of B, C", "0.0063, 0.0075", "-", "-", "not computed"]);
        let strain = format!("at {} ppm", self.spread("strain of the foil", 1));
        row(["amplitude at the teeth, um", "20.72, 1.81", &strain, "-", "a strain that is likely"]);
        table.markdown()
    }

    /// How the bow of the stressed stators goes with the modulus of the foil: their correlation.
    fn bow_by_modulus(&self) -> String {
        let pairs: Vec<_> =
            self.stressed.met().map(|member| (member.foil_modulus_pa, member.bow_m)).collect();
        format!("{:.2}", Line::through(&pairs).map_or(f64::NAN, |line| line.correlation))
    }

    /// Modulus of the foil of the stressed stators, GPa.
    fn stressed_modulus(&self) -> String {
        let spread: Spread = self.stressed.met().map(|member| 1e-9 * member.foil_modulus_pa).collect();
        format!("{:.0} +- {:.0}", spread.mean, spread.sd)
    }

    /// Height of the outer rim above its lowest place, of the default drawing with stress, um.
    fn uneven_rim(&self) -> String {
        let rim = self.sweeps.stressed.solution.cooled_rim();
        let (low, high) = rim.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| {
            (low.min(height), high.max(height))
        });
        micrometres(high - low)
    }

    /// How the default stator is driven.
    fn field_lines(&self) -> String {
        let solved = &self.sweeps.flat;
        let Some(driven) = DrivenStator::of(solved) else { return String::new() };
        Table::of_lines(driven.lines(solved.drawing.numbers.field_angle_deg)).markdown()
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
        let [b, _] = self.sweeps.flat.measured;
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
            ("bow_stressed", micrometres(self.sweeps.stressed.figures.bow_m)),
            ("bow_thicker", micrometres(self.sweeps.thicker.figures.bow_m)),
            ("bow_by_modulus", self.bow_by_modulus()),
            ("modulus_stressed", self.stressed_modulus()),
            ("uneven_rim", self.uneven_rim()),
            ("exponent_b", self.spread("exponent of B", 2)),
            ("exponent_c", self.spread("exponent of C", 2)),
            ("force_b", self.spread("force on B", 2)),
            ("force_c", self.spread("force on C", 2)),
            ("best_field_b", self.spread("best field for B", 1)),
            ("best_field_c", self.spread("best field for C", 1)),
            ("field_one", self.spread("field of both amplitudes", 1)),
            ("field_other", self.spread("the other such field", 1)),
            ("strain", self.spread("strain of the foil", 1)),
            ("field_lines", self.field_lines()),
            ("table_free", free_response::table(&self.free_modes()).markdown()),
            ("stressed_members", self.stressed.met().count().to_string()),
            ("stressed_drawn", self.stressed.members.len().to_string()),
            ("tilt_stressed", spread(&self.stressed, "f of the lower tilt", 0)),
            ("exponent_b_stressed", spread(&self.stressed, "exponent of B", 2)),
            ("exponent_c_stressed", spread(&self.stressed, "exponent of C", 2)),
            ("bow_members", spread(&self.stressed, "bow", 0)),
            ("silicon_stressed", spread(&self.stressed, "thickness of the silicon", 0)),
            ("table_stressed_ensemble", self.stressed.table().markdown()),
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
