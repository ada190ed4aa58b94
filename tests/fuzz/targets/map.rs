//! Any text as the file of a response map: refused in one line, or a map that its file gives again and that any move
//! can be planned by.

#![no_main]

use std::path::Path;

use controller::response_map::Family;
use libfuzzer_sys::fuzz_target;
use motor_model::DriveMode;
use simulation::scene::{parse_response_map, response_map_text};

fuzz_target!(|text: &str| {
    let map = match parse_response_map(text, Path::new("map.toml")) {
        Ok(map) => map,
        Err(error) => {
            assert_eq!(error.one_line().lines().count(), 1);
            return;
        }
    };
    let again = parse_response_map(&response_map_text(&map, Path::new("map.toml")), Path::new("map.toml"))
        .expect("its own file");
    assert_eq!(again, map);
    for turn_rad in [1e-9, 1e-6, 1e-3, 1.0, 1e3] {
        for family in Family::ALL {
            if let Some(burst) = map.burst(family, turn_rad, 1.0) {
                assert!(burst.turn_rad.is_finite() && burst.ticks > 0 && burst.amplitude <= 1.0);
            }
        }
        for mode in [DriveMode::B, DriveMode::C] {
            assert!(map.coast_rad(mode, turn_rad).is_finite());
        }
    }
});
