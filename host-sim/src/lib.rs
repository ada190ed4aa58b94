//! The motor on a desk: plant, scenes, runs, reports and the `host-sim` command.
//!
//! In the order of the data:
//!
//! | module | what it is |
//! |---|---|
//! | [`scene`] | every setting by its key: defaults, then a TOML file, then `--set`, then flags |
//! | [`chance`] | one seeded stream of random numbers per source of noise |
//! | [`simulate`] | one run of the open loop: motor, constant drive, observers, summary |
//! | [`mod@reference`] | a second integrator of the motor, event-driven, to judge the fixed step by |
//! | [`averaged`] | what a drive does on average, identified from such runs |
//! | [`allan`] | how a gyroscope's means differ, by the span of the mean |
//! | [`statistics`], [`spectrum`] | what is said of a run: mean and spread, the largest spectral line |
//! | [`filter`] | the estimator that a scene picks |
//! | [`disturbance`] | what goes wrong with the motor during a move |
//! | [`record`] | a run written down, one row every 50 us |
//! | [`reproduce`] | the published tables and figures beside ours, with verdicts |
//! | [`response_map`] | what each drive does, identified for the controller |
//! | [`positioning_trials`] | many moves of many motors, beside simpler strategies |
//! | [`rate`] | a rate held in closed loop, against the truth |
//! | [`calibrate`] | a gyroscope on the rotor calibrated in closed loop, against the truth |
//! | [`instructions`] | what the operations of the firmware take, counted on an emulated microcontroller |
//! | [`pil`] | the firmware on an emulated microcontroller in the loop, beside the host's own run bit by bit |
//! | [`telemetry`] | the firmware's log of such a run, decoded, beside the truth |
//! | [`size`] | what the firmware takes of flash, RAM and stack, and that its loop can neither panic nor allocate |
//! | [`accuracy`] | speed against error of the fixed step, beside other crates' integrators |
//! | [`estimate`] | how far the filters are off the truth, beside a lower bound |
//! | [`filters`] | what each filter costs, beside how far it is off |
//! | [`chart`] | pictures as SVG |
//! | [`export`] | files that appear whole or not at all |
//! | [`keys`], [`cli`], [`error`] | the command itself |
//!
//! Clockwise and upward are positive; every name carries its unit.

pub mod accuracy;
pub mod allan;
pub mod averaged;
pub mod calibrate;
pub mod chance;
pub mod chart;
pub mod cli;
pub mod closed_loop;
pub mod desk;
pub mod disturbance;
mod document;
pub mod error;

pub mod estimate;
pub mod export;
pub mod filter;
pub mod filters;
pub mod instructions;
pub mod instruments;
pub mod keys;
pub mod pil;
pub mod plant;
pub mod position;
pub mod positioning_trials;
pub mod rate;
pub mod record;
pub mod reference;
pub mod reproduce;
pub mod response_map;
pub mod scene;
mod section;
pub mod simulate;
pub mod size;
pub mod spectrum;
pub mod statistics;
pub mod telemetry;

pub use error::CommandError;
pub use scene::{Kind, Scene, Setting};
