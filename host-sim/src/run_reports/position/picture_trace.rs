//! The course of a move for its picture: evenly spaced moments in bounded memory, and every change of the drive.

use motor_model::DriveCommand;

use simulation::runs::closed_loop::PositioningMoment;

/// Moments kept at most.
const MOMENTS_MAX: usize = 60_000;

/// The course of a move.
#[derive(Clone, Debug)]
pub struct PictureTrace {
    /// Evenly spaced moments.
    pub moments: Vec<PositioningMoment>,
    /// When the drive changed, in s, and what it changed to.
    pub commands: Vec<(f64, DriveCommand)>,
    ticks_per_moment: u64,
    ticks: u64,
}

impl Default for PictureTrace {
    fn default() -> Self {
        Self { moments: Vec::new(), commands: vec![(0.0, DriveCommand::OFF)], ticks_per_moment: 1, ticks: 0 }
    }
}

impl PictureTrace {
    /// Takes a tick. When the memory is full, every second moment is removed, and from then on half as many are kept.
    pub fn take(&mut self, moment: &PositioningMoment) {
        if self.ticks.is_multiple_of(self.ticks_per_moment) {
            if self.moments.len() == MOMENTS_MAX {
                let mut index = 0;
                self.moments.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.ticks_per_moment *= 2;
            }
            if self.ticks.is_multiple_of(self.ticks_per_moment) {
                self.moments.push(*moment);
            }
        }
        self.ticks += 1;
        let applied = moment.report.applied;
        if self.commands.last().is_none_or(|(_, last)| *last != applied) {
            self.commands.push((moment.seconds(), applied));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::{PositioningPhase, TickReport, Wait};
    use estimator::Health;
    use motor_model::{Angle, DriveMode, Time};

    fn moment(tick: u64, applied: DriveCommand) -> PositioningMoment {
        let report = TickReport {
            estimate: None,
            health: Health::Waiting,
            camera: None,
            command: applied,
            applied,
            phase: PositioningPhase::Settling(Wait::Rest),
        };
        PositioningMoment {
            at: Time::from_micros(10 * tick),
            angle: Angle::ZERO,
            own_axis_angle: Angle::ZERO,
            rate_rad_s: 0.0,
            tilt: None,
            report,
        }
    }

    #[test]
    fn law_long_runs_stay_bounded_and_evenly_spaced() {
        let mut trace = PictureTrace::default();
        for tick in 0..500_000 {
            trace.take(&moment(tick, DriveCommand::OFF));
        }
        assert!(trace.moments.len() <= MOMENTS_MAX && trace.moments.len() > MOMENTS_MAX / 2);
        let gaps: Vec<u64> =
            trace.moments.windows(2).map(|pair| pair[1].at.nanos_since(pair[0].at)).collect();
        assert!(gaps.iter().all(|gap| *gap == gaps[0]));
    }

    #[test]
    fn exact_every_change_of_drive_is_kept() {
        let mut trace = PictureTrace::default();
        let (b, off) = (DriveCommand::full(DriveMode::B), DriveCommand::OFF);
        for (tick, command) in [off, b, b, off, b].into_iter().enumerate() {
            trace.take(&moment(tick as u64, command));
        }
        let commands: Vec<DriveCommand> = trace.commands.iter().map(|(_, command)| *command).collect();
        assert_eq!(commands, [off, b, off, b]);
        assert!((trace.commands[1].0 - 1e-5).abs() < 1e-15);
    }
}
