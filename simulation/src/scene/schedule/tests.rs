use proptest::prelude::*;

use super::*;

fn read(text: &str) -> Schedule {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn part(drive: Option<(DriveMode, f64, Option<[f64; 2]>)>, duration_s: f64) -> SchedulePart {
    let drive = drive.map(|(mode, amplitude, frequency_hz)| ScheduledDrive { mode, amplitude, frequency_hz });
    SchedulePart { drive, duration_s }
}

#[test]
fn exact_parts_of_a_schedule() {
    let expected = [
        part(Some((DriveMode::B, 1.0, None)), 0.5),
        part(None, 0.3),
        part(Some((DriveMode::C, 0.5, Some([7440.0, 7480.0]))), 2.0),
        part(Some((DriveMode::B, 0.25, Some([6310.5; 2]))), 1e-3),
    ];
    let text = "b:1.0 for 0.5,off for .3 , c:0.5@7440..7480 for 2, b:0.25 @ 6310.5 for 1e-3";
    assert_eq!(read(text).parts(), expected);
    assert!((read(text).duration_s() - 2.801).abs() < 1e-12);
}

#[test]
fn exact_repetitions_stand_one_after_the_other() {
    let (b, off) = (part(Some((DriveMode::B, 1.0, None)), 0.1), part(None, 0.05));
    assert_eq!(read("(b:1 for 0.1, off for 0.05) x2, off for 0.05x2").parts(), [b, off, b, off, off, off]);
    assert_eq!(read("((b:1 for 0.1)x2, off for 0.05)").parts(), [b, b, off]);
    assert_eq!(read("b:1 for 0.1 x2, off for 0.05").to_string(), "b:1 for 0.1 x2, off for 0.05");
}

#[test]
fn exact_refusals_name_the_column_and_what_is_possible() {
    for (text, column, problem) in [
        ("", 1, "no drive; it ends here"),
        ("d:1 for 1", 1, "no drive; found d:1"),
        ("b for 1", 3, ": is missing; found for"),
        ("b:2 for 1", 3, "amplitude 2 is outside its bounds"),
        ("b:1", 4, "for is missing; it ends here"),
        ("b:1 for", 8, "a time in s is missing; it ends here"),
        ("b:1 for 0", 9, "a part of 0 s is outside its bounds"),
        ("b:1 for -1", 9, "a part of -1 s is outside its bounds"),
        ("b:NaN for 1", 3, "an amplitude is missing; found NaN"),
        ("b:1@0 for 1", 5, "frequency 0 Hz is outside its bounds"),
        ("b:1@6000.. for 1", 12, "a frequency in Hz is missing; found for"),
        ("b:1 for 1 off for 1", 11, "a comma is missing; found off"),
        ("(b:1 for 1", 11, ") is missing; it ends here"),
        ("b:1 for 1 x0", 12, "0 is no count"),
        ("(off for 1) x1.5", 14, "1.5 is no count"),
        ("off for 1e-5 x10001", 15, "10001 is no count"),
        ("(off for 1e-5 x200) x200", 25, "more than 10000 parts; it ends here"),
        ("off for 600 x2", 15, "it takes 1200 s in all"),
        ("((((((((((off for 1))))))))))", 10, "brackets are too deep; found ("),
    ] {
        let error = text.parse::<Schedule>().unwrap_err();
        assert_eq!((error.column, error.problem.as_str()), (column, problem), "{text}");
        assert!(!error.possible.is_empty());
    }
}

fn any_part() -> impl Strategy<Value = SchedulePart> {
    let frequency = prop_oneof![
        Just(None),
        (1.0..1e6).prop_map(|hz| Some([hz; 2])),
        (1.0..1e6, 1.0..1e6).prop_map(|(from, until)| Some([from, until])),
    ];
    let mode = prop_oneof![Just(DriveMode::B), Just(DriveMode::C)];
    let drive = proptest::option::of((mode, 0.0..=1.0, frequency));
    (drive, 1e-5..10.0).prop_map(|(drive, duration_s)| part(drive, duration_s))
}

proptest! {
    #[test]
    fn law_the_text_of_a_schedule_gives_it_again(parts in proptest::collection::vec(any_part(), 1..20)) {
        let schedule = Schedule { parts };
        prop_assert_eq!(read(&schedule.to_string()), schedule);
    }

    /// Whatever is given: a schedule within its bounds, or an error whose column lies in the text.
    #[test]
    fn law_any_text_is_read_or_refused(text in "[bcofrx:@.,()0-9 ]{0,40}|.{0,40}") {
        match text.parse::<Schedule>() {
            Ok(schedule) => {
                prop_assert!(!schedule.parts().is_empty() && schedule.parts().len() <= PARTS_MAX);
                prop_assert!(schedule.duration_s() <= DURATION_MAX_S);
            }
            Err(error) => prop_assert!((1..=text.chars().count() + 1).contains(&error.column)),
        }
    }
}
