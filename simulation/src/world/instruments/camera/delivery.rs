//! The way of the frames from the camera: latency, lost frames, copies, and frames that come late.

use std::collections::VecDeque;

use estimator::CameraFrame;
use motor_model::Time;
use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;

use super::MarkedPose;
use crate::math::random_streams::{RandomFault, RandomSource};
use crate::scene::Scene;
use crate::scene::faults::{CameraFault, FaultKind};
use crate::world::event_clock::EventRate;
use crate::world::instruments::{FaultChances, FaultTimes};

/// A frame as it is delivered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeliveredFrame {
    /// The frame.
    pub frame: CameraFrame,
    /// What its marks showed; `None` of a single mark, and where a fault of the camera shows another angle.
    pub marked: Option<MarkedPose>,
}

/// The frames on their way.
#[derive(Clone, Debug)]
pub(super) struct Delivery {
    latency_nanos: u64,
    period_nanos: u64,
    drop: RandomFault,
    duplicate: RandomFault,
    late: RandomFault,
    /// Most periods that a late frame comes late.
    late_frames: u64,
    outages: FaultTimes<()>,
    intermittent: FaultChances,
    /// Delays in ns.
    delays: FaultTimes<u64>,
    /// Time of arrival and frame, in order of arrival.
    on_the_way: VecDeque<(Time, DeliveredFrame)>,
}

impl Delivery {
    /// The delivery of a scene with frames at this rate.
    pub(super) fn new(scene: &Scene, rate: EventRate) -> Self {
        let fault =
            |source, probability| RandomFault::new(scene.noise_seed(), source, scene.number(probability));
        Self {
            latency_nanos: rate.span_nanos(scene.integer("camera.latency_frames"))
                + scene.nanos("camera.latency_s"),
            period_nanos: rate.span_nanos(1),
            drop: fault(RandomSource::CameraDrop, "camera.drop_probability"),
            duplicate: fault(RandomSource::CameraDuplicate, "camera.duplicate_probability"),
            late: fault(RandomSource::CameraLate, "camera.late_probability"),
            late_frames: scene.integer("camera.late_frames"),
            outages: FaultTimes::of(scene, |kind| {
                (kind == FaultKind::Camera(CameraFault::Lost)).then_some(())
            }),
            intermittent: FaultChances::of(scene, RandomSource::CameraFaultLoss, |kind| match kind {
                FaultKind::Camera(CameraFault::Intermittent(probability)) => Some(probability),
                _ => None,
            }),
            delays: FaultTimes::of(scene, |kind| match kind {
                FaultKind::Camera(CameraFault::Delayed(by_s)) => Some(nanos(by_s)),
                _ => None,
            }),
            on_the_way: VecDeque::new(),
        }
    }

    /// Takes the faults of `fresh`; frames and random numbers stay.
    pub(super) fn take_faults(&mut self, fresh: Self) {
        self.outages = fresh.outages;
        self.intermittent.take_times(fresh.intermittent);
        self.delays = fresh.delays;
    }

    /// Sends the frame whose exposure ends at `now`, unless it is lost; `None` if there is none.
    pub(super) fn send(&mut self, now: Time, frame: Option<DeliveredFrame>) {
        // Every fault has its draw, also where the frame is dropped or there is none.
        let dropped = self.drop.occurs().is_some();
        let twice = self.duplicate.occurs().is_some();
        let most = self.late_frames;
        let late_frames = self.late.occurs().map_or(0, |rng| whole_up_to(most, rng));
        let missed = self.intermittent.occurs(now).is_some();
        let Some(frame) = frame.filter(|_| !dropped && !missed && !self.outages.cover(now)) else { return };
        let delay_nanos: u64 = self.delays.all(now).sum();
        let arrives_at = now.plus_nanos(self.latency_nanos + late_frames * self.period_nanos + delay_nanos);
        let place = self.on_the_way.partition_point(|(earlier, _)| *earlier <= arrives_at);
        for _ in 0..=u8::from(twice) {
            self.on_the_way.insert(place, (arrives_at, frame));
        }
    }

    /// The oldest frame that has arrived by `now`.
    pub(super) fn arrived(&mut self, now: Time) -> Option<DeliveredFrame> {
        let (arrives_at, frame) = *self.on_the_way.front()?;
        (arrives_at <= now).then(|| {
            self.on_the_way.pop_front();
            frame
        })
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 to 1 s")]
fn nanos(seconds: f64) -> u64 {
    (1e9 * seconds).round() as u64
}

/// A whole number from 1 to `most`.
fn whole_up_to(most: u64, rng: &mut Pcg64) -> u64 {
    Uniform::new_inclusive(1, most.max(1)).map_or(1, |uniform| uniform.sample(rng))
}
