//! Studies, logs, reports and the `host-sim` command of a micro-motor in simulation.
//!
//! The crate has layers. Imports point down only; `tests/` holds it.
//!
//! | layer | what it is |
//! |---|---|
//! | [`cli`] | flags, then a scene, then one call, then output; owns the command's error |
//! | [`studies`] | many runs, then rows: what is asked, one function that runs one case, what is concluded |
//! | [`board`] | the firmware in an emulator: built, counted, measured, in the loop, its log decoded |
//! | [`log`] | the records of a run in a file: MCAP, Parquet, CSV |
//! | [`run_reports`] | what is shown of one run: its picture, its page, its samples |
//! | [`scene_files`] | scenes and response maps in files, and the gallery |
//! | [`report`] | rows in; text, pictures, CSV and JSON out; it knows no motor |
//! | [`math`] | differences between results, and curves through points |
//! | [`tool`] | other programs: started, given a limited time |
//!
//! The runs themselves are those of the crate [`simulation`], which has no files, threads or terminals.

pub mod board;
pub mod cli;
pub mod log;
pub mod math;
pub mod report;
pub mod run_reports;
pub mod scene_files;
pub mod studies;
pub mod tool;

pub use cli::CommandError;

/// The README's example, which must compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
