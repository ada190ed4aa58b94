//! The instruments as data: what a filter assumes of the camera and the vibrometer. Filters take variances, gates,
//! windows and horizons from it, the controller its measuring times, and the firmware receives it.
//!
//! Marks are equally spaced on their circle of the radius `rho`, and the angle is that of the rigid motion that fits
//! them best. With tracking noise `sigma`, quantisation step `Delta` and n marks the variance of a frame's angle is
//!
//! ```text
//! R = (sigma^2 + Delta^2 / 12) / (n rho^2)
//! ```
//!
//! # What averaging cannot remove
//!
//! Neighbouring frames share what the tracker is off at one place of a pixel (b, rms), and what moves all marks against
//! the pin's axis (s, rms): a microscope that vibrates, a rotor that shifts in its hub. No average of neighbouring
//! frames removes it, so its variance is a part of every estimate's (F17). A moving mark crosses pixels, and the errors
//! of some neighbours are as different as noise. How far apart frames have different errors is not described, so the
//! same variance counts as noise and as persistent: an upper bound for both.
//!
//! A mark at rest stays at one place of one cell of the quantiser. The mean of its codes, over the tracking noise, is
//! off by a periodic function of that place x (Widrow and Kollar, "Quantization Noise", 2008, chapter 4):
//!
//! ```text
//! bias(x)  = sum over k = 1, 2, ... of (-1)^k Delta / (pi k) exp(-2 pi^2 k^2 sigma^2 / Delta^2) sin(2 pi k x / Delta)
//! variance = sum of Delta^2 / (2 pi^2 k^2) exp(-4 pi^2 k^2 sigma^2 / Delta^2)          over places in the cell
//! ```
//!
//! Without noise the sum is `Delta^2 / 12`. At `sigma = Delta / 2` it is 0.05 milli-degrees of a mark of the default
//! camera. Several marks lie at places of their own, so that of `n` it is an `n`-th. The variance of the codes depends
//! on the place as well. It is least in the middle of a cell:
//!
//! ```text
//! least = sigma^2 + Delta^2 / 12
//!         + sum over k of (-1)^k (4 sigma^2 + Delta^2 / (pi k)^2) exp(-2 pi^2 k^2 sigma^2 / Delta^2)
//! ```

use core::f64::consts::PI;

use motor_model::{OutOfBounds, Real, math};

use crate::filters::kicks_kept::KEPT_NANOS;
use crate::measurement::CameraFrame;
use crate::vibrometer::rest::quiet_m2_s2;

/// Harmonics of the codes' variance that are summed.
const HARMONICS: f64 = 64.0;

/// Which of the filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterKind {
    /// [`crate::ConstantRate`]: camera only.
    ConstantRate,
    /// [`crate::ImpactAided`]: camera, and impacts from the vibrometer.
    ImpactAided,
    /// [`crate::TwinFilter`]: camera, and the twin driven by the vibrometer's impacts.
    Twin,
}

impl FilterKind {
    /// Its name in scenes and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::ConstantRate => "constant_rate",
            Self::ImpactAided => "impact_aided",
            Self::Twin => "twin",
        }
    }
}

/// The instruments of a bench.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Instruments {
    /// The camera: every bench has one.
    pub camera: CameraDescription,
    /// The vibrometer; `None` on a bench without one.
    pub vibrometer: Option<VibrometerDescription>,
}

/// A camera, as far as a filter needs to know it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// Distance of the tracked marks from the axis, in m: 1e-4 to 0.1.
    pub radius_m: f64,
    /// Number of marks, equally spaced round the axis: 1 to 16.
    pub marks: u8,
    /// Root mean square error of each coordinate of a mark that neighbouring frames share, in m: 0 to 1e-3. Those of
    /// two marks are independent. The sub-pixel bias of a tracker is one: its amplitude over `sqrt 2`.
    pub mark_bias_m: f64,
    /// Root mean square displacement of all marks together against the pin's axis that neighbouring frames share, along
    /// the direction in which it is largest, in m: 0 to 1e-3. A microscope's vibration is one, its amplitude over `sqrt
    /// 2`, and the shift of a rotor in its hub. It counts with a single mark.
    pub shift_m: f64,
    /// Standard deviation of the error of a frame's time stamp, in s: 0 to 1e-2. Errors of two frames are independent.
    pub stamp_sd_s: f32,
    /// Root mean square error in us of the clock by which frames are stamped, which all frames share: 0 to 10,000.
    pub clock_sd_micros: u16,
}

/// A vibrometer, as far as a filter needs to know it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// The paper's camera: 10,000 frames a second, 2 um of resolution, at marks 3.9 mm from the axis; with two opposite
    /// marks, 1 um of tracking noise and a latency of one frame, which are assumptions.
    fn default() -> Self {
        Self {
            period_nanos: 100_000,
            exposure_nanos: 0,
            latency_nanos: 100_000,
            noise_m: 1e-6,
            resolution_m: 2e-6,
            radius_m: 3.9e-3,
            marks: 2,
            mark_bias_m: 0.0,
            shift_m: 0.0,
            stamp_sd_s: 0.0,
            clock_sd_micros: 0,
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

/// Mean square of the quantiser's bias over the places in a cell, per that of a uniform error over a step, of noise of
/// this variance per that of the square of a step: the sum at the head of this module. Below `x = 1` it is its
/// transform by Poisson's formula, of which the first term left out is `exp(-pi^2 / x)`.
pub(crate) fn bias_part(noise_steps2: f32) -> f32 {
    use core::f32::consts::PI;
    let x = 4.0 * PI * PI * noise_steps2;
    let sum = if x < 1.0 {
        PI * PI / 6.0 - math::sqrt_f32(PI * x) + 0.5 * x
    } else {
        let (first, second) = (math::exp_f32(-x), math::exp_f32(-4.0 * x));
        first + 0.25 * second
    };
    sum * 6.0 / (PI * PI)
}

impl CameraDescription {
    /// Number of marks, at least 1.
    fn marks(&self) -> f64 {
        f64::from(self.marks.max(1))
    }

    /// The square of a length at the marks as that of an angle, `length^2 / (n rho^2)`, in rad^2.
    fn angle_rad2(&self, length_m: f64) -> f64 {
        let angle_rad = length_m / self.radius_m;
        angle_rad * angle_rad / self.marks()
    }

    /// A residual of the marks, root mean square in m, as the variance of an angle from all of them in rad^2: `n m^2`
    /// is shared by `2 n - 3` degrees of freedom. 0 with a single mark.
    pub(crate) fn residual_rad2(&self, residual_m: f64) -> f64 {
        let marks = self.marks();
        if marks > 1.0 { self.angle_rad2(residual_m) * marks / (2.0 * marks - 3.0) } else { 0.0 }
    }

    /// Variance of the quantisation's error in rad^2, as of uniform errors: `Delta^2 / (12 n rho^2)`.
    pub fn quantisation_rad2(&self) -> f64 {
        self.angle_rad2(self.resolution_m) / 12.0
    }

    /// Variance of a frame's angle in rad^2, quantisation included, with no mark left out.
    pub fn variance_rad2(&self) -> f64 {
        self.angle_rad2(self.noise_m) + self.quantisation_rad2()
    }

    /// The variance of an angle from `used` of `n` marks, per that from all.
    ///
    /// ```text
    /// used   all or 0   1    n - 1               fewer
    /// factor 1          n    (n - 1) / (n - 2)   2 n / used
    /// ```
    ///
    /// One mark is taken to be shifted by nothing. With two left out or more the factor depends on which; a camera
    /// delivers no frame of which it is more than this.
    pub fn variance_factor<T: Real>(&self, used: u8) -> T {
        let [all, marks] = [self.marks, used].map(|count| T::from_i32(count.into()));
        if used == CameraFrame::ALL_MARKS || used >= self.marks {
            T::one()
        } else if used == 1 {
            all
        } else if used + 1 == self.marks {
            marks / (marks - T::one())
        } else {
            (all + all) / marks
        }
    }

    /// Variance in rad^2 of an angle from all marks by the marks' errors that neighbouring frames share.
    pub fn mark_bias_rad2(&self) -> f64 {
        self.angle_rad2(self.mark_bias_m)
    }

    /// Variance in rad^2 of an angle from one mark, of however many, by what neighbouring frames share.
    pub fn single_mark_rad2(&self) -> f64 {
        self.marks() * (self.angle_rad2(self.mark_bias_m) + self.angle_rad2(self.shift_m))
    }

    /// Variance in rad^2 of an angle from all marks by what neighbouring frames share, see the head of this module.
    pub fn persistent_rad2(&self) -> f64 {
        if self.marks > 1 { self.mark_bias_rad2() } else { self.single_mark_rad2() }
    }

    /// Variance of a resting rotor's mean angle in rad^2 that no number of frames removes: that of the quantisation,
    /// and [`Self::persistent_rad2`].
    pub fn floor_rad2(&self) -> f64 {
        self.quantisation_floor_rad2() + self.persistent_rad2()
    }

    /// The quantisation's part of the floor in rad^2, see the head of this module. It is [`Self::quantisation_rad2`]
    /// without noise.
    #[expect(clippy::cast_possible_truncation, reason = "a part needs no more digits")]
    #[inline(never)]
    pub fn quantisation_floor_rad2(&self) -> f64 {
        if self.resolution_m <= 0.0 {
            return 0.0;
        }
        let noise_steps = self.noise_m / self.resolution_m;
        self.quantisation_rad2() * f64::from(bias_part((noise_steps * noise_steps) as f32))
    }

    /// Least variance of the codes of a rotor at rest in rad^2, that of one in the middle of a cell: see the head of
    /// this module.
    #[inline(never)]
    pub fn dither_rad2(&self) -> f64 {
        let noise_rad2 = self.angle_rad2(self.noise_m);
        if self.resolution_m <= 0.0 {
            return noise_rad2;
        }
        let noise_steps = PI * self.noise_m / self.resolution_m;
        let (mut sum, mut weighted, mut k, mut sign) = (0.0, 0.0, 1.0, -1.0);
        while k <= HARMONICS {
            let kept = sign * math::exp(-2.0 * noise_steps * noise_steps * k * k);
            sum += kept;
            weighted += kept / (k * k);
            (k, sign) = (k + 1.0, -sign);
        }
        let step_rad2 = 12.0 * self.quantisation_rad2();
        let variance_rad2 = self.variance_rad2() + 4.0 * noise_rad2 * sum + step_rad2 * weighted / (PI * PI);
        variance_rad2.max(0.0).min(self.variance_rad2())
    }

    /// Time between two frames, in s.
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    pub fn period_s(&self) -> f64 {
        1e-9 * self.period_nanos as f64
    }

    /// Time from the middle of an exposure to the arrival of the next frame, in ns.
    pub fn arrival_nanos(&self) -> u64 {
        self.period_nanos.saturating_add(self.latency_nanos)
    }

    /// The description, if all of it is within bounds.
    ///
    /// # Errors
    /// When a field is not: named by its key in a scene, or by itself where no key has it, with its bounds.
    #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
    #[inline(never)]
    pub fn checked(self) -> Result<Self, OutOfBounds> {
        let period_s = self.period_s();
        for (key, value, least, most, unit) in [
            ("camera.frame_rate_hz", 1.0 / period_s, 10.0, 100_000.0, "Hz"),
            ("camera.exposure_frames", 1e-9 * self.exposure_nanos as f64 / period_s, 0.0, 1.0, ""),
            ("camera.latency_s", 1e-9 * self.latency_nanos as f64, 0.0, 10.0, "s"),
            ("camera.noise_m", self.noise_m, 0.0, 1e-3, "m"),
            ("camera.resolution_m", self.resolution_m, 0.0, 1e-3, "m"),
            ("camera.tracking_radius_m", self.radius_m, 1e-4, 0.1, "m"),
            ("camera.marks", self.marks.into(), 1.0, 16.0, ""),
            ("camera.mark_bias_m", self.mark_bias_m, 0.0, 1e-3, "m"),
            ("camera.shift_m", self.shift_m, 0.0, 1e-3, "m"),
            ("camera.stamp_jitter_s", self.stamp_sd_s.into(), 0.0, 1e-2, "s"),
            ("camera.clock_error_s", 1e-6 * f64::from(self.clock_sd_micros), 0.0, 1e-2, "s"),
        ] {
            OutOfBounds::check(key, value, least, most, unit)?;
        }
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
        math::sqrt(self.noise_m_s * self.noise_m_s + self.resolution_m_s * self.resolution_m_s / 12.0)
    }

    /// Root mean square velocity in m/s below which filters take the rotor for quiet, by the slower one of each sample
    /// and the one before it (F7).
    pub fn quiet_m_s(&self) -> f64 {
        let sd_m_s = self.sample_sd_m_s();
        math::sqrt(quiet_m2_s2(sd_m_s * sd_m_s))
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
    /// Longest period of a vibrometer with which the twin's rate is right, and with which impacts are told apart at
    /// all, in ns.
    const TWIN_PERIOD_NANOS: u64 = 10_000;
    const IMPACTS_PERIOD_NANOS: u64 = 50_000;

    /// Largest standard deviation of a sample with which the twin's variances are right, and with which an impact
    /// shows, in m/s.
    pub(crate) const TWIN_SD_M_S: f64 = 1.2e-3;
    pub(crate) const IMPACTS_SD_M_S: f64 = 4e-3;

    /// Least range of a vibrometer that shows the rotor of mode B, in m/s.
    const RANGE_M_S: f64 = 0.1;

    /// Largest standard deviation of the camera's clock with which impacts help, in us: in it a kick of 7 rad/s turns
    /// the rotor by 40 milli-degrees, three standard deviations of a frame, so that kick and frames seem to disagree.
    const IMPACTS_CLOCK_MICROS: u16 = 100;

    /// Longest time from one frame's exposure to the next one's arrival with which impacts of unknown sign help, in ns:
    /// later their kicks in mode C have grown beyond what the camera alone leaves open.
    const IMPACTS_ARRIVAL_NANOS: u64 = 25_000_000;

    /// The filter that is the most accurate with these instruments, and whose variances are right.
    ///
    /// Measured with `host-sim estimate`, rms of the angle in milli-degrees and mean normalised error squared, steady
    /// in mode B and C, four drawn motors, a camera on a single mark:
    ///
    /// | instruments | `constant_rate` | `impact_aided` | `twin` |
    /// |---|---|---|---|
    /// | default | 18.7, 12.5 | 8.3, 12.1 | 4.3, 4.8 |
    /// | 1,000 frames/s | 255, 55 | 48, 57 | 13, 12 |
    /// | 200 frames/s | 1467, 180 | 816, 261 | 28, 22 |
    /// | 60 frames/s, 20 ms late | 8680, 573 | 3276, 1082 | 106, 54 |
    /// | 50 frames/s | 6439, 420 | 2231, 728 | 966, 43 |
    /// | 30 frames/s | 8742, 562 | 3693, 4690 | 2849, 59 |
    /// | noise 1 mm/s | | 9.0, 13.0 | 5.8, 9.7 |
    /// | noise 2 mm/s | | 11.0, 13.3 | 6.3, 13.1; up to 11 times its variance |
    /// | noise 4 mm/s | | 14.6, 13.2 | 8.2, 19.3; up to 377 times |
    /// | 100,000 samples/s | | 8.2, 12.1 | 4.4, 5.0 |
    /// | 50,000 samples/s | | 8.6, 12.1 | 5.0, 5.5 |
    /// | 20,000 samples/s | | 10.0, 12.1 | 8.9, 12.0 |
    /// | range 20 mm/s | | 16.9, 12.1 | 16.9, 4.8; up to 7 times its variance |
    ///
    /// A camera whose clock is off by 0.06 ms, held at 300 deg/s (`host-sim rate`), six motors: 26, 27 and 28
    /// milli-degrees. By 0.12 ms: 48, 49 and 49. By 0.29 ms two of five motors lose the estimate some sixty times a
    /// second with the filters that take impacts, and none with `constant_rate`.
    pub fn best_filter(&self) -> FilterKind {
        let Some(vibrometer) = self.vibrometer else { return FilterKind::ConstantRate };
        let (sd_m_s, period_nanos) = (vibrometer.sample_sd_m_s(), vibrometer.period_nanos);
        let clipped = vibrometer.range_m_s > 0.0 && vibrometer.range_m_s < Self::RANGE_M_S;
        let arrival_nanos = self.camera.arrival_nanos();
        let (kept, timely) = (arrival_nanos <= KEPT_NANOS, arrival_nanos <= Self::IMPACTS_ARRIVAL_NANOS);
        if self.camera.clock_sd_micros > Self::IMPACTS_CLOCK_MICROS {
            FilterKind::ConstantRate
        } else if sd_m_s <= Self::TWIN_SD_M_S && period_nanos <= Self::TWIN_PERIOD_NANOS && kept && !clipped {
            FilterKind::Twin
        } else if sd_m_s <= Self::IMPACTS_SD_M_S && period_nanos <= Self::IMPACTS_PERIOD_NANOS && timely {
            FilterKind::ImpactAided
        } else {
            FilterKind::ConstantRate
        }
    }

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
mod tests;
