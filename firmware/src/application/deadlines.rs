//! Deadlines of the ticks: those that ended late, and those that were lost.

use link::BoardFault;

use super::Application;
use crate::design::DesignedDrive;

/// The drive goes off after this many missed deadlines in a row.
pub const OVERRUNS_MAX: u32 = 10;

impl<D: DesignedDrive> Application<'_, D> {
    /// Records whether the last tick met its deadline.
    ///
    /// A missed deadline is counted only while the drive may be on, and in a self-test. After [`OVERRUNS_MAX`] in a row
    /// of the first kind the fault latches.
    pub fn record_deadline(&mut self, met: bool) {
        if let Some(observation) = &mut self.observation {
            observation.late_ticks += u32::from(!met && !observation.is_over);
        }
        if met || !self.is_driving() {
            self.overruns_in_a_row = 0;
            return;
        }
        self.counters.overruns = self.counters.overruns.saturating_add(1);
        self.overruns_in_a_row += 1;
        if self.overruns_in_a_row >= OVERRUNS_MAX {
            self.latch(BoardFault::Overrun);
        }
    }

    /// Advances the time by ticks that passed before arming or a jog, and so before the frame that asked for it.
    pub fn skip_ticks(&mut self, ticks: u64) {
        self.elapsed_ticks += ticks;
        self.last_frame_at += ticks;
        if let Some(observation) = &mut self.observation {
            observation.last_tick += ticks;
        }
    }

    /// Advances the time by ticks that were lost. Where the drive may be on, each is a missed deadline.
    pub fn record_lost_ticks(&mut self, lost: u64) {
        self.elapsed_ticks += lost;
        (0..lost.min(u64::from(OVERRUNS_MAX))).for_each(|_| self.record_deadline(false));
    }
}
