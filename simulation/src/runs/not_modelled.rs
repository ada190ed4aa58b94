//! What a simulated run leaves out, as sentences for its report.

use crate::scene::Scene;

/// What no run has, with a loop or without.
const ALWAYS: [&str; 3] = [
    "Coil, amplifier and magnetic field: a drive is an amplitude of mode B or C at its frequency.",
    "Wear, dirt and temperature: a motor keeps its parameters, unless a fault of the scene changes them.",
    "The parameters are those of Table 1 of the paper, or those of the scene. None was measured on your motor.",
];

/// What the motor of the paper leaves out under a given drive, without instruments and controller.
pub fn not_modelled_in_open_loop() -> Vec<String> {
    ALWAYS.map(str::to_owned).to_vec()
}

/// What the rotor of `scene` leaves out.
pub fn of_rotor(scene: &Scene) -> &'static str {
    if scene.choice("plant.rotor") == "height_only" {
        "Tilt and shift of the rotor: it rises and turns. `--set plant.rotor=tilting` has both."
    } else {
        "Play, friction and restitution of the hub were not measured: they are values that explain the paper's rates. \
         Filters and response map know nothing of tilt."
    }
}

/// What the board of `scene` leaves out.
fn of_board(scene: &Scene) -> String {
    match scene.integer("board.latency_ticks") {
        0 => "The time that a microcontroller takes: the loop gives its command at the end of the tick, in no time. \
              `--set board.latency_ticks=1` gives it a tick. `pil` and `instructions` measure it."
            .to_owned(),
        ticks => {
            let ticks = if ticks == 1 { "1 tick".to_owned() } else { format!("{ticks} ticks") };
            format!(
                "A microcontroller that is late: each command acts {ticks} of 10 us after the measurements that \
                 decide it, and no work takes longer than that. `parts` says which filter a part has the time for."
            )
        }
    }
}

/// What a run of `scene` leaves out.
pub fn not_modelled(scene: &Scene) -> Vec<String> {
    [of_rotor(scene).to_owned(), of_board(scene)].into_iter().chain(not_modelled_in_open_loop()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene with a latency does not say that a command takes no time, and one without says nothing else.
    #[test]
    fn tool_a_latency_is_told_as_it_is_set() {
        let told = |latency: &str| {
            let mut scene = Scene::default();
            scene.set("board.latency_ticks", latency).expect("within bounds");
            not_modelled(&scene).join("\n")
        };
        assert!(told("0").contains("in no time") && !told("0").contains("acts"), "{}", told("0"));
        for (latency, words) in [("1", "acts 1 tick of 10 us"), ("16", "acts 16 ticks of 10 us")] {
            let told = told(latency);
            assert!(told.contains(words) && !told.contains("in no time"), "{told}");
        }
    }
}
