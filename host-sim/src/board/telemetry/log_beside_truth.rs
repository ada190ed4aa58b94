//! A table of the log's entries, each with the true angle and rate of its tick.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use controller::PositionLoop;
use motor_model::{Angle, math};

use super::{LogEntry, picture};
use crate::board::BoardError;
use crate::report::OutputError;
use crate::report::files::Output;
use simulation::math::statistics::MeanSquare;
use simulation::runs::closed_loop::PositioningMoment;
use simulation::world::pose::{Pose, RotorTilt};

/// Names of the columns. Those from the estimated angle to the error are of estimates. The last five are of a rotor
/// that tilts: slopes, and shift and height of its mass centre; empty of one that does not.
const COLUMNS: [&str; 16] = [
    "tick",
    "time_s",
    "level",
    "entry",
    "text",
    "true_angle_deg",
    "true_rate_rad_s",
    "estimated_angle_deg",
    "estimated_rate_rad_s",
    "sigma_mdeg",
    "error_mdeg",
    "true_slope_x",
    "true_slope_y",
    "true_shift_x_m",
    "true_shift_y_m",
    "true_height_m",
];

/// Most points of a picture: a few minutes of a run. Later ones are in the table only.
pub(super) const POINTS_MAX: usize = 200_000;

/// A logged estimate, and the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Logged {
    pub(super) time_s: f64,
    pub(super) true_deg: f64,
    pub(super) estimated_deg: f64,
    pub(super) sigma_mdeg: f64,
    pub(super) error_mdeg: f64,
}

/// Writes the table, and keeps the points of its picture.
#[derive(Debug)]
pub struct LogBesideTruth {
    csv: csv::Writer<Output>,
    /// How often each kind of entry came.
    pub(super) counts: BTreeMap<String, u64>,
    errors_mdeg: MeanSquare,
    pub(super) estimates: Vec<Logged>,
    /// Time and innovation in milli-degrees: of frames used, and of frames refused.
    pub(super) innovations: [Vec<(f64, f64)>; 2],
    /// When the drive changed, and what it is from then on.
    pub(super) drives: Vec<(f64, String)>,
    pub(super) end_s: f64,
}

impl LogBesideTruth {
    /// A table that will be at `path` after [`Self::publish`].
    ///
    /// # Errors
    /// When nothing can be written there.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let mut record = Self {
            csv: csv::Writer::from_writer(Output::create(path)?),
            counts: BTreeMap::new(),
            errors_mdeg: MeanSquare::default(),
            estimates: Vec::new(),
            innovations: [Vec::new(), Vec::new()],
            drives: Vec::new(),
            end_s: 0.0,
        };
        record.write(COLUMNS.map(str::to_owned))?;
        Ok(record)
    }

    fn write(&mut self, row: [String; COLUMNS.len()]) -> Result<(), OutputError> {
        self.csv.write_record(row).map_err(|error| self.csv.get_ref().unwritable(error.into()))
    }

    /// Adds the entries of the tick that the plant has just made.
    ///
    /// # Errors
    /// When an entry is of another tick, or the table cannot be written.
    pub fn take(&mut self, entries: &[LogEntry], truth: &PositioningMoment) -> Result<(), BoardError> {
        let tick = truth.at.nanos() / PositionLoop::TICK_NANOS;
        self.end_s = truth.seconds();
        for entry in entries {
            if entry.tick != tick {
                let theirs = entry.tick;
                return Err(BoardError::Board(format!("logs tick {theirs} when the plant is at {tick}")));
            }
            *self.counts.entry(entry.kind().to_owned()).or_default() += 1;
            self.take_one(entry, truth)?;
        }
        Ok(())
    }

    fn take_one(&mut self, entry: &LogEntry, truth: &PositioningMoment) -> Result<(), BoardError> {
        let time_s = truth.seconds();
        let logged = estimate(entry, truth);
        if let Some(logged) = logged {
            self.errors_mdeg.add(logged.error_mdeg);
            put(&mut self.estimates, logged);
        } else if let Some(rad) = entry.field::<f64>("rad") {
            let [used, refused] = &mut self.innovations;
            let points = if entry.text.starts_with("innovation refused") { refused } else { used };
            put(points, (time_s, 1e3 * rad.to_degrees()));
        } else if entry.kind() == "drive" {
            let drive = entry.text.split(' ').nth(1).unwrap_or_default();
            put(&mut self.drives, (time_s, drive.to_owned()));
        }
        let of = |value: fn(&Logged) -> f64| logged.as_ref().map_or(String::new(), |l| value(l).to_string());
        let tilt = truth.tilt.map(|RotorTilt { pose: Pose { slope, shift_m, .. }, height_m }| {
            [slope[0], slope[1], shift_m[0], shift_m[1], height_m].map(|value| format!("{value:e}"))
        });
        let [slope_x, slope_y, shift_x_m, shift_y_m, height_m] = tilt.unwrap_or_default();
        let rate: Option<f32> = entry.field("rate_rad_s");
        self.write([
            entry.tick.to_string(),
            format!("{time_s:.5}"),
            entry.level.to_owned(),
            entry.kind().to_owned(),
            entry.text.clone(),
            truth.angle.degrees().to_string(),
            truth.rate_rad_s.to_string(),
            of(|logged| logged.estimated_deg),
            rate.map_or(String::new(), |rate| rate.to_string()),
            of(|logged| logged.sigma_mdeg),
            of(|logged| logged.error_mdeg),
            slope_x,
            slope_y,
            shift_x_m,
            shift_y_m,
            height_m,
        ])?;
        Ok(())
    }

    /// The picture as an SVG document.
    ///
    /// # Errors
    /// When it cannot be laid out.
    pub fn svg(&self) -> Result<String, OutputError> {
        picture::svg(self)
    }

    /// Puts the table at its path.
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

fn put<T>(points: &mut Vec<T>, point: T) {
    if points.len() < POINTS_MAX {
        points.push(point);
    }
}

/// The estimate of an entry with the truth, if the entry is an estimate.
fn estimate(entry: &LogEntry, truth: &PositioningMoment) -> Option<Logged> {
    let angle = Angle::from_units(entry.field("angle_units")?);
    let variance_rad2: f64 = entry.field("angle_rad2")?;
    Some(Logged {
        time_s: truth.seconds(),
        true_deg: truth.angle.degrees(),
        estimated_deg: angle.degrees(),
        sigma_mdeg: 1e3 * math::sqrt(variance_rad2).to_degrees(),
        error_mdeg: 1e3 * angle.minus(truth.angle).degrees(),
    })
}

impl fmt::Display for LogBesideTruth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds: Vec<String> = self.counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        let all: u64 = self.counts.values().sum();
        writeln!(f, "log                {all} entries: {}", kinds.join(", "))?;
        let rms_mdeg = self.errors_mdeg.root();
        writeln!(f, "logged estimates   {rms_mdeg:.2} mdeg rms off the truth of their tick")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller::{PositioningPhase, TickReport, Wait};
    use estimator::Health;
    use motor_model::{DriveCommand, Time};

    fn moment(tick: u64, degrees: f64) -> PositioningMoment {
        let report = TickReport {
            estimate: None,
            health: Health::Good,
            camera: None,
            command: DriveCommand::OFF,
            applied: DriveCommand::OFF,
            phase: PositioningPhase::Settling(Wait::Rest),
        };
        let at = Time::from_nanos(tick * PositionLoop::TICK_NANOS);
        let angle = Angle::from_degrees(degrees);
        let pose = Pose { slope: [1e-3, -2e-3], shift_m: [3e-6, -4e-6], ..Pose::LEVEL };
        let tilt = (tick == 7).then_some(RotorTilt { pose, height_m: 5e-6 });
        PositioningMoment { at, angle, own_axis_angle: angle, rate_rad_s: 0.5, tilt, report }
    }

    fn entry(tick: u64, text: String) -> LogEntry {
        LogEntry { tick, level: "info", text }
    }

    #[test]
    fn exact_a_row_has_the_truth_of_its_tick_and_its_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("telemetry.csv");
        let mut record = LogBesideTruth::create(&path).unwrap();
        let units = Angle::from_degrees(10.003).units();
        let text = format!("estimate angle_units={units} rate_rad_s=0.25 angle_rad2=1e-10 resting=false");
        record.take(&[entry(7, text), entry(7, "phase settling".to_owned())], &moment(7, 10.0)).unwrap();
        assert!(record.take(&[entry(7, "phase cruise".to_owned())], &moment(8, 10.0)).is_err());
        assert_eq!(record.counts.values().copied().collect::<Vec<_>>(), [1, 1]);
        assert!(record.to_string().contains("3.00 mdeg rms"), "{record}");
        record.publish().unwrap();
        let mut csv = csv::Reader::from_path(&path).unwrap();
        assert_eq!(csv.headers().unwrap(), COLUMNS.as_slice());
        let rows: Vec<_> = csv.records().map(Result::unwrap).collect();
        let number = |column: usize| rows[0][column].parse::<f64>().unwrap();
        assert_eq!((&rows[0][0], &rows[0][1], &rows[0][3]), ("7", "0.00007", "estimate"));
        assert!((number(5) - 10.0).abs() < 1e-6 && (number(6) - 0.5).abs() < 1e-12);
        assert!((number(7) - 10.003).abs() < 1e-6 && (number(8) - 0.25).abs() < 1e-12);
        assert!((number(9) - 1e-2_f64.to_degrees()).abs() < 1e-9 && (number(10) - 3.0).abs() < 1e-3);
        assert_eq!((&rows[1][4], &rows[1][7], &rows[1][10]), ("phase settling", "", ""));
        let of_tilt: Vec<f64> = (11..16).map(number).collect();
        assert_eq!(of_tilt, [1e-3, -2e-3, 3e-6, -4e-6, 5e-6]);
    }
}
