//! What the tests share: tolerances, second implementations to compare with, motors, runs, the built command.

pub mod awkward_tables;
pub mod browser;
pub mod built_command;
pub mod checkout;
pub mod closeness;
pub mod consistency_rows;
pub mod fault_bench;
pub mod live_teeth;
pub mod motors;
pub mod oscillator;
pub mod page;
pub mod plant_step;
pub mod precise_filter;
pub mod python;
pub mod started;
pub mod steady;
pub mod tilting_reference;
pub mod tooth;
pub mod watched_twin;
