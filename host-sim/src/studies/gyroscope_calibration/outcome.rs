//! What became of one calibration: a row of the table.

use serde::{Deserialize, Serialize};

use analysis::gyroscope_fit::CAUSES;
use simulation::math::statistics::NORMAL_95;

/// 95 % of chi-square with two degrees of freedom: `-2 ln 0.05`.
const PAIR_95: f64 = 5.991_465;

/// What became of a calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CalibrationOutcome {
    /// Seed of the run: the motor.
    pub seed: u64,
    /// Which gyroscope (`gyroscope.serial`).
    pub serial: u64,
    /// Motor time.
    pub motor_time_s: f64,
    /// Scale-factor error found.
    pub scale_factor_ppm: f64,
    /// Found less true. True is the scale factor at the middle of the plan: it changes while the gyroscope warms up.
    pub scale_factor_error_ppm: f64,
    /// Its standard deviation; 1.96 of it to either side are the 95 % interval.
    pub scale_factor_sigma_ppm: f64,
    /// What coning makes of that error: the gyroscope turns about the rotor's own axis, the reference is the angle seen
    /// from above.
    pub scale_factor_coning_ppm: f64,
    /// What the error of the reference makes of it.
    pub scale_factor_reference_ppm: f64,
    /// What the gyroscope's misalignment makes of it, which shows turns across the rotor's axis.
    pub scale_factor_misalignment_ppm: f64,
    /// What its non-linearity makes of it, beside what the fit found of that.
    pub scale_factor_nonlinearity_ppm: f64,
    /// What its temperature makes of it.
    pub scale_factor_temperature_ppm: f64,
    /// What its noise makes of it: the rest.
    pub scale_factor_noise_ppm: f64,
    /// Standard deviation of the scale factor by its random walk, as the fit states it.
    pub stated_random_walk_ppm: f64,
    /// The same by the drift of its bias.
    pub stated_drift_ppm: f64,
    /// By the reference.
    pub stated_reference_ppm: f64,
    /// By tilt and coning: their strength is found from the residuals.
    pub stated_coning_ppm: f64,
    /// By non-linearity.
    pub stated_nonlinearity_ppm: f64,
    /// By temperature.
    pub stated_temperature_ppm: f64,
    /// By the camera's errors that turn with the angle.
    pub stated_camera_ppm: f64,
    /// Non-linearity found.
    pub nonlinearity_ppm: f64,
    /// Found less true.
    pub nonlinearity_error_ppm: f64,
    /// Its standard deviation.
    pub nonlinearity_sigma_ppm: f64,
    /// Misalignment found less true along the first of the rotor's two axes across its own. The rotor turns too little
    /// about them for a calibration to tell it: found is zero.
    pub misalignment_first_error_mrad: f64,
    /// Along the second.
    pub misalignment_second_error_mrad: f64,
    /// Standard deviation of each: that of the data sheet.
    pub misalignment_sigma_mrad: f64,
    /// Amplitude of the camera's error that goes once round with the angle, as found.
    pub camera_once_mdeg: f64,
    /// Of that which goes twice.
    pub camera_twice_mdeg: f64,
    /// Standard deviation of the cosine or sine in these, root mean square.
    pub camera_sigma_mdeg: f64,
    /// Bias found.
    pub bias_deg_h: f64,
    /// Found less true.
    pub bias_error_deg_h: f64,
    /// Its standard deviation.
    pub bias_sigma_deg_h: f64,
    /// What coning makes of that error.
    pub bias_coning_deg_h: f64,
    /// What the error of the reference makes of it.
    pub bias_reference_deg_h: f64,
    /// What the gyroscope's noise makes of it: what its other errors do not.
    pub bias_noise_deg_h: f64,
    /// Correlation of both errors, as the fit states it.
    pub correlation: f64,
    /// Square of the distance of the true pair in standard deviations, correlation included.
    pub pair_distance_square: f64,
    /// Standard deviation of the bias that the gyroscope's random walk allows in this time, at rest.
    pub walk_bias_sigma_deg_h: f64,
    /// Standard deviation of the scale factor that the gyroscope's random walk allows at these rates, with an exact
    /// reference and without saturation: see [`super::schedule`].
    pub walk_scale_factor_sigma_ppm: f64,
    /// Factor on the filter's variances of the reference that the residuals tell, clockwise.
    pub reference_factor_clockwise: f64,
    /// The same counter-clockwise.
    pub reference_factor_counter_clockwise: f64,
    /// Intervals fitted.
    pub intervals: usize,
    /// Intervals left out because a sample in them was saturated.
    pub saturated_intervals: usize,
    /// Root mean square error of the reference at the ends of the intervals.
    pub reference_rms_mdeg: f64,
    /// Share of the ends of the intervals at which the reference is off by more than three standard deviations that the
    /// filter states.
    pub reference_beyond_3_sigma: f64,
    /// Ends at which it is called good and is off by more than five.
    pub reference_good_beyond_5_sigma: u64,
    /// The largest error of these.
    pub reference_good_beyond_5_sigma_worst_mdeg: f64,
    /// Its place among all calibrations.
    pub number: u64,
}

impl CalibrationOutcome {
    /// Error of the scale factor in its standard deviations.
    pub fn scale_factor_sigmas(&self) -> f64 {
        self.scale_factor_error_ppm.abs() / self.scale_factor_sigma_ppm
    }

    /// Whether the 95 % interval of the scale factor holds the truth.
    pub fn covers_scale_factor(&self) -> bool {
        self.scale_factor_error_ppm.abs() <= NORMAL_95 * self.scale_factor_sigma_ppm
    }

    /// Whether that of the bias does.
    pub fn covers_bias(&self) -> bool {
        self.bias_error_deg_h.abs() <= NORMAL_95 * self.bias_sigma_deg_h
    }

    /// Whether that of the non-linearity does.
    pub fn covers_nonlinearity(&self) -> bool {
        self.nonlinearity_error_ppm.abs() <= NORMAL_95 * self.nonlinearity_sigma_ppm
    }

    /// Of how many of the two misalignments the 95 % interval holds the truth.
    pub fn misalignments_covered(&self) -> usize {
        let errors = [self.misalignment_first_error_mrad, self.misalignment_second_error_mrad];
        errors.iter().filter(|error| error.abs() <= NORMAL_95 * self.misalignment_sigma_mrad).count()
    }

    /// Standard deviations of the scale factor by cause, as the fit states them, in ppm and in the order of
    /// [`CAUSES`].
    pub fn stated_ppm(&self) -> [f64; CAUSES.len()] {
        [
            self.stated_random_walk_ppm,
            self.stated_drift_ppm,
            self.stated_reference_ppm,
            self.stated_coning_ppm,
            self.stated_nonlinearity_ppm,
            self.stated_temperature_ppm,
            self.stated_camera_ppm,
        ]
    }

    /// Whether the 95 % ellipse of both does.
    pub fn covers_pair(&self) -> bool {
        self.pair_distance_square <= PAIR_95
    }
}
