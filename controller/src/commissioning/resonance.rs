//! A resonance, from the power that the vibrometer shows at the frequencies of a sweep.
//!
//! # The curve (C6)
//!
//! The rotor's vertical velocity follows the teeth that strike it, and the teeth the drive. So its power `P` over the
//! offset `x` of the drive from the design's frequency is taken for a resonance curve of free height and width:
//!
//! ```text
//! ln P(x) = a - ln(1 + ((x - c) / w)^2)          c: the resonance, w: half width at half power
//! ```
//!
//! It is fitted to `ln P` by least squares (Levenberg and Marquardt), from several widths. The variance of `ln P` is
//! that between parts of a point's time, the same for all points. The covariance is `s^2 (J' J)^-1`. Where chi-square
//! per degree of freedom exceeds 1 it is multiplied by it (Birge, Physical Review 40 (1932) 207): the curve is then no
//! better known than it fits.
//!
//! A point counts if its power is at least [`BOUNCING_PART`] of the greatest: below it the rotor lies on the teeth.
//!
//! # What the error bar holds beside chance
//!
//! The rotor is four times as heavy as the stator. Its strikes load the teeth, so that the power is greatest beside the
//! resonance of the stator alone. [`PULL`] says how far, in motors drawn around Table 1. In mode C a rotor that moves
//! up and down pulls by +28 +- 6 Hz (24 motors), one that tilts by -10 +- 10 Hz (8 motors of three kinds). Nothing that
//! is measured tells these two apart, so the error bar holds both.
//!
//! A weaker bounce is loaded more: in mode B by +50 Hz at three tenths of the drive. Pull and error bar grow as the
//! peak velocity falls below that of the motors by which they were found. They hold for motors about as strong as those
//! alone: at half of the velocity the peak of mode C is 100 Hz off the other way. Of a bounce that is weaker by
//! [`WEAKER_MAX`] no resonance is found.

use estimator::ResonanceOffset;
use motor_model::{DriveMode, math};

use super::map_factors::of_mode;
use super::quantiles;

/// Most frequencies of a sweep.
pub const SWEEP_POINTS_MAX: usize = 16;
/// The frequency of greatest power less the resonance of the stator alone.
struct Pull {
    /// Mean over drawn motors, in Hz.
    hz: f64,
    /// Standard deviation over them, in Hz.
    sd_hz: f64,
    /// Root mean square velocity in m/s at the peak, below which both grow in inverse proportion.
    velocity_m_s: f64,
}

/// At full drive, for modes B and C: the middle of both kinds of rotors, and their distance. From
/// `host-sim commission --trials` and `host-sim record`.
const PULL: [Pull; 2] =
    [Pull { hz: 15.0, sd_hz: 6.0, velocity_m_s: 33e-3 }, Pull { hz: 9.0, sd_hz: 20.0, velocity_m_s: 4.6e-3 }];

impl Pull {
    /// Mean and standard deviation at the peak power `power_m2_s2`; `None` of a bounce that is weaker by
    /// [`WEAKER_MAX`].
    fn at(&self, power_m2_s2: f64) -> Option<(f64, f64)> {
        let weaker = (self.velocity_m_s / math::sqrt(power_m2_s2.max(1e-12))).max(1.0);
        (weaker <= WEAKER_MAX).then_some((weaker * self.hz, weaker * self.sd_hz))
    }
}

/// Velocity of the motors by which the pull was found, per that of the weakest bounce that it holds for: those motors
/// are drawn around Table 1, and reach 1.2.
const WEAKER_MAX: f64 = 1.3;

/// Part of the greatest power below which the rotor lies on the teeth. Resonance curves of six half widths to either
/// side fall to a thirtieth of it.
const BOUNCING_PART: f32 = 0.03;
/// Probability with which a curve that fits is told not to.
const MISFIT_FALSE: f32 = 0.01;
/// Probability with which a sweep that shows no resonance is told to show one.
const RESONANCE_FALSE: f32 = 0.001;
/// Steps of the fit: it needs some ten.
const FIT_STEPS: u32 = 60;
/// Half widths in Hz from which the fit begins.
const WIDTHS_HZ: [f64; 3] = [30.0, 80.0, 200.0];

/// The power at one frequency.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SweepPoint {
    /// Offset of the drive's frequency from the design's, in Hz.
    pub offset_hz: f32,
    /// Power of the vertical velocity in m^2/s^2, without that of the vibrometer's noise.
    pub power_m2_s2: f32,
    /// Its variance between parts of the time, per squared power.
    pub relative_variance: f32,
}

/// A resonance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Offset from the design's drive frequency, in Hz.
    pub offset_hz: f64,
    /// Its standard deviation in Hz: of the fit, and of the pull by the rotor.
    pub offset_sd_hz: f64,
    /// The part of the fit.
    pub fit_sd_hz: f64,
    /// Half width of the curve at half power, in Hz.
    pub half_width_hz: f64,
    /// Chi-square per degree of freedom.
    pub reduced_chi_square: f64,
    /// Whether the curve fits, at a probability of 1 %. If not, the standard deviation is widened.
    pub fits: bool,
}

/// A curve: `a`, `c`, `w`, and its sum of squares.
#[derive(Clone, Copy)]
struct Curve {
    level: f64,
    centre_hz: f64,
    half_width_hz: f64,
    squares: f64,
}

/// Standard deviation in Hz of the resonances of motors drawn around the design: half of Table 1's tolerance.
const MOTORS_SD_HZ: f64 = 5.0;
/// Standard deviations by which a resonance is another one than the design's beyond doubt.
const BEYOND_DOUBT_SIGMAS: f64 = 3.0;

impl Resonance {
    /// The offset, if neither its error nor the difference of one motor from another explains it.
    pub fn beyond_doubt(&self) -> Option<ResonanceOffset<f32>> {
        let Self { offset_hz, offset_sd_hz, .. } = *self;
        let variance = offset_sd_hz * offset_sd_hz;
        let limit = BEYOND_DOUBT_SIGMAS * BEYOND_DOUBT_SIGMAS * (variance + MOTORS_SD_HZ * MOTORS_SD_HZ);
        #[expect(clippy::cast_possible_truncation, reason = "single precision suffices")]
        let found = ResonanceOffset { hz: offset_hz as f32, hz2: variance as f32 };
        (offset_hz * offset_hz > limit).then_some(found)
    }
}

type Symmetric = [[f64; 3]; 3];

impl Curve {
    fn at(&self, x_hz: f64) -> (f64, [f64; 3]) {
        let u = (x_hz - self.centre_hz) / self.half_width_hz;
        let under = 1.0 + u * u;
        let slope = 2.0 * u / (under * self.half_width_hz);
        (self.level - math::ln(under), [1.0, slope, slope * u])
    }

    fn with_squares(mut self, points: &[(f64, f64)]) -> Self {
        self.squares = points.iter().map(|(x, y)| (y - self.at(*x).0) * (y - self.at(*x).0)).sum();
        self
    }

    /// `J' J` and `J' r`.
    fn normal_equations(&self, points: &[(f64, f64)]) -> (Symmetric, [f64; 3]) {
        let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        for (x, y) in points {
            let (value, slopes) = self.at(*x);
            for ((row, right), slope) in matrix.iter_mut().zip(&mut right).zip(slopes) {
                *right += slope * (y - value);
                for (entry, other) in row.iter_mut().zip(slopes) {
                    *entry += slope * other;
                }
            }
        }
        (matrix, right)
    }

    fn moved(&self, by: [f64; 3]) -> Self {
        let [level, centre, width] = by;
        Self {
            level: self.level + level,
            centre_hz: self.centre_hz + centre,
            half_width_hz: (self.half_width_hz + width).clamp(2.0, 4000.0),
            ..*self
        }
    }

    /// The curve of least squares, from this one.
    fn fitted(self, points: &[(f64, f64)]) -> Self {
        let mut best = self.with_squares(points);
        let mut damping = 1e-3;
        for _ in 0..FIT_STEPS {
            let (mut matrix, right) = best.normal_equations(points);
            for (index, row) in matrix.iter_mut().enumerate() {
                if let Some(diagonal) = row.get_mut(index) {
                    *diagonal *= 1.0 + damping;
                }
            }
            let Some(inverse) = inverse(&matrix) else { break };
            let step = inverse.map(|row| row.iter().zip(right).map(|(a, b)| a * b).sum());
            let next = best.moved(step).with_squares(points);
            if next.squares < best.squares {
                damping *= 0.3;
                best = next;
            } else {
                damping *= 4.0;
            }
        }
        best
    }
}

/// Inverse of a symmetric matrix by cofactors; `None` of a singular one.
fn inverse([[a, b, c], [_, d, e], [_, _, f]]: &Symmetric) -> Option<Symmetric> {
    let first = [d * f - e * e, c * e - b * f, b * e - c * d];
    let determinant = a * first[0] + b * first[1] + c * first[2];
    if determinant.abs() < f64::MIN_POSITIVE || !determinant.is_finite() {
        return None;
    }
    let [x, y, z] = first;
    let (yy, yz, zz) = (a * f - c * c, b * c - a * e, a * d - b * b);
    Some([[x, y, z], [y, yy, yz], [z, yz, zz]].map(|row| row.map(|entry| entry / determinant)))
}

impl Resonance {
    /// The resonance that a sweep of `mode` shows; `None` where it shows none within its frequencies.
    pub fn of(mode: DriveMode, points: &[SweepPoint]) -> Option<Self> {
        let mut storage = [(0.0, 0.0); SWEEP_POINTS_MAX];
        let mut count = 0;
        let mut relative = 0.0;
        let greatest = points.iter().map(|point| point.power_m2_s2).fold(0.0, f32::max);
        let bouncing = points.iter().filter(|point| point.power_m2_s2 >= BOUNCING_PART * greatest);
        for (place, point) in storage.iter_mut().zip(bouncing) {
            *place = (f64::from(point.offset_hz), math::ln(f64::from(point.power_m2_s2).max(1e-30)));
            relative += f64::from(point.relative_variance);
            count += 1;
        }
        let measured = storage.get(..count)?;
        #[expect(clippy::cast_precision_loss, reason = "at most 16")]
        let number = count as f64;
        let (variance, freedom) = (relative / number, number - 3.0);
        if freedom < 1.0 || variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let (peak_hz, top) = measured
            .iter()
            .copied()
            .fold((0.0, f64::NEG_INFINITY), |best, point| if point.1 > best.1 { point } else { best });
        let curve = WIDTHS_HZ
            .map(|half_width_hz| {
                Curve { level: top, centre_hz: peak_hz, half_width_hz, squares: 0.0 }.fitted(measured)
            })
            .into_iter()
            .reduce(|best, other| if other.squares < best.squares { other } else { best })?;
        let level = measured.iter().map(|(_, y)| y).sum::<f64>() / number;
        let flat: f64 = measured.iter().map(|(_, y)| (y - level) * (y - level)).sum();
        let [chi_square, gained] = [curve.squares, flat - curve.squares].map(|squares| squares / variance);
        let scale = (chi_square / freedom).max(1.0);
        let (first, last) = (measured.first()?.0, measured.last()?.0);
        let within = curve.centre_hz > first && curve.centre_hz < last;
        if !within || gained / scale < f64::from(quantiles::chi_square(2.0, RESONANCE_FALSE)) {
            return None;
        }
        let (matrix, _) = curve.normal_equations(measured);
        let [_, [_, centre, _], _] = inverse(&matrix)?;
        let fit_sd_hz = math::sqrt(centre.max(0.0) * variance * scale);
        let (pull_hz, pull_sd_hz) = of_mode(&PULL, mode).at(math::exp(curve.level))?;
        #[expect(clippy::cast_possible_truncation, reason = "a quantile needs no more than single precision")]
        let limit = f64::from(quantiles::chi_square(freedom as f32, MISFIT_FALSE));
        Some(Self {
            offset_hz: curve.centre_hz - pull_hz,
            offset_sd_hz: math::sqrt(fit_sd_hz * fit_sd_hz + pull_sd_hz * pull_sd_hz),
            fit_sd_hz,
            half_width_hz: curve.half_width_hz,
            reduced_chi_square: chi_square / freedom,
            fits: chi_square <= limit,
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    /// Power at the peak of ordinary motors in mode B, where the pull is that of the table.
    const PEAK_M2_S2: f64 = 33e-3 * 33e-3 * 1.01;

    /// A curve at `centre_hz` of half width 40 Hz, at 13 frequencies 25 Hz apart, each power off by the part that `off`
    /// gives for its number.
    fn sweep(centre_hz: f64, off: impl Fn(u32) -> f64) -> [SweepPoint; 13] {
        core::array::from_fn(|index| {
            let x_hz = 25.0 * (index as f64 - 6.0);
            let power = PEAK_M2_S2 / (1.0 + ((x_hz - centre_hz) / 40.0).powi(2)) * (1.0 + off(index as u32));
            SweepPoint { offset_hz: x_hz as f32, power_m2_s2: power as f32, relative_variance: 0.01 }
        })
    }

    #[test]
    fn exact_a_clean_curve_is_found() {
        for centre_hz in [-60.0, 3.3, 40.0] {
            let found = Resonance::of(DriveMode::B, &sweep(centre_hz, |_| 0.0)).unwrap();
            assert!((found.offset_hz + PULL[0].hz - centre_hz).abs() < 1e-3, "{found:?}");
            assert!((found.half_width_hz - 40.0).abs() < 1e-2 && found.fits, "{found:?}");
        }
    }

    /// Powers at which the rotor lies on the teeth are no part of the curve.
    #[test]
    fn exact_frequencies_without_a_bounce_are_left_out() {
        let mut points = sweep(3.3, |_| 0.0);
        for index in [0, 1, 11, 12] {
            points[index].power_m2_s2 = 0.02 * PEAK_M2_S2 as f32;
        }
        let found = Resonance::of(DriveMode::B, &points).unwrap();
        assert!((found.offset_hz + PULL[0].hz - 3.3).abs() < 1e-3, "{found:?}");
        assert!((found.half_width_hz - 40.0).abs() < 1e-2 && found.fits, "{found:?}");
    }

    /// With noise of the stated variance the error is a few of the stated standard deviations, and these are those of
    /// many sweeps: 200 of them know a standard deviation to a twentieth, and four of those are a fifth.
    #[test]
    fn dual_the_standard_deviation_is_that_of_many_sweeps() {
        let mut state = 7_u64;
        let (mut squares, mut stated) = (0.0, 0.0);
        for _ in 0..200 {
            let noise: Vec<f64> = (0..13)
                .map(|_| {
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    let uniform = ((state >> 40) as f32 + 0.5) / (1_u64 << 24) as f32;
                    0.1 * f64::from(quantiles::normal(uniform))
                })
                .collect();
            let found = Resonance::of(DriveMode::B, &sweep(10.0, |index| noise[index as usize])).unwrap();
            squares += (found.offset_hz + PULL[0].hz - 10.0).powi(2);
            stated += found.fit_sd_hz.powi(2);
        }
        let ratio = (squares / stated).sqrt();
        assert!((0.75..1.2).contains(&ratio), "{ratio}");
    }

    /// A second peak contradicts the curve: it is told, and the error bar grows.
    #[test]
    fn law_a_curve_that_does_not_fit_is_told() {
        let clean = Resonance::of(DriveMode::C, &sweep(0.0, |_| 0.0)).unwrap();
        let odd =
            Resonance::of(DriveMode::C, &sweep(0.0, |index| if index > 9 { 4.0 } else { 0.0 })).unwrap();
        assert!(clean.fits && !odd.fits && odd.fit_sd_hz > 3.0 * clean.fit_sd_hz, "{clean:?} {odd:?}");
    }

    /// A bounce of five sixths of the velocity is pulled 1.2 times as far, and known 1.2 times as badly. One of two
    /// thirds tells nothing.
    #[test]
    fn exact_a_weak_bounce_is_pulled_farther() {
        let strong = PULL[0].at(33e-3 * 33e-3).unwrap();
        let weak = PULL[0].at(27.5e-3 * 27.5e-3).unwrap();
        assert!((weak.0 / strong.0 - 1.2).abs() < 1e-9 && (weak.1 / strong.1 - 1.2).abs() < 1e-9);
        assert!((PULL[0].at(1.0).unwrap().0 / strong.0 - 1.0).abs() < 1e-12);
        assert_eq!(PULL[0].at(22e-3 * 22e-3), None);
    }

    #[test]
    fn law_no_resonance_is_none() {
        let flat = |index: u32| 0.1 * f64::from(index % 3) - 0.1;
        let mut points = sweep(0.0, |_| 0.0);
        for (index, point) in points.iter_mut().enumerate() {
            point.power_m2_s2 = 1e-6 * (1.0 + flat(index as u32) as f32);
        }
        assert_eq!(Resonance::of(DriveMode::B, &points), None);
        assert_eq!(Resonance::of(DriveMode::B, &points[..3]), None);
        assert_eq!(Resonance::of(DriveMode::B, &sweep(400.0, |_| 0.0)), None, "beyond the sweep");
    }
}
