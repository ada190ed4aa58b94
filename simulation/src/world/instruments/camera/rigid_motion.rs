//! The rigid motion in the plane that brings the marks of a body nearest to where a camera sees them.
//!
//! ```text
//! minimise   sum over j of |p_j - d - R(a) X_j|^2      over angle a and shift d
//!
//! X_j: place of a mark on the body     p_j: where it is seen     R(a): rotation by a, counter-clockwise
//! ```
//!
//! With the means `Xm`, `pm` of the marks used and `X' = X - Xm`, `p' = p - pm` (Arun, Huang and Blostein, IEEE PAMI 9
//! (1987) 698-700, in two dimensions):
//!
//! ```text
//! a = atan2(sum X' x p', sum X' . p')        d = pm - R(a) Xm
//! ```
//!
//! Errors of variance `sigma^2` in each coordinate, independent, give to first order
//!
//! ```text
//! variance of a = sigma^2 / sum |X'|^2,        n r^2 for n >= 2 marks equally spaced on a circle of radius r
//! covariance of d = sigma^2 (1 / n + |Xm|^2 / sum |X'|^2)   across Xm; along Xm the first part alone
//! Q = sum |p - d - R(a) X|^2 / sigma^2         chi-squared with 2 n - 3 degrees of freedom
//! ```
//!
//! One mark does not tell a shift from an angle: with one, d is taken as 0, and Q has one degree of freedom, its
//! distance from the axis.

use motor_model::math;

use crate::math::count::real;

/// A place in the plane, in m.
pub(super) type Place = [f64; 2];

/// The motion that fits best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RigidMotion {
    /// Angle in rad, counter-clockwise, within half a turn.
    pub(super) angle_rad: f64,
    /// Shift of the body's origin in m.
    pub(super) shift_m: Place,
    /// `sum |X'|^2` in m^2, about the axis for one mark: the variance of the angle is `sigma^2` by this.
    pub(super) spread_m2: f64,
    /// Square of the distance in m^2 between the marks' mean and the body's origin.
    off_centre_m2: f64,
    /// Sum of the residuals' squares in m^2.
    pub(super) residual_m2: f64,
    /// Marks used.
    pub(super) marks: usize,
}

/// Scalar product and vertical part of the vector product.
fn products([ax, ay]: Place, [bx, by]: Place) -> (f64, f64) {
    (ax * bx + ay * by, ax * by - ay * bx)
}

fn minus(a: Place, b: Place) -> Place {
    [a[0] - b[0], a[1] - b[1]]
}

/// `place` turned by the angle with this sine and cosine.
fn turned([x, y]: Place, (sine, cosine): (f64, f64)) -> Place {
    [cosine * x - sine * y, sine * x + cosine * y]
}

impl RigidMotion {
    /// The motion that fits marks given as places on the body and places seen; `None` without marks.
    pub(super) fn fit(marks: impl Iterator<Item = (Place, Place)> + Clone) -> Option<Self> {
        let (mut count, mut body, mut seen) = (0_usize, [0.0; 2], [0.0; 2]);
        for (on_body, in_picture) in marks.clone() {
            count += 1;
            for axis in [0, 1] {
                body[axis] += on_body[axis];
                seen[axis] += in_picture[axis];
            }
        }
        let part = if count > 1 { 1.0 / real(count) } else { 0.0 };
        let (body, seen) = (body.map(|sum| part * sum), seen.map(|sum| part * sum));
        let (mut dot, mut cross, mut spread_m2) = (0.0, 0.0, 0.0);
        for (on_body, in_picture) in marks.clone() {
            let on_body = minus(on_body, body);
            let (with_seen, across_seen) = products(on_body, minus(in_picture, seen));
            dot += with_seen;
            cross += across_seen;
            spread_m2 += products(on_body, on_body).0;
        }
        let angle_rad = math::atan2(cross, dot);
        let rotation = math::sin_cos(angle_rad);
        let shift_m = minus(seen, turned(body, rotation));
        let residual_m2 = marks
            .map(|(on_body, in_picture)| {
                let left = minus(minus(in_picture, shift_m), turned(on_body, rotation));
                products(left, left).0
            })
            .sum();
        let off_centre_m2 = products(body, body).0;
        let motion = Self { angle_rad, shift_m, spread_m2, off_centre_m2, residual_m2, marks: count };
        (count > 0).then_some(motion)
    }

    /// Degrees of freedom of the residual.
    pub(super) fn freedom(&self) -> usize {
        if self.marks > 1 { 2 * self.marks - 3 } else { 1 }
    }

    /// Standard deviation of the angle in rad, of coordinates with this standard deviation in m.
    pub(super) fn angle_sd_rad(&self, coordinate_sd_m: f64) -> f64 {
        coordinate_sd_m / math::sqrt(self.spread_m2)
    }

    /// Standard deviation of the shift in m across the marks' mean, where it is largest; of one mark, for which no
    /// shift is told, that of a coordinate.
    pub(super) fn shift_sd_m(&self, coordinate_sd_m: f64) -> f64 {
        coordinate_sd_m * math::sqrt(1.0 / real(self.marks) + self.off_centre_m2 / self.spread_m2)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    use super::*;

    const RADIUS_M: f64 = 3.9e-3;

    /// `n` marks equally spaced on the circle.
    fn circle(n: u32) -> Vec<Place> {
        let at = |j: u32| {
            turned([RADIUS_M, 0.0], math::sin_cos(f64::from(j) / f64::from(n) * std::f64::consts::TAU))
        };
        (0..n).map(at).collect()
    }

    /// Marks and where they are seen after a motion.
    fn moved(marks: &[Place], angle_rad: f64, shift_m: Place) -> Vec<(Place, Place)> {
        let rotation = math::sin_cos(angle_rad);
        let seen = |place: Place| {
            let [x, y] = turned(place, rotation);
            [x + shift_m[0], y + shift_m[1]]
        };
        marks.iter().map(|&place| (place, seen(place))).collect()
    }

    proptest! {
        /// Without noise the motion itself comes out, by any two marks or more, and nothing is left.
        #[test]
        fn exact_a_motion_without_noise_is_found(
            n in 2_u32..=16,
            angle_rad in -3.1..3.1_f64,
            x_m in -1e-3..1e-3_f64,
            y_m in -1e-3..1e-3_f64,
        ) {
            let fit = RigidMotion::fit(moved(&circle(n), angle_rad, [x_m, y_m]).into_iter()).unwrap();
            prop_assert!((fit.angle_rad - angle_rad).abs() < 1e-13);
            prop_assert!((fit.shift_m[0] - x_m).abs() < 1e-16 && (fit.shift_m[1] - y_m).abs() < 1e-16);
            prop_assert!(fit.residual_m2 < 1e-30);
            prop_assert!((fit.spread_m2 / (f64::from(n) * RADIUS_M * RADIUS_M) - 1.0).abs() < 1e-12);
        }
    }

    /// One mark shows a shift as an angle: that of its direction from the axis.
    #[test]
    fn exact_the_shift_of_one_mark_is_an_angle() {
        let fit = RigidMotion::fit(moved(&circle(1), 0.0, [0.0, 7e-6]).into_iter()).unwrap();
        assert!((fit.angle_rad - math::atan2(7e-6, RADIUS_M)).abs() < 1e-15);
        assert!(fit.shift_m.iter().all(|shift_m| shift_m.abs() < 1e-18));
        assert!(RigidMotion::fit(std::iter::empty()).is_none());
    }

    /// One of three marks is left out: those 120 degrees apart that stay have 3/2 of a squared
    /// radius, and of n marks n (n - 2) / (n - 1).
    #[test]
    fn exact_spread_without_one_mark() {
        for n in 3..=16 {
            let marks = circle(n);
            let fit = RigidMotion::fit(moved(&marks[1..], 0.3, [0.0; 2]).into_iter()).unwrap();
            let n = f64::from(n);
            let expected = RADIUS_M * RADIUS_M * n * (n - 2.0) / (n - 1.0);
            assert!((fit.spread_m2 / expected - 1.0).abs() < 1e-12, "{n}");
        }
    }

    /// `sigma / (r sqrt n)` for the angle and `2 n - 3` for the residual, over 20,000 pictures: a variance is known to
    /// 1 %, a mean of chi-squared with k degrees to `sqrt(2 / k)` percent of a root of 2; four of those standard
    /// errors, to either side.
    #[test]
    fn law_angle_and_residual_have_their_variance() {
        let (sigma_m, pictures) = (1e-6, 20_000_u32);
        let mut rng = Pcg64::seed_from_u64(11);
        for n in [2_u32, 3, 4, 8, 16] {
            let marks = circle(n);
            let (mut squares, mut misfit) = (0.0, 0.0);
            for _ in 0..pictures {
                let mut seen = moved(&marks, 0.7, [3e-6, -2e-6]);
                for (_, place) in &mut seen {
                    for coordinate in place {
                        let noise: f64 = StandardNormal.sample(&mut rng);
                        *coordinate += sigma_m * noise;
                    }
                }
                let fit = RigidMotion::fit(seen.into_iter()).unwrap();
                let off = (fit.angle_rad - 0.7) / fit.angle_sd_rad(sigma_m);
                squares += off * off / f64::from(pictures);
                misfit += fit.residual_m2 / (sigma_m * sigma_m * f64::from(pictures));
            }
            let freedom = f64::from(2 * n - 3);
            assert!((squares - 1.0).abs() < 0.04, "{n}: {squares}");
            assert!(
                (misfit / freedom - 1.0).abs() < 0.04 / math::sqrt(freedom),
                "{n}: {misfit} of {freedom}"
            );
        }
    }

    /// Two of three marks, whose mean is half a radius off the axis: `sigma^2 / 2` along that line, and across it
    /// `sigma^2 (1 / 2 + 1 / 6)`, which is the one said. Over 20,000 pictures a variance is known to 1 %; four of that.
    #[test]
    fn law_the_shift_has_its_variance() {
        let (sigma_m, pictures) = (1e-6, 20_000_u32);
        let mut rng = Pcg64::seed_from_u64(12);
        let marks = &circle(3)[1..];
        let (sine, cosine) = math::sin_cos(0.7);
        let (mut along_m2, mut across_m2, mut said_m) = (0.0, 0.0, 0.0);
        for _ in 0..pictures {
            let mut seen = moved(marks, 0.7, [0.0; 2]);
            for coordinate in seen.iter_mut().flat_map(|(_, place)| place) {
                let noise: f64 = StandardNormal.sample(&mut rng);
                *coordinate += sigma_m * noise;
            }
            let fit = RigidMotion::fit(seen.into_iter()).unwrap();
            let (along_m, across_m) = products([cosine, sine], fit.shift_m);
            along_m2 += along_m * along_m / f64::from(pictures);
            across_m2 += across_m * across_m / f64::from(pictures);
            said_m = fit.shift_sd_m(sigma_m);
        }
        let of_sigma_m2 = |m2: f64| m2 / (sigma_m * sigma_m);
        assert!((of_sigma_m2(along_m2) * 2.0 - 1.0).abs() < 0.04, "{along_m2:e}");
        assert!((of_sigma_m2(across_m2) * 1.5 - 1.0).abs() < 0.04, "{across_m2:e}");
        assert!((of_sigma_m2(said_m * said_m) * 1.5 - 1.0).abs() < 1e-6, "{said_m:e}");
    }
}
