//! A recording as tables: what the instruments delivered, under which drives, and the truth beside it.

use std::ops::ControlFlow;

use motor_model::{DriveCommand, Time};
use simulation::runs::record::{Observer, RunRecord};

use crate::course::RunObserver;
use crate::drives::signed;
use crate::errors::Error;
use crate::tables::{NumberColumns, Table};

fn seconds(at: Time) -> f64 {
    at.seconds_since(Time::ZERO)
}

/// Keeps what a recording holds.
pub struct RecordedTables<'a> {
    /// The log, and the watch.
    pub observer: RunObserver<'a>,
    every: u64,
    ticks: u64,
    last: Option<DriveCommand>,
    camera: NumberColumns<2>,
    vibrometer: NumberColumns<2>,
    drive: NumberColumns<3>,
    truth: NumberColumns<3>,
}

impl<'a> RecordedTables<'a> {
    /// Empty tables; the truth is kept every `every` ticks, never for 0.
    pub fn new(observer: RunObserver<'a>, every: u64) -> Self {
        Self {
            observer,
            every,
            ticks: 0,
            last: None,
            camera: NumberColumns::new(["time_s", "angle_deg"]),
            vibrometer: NumberColumns::new(["time_s", "velocity_m_s"]),
            drive: NumberColumns::new(["time_s", "drive", "frequency_offset_hz"]),
            truth: NumberColumns::new(["time_s", "angle_deg", "rate_rad_s"]),
        }
    }

    /// Ends the log, and gives camera, vibrometer, drive and truth.
    ///
    /// # Errors
    /// When the log's end cannot be written.
    pub fn finish(self, result: &str) -> Result<[Table; 4], Error> {
        self.observer.finish(result)?;
        Ok([self.camera.into(), self.vibrometer.into(), self.drive.into(), self.truth.into()])
    }
}

impl Observer for RecordedTables<'_> {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        for sample in record.ldv_samples {
            self.vibrometer.push([seconds(sample.taken_at), f64::from(sample.velocity_m_s)]);
        }
        if let Some(frame) = record.camera_frame {
            self.camera.push([seconds(frame.exposed_at), frame.angle.degrees()]);
        }
        if self.last != Some(record.applied) {
            self.last = Some(record.applied);
            let offset_hz = f64::from(record.applied.frequency_offset_hz());
            self.drive.push([seconds(record.at), signed(record.applied), offset_hz]);
        }
        self.ticks += 1;
        if let Some(truth) = record.truth
            && self.every > 0
            && self.ticks.is_multiple_of(self.every)
        {
            self.truth.push([seconds(record.at), truth.angle.degrees(), truth.rate_rad_s]);
        }
        self.observer.take(|| *record)
    }
}
