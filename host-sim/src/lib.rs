//! The motor in simulation: plant, instruments, closed loop, studies, reports and the `host-sim` command.
//!
//! The crate has layers. Imports point down only; `tests/` holds it.
//!
//! | layer | what it is |
//! |---|---|
//! | [`cli`] | flags, then a scene, then one call, then output; owns the command's error |
//! | [`studies`] | many runs, then rows: what is asked, one function that runs one case, what is concluded |
//! | [`board`] | the firmware in an emulator: built, counted, measured, in the loop, its log decoded |
//! | [`log`] | the records of a run in a file: MCAP, Parquet, CSV |
//! | [`runs`] | one motor, one run: open loop, closed loop, a move, a rate |
//! | [`world`] | the truth and how it is measured: plant, instruments, faults; it never sees an estimate |
//! | [`report`] | rows in; text, pictures, CSV and JSON out; it knows no motor |
//! | [`scene`] | every setting by its key: defaults, then a TOML file, then `--set`, then flags; it knows no consumer |
//! | [`math`] | numbers only: statistics, spectrum, Allan deviation, streams of random numbers |
//! | [`tool`] | other programs: started, given a limited time |
//!
//! Clockwise and upward are positive; every name carries its unit.

pub mod board;
pub mod cli;
pub mod log;
pub mod math;
pub mod report;
pub mod runs;
pub mod scene;
pub mod studies;
pub mod tool;
pub mod world;

pub use cli::CommandError;
pub use scene::{Kind, Scene, Setting};

/// The README's example, which must compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
