//! The instruments as data: what a filter assumes of the camera and the vibrometer.
//!
//! One description serves all: filters take variances, gates, windows and horizons from it, the controller its measuring
//! times, and the firmware receives it with its configuration.
//!
//! | symbol | field | meaning |
//! |---|---|---|
//! | `T` | [`CameraDescription::period_nanos`] | time between two frames |
//! | `sigma` | [`CameraDescription::noise_m`] | tracking noise, before quantisation |
//! | `Delta` | [`CameraDescription::resolution_m`] | quantisation step |
//! | `rho` | [`CameraDescription::radius_m`] | distance of the marks from the axis |
//!
//! ```text
//! variance of a frame's angle   R = (sigma^2 + Delta^2 / 12) / rho^2
//! ```

use motor_model::OutOfBounds;

/// The instruments of a bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instruments {
    /// The camera: every bench has one.
    pub camera: CameraDescription,
    /// The vibrometer; `None` on a bench without one.
    pub vibrometer: Option<VibrometerDescription>,
}

/// A camera, as far as a filter needs to know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraDescription {
    /// Time between two frames, in ns: 10,000 to 100,000,000 (100 kHz to 10 Hz).
    pub period_nanos: u64,
    /// Exposure of a frame, in ns: 0 to the period. The frame shows the mean angle over it.
    pub exposure_nanos: u64,
    /// Time from the middle of the exposure to the arrival of the frame, in ns: at most 10 s.
    pub latency_nanos: u64,
    /// Standard deviation of the tracking noise before quantisation, in m: 0 to 1e-3.
    pub noise_m: f64,
    /// Quantisation step of the tracked position, in m: 0 to 1e-3; 0 for none.
    pub resolution_m: f64,
    /// Distance of the tracked mark from the axis, in m: 1e-4 to 0.1.
    pub radius_m: f64,
}

/// A vibrometer, as far as a filter needs to know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VibrometerDescription {
    /// Time between two samples, in ns: 1,000 to 100,000 (1 MHz to 10 kHz).
    pub period_nanos: u64,
    /// Standard deviation of a sample's noise, in m/s: 0 to 1.
    pub noise_m_s: f64,
    /// Largest velocity, of either sign, that it may show of a rotor at rest, in m/s: 0 to 1.
    pub bias_max_m_s: f64,
    /// Speed at which samples saturate, in m/s; 0 for no limit, else up to 100.
    pub range_m_s: f64,
    /// Step of the samples, in m/s: 0 to 1; 0 for none.
    pub resolution_m_s: f64,
}

impl Default for CameraDescription {
    /// The paper's camera: 10,000 frames a second, 2 um of resolution, at a mark 3.9 mm from the axis; with 1 um of
    /// tracking noise and a latency of one frame, which are assumptions.
    fn default() -> Self {
        Self {
            period_nanos: 100_000,
            exposure_nanos: 0,
            latency_nanos: 100_000,
            noise_m: 1e-6,
            resolution_m: 2e-6,
            radius_m: 3.9e-3,
        }
    }
}

impl Default for VibrometerDescription {
    /// 200,000 samples a second with 0.2 mm/s of noise, without bias, limit or steps.
    fn default() -> Self {
        Self { period_nanos: 5_000, noise_m_s: 2e-4, bias_max_m_s: 0.0, range_m_s: 0.0, resolution_m_s: 0.0 }
    }
}

impl Default for Instruments {
    /// The default camera and the default vibrometer.
    fn default() -> Self {
        Self { camera: CameraDescription::default(), vibrometer: Some(VibrometerDescription::default()) }
    }
}

impl CameraDescription {
    /// Variance of the quantisation's error in rad^2, as of a uniform error: `Delta^2 / (12 rho^2)`.
    pub fn quantisation_rad2(&self) -> f64 {
        let step_rad = self.resolution_m / self.radius_m;
        step_rad * step_rad / 12.0
    }

    /// Variance of a frame's angle in rad^2, quantisation included.
    pub fn variance_rad2(&self) -> f64 {
        let noise_rad = self.noise_m / self.radius_m;
        noise_rad * noise_rad + self.quantisation_rad2()
    }

    /// Time between two frames, in s.
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    pub fn period_s(&self) -> f64 {
        1e-9 * self.period_nanos as f64
    }

    /// The description, if all of it is within bounds.
    ///
    /// # Errors
    /// When a field is not: named by its key in a scene, with its bounds.
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    pub fn checked(self) -> Result<Self, OutOfBounds> {
        let period_s = self.period_s();
        OutOfBounds::check("camera.frame_rate_hz", 1.0 / period_s, 10.0, 100_000.0, "Hz")?;
        let exposure = 1e-9 * self.exposure_nanos as f64 / period_s;
        OutOfBounds::check("camera.exposure_frames", exposure, 0.0, 1.0, "")?;
        OutOfBounds::check("camera.latency_s", 1e-9 * self.latency_nanos as f64, 0.0, 10.0, "s")?;
        OutOfBounds::check("camera.noise_m", self.noise_m, 0.0, 1e-3, "m")?;
        OutOfBounds::check("camera.resolution_m", self.resolution_m, 0.0, 1e-3, "m")?;
        OutOfBounds::check("camera.tracking_radius_m", self.radius_m, 1e-4, 0.1, "m")?;
        Ok(self)
    }
}

impl VibrometerDescription {
    /// Time between two samples, in s.
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    pub fn period_s(&self) -> f64 {
        1e-9 * self.period_nanos as f64
    }

    /// Standard deviation of a sample in m/s: its noise, and its steps as a uniform error.
    pub fn sample_sd_m_s(&self) -> f64 {
        motor_model::math::sqrt(
            self.noise_m_s * self.noise_m_s + self.resolution_m_s * self.resolution_m_s / 12.0,
        )
    }

    /// The description, if all of it is within bounds.
    ///
    /// # Errors
    /// When a field is not: named by its key in a scene, with its bounds.
    pub fn checked(self) -> Result<Self, OutOfBounds> {
        OutOfBounds::check("ldv.sample_rate_hz", 1.0 / self.period_s(), 1e4, 1e6, "Hz")?;
        OutOfBounds::check("ldv.noise_m_s", self.noise_m_s, 0.0, 1.0, "m/s")?;
        OutOfBounds::check("ldv.bias_m_s", self.bias_max_m_s, 0.0, 1.0, "m/s")?;
        OutOfBounds::check("ldv.range_m_s", self.range_m_s, 0.0, 100.0, "m/s")?;
        OutOfBounds::check("ldv.resolution_m_s", self.resolution_m_s, 0.0, 1.0, "m/s")?;
        Ok(self)
    }
}

impl Instruments {
    /// The description, if all of it is within bounds.
    ///
    /// # Errors
    /// When a field is not: named by its key in a scene, with its bounds.
    pub fn checked(self) -> Result<Self, OutOfBounds> {
        let vibrometer = self.vibrometer.map(VibrometerDescription::checked).transpose()?;
        Ok(Self { camera: self.camera.checked()?, vibrometer })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1/4 + 1/12) of the step's square: noise of half a step, and a uniform error over a step.
    #[test]
    fn exact_variance_of_the_default_camera() {
        let step_rad = 2e-6_f64 / 3.9e-3;
        let variance_rad2 = CameraDescription::default().variance_rad2();
        assert!((variance_rad2 * 3.0 / (step_rad * step_rad) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn exact_bounds_name_the_key() {
        assert!(Instruments::default().checked().is_ok());
        let camera = CameraDescription::default();
        for (bad, key) in [
            (CameraDescription { period_nanos: 9_000, ..camera }, "camera.frame_rate_hz"),
            (CameraDescription { period_nanos: 0, ..camera }, "camera.frame_rate_hz"),
            (CameraDescription { exposure_nanos: 100_001, ..camera }, "camera.exposure_frames"),
            (CameraDescription { latency_nanos: u64::MAX, ..camera }, "camera.latency_s"),
            (CameraDescription { noise_m: f64::NAN, ..camera }, "camera.noise_m"),
            (CameraDescription { resolution_m: -1e-6, ..camera }, "camera.resolution_m"),
            (CameraDescription { radius_m: 0.0, ..camera }, "camera.tracking_radius_m"),
        ] {
            assert_eq!(bad.checked().unwrap_err().key, key);
        }
        let vibrometer = VibrometerDescription::default();
        for (bad, key) in [
            (VibrometerDescription { period_nanos: 0, ..vibrometer }, "ldv.sample_rate_hz"),
            (VibrometerDescription { noise_m_s: f64::INFINITY, ..vibrometer }, "ldv.noise_m_s"),
            (VibrometerDescription { bias_max_m_s: -1.0, ..vibrometer }, "ldv.bias_m_s"),
            (VibrometerDescription { range_m_s: 101.0, ..vibrometer }, "ldv.range_m_s"),
            (VibrometerDescription { resolution_m_s: 2.0, ..vibrometer }, "ldv.resolution_m_s"),
        ] {
            let instruments = Instruments { vibrometer: Some(bad), ..Instruments::default() };
            assert_eq!(instruments.checked().unwrap_err().key, key);
        }
    }
}
