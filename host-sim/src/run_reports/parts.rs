//! Parts that the reports on runs share.

use crate::report::chart::{Axis, Colour, Panel, Series};
use simulation::math::count::real;
use simulation::runs::stated_errors::{StatedErrors, hundredths_or_dash};
use simulation::scene::Scene;

/// What a run of `motor_s` cost.
pub(crate) fn cost_lines(motor_s: f64, wall_s: f64) -> Vec<(&'static str, String)> {
    vec![
        ("motor time", format!("{motor_s:.4} s")),
        ("time on this machine", format!("{wall_s:.3} s on one thread")),
        ("speed", format!("{:.2} times real time", motor_s / wall_s.max(1e-9))),
    ]
}

/// What drives, instruments and faults were set, of the keys that the command `reads`.
pub(crate) fn bench_lines(scene: &Scene, reads: &dyn Fn(&str) -> bool) -> Vec<(&'static str, String)> {
    let camera = format!(
        "{} frames a second of {} marks",
        scene.value_text("camera.frame_rate_hz"),
        scene.integer("camera.marks")
    );
    let vibrometer = match scene.choice("ldv.installed") {
        "no" => "none".to_owned(),
        _ => format!("{} samples a second", scene.value_text("ldv.sample_rate_hz")),
    };
    let faults = scene.value_text("faults").replace(['[', ']', '"'], "");
    let lines = [
        ("seed", "seed", scene.seed().to_string()),
        ("plant.rotor", "rotor", scene.choice("plant.rotor").replace('_', " ")),
        (
            "plant.parameters",
            "motor",
            format!("{} parameters", scene.choice("plant.parameters").replace('_', " ")),
        ),
        ("camera.frame_rate_hz", "camera", camera),
        ("ldv.installed", "vibrometer", vibrometer),
        ("faults", "faults by words", if faults.is_empty() { "none".to_owned() } else { faults }),
    ];
    lines.into_iter().filter(|(key, ..)| reads(key)).map(|(_, what, said)| (what, said)).collect()
}

/// Errors of the estimate beside what the filter states of them.
pub(crate) fn stated_lines(stated: &StatedErrors) -> [(&'static str, String); 2] {
    let worst = match stated.good_beyond_5_sigma {
        0 => "none".to_owned(),
        count => format!("{count}, the worst by {:.1} mdeg", stated.good_beyond_5_sigma_worst_mdeg),
    };
    let percent = stated.beyond_3_sigma.map(|share| 100.0 * share);
    [
        (
            "estimates off by more than three of their standard deviations",
            format!("{} %; of normal errors 0.27 %", hundredths_or_dash(percent)),
        ),
        ("estimates called good and off by more than five", worst),
    ]
}

/// A course through named states, each on a line of its own.
pub(crate) fn course(title: &str, end_s: f64, changes: &[(f64, String)]) -> Panel {
    let mut names: Vec<String> = Vec::new();
    for (_, name) in changes {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    let place =
        |name: &String| names.iter().position(|known| known == name).map_or(0.0, |index| real(index) + 1.0);
    let mut points: Vec<(f64, f64)> = changes.iter().map(|(at, name)| (*at, place(name))).collect();
    points.extend(points.last().map(|(_, last)| (end_s, *last)));
    let height = 110 + 26 * u32::try_from(names.len()).unwrap_or(10);
    Panel::new(title, Axis::new("time (s)").within(0.0..end_s), Axis::of_names("", names))
        .series(Series::steps(points).colour(Colour::Purple).width(2.0))
        .height(height)
}
