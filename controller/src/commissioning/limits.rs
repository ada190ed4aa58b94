//! The limits within which experiments drive a motor: the travel, at which they end, and the strongest drive, above
//! which an order is refused.

use estimator::Estimate;
use motor_model::OutOfBounds;

use super::experiment::Experiment;
use super::experimenter::{ExperimentTuning, Experimenter, Stage};
use super::result::CommissioningEnd;
use crate::response_map::direction;
use crate::target::Travel;

impl ExperimentTuning {
    /// The same between other angles, and with another strongest drive, 0 to 1.
    #[must_use]
    pub fn with_limits(mut self, travel: Travel, amplitude_max: f32) -> Self {
        (self.travel, self.amplitude_max) = (travel, amplitude_max);
        self
    }

    /// The angles between which the rotor may be driven.
    pub fn travel(&self) -> Travel {
        self.travel
    }

    /// The strongest drive that may be ordered, 0 to 1.
    pub fn amplitude_max(&self) -> f32 {
        self.amplitude_max
    }
}

impl Experimenter {
    /// Whether an experiment may be ordered.
    ///
    /// # Errors
    /// When it drives harder than is allowed.
    pub fn allows(&self, experiment: &Experiment) -> Result<(), OutOfBounds> {
        let (amplitude, most) = (experiment.amplitude().into(), self.tuning.amplitude_max.into());
        OutOfBounds::check("experiment.amplitude", amplitude, 0.0, most, "").map(|_| ())
    }

    /// Ends where the drive leads out of the travel, or farther out. The coast after that is not part of it.
    pub(super) fn end_at_travel(&mut self, estimate: &Estimate<f32>) {
        let along = match &self.stage {
            Stage::Sweeping(sweep) => direction(sweep.mode()),
            Stage::Cruising(run) => run.along(),
            Stage::Bursting(run) => run.train.along,
            Stage::Resting(_) | Stage::Ready | Stage::Ended(_) => return,
        };
        if self.tuning.travel.forbids(estimate.angle, along) {
            self.stage = Stage::Ended(CommissioningEnd::EndOfTravel);
        }
    }
}

#[cfg(test)]
mod tests {
    use estimator::{Health, Instruments};
    use motor_model::{Angle, DriveCommand, DriveMode, Time};

    use super::super::ExperimentPhase;
    use super::*;

    const MOST: f32 = 0.5;

    /// One that is ready, within 10 degrees to either side, of a rotor that lies at 0.
    fn ready() -> (Experimenter, Time, Estimate<f32>) {
        let travel = Travel::try_new(-10.0, 10.0).unwrap();
        let tuning = ExperimentTuning::new(&Instruments::default()).with_limits(travel, MOST);
        let mut experimenter = Experimenter::new(tuning, Time::ZERO);
        let mut now = Time::ZERO;
        let estimate = Estimate {
            at: now,
            angle: Angle::ZERO,
            rate_rad_s: 0.0,
            angle_rad2: 1e-12,
            angle_rate_rad2_s: 0.0,
            rate_rad2_s2: 1e-6,
            resting: true,
        };
        while experimenter.phase() != ExperimentPhase::Ready {
            experimenter.decide(now, Some(&estimate), Health::Good);
            now = now.plus_nanos(crate::TICK_NANOS);
        }
        (experimenter, now, estimate)
    }

    fn drives(mode: DriveMode) -> [Experiment; 3] {
        [
            Experiment::Sweep { mode, amplitude: MOST },
            Experiment::Cruise { mode, amplitude: MOST, offset_hz: 0.0 },
            Experiment::Train { mode, amplitude: MOST, offset_hz: 0.0, ticks: 100_000, count: 1 },
        ]
    }

    /// Each drive is on up to the limit of its direction, and ends in the tick that lies beyond; the limit of the other
    /// direction ends none.
    #[test]
    fn exact_the_travel_ends_every_drive_in_its_tick() {
        for (mode, sign) in [(DriveMode::B, 1.0), (DriveMode::C, -1.0)] {
            for experiment in drives(mode) {
                let (mut experimenter, mut now, estimate) = ready();
                assert!(experimenter.order(experiment));
                for (deg, on) in
                    [(0.0, true), (-sign * 11.0, true), (sign * 10.0, true), (sign * 10.001, false)]
                {
                    let estimate = Estimate { angle: Angle::from_degrees(deg), ..estimate };
                    let command = experimenter.decide(now, Some(&estimate), Health::Good);
                    assert_eq!(command.mode(), on.then_some(mode), "{experiment:?} at {deg}");
                    now = now.plus_nanos(crate::TICK_NANOS);
                }
                assert_eq!(experimenter.phase(), ExperimentPhase::Ended(CommissioningEnd::EndOfTravel));
            }
        }
    }

    /// A rotor that lies beyond the limit is not driven farther for a single tick, and is driven back.
    #[test]
    fn exact_nothing_drives_farther_out() {
        for (mode, driven) in [(DriveMode::B, false), (DriveMode::C, true)] {
            for experiment in drives(mode) {
                let (mut experimenter, now, estimate) = ready();
                let outside = Estimate { angle: Angle::from_degrees(10.5), ..estimate };
                assert!(experimenter.order(experiment));
                let command = experimenter.decide(now, Some(&outside), Health::Good);
                assert_eq!(command != DriveCommand::OFF, driven, "{experiment:?}");
            }
        }
    }

    #[test]
    fn exact_a_stronger_drive_is_not_allowed() {
        let (experimenter, ..) = ready();
        for experiment in drives(DriveMode::C) {
            assert_eq!(experimenter.allows(&experiment), Ok(()));
        }
        let harder = Experiment::Sweep { mode: DriveMode::B, amplitude: MOST.next_up() };
        let refused = experimenter.allows(&harder).unwrap_err();
        assert_eq!((refused.key, refused.max), ("experiment.amplitude", MOST.into()));
    }
}
