//! What the emulated program printed: `compiler` and the compiler's name, then `operation samples total max` a line.

use std::collections::HashSet;

use simulation::math::count::real;

/// Instructions of one operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OperationCount {
    /// Name of the operation: small letters, digits, `_` and `.`.
    pub operation: String,
    /// Number of samples, at least one.
    pub samples: u32,
    /// Instructions of all samples.
    pub total: u64,
    /// Instructions of the longest.
    pub max: u32,
}

impl OperationCount {
    /// Mean of the samples.
    pub fn mean(&self) -> f64 {
        real(self.total) / f64::from(self.samples)
    }
}

/// A whole listing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listing {
    /// The compiler that built the program, as `rustc --version` names it.
    pub compiler: String,
    /// The counts, each operation once.
    pub counts: Vec<OperationCount>,
}

/// Why a listing is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ListingError {
    /// The first line does not name the compiler.
    #[error("line 1 does not name the compiler")]
    NoCompiler,
    /// A line is not of the form `operation samples total max`, has numbers that contradict each other (no samples, or
    /// a longest sample above the total or below the mean), or repeats an operation.
    #[error("line {line} is not `operation samples total max` of another operation")]
    Malformed {
        /// Line, from 1.
        line: usize,
    },
    /// An operation that is needed does not come.
    #[error("{operation} is missing")]
    Missing {
        /// The operation.
        operation: String,
    },
    /// Loops whose lengths are known were counted wrongly.
    #[error("9000 turns of a loop of two instructions were counted as {counted} instead of 18000")]
    Miscounted {
        /// The difference of both loops.
        counted: i64,
    },
}

impl Listing {
    /// Reads `text`.
    ///
    /// # Errors
    /// At the first line that is not as it should be.
    pub fn parse(text: &str) -> Result<Self, ListingError> {
        let mut lines = text.lines().enumerate();
        let compiler = lines
            .next()
            .and_then(|(_, line)| line.strip_prefix("compiler "))
            .filter(|compiler| !compiler.trim().is_empty() && !compiler.contains(char::is_control))
            .ok_or(ListingError::NoCompiler)?;
        let mut seen = HashSet::new();
        let counts = lines
            .map(|(index, line)| {
                let new = count(line).filter(|count| seen.insert(count.operation.clone()));
                new.ok_or(ListingError::Malformed { line: index + 1 })
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { compiler: compiler.to_owned(), counts })
    }

    /// The count of one operation, if there is one.
    pub fn find(&self, operation: &str) -> Option<&OperationCount> {
        self.counts.iter().find(|count| count.operation == operation)
    }

    /// The count of one operation.
    ///
    /// # Errors
    /// When there is none.
    pub fn count(&self, operation: &'static str) -> Result<&OperationCount, ListingError> {
        self.find(operation).ok_or_else(|| ListingError::Missing { operation: operation.to_owned() })
    }

    /// Checks the counter by loops of known length: 9,000 turns more are 18,000 instructions more, in every sample.
    ///
    /// # Errors
    /// When that is not what was counted.
    pub fn prove(&self) -> Result<(), ListingError> {
        let (short, long) = (self.count("loop_of_1000_turns")?, self.count("loop_of_10000_turns")?);
        let alike = |count: &OperationCount| u64::from(count.samples) * u64::from(count.max) == count.total;
        let counted = i64::from(long.max) - i64::from(short.max);
        if counted == 18_000 && alike(short) && alike(long) {
            Ok(())
        } else {
            Err(ListingError::Miscounted { counted })
        }
    }
}

/// The count of a line, unless it is malformed.
fn count(line: &str) -> Option<OperationCount> {
    let fields: Vec<&str> = line.split(' ').collect();
    let &[operation, samples, total, max] = fields.as_slice() else { return None };
    let of_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '.';
    let is_name = !operation.is_empty() && operation.chars().all(of_name);
    let (samples, total, max): (u32, u64, u32) =
        (samples.parse().ok()?, total.parse().ok()?, max.parse().ok()?);
    let possible = samples > 0 && u64::from(max) <= total && total <= u64::from(samples) * u64::from(max);
    (is_name && possible).then(|| OperationCount { operation: operation.to_owned(), samples, total, max })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LOOPS: &str =
        "compiler rustc 1.95.0\nloop_of_1000_turns 2 4014 2007\nloop_of_10000_turns 2 40014 20007\n";

    #[test]
    fn exact_a_listing() {
        let listing = Listing::parse(LOOPS).unwrap();
        assert_eq!(listing.compiler, "rustc 1.95.0");
        let count = listing.count("loop_of_1000_turns").unwrap();
        assert_eq!((count.samples, count.total, count.max), (2, 4014, 2007));
        assert!((count.mean() - 2007.0).abs() < 1e-9);
        assert_eq!(listing.count("tick"), Err(ListingError::Missing { operation: "tick".to_owned() }));
    }

    #[test]
    fn exact_refusals() {
        use ListingError::{Malformed, NoCompiler};
        for (text, expected) in [
            ("", NoCompiler),
            ("twin_digest 0x12\n", NoCompiler),
            ("compiler \n", NoCompiler),
            ("compiler r\n\n", Malformed { line: 2 }),
            ("compiler r\na 1 2\n", Malformed { line: 2 }),
            ("compiler r\na 1 2 2 2\n", Malformed { line: 2 }),
            ("compiler r\na 1  2\n", Malformed { line: 2 }),
            ("compiler r\na 1 2 -2\n", Malformed { line: 2 }),
            ("compiler r\nA 1 2 2\n", Malformed { line: 2 }),
            ("compiler r\na 1 2 4294967296\n", Malformed { line: 2 }),
            ("compiler r\na 0 0 0\n", Malformed { line: 2 }),
            ("compiler r\na 2 3 4\n", Malformed { line: 2 }),
            ("compiler r\na 2 9 4\n", Malformed { line: 2 }),
            ("compiler r\na 1 2 2\na 1 2 2\n", Malformed { line: 3 }),
        ] {
            assert_eq!(Listing::parse(text), Err(expected), "{text:?}");
        }
    }

    /// A timer that does not count instructions is detected.
    #[test]
    fn exact_proof_by_loops_of_known_length() {
        let of = |short: &str, long: &str| {
            let text = format!("compiler r\nloop_of_1000_turns {short}\nloop_of_10000_turns {long}\n");
            Listing::parse(&text).unwrap().prove()
        };
        assert_eq!(Listing::parse(LOOPS).unwrap().prove(), Ok(()));
        assert_eq!(of("1 2007 2007", "1 20006 20006"), Err(ListingError::Miscounted { counted: 17_999 }));
        // Right in its longest sample, wrong in another.
        assert_eq!(of("2 4013 2007", "2 40014 20007"), Err(ListingError::Miscounted { counted: 18_000 }));
        assert_eq!(
            Listing::parse("compiler r\n").unwrap().prove(),
            Err(ListingError::Missing { operation: "loop_of_1000_turns".to_owned() })
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

        /// The printed counts of any samples are read back unchanged.
        #[test]
        fn law_written_counts_are_read_back(
            samples in prop::collection::btree_map("[a-z0-9_.]{1,30}", prop::collection::vec(any::<u32>(), 1..9), 0..9)
        ) {
            let counts: Vec<OperationCount> = samples
                .into_iter()
                .map(|(operation, samples)| OperationCount {
                    operation,
                    samples: u32::try_from(samples.len()).unwrap(),
                    total: samples.iter().map(|&sample| u64::from(sample)).sum(),
                    max: samples.iter().copied().max().unwrap(),
                })
                .collect();
            let lines: Vec<String> = counts
                .iter()
                .map(|count| {
                    let OperationCount { operation, samples, total, max } = count;
                    format!("{operation} {samples} {total} {max}\n")
                })
                .collect();
            let text = format!("compiler rustc 1.95.0\n{}", lines.concat());
            prop_assert_eq!(Listing::parse(&text).unwrap().counts, counts);
        }

        /// Any text is refused, or its numbers are consistent.
        #[test]
        fn law_nothing_inconsistent_is_accepted(
            lines in prop::collection::vec(prop_oneof![8 => "[a-c]{1,2} [0-2] [0-3] [0-3]", 1 => "\\PC{0,12}"], 0..4),
            named in any::<bool>()
        ) {
            let head = if named { "compiler r\n" } else { "" };
            if let Ok(listing) = Listing::parse(&format!("{head}{}", lines.join("\n"))) {
                for count in &listing.counts {
                    prop_assert!(count.samples > 0 && count.mean() <= f64::from(count.max));
                    prop_assert_eq!(listing.counts.iter().filter(|c| c.operation == count.operation).count(), 1);
                }
            }
        }
    }
}
