//! A single mark, as a camera follows it: along the arc about the pin's axis, clockwise positive.

use motor_model::math;

use super::rigid_motion::Place;
use crate::world::pose::Pose;

/// Where a mark at `radius_m` stands on a level rotor at `angle_rad`.
pub(super) fn place(radius_m: f64, angle_rad: f64) -> Place {
    let (sine, cosine) = math::sin_cos(-angle_rad);
    [radius_m * cosine, radius_m * sine]
}

/// By how much shift and tilt turn the direction of a mark as seen from the axis, in rad, counter-clockwise.
pub(super) fn change_of_direction(radius_m: f64, angle_rad: f64, pose: &Pose) -> f64 {
    if *pose == Pose::LEVEL {
        return 0.0;
    }
    let (sine, cosine) = math::sin_cos(-angle_rad);
    let [x, y] = pose.seen_from_above(place(radius_m, angle_rad));
    math::atan2(cosine * y - sine * x, cosine * x + sine * y)
}

/// The part along the arc of a displacement, at a mark that stands at `angle_rad`.
pub(super) fn along_the_arc(angle_rad: f64, [x, y]: [f64; 2]) -> f64 {
    let (sine, cosine) = math::sin_cos(-angle_rad);
    sine * x - cosine * y
}
