//! Which ticks are reported: those of the period that the host needs, and those of changes ([`link::REPORT_TICKS`]).

use estimator::Health;
use link::{BoardMessage, CHANGE_TICKS, PhaseRecord, REPORT_TICKS, checked_report_ticks};
use motor_model::DriveCommand;

use super::Application;
use super::description::refused;
use crate::design::DesignedDrive;
use crate::loop_report::LoopReport;

/// When the next report comes, and what the last one has told.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reports {
    period_ticks: u16,
    /// Ticks that pass before the next report of the period.
    left_ticks: u16,
    /// Ticks that pass before a change of health or phase is reported.
    quiet_ticks: u16,
    drive: DriveCommand,
    phase: PhaseRecord,
    health: Health,
}

impl Default for Reports {
    fn default() -> Self {
        Self {
            period_ticks: REPORT_TICKS,
            left_ticks: 0,
            quiet_ticks: 0,
            drive: DriveCommand::OFF,
            phase: PhaseRecord::Waiting,
            health: Health::Waiting,
        }
    }
}

impl Reports {
    /// The next tick of the loop is reported, and the periods count from it.
    pub(super) fn begin(&mut self) {
        self.left_ticks = 0;
    }

    /// Whether this tick is to be reported: once in every tick in which the loop does not wait.
    #[inline]
    pub(super) fn is_due(&mut self, report: &LoopReport<'_>) -> bool {
        self.quiet_ticks = self.quiet_ticks.saturating_sub(1);
        if let Some(left) = self.left_ticks.checked_sub(1) {
            self.left_ticks = left;
            self.changes(report)
        } else {
            self.left_ticks = self.period_ticks - 1;
            true
        }
    }

    /// A tick passes in which the loop does nothing.
    #[inline]
    pub(super) fn pass(&mut self) {
        self.quiet_ticks = self.quiet_ticks.saturating_sub(1);
        self.left_ticks = self.left_ticks.saturating_sub(1);
    }

    /// Whether the host has to know of a change. A rate changes its drive too often for that.
    #[inline]
    fn changes(&self, report: &LoopReport<'_>) -> bool {
        (report.applied() != self.drive && !matches!(report, LoopReport::Rate { .. }))
            || (self.quiet_ticks == 0
                && (report.kind_of_phase() != self.phase || report.health() != self.health))
    }

    /// The host is told of this tick.
    pub(super) fn told(&mut self, report: &LoopReport<'_>) {
        self.quiet_ticks = CHANGE_TICKS;
        (self.drive, self.phase, self.health) = (report.applied(), report.kind_of_phase(), report.health());
    }
}

impl<D: DesignedDrive> Application<'_, D> {
    /// From now on the host needs a report every `ticks`.
    pub(super) fn set_report_period(&mut self, ticks: u16) -> BoardMessage {
        match checked_report_ticks(ticks) {
            Ok(period_ticks) => {
                self.reports.period_ticks = period_ticks;
                self.reports.begin();
                BoardMessage::ReportPeriod { ticks }
            }
            Err(error) => refused(&error),
        }
    }
}
