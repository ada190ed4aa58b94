//! Keys of the board that the loop runs on.

use controller::LATENCY_TICKS_MAX;

use crate::scene::{Kind, Setting};

/// Settings of the board.
pub const SETTINGS: &[Setting] = &[Setting {
    key: "board.latency_ticks",
    unit: "",
    kind: Kind::Integer { default: 0, min: 0, max: LATENCY_TICKS_MAX as u64 },
    meaning: "ticks of 10 us from the measurements of a tick until the command acts that they decided: the time that \
              the processor has for the work of a tick; 0 is a processor without bounds",
}];
