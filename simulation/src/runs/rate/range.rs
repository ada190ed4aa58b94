//! The range of a motor's rates, in open loop.

use motor_model::{Angle, DriveCommand, DriveMode, Parameter, Time};
use serde::Serialize;

use super::SETTLE_S;
use crate::runs::RunError;
use crate::runs::limits;
use crate::scene::Scene;
use crate::world::plant::Plant;

/// The fastest mean rates of a motor, at the amplitude that turns it fastest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateRange {
    /// Mean rate in mode B, clockwise, in deg/s.
    pub clockwise_deg_s: f64,
    /// Mean rate in mode C, counter-clockwise and so negative.
    pub counter_clockwise_deg_s: f64,
}

/// A motor that is driven at one amplitude.
struct Driven {
    plant: Plant,
    command: DriveCommand,
    settled_at: Angle,
}

impl RateRange {
    /// Amplitudes of which the fastest is taken. A rotor that tilts may be fastest below full drive.
    const AMPLITUDES: [f32; 5] = [0.3, 0.4, 0.5, 0.7, 1.0];
    /// Time in s, after [`SETTLE_S`], after which the amplitudes are compared.
    const COMPARED_OVER_S: f64 = 0.35;
    /// Time of the mean in s, after [`SETTLE_S`]. Since the rate ripples by a third, the mean scatters by some 2 %.
    const MEAN_OVER_S: f64 = 5.0;

    /// The range of the motor of `scene`, without loop and faults, with a drive at the resonance that the loop follows.
    ///
    /// # Errors
    /// When the model refuses the scene's parameters.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        Ok(Self {
            clockwise_deg_s: fastest_deg_s(scene, DriveMode::B, 1.0)?,
            counter_clockwise_deg_s: fastest_deg_s(scene, DriveMode::C, -1.0)?,
        })
    }

    /// Whether a `profile` of `rate_deg_s` is within it.
    pub(super) fn holds_profile(self, rate_deg_s: f64, profile: &str) -> bool {
        self.holds(rate_deg_s) && (profile != "both_ways" || self.holds(-rate_deg_s))
    }

    /// Whether `rate_deg_s` is within it.
    pub fn holds(self, rate_deg_s: f64) -> bool {
        (self.counter_clockwise_deg_s..=self.clockwise_deg_s).contains(&rate_deg_s)
    }
}

/// The mean rate in deg/s at the amplitude of `mode` that turns fastest in the direction `along`, 1 or -1.
fn fastest_deg_s(scene: &Scene, mode: DriveMode, along: f64) -> Result<f64, RunError> {
    let mut fastest = None;
    let most = limits::rate_tuning(scene).amplitude_max;
    for amplitude in RateRange::AMPLITUDES.map(|amplitude| amplitude.min(most)) {
        let mut driven = Driven::settled(scene, DriveCommand::saturating(mode, amplitude))?;
        let turned_deg = along * driven.turned_deg(RateRange::COMPARED_OVER_S);
        if fastest.as_ref().is_none_or(|(most_deg, _)| turned_deg > *most_deg) {
            fastest = Some((turned_deg, driven));
        }
    }
    let mean =
        |(_, mut driven): (f64, Driven)| driven.turned_deg(RateRange::MEAN_OVER_S) / RateRange::MEAN_OVER_S;
    Ok(fastest.map_or(0.0, mean))
}

/// `command` at the resonance of the motor of `scene`, where the loop's drive follows it: farther from the design's
/// than half a half width. A nearer one costs less than a fifteenth of the rate.
fn at_resonance(scene: &Scene, plant: &Plant, command: DriveCommand) -> DriveCommand {
    let (frequency, damping_ratio) = match command.mode() {
        Some(DriveMode::B) => (Parameter::ModeBFrequency, Parameter::ModeBDampingRatio),
        Some(DriveMode::C) => (Parameter::ModeCFrequency, Parameter::ModeCDampingRatio),
        None => return command,
    };
    let design = scene.motor_params();
    let offset_hz = plant.params().get(frequency) - design.get(frequency);
    let is_followed = offset_hz.abs() > 0.5 * design.get(damping_ratio) * design.get(frequency);
    #[expect(clippy::cast_possible_truncation, reason = "a command has single precision")]
    let offset_hz = if is_followed { offset_hz as f32 } else { 0.0 };
    command.with_saturating_offset(offset_hz)
}

impl Driven {
    /// The motor of `scene` after [`SETTLE_S`] with `command`.
    fn settled(scene: &Scene, command: DriveCommand) -> Result<Self, RunError> {
        let plant = Plant::draw(scene)?;
        let command = at_resonance(scene, &plant, command);
        let mut driven = Self { plant, command, settled_at: Angle::ZERO };
        driven.run_until(SETTLE_S);
        driven.settled_at = driven.plant.rotor().angle;
        Ok(driven)
    }

    /// Turn in degrees over the first `over_s` after settling.
    fn turned_deg(&mut self, over_s: f64) -> f64 {
        self.run_until(SETTLE_S + over_s);
        self.plant.rotor().angle.minus(self.settled_at).degrees()
    }

    fn run_until(&mut self, until_s: f64) {
        while self.plant.now().seconds_since::<f64>(Time::ZERO) < until_s {
            self.plant.step(self.command);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motor 1 % off its design is as fast as one of the design within a tenth, since the drive follows it.
    #[test]
    fn law_a_motor_beside_its_design_reaches_what_others_do() {
        let reach = |sets: &[&str]| {
            let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
            RateRange::of(&Scene::of_sets(&sets).unwrap()).unwrap()
        };
        let design = reach(&["plant.parameters=nominal"]);
        let warm = reach(&["plant.parameters=nominal", "plant.motor.mode_b.frequency_hz=6237"]);
        let part = warm.clockwise_deg_s / design.clockwise_deg_s;
        assert!((0.9..1.1).contains(&part), "{warm:?} {design:?}");
    }

    /// The motor of set F turns at some 100 deg/s at full drive of mode B, and twice as fast at 0.4 of it.
    #[test]
    fn law_a_motor_that_is_fastest_below_full_drive_reaches_that_rate() {
        let set_f = [
            "plant.rotor=tilting",
            "plant.motor.friction=0.15",
            "plant.motor.vertical_damping_n_s_per_m=0.9e-3",
            "plant.motor.mode_shift_deg=1.25",
            "plant.motor.tooth_rocking_exponent=2.0",
            "plant.motor.hub.clearance_m=7e-6",
            "plant.motor.hub.friction=0.4",
            "plant.motor.hub.restitution=0.5",
            "plant.motor.stator_tilt.frequency_hz=5000",
            "plant.motor.stator_tilt.damping_ratio=0.02",
        ];
        let scene = Scene::of_sets(&set_f.map(str::to_owned)).unwrap();
        let full_deg = Driven::settled(&scene, DriveCommand::full(DriveMode::B)).unwrap().turned_deg(1.0);
        let reach = RateRange::of(&scene).unwrap();
        assert!(full_deg > 0.0 && reach.clockwise_deg_s > 1.4 * full_deg, "{reach:?}, {full_deg}");
        assert!(reach.holds(1.2 * full_deg) && reach.counter_clockwise_deg_s < -50.0, "{reach:?}");
    }
}
