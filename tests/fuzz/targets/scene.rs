//! Any bytes as a scene file: taken or refused in one line, and what is taken is a motor that can be built.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use motor_model::{Motor, MotorSetup};
use simulation::Scene;

fuzz_target!(|text: &str| {
    let mut scene = Scene::default();
    if let Err(error) = scene.set_all(text, Path::new("scene.toml")) {
        assert_eq!(error.one_line().lines().count(), 1);
    }
    // Bounds that belong together may still be refused, as an error.
    let _ = Motor::<f64>::try_new(&scene.motor_params(), &MotorSetup::with_step(1e-6));
});
