//! A rotor whose motion is known, what drives it, and the camera that shows it to a filter.

use std::collections::VecDeque;

use estimator::{
    AngleFilter, CameraDescription, CameraFrame, CheckedMotor, ConstantRate, ConstantRateTuning, Estimate,
    Health, ImpactAided, ImpactAidedTuning, Instruments, LdvSample, TwinFilter, TwinTuning, Verdict,
};
use motor_model::{Angle, DriveCommand, MotorParams, Time};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

pub(crate) const TICK_NANOS: u64 = 10_000;

/// All three filters for these instruments.
pub(crate) fn filters(instruments: &Instruments) -> Vec<Box<dyn AngleFilter<f32>>> {
    let motor = MotorParams::nominal();
    vec![
        Box::new(ConstantRate::new(&ConstantRateTuning::for_motor(&motor, instruments))),
        Box::new(ImpactAided::new(&ImpactAidedTuning::new(&motor, instruments))),
        Box::new(TwinFilter::new(
            &CheckedMotor::try_new(&motor).unwrap(),
            &TwinTuning::new(&motor, instruments),
        )),
    ]
}

/// A rotor, what drives it, and the camera that shows it.
pub(crate) struct Bench {
    pub(crate) camera: CameraDescription,
    /// Where in its pixel each mark lies when the rotor stands at zero, in steps.
    pub(crate) places: Vec<f64>,
    pub(crate) rng: Pcg64,
    pub(crate) now: Time,
    pub(crate) angle_rad: f64,
    pub(crate) frames: VecDeque<(Time, CameraFrame)>,
    pub(crate) next_frame: Time,
    pub(crate) restarts: u32,
}

impl Bench {
    pub(crate) fn new(camera: CameraDescription, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let places = (0..camera.marks).map(|_| Uniform::new(0.0, 1.0).unwrap().sample(&mut rng)).collect();
        Self {
            camera,
            places,
            rng,
            now: Time::ZERO,
            angle_rad: 0.3,
            frames: VecDeque::new(),
            next_frame: Time::ZERO,
            restarts: 0,
        }
    }

    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    /// The angle in rad that the marks of a rotor at `place_rad` show: the mean of their codes along the arc.
    pub(crate) fn shown_rad(&mut self, place_rad: f64) -> f64 {
        let step_m = self.camera.resolution_m.max(1e-12);
        let mut sum_m = 0.0;
        for mark in 0..self.places.len() {
            let off_m = self.places[mark] * step_m;
            let shown_m = place_rad * self.camera.radius_m + self.camera.noise_m * self.normal();
            sum_m += ((shown_m + off_m) / step_m).round() * step_m - off_m;
        }
        sum_m / (self.places.len() as f64 * self.camera.radius_m)
    }

    /// One tick: the filter is told the drive as it begins to act, the rotor turns at `rate_rad_s`, and the filter
    /// receives what is due. The vibrometer shows `velocity_m_s`.
    pub(crate) fn tick(
        &mut self,
        filter: &mut dyn AngleFilter<f32>,
        command: DriveCommand,
        rate_rad_s: f64,
        velocity_m_s: Option<f64>,
    ) -> (Option<Estimate<f32>>, Health) {
        filter.drive(self.now, command);
        self.now = self.now.plus_nanos(TICK_NANOS);
        self.angle_rad += rate_rad_s * 1e-9 * TICK_NANOS as f64;
        if let Some(velocity_m_s) = velocity_m_s {
            filter.update_ldv(&LdvSample { taken_at: self.now, velocity_m_s: velocity_m_s as f32 });
        }
        if self.now >= self.next_frame {
            self.next_frame = self.next_frame.plus_nanos(self.camera.period_nanos);
            let shown_rad = self.shown_rad(self.angle_rad);
            let angle = Angle::from_degrees(shown_rad.to_degrees()).wrapped();
            let frame = CameraFrame::new(self.now, angle);
            self.frames.push_back((self.now.plus_nanos(self.camera.latency_nanos), frame));
        }
        while self.frames.front().is_some_and(|(due, _)| *due <= self.now) {
            let Some((_, frame)) = self.frames.pop_front() else { break };
            let restarted = filter.update_camera(&frame).verdict == Verdict::Restarted;
            self.restarts += u32::from(restarted);
        }
        filter.assess(self.now)
    }

    /// Error of an estimate in rad.
    pub(crate) fn error_rad(&self, estimate: &Estimate<f32>) -> f64 {
        let truth = Angle::from_degrees(self.angle_rad.to_degrees());
        estimate.angle.radians_since(truth)
    }
}
