//! What the board does for somebody who brings it up: a drive by hand, and a look at itself. Neither has a filter, a
//! camera or a target.
//!
//! A jog goes on without the host for 10 ms at most: its switch is a dead man's.

use controller::LoopTiming;
use link::{BoardFault, BoardMessage, Jog, JogReport, SelfTestReport};
use motor_model::OutOfBounds;

use super::description::refused;
use super::observation::{Observation, Observed};
use super::{Application, State, time};
use crate::design::DesignedDrive;

impl<D: DesignedDrive> Application<'_, D> {
    /// Drives by hand from the next tick on, in the place of the jog under way if there is one.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn jog(&mut self, jog: &Jog) -> BoardMessage {
        match self.state {
            State::Armed => return BoardMessage::Fault(BoardFault::Armed),
            State::Latched(_) => return BoardMessage::Fault(self.fault()),
            State::Safe | State::Jogging(_) => {}
        }
        match self.begin_jog(jog) {
            Ok(()) => BoardMessage::Jogging,
            Err(error) => refused(&error),
        }
    }

    fn begin_jog(&mut self, jog: &Jog) -> Result<(), OutOfBounds> {
        let (command, ticks) = jog.checked()?;
        if matches!(self.state, State::Safe) {
            let design = D::design(&self.bench.design)?;
            // It was configured with what the amplifier followed until now.
            self.memory.configured = None;
            self.amplifier.follow(design);
            self.amplifier.keep_time(LoopTiming::default());
        }
        self.state = State::Jogging(command);
        self.observe(Observed::Jog, ticks);
        Ok(())
    }

    /// Looks at the board from the next tick on.
    pub(super) fn self_test(&mut self) -> Option<BoardMessage> {
        if self.is_driving() {
            return Some(self.refused_while_driving());
        }
        self.observe(Observed::SelfTest, SelfTestReport::TICKS);
        None
    }

    /// Begins an observation, without the measurements that have waited for a loop.
    fn observe(&mut self, of: Observed, ticks: u64) {
        self.measurements.clear();
        self.observation = Some(Observation::begin(of, self.elapsed_ticks, ticks));
    }

    /// The tick of a board that is not armed: the drive is off, unless it is on by hand.
    // Never inlined: it is no part of an armed tick.
    #[inline(never)]
    pub(super) fn tick_by_hand(&mut self) {
        let under_way = self.observation.as_mut().filter(|observation| !observation.is_over);
        let Some(observation) = under_way else {
            self.amplifier.switch_off();
            return;
        };
        if self.elapsed_ticks > observation.last_tick {
            observation.is_over = true;
            self.amplifier.switch_off();
            if let State::Jogging(_) = self.state {
                self.state = State::Safe;
            }
            return;
        }
        observation.take(&mut self.measurements, time(self.elapsed_ticks));
        match self.state {
            State::Jogging(command) => observation.applied = self.amplifier.drive(command),
            _ => self.amplifier.switch_off(),
        }
    }

    /// What an observation that is over has seen, once.
    pub(super) fn take_observed(&mut self) -> Option<BoardMessage> {
        let observation = self.observation.take_if(|observation| observation.is_over)?;
        let Observation { of, ticks, late_ticks, velocity, camera, applied, .. } = observation;
        Some(match of {
            Observed::Jog => BoardMessage::Jogged(JogReport { ticks, applied: applied.into(), velocity }),
            Observed::SelfTest => BoardMessage::SelfTest(SelfTestReport {
                amplifier_works: self.amplifier.works(),
                has_converter: self.has_converter,
                ticks,
                late_ticks,
                velocity,
                camera,
                stack_bytes_max: self.stack_bytes_max,
                stack_bytes: self.stack_bytes,
            }),
        })
    }

    /// The answer to what has to wait until the drive is off.
    pub(super) fn refused_while_driving(&self) -> BoardMessage {
        BoardMessage::Fault(match self.state {
            State::Jogging(_) => BoardFault::Jogging,
            _ => BoardFault::Armed,
        })
    }
}
