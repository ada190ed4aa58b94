//! Tables with what real ones have, against what a log should hold.

use std::fs;
use std::ops::ControlFlow;

use motor_model::DriveMode;
use tempfile::TempDir;

use super::*;

/// What arrived: time of the tick, frame, samples, drive.
#[derive(Default)]
struct Kept {
    frames: Vec<(Time, CameraFrame)>,
    samples: Vec<(Time, LdvSample)>,
    drives: Vec<(Time, DriveCommand)>,
    ticks: u64,
}

impl Observer for Kept {
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.ticks += 1;
        assert_eq!(record.at, Time::from_nanos(self.ticks * TICK_NANOS), "every tick has its record");
        self.frames.extend(record.camera_frame.map(|frame| (record.at, frame)));
        self.samples.extend(record.ldv_samples.iter().map(|sample| (record.at, *sample)));
        if self.drives.last().is_none_or(|(_, last)| *last != record.applied) {
            self.drives.push((record.at, record.applied));
        }
        ControlFlow::Continue(())
    }
}

fn table(folder: &TempDir, name: &str, text: &str) -> std::path::PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    path
}

/// Lines of a table.
fn lines(count: u32, line: impl Fn(u32) -> String) -> String {
    (0..count).flat_map(|n| [line(n), "\n".to_owned()]).collect()
}

fn measured(path: std::path::PathBuf, time: &str, value: &str) -> MeasuredTable {
    let column = |text: &str| text.parse::<ColumnName>().unwrap_or_else(|never| match never {});
    MeasuredTable {
        path,
        time: column(time),
        value: column(value),
        scale: 1.0,
        offset: 0.0,
        clock: Clock::default(),
    }
}

fn import(recording: &Recording) -> Result<(Kept, Imported, Scene), LogError> {
    let mut kept = Kept::default();
    let import = Import::new(recording, Scene::default())?;
    let imported = import.run(&mut kept)?;
    Ok((kept, imported, import.scene().clone()))
}

/// A table of drives with the columns `time_s`, `mode` and `amplitude`.
fn drive_table(path: std::path::PathBuf, mode: &str, amplitude: &str) -> DriveTable {
    DriveTable {
        path,
        time: "time_s".parse().unwrap_or_else(|never| match never {}),
        mode: mode.to_owned(),
        amplitude: amplitude.to_owned(),
        frequency: None,
        clock: Clock::default(),
    }
}

/// 1,000 frames a second of a rotor at 100 deg/s, in ms and milliradians, with a wrong sign and 5 degrees more.
fn camera(folder: &TempDir, text: impl Fn(u32) -> String) -> MeasuredTable {
    let rows: String = (0..100).map(text).collect();
    measured(table(folder, "camera.csv", &format!("t_ms,phi_mrad\n{rows}")), "t_ms", "phi_mrad")
}

/// Units, sign, offset and clock: frame n is of n ms, at 0.1 n degrees.
#[test]
fn exact_values_and_times() {
    let folder = TempDir::new().unwrap();
    let clock = Clock { offset_s: 12.5, drift_ppm: 1000.0 };
    let shown_ms = |n: u32| 1e3 * (12.5 + 1e-3 * f64::from(n) * 1.001);
    let rows = |n: u32| {
        let mrad = 1e3 * (-(0.1 * f64::from(n) - 5.0)).to_radians();
        format!("{},{mrad}\n", shown_ms(n))
    };
    let camera = MeasuredTable { scale: -1.0, offset: 5.0, clock, ..camera(&folder, rows) };
    let (kept, imported, scene) =
        import(&Recording { camera: Some(Measurements::Table(camera)), ..Recording::default() }).unwrap();
    assert_eq!(kept.frames.len(), 100);
    let tick_ms = 0.01;
    for (n, (arrived, frame)) in (0_u32..).zip(&kept.frames) {
        let at_ms = 1e3 * frame.exposed_at.seconds_since::<f64>(Time::ZERO);
        assert!((at_ms - (f64::from(n) + tick_ms)).abs() < 1e-5, "{n}: {at_ms}");
        // Units of 2^-32 turn are 8.4e-8 degrees.
        assert!((frame.angle.degrees() - 0.1 * f64::from(n)).abs() < 1e-7, "{n}: {frame:?}");
        // One frame of latency, to the end of a tick.
        let late_ms = 1e3 * arrived.seconds_since::<f64>(frame.exposed_at);
        assert!((1.0 - 1e-5..1.0 + tick_ms + 1e-5).contains(&late_ms), "{n}: {late_ms}");
    }
    assert!(
        (scene.number("camera.frame_rate_hz") - 1000.0).abs() < 0.02,
        "{}",
        scene.number("camera.frame_rate_hz")
    );
    assert_eq!((scene.choice("ldv.installed"), scene.integer("camera.marks")), ("no", 1));
    assert!((imported.start_s + 1e-5).abs() < 1e-8, "{}", imported.start_s);
}

/// Gaps, empty cells, NaN, rows twice, rows in the wrong order: left out and counted, the others are there.
#[test]
fn exact_what_cannot_be_used_is_counted() {
    let folder = TempDir::new().unwrap();
    let rows = |n: u32| match n {
        10 => "10,\n".to_owned(),
        11 => "11,NaN\n".to_owned(),
        12 => ",3\n".to_owned(),
        // Cells without a name that are empty say nothing.
        20 => "19,7,,\n".to_owned(),
        21 => "18.5,7\n".to_owned(),
        40..60 => String::new(),
        n => format!("{n},{n}\r\n"),
    };
    let camera = camera(&folder, rows);
    let (kept, imported, _) =
        import(&Recording { camera: Some(Measurements::Table(camera)), ..Recording::default() }).unwrap();
    let source = &imported.sources[0];
    assert_eq!((source.rows, source.left_out.empty, source.left_out.out_of_order), (75, 3, 2));
    assert_eq!(kept.frames.len(), 75);
    assert!(
        (source.longest_gap_s - 0.021).abs() < 1e-9 && (source.gap_from_s - 0.03901).abs() < 1e-9,
        "{source:?}"
    );
    assert!(imported.duration_s < 0.102, "{imported:?}");
}

/// Series in memory give the records of a table with the same rows. A value that is not finite counts as an empty cell.
#[test]
fn dual_series_in_memory_are_a_table() {
    let folder = TempDir::new().unwrap();
    let angle = |n: u32| if n == 7 { f64::NAN } else { 0.25 * f64::from(n) };
    let times_s: Vec<f64> = (0..50).map(|n| 3.0 + 0.002 * f64::from(n)).collect();
    let angles_deg: Vec<f64> = (0..50).map(angle).collect();
    let drives = [(0.0, DriveCommand::full(DriveMode::B)), (3.05, DriveCommand::OFF)];
    let rows = lines(50, |n| format!("{},{}", 3.0 + 0.002 * f64::from(n), angle(n)));
    let tabled = measured(table(&folder, "a.csv", &format!("t_s,a_deg\n{rows}")), "t_s", "a_deg");
    let series = MeasuredSeries { name: "camera", time_s: &times_s, values: &angles_deg };
    let of = |camera| {
        let drive = Some(Drives::Series(&drives));
        let (kept, imported, scene) =
            import(&Recording { camera: Some(camera), drive, vibrometer: None }).unwrap();
        assert_eq!((kept.frames.len(), imported.sources[0].left_out.empty, kept.drives.len()), (49, 1, 2));
        (kept.frames, kept.drives, kept.ticks, scene)
    };
    assert_eq!(of(Measurements::Table(tabled)), of(Measurements::Series(series)));
    let one = MeasuredSeries { time_s: &times_s[..1], values: &angles_deg[..1], ..series };
    let camera = Some(Measurements::Series(one));
    let refused = import(&Recording { camera, ..Recording::default() }).map(|_| ()).unwrap_err();
    assert_eq!(refused.to_string(), "camera has 1 rows with time and value; 2 are the least");
}

/// Semicolons, decimal commas, a byte-order mark, a comment and blanks; a drive that began before.
#[test]
fn exact_a_table_of_a_spreadsheet_and_its_drive() {
    let folder = TempDir::new().unwrap();
    let rows = lines(50, |n| format!("0,{:05} ; {n},5", 10 * n));
    let text = format!("\u{feff}time_s;v_mm_s\n# the vibrometer\n{rows}");
    let vibrometer = measured(table(&folder, "v.csv", &text), "time_s", "v_mm_s");
    let drives = "time_s,drive_mode,drive_amplitude\n-1,c,0.5\n0.002,off,\n0.003,B,1\n";
    let drive = drive_table(table(&folder, "drive.csv", drives), "drive_mode", "drive_amplitude");
    let recording = Recording {
        vibrometer: Some(Measurements::Table(vibrometer)),
        drive: Some(Drives::Table(drive)),
        camera: None,
    };
    let (kept, _, scene) = import(&recording).unwrap();
    for (n, (_, sample)) in (0_u16..).zip(&kept.samples) {
        assert!(
            (f64::from(sample.velocity_m_s) - 1e-3 * (f64::from(n) + 0.5)).abs() < 1e-8,
            "{n}: {sample:?}"
        );
    }
    assert_eq!(kept.samples.len(), 50);
    let ms = |ms: u64| Time::from_nanos(ms * 1_000_000 + TICK_NANOS);
    let expected = [
        (Time::from_nanos(TICK_NANOS), DriveCommand::saturating(DriveMode::C, 0.5)),
        (ms(2), DriveCommand::OFF),
        (ms(3), DriveCommand::full(DriveMode::B)),
    ];
    assert_eq!(kept.drives, expected);
    assert!((scene.number("ldv.sample_rate_hz") - 10_000.0).abs() < 1e-9);
}

/// A table that shows instruments and drive in rows of their own, as `--log own.csv` writes them: the rows without a
/// mode are no rows of the drive, and the drive is told by its rows and its time in each mode.
#[test]
fn exact_a_row_without_a_mode_leaves_the_drive_as_it_is() {
    let folder = TempDir::new().unwrap();
    let mode = |n: u32| match n {
        10 => "off,0",
        100 => "B,1",
        400 => "c,0.5",
        600 => "none,",
        _ => ",",
    };
    let rows = lines(1000, |n| format!("{},{},{}", f64::from(n) * 1e-4, 0.1 * f64::from(n), mode(n)));
    let path = table(&folder, "own.csv", &format!("time_s,a_deg,mode,amplitude\n{rows}"));
    let recording = |mode| Recording {
        camera: Some(Measurements::Table(measured(path.clone(), "time_s", "a_deg"))),
        drive: Some(Drives::Table(drive_table(path.clone(), mode, "amplitude"))),
        vibrometer: None,
    };
    let (kept, imported, _) = import(&recording("mode")).unwrap();
    let modes: Vec<Option<DriveMode>> = kept.drives.iter().map(|(_, drive)| drive.mode()).collect();
    assert_eq!(modes, [None, Some(DriveMode::B), Some(DriveMode::C), None]);
    let drive = imported.drive.as_ref().unwrap();
    assert_eq!((drive.rows, drive.left_out.empty), (4, 996));
    let close = |seconds: f64, expected: f64| assert!((seconds - expected).abs() < 2e-5, "{drive:?}");
    close(drive.mode_b_s, 0.03);
    close(drive.mode_c_s, 0.02);
    let said =
        "drive              4 rows: 0.0300 s in mode B, 0.0200 s in mode C, 0.0500 s off; 996 rows left out";
    assert!(imported.to_string().contains(said), "{imported}");
}

/// A column that is not one of modes: what stands there is named, and so is a column with nothing in it.
#[test]
fn exact_a_column_that_has_no_mode_is_refused() {
    let folder = TempDir::new().unwrap();
    let rows = lines(100, |n| format!("{},{n},,{}", f64::from(n) * 1e-3, if n == 50 { "Used" } else { "" }));
    let path = table(&folder, "own.csv", &format!("time_s,a_deg,phase,verdict\n{rows}"));
    for (mode, said) in [
        ("verdict", "own.csv:52: column \"verdict\": \"Used\" is not a mode: b, c or off; --drive-mode"),
        (
            "phase",
            "own.csv has no drive: no row has a time, a mode in \"phase\" and an amplitude in \"a_deg\"",
        ),
    ] {
        let recording = Recording {
            camera: Some(Measurements::Table(measured(path.clone(), "time_s", "a_deg"))),
            drive: Some(Drives::Table(drive_table(path.clone(), mode, "a_deg"))),
            vibrometer: None,
        };
        let error = import(&recording).map(|_| ()).unwrap_err();
        let refused = format!("{error}; {}", error.hint().unwrap_or_default());
        assert!(refused.contains(said), "{said}: {refused}");
    }
}

/// Samples of a rotor at rest and then hopping, at 10,000 a second, and what is said of a constant and of clocks.
#[test]
fn exact_advice_names_its_flag() {
    let folder = TempDir::new().unwrap();
    let noise = |n: u32| 1e-4 * f64::from(n * 7919 % 13);
    let hop = |n: u32| if n > 1000 { 0.1 * motor_model::math::sin_cos(f64::from(n)).0 } else { 0.0 };
    let samples = lines(5000, |n| format!("{},{}", n * 100, 0.02 + noise(n) + hop(n)));
    let vibrometer = measured(table(&folder, "v.csv", &format!("t_us,v_m_s\n{samples}")), "t_us", "v_m_s");
    let angle = |n: u32| if n > 300 { -0.5 * f64::from(n - 300) } else { 1e-3 * f64::from(n % 3) };
    let frames = lines(500, |n| format!("{n},{}", angle(n)));
    let camera = measured(table(&folder, "c.csv", &format!("t_ms,angle_deg\n{frames}")), "t_ms", "angle_deg");
    let drive = drive_table(table(&folder, "d.csv", "time_s,m,a\n0.1,b,1\n"), "m", "a");
    let recording = Recording {
        camera: Some(Measurements::Table(camera.clone())),
        vibrometer: Some(Measurements::Table(vibrometer)),
        drive: Some(Drives::Table(drive)),
    };
    let advised = |recording| import(recording).unwrap().1.advice.join(" ");
    let advice = advised(&recording);
    // A camera whose values have the other sign already is not told to change it to the same.
    let rows = lines(500, |n| format!("{n},{}", -angle(n)));
    let path = table(&folder, "other.csv", &format!("t_ms,angle_deg\n{rows}"));
    let other = Recording {
        camera: Some(Measurements::Table(MeasuredTable { path, scale: -1.0, ..camera })),
        ..recording.clone()
    };
    let other = advised(&other);
    assert!(other.contains("--camera-scale 1,") && !other.contains("--camera-scale -1"), "{other}");
    for said in [
        "after the vibrometer",
        "add about 0.2",
        "Mode B turned the rotor by -",
        "--camera-scale -1",
        "add -0.02",
    ] {
        assert!(advice.contains(said), "{said}: {advice}");
    }
}

#[test]
fn exact_refusals_name_file_line_column_and_what_is_possible() {
    let folder = TempDir::new().unwrap();
    let refusal = |text: &str, time: &str, value: &str| {
        let camera = measured(table(&folder, "camera.csv", text), time, value);
        let camera = Some(Measurements::Table(camera));
        let error = import(&Recording { camera, ..Recording::default() }).map(|_| ()).unwrap_err();
        format!("{error}; {}", error.hint().unwrap_or_default())
    };
    for (text, time, value, said) in [
        (
            "t_s,a_deg\n1,2\n2,much\n",
            "t_s",
            "a_deg",
            "camera.csv:3: column \"a_deg\": \"much\" is not a number",
        ),
        (
            "t_s,a_deg\n1,2\n",
            "t_s",
            "b_deg",
            "has no column \"b_deg\"; --camera-angle names one of t_s, a_deg",
        ),
        (
            "t_s,a_deg\n1,2\n",
            "t_ms",
            "a_deg",
            "has no column \"t_ms\"; --camera-time names one of t_s, a_deg",
        ),
        // A decimal comma in a table with commas.
        (
            "t_s,a_deg\n1,2\n2,3\n0,000,1,5\n",
            "t_s",
            "a_deg",
            "camera.csv:4 has 4 cells, and 2 columns have a name",
        ),
        (
            "t_s,a_deg\n1,2\n1,3\n1,4\n",
            "t_s",
            "a_deg",
            "has 3 rows with time and value, all at the same time",
        ),
        ("t,a_deg\n1,2\n", "t", "a_deg", "does not end in a unit; t:UNIT, with one of ms, us, ns, s"),
        ("t_s,a_deg\n1,2\n", "t_s", "a_deg:m", "has no unit \"m\"; a_deg:UNIT"),
        ("t_s,a_deg\n1,2\n2,\n", "t_s", "a_deg", "has 1 rows with time and value; 2 are the least"),
        (
            "t_s,a_deg\n1,2\n1.01,3\n1.02,3\n70,4\n",
            "t_s",
            "a_deg",
            "no measurement for more than a minute after 0.0",
        ),
        ("", "t_s", "a_deg", "has no column \"a_deg\"; a table begins with a line of names"),
    ] {
        let refused = refusal(text, time, value);
        assert!(refused.contains(said), "{said}: {refused}");
    }
    let nothing = import(&Recording::default()).map(|_| ()).unwrap_err();
    assert!(nothing.to_string().contains("nothing that was measured"));
}
