//! What the host tells before a task: instruments, motor, response map, configuration. While armed all is refused.

use controller::LoopTiming;
use link::{BoardFault, BoardMessage, HostMessage, SettingKey};
use motor_model::OutOfBounds;

use super::Application;
use super::configured_move::{Asked, Bench, Configured, MoveError, MoveMemory};
use crate::design::DesignedDrive;

impl<D: DesignedDrive> Application<'_, D> {
    /// Builds the task that is asked for. While armed it is refused.
    // Never inlined: the stack that construction of a filter takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn configure(&mut self, asked: Asked) -> BoardMessage {
        if self.is_driving() {
            return self.refused_while_driving();
        }
        let design = match D::design(&self.bench.design) {
            Ok(design) => design,
            Err(error) => return refused(&error),
        };
        match Configured::build(self.memory, asked, &self.bench) {
            Ok(()) => {
                self.amplifier.follow(design);
                self.amplifier.keep_time(self.bench.timing);
                BoardMessage::Configured
            }
            Err(MoveError::Setting(error)) => refused(&error),
            Err(MoveError::Map(fault)) => BoardMessage::Fault(BoardFault::Map(fault)),
            #[cfg(not(feature = "commissioning"))]
            Err(MoveError::NoExperiments) => BoardMessage::Fault(BoardFault::NoExperiments),
        }
    }

    /// Takes what `message` tells of the bench, for the configurations that follow; `None` where it tells nothing.
    pub(super) fn describe_by(&mut self, message: &HostMessage) -> Option<BoardMessage> {
        Some(match message {
            HostMessage::Instruments(instruments) => self.describe(|bench| {
                bench.instruments = instruments.checked()?;
                Ok(())
            }),
            HostMessage::DescriptionBegin => {
                if self.is_driving() {
                    return Some(self.refused_while_driving());
                }
                self.forget_description();
                BoardMessage::Described
            }
            HostMessage::MotorParameter(parameter) => self.describe(|bench| bench.set(*parameter)),
            &HostMessage::Timing { latency_ticks, decision_ticks } => {
                self.describe(|bench| bench.set_timing(LoopTiming { latency_ticks, decision_ticks }))
            }
            HostMessage::MapBegin
            | HostMessage::MapRows(_)
            | HostMessage::MapLearnt(_)
            | HostMessage::MapEnd(_) => self.describe_map(message),
            _ => return None,
        })
    }

    /// Changes the description of the bench, for the configurations that follow.
    fn describe(&mut self, change: impl FnOnce(&mut Bench) -> Result<(), OutOfBounds>) -> BoardMessage {
        if self.is_driving() {
            return self.refused_while_driving();
        }
        match change(&mut self.bench) {
            Ok(()) => BoardMessage::Described,
            Err(error) => refused(&error),
        }
    }

    /// Takes a part of the response map, for the configurations that follow.
    // Never inlined: as above.
    #[inline(never)]
    fn describe_map(&mut self, part: &HostMessage) -> BoardMessage {
        if self.is_driving() {
            return self.refused_while_driving();
        }
        let MoveMemory { configured, map, .. } = &mut *self.memory;
        let taken = match part {
            HostMessage::MapRows(rows) => map.append(rows),
            HostMessage::MapLearnt(learnt) => map.learn(*learnt),
            HostMessage::MapEnd(end) => map.end(*end),
            _ => {
                *configured = None;
                map.begin(&self.bench.design);
                Ok(())
            }
        };
        match taken {
            Ok(()) => BoardMessage::Described,
            Err(fault) => BoardMessage::Fault(BoardFault::Map(fault)),
        }
    }
}

/// The answer to a setting out of its bounds.
pub(super) fn refused(error: &OutOfBounds) -> BoardMessage {
    let key = SettingKey::try_from(error.key).unwrap_or_default();
    BoardMessage::Fault(BoardFault::OutOfBounds { key })
}
