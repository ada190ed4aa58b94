//! A log in MCAP as tables: one for each channel, with the names of its messages' fields.

use std::path::PathBuf;

use host_sim::log::{LogHead, LogMessage, LogPart, open};
use motor_model::Time;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Error;
use crate::interruption::interruptible;
use crate::scene::PyScene;
use crate::tables::{Column, Table};

/// A field of a message, which knows its column.
trait Field: Sized {
    /// The column of so many fields.
    fn column(cells: Vec<Self>) -> Column;
}

macro_rules! fields {
    ($($kind:ty => $of:expr,)+) => {
        $(impl Field for $kind {
            fn column(cells: Vec<Self>) -> Column {
                let of: fn(Vec<Self>) -> Column = $of;
                of(cells)
            }
        })+
    };
}

/// Numbers of another type as those of a column.
fn numbers<N>(cells: Vec<N>, of: fn(N) -> f64) -> Column {
    Column::Numbers(cells.into_iter().map(of).collect())
}

#[expect(clippy::cast_precision_loss, reason = "an angle's units: 53 bits hold 2^20 turns to the last unit")]
fn of_units(units: i64) -> f64 {
    units as f64
}

fields! {
    f64 => Column::Numbers,
    f32 => |cells| numbers(cells, f64::from),
    u32 => |cells| numbers(cells, f64::from),
    i64 => |cells| numbers(cells, of_units),
    bool => Column::Flags,
    String => Column::Words,
}

macro_rules! channels {
    ($($message:ident $topic:literal: $($field:ident)+;)+) => {
        /// The messages read so far, with their times, by channel.
        #[derive(Default)]
        #[allow(non_snake_case, reason = "the names are those of the messages")]
        struct Messages {
            $($message: Vec<(f64, host_sim::log::channels::$message)>,)+
        }

        impl Messages {
            fn add(&mut self, at_s: f64, message: LogMessage) {
                match message {
                    $(LogMessage::$message(message) => self.$message.push((at_s, message)),)+
                }
            }

            /// A table of each channel that has messages, by its topic.
            fn tables(self) -> Vec<(&'static str, Table)> {
                let mut tables = Vec::new();
                $(if !self.$message.is_empty() {
                    let table = Table::default()
                        .with("time_s", Column::Numbers(self.$message.iter().map(|(at_s, _)| *at_s).collect()))
                        $(.with(stringify!($field), Field::column(
                            self.$message.iter().map(|(_, message)| message.$field.clone()).collect(),
                        )))+;
                    tables.push(($topic, table));
                })+
                tables
            }
        }
    };
}

channels! {
    Impact "/truth/impact": velocity_before_m_s velocity_after_m_s rate_before_rad_s rate_after_rad_s;
    VibrometerSample "/vibrometer": velocity_m_s arrived_after_ns;
    CameraFrame "/camera": angle_deg angle_units marks_used arrived_after_ns residual_steps;
    Marks "/camera/marks": angle_deg angle_sd_deg shift_x_m shift_y_m residual_m marks_used;
    Innovation "/innovation": innovation_rad variance_rad2 normalised_squared verdict used arrived_after_ns;
    Truth "/truth": angle_deg angle_units own_axis_angle_deg rate_rad_s height_m velocity_m_s;
    Tilt "/truth/tilt": slope_x slope_y shift_x_m shift_y_m tilt_mrad;
    Estimate "/estimate": angle_deg angle_units rate_rad_s angle_rad2 angle_rate_rad2_s rate_rad2_s2 resting
        angle_sd_mdeg error_mdeg age_ns;
    Reference "/reference": wanted_rad_s angle_deg;
    Health "/health": health level;
    Task "/phase": phase;
    Drive "/drive": mode amplitude frequency_offset_hz asked_mode asked_amplitude;
}

/// What a log holds: command, filter, scene, how the run ended, its result in JSON, and its tables by topic.
type Read<'py> = (String, String, PyScene, Option<String>, Option<String>, Bound<'py, PyDict>);

#[pyfunction]
pub fn read_log(py: Python<'_>, path: PathBuf) -> Result<Read<'_>, Error> {
    let (head, messages, ended, result) = interruptible(py, None, |watch| {
        let (head, mut reader) = open(&path)?;
        let (mut messages, mut ended, mut result) = (Messages::default(), None, None);
        while let Some(part) = reader.next_part()? {
            watch.check();
            match part {
                LogPart::Message(at, message) => messages.add(at.seconds_since(Time::ZERO), message),
                LogPart::Result(json) => result = Some(json),
                LogPart::Ended(how) => ended = Some(how),
            }
        }
        Ok((head, messages, ended, result))
    })?;
    let tables = PyDict::new(py);
    for (topic, table) in messages.tables() {
        tables.set_item(topic, table.into_dict(py)?)?;
    }
    let LogHead { command, filter, scene, .. } = head;
    Ok((command, filter, PyScene(scene), ended, result, tables))
}
