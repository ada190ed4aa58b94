//! In the place of `told.rs` without the feature `tell`: nothing is told, and nothing is kept.

use core::marker::PhantomData;

use motor_model::Real;

/// Nothing: neither of a kick nor of a sample period.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Untold<T>(PhantomData<T>);

pub(super) type ToldKick<T> = Untold<T>;
pub(super) type ToldPeriod<T> = Untold<T>;

#[expect(clippy::unused_self, clippy::trivially_copy_pass_by_ref, reason = "as in `told.rs`")]
impl<T: Real> Untold<T> {
    #[inline]
    pub(super) fn is_small(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn has_tooth_velocity(&self) -> bool {
        false
    }

    #[inline]
    pub(super) fn factors(&self, estimated: [T; 2]) -> ([T; 2], [T; 2]) {
        (estimated, [T::one(); 2])
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
    pub(super) fn pair(&self) -> Option<u8> {
        None
    }

    #[inline]
    pub(super) fn instant_s2(&self, untold_s2: T) -> T {
        untold_s2
    }
}
