//! The measuring instruments: what camera and vibrometer make of the rotor's motion.

pub mod camera;
pub mod ldv;

pub use camera::Camera;
pub use ldv::Ldv;
