//! `import`: a user's own recording into a log.

use std::ffi::OsStr;
use std::path::PathBuf;

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, Error, ValueHint};

use super::log_args::LogArgs;
use super::{Format, SceneArgs};
use crate::cli::CommandError;
use crate::log::LogError;
use crate::log::import::{
    Clock, ColumnName, DriveTable, Drives, Import, MeasuredTable, Measurements, Recording,
};
use crate::report::files;

/// A clock as `OFFSET_S` or `OFFSET_S,DRIFT_PPM`.
#[derive(Clone, Debug)]
struct ClockParser;

/// Largest drift of a clock, in parts per million.
const DRIFT_MAX_PPM: f64 = 1e5;

impl TypedValueParser for ClockParser {
    type Value = Clock;

    fn parse_ref(&self, command: &Command, flag: Option<&Arg>, value: &OsStr) -> Result<Clock, Error> {
        let text = value.to_string_lossy();
        let (offset, drift) = text.split_once(',').unwrap_or((&text, "0"));
        let number = |text: &str| text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        match (number(offset), number(drift)) {
            (Some(offset_s), Some(drift_ppm)) if drift_ppm.abs() <= DRIFT_MAX_PPM => {
                Ok(Clock { offset_s, drift_ppm })
            }
            _ => {
                let name = flag.and_then(Arg::get_long).unwrap_or_default();
                let why = format!(
                    "--{name} = {text} is not S or S,PPM with finite numbers, PPM within {DRIFT_MAX_PPM} to either side"
                );
                Err(Error::raw(ErrorKind::ValueValidation, why).with_cmd(command))
            }
        }
    }
}

/// A finite number.
fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("{text} is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("{text} is not finite")) }
}

#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// Table of the camera's angles, clockwise positive: CSV with `,`, `;` or tabs and one line of names
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    camera: Option<PathBuf>,
    /// Its column of times, of the middle of each exposure. The unit is the end of the name (s, ms, us, ns), or stands
    /// behind a colon: `stamp:us`
    #[arg(long, value_name = "COLUMN", default_value = "time_s", requires = "camera")]
    camera_time: ColumnName,
    /// Its column of angles: deg, mdeg, rad, mrad, urad, turn
    #[arg(long, value_name = "COLUMN", default_value = "angle_deg", requires = "camera")]
    camera_angle: ColumnName,
    /// What the angles are multiplied by: -1 of a camera that counts counter-clockwise or looks from below
    #[arg(long, value_name = "X", default_value = "1", requires = "camera")]
    #[arg(value_parser = finite, allow_negative_numbers = true)]
    camera_scale: f64,
    /// What is added to them then, in degrees
    #[arg(long, value_name = "DEG", default_value = "0", requires = "camera")]
    #[arg(value_parser = finite, allow_negative_numbers = true)]
    camera_offset: f64,
    /// The camera's clock: what it shows at 0 of the other clocks, in s, and by how many ppm it runs faster
    #[arg(long, value_name = "S[,PPM]", default_value = "0", requires = "camera")]
    #[arg(value_parser = ClockParser, allow_hyphen_values = true)]
    camera_clock: Clock,
    /// Table of the vibrometer's velocities, upwards positive
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    vibrometer: Option<PathBuf>,
    /// Its column of times
    #[arg(long, value_name = "COLUMN", default_value = "time_s", requires = "vibrometer")]
    vibrometer_time: ColumnName,
    /// Its column of velocities: `m_s`, `mm_s`, `um_s`
    #[arg(long, value_name = "COLUMN", default_value = "velocity_m_s", requires = "vibrometer")]
    vibrometer_velocity: ColumnName,
    /// What the velocities are multiplied by: -1 for a wrong sign
    #[arg(long, value_name = "X", default_value = "1", requires = "vibrometer")]
    #[arg(value_parser = finite, allow_negative_numbers = true)]
    vibrometer_scale: f64,
    /// What is added to them then, in m/s
    #[arg(long, value_name = "M_S", default_value = "0", requires = "vibrometer")]
    #[arg(value_parser = finite, allow_negative_numbers = true)]
    vibrometer_offset: f64,
    /// The vibrometer's clock
    #[arg(long, value_name = "S[,PPM]", default_value = "0", requires = "vibrometer")]
    #[arg(value_parser = ClockParser, allow_hyphen_values = true)]
    vibrometer_clock: Clock,
    /// Table of the drives: each row holds from its time on
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    drive: Option<PathBuf>,
    /// Its column of times
    #[arg(long, value_name = "COLUMN", default_value = "time_s", requires = "drive")]
    drive_time: ColumnName,
    /// Its column of modes: b, c, off. A row without a mode is no row of the drive
    #[arg(long, value_name = "COLUMN", default_value = "drive_mode", requires = "drive")]
    drive_mode: String,
    /// Its column of amplitudes, of full drive
    #[arg(long, value_name = "COLUMN", default_value = "drive_amplitude", requires = "drive")]
    drive_amplitude: String,
    /// Its column of frequencies: Hz, kHz. Without it, and where a cell is empty, the drive has the frequency of the
    /// design
    #[arg(long, value_name = "COLUMN", requires = "drive")]
    drive_frequency: Option<ColumnName>,
    /// The drive's clock
    #[arg(long, value_name = "S[,PPM]", default_value = "0", requires = "drive")]
    #[arg(value_parser = ClockParser, allow_hyphen_values = true)]
    drive_clock: Clock,
    /// What was recorded: motor, or stator (without a rotor, the vibrometer on a tooth)
    #[arg(long)]
    model: Option<String>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl ImportArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("import", &[("record.model", &self.model)])?;
        let recording = self.recording();
        self.log.apart_from([&self.camera, &self.vibrometer, &self.drive].into_iter().flatten())?;
        let import = Import::new(&recording, scene)?;
        let mut log = self.log.open("import", import.scene())?;
        let imported = match import.run(&mut log) {
            Err(LogError::Ended) => return Err(log.stopped().into()),
            other => other?,
        };
        let json = files::json_line(&imported);
        let logged = log.finish(&json)?;
        Ok(files::print(&self.format.of(format!("{imported}{logged}"), json))?)
    }

    fn recording(&self) -> Recording<'static> {
        let camera = self.camera.as_ref().map(|path| MeasuredTable {
            path: path.clone(),
            time: self.camera_time.clone(),
            value: self.camera_angle.clone(),
            scale: self.camera_scale,
            offset: self.camera_offset,
            clock: self.camera_clock,
        });
        let vibrometer = self.vibrometer.as_ref().map(|path| MeasuredTable {
            path: path.clone(),
            time: self.vibrometer_time.clone(),
            value: self.vibrometer_velocity.clone(),
            scale: self.vibrometer_scale,
            offset: self.vibrometer_offset,
            clock: self.vibrometer_clock,
        });
        let drive = self.drive.as_ref().map(|path| DriveTable {
            path: path.clone(),
            time: self.drive_time.clone(),
            mode: self.drive_mode.clone(),
            amplitude: self.drive_amplitude.clone(),
            frequency: self.drive_frequency.clone(),
            clock: self.drive_clock,
        });
        Recording {
            camera: camera.map(Measurements::Table),
            vibrometer: vibrometer.map(Measurements::Table),
            drive: drive.map(Drives::Table),
        }
    }
}
