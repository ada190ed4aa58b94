//! The microcontroller's runs in `f32`, to compare their digests with those of host and microcontroller.

use firmware_checks::parity::{LoopRun, TwinRun};
use motor_model::{ImpactRule, OutOfBounds};
use wasm_bindgen::prelude::wasm_bindgen;

fn text() -> Result<String, OutOfBounds> {
    let [twin, located] = [ImpactRule::EndOfStep, ImpactRule::Located].map(TwinRun::compute);
    Ok(format!("{}\n{}\n{}\n", twin?, located?, LoopRun::compute(&mut None)?))
}

/// What the program `parity` prints on the microcontroller.
///
/// # Errors
/// When the model refuses the nominal motor: never, unless its bounds are changed.
#[wasm_bindgen]
pub fn parity() -> Result<String, String> {
    text().map_err(|error| error.to_string())
}
