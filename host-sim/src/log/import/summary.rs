//! What was imported, and what in it asks for a second look.

use std::fmt;

use motor_model::{DriveMode, Time, math};
use serde::Serialize;

use super::rows::LeftOut;
use crate::report::table::Table;
use simulation::math::count::real;

/// First values of an instrument that are taken as those of a rotor at rest.
const AT_REST: u64 = 50;
/// Standard deviations of these by which a motion is seen.
const MOVED_SD: f64 = 8.0;
/// Way that no rotor of this kind goes up or down, in m.
const HEIGHT_MAX_M: f64 = 1e-3;
/// Least turn by which a mode shows its sense, in degrees.
const TURN_DEG: f64 = 1.0;

/// An instrument of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportedSource {
    /// Its name.
    pub name: &'static str,
    /// Rows used.
    pub rows: u64,
    /// Rows left out.
    #[serde(flatten)]
    pub left_out: LeftOut,
    /// Mean rate of its rows in 1/s, of the time between the first and the last.
    pub rate_hz: f64,
    /// Longest time from one row to the next, in s.
    pub longest_gap_s: f64,
    /// When that begins, in s of the log.
    pub gap_from_s: f64,
    /// When it first shows a motion, in s of the log; `null` if it never does, or does from the start on.
    pub first_motion_s: Option<f64>,
}

/// The drive of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ImportedDrive {
    /// Rows used, up to the end of the log.
    pub rows: u64,
    /// Rows left out.
    #[serde(flatten)]
    pub left_out: LeftOut,
    /// Time in mode B in the log, in s.
    pub mode_b_s: f64,
    /// Time in mode C, in s.
    pub mode_c_s: f64,
    /// Time without a drive, in s.
    pub off_s: f64,
}

impl fmt::Display for ImportedDrive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rows, left_out, mode_b_s, mode_c_s, off_s } = self;
        let left_out = left_out.empty + left_out.out_of_order + left_out.early;
        writeln!(
            f,
            "drive              {rows} rows: {mode_b_s:.4} s in mode B, {mode_c_s:.4} s in mode C, {off_s:.4} s off; \
             {left_out} rows left out"
        )
    }
}

/// What was imported.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Imported {
    /// Time of the log's 0 on the common clock, in s.
    pub start_s: f64,
    /// Length of the log.
    pub duration_s: f64,
    /// Its instruments.
    pub sources: Vec<ImportedSource>,
    /// Its drive; `null` if none was given.
    pub drive: Option<ImportedDrive>,
    /// What asks for a second look, in sentences.
    pub advice: Vec<String>,
}

/// The rows of one instrument.
#[derive(Clone, Copy, Debug, Default)]
struct Rows {
    count: u64,
    first: Option<Time>,
    last: Option<Time>,
    gap_s: f64,
    gap_from: Time,
    /// Mean and sum of squared deviations at rest (Welford, Technometrics 4 (1962) 419-420).
    rest_mean: f64,
    rest_squares: f64,
    moved: Option<Time>,
    sum: f64,
}

impl Rows {
    fn add(&mut self, at: Time, value: f64) {
        self.first = self.first.or(Some(at));
        if let Some(last) = self.last {
            let gap_s = at.seconds_since(last);
            if gap_s > self.gap_s {
                (self.gap_s, self.gap_from) = (gap_s, last);
            }
        }
        (self.last, self.count, self.sum) = (Some(at), self.count + 1, self.sum + value);
        if self.count <= AT_REST {
            let off = value - self.rest_mean;
            self.rest_mean += off / real(self.count);
            self.rest_squares += off * (value - self.rest_mean);
        } else if self.moved.is_none() {
            let sd = math::sqrt(self.rest_squares / real(AT_REST - 1));
            self.moved = ((value - self.rest_mean).abs() > MOVED_SD * sd).then_some(at);
        }
    }

    fn duration_s(&self) -> f64 {
        self.first.zip(self.last).map_or(0.0, |(first, last)| last.seconds_since(first))
    }

    fn told(&self, name: &'static str, left_out: LeftOut) -> Option<ImportedSource> {
        let seconds = |at: Time| at.seconds_since::<f64>(Time::ZERO);
        (self.count > 1).then(|| ImportedSource {
            name,
            rows: self.count,
            left_out,
            rate_hz: real(self.count - 1) / self.duration_s(),
            longest_gap_s: self.gap_s,
            gap_from_s: seconds(self.gap_from),
            first_motion_s: self.moved.map(seconds),
        })
    }
}

/// What is gathered while a recording is read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Summary {
    camera: Rows,
    vibrometer: Rows,
    /// The last angle, and the angle without jumps of a turn.
    angle_deg: Option<(f64, f64)>,
    /// Turned under modes B and C.
    turned_deg: [f64; 2],
    /// Rows of the drive.
    drive_rows: u64,
    /// Ticks without drive, in mode B, in mode C.
    driven_ticks: [u64; 3],
}

impl Summary {
    /// Adds a frame that came under a drive in `mode`.
    pub(super) fn angle(&mut self, at: Time, angle_deg: f64, mode: Option<DriveMode>) {
        let (last, whole) = self.angle_deg.unwrap_or((angle_deg, angle_deg));
        let change = angle_deg - last;
        let change = change - 360.0 * (change / 360.0).round();
        self.angle_deg = Some((angle_deg, whole + change));
        if let Some(mode) = mode {
            self.turned_deg[usize::from(mode == DriveMode::C)] += change;
        }
        self.camera.add(at, whole + change);
    }

    /// Adds a row of the drive.
    pub(super) fn drive_row(&mut self) {
        self.drive_rows += 1;
    }

    /// Adds a tick under a drive in `mode`.
    pub(super) fn tick(&mut self, mode: Option<DriveMode>) {
        let place = match mode {
            None => 0,
            Some(DriveMode::B) => 1,
            Some(DriveMode::C) => 2,
        };
        self.driven_ticks[place] += 1;
    }

    /// Adds a sample.
    pub(super) fn velocity(&mut self, at: Time, velocity_m_s: f64) {
        self.vibrometer.add(at, velocity_m_s);
    }

    /// What was gathered of a log that ends at `end`; `left_out` is that of camera and vibrometer, and `camera_scale`
    /// what the angles were multiplied by.
    pub(super) fn told(
        &self,
        left_out: [LeftOut; 2],
        camera_scale: f64,
        (start_s, end): (f64, Time),
    ) -> Imported {
        let camera = self.camera.told("camera", left_out[0]);
        let vibrometer = self.vibrometer.told("vibrometer", left_out[1]);
        let advice =
            [clocks(camera.as_ref(), vibrometer.as_ref()), self.sense(camera_scale), self.constant()];
        Imported {
            start_s,
            duration_s: end.seconds_since(Time::ZERO),
            sources: [camera, vibrometer].into_iter().flatten().collect(),
            drive: None,
            advice: advice.into_iter().flatten().collect(),
        }
    }

    /// The drive of the log; `left_out` is that of its rows.
    pub(super) fn drive(&self, left_out: LeftOut) -> ImportedDrive {
        let [off_s, mode_b_s, mode_c_s] =
            self.driven_ticks.map(|ticks| 1e-9 * real(ticks * controller::TICK_NANOS));
        ImportedDrive { rows: self.drive_rows, left_out, mode_b_s, mode_c_s, off_s }
    }

    /// A mode that turned the rotor the other way: B is clockwise, C counter-clockwise.
    fn sense(&self, camera_scale: f64) -> Option<String> {
        let [b, c] = self.turned_deg;
        let wrong = [("B", b, b < -TURN_DEG), ("C", c, c > TURN_DEG)];
        let right = b > TURN_DEG || c < -TURN_DEG;
        let (mode, turned_deg, _) = wrong.into_iter().find(|(_, _, wrong)| *wrong && !right)?;
        let camera = if camera_scale > 0.0 {
            "counts counter-clockwise or looks from below"
        } else {
            "counts clockwise and looks from above"
        };
        Some(format!(
            "Mode {mode} turned the rotor by {turned_deg:+.1} degrees, clockwise positive, which is the other way \
             round: --camera-scale {}, if the camera {camera}.",
            -camera_scale
        ))
    }

    /// A velocity whose mean would carry the rotor away.
    fn constant(&self) -> Option<String> {
        let Rows { sum, count, .. } = self.vibrometer;
        let mean_m_s = if count > 0 { sum / real(count) } else { 0.0 };
        let way_m = mean_m_s * self.vibrometer.duration_s();
        (way_m.abs() > HEIGHT_MAX_M).then(|| {
            format!(
                "The mean velocity is {mean_m_s:+.4} m/s, which would have carried the rotor {:.1} mm away: it is a \
                 constant of the instrument, add {:+.4} to --vibrometer-offset.",
                1e3 * way_m.abs(),
                -mean_m_s
            )
        })
    }
}

/// Two instruments that see the first motion at different times.
fn clocks(camera: Option<&ImportedSource>, vibrometer: Option<&ImportedSource>) -> Option<String> {
    let (camera, vibrometer) = (camera?, vibrometer?);
    let later_s = camera.first_motion_s? - vibrometer.first_motion_s?;
    // The vibrometer sees the first hops, the camera a turn that is larger than its noise.
    let apart_s = 5.0 / camera.rate_hz + 2e-3;
    (later_s.abs() > apart_s).then(|| {
        format!(
            "The camera sees the first motion {:.4} s {} the vibrometer: if their clocks differ, add \
             about {later_s:.4} to the offset of --camera-clock.",
            later_s.abs(),
            if later_s > 0.0 { "after" } else { "before" }
        )
    })
}

impl fmt::Display for Imported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "imported           {:.4} s, from {:.6} s of the recording on",
            self.duration_s, self.start_s
        )?;
        let mut table = Table::new(&[
            "",
            "rows",
            "empty",
            "out of order",
            "too early",
            "rows a second",
            "longest gap, s",
            "from, s",
            "first motion, s",
        ]);
        for source in &self.sources {
            table.push(vec![
                source.name.to_owned(),
                source.rows.to_string(),
                source.left_out.empty.to_string(),
                source.left_out.out_of_order.to_string(),
                source.left_out.early.to_string(),
                format!("{:.3}", source.rate_hz),
                format!("{:.6}", source.longest_gap_s),
                format!("{:.4}", source.gap_from_s),
                source.first_motion_s.map_or_else(|| "-".to_owned(), |at_s| format!("{at_s:.4}")),
            ]);
        }
        f.write_str(&table.text())?;
        self.drive.iter().try_for_each(|drive| drive.fmt(f))?;
        self.advice.iter().try_for_each(|advice| writeln!(f, "look               {advice}"))
    }
}
