//! The response map of the loop: that of Table 1, or the one that the host sends, in the one place where it is kept.

use controller::ResponseMap;
use controller::response_map::{Burst, Cruise};
use link::{LearntRecord, MAP_ROWS_MAX, MapEnd, MapFault, MapRows, rows_of};
use motor_model::MotorParams;

/// The map from the host, if one has begun.
#[derive(Debug, Default)]
pub(super) struct MapMemory {
    received: Option<ResponseMap>,
    is_complete: bool,
}

impl MapMemory {
    /// No map from the host.
    pub(super) const fn new() -> Self {
        Self { received: None, is_complete: false }
    }

    /// The map to plan by: the received one, or that of Table 1 if none has begun.
    ///
    /// # Errors
    /// When the received one is not complete.
    pub(super) fn map(&self) -> Result<&ResponseMap, MapFault> {
        match &self.received {
            None => Ok(ResponseMap::table_1()),
            Some(map) if self.is_complete => Ok(map),
            Some(map) => Err(MapFault::Incomplete { rows: rows_of(map) }),
        }
    }

    /// The map from the host, if one has begun.
    pub(super) fn received(&self) -> Option<&ResponseMap> {
        self.received.as_ref()
    }

    /// From now on the map is that of Table 1.
    pub(super) fn forget(&mut self) {
        self.received = None;
        self.is_complete = false;
    }

    /// Begins a map of `design`, without rows.
    pub(super) fn begin(&mut self, design: &MotorParams) {
        self.received = Some(ResponseMap::without_rows(*design));
        self.is_complete = false;
    }

    /// Appends rows to their table.
    ///
    /// # Errors
    /// When no map has begun, or a map with these rows is refused; it is then as before.
    pub(super) fn append(&mut self, rows: &MapRows) -> Result<(), MapFault> {
        let map = self.incomplete()?;
        match rows {
            MapRows::Cruises(rows) => {
                let mut cruises = heapless::Vec::<Cruise, MAP_ROWS_MAX>::new();
                for row in rows {
                    // Never full: as many as a frame holds.
                    let _ = cruises.push(row.cruise().ok_or(MapFault::Unknown)?);
                }
                map.append_cruises(&cruises)?;
            }
            MapRows::Bursts { family, rows } => {
                let family = family.value().ok_or(MapFault::Unknown)?;
                let mut bursts = heapless::Vec::<Burst, MAP_ROWS_MAX>::new();
                for row in rows {
                    let _ = bursts.push(row.into());
                }
                map.append_bursts(family, &bursts)?;
            }
        }
        Ok(())
    }

    /// Takes what moves have learnt of the motor.
    ///
    /// # Errors
    /// When no map has begun, or a factor is out of bounds; it is then as before.
    pub(super) fn learn(&mut self, learnt: LearntRecord) -> Result<(), MapFault> {
        Ok(self.incomplete()?.set_learnt(learnt.into())?)
    }

    /// Ends the map.
    ///
    /// # Errors
    /// When no map has begun, a row of it has not come, or its correlation is out of bounds.
    pub(super) fn end(&mut self, end: MapEnd) -> Result<(), MapFault> {
        let map = self.incomplete()?;
        let rows = rows_of(map);
        if rows != end.rows {
            return Err(MapFault::Incomplete { rows });
        }
        map.complete(end.step_walk_correlation)?;
        self.is_complete = true;
        Ok(())
    }

    /// The map to which rows may be appended.
    fn incomplete(&mut self) -> Result<&mut ResponseMap, MapFault> {
        self.received.as_mut().filter(|_| !self.is_complete).ok_or(MapFault::Incomplete { rows: 0 })
    }
}
