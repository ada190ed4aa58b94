#![doc = include_str!("../README.md")]

#[cfg(all(test, feature = "solver"))]
mod bimetal_ring;
#[cfg(feature = "solver")]
pub mod deck;
pub mod drawing;
#[cfg(feature = "solver")]
pub mod drive;
#[cfg(feature = "solver")]
pub mod ensemble;
#[cfg(feature = "solver")]
pub mod fit;
#[cfg(feature = "solver")]
pub mod members;
#[cfg(feature = "solver")]
pub mod mesh;
#[cfg(feature = "solver")]
pub mod modes;
#[cfg(feature = "solver")]
pub mod solution;
#[cfg(feature = "solver")]
pub mod solver;

pub use drawing::{Clamp, Drawing, DrawingError, Silicon, Springs};
