//! Any text as the word of a fault: a fault whose word gives it again, or a refusal at a column of the word. In a scene
//! it is taken or refused in one line.

#![no_main]

use libfuzzer_sys::fuzz_target;
use simulation::Scene;
use simulation::scene::faults::Fault;

fuzz_target!(|text: &str| {
    match text.parse::<Fault>() {
        Ok(fault) => {
            assert!(fault.from < fault.until);
            assert_eq!(fault.to_string().parse(), Ok(fault));
        }
        Err(error) => assert!((1..=text.chars().count() + 1).contains(&error.column), "{error}"),
    }
    let mut scene = Scene::default();
    if let Err(error) = scene.set("faults", text) {
        assert_eq!(error.one_line().lines().count(), 1);
    }
});
