//! What a simulated run leaves out, as sentences for its report.

use crate::scene::Scene;

/// What no run has.
const ALWAYS: [&str; 4] = [
    "Coil, amplifier and magnetic field: a drive is an amplitude of mode B or C at its frequency.",
    "Wear, dirt and temperature: a motor keeps its parameters, unless a fault of the scene changes them.",
    "The time that a microcontroller takes: the loop gives its command at the end of the tick, in no time. `pil` and \
     `instructions` measure it.",
    "The parameters are those of Table 1 of the paper, or those of the scene. None was measured on your motor.",
];

/// What the motor of the paper leaves out under a given drive, without instruments and controller.
pub fn not_modelled_in_open_loop() -> Vec<String> {
    let open_loop = [ALWAYS[0], ALWAYS[1], ALWAYS[3]];
    open_loop.map(str::to_owned).to_vec()
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

/// What a run of `scene` leaves out.
pub fn not_modelled(scene: &Scene) -> Vec<String> {
    std::iter::once(of_rotor(scene)).chain(ALWAYS).map(str::to_owned).collect()
}
