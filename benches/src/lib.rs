//! What a step costs, measured by criterion: `cargo bench -p benches`.
//!
//! Nothing to import here; each bench is a file of its own beside this folder.
