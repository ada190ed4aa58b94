//! `host-sim parts`, which measures the programs as `host-sim size` does: the firmware fits its part, and its tasks can
//! neither panic nor allocate nor fall back on software's double precision. The Cortex-M7 has a filter that fits it.

use std::path::Path;

use firmware::part_filters::{OPTIONAL_FILTERS, PARTS, has_time};
use host_sim::scene_files::GalleryScene;
use serde_json::Value;
use simulation::scene::Scene;

use crate::host_sim;

#[test]
fn tool_firmware_fits_and_its_tasks_call_nothing_forbidden() {
    let output = host_sim().args(["parts", "--format", "json"]).output().expect("host-sim starts");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    check_sizes(&report);
    check_fits(&report);
}

fn check_sizes(report: &Value) {
    for program in report["programs"].as_array().expect("programs") {
        let number = |field: &str| program[field].as_u64().unwrap_or_else(|| panic!("{field} in {program}"));
        // Empty images, or tasks whose calls are not followed, would pass for small and harmless.
        // An STM32G474RE has 504 KiB beside a kept description; the linker scripts hold what each program may take.
        assert!(number("flash_bytes") > 16 * 1024 && number("flash_bytes") <= 504 * 1024, "{program}");
        assert!(number("functions") > 10, "{program}");
        assert_eq!(program["forbidden"], Value::Array(vec![]), "{program}");
    }
    let bytes = |of: &Value, field: &str| of[field].as_u64().unwrap_or_else(|| panic!("{field} in {of}"));
    let stacks = |program: &Value| -> Vec<(String, u64)> {
        let stacks = program["stacks"].as_array().expect("a stack for each filter").iter();
        stacks
            .map(|stack| (stack["filter"].as_str().expect("a name").to_owned(), bytes(stack, "bytes")))
            .collect()
    };
    // A part of the board's family of 256 KiB, as an STM32G491, has room for a program with one filter, with a map and
    // a description of the instruments that the host sends.
    for small in &report["programs"].as_array().expect("programs")[2..] {
        let ram = bytes(small, "static_bytes") + stacks(small)[0].1;
        assert!(bytes(small, "flash_bytes") <= 256 * 1024 && ram <= 32 * 1024, "{small}");
    }
    for (index, filters) in [
        &["constant_rate", "impact_aided", "twin"][..],
        &["constant_rate", "impact_aided", "twin"],
        &["constant_rate"],
        &["impact_aided"],
    ]
    .into_iter()
    .enumerate()
    {
        let program = &report["programs"][index];
        let stacks = stacks(program);
        assert!(stacks.iter().map(|(filter, _)| filter.as_str()).eq(filters.iter().copied()), "{program}");
        for (filter, stack) in stacks {
            let ram = bytes(program, "static_bytes") + stack;
            // A tick takes a kB of stack; a filter is some kB of variables.
            assert!(stack > 1024 && ram > 4096 && ram <= 128 * 1024, "{filter}: {program}");
        }
    }
}

/// A Cortex-M7 has time for `constant_rate` and `impact_aided`, as firmware/BRINGUP.md says, and the other parts have
/// flash and RAM for all filters.
fn check_fits(report: &Value) {
    let fits = report["fits"].as_array().expect("fits");
    assert_eq!(fits.len(), 9, "{report}");
    for fit in fits {
        let number =
            |of: &Value, field: &str| of[field].as_f64().unwrap_or_else(|| panic!("{field} in {fit}"));
        let (part, filter) = (&fit["part"], fit["filter"].as_str().expect("a name"));
        // A tick of 10 us at one instruction a cycle.
        let per_tick = 10.0 * number(part, "clock_mhz");
        assert!((number(fit, "per_tick") - per_tick).abs() < 1e-9, "{fit}");
        assert!(number(fit, "ram_bytes") <= number(part, "ram_bytes"), "{fit}");
        assert!(number(fit, "flash_bytes") <= number(part, "flash_bytes"), "{fit}");
        let (mean, latency_ticks) = (number(fit, "mean"), number(fit, "latency_ticks"));
        // No program is on time whose work is more than there is on average.
        assert!(latency_ticks >= 1.0 && (mean <= per_tick || latency_ticks > 16.0), "{fit}");
        if part["processor"] == "Cortex-M7" && filter != "twin" {
            assert!(latency_ticks <= 16.0, "{fit}");
        }
    }
    let mut held = 0;
    for of_part in fits.chunks(3) {
        held += check_held(of_part);
        match of_part.iter().rfind(|fit| fit["latency_ticks"].as_u64() <= Some(16)) {
            Some(best) => check_scene(best, (2 * ticks(best)).min(16)),
            None => check_scene(&of_part[0], 1),
        }
    }
    assert_eq!(held, PARTS.len() * OPTIONAL_FILTERS.len(), "{report}");
}

/// The firmware of a part holds a filter where the part has time for it. How many filters of `of_part` were looked at:
/// none of a part without firmware, and `constant_rate` is in every program.
fn check_held(of_part: &[Value]) -> usize {
    let of_firmware = of_part.iter().filter_map(|fit| {
        let (part, filter) = (fit["part"]["scene"].as_str()?, fit["filter"].as_str()?);
        let is_looked_at = OPTIONAL_FILTERS.contains(&filter) && PARTS.iter().any(|&(name, _)| name == part);
        is_looked_at.then(|| {
            let fits = fit["latency_ticks"].as_u64().is_some_and(|ticks| ticks <= 16);
            assert_eq!(has_time(Some(part), filter), fits, "{fit}");
        })
    });
    of_firmware.count()
}

fn ticks(fit: &Value) -> u64 {
    fit["latency_ticks"].as_u64().expect("a count")
}

/// The scene of a part has the best filter that fits it, and a latency for twice the backlog of the counted move:
/// others have more. Where none fits it has the simplest, with a latency.
fn check_scene(fit: &Value, needed_ticks: u64) {
    let name = fit["part"]["scene"].as_str().expect("a name");
    let of_gallery = GalleryScene::named(name).expect("a scene of the gallery");
    let mut scene = Scene::default();
    scene.set_all(of_gallery.text, Path::new(name)).expect("settings");
    assert_eq!(scene.choice("estimator.filter"), fit["filter"].as_str().expect("a name"), "{fit}");
    assert!(scene.integer("board.latency_ticks") >= needed_ticks, "{fit}");
}
