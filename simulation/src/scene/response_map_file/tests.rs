//! The file of a response map: written and read again, and refused with the place of what is wrong.

use super::*;
use crate::scene::Scene;
use proptest::prelude::*;

fn parsed_as(name: &str, text: &str) -> Result<ResponseMap, String> {
    parse_response_map(text, Path::new(name)).map_err(|error| error.one_line())
}

fn parsed(text: &str) -> Result<ResponseMap, String> {
    parsed_as("map.toml", text)
}

fn text_of(map: &ResponseMap) -> String {
    response_map_text(map, Path::new("map.toml"))
}

fn table_1() -> String {
    text_of(ResponseMap::table_1())
}

#[test]
fn exact_the_map_of_table_1_survives_its_file() {
    assert_eq!(parsed(&table_1()).as_ref(), Ok(ResponseMap::table_1()));
    for name in ["map.json", "MAP.JSON"] {
        let text = response_map_text(ResponseMap::table_1(), Path::new(name));
        assert_eq!(parsed_as(name, &text).as_ref(), Ok(ResponseMap::table_1()));
        assert!(parsed(&text).is_err(), "it is no TOML");
        let tables: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(tables["bursts"]["walk"].as_array().map(Vec::len), Some(9));
    }
    assert!(parsed_as("map.json", &table_1()).is_err(), "it is no JSON");
}

/// That of one motor, with factors that no two digits hold.
fn of_one_motor() -> ResponseMap {
    let factor = |value| LearntFactor { value, variance: 1e-3 / value };
    ResponseMap::table_1()
        .with_learnt(LearntFactors {
            bursts: [1.0 / 3.0, 0.7, 1.3, 0.9, 3.9].map(factor),
            step_walk_covariance: -1e-3 / 7.0,
            rates: [1.0 / 7.0, 1.1].map(factor),
            resonances: [-1e2 / 7.0, 1e2 / 3.0].map(|hz| ResonanceOffset { hz, hz2: 1e3 / 9.0 }),
        })
        .unwrap()
}

#[test]
fn exact_what_was_learnt_survives_the_file_and_is_refused_by_its_line() {
    for (name, from, to) in [
        ("map.toml", "walk = { value = 0.7,", "walk = { value = 0.07,"),
        ("map.json", "\"walk\": {\"value\": 0.7,", "\"walk\": {\"value\": 0.07,"),
    ] {
        let text = response_map_text(&of_one_motor(), Path::new(name));
        assert_eq!(parsed_as(name, &text), Ok(of_one_motor()));
        assert_ne!(parsed_as(name, &text).as_ref(), Ok(ResponseMap::table_1()));
        let at = text.lines().position(|line| line.contains(from)).unwrap() + 1;
        let error = parsed_as(name, &text.replacen(from, to, 1)).unwrap_err();
        let wrong = "learnt walk = 0.07 is outside its bounds 0.1 to 4";
        assert!(error.starts_with(&format!("error: {name}:{at}:")) && error.contains(wrong), "{error}");
        let lacking = parsed_as(name, &text.replacen("rate_b", "rate_a", 1)).unwrap_err();
        assert!(lacking.contains("rate_a"), "{lacking}");
    }
}

/// The same rules as in TOML, each with the line of what breaks it.
#[test]
fn exact_refusals_of_json_name_the_line_and_what_is_wrong() {
    let text = response_map_text(ResponseMap::table_1(), Path::new("map.json"));
    let line = |part: &str| text.lines().position(|line| line.contains(part)).unwrap() + 1;
    for (from, to, at, wrong) in [
        ("\"ticks\":67,", "", line("\"ticks\":67,"), "missing field `ticks`"),
        ("\"ticks\":67,", "\"ticks\":95,", line("\"ticks\":94,"), "walk row 2: ticks = 94 after 95"),
        ("\"ticks\":67,", "\"ticks\":67", line("\"ticks\":67,"), "expected `,` or `}`"),
        ("_s\":3.365,", "_s\":0.365,", line("_s\":3.365,"), "cruises row 2: rate_rad_s"),
        ("_s\":-1.539,", "_s\":-1e39,", line("_s\":-1.539,"), "number out of range"),
        ("correlation\": 0.87", "correlation\": 1.5", 2, "step_walk_correlation = 1.5"),
        (
            "    \"motor.rotor_mass_kg\": 4.6e-5,\n",
            "",
            line("\"design\""),
            "the design lacks motor.rotor_mass_kg",
        ),
        ("mass_kg\": 4.6e-5", "mass_kg\": -1.0", line("motor.rotor_mass"), "1e-9 to 1 kg"),
        ("motor.rotor_mass_kg", "motor.rotor_mas_kg", line("motor.rotor_mass"), "no parameter"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = parsed_as("map.json", &text.replacen(from, to, 1)).unwrap_err();
        assert!(
            error.starts_with(&format!("error: map.json:{at}:")) && error.contains(wrong),
            "{at} {wrong}: {error}"
        );
    }
}

#[test]
fn exact_refusals_name_the_line_and_what_is_wrong() {
    let text = table_1();
    let line = |part: &str| text.lines().position(|line| line.contains(part)).unwrap() + 1;
    for (from, to, at, wrong) in [
        ("ticks = 67, ", "", line("ticks = 67,"), "missing field `ticks`"),
        ("ticks = 67, ", "tick = 67, ", line("ticks = 67,"), "unknown field `tick`"),
        ("ticks = 67, ", "ticks = 95, ", line("ticks = 94,"), "walk row 2: ticks = 94 after 95"),
        ("ticks = 67, ", "ticks = -1, ", line("ticks = 67,"), "invalid value"),
        (
            "rate_rad_s = 3.365,",
            "rate_rad_s = 0.365,",
            line("rate_rad_s = 3.365,"),
            "cruises row 2: rate_rad_s",
        ),
        ("rate_rad_s = 3.365,", "rate_rad_s = nan,", line("rate_rad_s = 3.365,"), "rate_rad_s = NaN"),
        ("rate_rad_s = -1.539,", "rate_rad_s = inf,", line("rate_rad_s = -1.539,"), "cruises row 15"),
        ("correlation = 0.87", "correlation = 1.5", 2, "step_walk_correlation = 1.5"),
        ("\"motor.rotor_mass_kg\" = 4.6e-5\n", "", line("[design]"), "the design lacks motor.rotor_mass_kg"),
        (
            "\"motor.rotor_mass_kg\" = 4.6e-5",
            "\"motor.rotor_mass_kg\" = -1.0",
            line("rotor_mass"),
            "1e-9 to 1 kg",
        ),
        ("motor.rotor_mass_kg", "motor.rotor_mas_kg", line("rotor_mass"), "no parameter"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = parsed(&text.replacen(from, to, 1)).unwrap_err();
        assert!(
            error.starts_with(&format!("error: map.toml:{at}:")) && error.contains(wrong),
            "{at} {wrong}: {error}"
        );
    }
    let without: Vec<&str> = text.lines().filter(|line| !line.starts_with("nudge")).collect();
    let without = without.join("\n");
    assert!(parsed(&without).is_err());
    assert!(parsed("").unwrap_err().contains("missing field"));
}

#[test]
fn exact_a_map_of_another_design_is_refused() {
    let mut heavy = Scene::default();
    heavy.set("motor.rotor_mass_kg", "184e-6").unwrap();
    let refused = heavy.response_map().unwrap_err().one_line();
    let expected =
        "error: the response map is for motor.rotor_mass_kg = 4.6e-5, the design has 1.84e-4; hint: ";
    assert!(refused.starts_with(expected), "{refused}");
    let own = parsed(&table_1().replace("rotor_mass_kg\" = 4.6e-5", "rotor_mass_kg\" = 0.000184")).unwrap();
    assert_eq!(*heavy.with_response_map(own).response_map().unwrap(), own);
    let nominal = Scene::default().with_response_map(own).response_map().unwrap_err();
    assert!(matches!(nominal, SceneError::OtherDesign { key: "motor.rotor_mass_kg", .. }), "{nominal}");
}

proptest! {
    /// Any finite numbers within their bounds come back bit for bit.
    #[test]
    fn law_numbers_survive_the_file(
        amplitude in 1e-6_f32..=1.0,
        turn in 1e-12_f32..1.0,
        sd in 0.0_f32..1.0,
        mass in 1e-9..1.0,
    ) {
        let burst = Burst { amplitude, ticks: 7, turn_rad: turn, motors_sd_rad: sd, repeat_sd_rad: sd * turn };
        let design = MotorParams::nominal().with(Parameter::RotorMass, mass).unwrap();
        let map = ResponseMap::try_new(design, &[], [&[burst], &[], &[], &[], &[]], sd).unwrap();
        for name in ["map.toml", "map.json"] {
            prop_assert_eq!(parsed_as(name, &response_map_text(&map, Path::new(name))), Ok(map));
        }
    }

    /// A file with any piece of it cut out or overwritten is refused in one line or is a map that keeps the rules.
    #[test]
    fn law_any_damage_gives_a_map_or_one_line(
        from in 0..6000_usize,
        length in 0..60_usize,
        new in "[-0-9a-z.={} \n\\[\\]]{0,6}") {
        let mut text = text_of(&of_one_motor());
        let from = from.min(text.len());
        let to = (from + length).min(text.len());
        text.replace_range(from..to, &new);
        match parsed(&text) {
            Ok(map) => prop_assert_eq!(parsed(&text_of(&map)), Ok(map)),
            Err(error) => prop_assert_eq!(error.lines().count(), 1),
        }
    }

    #[test]
    fn law_any_text_is_refused_in_one_line(text in "\\PC*|(\\[?[a-z_.]{0,12}\\]? ?=? ?[0-9a-z\".'\\[{-]{0,6}\n){0,4}") {
        let error = parsed(&text).unwrap_err();
        prop_assert_eq!(error.lines().count(), 1);
    }
}
