//! What the system tests share with the benchmarks, and the README's code, which must compile and run. The system tests
//! are in `system`, those on the emulated microcontroller in `qemu`.

pub mod matrix_covariance;

#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
