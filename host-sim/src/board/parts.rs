//! Which filter fits which part: flash, RAM, and the work of a tick.
//!
//! ```text
//! instructions in a tick = f 10 us     at one a cycle of f
//! ```
//!
//! A filter fits where the program with all filters and its own stack have room, and where the program is never further
//! behind than the longest latency of a loop ([`controller::LATENCY_TICKS_MAX`]). Instructions are those of a
//! Cortex-M4F, of the whole program: the timer's interrupt, the loop and the line. On a slow part the loop decides in
//! one of eight ticks ([`controller::LoopTiming`]). There may be a part that no filter fits.

use std::fmt;

use controller::LATENCY_TICKS_MAX;
use serde::Serialize;

use crate::board::instructions::{CountReport, ListingError};
use crate::board::size::{ProgramSize, SizeReport};
use crate::report::files::json_line;
use crate::report::page::PlacedValue;
use crate::report::table::Table;
use simulation::math::count::real;

/// A microcontroller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Part {
    /// Its name.
    pub name: &'static str,
    /// Its processor.
    pub processor: &'static str,
    /// The processor's clock, in MHz.
    pub clock_mhz: u32,
    /// Flash for a program.
    pub flash_bytes: u64,
    /// RAM for variables and stack: that which the processor reaches without a wait.
    pub ram_bytes: u64,
    /// The scene of the gallery with its filter and timing; where no filter fits, with the simplest one.
    pub scene: &'static str,
    /// Ticks from one decision of its loop to the next: that of the scene.
    pub decision_ticks: u32,
}

/// The parts: those that firmware is written for, without the 8 KiB of the first that keep a description, and one with
/// its flash in another chip, as on a Pico 2.
pub const PARTS: [Part; 3] = [
    Part {
        name: "STM32G474RE",
        processor: "Cortex-M4F",
        clock_mhz: 170,
        flash_bytes: 504 * 1024,
        ram_bytes: 80 * 1024,
        scene: "stm32g474",
        decision_ticks: 8,
    },
    Part {
        name: "STM32H743ZI",
        processor: "Cortex-M7",
        clock_mhz: 480,
        flash_bytes: 2048 * 1024,
        ram_bytes: 128 * 1024,
        scene: "stm32h743",
        decision_ticks: 1,
    },
    Part {
        name: "RP2350",
        processor: "Cortex-M33",
        clock_mhz: 150,
        flash_bytes: 4096 * 1024,
        ram_bytes: 520 * 1024,
        scene: "rp2350",
        decision_ticks: 8,
    },
];

impl Part {
    /// Instructions that the program has in a tick of 10 us.
    pub const fn per_tick(&self) -> u32 {
        10 * self.clock_mhz
    }

    /// The name in a listing of what is counted as `tick` where each tick decides.
    pub fn counted(&self, tick: &str) -> String {
        match self.decision_ticks {
            1 => tick.to_owned(),
            ticks => format!("{tick}_every_{ticks}"),
        }
    }
}

/// A filter on a part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The part.
    pub part: Part,
    /// The filter.
    pub filter: &'static str,
    /// Flash of the program with all filters.
    pub flash_bytes: u64,
    /// Its variables, and the stack of a move by the filter.
    pub ram_bytes: u64,
    /// Instructions that the program has in a tick.
    pub per_tick: u32,
    /// Instructions of a tick of the program on average.
    pub mean: f64,
    /// Ticks that the program is behind at most: the least `board.latency_ticks`.
    pub latency_ticks: u32,
}

impl Fit {
    /// Why it does not fit; nothing where it does.
    pub fn lacks(&self) -> Vec<&'static str> {
        let Self { part, flash_bytes, ram_bytes, latency_ticks, .. } = self;
        let lacks = [
            (*flash_bytes > part.flash_bytes, "flash"),
            (*ram_bytes > part.ram_bytes, "RAM"),
            (*latency_ticks as usize > LATENCY_TICKS_MAX, "time"),
        ];
        lacks.into_iter().filter_map(|(lacks, what)| lacks.then_some(what)).collect()
    }
}

/// The filters on all parts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartsReport {
    /// Part by part, the simplest filter first.
    pub fits: Vec<Fit>,
    /// The programs that were measured.
    pub programs: Vec<ProgramSize>,
}

/// The filters, and their ticks in a listing.
const TICKS: [(&str, &str); 3] = [
    ("constant_rate", "program_tick"),
    ("impact_aided", "program_tick_impact_aided"),
    ("twin", "program_tick_twin"),
];

impl PartsReport {
    /// By the counts of a Cortex-M4F and the sizes of the programs.
    ///
    /// # Errors
    /// When a count, or the program with all filters, is missing.
    pub fn new(counts: &CountReport, sizes: SizeReport) -> Result<Self, ListingError> {
        let missing = |operation: &str| ListingError::Missing { operation: operation.to_owned() };
        let program = |program: &&ProgramSize| program.program == "board" && program.only.is_none();
        let program = sizes.programs.iter().find(program).ok_or_else(|| missing("board"))?;
        let fit = |part: Part, filter: &'static str, tick: &str| {
            let count = |operation: &str| counts.count(operation).ok_or_else(|| missing(operation));
            let (per_tick, tick) = (part.per_tick(), part.counted(tick));
            let stack = program.stacks.iter().find(|stack| stack.filter == filter);
            let stack = stack.ok_or_else(|| missing(filter))?;
            Ok(Fit {
                part,
                filter,
                flash_bytes: program.flash_bytes,
                ram_bytes: program.static_bytes + u64::from(stack.bytes),
                per_tick,
                mean: count(&tick)?.mean(),
                latency_ticks: count(&format!("{tick}_latency_at_{per_tick}"))?.max,
            })
        };
        let all = PARTS.into_iter().flat_map(|part| TICKS.map(|(filter, tick)| fit(part, filter, tick)));
        let fits = all.collect::<Result<_, _>>()?;
        Ok(Self { fits, programs: sizes.programs })
    }

    /// The best filter that fits `part`, if one does: the last of those that fit.
    pub fn best(&self, part: &Part) -> Option<&Fit> {
        self.fits.iter().rfind(|fit| fit.part == *part && fit.lacks().is_empty())
    }

    /// The parts that no filter fits, and how much of what they have in a tick the simplest filter takes.
    fn without(&self) -> String {
        let of_part = |part: &Part| {
            let simplest =
                self.fits.iter().find(|fit| fit.part == *part).filter(|_| self.best(part).is_none())?;
            let share = share(simplest.mean, f64::from(simplest.per_tick));
            Some(format!("No filter fits the {}: `{}` takes {share} of a tick.", part.name, simplest.filter))
        };
        PARTS.iter().filter_map(of_part).collect::<Vec<_>>().join(" ")
    }

    fn table(&self) -> Table {
        let mut table =
            Table::new(&["part", "decides in", "filter", "flash", "RAM", "tick, mean", "latency", ""]);
        for fit in &self.fits {
            let Fit { part, filter, flash_bytes, ram_bytes, per_tick, mean, latency_ticks } = fit;
            let lacks = fit.lacks();
            let is_best = self.best(part) == Some(fit);
            table.push(vec![
                format!("{}, {} MHz", part.name, part.clock_mhz),
                part.decision_ticks.to_string(),
                (*filter).to_owned(),
                share(real(*flash_bytes), real(part.flash_bytes)),
                share(real(*ram_bytes), real(part.ram_bytes)),
                share(*mean, f64::from(*per_tick)),
                latency_ticks.to_string(),
                match (lacks.is_empty(), is_best) {
                    (true, true) => format!("fits: --scene {}", part.scene),
                    (true, false) => "fits".to_owned(),
                    (false, _) => format!("no: {}", lacks.join(", ")),
                },
            ]);
        }
        table
    }

    /// The report as one JSON object on one line.
    pub fn json(&self) -> String {
        json_line(self)
    }

    /// The values of the page on the microcontroller that parts give.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        let without = self.without();
        let without =
            if without.is_empty() { "Each part has a filter that fits.".to_owned() } else { without };
        vec![("table_parts", self.table().markdown()), ("parts_without", without)]
    }
}

fn share(of: f64, all: f64) -> String {
    format!("{:.0} %", 100.0 * of / all)
}

impl fmt::Display for PartsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.table().text())?;
        let without = self.without();
        if without.is_empty() { Ok(()) } else { writeln!(f, "\n{without}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(filter: &'static str, latency_ticks: u32) -> Fit {
        let [part, ..] = PARTS;
        let (flash_bytes, ram_bytes) = (part.flash_bytes, part.ram_bytes);
        Fit { part, filter, flash_bytes, ram_bytes, per_tick: 1700, mean: 1000.0, latency_ticks }
    }

    /// A tick of 10 us at 170 MHz has 1700 cycles.
    #[test]
    fn exact_all_cycles_of_a_tick_are_the_program_s() {
        assert_eq!(PARTS.map(|part| part.per_tick()), [1700, 4800, 1500]);
    }

    /// All of what there is fits, and one more does not.
    #[test]
    fn exact_a_filter_fits_up_to_each_limit() {
        let full = fit("twin", 16);
        assert!(full.lacks().is_empty());
        for (over, lacks) in [
            (Fit { flash_bytes: full.flash_bytes + 1, ..full.clone() }, "flash"),
            (Fit { ram_bytes: full.ram_bytes + 1, ..full.clone() }, "RAM"),
            (Fit { latency_ticks: 17, ..full.clone() }, "time"),
        ] {
            assert_eq!(over.lacks(), [lacks]);
        }
    }

    /// A part whose filters all lack time is told, with what the simplest takes; one that has a filter is not.
    #[test]
    fn exact_a_part_that_no_filter_fits_is_told() {
        let [_, other, _] = PARTS;
        let late = Fit { mean: 2125.0, ..fit("constant_rate", 17) };
        let fits = vec![late, fit("twin", 18), Fit { part: other, ..fit("constant_rate", 17) }];
        let mut report = PartsReport { fits, programs: Vec::new() };
        report.fits.push(Fit { part: other, ..fit("twin", 16) });
        let expected = "No filter fits the STM32G474RE: `constant_rate` takes 125 % of a tick.";
        assert_eq!(report.without(), expected);
        assert!(report.to_string().ends_with(&format!("\n{expected}\n")), "{report}");
        report.fits.push(fit("twin", 1));
        assert_eq!(report.without(), "");
    }

    /// The last filter that fits, of that part alone.
    #[test]
    fn exact_the_best_filter_is_the_last_that_fits() {
        let [part, other, _] = PARTS;
        let report = PartsReport {
            fits: vec![
                fit("constant_rate", 3),
                fit("impact_aided", 16),
                fit("twin", 17),
                Fit { part: other, ..fit("twin", 1) },
            ],
            programs: Vec::new(),
        };
        assert_eq!(report.best(&part).map(|fit| fit.filter), Some("impact_aided"));
        assert_eq!(report.best(&other).map(|fit| fit.filter), Some("twin"));
        let text = report.to_string();
        let verdicts: Vec<&str> = text
            .lines()
            .filter_map(|line| line.split("MHz").nth(1)?.trim_end().rsplit("  ").next())
            .collect();
        assert_eq!(verdicts.len(), 4, "{text}");
        assert!(verdicts[0].ends_with("fits") && verdicts[1].ends_with("fits: --scene stm32g474"), "{text}");
        assert!(
            verdicts[2].ends_with("no: time") && verdicts[3].ends_with("fits: --scene stm32h743"),
            "{text}"
        );
    }
}
