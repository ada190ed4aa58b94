//! How often a board reports.
//!
//! | reports | when |
//! |---|---|
//! | of the period | every so many ticks, as the host has asked ([`HostMessage::ReportPeriod`](crate::HostMessage)) |
//! | of the drive | in the tick in which a move or an experiment changes it; a rate changes it too often |
//! | of health and phase | at a change, at most one in [`CHANGE_TICKS`] since the last report |
//!
//! A host that hears nothing for ten of the longest periods, a second, can take the board for silent.

use motor_model::OutOfBounds;

/// Ticks of 10 us between two reports where the host has not asked for others: a thousand a second.
pub const REPORT_TICKS: u16 = 100;

/// Longest period of reports in ticks, 100 ms: the time after which a board shows that it is there.
pub const REPORT_TICKS_MAX: u16 = 10_000;

/// Ticks after a report before which no other one tells of a change of health or phase: a thousand a second fit the
/// line.
pub const CHANGE_TICKS: u16 = 100;

/// Ticks between two reports of a board that is asked for reports every `ticks`, 0 for those of changes alone.
///
/// # Errors
/// When it is out of bounds.
pub fn checked_report_ticks(ticks: u16) -> Result<u16, OutOfBounds> {
    OutOfBounds::check("board.report_period_ticks", ticks.into(), 0.0, REPORT_TICKS_MAX.into(), "ticks")?;
    Ok(if ticks == 0 { REPORT_TICKS_MAX } else { ticks })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_period_has_bounds() {
        for (asked, ticks) in
            [(0, REPORT_TICKS_MAX), (1, 1), (100, 100), (REPORT_TICKS_MAX, REPORT_TICKS_MAX)]
        {
            assert_eq!(checked_report_ticks(asked), Ok(ticks));
        }
        let refused = checked_report_ticks(REPORT_TICKS_MAX + 1).unwrap_err();
        assert_eq!(
            (refused.key, refused.value, refused.max),
            ("board.report_period_ticks", 10_001.0, 10_000.0)
        );
    }
}
