//! How often a run needs a report of its board.
//!
//! | what reads the reports | period |
//! |---|---|
//! | a log: each of them | 1 ms |
//! | the simulated plant, which runs as far as the board has reported | 1 ms |
//! | the live view, the figures at the end | 20 ms |
//!
//! Changes of drive, health and phase are reported whatever the period. A board shows that it is there every 100 ms at
//! least: ten such times, [`SILENCE_MAX`](super::serial_run::SILENCE_MAX), are silence.

use std::str::FromStr;

use controller::TICK_NANOS;
use link::{CHANGE_TICKS, REPORT_TICKS, REPORT_TICKS_MAX};
use motor_model::OutOfBounds;
use simulation::math::count::real;

use super::SerialError;
use super::frame_source::FrameSource;

/// Ticks between two reports for people.
const VIEW_TICKS: u16 = 2_000;

const KEY: &str = "--report-every";

/// Time between two reports of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReportPeriod {
    /// In ticks; 0 for reports of changes alone.
    ticks: u16,
}

/// Why a text is no period.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ReportPeriodError {
    /// It is no number.
    #[error("expected a time in s, or 0")]
    NoNumber,
    /// It is out of bounds.
    #[error("{0}, or 0 for reports of changes alone")]
    OutOfBounds(#[from] OutOfBounds),
}

/// So many ticks in s.
fn seconds(ticks: u16) -> f64 {
    1e-9 * real(u64::from(ticks) * TICK_NANOS)
}

impl ReportPeriod {
    /// What a run needs whose frames are of `source`, and that `logs` or does not.
    pub fn needed(source: &FrameSource, logs: bool) -> Self {
        let ticks = if logs || *source == FrameSource::Plant { REPORT_TICKS } else { VIEW_TICKS };
        Self { ticks }
    }

    /// The same, as it goes over the wire: `asked` where that is what a run with frames of `source` can do with.
    ///
    /// # Errors
    /// When reports are rarer than the simulated plant needs them.
    pub fn checked(asked: Option<Self>, source: &FrameSource, logs: bool) -> Result<Self, SerialError> {
        let needed = Self::needed(source, logs);
        let period = asked.unwrap_or(needed);
        if *source == FrameSource::Plant && !(1..=needed.ticks).contains(&period.ticks) {
            let (asked_s, most_s) = (seconds(period.ticks), seconds(needed.ticks));
            return Err(SerialError::RareReports { asked_s, most_s });
        }
        Ok(period)
    }

    /// In ticks; 0 for reports of changes alone.
    pub(super) fn ticks(self) -> u16 {
        self.ticks
    }
}

impl FromStr for ReportPeriod {
    type Err = ReportPeriodError;

    /// A time in s, as long as the line carries reports so often, and the board tells that it is there; or 0.
    fn from_str(text: &str) -> Result<Self, ReportPeriodError> {
        let period_s: f64 = text.parse().map_err(|_| ReportPeriodError::NoNumber)?;
        if period_s.abs() <= 0.0 {
            return Ok(Self { ticks: 0 });
        }
        OutOfBounds::check(KEY, period_s, seconds(CHANGE_TICKS), seconds(REPORT_TICKS_MAX), "s")?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 10,000")]
        let ticks = (period_s / seconds(1)).round() as u16;
        Ok(Self { ticks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both bounds are taken, and what is beyond is refused by the flag, the value and the bounds.
    #[test]
    fn exact_a_period_has_bounds() {
        for (text, ticks) in [("0", 0), ("-0", 0), ("0.001", 100), ("1e-2", 1000), ("0.1", 10_000)] {
            assert_eq!(text.parse(), Ok(ReportPeriod { ticks }), "{text}");
        }
        for text in ["0.00099", "0.1001", "-0.01", "inf", "nan"] {
            let refused = text.parse::<ReportPeriod>().unwrap_err().to_string();
            let told = ["--report-every", "0.001", "0.1", "0 for reports of changes alone"];
            assert!(told.iter().all(|told| refused.contains(told)), "{refused}");
        }
        assert_eq!("often".parse::<ReportPeriod>(), Err(ReportPeriodError::NoNumber));
    }

    /// A log and the simulated plant need a report every millisecond, the live view one in twenty.
    #[test]
    fn exact_a_run_has_the_reports_that_it_needs() {
        let camera = FrameSource::StandardInput;
        for (source, logs, ticks) in [
            (&camera, false, 2000),
            (&camera, true, 100),
            (&FrameSource::Plant, false, 100),
            (&FrameSource::Plant, true, 100),
        ] {
            assert_eq!(ReportPeriod::checked(None, source, logs).unwrap().ticks(), ticks);
        }
    }

    /// Whoever asks gets what he asks for, with a camera. The simulated plant would stand still without reports.
    #[test]
    fn exact_rarer_reports_than_the_plant_needs_are_refused() {
        let asked = |text: &str| Some(text.parse().unwrap());
        for text in ["0", "0.001", "0.1"] {
            for logs in [false, true] {
                let checked = ReportPeriod::checked(asked(text), &FrameSource::StandardInput, logs);
                assert_eq!(Some(checked.unwrap()), asked(text));
            }
        }
        assert!(ReportPeriod::checked(asked("0.001"), &FrameSource::Plant, false).is_ok());
        for (text, told) in [("0", "= 0:"), ("0.002", "= 0.002:")] {
            let refused = ReportPeriod::checked(asked(text), &FrameSource::Plant, true).unwrap_err();
            let line = refused.to_string();
            assert!(line.contains(told) && line.contains("0.001 s"), "{line}");
        }
    }
}
