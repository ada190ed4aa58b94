//! Every key of a scene, one table for each thing that it describes.

pub mod calibrate;
pub mod camera;
pub mod estimator;
pub mod faults;
pub mod gyroscope;
pub mod plant;
pub mod position;
pub mod rate;
pub mod simulate;
pub mod vibrometer;
