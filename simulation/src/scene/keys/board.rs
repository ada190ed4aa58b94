//! Keys of the board that the loop runs on.

use controller::{DECISION_TICKS_MAX, LATENCY_TICKS_MAX};

use crate::scene::{Kind, Setting};

/// Settings of the board.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "board.latency_ticks",
        unit: "",
        kind: Kind::Integer { default: 0, min: 0, max: LATENCY_TICKS_MAX as u64 },
        meaning: "ticks of 10 us from the measurements of a tick until their command acts: the processor's time for \
                  its work",
    },
    Setting {
        key: "board.decision_ticks",
        unit: "",
        kind: Kind::Integer { default: 1, min: 1, max: DECISION_TICKS_MAX as u64 },
        meaning: "ticks from one decision of the loop to the next; measurements wait, and bursts end on time",
    },
    Setting {
        key: "board.interrupt_late_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 4e-6 },
        meaning: "most that the interrupt of a tick is late, and its command with it; the twin is told this bound; \
                  beyond 4 us a board would sample the next tick",
    },
    Setting {
        key: "board.sampling",
        unit: "",
        kind: Kind::Choice { default: "timer", of: &["timer", "interrupt"] },
        meaning: "what takes the vibrometer's samples: a timer in hardware, on time, or the interrupt, as late as it \
                  is",
    },
];
