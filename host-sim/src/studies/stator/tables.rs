//! Tables of a stator and of an ensemble.

use stator::ensemble::Member;
use stator::modes::ModeFigures;

use super::SolvedStator;
use super::driven::DrivenStator;
use super::members::Ensemble;
use super::quantities::QUANTITIES;
use crate::report::document::{Block, Document};
use crate::report::key_figure::significant;
use crate::report::table::Table;

impl SolvedStator {
    /// A row for each mode.
    pub(super) fn mode_table(&self) -> Table {
        let f = &self.figures;
        let [t1, t2] = f.tilt;
        let mut table = Table::new(&[
            "mode",
            "frequency Hz",
            "modal mass mg",
            "over stator mass",
            "exponent at the teeth",
            "mode shift deg",
            "lever",
        ]);
        let mut row = |name: &str, mode: &ModeFigures, shift: f64, lever: f64| {
            table.push(vec![
                name.to_owned(),
                format!("{:.0}", mode.frequency_hz),
                format!("{:.2}", 1e6 * mode.modal_mass_kg),
                format!("{:.3}", mode.modal_mass_kg / f.stator_mass_kg),
                format!("{:.2}", mode.exponent),
                format!("{shift:.2}"),
                format!("{lever:.3}"),
            ]);
        };
        row("A", &f.a, f64::NAN, f64::NAN);
        row("tilt 1", &t1, f64::NAN, f64::NAN);
        row("tilt 2", &t2, f64::NAN, f64::NAN);
        row("B", &f.b, f.mode_shift_deg[0], f.lever[0]);
        row("C", &f.c, f.mode_shift_deg[1], f.lever[1]);
        table
    }

    /// What is said of the whole.
    pub(super) fn lines(&self) -> Vec<(&'static str, String)> {
        let (f, n) = (&self.figures, &self.drawing.numbers);
        let driven = DrivenStator::of(self).map(|driven| driven.lines(n.field_angle_deg));
        let lines = vec![
            (
                "modes about",
                if self.drawing.stressed { "the bonded state" } else { "the flat state" }.to_owned(),
            ),
            ("bow, inner over outer rim", format!("{:.1} um", 1e6 * f.bow_m)),
            ("stator mass", format!("{:.2} mg", 1e6 * f.stator_mass_kg)),
            ("effective tooth mass", format!("{:.2} mg", 1e6 * f.effective_tooth_mass_kg)),
            ("with the tilting modes", format!("{:.2} mg", 1e6 * f.effective_tooth_mass_with_tilt_kg)),
            ("thickness of the silicon", format!("{:.2} um", 1e6 * n.silicon_thickness_m)),
            ("half-angle of the springs", format!("{:.2} deg", n.spring_half_angle_deg)),
            ("stem of the springs", format!("{:.3} mm", 1e3 * n.spring_stem_m)),
            ("mesh", format!("{} nodes", self.solution.mesh.nodes.len())),
        ];
        lines.into_iter().chain(driven.into_iter().flatten()).collect()
    }

    /// Everything in words and tables.
    pub(super) fn document(&self) -> Document {
        let mut blocks = vec![Block::Heading("The stator by finite elements".to_owned())];
        if let Some(rounds) = self.fit_rounds {
            let said = format!(
                "Thickness and springs were fitted to the frequencies of A, B and C, in {rounds} solutions."
            );
            blocks.push(Block::Paragraph(said));
        }
        blocks.push(Block::Table(self.mode_table()));
        blocks.push(Block::Table(Table::of_lines(self.lines())));
        Document { blocks }
    }
}

impl Ensemble {
    /// Mean, standard deviation and range of each quantity.
    pub(super) fn table(&self) -> Table {
        let mut table = Table::new(&["quantity", "mean", "standard deviation", "least", "largest"]);
        for quantity in QUANTITIES {
            let (spread, (low, high)) = (self.spread(quantity), self.range(quantity));
            if !spread.mean.is_finite() {
                continue;
            }
            let name = if quantity.unit.is_empty() {
                quantity.name.to_owned()
            } else {
                format!("{}, {}", quantity.name, quantity.unit)
            };
            let cells = [spread.mean, spread.sd, low, high].map(significant);
            table.push(std::iter::once(name).chain(cells).collect());
        }
        table
    }

    pub(super) fn document(&self) -> Document {
        let (met, all) = (self.met().count(), self.members.len());
        let said = format!(
            "{met} of {all} stators drawn over what is not published meet the frequencies of A, B and C. Their spread \
             is what the drawing leaves open."
        );
        let mut blocks = vec![
            Block::Heading("Stators that meet the frequencies".to_owned()),
            Block::Paragraph(said),
            Block::Table(self.table()),
        ];
        let missed: Vec<&Member> = self.members.iter().filter(|member| !member.met).collect();
        if !missed.is_empty() {
            let mut table = Table::new(&["stator", "why it does not meet them"]);
            for member in missed {
                table.push(vec![member.number.to_string(), member.why.clone()]);
            }
            blocks.push(Block::Table(table));
        }
        Document { blocks }
    }
}
