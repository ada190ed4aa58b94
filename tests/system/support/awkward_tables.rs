//! Tables as a laboratory has them, made of the log of a run, and the flags by which `import` reads them.
//!
//! The camera counts the other way round from 12.5 degrees on, has a clock of its own that is 12.5 ms ahead and runs
//! 35 ppm fast, is blind for 10 ms and leaves cells empty; the vibrometer shows 20 mm/s more, in a table with
//! semicolons and decimal commas.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const OFFSET_S: f64 = 12.5e-3;
const DRIFT: f64 = 35e-6;

/// Writes camera.csv, ldv.csv and drive.csv of the log `own.csv` of a folder; frames with an angle.
pub fn write(folder: &Path) -> u64 {
    let text = fs::read_to_string(folder.join("own.csv")).unwrap();
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    let [time, angle, velocity, mode, amplitude] =
        ["time_s", "camera_angle_deg", "vibrometer_m_s", "drive_mode", "drive_amplitude"].map(place);
    let (mut camera, mut ldv) = ("stamp_ms,phi_deg\n".to_owned(), "time_s;v_mm_s\n".to_owned());
    let (mut drives, mut frames, mut last) =
        ("time_s,drive_mode,drive_amplitude\n".to_owned(), 0, String::new());
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let at_s: f64 = cells[time].parse().unwrap();
        if let Ok(angle_deg) = cells[angle].parse::<f64>() {
            let shown_ms = 1e3 * (OFFSET_S + at_s * (1.0 + DRIFT));
            let seen =
                if (0.08..0.081).contains(&at_s) { String::new() } else { (12.5 - angle_deg).to_string() };
            if !(0.05..0.06).contains(&at_s) {
                frames += u64::from(!seen.is_empty());
                writeln!(camera, "{shown_ms:.6},{seen}").unwrap();
            }
        }
        if let Ok(velocity_m_s) = cells[velocity].parse::<f64>() {
            let shown = (1e3 * velocity_m_s + 20.0).to_string().replace('.', ",");
            writeln!(ldv, "{at_s:.9};{shown}").unwrap();
        }
        let drive = format!("{},{}", cells[mode], cells[amplitude]);
        if !cells[mode].is_empty() && drive != last {
            writeln!(drives, "{at_s:.9},{drive}").unwrap();
            last = drive;
        }
    }
    for (name, table) in [("camera.csv", camera), ("ldv.csv", ldv), ("drive.csv", drives)] {
        fs::write(folder.join(name), table).unwrap();
    }
    frames
}

/// The tables, without corrections.
pub const TABLES: [&str; 12] = [
    "import",
    "--camera",
    "camera.csv",
    "--camera-time",
    "stamp_ms",
    "--camera-angle",
    "phi_deg",
    "--vibrometer",
    "ldv.csv",
    "--vibrometer-velocity",
    "v_mm_s",
    "--drive=drive.csv",
];

/// The corrections of the tables, with a clock of the camera.
pub fn corrections(clock: &str) -> [&str; 8] {
    [
        "--camera-scale",
        "-1",
        "--camera-offset",
        "12.5",
        "--camera-clock",
        clock,
        "--vibrometer-offset",
        "-0.02",
    ]
}

/// The clock of the camera.
pub const CLOCK: &str = "0.0125,35";
