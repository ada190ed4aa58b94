//! What the stator filter is told of the next impact.

use motor_model::Real;

/// Variance of an instant that is told, in s^2: 1 ns, to which times are kept.
const INSTANT_TOLD_S2: f64 = 1e-18;
/// Misfit that no impact reaches.
const MISFIT_MAX: f64 = 1e30;

/// What is told of the next impact.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct ToldContact {
    /// The pair of teeth; `None` where it is not told.
    pub(super) pair: Option<u8>,
    /// Whether the instant is told: the middle of the time within which the impact was.
    pub(super) instant: bool,
}

impl ToldContact {
    /// Nothing.
    pub(in super::super) fn nothing() -> Self {
        Self { pair: None, instant: false }
    }

    /// Whether it is of the first pair: as told, or else as `found`.
    pub(in super::super) fn is_of_first_pair(self, found: bool) -> bool {
        self.pair.map_or(found, |pair| pair == 0)
    }

    /// The misfit up to which it is no noise: any, where the pair is told.
    pub(in super::super) fn misfit_max<T: Real>(self, limit: T) -> T {
        if self.pair.is_some() { T::from_f64(MISFIT_MAX) } else { limit }
    }

    /// Variance of its instant, which is `untold_s2` where it is not told.
    pub(in super::super) fn instant_s2<T: Real>(self, untold_s2: T) -> T {
        if self.instant { T::from_f64(INSTANT_TOLD_S2) } else { untold_s2 }
    }
}
