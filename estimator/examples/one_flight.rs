//! One flight of the rotor, as the filter `twin` takes it: the impact that ends it, and what the impact tells.
//!
//! The motor has its nominal parameters, which the filter knows only within the tolerances. The vibrometer has 0.2 mm/s
//! of noise, and a frame of the camera 12 milli-degrees.

use estimator::{
    AngleFilter as _, CameraFrame, CheckedMotor, Estimate, ImpactInnovation, Instruments, LdvSample,
    TwinFilter, TwinTuning, Verdict,
};
use motor_model::{
    Angle, DriveCommand, DriveMode, Motor, MotorParams, MotorSetup, MotorState, RotorState, Time, math,
};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng as _;

/// Period of the vibrometer in us, and of the camera in periods of the vibrometer.
const PERIOD_US: u64 = 5;
const FRAME_PERIODS: u64 = 20;
const VIBROMETER_M_S: f64 = 2e-4;
const CAMERA_DEG: f64 = 0.012;

/// The rotor and its estimate.
struct Look {
    rotor: RotorState<f64>,
    estimate: Estimate<f64>,
}

impl Look {
    fn print(&self, what: &str) {
        let Self { rotor, estimate } = self;
        let off_mdeg = 1e3 * estimate.angle.minus(rotor.angle.angle()).degrees();
        let sd_mdeg = 1e3 * math::sqrt(estimate.angle_rad2).to_degrees();
        println!(
            "{what:<24} rate {:8.4} rad/s, estimate {:8.4} +- {:.4}; angle off by {off_mdeg:+.2} mdeg, +- {sd_mdeg:.2}",
            rotor.rate_rad_s,
            estimate.rate_rad_s,
            math::sqrt(estimate.rate_rad2_s2),
        );
    }
}

fn print_impact(impact: &ImpactInnovation<f64>) {
    let contact = impact.contact;
    println!(
        "impact: gap {:+.1} nm, predicted +- {:.1}; approach {:+.3} mm/s, predicted +- {:.3}; squares {:.2?}",
        1e9 * contact.gap_m,
        1e9 * math::sqrt(contact.gap_m2),
        1e3 * contact.approach_m_s,
        1e3 * math::sqrt(contact.approach_m2_s2),
        contact.normalised_squared(),
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let nominal = MotorParams::nominal();
    let motor = Motor::try_new(&nominal, &MotorSetup::with_step(5e-6))?;
    let tuning = TwinTuning::<f64>::new(&nominal, &Instruments::default());
    let mut filter = TwinFilter::new(&CheckedMotor::try_new(&nominal)?, &tuning);
    let (mut state, command) = (MotorState::default(), DriveCommand::full(DriveMode::B));
    let mut rng = Pcg64::seed_from_u64(2);
    let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
    filter.drive(Time::ZERO, command);
    let mut last_impact = Time::ZERO;
    while state.steps < 200_000 {
        let now = Time::from_micros(PERIOD_US * state.steps);
        let before = filter.estimate(now).map(|estimate| Look { rotor: state.rotor, estimate });
        motor.step(&mut state, command);
        let now = Time::from_micros(PERIOD_US * state.steps);
        #[expect(clippy::cast_possible_truncation, reason = "a sample is single precision")]
        let velocity_m_s = (state.rotor.velocity_m_s + VIBROMETER_M_S * noise()) as f32;
        let impact = filter.update_ldv(&LdvSample { taken_at: now, velocity_m_s });
        if let (Some(impact), Some(before), Some(estimate)) = (impact, before, filter.estimate(now)) {
            let flight_us = now.nanos_since(last_impact) / 1_000;
            last_impact = now;
            if now > Time::from_micros(300_000) && flight_us > 600 && impact.verdict == Verdict::Used {
                println!(
                    "flight of {flight_us} us, ended by an impact before {:.3} ms",
                    1e3 * now.seconds_since::<f64>(Time::ZERO)
                );
                before.print("before the impact");
                print_impact(&impact);
                Look { rotor: state.rotor, estimate }.print("after it");
                return Ok(());
            }
        }
        if state.steps.is_multiple_of(FRAME_PERIODS) {
            let degrees = state.rotor.angle.angle().degrees() + CAMERA_DEG * noise();
            filter.update_camera(&CameraFrame::new(now, Angle::from_degrees(degrees)));
        }
    }
    Err("no such flight in a second".into())
}
