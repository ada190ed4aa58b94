//! The motor in simulation: plant, instruments, faults, and the closed loop of the controller around them.
//!
//! The crate has no files, no threads, no terminal, no clock and no global generator: a scene comes in as text and
//! values, and results go out as values. Whatever has a float, a heap and a stack runs it: a command, a page in a
//! browser, a Python module.
//!
//! ```text
//! scene ----> rig: plant and instruments ----> camera frames, vibrometer samples
//!                  ^                                     |
//!                  +---- drive <---- controller <---- filter
//! ```
//!
//! | layer | what it is |
//! |---|---|
//! | [`runs`] | one motor, one run: open loop, closed loop, a move, a rate, a recording |
//! | [`world`] | the truth and how it is measured: plant, instruments, faults; it never sees an estimate |
//! | [`scene`] | every setting by its key: defaults, TOML text, assignments; it knows no consumer |
//! | [`math`] | numbers only: statistics, spectrum, Allan deviation, streams of random numbers |
//!
//! Imports point down only; `tests/` holds it. Clockwise and upward are positive; every name carries its unit.

pub mod math;
pub mod runs;
pub mod scene;
pub mod world;

pub use scene::{Kind, Scene, SceneError, Setting};

/// The README's example, which must compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
