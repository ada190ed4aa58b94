//! Rows in; text, pictures and files out. Nothing here knows a motor.

pub mod chart;
pub mod document;
pub mod files;
pub mod section;
