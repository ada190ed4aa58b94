//! What a move will take, asked by the host before it is configured.

use controller::MoveForecast;
use link::{BoardFault, BoardMessage, Configuration};

use super::Application;
use super::configured_move::{MoveError, asked};
use super::description::refused;
use crate::design::DesignedDrive;

impl<D: DesignedDrive> Application<'_, D> {
    /// What the move of `question` will take on the bench that was described. While armed it is refused: it takes
    /// longer than a tick.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn forecast(&self, question: Configuration) -> BoardMessage {
        if self.is_driving() {
            return self.refused_while_driving();
        }
        match self.forecast_of(question) {
            Ok(answer) => answer,
            Err(MoveError::Setting(error)) => refused(&error),
            Err(MoveError::Map(fault)) => BoardMessage::Fault(BoardFault::Map(fault)),
            #[cfg(not(feature = "commissioning"))]
            Err(MoveError::NoExperiments) => BoardMessage::Fault(BoardFault::NoExperiments),
        }
    }

    fn forecast_of(&self, question: Configuration) -> Result<BoardMessage, MoveError> {
        let (map, _, limits) = asked(&self.memory.map, &question, &self.bench)?;
        let Configuration { target_deg, tolerance_deg, .. } = question;
        #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
        let [distance_rad, tolerance_rad] = [target_deg, tolerance_deg].map(|deg| deg.to_radians() as f32);
        let forecast =
            MoveForecast::try_new(&self.bench.instruments, map, &limits, distance_rad, tolerance_rad);
        Ok(BoardMessage::Forecast(forecast.map(Into::into).map_err(Into::into)))
    }
}
