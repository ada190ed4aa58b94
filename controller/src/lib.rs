//! Positioning of the rotor: which mode, how strongly, when to stop. And [`tick()`], the one loop body: firmware calls it, and so does the
//! simulation.
//!
//! # In the order of the data
//!
//! - [`Sense`], [`Drive`]: what the loop asks of the hardware, in three methods.
//! - [`tick()`] on a [`PositionLoop`], which holds any [`estimator::AngleFilter`]: fuse what arrived, estimate, decide, drive.
//! - [`Positioning`]: the decision, a state machine over approach, settling and holding.
//! - [`gear`]: the strengths of drive it picks from, and how far the rotor coasts after each.
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code. A tick cannot fail or panic and takes bounded time. The drive is on only while an approach is
//! under way on an estimate that is there and good enough.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | gear | a mode and an amplitude, with the distance from which it is used |
//! | coast | what the rotor still turns after the drive is cut: ring-down, flight and sliding |
//! | approach | the drive is on, until the remaining angle is the coast |
//! | settling | the drive is off, until the rotor lies still and is measured well enough |

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

pub mod gear;
mod ports;
mod positioning;
mod tick;

pub use ports::{Drive, LDV_SAMPLES_PER_TICK_MAX, Sense};
pub use positioning::{Phase, Positioning, PositioningTuning, Target};
pub use tick::{PositionLoop, Report, tick};
