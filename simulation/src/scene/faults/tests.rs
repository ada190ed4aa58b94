//! Words of faults: what they mean, what is refused and where, and that keys say the same.

use super::*;
use crate::scene::Scene;
use proptest::prelude::*;

fn fault(kind: FaultKind, from_s: f64, until_s: Option<f64>) -> Fault {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small and positive")]
    let at = |s: f64| Time::from_nanos((s * 1e9).round() as u64);
    Fault { kind, from: at(from_s), until: until_s.map_or(Fault::NEVER, at) }
}

#[test]
fn exact_words_mean_their_faults() {
    use FaultKind::{Camera, Drift, Drive, Jolt, Mark, Rub, Stuck, Vibrometer};
    for (word, expected) in [
        ("camera:lost@1.0..2.0", fault(Camera(CameraFault::Lost), 1.0, Some(2.0))),
        ("camera:off", fault(Camera(CameraFault::Lost), 0.0, None)),
        ("camera:offset", fault(Camera(CameraFault::Offset(90.0)), 0.0, None)),
        ("camera:offset:-10@..0.5", fault(Camera(CameraFault::Offset(-10.0)), 0.0, Some(0.5))),
        ("mark2:false:2e-5@1", fault(Mark(2, MarkFault::False(2e-5)), 1.0, None)),
        ("mark16:exchanged", fault(Mark(16, MarkFault::Exchanged), 0.0, None)),
        ("ldv:stuck@0.5..", fault(Vibrometer(VibrometerFault::Stuck), 0.5, None)),
        ("ldv:garbage", fault(Vibrometer(VibrometerFault::NotANumber), 0.0, None)),
        ("drive:weak:0.7@0.05..", fault(Drive(DriveFault::Weak(0.7)), 0.05, None)),
        ("drive:dead", fault(Drive(DriveFault::Dead(None)), 0.0, None)),
        ("drive:dead:c@2..3", fault(Drive(DriveFault::Dead(Some(DriveMode::C))), 2.0, Some(3.0))),
        ("stator:drift:-1@1..3", fault(Drift(-1.0), 1.0, Some(3.0))),
        ("rotor:jolt:-2.5@0.3", fault(Jolt(-2.5), 0.3, None)),
        ("rotor:stuck@0.3..0.35", fault(Stuck, 0.3, Some(0.35))),
        ("hub:rub:0.8@1..", fault(Rub(0.8), 1.0, None)),
        ("camera:intermittent:0.5@1..2", fault(Camera(CameraFault::Intermittent(0.5)), 1.0, Some(2.0))),
        ("camera:garbage:0.2", fault(Camera(CameraFault::Outliers(0.2)), 0.0, None)),
        ("camera:delayed:5e-3", fault(Camera(CameraFault::Delayed(5e-3)), 0.0, None)),
        ("ldv:intermittent:1", fault(Vibrometer(VibrometerFault::Intermittent(1.0)), 0.0, None)),
        ("ldv:outliers:0.1", fault(Vibrometer(VibrometerFault::Outliers(0.1)), 0.0, None)),
        ("ldv:offset:-0.01", fault(Vibrometer(VibrometerFault::Offset(-0.01)), 0.0, None)),
    ] {
        assert_eq!(word.parse(), Ok(expected), "{word}");
    }
}

/// How a word may say when.
const TIMES: &str = "@FROM, @FROM.., @..UNTIL or @FROM..UNTIL, in s";

#[test]
fn exact_refusals_name_word_column_and_what_is_possible() {
    for (word, column, problem, possible) in [
        ("", 1, "it lacks what fails", "camera, mark1 to mark16, ldv, drive, stator, rotor, hub"),
        (
            "camra:lost",
            1,
            "camra is nothing that fails",
            "camera, mark1 to mark16, ldv, drive, stator, rotor, hub",
        ),
        ("mark17:lost", 1, "mark17 is no mark", "mark1 to mark16"),
        ("drive", 6, "drive lacks how it fails", "drive:weak:PART, drive:dead[:b|:c], drive:swapped"),
        (
            "camera:lots@1..2",
            8,
            "lots is no fault of camera",
            "camera:lost, camera:stuck, camera:zeros, camera:offset[:DEG], camera:intermittent:PART, \
             camera:outliers:PART, camera:delayed:S",
        ),
        (
            "mark2:lots",
            7,
            "lots is no fault of mark2",
            "mark2:lost, mark2:stuck, mark2:false[:M], mark2:exchanged",
        ),
        ("ldv:stuck:3", 10, "stuck takes no value, and :3 is one", "ldv:stuck"),
        ("drive:weak@1", 11, "weak lacks its value", "drive:weak:PART"),
        ("drive:weak:2", 12, "weak = 2 is outside its bounds 0 to 1", "drive:weak:PART"),
        ("drive:weak:much", 12, "weak = much is not a number, bounds 0 to 1", "drive:weak:PART"),
        ("drive:dead:a", 12, "a is no mode", "b or c"),
        ("rotor:jolt:1@1..2", 15, "it happens at one time", "@FROM, in s"),
        ("ldv:lost@2..1", 13, "the fault ends at 1 s and begins at 2 s", TIMES),
        ("ldv:lost@", 10, "a time is missing", TIMES),
        ("ldv:lost@..", 10, "a time is missing", TIMES),
        ("ldv:lost@1..soon", 13, "soon is not a time in s", TIMES),
        ("ldv:lost@-1..", 10, "-1 s is outside its bounds 0 to 100000 s", TIMES),
    ] {
        let refused = word.parse::<Fault>().unwrap_err();
        let expected = FaultWordError {
            word: word.to_owned(),
            column,
            problem: problem.to_owned(),
            possible: possible.to_owned(),
        };
        assert_eq!(refused, expected, "{word}");
    }
}

/// Where a word goes wrong in a file and on the command line.
#[test]
fn exact_a_scene_s_refusal_is_one_line() {
    let mut scene = Scene::default();
    let of_file =
        scene.set_all("seed = 2\nfaults = [\"ldv:lost\",\n  \"drive:weak\"]", "scene.toml".as_ref());
    assert_eq!(
        of_file.unwrap_err().one_line(),
        "error: scene.toml:3:3: fault drive:weak, column 11: weak lacks its value; hint: possible: drive:weak:PART"
    );
    for text in ["faults = [3]", "faults = 3", "faults = [[\"ldv:lost\"]]"] {
        assert!(scene.set_all(text, "scene.toml".as_ref()).is_err(), "{text}");
    }
    assert_eq!(scene.faults(), []);
}

/// A list in a file, a list on the command line, and one by one; a later list takes the place of an earlier one.
#[test]
fn exact_lists_of_words() {
    let words = ["camera:lost@1..2", "drive:weak:0.7@0.05.."];
    let mut of_file = Scene::default();
    of_file.set_all(&format!("faults = {words:?}"), "scene.toml".as_ref()).unwrap();
    let mut by_set = Scene::default();
    by_set.set("faults", &words.join(", ")).unwrap();
    let mut one_by_one = Scene::default();
    for word in words {
        one_by_one.add_fault(word, &|_| Ok(()), crate::scene::Origin::Flag).unwrap();
    }
    assert_eq!(of_file, by_set);
    assert_eq!(of_file, one_by_one);
    assert_eq!(of_file.value_text(KEY), format!("{words:?}"));
    assert_eq!(of_file.faults().iter().map(Fault::to_string).collect::<Vec<_>>(), words);
    of_file.set_all("faults = [\"ldv:zeros\"]", "scene.toml".as_ref()).unwrap();
    assert_eq!(of_file.value_text(KEY), "[\"ldv:zeros\"]");
}

/// Each fault by keys is that of a word.
#[test]
fn dual_keys_and_words_agree() {
    for (keys, word) in [
        ("camera.lost_from_s=1 camera.lost_until_s=2", "camera:lost@1..2"),
        ("camera.fault=offset camera.fault_offset_deg=5 camera.fault_until_s=3", "camera:offset:5@..3"),
        (
            "camera.mark_fault=false camera.faulty_mark=2 camera.mark_fault_from_s=1 camera.mark_fault_until_s=2",
            "mark2:false@1..2",
        ),
        ("ldv.fault=inverted ldv.fault_from_s=0.5 ldv.fault_until_s=0.6", "ldv:inverted@0.5..0.6"),
        ("fault.drive_gain=0.7 fault.from_s=0.05", "drive:weak:0.7@0.05.."),
        ("fault.dead_mode=c", "drive:dead:c"),
        ("fault.modes=swapped", "drive:swapped"),
        ("fault.drift_percent=-1 fault.drift_s=2 fault.from_s=1", "stator:drift:-1@1..3"),
        ("fault.drift_percent=-1 fault.from_s=1", "stator:drift:-1@1"),
        ("fault.jolt_rad_s=2 fault.from_s=1", "rotor:jolt:2@1"),
        ("fault.rotor=stuck fault.from_s=1", "rotor:stuck@1"),
        ("fault.hub_friction=0.8 fault.from_s=1", "hub:rub:0.8@1"),
    ] {
        let (mut by_keys, mut by_word) = (Scene::default(), Scene::default());
        for set in keys.split(' ') {
            let (key, value) = set.split_once('=').unwrap();
            by_keys.set(key, value).unwrap();
        }
        by_word.set(KEY, word).unwrap();
        assert_eq!(by_keys.faults(), by_word.faults(), "{word}");
    }
}

/// Every word of the table is written as its pattern says, and its other name means the same.
#[test]
fn exact_every_word_of_the_table_is_taken() {
    for word in WORDS {
        let value = match word.value {
            FaultValue::Number { .. } => ":0.001",
            FaultValue::None | FaultValue::Mode => "",
        };
        let thing = if word.thing == "mark" { "mark3" } else { word.thing };
        let parsed: Fault = format!("{thing}:{}{value}", word.what).parse().unwrap();
        assert_eq!(parsed.to_string(), format!("{thing}:{}{value}", word.what));
        if !word.alias.is_empty() {
            assert_eq!(format!("{thing}:{}{value}", word.alias).parse(), Ok(parsed));
        }
    }
}

fn any_fault() -> impl Strategy<Value = Fault> {
    let kind = (
        0..WORDS.len(),
        -5.0..5.0_f64,
        1..=16_u8,
        prop_oneof![Just(None), Just(Some(DriveMode::B)), Just(Some(DriveMode::C))],
    )
        .prop_map(|(index, number, mark, mode)| {
            let word = WORDS[index];
            // Within the bounds of every key.
            let number = match word.what {
                "weak" | "intermittent" | "outliers" | "delayed" | "rub" => number.abs() / 5.0,
                "false" => 1e-3 * number,
                "offset" if word.thing == "ldv" => number / 5.0,
                _ => number,
            };
            (word.kind)(words::FaultArgument { number, mode, mark })
        });
    let nanos = 0..100_000_000_000_000_u64;
    (kind, nanos.clone(), proptest::option::of(nanos)).prop_map(|(kind, from, length)| Fault {
        kind,
        from: Time::from_nanos(from),
        until: match length {
            Some(length) if !matches!(kind, FaultKind::Jolt(_)) => {
                Time::from_nanos((from + 1 + length).min(100_000_000_000_000))
            }
            _ => Fault::NEVER,
        },
    })
}

proptest! {
    /// A fault's word is the fault again, to the nanosecond and the last bit.
    #[test]
    fn law_a_fault_is_its_word(fault in any_fault()) {
        prop_assert_eq!(fault.to_string().parse(), Ok(fault));
    }

    /// Any text is a fault that ends after it begins, or is refused at a column within it.
    #[test]
    fn law_any_text_is_a_fault_or_refused(
        text in "\\PC{0,40}|(camera|ldv|drive|rotor|hub|mark[0-9]{0,3}):[a-z]{0,6}(:[-0-9.e]{0,5})?(@[0-9.e-]{0,8})?",
    ) {
        match text.parse::<Fault>() {
            Ok(fault) => {
                prop_assert!(fault.from < fault.until);
                prop_assert_eq!(fault.to_string().parse(), Ok(fault));
            }
            Err(error) => prop_assert!((1..=text.chars().count() + 1).contains(&error.column), "{error}"),
        }
    }
}
