//! Camera frames as lines of text.
//!
//! ```text
//! # time_s angle_deg residual
//! 1795587146.918400 12.3456 3
//! 1795587146.919400 12.4001 3
//! ```
//!
//! | field | unit | bounds | what it is |
//! |---|---|---|---|
//! | `time_s` | s | 0 to 9e9, rising | middle of the exposure by the host's clock, since 1970-01-01 UTC |
//! | `angle_deg` | deg | -1e6 to 1e6 | angle of the marks, clockwise positive; whole turns do not matter |
//! | `residual` | 0.1 um | 0 to 255 | [`CameraFrame::residual`]: 0 where the camera does not tell; may be left out |
//!
//! The times of a recording are since any time: only their differences count.
//!
//! Spaces, tabs or a comma stand between fields. Empty lines and lines that begin with `#` are passed over.

use estimator::CameraFrame;
use motor_model::{Angle, Time};

/// Bytes of a line at most.
pub const LINE_BYTES_MAX: usize = 256;

/// A camera frame by a clock of the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HostFrame {
    /// Middle of the exposure in ns: of a line as it stands there, of a [`super::FrameSource`] by the host's clock.
    pub exposed_nanos: i64,
    /// The angle.
    pub angle: Angle,
    /// [`CameraFrame::residual`].
    pub residual: u8,
}

impl HostFrame {
    /// The frame for the board, exposed at `exposed_nanos` of its time.
    pub fn on_board(&self, exposed_nanos: u64) -> CameraFrame {
        let frame = CameraFrame::new(Time::from_nanos(exposed_nanos), self.angle);
        CameraFrame { residual: self.residual, ..frame }
    }
}

/// Why a line is no frame.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameTextError {
    /// Too few or too many fields.
    #[error("{at}: {found} fields, expected time_s, angle_deg and residual")]
    Fields {
        /// File and line.
        at: Place,
        /// Number of fields.
        found: usize,
    },
    /// A field that is no number.
    #[error("{at}: {field} = {value} is no number, bounds {bounds}")]
    NoNumber {
        /// File and line.
        at: Place,
        /// The field.
        field: &'static str,
        /// What stands there.
        value: String,
        /// Least and greatest value, with the unit.
        bounds: &'static str,
    },
    /// A number outside its bounds.
    #[error("{at}: {field} = {value} is outside its bounds {bounds}")]
    OutOfBounds {
        /// File and line.
        at: Place,
        /// The field.
        field: &'static str,
        /// What stands there.
        value: String,
        /// Least and greatest value, with the unit.
        bounds: &'static str,
    },
    /// A frame that was not exposed after the one before it.
    #[error("{at}: time_s = {value} is not after the line before, bounds: more than {before}")]
    NotLater {
        /// File and line.
        at: Place,
        /// What stands there.
        value: String,
        /// What stands in the line before.
        before: String,
    },
    /// A line that does not end.
    #[error("{at}: the line has more than {LINE_BYTES_MAX} bytes")]
    TooLong {
        /// File and line.
        at: Place,
    },
    /// The file cannot be read on.
    #[error("{at}: {reason}")]
    Unreadable {
        /// File and line.
        at: Place,
        /// The system's reason.
        reason: String,
    },
}

/// File and line, as `file:line`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u64,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}:{}", self.file, self.line)
    }
}

/// Reads the lines of a file, one after the other.
#[derive(Clone, Debug)]
pub struct FrameText {
    at: Place,
    before: Option<(i64, String)>,
}

impl FrameText {
    /// The reader of `file`, before its first line.
    pub fn new(file: &str) -> Self {
        Self { at: Place { file: file.to_owned(), line: 0 }, before: None }
    }

    /// File and number of the last line.
    pub fn place(&self) -> Place {
        self.at.clone()
    }

    /// The frame of the next line; `None` of an empty line or a comment.
    ///
    /// # Errors
    /// When the line is neither.
    pub fn read(&mut self, line: &str) -> Result<Option<HostFrame>, FrameTextError> {
        self.at.line += 1;
        let at = || self.at.clone();
        if line.len() > LINE_BYTES_MAX {
            return Err(FrameTextError::TooLong { at: at() });
        }
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            return Ok(None);
        }
        // Two commas in a row are an empty field; spaces in a row are one separator.
        let fields: Vec<&str> = if line.contains(',') {
            line.split(',').map(str::trim).collect()
        } else {
            line.split_whitespace().collect()
        };
        let (time, angle, residual) = match fields[..] {
            [time, angle] => (time, angle, "0"),
            [time, angle, residual] => (time, angle, residual),
            _ => return Err(FrameTextError::Fields { at: at(), found: fields.len() }),
        };
        let time_s = self.number("time_s", time, (0.0, 9e9), "0 to 9e9 s")?;
        let angle_deg = self.number("angle_deg", angle, (-1e6, 1e6), "-1e6 to 1e6 deg")?;
        let residual = self.residual(residual)?;
        #[expect(clippy::cast_possible_truncation, reason = "9e18 is below 2^63")]
        let exposed_nanos = (time_s * 1e9).round() as i64;
        if let Some((_, before)) = self.before.as_ref().filter(|(before, _)| *before >= exposed_nanos) {
            let (value, before) = (time.to_owned(), before.clone());
            return Err(FrameTextError::NotLater { at: at(), value, before });
        }
        self.before = Some((exposed_nanos, time.to_owned()));
        Ok(Some(HostFrame { exposed_nanos, angle: Angle::from_degrees(angle_deg), residual }))
    }

    fn number(
        &self,
        field: &'static str,
        text: &str,
        (min, max): (f64, f64),
        bounds: &'static str,
    ) -> Result<f64, FrameTextError> {
        let (at, value) = (self.at.clone(), text.to_owned());
        match text.parse::<f64>() {
            Ok(number) if (min..=max).contains(&number) => Ok(number),
            Ok(_) => Err(FrameTextError::OutOfBounds { at, field, value, bounds }),
            Err(_) => Err(FrameTextError::NoNumber { at, field, value, bounds }),
        }
    }

    fn residual(&self, text: &str) -> Result<u8, FrameTextError> {
        let (at, value, field) = (self.at.clone(), text.to_owned(), "residual");
        let bounds = "0 to 255, whole";
        match (text.parse::<u8>(), text.parse::<f64>()) {
            (Ok(residual), _) => Ok(residual),
            (Err(_), Ok(_)) => Err(FrameTextError::OutOfBounds { at, field, value, bounds }),
            (Err(_), Err(_)) => Err(FrameTextError::NoNumber { at, field, value, bounds }),
        }
    }
}

#[cfg(test)]
mod tests;
