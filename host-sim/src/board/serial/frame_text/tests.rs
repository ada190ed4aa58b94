use proptest::prelude::*;

use super::*;

fn refusal(lines: &[&str]) -> String {
    let mut text = FrameText::new("frames.txt");
    let mut read = lines.iter().map(|line| text.read(line));
    read.find_map(Result::err).expect("a bad line").to_string()
}

#[test]
fn exact_frames_of_lines() {
    let mut text = FrameText::new("-");
    let mut read = |line| text.read(line).unwrap();
    assert_eq!(read("# time_s angle_deg residual"), None);
    assert_eq!(read(" \t"), None);
    let frame = |exposed_nanos, degrees, residual| {
        Some(HostFrame { exposed_nanos, angle: Angle::from_degrees(degrees), residual })
    };
    assert_eq!(read("1.5 90 7\r"), frame(1_500_000_000, 90.0, 7));
    assert_eq!(read("1.6, -90.25"), frame(1_600_000_000, -90.25, 0));
    assert_eq!(read("\t2e0\t0\t255\n"), frame(2_000_000_000, 0.0, 255));
    let sent = read("3 45 1").unwrap().on_board(17);
    assert_eq!((sent.exposed_at.nanos(), sent.residual, sent.marks_used), (17, 1, CameraFrame::ALL_MARKS));
}

#[test]
fn exact_bad_lines_are_refused_by_place_value_and_bounds() {
    for (lines, expected) in [
        (vec!["1 2 3", "", "5"], "frames.txt:3: 1 fields, expected time_s, angle_deg and residual"),
        (vec!["1 2 3 4"], "frames.txt:1: 4 fields, expected time_s, angle_deg and residual"),
        (vec!["1,,3"], "frames.txt:1: angle_deg =  is no number, bounds -1e6 to 1e6 deg"),
        (vec!["x 2 3"], "frames.txt:1: time_s = x is no number, bounds 0 to 9e9 s"),
        (vec!["-1 2 3"], "frames.txt:1: time_s = -1 is outside its bounds 0 to 9e9 s"),
        (vec!["1 nan 3"], "frames.txt:1: angle_deg = nan is outside its bounds -1e6 to 1e6 deg"),
        (vec!["1 inf 3"], "frames.txt:1: angle_deg = inf is outside its bounds -1e6 to 1e6 deg"),
        (vec!["1 2 256"], "frames.txt:1: residual = 256 is outside its bounds 0 to 255, whole"),
        (vec!["1 2 0.5"], "frames.txt:1: residual = 0.5 is outside its bounds 0 to 255, whole"),
        (vec!["1 2 x"], "frames.txt:1: residual = x is no number, bounds 0 to 255, whole"),
        (
            vec!["2 2 3", "2 2 3"],
            "frames.txt:2: time_s = 2 is not after the line before, bounds: more than 2",
        ),
        (
            vec!["2 2 3", "1 2 3"],
            "frames.txt:2: time_s = 1 is not after the line before, bounds: more than 2",
        ),
    ] {
        assert_eq!(refusal(&lines), expected);
    }
    let long = format!("1 2 {}", "0".repeat(LINE_BYTES_MAX));
    assert_eq!(refusal(&[&long]), "frames.txt:1: the line has more than 256 bytes");
}

proptest! {
    /// What is written is read, the angle to the bit.
    #[test]
    fn law_written_frames_are_read(
        time_us in 0..9_000_000_000_000_000_u64,
        angle_deg in -1e6..1e6_f64,
        residual: u8,
        separator in prop::sample::select(vec![" ", "\t", ",", " , "]),
    ) {
        let line = format!("{}.{:06}{separator}{angle_deg}{separator}{residual}",
            time_us / 1_000_000, time_us % 1_000_000);
        let frame = FrameText::new("-").read(&line).unwrap().unwrap();
        // At the end of the bounds a double has steps of 2 us, and its product with 1e9 steps of 1 us.
        prop_assert!(frame.exposed_nanos.abs_diff(1000 * time_us.cast_signed()) <= 1500, "{line}: {frame:?}");
        prop_assert_eq!(frame.angle, Angle::from_degrees(angle_deg));
        prop_assert_eq!(frame.residual, residual);
    }

    /// Any text is a frame within its bounds, nothing, or an error with its place.
    #[test]
    fn law_any_text_is_read_or_refused(
        lines in prop::collection::vec(
            ".{0,40}|[0-9 ,.e+-]{0,40}|[0-9]{1,3} -?[0-9]{1,8} [0-9]{1,3}",
            1..8,
        ),
    ) {
        let mut text = FrameText::new("any");
        let mut before = -1;
        for (index, line) in lines.iter().enumerate() {
            match text.read(line) {
                Ok(None) => {}
                Ok(Some(frame)) => {
                    prop_assert!(frame.exposed_nanos > before, "{line}");
                    before = frame.exposed_nanos;
                    prop_assert!(frame.exposed_nanos <= 9_000_000_000_000_000_000);
                    prop_assert!(frame.angle.degrees().abs() <= 1e6 + 1e-6);
                }
                Err(error) => {
                    let place = format!("any:{}: ", index + 1);
                    prop_assert!(error.to_string().starts_with(&place), "{error}");
                }
            }
        }
    }
}
