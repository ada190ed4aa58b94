//! The twin beside a motor under drives that follow each other: its errors, its innovations, and what it has learnt.
//!
//! Runs that several tests judge are made once ([`STEADY`], [`REVERSALS`]).

use std::f64::consts::TAU;
use std::sync::LazyLock;

use analysis::filter_errors::error_sums::ErrorSums;
use estimator::{AngleFilter as _, LEARNT, LEARNT_NAMES, Learnt, TwinFilter, true_parts};
use motor_model::{DriveCommand, DriveMode, Parameter, Phase};
use rayon::prelude::*;
use simulation::Scene;
use simulation::math::count::real;
use simulation::runs::filter::AnyFilter;
use simulation::world::plant::Plant;
use simulation::world::rig::Rig;

/// A tick of the loop in s.
const TICK_S: f64 = 1e-5;

/// A number of the motor that the twin estimates, and its true value.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    pub name: &'static str,
    pub learnt: Learnt,
    pub truth: f64,
}

impl Judged {
    /// Square of the error per its variance.
    pub fn normalised(&self) -> f64 {
        self.error_squared() / self.learnt.variance
    }

    /// Square of truth less estimate.
    pub fn error_squared(&self) -> f64 {
        let error = self.truth - self.learnt.estimate;
        error * error
    }
}

/// What became of a run.
#[derive(Clone, Debug)]
pub struct WatchedTwin {
    /// In each of the drives.
    pub parts: Vec<ErrorSums>,
    /// At the end: the parameters, friction and tooth factor, and the phase of the drive.
    pub learnt: Vec<Judged>,
}

/// Drives that follow each other, each for some ticks of 10 us.
pub type Drives = [(DriveCommand, u64)];

/// 40 motors and a single mark from rest, in mode B and in mode C: 0.25 s of spin-up, then 0.5 s.
pub static STEADY: LazyLock<[(&str, Vec<WatchedTwin>); 2]> = LazyLock::new(|| {
    [("b", DriveMode::B), ("c", DriveMode::C)]
        .map(|(name, mode)| (name, DriveCommand::full(mode)))
        .map(|(name, command)| (name, each("1", 40, &[(command, 25_000), (command, 50_000)])))
});

/// 80 motors and two marks in 0.3 s of a mode, the first 50 ms of the other, and 0.45 s of that.
pub static REVERSALS: LazyLock<[(&str, Vec<WatchedTwin>); 2]> = LazyLock::new(|| {
    let [b, c] = [DriveMode::B, DriveMode::C].map(DriveCommand::full);
    [("c after b", b, c), ("b after c", c, b)]
        .map(|(name, before, after)| (name, [(before, 30_000), (after, 5_000), (after, 45_000)]))
        .map(|(name, drives)| (name, each("2", 80, &drives)))
});

/// The first `motors` motors under some drives, by a camera on so many marks.
pub fn each(marks: &str, motors: u64, drives: &Drives) -> Vec<WatchedTwin> {
    (1..=motors).into_par_iter().map(|motor| watched(marks, motor, drives)).collect()
}

fn watched(marks: &str, motor: u64, drives: &Drives) -> WatchedTwin {
    let mut scene = Scene::default();
    scene.set("camera.marks", marks).expect("a number of marks");
    scene.set("seed", &motor.to_string()).expect("a seed");
    let mut rig = Rig::new(&scene).expect("a rig");
    let mut twin = AnyFilter::<f32>::named("twin", &scene).expect("the nominal motor");
    let mut tick = 0_u64;
    let mut part = |&(command, ticks): &(DriveCommand, u64)| {
        let mut sums = ErrorSums::default();
        for _ in 0..ticks {
            follow(&mut rig, &mut twin, command, &mut sums);
            if tick.is_multiple_of(7) {
                let (estimate, health) = twin.assess(rig.plant().now());
                let rotor = rig.plant().rotor();
                sums.estimate(estimate.as_ref(), health, rotor.angle, rotor.rate_rad_s);
            }
            tick += 1;
        }
        sums
    };
    let parts = drives.iter().map(&mut part).collect();
    let AnyFilter::Twin(twin) = &twin else { unreachable!("named so") };
    let mut learnt = parameters(twin, &scene, rig.plant());
    learnt.push(phase(twin, &scene, rig.plant(), drives));
    WatchedTwin { parts, learnt }
}

/// One tick of 10 us.
fn follow(rig: &mut Rig, twin: &mut AnyFilter<f32>, command: DriveCommand, sums: &mut ErrorSums) {
    twin.drive(rig.plant().now(), command);
    rig.tick_in_steps(command, &mut |_, _| ());
    while let Some(sample) = rig.ldv_sample() {
        if let Some(innovation) = twin.update_ldv(&sample) {
            sums.impact(&innovation);
        }
    }
    while let Some(frame) = rig.camera_frame() {
        sums.innovation(&twin.update_camera(&frame));
    }
}

fn parameters(twin: &TwinFilter<f32>, scene: &Scene, plant: &Plant) -> Vec<Judged> {
    let learnt: [Learnt; LEARNT] = twin.learnt().expect("some frames");
    let variation = plant.amplitude_variation().expect("a rotor that does not tilt");
    let truth = true_parts(&scene.motor_params(), plant.params(), variation).expect("a motor of the model");
    let named = LEARNT_NAMES.into_iter().zip(learnt.into_iter().zip(truth));
    named.map(|(name, (learnt, truth))| Judged { name, learnt, truth }).collect()
}

/// The phase of the drive in rad, as the lead of the true one before that of the twin: the generator drives at the
/// resonances of the design from phase 0 on.
fn phase(twin: &TwinFilter<f32>, scene: &Scene, plant: &Plant, drives: &Drives) -> Judged {
    let design = scene.motor_params();
    let hz = |command: &DriveCommand| match command.mode() {
        Some(DriveMode::B) => design.get(Parameter::ModeBFrequency),
        Some(DriveMode::C) => design.get(Parameter::ModeCFrequency),
        None => 0.0,
    };
    let turns: f64 = drives.iter().map(|(command, ticks)| hz(command) * TICK_S * real(*ticks)).sum();
    let learnt = twin.learnt_phase().expect("some samples");
    let behind_s: f64 = plant.now().seconds_since(learnt.at);
    let last = drives.last().map_or(0.0, |(command, _)| hz(command));
    let truth = Phase::from_turns(turns - last * behind_s);
    let lead = truth.units().wrapping_sub(learnt.phase.units()).cast_signed();
    #[expect(clippy::cast_precision_loss, reason = "a rounding of 2^-53 turns")]
    let lead_rad = lead as f64 * (TAU / 18_446_744_073_709_551_616.0);
    let (variance, prior_variance) = (learnt.variance_rad2, learnt.prior_rad2);
    Judged {
        name: "drive phase",
        learnt: Learnt { estimate: -lead_rad, variance, prior_variance },
        truth: 0.0,
    }
}
