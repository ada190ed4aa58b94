//! Positions the rotor of the micro-motor in closed loop, and holds or leads its rate. [`tick()`] is the one loop
//! body: firmware calls it, and so does the simulation.
//!
//! # The loop
//!
//! ```text
//!             camera frames, vibrometer samples
//!  +---------+  [Sense]      +-----------------+  estimate, health  +------------------------+
//!  | sensors | ------------> | angle filter    | -----------------> | Positioning            |
//!  +---------+               | [AngleFilter]   |                    |  phase, plan, limits   |
//!       ^                    +-----------------+                    +------------------------+
//!       |                            ^                                          |
//!       |                            | command that is applied                  | command
//!   +-------+                  +-----------+                                    |
//!   | rotor | <--------------- | amplifier | <----------------------------------+
//!   +-------+                  |  [Drive]  |
//!                              +-----------+
//! ```
//!
//! # In the order of the data
//!
//! 1. [`Sense`], [`Drive`]: what the loop needs of the hardware, in four methods.
//! 2. [`tick()`] on a [`PositionLoop`], which holds any [`estimator::AngleFilter`]: fuse what arrived, estimate,
//!    decide, drive.
//! 3. [`Target`], [`Limits`]: what is asked, and within which limits.
//! 4. [`ResponseMap`]: what the rotor does under each drive, identified from motors drawn around a design.
//! 5. [`rest_filter`] and [`map_correction`]: one Kalman filter in two parts, the angle of the rotor at rest, and how
//!    this motor differs from the map.
//! 6. [`situation`]: what remains, and whether the target counts as reached.
//! 7. [`drive_plan`]: which drive comes next.
//! 8. [`progress_window`]: whether a cruise turns the rotor, and `amplitude_search`: which one turns it fastest.
//! 9. [`settling_watch`]: what becomes of the rotor once the drive is off, and [`ring_down`] of the stator.
//! 10. [`Positioning`]: the state machine that uses all of these.
//! 11. [`MoveForecast`]: what a move will take, and what cannot be reached, before it starts.
//! 12. [`TickReport`]: what a tick did.
//! 13. [`InFlight`]: decisions on their way, of a loop whose commands act some ticks later.
//! 14. [`resonance_tracker`]: the frequency of the drive, which follows a resonance that drifts.
//! 15. [`commissioning`]: the response map of the motor at hand, measured before the first move.
//!
//! [`rate`] is the other task, with [`tick_rate`] as its loop body.
//!
//! # Phases of positioning
//!
//! | phase | drive | ends when | then |
//! |---|---|---|---|
//! | `Waiting` | off | there is a usable estimate | `Settling` |
//! | `Settling` | off | at rest, and the target counts as reached | `Holding` |
//! | | | at rest, and a drive is due | `Cruise`, `Burst` |
//! | `Cruise` | on | the coast remains, the angle is too uncertain, or `on_max_nanos` is over | `Settling` |
//! | | | no frame has come for a window | `Settling` |
//! | | | a window shows a stuck rotor, or one that turns the wrong way | `Settling`, `Stopped` |
//! | `Burst` | on | its ticks or `on_max_nanos` are over | `Settling` |
//! | `Settling` | off | the rotor turns on, and never stops | `Brake`, `Stopped` |
//! | | | measuring on cannot end before the deadline | `Stopped` |
//! | `Brake` | on | the rotor no longer turns that way, or half a second is over | `Settling` |
//! | `Waiting` | off | there is no usable estimate for too long | `Stopped` |
//! | `Settling` | off | no frame has come for as long | `Stopped` |
//! | `Holding` | off | the rotor moves, or lies outside the tolerance for certain | `Settling` |
//! | `Stopped` | off | there is another target | `Settling` |
//! | all but `Stopped` | | there is no usable estimate | `Waiting` |
//! | `Cruise`, `Burst` | | the rotor is outside the travel | `Stopped` |
//! | all but `Holding`, `Stopped` | | the deadline is over | `Stopped` |
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code. A tick cannot fail or panic and takes bounded time. The drive is on only
//! during a cruise, a burst or a brake, by an estimate that is usable; it is off in the tick that loses the estimate.
//! An estimate that is only wide ([`estimator::Reason::Uncertain`]) begins nothing. It ends a cruise after a window of
//! 0.15 s, or sooner near the target, but not a burst, whose end is known beforehand.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | tick | period of the loop, 10 us |
//! | latency | ticks from the measurements of a tick until the command acts that they decided |
//! | decision ticks | ticks from one decision of the loop to the next; between them measurements wait |
//! | cruise | a drive that stays on until it is cut |
//! | coast | what the rotor still turns after a cruise is cut: ring-down, flight and sliding |
//! | burst | a drive of a given number of ticks, from rest to rest |
//! | family | bursts of one mode that differ in amplitude or in length only |
//! | step, walk, stride | families of mode C: shortest, fine and coarse |
//! | nudge, throw | families of mode B: shortest and coarse |
//! | commissioning | measuring the response map of one motor, with that of its design as the prior |
//! | experiment | a drive from rest to rest that is ordered for its response: a sweep, a cruise or a train of bursts |
//! | response | what an experiment has shown: powers, turns, coast and time to rest |
//! | response map | mean turn or rate of each drive over drawn motors, with its spreads |
//! | factor | turn or rate of this motor per turn or rate of the map |
//! | forecast | turn of a burst in this motor, with its variance |
//! | settling | the drive is off, until the rotor is at rest and measured well enough |
//! | reached | the risk that the rotor lies outside the tolerance is small enough ([`situation::Confidence`]) |
//! | offset | of the drive's frequency from the resonance of the design |
//! | probe | a burst of the other mode that tells a lost mode from a stuck rotor |
//! | direction | +1 clockwise, -1 counter-clockwise |

#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::disallowed_methods,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a test fails by panicking, and takes its yardsticks from another library"
    )
)]

pub mod commissioning;
pub mod drive_plan;
pub mod map_correction;

mod amplitude_search;
mod in_flight;
mod loop_timing;
mod move_forecast;
mod ports;
mod positioning;
pub mod progress_window;
pub mod rate;
pub mod resonance_tracker;
pub mod response_map;
pub mod rest_filter;
pub mod ring_down;
pub mod settling_watch;
pub mod situation;
mod target;
mod tick;

/// The README's example, which must compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

pub use in_flight::{Decision, InFlight};
pub use loop_timing::{DECISION_TICKS_MAX, LATENCY_TICKS_MAX, LoopTiming};
pub use move_forecast::{MoveForecast, Unreachable};
pub use ports::{Drive, LDV_SAMPLES_PER_TICK_MAX, Sense};
pub use positioning::{Positioning, PositioningPhase, PositioningTuning, StopReason, Wait};
pub use response_map::ResponseMap;
pub use target::{Limits, Target, Travel};
pub use tick::{
    Fused, PositionLoop, RateLoop, RateReport, TICK_NANOS, TickReport, fuse, tick, tick_by, tick_rate,
    tick_rate_by,
};
