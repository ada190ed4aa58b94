//! Moves a simulated motor by 20 degrees and prints the phases of the move.
//!
//! The motor is the nominal one of `motor_model`. Its camera takes 10,000 frames a second of a single mark with the
//! noise of two pixels, each delivered one frame late.

use controller::{
    Drive, PositionLoop, PositioningPhase, PositioningTuning, ResponseMap, Sense, TICK_NANOS, Target, tick,
};
use estimator::{CameraDescription, CameraFrame, ConstantRate, ConstantRateTuning, Instruments, LdvSample};
use motor_model::{Angle, DriveCommand, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

const TARGET_DEG: f64 = 20.0;
const TOLERANCE_DEG: f64 = 0.005;
const TICKS_PER_FRAME: u64 = 10;
const TICKS_MAX: u64 = 500_000;
/// A pixel, 2 um at 3.9 mm, in units of 2^-32 turn.
const PIXEL_UNITS: i64 = 350_546;
/// Step of the noise sequence, near the golden section of two pixels: it fills them evenly.
const NOISE_STEP: u64 = 433_299;

/// Camera and vibrometer on the simulated motor, and an amplifier without limits.
#[derive(Default)]
struct Rig {
    exposed: Option<CameraFrame>,
    arrived: Option<CameraFrame>,
    ldv: Option<LdvSample>,
}

impl Rig {
    /// Measures the motor as it is at the beginning of tick number `ticks`.
    fn measure(&mut self, state: &MotorState<f32>, ticks: u64, now: Time) {
        // A vibrometer without noise would count as one without light.
        let noise_m_s = if ticks.is_multiple_of(2) { 1e-5 } else { -1e-5 };
        self.ldv = Some(LdvSample { taken_at: now, velocity_m_s: state.rotor.velocity_m_s + noise_m_s });
        if ticks.is_multiple_of(TICKS_PER_FRAME) {
            let frame = ticks / TICKS_PER_FRAME;
            let noise =
                frame.wrapping_mul(NOISE_STEP).cast_signed().rem_euclid(2 * PIXEL_UNITS) - PIXEL_UNITS / 2;
            // Half a pixel is in the noise, so that the division rounds to the nearest pixel.
            let pixels = (state.rotor.angle.angle().units() + noise).div_euclid(PIXEL_UNITS);
            let angle = Angle::from_units(pixels * PIXEL_UNITS).wrapped();
            self.arrived = self.exposed.replace(CameraFrame::new(now, angle));
        }
    }
}

impl Sense for Rig {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.arrived.take()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.take()
    }
}

impl Drive for Rig {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }
}

fn name(phase: &PositioningPhase) -> String {
    match phase {
        PositioningPhase::Waiting(health) => format!("waiting: {health:?}"),
        PositioningPhase::Cruise { cruise, .. } => {
            format!("cruise {:?} at {:.0} %", cruise.mode, 100.0 * cruise.amplitude)
        }
        PositioningPhase::Burst { family, burst, .. } => format!("{family:?} of {} ticks", burst.ticks),
        PositioningPhase::Settling(_) => "settling".to_owned(),
        PositioningPhase::Brake { mode, .. } => format!("brake by {mode:?}"),
        PositioningPhase::Holding => "holding".to_owned(),
        PositioningPhase::Stopped(why) => format!("stopped: {why:?}"),
    }
}

fn main() -> Result<(), OutOfBounds> {
    let step_s = std::time::Duration::from_nanos(TICK_NANOS).as_secs_f64();
    let motor = Motor::<f32>::try_new(&MotorParams::nominal(), &MotorSetup::with_step(step_s))?;
    let mut state = MotorState::default();
    let mut rig = Rig::default();
    let camera = CameraDescription { marks: 1, ..CameraDescription::default() };
    let instruments = Instruments { camera, ..Instruments::default() };
    let tuning = ConstantRateTuning::for_motor(&MotorParams::nominal(), &instruments);
    let filter = ConstantRate::<f32>::new(&tuning);
    let target = Target::try_new(TARGET_DEG, TOLERANCE_DEG)?;
    let map = ResponseMap::table_1();
    let mut position_loop = PositionLoop::new(filter, map, target, PositioningTuning::default(), Time::ZERO);
    let mut last = String::new();
    for ticks in 0..TICKS_MAX {
        let now = Time::from_nanos(ticks * TICK_NANOS);
        rig.measure(&state, ticks, now);
        let report = tick(&mut position_loop, now, &mut rig);
        let phase = name(&report.phase);
        if phase != last {
            let [time_ms, angle_deg] = [now.seconds_since::<f64>(Time::ZERO) * 1e3, degrees(&state)];
            println!("{time_ms:8.2} ms  {angle_deg:9.4} deg  {phase}");
            last = phase;
        }
        if matches!(report.phase, PositioningPhase::Holding | PositioningPhase::Stopped(_)) {
            break;
        }
        motor.step(&mut state, report.applied);
    }
    println!("off the target by {:.2} milli-degrees", 1e3 * (degrees(&state) - TARGET_DEG));
    Ok(())
}

fn degrees(state: &MotorState<f32>) -> f64 {
    state.rotor.angle.angle().degrees()
}
