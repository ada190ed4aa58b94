//! Whether the twin learns the motor, and knows how well: what it says of the parameters beside those of drawn motors,
//! and the innovations of gap and approach from which it learns.
//!
//! The square of a parameter's error per its variance is one number a motor, and motors are independent: over `n`
//! motors its mean is `chi^2_n / n`. The rows are held to bounds on both sides at one chance for all of them
//! ([`crate::support::consistency_rows`]).
//!
//! The twin is too sure of most parameters. They are constant, and it takes the errors of a thousand impacts for
//! independent of each other. A twin that is told parts of the truth (`analysis::filter_errors::told`) shows which are
//! not. Nobody reads these variances but the filter itself. So the rows of [`TOO_SURE`] may be too sure by as much as
//! stands there, and [`law_what_the_twin_says_it_has_learnt_it_has`] bounds the errors themselves.

use estimator::LEARNT;

use crate::support::consistency_rows::{Asked, Known, Row, assert_family_within, outside_if_variances_were};
use crate::support::watched_twin::{Judged, REVERSALS, STEADY, WatchedTwin};

/// Told the jumps at impacts, the twin is consistent in these parameters.
const JUMPS: &str = "errors of the jumps at impacts that the twin takes for independent";
/// Told the impacts that the vibrometer does not detect, the twin is consistent in these.
const SMALL: &str = "impacts below the vibrometer's noise, whose recoil the twin does not know";
/// Told both, the twin is consistent in this.
const BOTH: &str = "errors of the jumps, and impacts below the vibrometer's noise";
/// Told both, it is not: 2.1 and 2.6 remain. In motors like their design 1.2 and 2.7 do.
const NOT_FOUND: &str = "not found";
/// The phase of two motors is off by 0.8 rad, with 0.06 rad said; without them 1.7 remains of 5.2.
const RESTARTED: &str =
    "a restart of the stator keeps a phase that went astray, with the variance of the prior";
/// `twin/rotor.rs`: it differs by a percent between the modes.
const OF_OTHERS: &str = "it takes up what other parameters leave of the teeth's tangential velocity";

/// Parameters of whose errors the twin is too sure: the row, how many times too small a standard deviation may be, and
/// why.
const TOO_SURE: [(&str, f64, &str); 21] = [
    ("stiffness of A, c after b", 2.0, JUMPS),
    ("stiffness of B, c after b", 2.0, NOT_FOUND),
    ("damping of B, c after b", 2.0, NOT_FOUND),
    ("amplitude of B, c after b", 4.0, SMALL),
    ("amplitude of C, c after b", 2.0, BOTH),
    ("mass ratio, c after b", 2.0, JUMPS),
    ("restitution, c after b", 2.0, JUMPS),
    ("first pair, c after b", 2.0, SMALL),
    ("second pair, c after b", 2.0, SMALL),
    ("tooth angle, c after b", 2.0, JUMPS),
    ("tooth factor, c after b", 20.0, OF_OTHERS),
    ("drive phase, c after b", 4.0, RESTARTED),
    ("stiffness of A, b after c", 2.0, JUMPS),
    ("damping of B, b after c", 2.0, JUMPS),
    ("amplitude of B, b after c", 2.0, JUMPS),
    ("mass ratio, b after c", 2.0, JUMPS),
    ("restitution, b after c", 2.0, JUMPS),
    ("first pair, b after c", 2.0, JUMPS),
    ("second pair, b after c", 2.0, JUMPS),
    ("tooth factor, b after c", 20.0, OF_OTHERS),
    ("drive phase, b after c", 2.0, JUMPS),
];

/// Every parameter after 0.8 s, of which one mode was driven for 0.3 s, then the other.
fn rows_of_parameters() -> Vec<Row> {
    let of_drives = |(drives, of_motors): &(&str, Vec<WatchedTwin>)| {
        let row = |place: usize| {
            let judged: Vec<Judged> = of_motors.iter().map(|motor| motor.learnt[place]).collect();
            let means = judged.iter().map(Judged::normalised).collect();
            let name = format!("{}, {drives}", judged[0].name);
            Row { name, asked: Asked::Right, means, independent: 1.0 }
        };
        (0..=LEARNT).map(row).collect::<Vec<Row>>()
    };
    REVERSALS.iter().flat_map(of_drives).collect()
}

/// What the twin says of its parameters is as wrong as it says, in those not known to be worse; and that would show if
/// standard deviations were twice or half of what is said.
#[test]
fn law_errors_of_the_parameters_are_as_large_as_said() {
    let rows = rows_of_parameters();
    assert_eq!(rows.len(), 2 * (LEARNT + 1));
    let known = TOO_SURE.map(|(row, times, cause)| Known {
        family: "parameters",
        row,
        mean: (1.0, times * times),
        cause,
    });
    assert_family_within("parameters", &rows, &known);
    let is_known = |row: &Row| TOO_SURE.iter().any(|(name, ..)| *name == row.name);
    let right: Vec<Row> = rows.iter().filter(|row| !is_known(row)).cloned().collect();
    for factor in [4.0, 0.25] {
        let outside = outside_if_variances_were(factor, &right, rows.len());
        assert_eq!(outside, right.len(), "{factor}");
    }
}

/// A parameter counts as learnt if its standard deviation and its error are at most half of what they were. After both
/// modes have been driven the twin says so of each, and so it is, in the root mean square over the motors.
#[test]
fn law_what_the_twin_says_it_has_learnt_it_has() {
    for (drives, of_motors) in &*REVERSALS {
        for place in 0..LEARNT {
            let sum =
                |of: fn(&Judged) -> f64| of_motors.iter().map(|motor| of(&motor.learnt[place])).sum::<f64>();
            let name = of_motors[0].learnt[place].name;
            let (said, before) =
                (sum(|judged| judged.learnt.variance), sum(|judged| judged.learnt.prior_variance));
            assert!(said <= 0.25 * before, "{name}, {drives}: variance {said:e} of {before:e}");
            let (error, truth) = (sum(Judged::error_squared), sum(|judged| judged.truth * judged.truth));
            assert!(error <= 0.25 * truth, "{name}, {drives}: square of the error {error:e} of {truth:e}");
        }
    }
}

/// Of the amplitude of a mode that was not driven nothing is known: in no motor does the twin say that it has learnt a
/// hundredth of it, and it stays with the design.
#[test]
fn law_nothing_is_learnt_of_a_drive_that_was_off() {
    for ((_, of_motors), undriven) in STEADY.iter().zip(["amplitude of C", "amplitude of B"]) {
        for motor in of_motors {
            let judged = motor.learnt.iter().find(|judged| judged.name == undriven).expect("a parameter");
            let learnt = judged.learnt;
            assert!(learnt.variance >= 0.99 * learnt.prior_variance, "{undriven}: {learnt:?}");
            assert!(
                learnt.estimate * learnt.estimate <= 0.01 * learnt.prior_variance,
                "{undriven}: {learnt:?}"
            );
        }
    }
}

/// Least number of impacts that the twin explains in 50 ms, and in longer parts of a run.
const IMPACTS: [f64; 2] = [20.0, 100.0];

/// Standard deviations of gap and approach that are wrong by this factor are outside in half of the rows.
const SHARP: f64 = 1.6;

/// The standard deviations of gap and approach are right within a quarter in every phase: they weigh an impact against
/// all others, and need not be righter. What follows from them for angle and rate is judged by `law_consistency`.
///
/// Nearest to the bounds are the gap in the spin-up of mode B, 1.57 (with a twentieth of the vibrometer's noise 0.9),
/// the approach in steady mode B, 0.74 (one tuned noise serves both modes), and both in mode C, up to 1.3 (where the
/// twin is told the impacts that the vibrometer does not detect, 0.95 to 1.1). Impacts that were not used are left out.
#[test]
fn law_gap_and_approach_are_as_far_off_as_said() {
    let phases = [
        ("spin-up", &STEADY, 0, IMPACTS[1]),
        ("steady", &STEADY, 1, IMPACTS[1]),
        ("first 50 ms", &REVERSALS, 1, IMPACTS[0]),
        ("later", &REVERSALS, 2, IMPACTS[1]),
    ];
    let mut rows = Vec::new();
    for (phase, runs, part, independent) in phases {
        for ((drives, of_motors), (place, kind)) in
            runs.iter().flat_map(|run| [(run, (0, "gap")), (run, (1, "approach"))])
        {
            let mean = |motor: &WatchedTwin| motor.parts[part].contact_innovations()[place].0;
            let means = of_motors.iter().map(mean).collect();
            rows.push(Row {
                name: format!("{kind}, {drives}, {phase}"),
                asked: Asked::Near,
                means,
                independent,
            });
        }
    }
    assert_eq!(rows.len(), 16);
    assert_family_within("contacts", &rows, &[]);
    for factor in [SHARP * SHARP, 1.0 / (SHARP * SHARP)] {
        let outside = outside_if_variances_were(factor, &rows, rows.len());
        assert!(outside >= rows.len() / 2, "{factor}: {outside}");
    }
}
