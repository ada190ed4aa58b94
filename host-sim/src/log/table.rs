//! Records as rows of one table: each row is an instant, and cells of what it does not show are empty.
//!
//! A row is a vibrometer sample, a camera frame with what became of it, an impact, or a logged tick with truth,
//! estimate, health, phase and drive. Ticks at which health, phase or drive change have a row in any case. The column
//! `time_s` is the instant that the row is of: for a frame the middle of its exposure, so that it stands after rows of
//! later instants.

use std::borrow::Cow;

use estimator::{Health, LdvSample};
use motor_model::{Angle, DriveCommand, Time, math};

pub(super) use crate::report::parquet_table::{Cell, CellKind};
use simulation::runs::record::{Impact, RunRecord, Task, mode_word, verdict_word};

macro_rules! columns {
    ($($place:ident $name:literal $kind:ident,)+) => {
        /// The columns, by place.
        #[derive(Clone, Copy, Debug)]
        enum Place { $($place,)+ }

        /// Names of the columns and what their cells are.
        pub const COLUMNS: &[(&str, CellKind)] = &[$(($name, CellKind::$kind),)+];
    };
}

columns! {
    TimeS "time_s" Number,
    TruthAngle "truth_angle_deg" Number,
    TruthRate "truth_rate_rad_s" Number,
    TruthHeight "truth_height_m" Number,
    TruthVelocity "truth_velocity_m_s" Number,
    TruthTilt "truth_tilt_mrad" Number,
    TruthShiftX "truth_shift_x_m" Number,
    TruthShiftY "truth_shift_y_m" Number,
    ImpactKick "impact_kick_rad_s" Number,
    ImpactBefore "impact_velocity_before_m_s" Number,
    ImpactAfter "impact_velocity_after_m_s" Number,
    Vibrometer "vibrometer_m_s" Number,
    CameraAngle "camera_angle_deg" Number,
    CameraMarks "camera_marks_used" Number,
    MarksShiftX "marks_shift_x_m" Number,
    MarksShiftY "marks_shift_y_m" Number,
    MarksResidual "marks_residual_m" Number,
    Innovation "innovation_mdeg" Number,
    InnovationSd "innovation_sd_mdeg" Number,
    Verdict "verdict" Word,
    EstimateAngle "estimate_angle_deg" Number,
    EstimateAngleSd "estimate_angle_sd_mdeg" Number,
    EstimateRate "estimate_rate_rad_s" Number,
    EstimateRateSd "estimate_rate_sd_rad_s" Number,
    EstimateResting "estimate_resting" Number,
    EstimateHealth "health" Word,
    Phase "phase" Word,
    WantedRate "wanted_rate_rad_s" Number,
    ReferenceAngle "reference_angle_deg" Number,
    DriveMode "drive_mode" Word,
    DriveAmplitude "drive_amplitude" Number,
    DriveOffset "drive_frequency_offset_hz" Number,
}

/// A row.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// A cell for each column.
    cells: Vec<Option<Cell>>,
    /// Columns whose cells are not empty: few of many.
    filled: Vec<usize>,
}

impl Row {
    /// A cell for each column.
    pub(super) fn cells(&self) -> &[Option<Cell>] {
        &self.cells
    }

    /// The cells that are not empty, each with its column.
    pub(super) fn filled(&self) -> impl Iterator<Item = (usize, &Cell)> {
        self.filled.iter().filter_map(|column| Some((*column, self.cells.get(*column)?.as_ref()?)))
    }
}

/// Makes rows of records.
#[derive(Clone, Debug)]
pub(super) struct RowMaker {
    health: Option<(Health, String)>,
    phase: Cow<'static, str>,
    drive: Option<DriveCommand>,
    row: Row,
}

impl RowMaker {
    /// No row yet.
    pub(super) fn new() -> Self {
        let row = Row { cells: vec![None; COLUMNS.len()], filled: Vec::new() };
        Self { health: None, phase: Cow::Borrowed(""), drive: None, row }
    }

    fn set(&mut self, place: Place, cell: impl Into<Cell>) {
        if let Some(slot) = self.row.cells.get_mut(place as usize) {
            *slot = Some(cell.into());
            self.row.filled.push(place as usize);
        }
    }

    fn begin(&mut self, at: Time) {
        for column in self.row.filled.drain(..) {
            self.row.cells[column] = None;
        }
        self.set(Place::TimeS, at.seconds_since::<f64>(Time::ZERO));
    }

    /// Gives the rows of impacts and samples to `take`.
    ///
    /// # Errors
    /// When `take` refuses one.
    pub(super) fn of_samples<E>(
        &mut self,
        impacts: &[Impact],
        samples: &[LdvSample],
        mut take: impl FnMut(&Row) -> Result<(), E>,
    ) -> Result<(), E> {
        for impact in impacts {
            self.impact(impact);
            take(&self.row)?;
        }
        for sample in samples {
            self.begin(sample.taken_at);
            self.set(Place::Vibrometer, sample.velocity_m_s);
            take(&self.row)?;
        }
        Ok(())
    }

    /// Gives the row of the record's frame, and that of its tick if it is `logged` or something changed, to `take`.
    ///
    /// # Errors
    /// When `take` refuses one.
    pub(super) fn of_tick<E>(
        &mut self,
        record: &RunRecord,
        logged: bool,
        mut take: impl FnMut(&Row) -> Result<(), E>,
    ) -> Result<(), E> {
        if record.camera_frame.is_some() {
            self.frame(record);
            take(&self.row)?;
        }
        if self.changed(record) || logged {
            self.tick(record);
            take(&self.row)?;
        }
        Ok(())
    }

    fn impact(&mut self, impact: &Impact) {
        self.begin(impact.at);
        self.set(Place::ImpactKick, impact.kick_rad_s());
        self.set(Place::ImpactBefore, impact.velocity_m_s[0]);
        self.set(Place::ImpactAfter, impact.velocity_m_s[1]);
    }

    fn frame(&mut self, record: &RunRecord) {
        let Some(frame) = record.camera_frame else { return };
        self.begin(frame.exposed_at);
        self.set(Place::CameraAngle, frame.angle.degrees());
        self.set(Place::CameraMarks, f64::from(frame.marks_used));
        if let Some(marked) = record.marked {
            self.set(Place::MarksShiftX, marked.shift_m[0]);
            self.set(Place::MarksShiftY, marked.shift_m[1]);
            self.set(Place::MarksResidual, marked.residual_m);
        }
        if let Some(innovation) = record.innovation {
            if innovation.variance_rad2 > 0.0 {
                let mdeg = |rad: f64| 1e3 * rad.to_degrees();
                self.set(Place::Innovation, mdeg(innovation.innovation_rad.into()));
                self.set(Place::InnovationSd, mdeg(math::sqrt(innovation.variance_rad2.into())));
            }
            self.set(Place::Verdict, verdict_word(&innovation));
        }
    }

    /// Whether health, phase or drive are not those of the last record.
    fn changed(&mut self, record: &RunRecord) -> bool {
        let phase = record.task.word();
        let same = self.health.as_ref().is_some_and(|(health, _)| *health == record.health)
            && self.drive == Some(record.applied)
            && self.phase == phase;
        if !same {
            self.health = Some((record.health, format!("{:?}", record.health)));
            self.phase = phase;
            self.drive = Some(record.applied);
        }
        !same
    }

    fn tick(&mut self, record: &RunRecord) {
        self.begin(record.at);
        if let Some(truth) = record.truth {
            self.set(Place::TruthAngle, truth.angle.degrees());
            self.set(Place::TruthRate, truth.rate_rad_s);
            self.set(Place::TruthHeight, truth.height_m);
            self.set(Place::TruthVelocity, truth.velocity_m_s);
            if let Some(tilt) = truth.tilt {
                self.set(Place::TruthTilt, 1e3 * tilt.pose.tilt_rad());
                self.set(Place::TruthShiftX, tilt.pose.shift_m[0]);
                self.set(Place::TruthShiftY, tilt.pose.shift_m[1]);
            }
        }
        if let Some(estimate) = record.estimate {
            self.set(Place::EstimateAngle, estimate.angle.degrees());
            let sd_rad = math::sqrt(f64::from(estimate.angle_rad2));
            self.set(Place::EstimateAngleSd, 1e3 * sd_rad.to_degrees());
            self.set(Place::EstimateRate, estimate.rate_rad_s);
            self.set(Place::EstimateRateSd, math::sqrt(f64::from(estimate.rate_rad2_s2)));
            self.set(Place::EstimateResting, f64::from(u8::from(estimate.resting)));
        }
        let health = self.health.as_ref().map_or_else(String::new, |(_, word)| word.clone());
        self.set(Place::EstimateHealth, Cow::Owned(health));
        self.set(Place::Phase, self.phase.clone());
        if let Task::Rate { wanted_rad_s, reference, .. } = record.task {
            self.set(Place::WantedRate, wanted_rad_s);
            if let Some(reference) = reference {
                self.set(Place::ReferenceAngle, Angle::degrees(reference));
            }
        }
        self.set(Place::DriveMode, mode_word(record.applied));
        self.set(Place::DriveAmplitude, record.applied.amplitude());
        self.set(Place::DriveOffset, record.applied.frequency_offset_hz());
    }
}
