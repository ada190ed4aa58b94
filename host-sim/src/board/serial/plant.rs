//! The simulated motor under the drive that the board reports: hardware in the loop.
//!
//! The plant has no time of its own: it runs as far as the board has reported, and its frames go to the board at once.
//! A move and an experiment report every tick in which they change their drive, so that the plant has the very drive of
//! the board, where no report is lost on the line. A rate reports every millisecond, and changes its drive twice in
//! that time: of both changes the plant learns the second, and when it was.

use controller::{Drive as _, PositionLoop, Sense as _};
use estimator::CameraFrame;
use motor_model::{DriveCommand, Time};

use simulation::runs::record::{Impact, Truth};
use simulation::runs::tick_driver::{Moment, RigPorts, TickDriver, TickProgram};
use simulation::scene::{Scene, SceneError};

/// Takes what the instruments deliver, and drives as it was told.
struct Follower {
    command: DriveCommand,
}

impl TickProgram for Follower {
    type Report = DriveCommand;

    fn tick(&mut self, _: Time, ports: &mut RigPorts) -> DriveCommand {
        let _ = ports.camera_frame();
        while ports.ldv_sample().is_some() {}
        ports.drive(self.command)
    }
}

/// The plant of a run. Its time begins when the board is armed.
pub(super) struct PlantInTheLoop {
    driver: TickDriver<Follower>,
    ticks: u64,
    last: Option<Moment<DriveCommand>>,
    /// Frames delivered since they were last taken, oldest first.
    frames: Vec<CameraFrame>,
    impacts: Vec<Impact>,
}

impl PlantInTheLoop {
    /// The plant of a scene, at rest.
    ///
    /// # Errors
    /// When the scene is refused.
    pub(super) fn new(scene: &Scene) -> Result<Self, SceneError> {
        let driver = TickDriver::new(scene, Follower { command: DriveCommand::OFF })?;
        Ok(Self { driver, ticks: 0, last: None, frames: Vec::new(), impacts: Vec::new() })
    }

    /// Runs until tick `ticks`, at which the board reports `command`, applied since `since` where that is known.
    pub(super) fn follow(&mut self, ticks: u64, command: DriveCommand, since: Option<Time>) {
        if command != self.driver.program().command {
            let since = since.map_or(ticks, |since| since.nanos() / PositionLoop::TICK_NANOS);
            self.run_until(since.min(ticks));
            self.driver.program_mut().command = command;
            self.driver.overrule(command);
        }
        self.run_until(ticks);
    }

    fn run_until(&mut self, ticks: u64) {
        while self.ticks < ticks {
            self.ticks += 1;
            self.last = Some(self.driver.next_tick());
            self.frames.extend(self.driver.measurements().camera_frame);
            self.impacts.extend_from_slice(self.driver.impacts());
        }
    }

    /// The frames since the last call.
    pub(super) fn take_frames(&mut self) -> Vec<CameraFrame> {
        std::mem::take(&mut self.frames)
    }

    /// The impacts since the last call.
    pub(super) fn take_impacts(&mut self) -> Vec<Impact> {
        std::mem::take(&mut self.impacts)
    }

    /// The rotor now; `None` before the first tick.
    pub(super) fn truth(&self) -> Option<Truth> {
        let Moment { angle, own_axis_angle, rate_rad_s, tilt, .. } = self.last?;
        let plant = self.driver.plant();
        let (height_m, velocity_m_s) = (plant.height_m(), plant.rotor().velocity_m_s);
        Some(Truth { angle, own_axis_angle, rate_rad_s, height_m, velocity_m_s, tilt })
    }
}

#[cfg(test)]
mod tests {
    use motor_model::DriveMode;

    use super::*;

    /// The plant under reports is that of the tick driver under the same drive, to the bit, whenever the reports come.
    #[test]
    fn dual_reports_that_tell_when_a_drive_began_give_the_plant_of_that_drive() {
        let sets = ["camera.frame_rate_hz=1000", "ldv.installed=no"].map(str::to_owned);
        let scene = Scene::of_sets(&sets).unwrap();
        let drive = DriveCommand::full(DriveMode::B);
        let mut plant = PlantInTheLoop::new(&scene).unwrap();
        plant.follow(200, DriveCommand::OFF, None);
        // It began 40 ticks before the report, and ends with the last one.
        plant.follow(300, drive, Some(Time::from_nanos(260 * PositionLoop::TICK_NANOS)));
        plant.follow(700, drive, Some(Time::from_nanos(260 * PositionLoop::TICK_NANOS)));
        plant.follow(900, DriveCommand::OFF, None);
        plant.follow(1500, DriveCommand::OFF, None);

        let mut expected = TickDriver::new(&scene, Follower { command: DriveCommand::OFF }).unwrap();
        let mut frames = Vec::new();
        for tick in 0..1500 {
            // What a tick decides is applied in the next.
            let command = if (260..900).contains(&tick) { drive } else { DriveCommand::OFF };
            expected.program_mut().command = command;
            expected.overrule(command);
            expected.next_tick();
            frames.extend(expected.measurements().camera_frame);
        }
        assert_eq!(plant.driver.plant().rotor(), expected.plant().rotor());
        assert!(plant.truth().unwrap().angle.degrees() > 0.1, "{:?}", plant.truth());
        assert_eq!(plant.take_frames(), frames);
        assert!(frames.len() == 14 && plant.take_frames().is_empty(), "{}", frames.len());
        assert!(!plant.take_impacts().is_empty() && plant.take_impacts().is_empty());
    }
}
