//! The identified map as Rust source for `controller`, and as a document. [`analysis::response_map`] identifies it.

use std::fmt::Write as _;

use controller::response_map::Family;

use crate::report::document::{Block, Document, Table};
use analysis::response_map::{BurstRow, IdentifiedResponseMap, rounded};

/// The module `controller::response_map::table`, as `rustfmt` leaves it.
pub(crate) fn source(map: &IdentifiedResponseMap) -> String {
    let IdentifiedResponseMap { motors, seed, step_walk_correlation, .. } = map;
    let mut text = format!(
        "//! Written by `host-sim response-map --motors {motors} --seed {seed} --write \
         controller/src/response_map/table.rs`: do not edit.\n\n\
         use motor_model::DriveMode::{{B, C}};\n\n\
         use super::{{Burst, Cruise, burst, cruise}};\n\n\
         /// Correlation over motors of the turns by a step and by a walk.\n\
         pub(super) const STEP_WALK_CORRELATION: f32 = {step_walk_correlation:.2};\n\n\
         /// Cruises of each mode, weakest first: drive, rate and its spread over motors in rad/s, coast per \
         rate in s\n/// and its spread in milli-degrees.\n\
         #[rustfmt::skip]\npub(super) const CRUISES: [Cruise; {}] = [\n",
        map.cruises.len()
    );
    // Writing to a string cannot fail.
    for row in &map.cruises {
        let [rate, sd, coast, off] =
            [row.rate_rad_s, row.rate_sd_rad_s, row.coast_s, row.coast_sd_mdeg].map(figure);
        let drive = format!("({:?}, {:?})", row.mode, row.amplitude);
        let _ = writeln!(text, "    cruise({drive}, ({rate}, {sd}), ({coast}, {off})),");
    }
    text.push_str(
        "];\n\n/// Bursts of each family, in the order of [`super::Family::ALL`], shortest first: amplitude, \
         ticks, turn,\n/// its spread over motors and from burst to burst in milli-degrees.\n\
         #[rustfmt::skip]\npub(super) const BURSTS_OF: [&[Burst]; 5] = [\n",
    );
    for (family, rows) in Family::ALL.into_iter().zip(&map.bursts) {
        let _ = writeln!(text, "    // {family:?}\n    &[");
        for row in rows {
            let [turn, motors, repeat] = [row.turn_mdeg.abs(), row.motors_mdeg, row.repeat_mdeg].map(figure);
            let BurstRow { amplitude, ticks, .. } = row;
            let _ = writeln!(text, "        burst({amplitude:?}, {ticks}, {turn}, {motors}, {repeat}),");
        }
        text.push_str("    ],\n");
    }
    text.push_str("];\n");
    text
}

/// The map as a document for the terminal.
pub(crate) fn document(map: &IdentifiedResponseMap) -> Document {
    let mut cruises =
        Table::new(&["drive", "rate rad/s", "over motors", "lag ms", "coast ms", "coast off mdeg"]);
    for row in &map.cruises {
        cruises.push(vec![
            format!("{:?} {:.2}", row.mode, row.amplitude),
            format!("{:+.3}", row.rate_rad_s),
            format!("{:.3}", row.rate_sd_rad_s),
            format!("{:.1}", 1e3 * row.spin_up_s),
            format!("{:.2}", 1e3 * row.coast_s),
            format!("{:.0}", row.coast_sd_mdeg),
        ]);
    }
    let mut bursts =
        Table::new(&["family", "amplitude", "ticks", "turn mdeg", "over motors", "burst to burst"]);
    for (family, rows) in Family::ALL.into_iter().zip(&map.bursts) {
        for row in rows {
            bursts.push(vec![
                format!("{family:?}"),
                format!("{:.2}", row.amplitude),
                row.ticks.to_string(),
                format!("{:+.3}", row.turn_mdeg),
                format!("{:.3}", row.motors_mdeg),
                format!("{:.3}", row.repeat_mdeg),
            ]);
        }
    }
    let summary = format!(
        "{} motors drawn from seed {}; spreads are standard deviations. Steps and walks of a motor are correlated \
         by {:.2}.",
        map.motors, map.seed, map.step_walk_correlation
    );
    Document {
        blocks: vec![
            Block::Heading("Response map".to_owned()),
            Block::Paragraph(summary),
            Block::Table(cruises),
            Block::Table(bursts),
        ],
    }
}

/// `value` with four significant digits, as Rust writes an `f32`.
fn figure(value: f64) -> String {
    format!("{:?}", rounded(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_figures_have_four_digits() {
        for (value, text) in
            [(7424.4083, "7424.0"), (-0.065_123_4, "-0.06512"), (11_890.31, "11890.0"), (0.0, "0.0")]
        {
            assert_eq!(figure(value), text);
        }
    }

    /// The map in `controller`, written again, is the same bytes.
    #[test]
    fn exact_the_compiled_map_is_as_the_command_writes_it() {
        let map = controller::ResponseMap::table_1();

        let mdeg = |rad: f32| 1e3 * f64::from(rad).to_degrees();
        let cruise_row = |cruise: &controller::response_map::Cruise| analysis::response_map::CruiseRow {
            mode: cruise.mode,
            amplitude: cruise.amplitude,
            rate_rad_s: cruise.rate_rad_s.into(),
            rate_sd_rad_s: cruise.rate_sd_rad_s.into(),
            spin_up_s: 0.0,
            coast_s: cruise.coast_s.into(),
            coast_sd_mdeg: mdeg(cruise.coast_sd_rad),
        };
        let burst_row = |burst: &controller::response_map::Burst| BurstRow {
            amplitude: burst.amplitude,
            ticks: burst.ticks,
            turn_mdeg: mdeg(burst.turn_rad),
            motors_mdeg: mdeg(burst.motors_sd_rad),
            repeat_mdeg: mdeg(burst.repeat_sd_rad),
        };
        let identified = IdentifiedResponseMap {
            cruises: map.cruises().iter().map(cruise_row).collect(),
            bursts: Family::ALL.map(|family| map.bursts(family).iter().map(burst_row).collect()).into(),
            step_walk_correlation: map.step_walk_correlation().into(),
            design: motor_model::MotorParams::nominal(),
            motors: 200,
            seed: 1,
        };
        let written = include_str!("../../../controller/src/response_map/table.rs");
        assert_eq!(source(&identified), written);
    }
}
