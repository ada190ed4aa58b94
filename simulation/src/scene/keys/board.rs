//! Keys of the board that the loop runs on.

use controller::LATENCY_TICKS_MAX;

use crate::scene::{Kind, Setting};

/// Settings of the board.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "board.latency_ticks",
        unit: "",
        kind: Kind::Integer { default: 0, min: 0, max: LATENCY_TICKS_MAX as u64 },
        meaning: "ticks of 10 us from the measurements of a tick until the command acts that they decided: the time \
                  that the processor has for the work of a tick; 0 is a processor without bounds",
    },
    Setting {
        key: "board.interrupt_late_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 4e-6 },
        meaning: "most that the interrupt of a tick is late: the command acts later by any time up to this; the twin \
                  is told this bound, the other filters know nothing; beyond 4 us a board would take a sample of the \
                  next tick",
    },
    Setting {
        key: "board.sampling",
        unit: "",
        kind: Kind::Choice { default: "timer", of: &["timer", "interrupt"] },
        meaning: "what takes the vibrometer's samples: a timer in hardware, on time, or the interrupt, as late as it \
                  is",
    },
];
