//! The tick driver: in every tick the rig moves under the command applied, then a program reads, estimates and drives.
//!
//! ```text
//! every 10 us:  the rig's plant moves under the command applied;
//!               the program takes what has arrived and gives the next command;
//!               an observer sees the moment, with the truth beside it
//! ```
//!
//! All programs that run a motor in ticks run here: the controller's loops, baselines, filters under a given drive,
//! recordings.
//!
//! Where the board's interrupts are late ([`LateInterrupts`]), the plant runs on beyond the tick before the program is
//! asked, which takes it for the time of the tick. A moment has the truth at that time.

use std::ops::ControlFlow;

use controller::{Drive, InFlight, LoopTiming, Sense, TICK_NANOS};
use estimator::{CameraFrame, LdvSample};
use motor_model::{Angle, DriveCommand, Time};

use crate::runs::late_interrupts::LateInterrupts;
use crate::runs::record::Impact;
use crate::scene::{Scene, SceneError};
use crate::world::instruments::camera::{DeliveredFrame, MarkCounts, MarkedPose};
use crate::world::plant::Plant;
use crate::world::pose::RotorTilt;
use crate::world::rig::{PlantStep, Rig};

/// A program that runs on the rig, tick by tick.
pub trait TickProgram {
    /// Its report of a tick.
    type Report;

    /// Whether it observes every step of the plant. A plant that is not observed takes longer steps at rest.
    const OBSERVES_STEPS: bool = false;

    /// Observes a step of the plant, and the plant after it.
    fn step(&mut self, step: &PlantStep, plant: &Plant) {
        let _ = (step, plant);
    }

    /// Takes what has arrived until `now`, and gives the command of the next tick.
    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> Self::Report;
}

/// The measurements that a tick took in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TickMeasurements {
    /// The last camera frame, if one had arrived.
    pub camera_frame: Option<CameraFrame>,
    /// What its marks showed; `None` of a single mark.
    pub marked: Option<MarkedPose>,
    /// Vibrometer samples, oldest first.
    pub ldv_samples: Vec<LdvSample>,
}

/// The ports of the rig for a program: two instruments and an amplifier.
#[derive(Clone, Debug)]
pub struct RigPorts {
    rig: Rig,
    /// The last command of the program; `None` of one that has given none.
    given: Option<DriveCommand>,
    /// The command that acts.
    command: DriveCommand,
    /// Those that do not act yet.
    in_flight: InFlight<DriveCommand>,
    timing: LoopTiming,
    /// The command that the amplifier applies whatever the program says.
    by_hand: Option<DriveCommand>,
    measurements: TickMeasurements,
    /// The impacts since the last tick.
    impacts: Vec<Impact>,
}

impl RigPorts {
    /// The plant: the truth. A filter may not use it.
    pub fn plant(&self) -> &Plant {
        self.rig.plant()
    }

    /// How many of the camera's pictures were not made of all marks; `None` of a single mark.
    pub fn mark_counts(&self) -> Option<MarkCounts> {
        self.rig.mark_counts()
    }
}

impl RigPorts {
    /// Gives the amplifier the command that acts from `now` on.
    fn apply(&mut self, now: Time) {
        let Some(given) = self.given else { return };
        let command = self.by_hand.unwrap_or(given);
        let acts_at = now.plus_nanos(TICK_NANOS * u64::from(self.timing.latency_ticks));
        self.in_flight.put(acts_at, |decision| *decision = command);
        self.command = *self.in_flight.acting(now);
    }
}

impl Sense for RigPorts {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        let DeliveredFrame { frame, marked } = self.rig.delivered_frame()?;
        self.measurements.camera_frame = Some(frame);
        self.measurements.marked = marked;
        Some(frame)
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        let sample = self.rig.ldv_sample();
        self.measurements.ldv_samples.extend(sample);
        sample
    }
}

impl Drive for RigPorts {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.given = Some(command);
        self.by_hand.unwrap_or(command)
    }

    fn timing(&self) -> LoopTiming {
        self.timing
    }
}

/// The end of a tick: the program's report, and the truth, which only the simulation knows.
#[derive(Clone, Copy, Debug)]
pub struct Moment<R> {
    /// The instant.
    pub at: Time,
    /// The rotor's true angle, as seen from above.
    pub angle: Angle,
    /// The integral of its rate about its own axis: what a gyroscope on it turns by.
    pub own_axis_angle: Angle,
    /// The rotor's true rate in rad/s.
    pub rate_rad_s: f64,
    /// Tilt, shift and height of a rotor that tilts.
    pub tilt: Option<RotorTilt>,
    /// The program's report.
    pub report: R,
}

impl<R> Moment<R> {
    /// The instant in s since the start.
    pub fn seconds(&self) -> f64 {
        self.at.seconds_since(Time::ZERO)
    }
}

/// Rig and program, ready to run.
#[derive(Clone, Debug)]
pub struct TickDriver<P> {
    ports: RigPorts,
    program: P,
    /// `None` of interrupts that are on time.
    interrupts: Option<LateInterrupts>,
    /// Steps of the plant by which it has run beyond the last tick.
    beyond: u64,
}

/// The truth at the end of a tick.
struct Truth {
    at: Time,
    angle: Angle,
    own_axis_angle: Angle,
    rate_rad_s: f64,
    tilt: Option<RotorTilt>,
}

impl Truth {
    fn of(plant: &Plant) -> Self {
        let (rotor, own_axis_angle) = (plant.rotor(), plant.own_axis_angle());
        let (angle, rate_rad_s) = (rotor.angle, rotor.rate_rad_s);
        Self { at: plant.now(), angle, own_axis_angle, rate_rad_s, tilt: plant.tilt() }
    }
}

impl<P: TickProgram> TickDriver<P> {
    /// The rig of a scene, at rest, with the drive off.
    ///
    /// # Errors
    /// When the model refuses the plant, or the rig its instruments or the plant's step.
    pub fn new(scene: &Scene, program: P) -> Result<Self, SceneError> {
        let rig = Rig::new(scene)?;
        Ok(Self {
            ports: RigPorts {
                rig,
                given: None,
                command: DriveCommand::OFF,
                in_flight: InFlight::new(),
                timing: LoopTiming::default(),
                by_hand: None,
                measurements: TickMeasurements::default(),
                impacts: Vec::new(),
            },
            program,
            interrupts: None,
            beyond: 0,
        })
    }

    /// The same with a program that decides, and whose commands act, at these times.
    #[must_use]
    pub fn with_timing(mut self, timing: LoopTiming) -> Self {
        self.ports.timing = timing;
        self
    }

    /// The same with the interrupts of a board that are late.
    #[must_use]
    pub fn with_interrupts(mut self, interrupts: Option<LateInterrupts>) -> Self {
        self.interrupts = interrupts;
        self
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        self.ports.rig.plant()
    }

    /// How many of the camera's pictures were not made of all marks; `None` of a single mark.
    pub fn mark_counts(&self) -> Option<MarkCounts> {
        self.ports.mark_counts()
    }

    /// The program, to look at.
    pub fn program(&self) -> &P {
        &self.program
    }

    /// The program, to change.
    pub fn program_mut(&mut self) -> &mut P {
        &mut self.program
    }

    /// The program, when the run is over.
    pub fn into_program(self) -> P {
        self.program
    }

    /// The measurements of the last tick.
    pub fn measurements(&self) -> &TickMeasurements {
        &self.ports.measurements
    }

    /// The rotor's impacts in the last tick, which only the simulation knows, oldest first.
    pub fn impacts(&self) -> &[Impact] {
        &self.ports.impacts
    }

    /// Puts `command` in the place of the last command of the program.
    pub fn overrule(&mut self, command: DriveCommand) {
        self.ports.command = command;
    }

    /// Drives by hand from the end of the next tick and its latency on: the amplifier applies `command` whatever the
    /// program says, and the program is told so. `None` gives the drive back to the program.
    pub fn drive_by_hand(&mut self, command: Option<DriveCommand>) {
        self.ports.by_hand = command;
    }

    /// Takes the faults of `scene` from now on. Otherwise `scene` is the driver's own, and all that differs of its
    /// faults comes after now: the run is then that of `scene` from the start.
    ///
    /// # Errors
    /// When the rig or the model refuses a fault; then all is as it was.
    pub fn change_faults(&mut self, scene: &Scene) -> Result<(), SceneError> {
        self.ports.rig.change_faults(scene)
    }

    /// Runs to the end of the next tick.
    pub fn next_tick(&mut self) -> Moment<P::Report> {
        self.ports.impacts.clear();
        let late = self.interrupts.as_mut().map_or(0, LateInterrupts::draw);
        if self.interrupts.as_ref().is_some_and(LateInterrupts::takes_samples) {
            self.ports.rig.sample_late(late);
        }
        self.run_plant(self.ports.rig.tick_steps() - self.beyond);
        let Truth { at, angle, own_axis_angle, rate_rad_s, tilt } = Truth::of(self.ports.rig.plant());
        self.run_plant(late);
        self.beyond = late;
        let Self { ports, program, .. } = self;
        ports.measurements.camera_frame = None;
        ports.measurements.marked = None;
        ports.measurements.ldv_samples.clear();
        let report = program.tick(at, ports);
        ports.apply(at);
        Moment { at, angle, own_axis_angle, rate_rad_s, tilt, report }
    }

    /// The plant under the command that acts, over so many of its steps.
    fn run_plant(&mut self, steps: u64) {
        let Self { ports: RigPorts { rig, command, impacts, .. }, program, .. } = self;
        if P::OBSERVES_STEPS {
            rig.run_in_steps(steps, *command, &mut |step, plant| {
                impacts.extend(Impact::of(step));
                program.step(step, plant);
            });
        } else {
            rig.run(steps, *command, &mut |step| impacts.extend(Impact::of(step)));
        }
    }

    /// Runs until `observe` breaks, and returns its value.
    pub fn run<B>(&mut self, mut observe: impl FnMut(&mut Self, Moment<P::Report>) -> ControlFlow<B>) -> B {
        loop {
            let moment = self.next_tick();
            if let ControlFlow::Break(value) = observe(self, moment) {
                return value;
            }
        }
    }
}
