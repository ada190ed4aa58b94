//! A partial genie: the filter is told parts of the truth, to find out what not knowing them costs.
//!
//! | part | what is told | noise that goes with it |
//! |---|---|---|
//! | tooth velocity | the rate to which the tooth of each impact carries the rotor | its own, and the tooth factor |
//! | instant | when each impact was within the period of its sample | the instant's, and the kick's |
//! | jump | the rotor's velocity before each impact, and its jump | the vibrometer's, at impacts |
//! | pair | which pair of teeth struck, or that none did | none: a decision has no variance |
//! | friction | the largest kick per jump | the friction's |
//! | small impacts | kick and recoil of all that the vibrometer does not detect | chatter, launch, undetected |
//!
//! The period of a sample may have several impacts. The one with the largest jump is the one that the vibrometer
//! detects; the others count as small, as do the pushes of teeth in sustained contact and the hub's. Noises that
//! describe the model, such as those of gap and approach, stay.
//!
//! The other way round, the filter says what it has learnt of the motor, and what is true of it: [`learnt`].
//!
//! Both are for studies. Without the feature `tell` nothing can be told: the code that takes it in is left out,
//! and `untold.rs` takes the place of this module and answers what the filter asks, at no cost.

mod kick;
mod learnt;
mod period;

use motor_model::{Real, Time};

use super::TwinFilter;
pub(super) use kick::ToldKick;
pub use learnt::{LEARNT, LEARNT_NAMES, Learnt, LearntPhase, true_parts};
pub(super) use period::ToldPeriod;

/// Variance that is left to a kick of which all is told, in rad^2/s^2: 1e-5 rad/s, ten times what `f32` rounds, so
/// that no variance becomes zero.
const KICK_TOLD_RAD2_S2: f64 = 1e-10;

/// Which parts of the truth are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "a set")]
pub struct ToldParts {
    /// The rate to which the tooth of each impact would carry the rotor.
    pub tooth_velocity: bool,
    /// When each impact was within the period of its sample.
    pub instant: bool,
    /// The rotor's velocity before each impact, and its jump.
    pub jump: bool,
    /// Which pair of teeth struck, or that none did.
    pub pair: bool,
    /// The largest kick per jump.
    pub friction: bool,
    /// Kick and recoil of what the vibrometer does not detect.
    pub small_impacts: bool,
}

/// The tooth of a true contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueTooth<T> {
    /// The pair of teeth, 0 or 1.
    pub pair: u8,
    /// Rate to which it would carry the rotor if friction had no limit, in rad/s.
    pub rate_rad_s: T,
    /// Largest kick that friction allows per jump, in rad/s per m/s.
    pub kick_per_jump_rad_m: T,
}

/// What truly happened to the rotor at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueContact<T> {
    /// When.
    pub at: Time,
    /// The tooth that struck; `None` of whatever else changed the motion, as a sustained contact or the hub.
    pub tooth: Option<TrueTooth<T>>,
    /// Vertical velocity of the rotor before, in m/s.
    pub before_m_s: T,
    /// Jump of that velocity, in m/s.
    pub jump_m_s: T,
    /// Change of the rate, in rad/s.
    pub kick_rad_s: T,
}

impl<T: Real> TwinFilter<T> {
    /// The same filter before its first measurement, which is told these parts of the truth by [`Self::tell`].
    #[must_use]
    pub fn with_told(mut self, parts: ToldParts) -> Self {
        let (zero, tuning) = (T::zero(), &mut self.tuning);
        if parts.tooth_velocity {
            tuning.tooth_velocity_m_s = zero;
        }
        if parts.small_impacts {
            (tuning.chatter_rad2_s2, tuning.undetected_part2) = (T::from_f64(KICK_TOLD_RAD2_S2), zero);
        }
        self.told.parts = parts;
        self
    }

    /// Tells what truly happened: in the order of time, and before the first sample after it.
    pub fn tell(&mut self, contact: &TrueContact<T>) {
        self.told.tell(contact);
    }
}
