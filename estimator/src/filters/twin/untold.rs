//! In the place of `told.rs` without the feature `tell`: nothing is told, and nothing is kept.

use core::marker::PhantomData;

use motor_model::{Real, Time};

use super::TwinFilter;
use super::kick_record::KickRecord;
use super::measured_impact::MeasuredImpact;
use crate::camera::track::State;
use crate::vibrometer::impact_detector::VibrometerEvent;

/// Nothing of the next impact.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToldContact;

/// Nothing of a kick.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToldKick<T>(PhantomData<T>);

/// Nothing of a sample period.
#[derive(Clone, Debug)]
pub(super) struct ToldPeriod<T>(PhantomData<T>);

#[expect(clippy::unused_self, reason = "as in `told.rs`")]
impl ToldContact {
    #[inline]
    pub(super) fn nothing() -> Self {
        Self
    }

    #[inline]
    pub(super) fn is_of_first_pair(self, found: bool) -> bool {
        found
    }

    #[inline]
    pub(super) fn misfit_max<T: Real>(self, limit: T) -> T {
        limit
    }

    #[inline]
    pub(super) fn instant_s2<T: Real>(self, untold_s2: T) -> T {
        untold_s2
    }
}

#[expect(clippy::unused_self, clippy::trivially_copy_pass_by_ref, reason = "as in `told.rs`")]
impl<T: Real> ToldKick<T> {
    #[inline]
    pub(super) fn nothing() -> Self {
        Self(PhantomData)
    }

    #[inline]
    pub(super) fn is_small(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn has_tooth_velocity(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn apply<B>(&self, _: &mut State<T, B>) -> bool {
        false
    }

    #[inline]
    pub(super) fn factors(&self, estimated: [T; 2]) -> [T; 2] {
        estimated
    }

    #[inline]
    pub(super) fn error_parts(&self) -> [T; 2] {
        [T::one(); 2]
    }
}

#[expect(clippy::unused_self, reason = "as in `told.rs`")]
impl<T: Real> ToldPeriod<T> {
    #[inline]
    pub(super) fn nothing() -> Self {
        Self(PhantomData)
    }

    #[inline]
    pub(super) fn is_told(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn is_false_alarm(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn bounces(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn measured(&mut self, _: Time, _: T, impact: MeasuredImpact<T>) -> MeasuredImpact<T> {
        impact
    }

    #[inline]
    pub(super) fn improve(&self, _: &mut KickRecord<T>, _: T, _: T) {}
}

#[expect(clippy::unused_self, reason = "as in `told.rs`")]
impl<T: Real> TwinFilter<T> {
    #[inline]
    pub(super) fn begin_told_period(&mut self, _: Time, _: VibrometerEvent<T>) {}

    #[inline]
    pub(super) fn end_told_period(&mut self, _: Time) {}
}
