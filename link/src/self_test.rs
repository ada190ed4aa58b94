//! What a board can tell of itself while the rotor rests.

use serde::{Deserialize, Serialize};

use crate::observation::{CameraAges, VelocitySums};

/// What a board has seen of itself over [`Self::TICKS`], with the drive off. What is good is for the host to judge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SelfTestReport {
    /// Whether neither an error of pulse width or enabling pin nor an over-current has occurred since the last arming
    /// or jog, or since the start.
    pub amplifier_works: bool,
    /// Whether the board has a converter for a vibrometer. Without one the samples are those of the host.
    pub has_converter: bool,
    /// Ticks that the loop ran.
    pub ticks: u32,
    /// Ticks that were lost, or ended after the next had begun.
    pub late_ticks: u32,
    /// The vibrometer. A converter has [`Self::SAMPLES_PER_TICK`], and fewer when some were out of its range.
    pub velocity: VelocitySums,
    /// The camera.
    pub camera: CameraAges,
    /// The most bytes of stack used since the start; 0 where it is not measured.
    pub stack_bytes_max: u32,
    /// The bytes that there are for it; 0 where that is not known.
    pub stack_bytes: u32,
}

impl SelfTestReport {
    /// Length of the test in ticks: 100 ms. A camera of 100 frames a second has ten, and a mean of as many samples is a
    /// hundred times as certain as one.
    pub const TICKS: u64 = 10_000;

    /// Samples of a board's converter in a tick: 200,000 a second.
    pub const SAMPLES_PER_TICK: u32 = 2;
}
