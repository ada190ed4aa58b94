//! A commissioned motor in tables and as JSON.

use std::fmt::Write as _;

use controller::response_map::Family;
use motor_model::DriveMode;
use serde::Serialize;
use simulation::runs::commission::CommissionedMotor;

use super::rows::{self, BurstRow, CruiseRow, ResonanceRow};
use super::{end_word, finding_word, sentence};
use crate::report::document::{Block, Document, Table};
use crate::report::files;

/// What the columns of the tables mean.
const ABOUT_RESONANCES: &str = "+- is one standard deviation, in every table. found: by the sweep; its deviation has \
    the part of the fit and the pull by the rotor, and - stands where the sweep shows no resonance. drive: \
    of the map, at the resonance found where it is not the design's beyond doubt. half width: of the curve, at half \
    power. chi2: chi-square per degree of freedom, 1 where the curve fits. true: of a motor that is \
    simulated.";
const ABOUT_FACTORS: &str = "factor: what this motor does per what the map foresees. rows: those that were measured. \
    chi2: of these rows about the factor, per degree of freedom; - stands for fewer than two. against the \
    map: what these rows contradict, its level (by 3.3 standard deviations) or its shape (at 1 %); all rows of such a \
    table are measured.";
const ABOUT_CRUISES: &str = "drive: mode and amplitude. map: rate in the map that it began with; its deviation is over \
    motors. measured: mean of the windows of this drive, and - where there was none. this motor: what stands in its \
    map, with how well it is known; - where the row is left out. coast: turn after the end of the drive per rate. \
    windows: of 50 ms, that were measured; back: those of them in which the rotor turned backwards. rest: from the end \
    of the drive until the rotor lies still.";
const ABOUT_BURSTS: &str = "ticks: of 10 us, with the drive on. map, measured, this motor, rest and -: as of the \
    cruises, of the turn of a burst in the direction of its mode. burst to burst: standard deviation of one burst \
    about the turn of this motor. trains: rows of equal bursts, that were measured.";

/// A commissioned motor for programs.
#[derive(Debug, Serialize)]
struct Commissioning {
    /// Seed of the motor; `null` of one that is not simulated.
    seed: Option<u64>,
    /// How it ended.
    end: &'static str,
    /// Motor time.
    time_s: f32,
    /// Why the motor is not fit for use; `null` if it is.
    unfit: Option<String>,
    resonances: Vec<ResonanceRow>,
    findings: Vec<FindingRow>,
    factors: Vec<FactorRow>,
    cruises: Vec<CruiseRow>,
    bursts: Vec<BurstRow>,
}

/// A finding.
#[derive(Debug, Serialize)]
pub(crate) struct FindingRow {
    /// "B" or "C".
    mode: String,
    /// What.
    what: &'static str,
}

/// The common factor of a table.
#[derive(Debug, Serialize)]
struct FactorRow {
    /// The table.
    of: String,
    /// Factor on the map that it began with.
    factor: f32,
    /// Its standard deviation.
    sd: f32,
    /// Rows that were measured.
    rows: u16,
    /// Chi-square per degree of freedom of the rows about the factor; `null` of fewer than two.
    reduced_chi_square: Option<f32>,
    /// Whether the rows contradict the level of that map.
    other_level: bool,
    /// Whether they contradict its shape.
    other_shape: bool,
}

/// The findings of a motor.
pub(crate) fn findings(motor: &CommissionedMotor) -> Vec<FindingRow> {
    let of = motor.commissioned.findings;
    of.iter()
        .map(|finding| FindingRow { mode: format!("{:?}", finding.mode), what: finding_word(finding.kind) })
        .collect()
}

fn factors(motor: &CommissionedMotor) -> Vec<FactorRow> {
    let factors = &motor.commissioned.factors;
    let modes = [DriveMode::B, DriveMode::C];
    let rates = modes.map(|mode| (format!("rates of mode {mode:?}"), factors.rates(mode)));
    let coasts = modes.map(|mode| (format!("coasts of mode {mode:?}"), factors.coasts(mode)));
    let turns = Family::ALL.map(|family| (format!("turns of {}", family.name()), factors.turns(family)));
    let row = |(of, factor): (String, &controller::commissioning::row_factors::RowFactors)| FactorRow {
        of,
        factor: factor.common().mean,
        sd: motor_model::math::sqrt_f32(factor.common().variance),
        rows: factor.measured(),
        reduced_chi_square: factor.reduced_chi_square(),
        other_level: factor.has_other_level(),
        other_shape: factor.has_other_shape(),
    };
    rates.into_iter().chain(coasts).chain(turns).map(row).collect()
}

/// As one JSON object on one line.
pub(crate) fn json(motor: &CommissionedMotor) -> String {
    let found = &motor.commissioned;
    files::json_line(&Commissioning {
        seed: motor.seed,
        end: end_word(found.end),
        time_s: found.time_s,
        unfit: found.map.as_ref().err().map(ToString::to_string),
        resonances: rows::resonances(motor),
        findings: findings(motor),
        factors: factors(motor),
        cruises: rows::cruises(motor),
        bursts: rows::bursts(motor),
    })
}

/// A value and its standard deviation; a dash for none.
fn with_sd(value: Option<f64>, sd: Option<f64>, digits: usize) -> String {
    value.zip(sd).map_or_else(|| "-".to_owned(), |(value, sd)| format!("{value:.digits$} +- {sd:.digits$}"))
}

fn milliseconds(time_s: Option<f32>) -> String {
    time_s.map_or_else(|| "-".to_owned(), |time_s| format!("{:.0}", 1e3 * time_s))
}

fn resonance_table(motor: &CommissionedMotor) -> Table {
    let mut table =
        Table::new(&["mode", "design Hz", "found Hz", "drive Hz", "half width Hz", "chi2", "true Hz"]);
    for row in rows::resonances(motor) {
        table.push(vec![
            row.mode,
            format!("{:.1}", row.design_hz),
            with_sd(row.found_hz, row.sd_hz, 1),
            format!("{:.1}", row.drive_hz),
            row.half_width_hz.map_or_else(|| "-".to_owned(), |width| format!("{width:.0}")),
            row.reduced_chi_square.map_or_else(|| "-".to_owned(), |chi| format!("{chi:.1}")),
            row.true_hz.map_or_else(|| "-".to_owned(), |hz| format!("{hz:.1}")),
        ]);
    }
    table
}

/// What of the map a table's rows contradict.
fn against(level: bool, shape: bool) -> &'static str {
    match (level, shape) {
        (false, false) => "-",
        (true, false) => "level",
        (false, true) => "shape",
        (true, true) => "level, shape",
    }
}

fn factor_table(motor: &CommissionedMotor) -> Table {
    let mut table = Table::new(&["table", "factor", "rows", "chi2", "against the map"]);
    for row in factors(motor) {
        table.push(vec![
            row.of,
            format!("{:.3} +- {:.3}", row.factor, row.sd),
            row.rows.to_string(),
            row.reduced_chi_square.map_or_else(|| "-".to_owned(), |chi| format!("{chi:.1}")),
            against(row.other_level, row.other_shape).to_owned(),
        ]);
    }
    table
}

fn cruise_table(motor: &CommissionedMotor) -> Table {
    let mut table = Table::new(&[
        "drive",
        "map rad/s",
        "measured rad/s",
        "this motor rad/s",
        "coast ms",
        "windows",
        "back",
        "rest ms",
    ]);
    for row in rows::cruises(motor) {
        let own = [row.rate_rad_s, row.rate_sd_rad_s].map(|value| value.map(f64::from));
        table.push(vec![
            format!("{} {:.2}", row.mode, row.amplitude),
            format!("{:.3} +- {:.3}", row.prior_rate_rad_s, row.prior_rate_sd_rad_s),
            row.measured_rad_s.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.3}")),
            with_sd(own[0], own[1], 3),
            row.coast_s.map_or_else(|| "-".to_owned(), |coast_s| format!("{:.2}", 1e3 * coast_s)),
            row.windows.to_string(),
            row.backward.to_string(),
            milliseconds(row.to_rest_s),
        ]);
    }
    table
}

fn burst_table(motor: &CommissionedMotor) -> Table {
    let mut table = Table::new(&[
        "family",
        "amplitude",
        "ticks",
        "map mdeg",
        "measured mdeg",
        "this motor mdeg",
        "burst to burst mdeg",
        "trains",
        "rest ms",
    ]);
    for row in rows::bursts(motor) {
        table.push(vec![
            row.family.to_owned(),
            format!("{:.2}", row.amplitude),
            row.ticks.to_string(),
            format!("{:.2} +- {:.2}", row.prior_turn_mdeg, row.prior_motors_mdeg),
            row.measured_mdeg.map_or_else(|| "-".to_owned(), |turn| format!("{turn:.2}")),
            with_sd(row.turn_mdeg, row.turn_sd_mdeg, 2),
            row.repeat_sd_mdeg.map_or_else(|| "-".to_owned(), |sd| format!("{sd:.3}")),
            row.trains.to_string(),
            milliseconds(row.to_rest_s),
        ]);
    }
    table
}

/// What was found, in a sentence or more.
pub(crate) fn verdict(motor: &CommissionedMotor) -> String {
    let found = &motor.commissioned;
    let trials: u32 = rows::cruises(motor).iter().map(|row| u32::from(row.windows > 0)).sum::<u32>()
        + rows::bursts(motor).iter().map(|row| u32::from(row.trains > 0)).sum::<u32>();
    let mut text = format!(
        "{}, measured for {:.1} s of its time: {trials} rows of the map by their own drive, the others \
         by the factor of their table.",
        super::name(motor),
        found.time_s
    );
    let sentences: Vec<String> = found.findings.iter().map(sentence).collect();
    if sentences.is_empty() {
        text.push_str(" It does nothing that the map does not foresee.");
    } else {
        text.push(' ');
        text.push_str(&sentences.join(" "));
    }
    for mode in [DriveMode::B, DriveMode::C] {
        if found.factors.coasts(mode).common().mean < 0.0 {
            let _ = write!(
                text,
                " After drives of mode {mode:?} the rotor comes to rest behind where they ended: its map has no coast."
            );
        }
    }
    if let Err(unfit) = &found.map {
        let _ = write!(text, " The motor is not fit for use, and has no map: {unfit}.");
    }
    text
}

/// For the terminal.
pub(crate) fn document(motor: &CommissionedMotor) -> Document {
    let heading = |text: &str| Block::Heading(text.to_owned());
    let about = |text: &str| Block::Paragraph(text.to_owned());
    Document {
        blocks: vec![
            heading("Commissioned motor"),
            Block::Paragraph(verdict(motor)),
            heading("Resonances"),
            about(ABOUT_RESONANCES),
            Block::Table(resonance_table(motor)),
            heading("Factors on the map that it began with"),
            about(ABOUT_FACTORS),
            Block::Table(factor_table(motor)),
            heading("Cruises"),
            about(ABOUT_CRUISES),
            Block::Table(cruise_table(motor)),
            heading("Bursts"),
            about(ABOUT_BURSTS),
            Block::Table(burst_table(motor)),
        ],
    }
}
