//! Positioning of the rotor: which mode, how strongly, when to stop. And [`tick()`], the one loop body: firmware calls
//! it, and so does the simulation.
//!
//! # In the order of the data
//!
//! - [`Sense`], [`Drive`]: what the loop asks of the hardware, in three methods.
//! - [`tick()`] on a [`PositionLoop`], which holds any [`estimator::AngleFilter`]: fuse what arrived, estimate,
//!   decide, drive.
//! - [`response_map`]: what the rotor does under each drive, identified from the plant and compiled in;
//!   [`correction`]: how this motor differs from it.
//! - [`ledger`]: what is known of a resting rotor across bursts.
//! - [`plan`]: what to drive next, from what remains and how well that is known; [`progress`]: whether a driven rotor
//!   gets on.
//! - [`Positioning`]: the decision, a state machine over cruise, burst, settling and holding, within [`Limits`].
//! - [`rate`]: the other task, a rate held or led through a profile; [`tick_rate`] is its loop body.
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code. A tick cannot fail or panic and takes bounded time. The drive is on only
//! during a cruise or a burst, on an estimate that is there and good enough; it is off in the tick that loses the
//! estimate.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | cruise | a drive that stays on until it is cut |
//! | burst | a drive of a given number of ticks, from rest to rest |
//! | coast | what the rotor still turns after a cruise is cut: ring-down, flight and sliding |
//! | family | bursts that differ in amplitude or in length only |
//! | settling | the drive is off, until the rotor lies still and is measured well enough |
//! | reached | the estimate lies within the tolerance by so many of its standard deviations |

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

pub mod drive_plan;
pub mod map_correction;

mod ports;
mod positioning;
pub mod progress_window;
pub mod rate;
pub mod response_map;
pub mod rest_filter;
pub mod situation;
mod target;
mod tick;

pub use ports::{Drive, LDV_SAMPLES_PER_TICK_MAX, Sense};
pub use positioning::{Positioning, PositioningPhase, PositioningTuning, StopReason};
pub use target::{Limits, Target, Travel};
pub use tick::{PositionLoop, RateLoop, RateReport, TICK_NANOS, TickReport, tick, tick_rate};
