//! A step that begins while the stator rings turns the rotor by another angle; one that begins after the ring-down of
//! [`controller::ring_down`] does not. The plant alone, driven by hand: height-only motors, and those of set F.

use std::path::Path;

use controller::TICK_NANOS;
use controller::ring_down::RingDown;
use host_sim::scene_files::load;
use motor_model::math::sqrt;
use motor_model::{DriveCommand, DriveMode, Time};
use simulation::Scene;
use simulation::math::statistics::Spread;
use simulation::world::plant::Plant;

use crate::support::plant_step::CONVERGED;

/// A nudge of some milli-degrees and the steps that follow it: amplitude, ticks.
const NUDGE: (f32, u32) = (0.3, 16);
const STEP: (f32, u32) = (0.25, 27);
/// Steps of the plant in a tick of the loop.
const STEPS_PER_TICK: u32 = 2;
/// Ticks in which the stator of every motor has come to rest: ten time constants of mode B and more.
const QUIET_TICKS: u32 = 6_000;
/// Ticks after which the filter says that the rotor rests.
const RINGING_TICKS: u32 = 400;
const MOTORS: u64 = 24;

/// Relative spread of a step about its forecast that the controller counts with.
const FORECAST_SPREAD: f64 = 0.06;

fn run(plant: &mut Plant, command: DriveCommand, ticks: u32) {
    for _ in 0..STEPS_PER_TICK * ticks {
        plant.step(command);
    }
}

/// Turn in mdeg, in the direction of mode C, of a step and of what follows it until rest.
fn step_mdeg(mut plant: Plant) -> f64 {
    let before = plant.rotor().angle;
    run(&mut plant, DriveCommand::saturating(DriveMode::C, STEP.0), STEP.1);
    run(&mut plant, DriveCommand::OFF, QUIET_TICKS);
    -1e3 * plant.rotor().angle.minus(before).degrees()
}

/// By how much a step `ticks` after a nudge turns more than one on a quiet stator, per turn of that, by each motor.
fn relative_differences(scene: &Scene, ticks: u32) -> Spread {
    let of_motor = |number| {
        let mut plant = Plant::draw(&scene.of_run(number).expect("a scene")).expect("a motor");
        run(&mut plant, DriveCommand::OFF, QUIET_TICKS);
        run(&mut plant, DriveCommand::saturating(DriveMode::B, NUDGE.0), NUDGE.1);
        run(&mut plant, DriveCommand::OFF, ticks);
        let soon = step_mdeg(plant.clone());
        run(&mut plant, DriveCommand::OFF, QUIET_TICKS);
        let quiet = step_mdeg(plant);
        (soon - quiet) / quiet
    };
    (0..MOTORS).map(of_motor).collect()
}

fn root_mean_square(of: Spread) -> f64 {
    sqrt(of.mean * of.mean + of.sd * of.sd)
}

/// What a nudge does to the step that follows it, as root mean square over motors: within the spread of forecasts once
/// the stator is quiet, and beyond it while the rotor already lies still by the filter, after 4 ms.
#[test]
fn law_a_step_on_a_quiet_stator_turns_as_forecast() {
    let set_f = load(Some(Path::new("set_f_plant")), &[]).expect("a scene of the gallery");
    let check = |name: &str, mut scene: Scene| {
        let (key, step_s) = CONVERGED;
        scene.set(key, step_s).expect("a step");
        let ring_down = RingDown::new(&scene.motor_params(), Time::ZERO);
        let is_over = |ticks: &u32| ring_down.is_over(Time::from_nanos(TICK_NANOS * u64::from(*ticks)));
        let quiet_ticks = (0..QUIET_TICKS).find(is_over).expect("a ring-down");
        let ringing = root_mean_square(relative_differences(&scene, RINGING_TICKS));
        assert!(ringing > FORECAST_SPREAD, "{name}: {ringing}");
        let quiet = root_mean_square(relative_differences(&scene, quiet_ticks));
        assert!(quiet < FORECAST_SPREAD, "{name}: {quiet}");
    };
    std::thread::scope(|threads| {
        threads.spawn(|| check("height only", Scene::default()));
        check("set F", set_f);
    });
}
