//! What a sweep costs, by the time of some of its rows: before it is begun, and on how many machines.

use std::time::Instant;

use serde::Serialize;

use super::{SweepError, SweepPlan};
use crate::report::document::{Block, Document, Table};
use simulation::math::count::real;

/// Rows that are measured, at most; and time after which no further one is begun, in s.
const MEASURED_MAX: u64 = 16;
const MEASURING_S: f64 = 20.0;

/// Nodes of the clusters that a plan is made for.
const NODES: [u64; 3] = [1, 100, 1000];

/// What a sweep costs; JSON by its field names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepCost {
    /// Rows of the sweep.
    pub rows: u64,
    /// Rows that were measured, spread evenly over all.
    pub measured_rows: u64,
    /// Processors that each of them had.
    pub cpus: usize,
    /// Mean time of a row in s.
    pub row_s: f64,
}

impl SweepPlan {
    /// Measures rows that are spread evenly over all, each with so many processors.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn cost(&self, cpus: usize) -> Result<SweepCost, SweepError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(cpus).build();
        let pool = pool.map_err(|error| SweepError::Plan {
            why: format!("there are no {cpus} threads: {error}"),
            hint: "fewer --cpus",
        })?;
        let rows = self.rows();
        let count = rows.min(MEASURED_MAX);
        let (mut measured_rows, mut time_s) = (0, 0.0);
        let begun = Instant::now();
        while measured_rows < count && (measured_rows == 0 || begun.elapsed().as_secs_f64() < MEASURING_S) {
            let number = rows / count * measured_rows;
            time_s += pool.install(|| self.make(number)).time_s;
            measured_rows += 1;
        }
        Ok(SweepCost { rows, measured_rows, cpus, row_s: time_s / real(measured_rows) })
    }
}

impl SweepCost {
    /// Time of all rows on one processor after the other, in s.
    pub fn processor_s(&self) -> f64 {
        real(self.rows) * self.row_s * real(self.cpus)
    }

    /// Parts of about `part_s` each, `most` of them at most.
    pub fn parts(&self, part_s: f64, most: u64) -> u64 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
        let parts = (real(self.rows) * self.row_s / part_s).ceil() as u64;
        parts.clamp(1, most.min(self.rows).max(1))
    }

    /// For the terminal, with the time on clusters whose nodes have so many cores.
    pub fn document(&self, cores: u64) -> Document {
        let mut table = Table::new(&["nodes", "cores", "time"]);
        for nodes in NODES {
            // No more cores than rows have something to do.
            let busy = (nodes * cores).min(self.rows.saturating_mul(self.cpus as u64));
            let time = duration(self.processor_s() / real(busy));
            table.push(vec![nodes.to_string(), (nodes * cores).to_string(), time]);
        }
        Document {
            blocks: vec![
                Block::Heading(format!("Plan of a sweep, {} rows", self.rows)),
                Block::Paragraph(format!(
                    "A row takes {:.3e} s with {} processors: mean of {} rows, spread over all. All rows together \
                     take {} of one processor like those of this machine.",
                    self.row_s,
                    self.cpus,
                    self.measured_rows,
                    duration(self.processor_s())
                )),
                Block::Table(table),
            ],
        }
    }
}

/// A time in words.
fn duration(time_s: f64) -> String {
    let units = [(365.25 * 86_400.0, "years"), (86_400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s")];
    let unit = units.iter().find(|(length_s, _)| time_s >= 2.0 * length_s);
    unit.map_or_else(
        || format!("{time_s:.1e} s"),
        |(length_s, name)| format!("{:.1} {name}", time_s / length_s),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(rows: u64, row_s: f64, cpus: usize) -> SweepCost {
        SweepCost { rows, measured_rows: 1, cpus, row_s }
    }

    /// A thousand rows of 3 s in parts of 100 s are 30 parts; no more than rows, no more than the scheduler takes.
    #[test]
    fn exact_parts_have_the_time_that_they_are_given() {
        assert_eq!(cost(1000, 3.0, 1).parts(100.0, 1000), 30);
        assert_eq!(cost(1000, 3.0, 1).parts(99.0, 1000), 31);
        assert_eq!(cost(1000, 1e-9, 1).parts(100.0, 1000), 1);
        assert_eq!(cost(5, 1e9, 1).parts(100.0, 1000), 5);
        assert_eq!(cost(1_000_000, 1e3, 1).parts(100.0, 1000), 1000);
    }

    /// A million rows of 0.36 s on one core are 100 h, on 100 nodes of 4 cores 15 min; a core more than there are rows
    /// helps nothing.
    #[test]
    fn exact_times_on_clusters() {
        let text = cost(1_000_000, 0.36, 1).document(4).text();
        for words in ["4.2 days of", "100    400    15.0 min", "1000   4000   90.0 s"] {
            assert!(text.contains(words), "{text}");
        }
        let text = cost(1_000_000, 0.36, 4).document(4).text();
        assert!(text.contains("100    400    1.0 h") || text.contains("100    400    60.0 min"), "{text}");
        let text = cost(10, 60.0, 1).document(8).text();
        assert!(text.contains("1000   8000   60.0 s") && text.contains("1      8      75.0 s"), "{text}");
    }
}
