//! Where the rotor stands to its target, and when the target counts as reached.

use motor_model::math;

/// What remains, how well it is known, and how well it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Target less angle in rad, clockwise positive.
    pub remaining_rad: f32,
    /// Standard deviation of that in rad.
    pub sigma_rad: f32,
    /// Distance from the target that counts as reached, in rad.
    pub tolerance_rad: f32,
    /// The risk that is accepted.
    pub confidence: Confidence,
    /// Strongest drive, 0 to 1.
    pub amplitude_max: f32,
    /// The part of the estimate's variance in rad^2 that measuring does not remove.
    pub floor_rad2: f32,
    /// Time in s from the exposure of a frame until the next one arrives: for so long the angle is predicted.
    pub frame_wait_s: f32,
}

/// The accepted risk that the rotor lies outside the tolerance, as quantiles of a normal error.
///
/// With the target `r` away and known to a standard deviation `s`, the tails of the error beyond the tolerance `t` on
/// either side weigh together
///
/// ```text
/// risk = Q((t - r) / s) + Q((t + r) / s),      Q(x): weight of the normal tail beyond x
/// ```
///
/// Off target one tail is nearly all of the risk; on target both are the same. So `risk <= p` where `|r| + z1 s <= t`
/// and `z2 s <= t`, with `Q(z1) = p` and `Q(z2) = p / 2`. Where the two conditions meet, a seventh of `t` off target,
/// the risk is a quarter more. A rule for the root mean square error, `r^2 + s^2`, would wait too long off target,
/// where only one side counts, or not long enough on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// `z1`, in standard deviations.
    pub one_sided: f32,
    /// `z2`, in standard deviations.
    pub two_sided: f32,
}

impl Default for Confidence {
    /// A risk of 3.6 %: chosen by `host-sim positioning-trials` over 1000 drawn motors, so that 95 % of the moves end
    /// within their tolerance.
    fn default() -> Self {
        Self { one_sided: 1.8, two_sided: 2.1 }
    }
}

/// Part of the largest standard deviation that still counts as reached on target: what a last step adds is to fit above
/// it. An assumption.
const ENOUGH_PART: f32 = 0.95;

/// Part of the standard deviation that is enough on target, below which measuring on cannot end the move off target.
/// Assumption.
const MEASURED_OUT_PART: f32 = 0.7;

impl Confidence {
    /// Standard deviation at which a rotor on target counts as there, in rad, with some to spare for a last step.
    pub(crate) fn sigma_enough_rad(self, tolerance_rad: f32) -> f32 {
        ENOUGH_PART * tolerance_rad / self.two_sided
    }

    /// Variance in rad^2, without the floor `floor_rad2`, at which a rotor on target counts as there, and the last step
    /// is due.
    pub(crate) fn enough_rad2(self, tolerance_rad: f32, floor_rad2: f32) -> f32 {
        let enough_rad = self.sigma_enough_rad(tolerance_rad);
        enough_rad * enough_rad - floor_rad2
    }
}

impl Situation {
    /// Whether the target counts as reached: see [`Confidence`].
    pub fn reached(&self) -> bool {
        let Self { remaining_rad, sigma_rad, confidence, tolerance_rad, .. } = *self;
        remaining_rad.abs() + confidence.one_sided * sigma_rad <= tolerance_rad
            && confidence.two_sided * sigma_rad <= tolerance_rad
    }

    /// [`Confidence::sigma_enough_rad`] of its tolerance.
    pub(crate) fn sigma_enough_rad(&self) -> f32 {
        self.confidence.sigma_enough_rad(self.tolerance_rad)
    }

    /// Whether measuring on cannot end the move off target: of what measuring can still remove little is left.
    pub(crate) fn measured_out(&self) -> bool {
        self.sigma_rad * self.sigma_rad - self.floor_rad2 <= self.needed_rad2()
    }

    /// Variance in rad^2, without the floor, at which a rotor counts as measured out; not positive if the floor is too
    /// high for the tolerance.
    fn needed_rad2(&self) -> f32 {
        let Self { confidence, tolerance_rad, floor_rad2, .. } = *self;
        MEASURED_OUT_PART * MEASURED_OUT_PART * confidence.enough_rad2(tolerance_rad, floor_rad2)
    }

    /// Distance in rad from the target within which measuring on ends the move: what a rotor that is measured out may
    /// be off. Negative if the floor is too high for the tolerance.
    pub(crate) fn reach_rad(&self) -> f32 {
        let measured_out_rad = math::sqrt_f32(self.needed_rad2() + self.floor_rad2);
        self.tolerance_rad - self.confidence.one_sided * measured_out_rad
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Half a milli-degree of tolerance and full drive.
    pub(crate) fn situation(remaining_mdeg: f32, sigma_mdeg: f32) -> Situation {
        let radians = |mdeg: f32| 1e-3 * mdeg * (core::f32::consts::PI / 180.0);
        Situation {
            remaining_rad: radians(remaining_mdeg),
            sigma_rad: radians(sigma_mdeg),
            tolerance_rad: radians(0.5),
            confidence: Confidence { one_sided: 1.7, two_sided: 2.0 },
            amplitude_max: 1.0,
            floor_rad2: 0.0,
            frame_wait_s: 2e-4,
        }
    }

    #[test]
    fn law_reached_means_error_and_uncertainty_within_the_tolerance() {
        for (remaining_mdeg, sigma_mdeg, reached) in
            [(0.0, 0.249, true), (0.0, 0.251, false), (0.2, 0.176, true), (-0.2, 0.177, false)]
        {
            assert_eq!(situation(remaining_mdeg, sigma_mdeg).reached(), reached);
        }
    }

    /// A rotor that is measured out within the reach counts as there, and one beyond it does not, whatever the floor.
    #[test]
    fn law_within_the_reach_measuring_on_ends_the_move() {
        for floor_mdeg in [0.0_f32, 0.05, 0.15] {
            let floor_rad2 = (1e-3 * floor_mdeg).to_radians().powi(2);
            let of = |remaining_mdeg, sigma_mdeg| Situation {
                floor_rad2,
                ..situation(remaining_mdeg, sigma_mdeg)
            };
            let (mut low_mdeg, mut high_mdeg) = (0.0, 0.5);
            for _ in 0..40 {
                let middle_mdeg = 0.5 * (low_mdeg + high_mdeg);
                if of(0.0, middle_mdeg).measured_out() {
                    low_mdeg = middle_mdeg;
                } else {
                    high_mdeg = middle_mdeg;
                }
            }
            let reach_mdeg = 1e3 * of(0.0, 0.0).reach_rad().to_degrees();
            assert!(reach_mdeg > 0.0, "{floor_mdeg} {reach_mdeg}");
            assert!(of(0.999 * reach_mdeg, low_mdeg).reached(), "{floor_mdeg} {reach_mdeg} {low_mdeg}");
            assert!(!of(1.001 * reach_mdeg, low_mdeg).reached(), "{floor_mdeg} {reach_mdeg} {low_mdeg}");
        }
    }

    /// The rule against the normal law itself, by libm's error function: at its border the risk is the one that is
    /// asked for, or up to a quarter more.
    #[test]
    fn dual_reached_bounds_the_risk() {
        let tail = |x: f64| 0.5 * libm::erfc(x * core::f64::consts::FRAC_1_SQRT_2);
        let confidence = Confidence::default();
        let asked = tail(f64::from(confidence.one_sided));
        assert!((2.0 * tail(f64::from(confidence.two_sided)) / asked - 1.0).abs() < 0.01);
        for percent in 0..100_u16 {
            let off = f64::from(percent) / 100.0;
            let reached = |sigma: f64| {
                let [remaining_mdeg, sigma_mdeg] = [off, sigma].map(|of| 0.5 * of as f32);
                Situation { confidence, ..situation(remaining_mdeg, sigma_mdeg) }.reached()
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if reached(middle) { low = middle } else { high = middle }
            }
            let risk = tail((1.0 - off) / low) + tail((1.0 + off) / low);
            assert!((0.99 * asked..1.25 * asked).contains(&risk), "{off}: {risk} for {asked}");
        }
    }
}
