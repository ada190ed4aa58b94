//! A high-speed camera on a microscope, following marks at a known radius on the rotor.
//!
//! With one mark the camera follows its direction from the axis, along the arc. A shift of the rotor is then an angle:
//!
//! ```text
//! arc = radius * (angle (within the turn) - direction's change by shift and tilt) + tracking noise
//! seen = resolution * round(arc / resolution)
//! ```
//!
//! With two marks or more it follows each by two image coordinates, and tells angle from shift: [`marks`].
//!
//! Defaults: the paper's camera, 10,000 frames/s and 2 um of resolution, at a feature 3.9 mm from the axis; two
//! opposite marks, 1 um of Gaussian tracking noise, and one frame of latency for reading out and tracking.
//!
//! Off unless a scene sets them:
//!
//! | what | model |
//! |---|---|
//! | phase, jitter | when a frame's exposure ends: [`crate::world::event_clock`] |
//! | exposure blur | a frame shows the mean angle, shift and tilt over its exposure and has the time of its middle |
//! | dropped frame | it never arrives |
//! | duplicated frame | it arrives a second time, right after the first |
//! | outlier | Gaussian error of the tracked position along the arc, of all marks alike, before quantisation |
//! | stamp jitter | Gaussian error of the time stamp alone |
//! | clock of its own | offset and drift of the clock that stamps, taken back by exchanges: [`own_clock`] |
//! | late frame | it arrives 1 to `camera.late_frames` frames later, all as likely, and later frames overtake it |
//! | loss | frames exposed within the outage do not exist |
//! | sub-pixel bias | each coordinate of a mark is off by a sine of its place in a pixel: [`subpixel_bias`] |
//! | vibration of the microscope | the picture is shifted by a sine of time, before all else: [`vibration`] |
//! | fault, from one time to another | frames show the last picture, angle zero, or a constant more than the angle |
//! | fault by chance, from one time to another | frames are lost, outliers, or late by a constant |
//! | fault of a mark, from one time to another | a mark is not found, stuck, false or exchanged: [`marks`] |

mod delivery;
mod exposure;
mod marks;
mod own_clock;
mod rigid_motion;
mod single_mark;
mod subpixel_bias;
mod vibration;

use estimator::CameraFrame;
use motor_model::{Angle, Time};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::{FaultChances, FaultTimes};
use crate::math::count::real;
use crate::math::random_streams::{self, RandomFault, RandomSource};
use crate::scene::Scene;
use crate::scene::faults::{CameraFault, FaultKind};
use crate::world::event_clock::{EventClock, EventRate};
use crate::world::pose::Pose;
use crate::world::rotor_path::RotorPath;
pub use delivery::DeliveredFrame;
use delivery::Delivery;
use exposure::{Exposure, Shown};
use marks::Marks;
pub use marks::{MarkCounts, MarkedPose};
pub(in crate::world::instruments) use own_clock::ClockSettings;
use own_clock::OwnClock;
use subpixel_bias::SubpixelBias;
use vibration::Vibration;

/// What tracking makes of a picture: all of a frame but its time.
#[derive(Clone, Copy, Debug)]
struct Picture {
    angle: Angle,
    marks_used: u8,
    residual: u8,
}

/// The camera, with the frames that are on their way from it.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Ends of the exposures.
    clock: EventClock,
    radius_m: f64,
    resolution_m: f64,
    noise_m: f64,
    noise: Pcg64,
    /// `None` of a camera that follows a single mark.
    marks: Option<Marks>,
    /// What the marks showed last.
    marked: Option<MarkedPose>,
    /// Of a single mark; several have their own.
    bias: Option<SubpixelBias>,
    vibration: Option<Vibration>,
    exposure: Exposure,
    outlier: RandomFault,
    outlier_m: f64,
    /// Outliers of faults.
    faulty: FaultChances,
    stamp_jitter_nanos: f64,
    stamps: Pcg64,
    /// `None` where the board's clock stamps the frames.
    own_clock: Option<OwnClock>,
    delivery: Delivery,
    /// What it shows wrongly; without pictures that do not exist.
    faults: FaultTimes<CameraFault>,
    /// The last picture without a fault.
    picture: Picture,
}

impl Camera {
    /// The camera of a scene.
    pub fn new(scene: &Scene) -> Self {
        let seed = scene.noise_seed();
        let rate = EventRate::from_hz(scene.number("camera.frame_rate_hz"));
        let clock = EventClock::new(rate, scene.number("camera.phase_frames")).with_jitter(
            1e9 * scene.number("camera.period_jitter_s"),
            random_streams::stream(seed, RandomSource::CameraClock),
        );
        let exposure_nanos = rate.part_nanos(scene.number("camera.exposure_frames"));
        Self {
            exposure: Exposure::new(exposure_nanos, clock.due()),
            clock,
            radius_m: scene.number("camera.tracking_radius_m"),
            resolution_m: scene.number("camera.resolution_m"),
            noise_m: scene.number("camera.noise_m"),
            noise: random_streams::stream(seed, RandomSource::Camera),
            marks: Marks::of(scene),
            marked: None,
            bias: SubpixelBias::of(scene),
            vibration: Vibration::of(scene),
            outlier: RandomFault::in_bursts(
                seed,
                RandomSource::CameraOutlier,
                scene.number("camera.outlier_probability"),
                scene.number("camera.outlier_burst_frames"),
            ),
            outlier_m: scene.number("camera.outlier_m"),
            faulty: FaultChances::of(scene, RandomSource::CameraFaultOutlier, |kind| match kind {
                FaultKind::Camera(CameraFault::Outliers(probability)) => Some(probability),
                _ => None,
            }),
            stamp_jitter_nanos: 1e9 * scene.number("camera.stamp_jitter_s"),
            stamps: random_streams::stream(seed, RandomSource::CameraStamp),
            own_clock: OwnClock::of(scene),
            delivery: Delivery::new(scene, rate),
            faults: FaultTimes::of(scene, |kind| match kind {
                FaultKind::Camera(fault) => shows_wrongly(fault).then_some(fault),
                _ => None,
            }),
            picture: Picture { angle: Angle::ZERO, marks_used: CameraFrame::ALL_MARKS, residual: 0 },
        }
    }

    /// Takes the faults of `scene`, which describes this camera and its faults until the present.
    pub fn change_faults(&mut self, scene: &Scene) {
        let Self { faults, faulty, delivery, marks, .. } = Self::new(scene);
        self.faults = faults;
        self.faulty.take_times(faulty);
        self.delivery.take_faults(delivery);
        if let (Some(own), Some(fresh)) = (&mut self.marks, marks) {
            own.take_faults(fresh);
        }
    }

    /// Variance of a frame's angle in rad^2: tracking noise, and the quantisation's as if it were uniform and
    /// independent; of all marks together.
    pub fn variance_rad2(scene: &Scene) -> f64 {
        let [noise_m, resolution_m, radius_m] =
            ["camera.noise_m", "camera.resolution_m", "camera.tracking_radius_m"]
                .map(|key| scene.number(key));
        (noise_m * noise_m + resolution_m * resolution_m / 12.0)
            / (real(scene.integer("camera.marks")) * radius_m * radius_m)
    }

    /// Root mean square error in s of the clock by which the frames of a scene are stamped: what exchanges with the
    /// board leave of it; 0 of the board's own.
    pub fn clock_error_s(scene: &Scene) -> f64 {
        ClockSettings::of(scene).error_s()
    }

    /// What the marks of the last picture showed; `None` of a single mark, and if they did not agree.
    pub fn marked(&self) -> Option<&MarkedPose> {
        self.marked.as_ref()
    }

    /// How many pictures were not made of all marks; `None` of a single mark.
    pub fn mark_counts(&self) -> Option<MarkCounts> {
        self.marks.as_ref().map(Marks::counts)
    }

    /// When it is to be shown the rotor next: at once while a shutter is open.
    #[inline]
    pub fn due(&self) -> Time {
        self.exposure.due(self.clock.due())
    }

    /// Sees the rotor over a step: begins and ends the exposures that are due.
    pub fn follow(&mut self, path: &RotorPath) {
        let at_instant = |at| Shown { angle: path.angle_at(at), pose: path.pose_at(at) };
        loop {
            if let Some(at) = self.exposure.opens_at().filter(|at| *at <= path.until.at) {
                self.exposure.open(at, at_instant(at));
            }
            let ends = self.clock.due();
            if ends > path.until.at {
                break;
            }
            self.expose(ends, at_instant(ends));
            self.clock.advance();
            self.exposure.plan(ends, self.clock.due());
        }
        self.exposure.look(path.until.at, Shown { angle: path.until.angle, pose: path.until.pose });
    }

    /// Ends the exposure of a frame at `now`, when the rotor stands as `shown`.
    pub fn expose(&mut self, now: Time, shown: Shown) {
        let (mut shown, middle_nanos) = self.exposure.close(now, shown);
        if let Some(vibration) = &self.vibration {
            let shift_m = vibration.mean_shift_m(now, 2 * middle_nanos);
            shown.pose = shown.pose.plus(&Pose { shift_m, ..Pose::LEVEL }, 1.0);
        }
        let exposed_at = self.stamped(now, middle_nanos);
        let seen = self.seen(now, shown);
        if let Some(Picture { angle, marks_used, residual }) = self.with_fault(now, seen) {
            let frame = CameraFrame { exposed_at, angle, marks_used, residual };
            let marked = self.marked.filter(|marked| marked.angle == angle);
            self.delivery.send(now, Some(DeliveredFrame { frame, marked }));
        } else {
            self.delivery.send(now, None);
        }
    }

    /// What tracking makes of a picture of the rotor as `shown`; `None` when its marks do not agree.
    fn seen(&mut self, now: Time, shown: Shown) -> Option<Picture> {
        if self.marks.is_some() {
            return self.seen_by_marks(now, shown);
        }
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        let outlier = self.outlier(now);
        let angle_rad = shown.angle.wrapped().radians_since::<f64>(Angle::ZERO);
        let arc_m = self.radius_m * angle_rad
            - self.radius_m * single_mark::change_of_direction(self.radius_m, angle_rad, &shown.pose)
            + self.bias_along_the_arc(angle_rad, &shown.pose)
            + self.noise_m * noise
            + self.outlier_m * outlier;
        let seen_m = if self.resolution_m > 0.0 {
            self.resolution_m * (arc_m / self.resolution_m).round()
        } else {
            arc_m
        };
        let angle = Angle::from_degrees((seen_m / self.radius_m).to_degrees()).wrapped();
        Some(Picture { angle, marks_used: 1, residual: 0 })
    }

    /// Sub-pixel bias of a single mark.
    fn bias_along_the_arc(&self, angle_rad: f64, pose: &Pose) -> f64 {
        let of_place = |bias: &SubpixelBias| {
            let place = pose.seen_from_above(single_mark::place(self.radius_m, angle_rad));
            single_mark::along_the_arc(angle_rad, bias.at(0, place))
        };
        self.bias.as_ref().map_or(0.0, of_place)
    }

    /// Error of an outlier, in standard deviations; 0 of any other frame.
    fn outlier(&mut self, now: Time) -> f64 {
        let error = |rng: Option<&mut Pcg64>| rng.map_or(0.0, |rng| StandardNormal.sample(rng));
        let by_chance: f64 = error(self.outlier.occurs());
        by_chance + error(self.faulty.occurs(now))
    }

    /// The same of two marks or more.
    fn seen_by_marks(&mut self, now: Time, Shown { angle, pose }: Shown) -> Option<Picture> {
        let outlier = self.outlier(now);
        let off = Angle::from_degrees((self.outlier_m * outlier / self.radius_m).to_degrees());
        self.marked = self.marks.as_mut()?.picture(now, angle.plus(off), &pose, &mut self.noise);
        self.marked.map(|marked| Picture {
            angle: marked.angle,
            marks_used: marked.marks_used,
            residual: CameraFrame::residual_steps(marked.residual_m),
        })
    }

    /// What is delivered, with the fault at `now` if there is one.
    fn with_fault(&mut self, now: Time, seen: Option<Picture>) -> Option<Picture> {
        match self.faults.at(now) {
            Some(CameraFault::Stuck) => Some(self.picture),
            Some(CameraFault::Zeros) => Some(Picture { angle: Angle::ZERO, ..self.picture }),
            Some(CameraFault::Offset(further_deg)) => seen.map(|picture| Picture {
                angle: picture.angle.plus(Angle::from_degrees(further_deg)).wrapped(),
                ..picture
            }),
            // The others show nothing wrong.
            _ => {
                self.picture = seen.unwrap_or(self.picture);
                seen
            }
        }
    }

    /// The time stamp of a frame whose middle of exposure was `middle_nanos` before `now`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "far within bounds, and it saturates"
    )]
    fn stamped(&mut self, now: Time, middle_nanos: u64) -> Time {
        let middle = Time::from_nanos(now.nanos_since(Time::from_nanos(middle_nanos)));
        let jitter: f64 = StandardNormal.sample(&mut self.stamps);
        let late_nanos = (self.stamp_jitter_nanos * jitter).round();
        let stamped = if late_nanos < 0.0 {
            Time::from_nanos(middle.nanos_since(Time::from_nanos(-late_nanos as u64)))
        } else {
            middle.plus_nanos(late_nanos as u64)
        };
        self.own_clock.as_mut().map_or(stamped, |clock| clock.by_the_board(now, stamped))
    }

    /// The oldest frame that has arrived by `now`.
    pub fn arrived(&mut self, now: Time) -> Option<CameraFrame> {
        self.delivered(now).map(|delivered| delivered.frame)
    }

    /// The same, with what its marks showed.
    pub fn delivered(&mut self, now: Time) -> Option<DeliveredFrame> {
        self.delivery.arrived(now)
    }
}

/// Whether a camera with this fault shows another picture than its own.
fn shows_wrongly(fault: CameraFault) -> bool {
    matches!(fault, CameraFault::Stuck | CameraFault::Zeros | CameraFault::Offset(_))
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
mod tests;
