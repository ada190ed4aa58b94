//! Rows of normalised squares, one mean for each motor: held to bounds on both sides, at one stated chance that any
//! row of a family is outside although the filter is consistent.
//!
//! A family is the rows of a test. [`FAMILY_WISE`] is shared evenly among its rows and, within a row, between the mean
//! over the motors and the motors one by one (Bonferroni; Holm's method rejects some row of a family if and only if
//! Bonferroni's does).
//!
//! | what | is | bounds |
//! |---|---|---|
//! | mean over the motors | 1 | of `chi^2_n / n`, `n` from the spread of the motors |
//! | the same of few independent errors | 1 | the same, `n` as given, times the number of motors |
//! | each motor | 1/2 to 2 | of `chi^2_n / n`, `n` as given, halved below and doubled above |
//!
//! [`Asked`] says where less than 1 is asked of the mean: then both bounds of a row are as much wider.
//!
//! `n` is the number of independent squares in the mean of one motor. That of a single motor does not come from the
//! spread of the motors: one motor whose errors are ten times what is said widens the bounds of the mean, and is
//! outside its own. A filter cannot know how this motor differs from its design, and process noise goes with the
//! square of the friction, 0.2 to 0.6 about 0.4: so the errors of one motor may be half or twice what is said, 1.4
//! times in standard deviations. Those of all motors together may not.

use host_sim::studies::filter_errors::consistency::mean_square_bounds;
use simulation::math::statistics::{Spread, chi_square_mean_bounds};

/// Chance that a consistent filter has any row of a family outside.
pub const FAMILY_WISE: f64 = 0.05;

/// How far the mean square of one motor may be from 1 by what no filter knows of it.
const OF_ONE_MOTOR: f64 = 2.0;

/// How far the mean of all motors may be below 1 where a filter may know its errors to be smaller than it says: a
/// standard deviation that is up to twice too large.
const WIDE: f64 = 4.0;

/// How far the mean of all motors may be from 1 where standard deviations need be right within a quarter.
const NEAR: (f64, f64) = (0.64, 1.5625);

/// What is asked of the mean of all motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// 1.
    Right,
    /// At most 1, and at least a quarter: surer than right is wrong, and so is a filter that says nothing.
    NotTooSure,
    /// 0.64 to 1.56: a standard deviation that is right within a quarter.
    Near,
}

/// One mean for each motor.
#[derive(Clone, Debug)]
pub struct Row {
    pub name: String,
    pub asked: Asked,
    pub means: Vec<f64>,
    /// Independent squares in the mean of one motor.
    pub independent: f64,
}

/// Errors that last as long as the run are one square in each, and those of a few runs do not show their spread.
const FEW: f64 = 2.0;

impl Row {
    fn mean(&self) -> f64 {
        self.means.iter().copied().collect::<Spread>().mean
    }

    fn motors(&self) -> f64 {
        self.means.iter().map(|_| 1.0).sum()
    }

    /// Bounds of the mean of all motors.
    pub fn bounds(&self, outside: f64) -> (f64, f64) {
        let (low, high) = if self.independent <= FEW {
            chi_square_mean_bounds(self.independent * self.motors(), outside)
        } else {
            mean_square_bounds(self.means.iter().copied(), outside)
        };
        match self.asked {
            Asked::Right => (low, high),
            Asked::NotTooSure => (low / WIDE, high),
            Asked::Near => (low * NEAR.0, high * NEAR.1),
        }
    }

    /// Bounds of the mean of one motor.
    fn bounds_of_one(&self, outside: f64) -> (f64, f64) {
        let (low, high) = chi_square_mean_bounds(self.independent, outside / self.motors());
        match self.asked {
            Asked::Right => (low / OF_ONE_MOTOR, high * OF_ONE_MOTOR),
            Asked::NotTooSure => (low / OF_ONE_MOTOR / WIDE, high * OF_ONE_MOTOR),
            Asked::Near => (low / OF_ONE_MOTOR * NEAR.0, high * OF_ONE_MOTOR * NEAR.1),
        }
    }

    /// What is outside, in words.
    fn complaint(&self, outside: f64) -> Option<String> {
        let (half, mean) = (0.5 * outside, self.mean());
        let (bounds, bounds_of_one) = (self.bounds(half), self.bounds_of_one(half));
        let far: Vec<String> = self
            .means
            .iter()
            .enumerate()
            .filter(|(_, mean)| !is_within(**mean, bounds_of_one))
            .map(|(motor, mean)| format!("motor {} has {mean:.2}, {bounds_of_one:.2?}", motor + 1))
            .collect();
        let fine = is_within(mean, bounds) && far.is_empty();
        (!fine).then(|| format!("{}: mean {mean:.4}, {bounds:.4?}; {}", self.name, far.join("; ")))
    }
}

fn is_within(value: f64, (low, high): (f64, f64)) -> bool {
    value >= low && value <= high
}

/// How many rows of a family with `rows_of_family` would be outside, had the filter said variances `factor` times as
/// large.
pub fn outside_if_variances_were(factor: f64, rows: &[Row], rows_of_family: usize) -> usize {
    let family: f64 = (0..rows_of_family).map(|_| 1.0).sum();
    let scaled =
        |row: &Row| Row { means: row.means.iter().map(|mean| mean / factor).collect(), ..row.clone() };
    rows.iter().map(scaled).filter(|row| row.complaint(FAMILY_WISE / family).is_some()).count()
}

/// A row that is known to be outside.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    pub family: &'static str,
    pub row: &'static str,
    /// Interval of the mean over the motors.
    pub mean: (f64, f64),
    pub cause: &'static str,
}

/// Asserts that no row of a family is outside, but those known, which are outside as far as is known.
#[track_caller]
pub fn assert_family_within(family: &str, rows: &[Row], known: &[Known]) {
    let rows_of_family: f64 = rows.iter().map(|_| 1.0).sum();
    let judge = |row: &Row| {
        let complaint = row.complaint(FAMILY_WISE / rows_of_family);
        match (complaint, known.iter().find(|known| known.family == family && known.row == row.name)) {
            (complaint, None) => complaint,
            (None, Some(_)) => Some(format!("{}: mended, no longer known to be outside", row.name)),
            (Some(complaint), Some(known)) => (!is_within(row.mean(), known.mean))
                .then(|| format!("{complaint}; known to be {:?}, {}", known.mean, known.cause)),
        }
    };
    let wrong: Vec<String> = rows.iter().filter_map(judge).collect();
    for Known { row, .. } in known.iter().filter(|known| known.family == family) {
        assert!(rows.iter().any(|of_family| of_family.name == *row), "no row {row:?}");
    }
    assert!(
        wrong.is_empty(),
        "{family}, {} of {} rows outside:\n{}",
        wrong.len(),
        rows.len(),
        wrong.join("\n")
    );
}

/// Nineteen motors whose errors squared are 0.8 of what is said and one with eleven times as much, over half a second:
/// the spread of all widens the bounds of the mean beyond it, and the one is outside its own.
#[test]
fn law_one_motor_far_off_is_outside() {
    let row = |last| {
        let means = (1..20).map(|motor| 0.8 + 0.02 * f64::from(motor % 5)).chain([last]).collect();
        Row { name: String::new(), asked: Asked::Right, means, independent: 80.0 }
    };
    assert_eq!(row(0.8).means.len(), 20);
    let (low, high) = row(11.0).bounds(FAMILY_WISE);
    assert!(is_within(row(11.0).mean(), (low, high)), "{low} {high}");
    assert!(
        row(11.0).complaint(FAMILY_WISE).is_some_and(|complaint| complaint.contains("motor 20 has 11.00"))
    );
    assert!(
        row(0.05).complaint(FAMILY_WISE).is_some_and(|complaint| complaint.contains("motor 20 has 0.05"))
    );
    let wide = Row { means: vec![1e-3; 20], asked: Asked::NotTooSure, ..row(0.8) };
    assert!(wide.complaint(FAMILY_WISE).is_some());
}

/// Right within a quarter: squares of 0.7 and 1.5 are, of 0.5 and 2 are not, where the spread is of some percent.
#[test]
fn law_near_is_a_quarter() {
    for (mean, is_near) in [(0.5, false), (0.7, true), (1.5, true), (2.0, false)] {
        let means = (0..20).map(|motor| mean * (1.0 + 0.01 * f64::from(motor % 5))).collect();
        let row = Row { name: String::new(), asked: Asked::Near, means, independent: 100.0 };
        assert_eq!(row.complaint(FAMILY_WISE).is_none(), is_near, "{mean}");
    }
}
