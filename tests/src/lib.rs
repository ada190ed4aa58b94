//! Nothing but the README's code, which must compile and run. The system tests are in `system`, those on the emulated
//! microcontroller in `qemu`.

#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
