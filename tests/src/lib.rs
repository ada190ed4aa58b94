//! Nothing but the code of README and tutorials, which must compile and run. The system tests are in `system`, those on
//! the emulated microcontroller in `qemu`.

#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

#[cfg(doctest)]
#[doc = include_str!("../../docs/tutorial-researcher.md")]
struct TutorialResearcher;

#[cfg(doctest)]
#[doc = include_str!("../../docs/tutorial-firmware.md")]
struct TutorialFirmware;
