//! The ports of the loop on any board.

use controller::{Drive, LoopTiming, Sense};
use estimator::{CameraFrame, LdvSample};
use motor_model::DriveCommand;

use super::measurements::MeasurementQueues;

/// Instruments and amplifier: what the loop needs of the board.
pub(super) struct Ports<'a, D> {
    pub(super) measurements: &'a mut MeasurementQueues,
    pub(super) amplifier: &'a mut D,
}

impl<D> Sense for Ports<'_, D> {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.measurements.camera_frame()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.measurements.ldv_sample()
    }
}

impl<D: Drive> Drive for Ports<'_, D> {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.amplifier.drive(command)
    }

    fn timing(&self) -> LoopTiming {
        self.amplifier.timing()
    }
}
