//! Marks on the rotor's upper face, as a camera from above tracks them: two image coordinates each.
//!
//! ```text
//! mark j on the rotor    X_j = r (cos 2 pi j / n, sin 2 pi j / n),      j = 0 ... n - 1
//! in the picture         step * round((axis + p_j + b_j + noise) / step),     p_j by `crate::world::pose`
//! ```
//!
//! `axis` is the place of the pin's axis within a step, drawn by the seed, and `b_j` the sub-pixel bias
//! ([`super::subpixel_bias`]). The angle is that of the rigid motion that fits the marks best
//! ([`super::rigid_motion`]). It is clockwise positive, `-a`.
//!
//! # Which marks are used
//!
//! The marks agree when the residual is not larger than noise and a tolerance make it:
//!
//! ```text
//! sqrt(sum |residual|^2) <= sqrt(sigma^2 chi2) + sqrt(n) tolerance,     sigma^2 = noise^2 + step^2 / 12
//! ```
//!
//! with `chi2` the value that chi-squared exceeds once in three million pictures. The tolerance is for what is no rigid
//! motion in the plane: a tilt eta moves a mark by up to `r eta^2 / 2`, 2.4 um at 35 mrad.
//!
//! and when the rotor's play allows the shift `d` that they show, of the standard deviation `sigma_d`:
//!
//! ```text
//! |d| <= play + tolerance + sigma_d sqrt(chi2)              play: what the hub's clearance and a vibration allow
//! |m| <= play + tolerance + sigma_d sqrt(chi2 / (2 N - 1))
//! m+ = m + (d - m) / N                                      the mean over such pictures of all marks, N = 6
//! ```
//!
//! Otherwise one mark is left out, or two, the ones without which the rest agrees best. The picture is refused, and no
//! frame comes of it, when no such rest agrees, when two of them agree among themselves but not with each other, or
//! when the rest is so crowded that its angle has more than twice the variance of as many marks all round.
//!
//! What residuals cannot tell:
//!
//! - Two marks have one degree of freedom, their distance. A mark that is false round the axis keeps it, and turns the
//!   angle by half its error. It also shifts the pattern by half its error: with no play pictures are refused from
//!   twice the tolerance and some noise on, 0.09 degrees of angle for the default camera, and with play from so much
//!   more on. Of two marks that disagree none is known to be right: the picture is refused.
//! - Two opposite marks that are exchanged are a turn by 180 degrees.
//! - A tilt shortens the picture. With three marks or more the angle stays right; two opposite marks show up to
//!   `eta^2 / 4` of it as an angle, 14 milli-degrees at 31 mrad.

use motor_model::{Angle, Time, math};
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;

use super::rigid_motion::{Place, RigidMotion};
use super::subpixel_bias::SubpixelBias;
use crate::math::count::real;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::scene::faults::{FaultKind, MarkFault};
use crate::world::instruments::{FaultTimes, assumed};
use crate::world::pose::Pose;

/// Standard deviations of the normal distribution that are exceeded once in three million times.
const DEVIATIONS: f64 = 5.0;
/// Difference of two angles beyond which sets of marks do not agree with each other, in standard deviations.
const DISAGREE: f64 = 6.0;
/// Most marks that are left out by their residual.
const LEFT_OUT_MAX: usize = 2;
/// Pictures over which the shift is averaged.
const SHIFT_PICTURES: f64 = 6.0;
/// Rounding of coordinates, in m.
const ROUNDING_M: f64 = 1e-12;

/// How many pictures were not made of all marks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct MarkCounts {
    /// Pictures taken, those included that do not arrive.
    pub frames: u64,
    /// Those of which a mark was not found.
    pub mark_lost: u64,
    /// Those in which marks were left out by their residual.
    pub mark_left_out: u64,
    /// Those that the camera refused, because their marks did not agree.
    pub refused: u64,
}

/// The rotor as its marks show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkedPose {
    /// Angle within the turn, clockwise positive.
    pub angle: Angle,
    /// Its standard deviation in rad.
    pub angle_sd_rad: f64,
    /// Shift of the upper face's centre in m, x and y; zero if a single mark is used.
    pub shift_m: [f64; 2],
    /// Root of the mean square of the residuals, in m.
    pub residual_m: f64,
    /// Marks used.
    pub marks_used: u8,
}

/// The marks, and what is known of the camera that tracks them.
#[derive(Clone, Debug)]
pub(super) struct Marks {
    on_rotor: Vec<Place>,
    axis_m: Place,
    bias: Option<SubpixelBias>,
    noise_m: f64,
    step_m: f64,
    tolerance_m: f64,
    /// Largest shift of the pattern that play and vibration make.
    play_m: f64,
    /// The mean shift of the last pictures.
    mean_shift_m: Place,
    /// The faults of each mark.
    faults: Vec<FaultTimes<MarkFault>>,
    /// Where the marks were found last; `None` of one that was not found.
    found: Vec<Option<Place>>,
    counts: MarkCounts,
}

/// What chi-squared with `freedom` degrees exceeds once in three million times, or more rarely (Wilson and Hilferty,
/// PNAS 17 (1931) 684-688).
fn chi_squared(freedom: usize) -> f64 {
    let freedom = real(freedom);
    let part = 2.0 / (9.0 * freedom);
    let root = 1.0 - part + DEVIATIONS * math::sqrt(part);
    freedom * root * root * root
}

impl Marks {
    /// The marks of a scene; `None` of a camera that follows a single one.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let (count, radius_m) = (scene.integer("camera.marks"), scene.number("camera.tracking_radius_m"));
        let step_m = scene.number("camera.resolution_m");
        let mut draw = random_streams::stream(scene.seed(), RandomSource::CameraAxis);
        let mut within_a_pixel = || Uniform::new(0.0, 1.0).map_or(0.0, |law| step_m * law.sample(&mut draw));
        let axis_m = [within_a_pixel(), within_a_pixel()];
        let place = |j: u64| {
            let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * real(j) / real(count));
            [radius_m * cosine, radius_m * sine]
        };
        let on_rotor: Vec<Place> = (0..count).map(place).collect();
        let faults_of = |number: u64| {
            FaultTimes::of(scene, |kind| match kind {
                FaultKind::Mark(of, fault) if u64::from(of) == number => Some(fault),
                _ => None,
            })
        };
        let marks = Self {
            found: vec![None; on_rotor.len()],
            on_rotor,
            axis_m,
            bias: SubpixelBias::of(scene),
            noise_m: scene.number("camera.noise_m"),
            step_m,
            tolerance_m: scene.number("camera.mark_tolerance_m"),
            play_m: assumed::shift_max_m(scene),
            mean_shift_m: [0.0; 2],
            faults: (1..=count).map(faults_of).collect(),
            counts: MarkCounts::default(),
        };
        (count > 1).then_some(marks)
    }

    /// Takes the faults of `fresh`.
    pub(super) fn take_faults(&mut self, fresh: Self) {
        self.faults = fresh.faults;
    }

    /// Counts of the pictures so far.
    pub(super) fn counts(&self) -> MarkCounts {
        self.counts
    }

    /// Takes a picture of a rotor that stands at `angle` in `pose`: what its marks show, or `None` if they do not
    /// agree.
    pub(super) fn picture(
        &mut self,
        now: Time,
        angle: Angle,
        pose: &Pose,
        noise: &mut Pcg64,
    ) -> Option<MarkedPose> {
        self.find(now, angle, pose, noise);
        let found: Vec<(Place, Place)> =
            self.on_rotor.iter().zip(&self.found).filter_map(|(on, seen)| Some((*on, (*seen)?))).collect();
        self.counts.frames += 1;
        self.counts.mark_lost += u64::from(found.len() < self.on_rotor.len());
        let fit = self.agreeing(&found);
        match &fit {
            None => self.counts.refused += 1,
            Some(fit) => self.counts.mark_left_out += u64::from(fit.marks < found.len()),
        }
        fit.map(|fit| self.shown(&fit))
    }

    /// Finds the marks in the picture.
    fn find(&mut self, now: Time, angle: Angle, pose: &Pose, noise: &mut Pcg64) {
        let (sine, cosine) = math::sin_cos(-angle.wrapped().radians_since::<f64>(Angle::ZERO));
        for (j, (&[x, y], faults)) in self.on_rotor.iter().zip(&self.faults).enumerate() {
            let fault = faults.at(now);
            let [x, y] = match fault {
                Some(MarkFault::False(further_m)) => {
                    let part = further_m / math::sqrt(x * x + y * y);
                    [x + part * y, y - part * x]
                }
                _ => [x, y],
            };
            let seen = pose.seen_from_above([cosine * x - sine * y, sine * x + cosine * y]);
            let bias_m = self.bias.as_ref().map_or([0.0; 2], |bias| bias.at(j, seen));
            let [shown_x, shown_y] = [0, 1].map(|axis| {
                let error: f64 = StandardNormal.sample(noise);
                let shown_m = seen[axis] + bias_m[axis] + self.noise_m * error;
                if self.step_m > 0.0 {
                    self.step_m * ((self.axis_m[axis] + shown_m) / self.step_m).round() - self.axis_m[axis]
                } else {
                    shown_m
                }
            });
            if let Some(place) = self.found.get_mut(j) {
                *place = match fault {
                    Some(MarkFault::Lost) => None,
                    Some(MarkFault::Stuck) => *place,
                    _ => Some([shown_x, shown_y]),
                };
            }
        }
        for (j, faults) in self.faults.iter().enumerate() {
            if faults.at(now) == Some(MarkFault::Exchanged) {
                self.found.swap(j, (j + 1) % self.faults.len());
            }
        }
    }

    /// Variance of a coordinate in m^2.
    fn coordinate_m2(&self) -> f64 {
        self.noise_m * self.noise_m + self.step_m * self.step_m / 12.0 + ROUNDING_M * ROUNDING_M
    }

    /// Whether the marks of a fit agree with a rigid motion that the hub allows.
    fn agrees(&self, fit: &RigidMotion) -> bool {
        let allowed_m = math::sqrt(self.coordinate_m2() * chi_squared(fit.freedom()))
            + self.tolerance_m * math::sqrt(real(fit.marks));
        fit.residual_m2 <= allowed_m * allowed_m && self.hub_allows(fit.shift_m, fit, 1.0)
    }

    /// Whether the hub allows a shift with `part` of the variance of a fit's.
    fn hub_allows(&self, [x, y]: Place, fit: &RigidMotion, part: f64) -> bool {
        let sd_m = fit.shift_sd_m(math::sqrt(self.coordinate_m2()));
        let allowed_m = self.play_m + self.tolerance_m + sd_m * math::sqrt(part * chi_squared(2));
        x * x + y * y <= allowed_m * allowed_m
    }

    /// Takes the shift of a picture whose marks all agree into the mean; whether the hub allows that.
    fn stays_on_the_pin(&mut self, fit: &RigidMotion) -> bool {
        for (mean_m, shift_m) in self.mean_shift_m.iter_mut().zip(fit.shift_m) {
            *mean_m += (shift_m - *mean_m) / SHIFT_PICTURES;
        }
        self.hub_allows(self.mean_shift_m, fit, 1.0 / (2.0 * SHIFT_PICTURES - 1.0))
    }

    /// The fit of those of the marks found that agree; `None` when the picture is refused.
    fn agreeing(&mut self, found: &[(Place, Place)]) -> Option<RigidMotion> {
        let all = RigidMotion::fit(found.iter().copied())?;
        if self.agrees(&all) {
            return (self.stays_on_the_pin(&all) && self.spread_out(&all)).then_some(all);
        }
        for left_out in 1..=LEFT_OUT_MAX.min(found.len().saturating_sub(2)) {
            let mut fits = Vec::new();
            for (first, second) in pairs(found.len(), left_out) {
                let rest = found.iter().enumerate().filter(|(j, _)| *j != first && *j != second);
                fits.extend(RigidMotion::fit(rest.map(|(_, mark)| *mark)));
            }
            fits.retain(|fit| self.agrees(fit) && self.spread_out(fit));
            let best = fits.iter().min_by(|a, b| a.residual_m2.total_cmp(&b.residual_m2)).copied();
            if let Some(best) = best {
                return fits.iter().all(|fit| self.same_angle(fit, &best)).then_some(best);
            }
        }
        None
    }

    /// Whether the angle of a fit has at most twice the variance of as many marks all round.
    fn spread_out(&self, fit: &RigidMotion) -> bool {
        let Some([x, y]) = self.on_rotor.first() else { return false };
        let all_round_m2 = real(fit.marks) * (x * x + y * y);
        // The margin is for rounding: two of four marks side by side have exactly twice the variance.
        fit.spread_m2 >= 0.499_999 * all_round_m2
    }

    /// Whether two fits give the same angle, within their errors and the tolerance.
    fn same_angle(&self, one: &RigidMotion, other: &RigidMotion) -> bool {
        let apart = within_the_turn(one.angle_rad - other.angle_rad);
        let sd_m = math::sqrt(self.coordinate_m2());
        let sum_rad = one.angle_sd_rad(sd_m) + other.angle_sd_rad(sd_m);
        let allowed_m = DISAGREE * sd_m + 2.0 * self.tolerance_m;
        apart.radians_since::<f64>(Angle::ZERO).abs() <= sum_rad / sd_m * allowed_m
    }

    /// What a fit shows.
    fn shown(&self, fit: &RigidMotion) -> MarkedPose {
        let marks = real(fit.marks);
        MarkedPose {
            angle: within_the_turn(-fit.angle_rad),
            angle_sd_rad: fit.angle_sd_rad(math::sqrt(self.coordinate_m2())),
            shift_m: fit.shift_m,
            residual_m: math::sqrt(fit.residual_m2 / marks),
            marks_used: u8::try_from(fit.marks).unwrap_or(u8::MAX),
        }
    }
}

/// `radians` as an angle within the turn.
fn within_the_turn(radians: f64) -> Angle {
    Angle::from_degrees(radians.to_degrees()).wrapped()
}

/// The ways to leave out one mark or two of `count`: two indices, the same one twice for a single mark.
fn pairs(count: usize, left_out: usize) -> impl Iterator<Item = (usize, usize)> {
    let second = move |first: usize| if left_out == 1 { first..first + 1 } else { first + 1..count };
    (0..count).flat_map(move |first| second(first).map(move |second| (first, second)))
}

#[cfg(test)]
mod tests;
