//! What a scene takes, and how it refuses the rest.

use super::*;
use proptest::prelude::*;

fn refused(sets: &[&str]) -> String {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap_err().one_line()
}

#[test]
fn exact_keys_are_unique() {
    let mut keys: Vec<_> = registry().map(|setting| setting.key).collect();
    let count = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), count);
}

#[test]
fn exact_defaults_are_values_that_could_be_set() {
    for setting in registry() {
        let text = match setting.kind.resolved() {
            Kind::Number { default, .. } => default.to_string(),
            Kind::Integer { default, .. } => default.to_string(),
            Kind::Choice { default, .. } | Kind::Schedule { default } => default.to_owned(),
            Kind::Faults => String::new(),
            Kind::As { key } => panic!("{key} is not resolved"),
        };
        assert!(setting.parse(&text).is_ok(), "{} = {text}", setting.key);
    }
}

#[test]
fn exact_later_sources_win() {
    let text = "seed = 9\n[motor]\nfriction = 0.5\nrestitution = 0.61\n[motor.mode_b]\nfrequency_hz = 6301\n";
    let mut scene = Scene::default();
    scene.set_all(text, Path::new("scene.toml")).unwrap();
    scene.assign_all(&["motor.friction=0.25".to_owned()], &|_| Ok(())).unwrap();
    let params = scene.motor_params();
    let got = [Parameter::Friction, Parameter::Restitution, Parameter::ModeBFrequency, Parameter::RotorMass];
    for (parameter, value) in got.into_iter().zip([0.25, 0.61, 6301.0, 46e-6]) {
        assert!((params.get(parameter) - value).abs() <= 0.0, "{parameter:?}");
    }
    assert_eq!(scene.motor_overrides().count(), 3);
    assert_eq!(scene.seed(), 9);
    scene.set("seed", "18446744073709551615").unwrap();
    assert_eq!(scene.seed(), u64::MAX);
}

/// A key that is as another follows it until it is set itself, and has its bounds under its own name.
#[test]
fn exact_a_key_that_is_as_another_follows_it() {
    let mut scene = Scene::default();
    let late = |scene: &Scene| {
        ["camera.latency_frames", "estimator.assumed.camera.latency_frames"].map(|key| scene.integer(key))
    };
    assert_eq!(late(&scene), [1, 1]);
    scene.set("camera.latency_frames", "4").unwrap();
    assert_eq!(late(&scene), [4, 4]);
    scene.set("estimator.assumed.camera.latency_frames", "2").unwrap();
    assert_eq!(late(&scene), [4, 2]);
    assert_eq!(
        refused(&["estimator.assumed.camera.noise_m=1"]),
        "error: estimator.assumed.camera.noise_m = 1 is outside its bounds 0 to 0.001 m"
    );
    assert_eq!(
        refused(&["estimator.assumed.ldv.installed=maybe"]),
        "error: estimator.assumed.ldv.installed = maybe is none of yes, no"
    );
}

#[test]
fn exact_refusals_name_key_value_bounds_and_the_nearest_key() {
    assert_eq!(
        refused(&["motor.stator_mas_kg=1"]),
        "error: unknown key motor.stator_mas_kg; hint: did you mean motor.stator_mass_kg?"
    );
    assert_eq!(refused(&["stator_mass_kg=1"]), refused(&["stator_mass_kg=2"]));
    assert!(refused(&["stator_mass_kg=1"]).ends_with("did you mean motor.stator_mass_kg?"));
    assert!(refused(&["xyzzy=1"]).ends_with("`host-sim keys` lists every key"));
    assert_eq!(
        refused(&["motor.restitution=1.5"]),
        "error: motor.restitution = 1.5 is outside its bounds 0 to 1"
    );
    assert_eq!(
        refused(&["motor.stator_mass_kg=nan"]),
        "error: motor.stator_mass_kg = nan is not a number, bounds 1e-9 to 1 kg"
    );
    assert!(
        refused(&["seed=-1"]).starts_with("error: seed = -1 is outside its bounds 0 to 18446744073709551615")
    );
    assert!(refused(&["seed=1.5"]).starts_with("error: seed = 1.5 is not a whole number"));
    assert!(
        refused(&["motor.friction"]).starts_with("error: --set motor.friction is not of the form key=value")
    );
    assert_eq!(refused(&["simulate.drive=a"]), "error: simulate.drive = a is none of b, c, off");
}

#[test]
fn exact_a_refused_value_leaves_the_scene_as_it_was() {
    let mut scene = Scene::default();
    scene.set("motor.friction", "0.3").unwrap();
    let before = scene.clone();
    assert!(scene.set("motor.friction", "-1").is_err());
    assert_eq!(scene, before);
}

proptest! {
    /// Whatever the text, a scene takes it whole or refuses it, and what it takes is finite and within bounds.
    #[test]
    fn law_accepted_values_are_finite_and_within_bounds(
        index in 0..registry().count(),
        value in prop_oneof![any::<f64>().prop_map(|x| x.to_string()), any::<i64>().prop_map(|x| x.to_string()), ".*"],
    ) {
        let setting = registry().nth(index).unwrap();
        let mut scene = Scene::default();
        if scene.set(setting.key, &value).is_ok() {
            match setting.kind.resolved() {
                Kind::Number { min, max, .. } => {
                    let number = scene.number(setting.key);
                    prop_assert!(number.is_finite() && number >= min && number <= max);
                }
                Kind::Integer { min, max, .. } => prop_assert!((min..=max).contains(&scene.integer(setting.key))),
                Kind::Choice { of, .. } => prop_assert!(of.contains(&scene.choice(setting.key))),
                Kind::Schedule { .. } => prop_assert!(!scene.schedule(setting.key).parts().is_empty()),
                Kind::Faults => prop_assert!(scene.faults().iter().all(|fault| fault.from < fault.until)),
                Kind::As { key } => prop_assert!(false, "{key} is not resolved"),
            }
        } else {
            prop_assert_eq!(scene, Scene::default());
        }
    }

    #[test]
    fn law_every_number_within_bounds_is_accepted(index in 0..registry().count(), part in 0.0..=1.0_f64) {
        let setting = registry().nth(index).unwrap();
        if let Kind::Number { min, max, .. } = setting.kind.resolved() {
            let number: f64 = f64::min(min + part * (max - min), max);
            let mut scene = Scene::default();
            scene.set(setting.key, &number.to_string()).unwrap();
            prop_assert!((scene.number(setting.key) - number).abs() <= 0.0);
        }
    }

    /// No text makes the reader panic, and every error is a single line.
    #[test]
    fn law_any_text_gives_a_scene_or_one_line(
        text in "\\PC*|(\\[?[a-z_.]{0,12}\\]? ?=? ?[0-9a-z\".'\\[{-]{0,6}\n){0,4}",
        set in ".*",
    ) {
        if let Err(error) = Scene::default().set_all(&text, Path::new("scene.toml")) {
            prop_assert_eq!(error.one_line().lines().count(), 1);
        }
        if let Err(error) = Scene::of_sets(&[set]) {
            prop_assert_eq!(error.one_line().lines().count(), 1);
        }
    }
}
