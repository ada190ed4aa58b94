//! The samples of an open-loop run as CSV: one row every 50 us, units in the names of the columns.

use std::path::Path;

use crate::report::OutputError;
use crate::report::files::Output;
use simulation::math::spectrum::SAMPLE_RATE_HZ;
use simulation::runs::RunError;
use simulation::runs::simulate::{MotorSample, Observer, drive_name};
use simulation::world::pose::Pose;

/// Names of the columns.
const COLUMNS: [&str; 9] = [
    "time_s",
    "height_m",
    "velocity_m_s",
    "angle_deg",
    "rate_rad_s",
    "tooth_height_0_m",
    "tooth_height_1_m",
    "drive",
    "amplitude",
];

/// Names of the columns that a rotor has which tilts: slopes, and shift of its mass centre.
const TILT_COLUMNS: [&str; 4] = ["slope_x", "slope_y", "shift_x_m", "shift_y_m"];

/// Writes the samples of a run as CSV.
#[derive(Debug)]
pub struct SamplesCsv {
    csv: csv::Writer<Output>,
    begun: bool,
}

impl SamplesCsv {
    /// A file that will be at `path` after [`Self::publish`].
    ///
    /// # Errors
    /// When nothing can be written there.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        Ok(Self { csv: csv::Writer::from_writer(Output::create(path)?), begun: false })
    }

    /// Writes the names of the columns, before the first sample.
    fn begin(&mut self, sample: &MotorSample) -> Result<(), OutputError> {
        let of_tilt = if sample.pose.is_some() { &TILT_COLUMNS[..] } else { &[] };
        let columns: Vec<String> = COLUMNS.iter().chain(of_tilt).map(|&name| name.to_owned()).collect();
        self.begun = true;
        self.write(&columns)
    }

    fn write(&mut self, row: &[String]) -> Result<(), OutputError> {
        self.csv.write_record(row).map_err(|error| self.csv.get_ref().unwritable(error.into()))
    }

    /// Writes the rest, and puts the file in its place.
    ///
    /// # Errors
    /// When the rest cannot be written.
    pub fn publish(mut self) -> Result<(), OutputError> {
        self.csv.flush().map_err(|source| self.csv.get_ref().unwritable(source))?;
        match self.csv.into_inner() {
            Ok(output) => output.publish(),
            Err(refused) => Err(OutputError::StandardOutput(refused.into_error())),
        }
    }
}

impl Observer for SamplesCsv {
    fn interval_s(&self) -> Option<f64> {
        Some(1.0 / SAMPLE_RATE_HZ)
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        if !self.begun {
            self.begin(sample)?;
        }
        let [first, second] = sample.tooth_heights_m;
        let mut row = vec![
            // Times are whole steps of at least 1 ns.
            format!("{:.9}", sample.time_s),
            format!("{:e}", sample.height_m),
            format!("{:e}", sample.velocity_m_s),
            format!("{}", sample.angle_deg),
            format!("{}", sample.rate_rad_s),
            format!("{first:e}"),
            format!("{second:e}"),
            drive_name(sample.drive).to_owned(),
            format!("{}", sample.drive.amplitude()),
        ];
        if let Some(Pose { slope, shift_m, .. }) = &sample.pose {
            row.extend(slope.iter().chain(shift_m).map(|value| format!("{value:e}")));
        }
        self.write(&row)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::runs::simulate::{OpenLoopRun, simulate};
    use simulation::scene::Scene;

    #[test]
    fn exact_rows_and_columns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        let mut scene = Scene::default();
        scene.set("simulate.duration_s", "0.01").unwrap();
        scene.set("simulate.settle_s", "0").unwrap();
        let mut record = SamplesCsv::create(&path).unwrap();
        simulate(&OpenLoopRun::from_scene(&scene).unwrap(), &mut record).unwrap();
        assert!(!path.exists(), "nothing is there before the end");
        record.publish().unwrap();

        let mut csv = csv::Reader::from_path(&path).unwrap();
        assert_eq!(csv.headers().unwrap(), COLUMNS.as_slice());
        let rows: Vec<_> = csv.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 201);
        let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
        assert!((number(200, 0) - 0.01).abs() < 1e-12);
        assert!(number(0, 1).abs() <= 0.0, "a run starts at rest");
        assert!((1..5).all(|column| number(200, column).is_finite()));
        assert_eq!(&rows[7][7], "c");
    }
}
