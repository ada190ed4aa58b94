//! One contact of the rotor with a tooth, the pin, a floor or a ceiling: its directions and what acts along them.
//!
//! A *direction* says with what speed the contact's surfaces part, per motion of rotor and stator:
//!
//! ```text
//! w = r . (rotor's motion) - s . (modal velocities)
//! ```
//!
//! An impulse P along it moves the rotor by `M^-1 r P` and the modes by `-M^-1 s P`, so that work and momentum agree.
//! The *compliance* is the change of `w` per impulse, `r . M^-1 r + s . M^-1 s`.

use nalgebra::{Vector2, Vector3};

use super::rigid_body::{RotorMobility, Twist};
use crate::math::Real;

/// Where the rotor can meet something else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactPlace {
    /// A tooth, 0 to 3, counter-clockwise; 0 and 2 are the first pair.
    Tooth(u8),
    /// The upper edge of the rotor's hole, at the pin.
    UpperEdge,
    /// The lower edge of the rotor's hole, at the pin.
    LowerEdge,
    /// The rotor's outer rim, at a floor.
    Rim,
    /// The rotor's upper side, at a ceiling.
    Ceiling,
}

/// Number of places.
pub(super) const PLACES: usize = 8;

impl ContactPlace {
    /// Every place, in the order in which sets of contacts count them.
    pub const ALL: [Self; PLACES] = [
        Self::Tooth(0),
        Self::Tooth(1),
        Self::Tooth(2),
        Self::Tooth(3),
        Self::UpperEdge,
        Self::LowerEdge,
        Self::Rim,
        Self::Ceiling,
    ];

    /// Whether it is an edge of the hole.
    pub const fn is_hub(self) -> bool {
        matches!(self, Self::UpperEdge | Self::LowerEdge)
    }

    /// Whether it is a tooth.
    pub const fn is_tooth(self) -> bool {
        matches!(self, Self::Tooth(_))
    }

    /// Its number among [`Self::ALL`].
    pub const fn index(self) -> u8 {
        match self {
            Self::Tooth(tooth) => tooth & 3,
            Self::UpperEdge => 4,
            Self::LowerEdge => 5,
            Self::Rim => 6,
            Self::Ceiling => 7,
        }
    }
}

/// A set of places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactPlaces(u8);

impl ContactPlaces {
    /// No place.
    pub const NONE: Self = Self(0);

    /// Whether it holds no place.
    #[inline]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether it holds `place`.
    #[inline]
    pub const fn contains(self, place: ContactPlace) -> bool {
        self.0 & (1 << place.index()) != 0
    }

    /// This set and `place`.
    #[inline]
    #[must_use]
    pub const fn with(self, place: ContactPlace) -> Self {
        Self(self.0 | (1 << place.index()))
    }

    /// This set and `others`.
    #[must_use]
    pub(super) const fn and(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Those of the hub.
    #[must_use]
    pub(super) const fn at_hub(self) -> Self {
        Self(self.0 & (1 << ContactPlace::UpperEdge.index() | 1 << ContactPlace::LowerEdge.index()))
    }

    /// Whether it holds an edge of the hole, and nothing else.
    #[inline]
    pub(super) const fn is_at_pin(self) -> bool {
        self.0 != 0
            && self.0 & !(1 << ContactPlace::UpperEdge.index() | 1 << ContactPlace::LowerEdge.index()) == 0
    }

    /// How many places it holds.
    pub const fn len(self) -> u32 {
        self.0.count_ones()
    }
}

/// Velocities of rotor and stator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Velocities<T> {
    pub(super) rotor: Twist<T>,
    pub(super) modes: Vector3<T>,
    pub(super) stator_tilt: Vector2<T>,
}

impl<T: Real> Velocities<T> {
    /// No motion.
    pub(super) fn zero() -> Self {
        Self { rotor: Twist::zero(), modes: Vector3::zeros(), stator_tilt: Vector2::zeros() }
    }
}

/// Motion per impulse of rotor and stator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mobility<T> {
    pub(super) rotor: RotorMobility<T>,
    /// `1 / M_n` of modes A, B and C.
    pub(super) modes: Vector3<T>,
    /// `1 / M_T`; 0 where tilt is left out.
    pub(super) stator_tilt: T,
}

/// A direction along which an impulse acts between rotor and stator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction<T> {
    rotor: Twist<T>,
    modes: Vector3<T>,
    stator_tilt: Vector2<T>,
    /// Change of the speed along it per impulse.
    pub(super) compliance: T,
    /// Whether the surface moves with the stator.
    moving: bool,
    /// Whether the impulse acts on the stator too.
    on_stator: bool,
}

impl<T: Real> Direction<T> {
    /// Against a tooth that moves with the modes.
    #[inline]
    pub(super) fn at_tooth(
        rotor: Twist<T>,
        modes: Vector3<T>,
        stator_tilt: Vector2<T>,
        mobility: &Mobility<T>,
    ) -> Self {
        let compliance = rotor.dot(&mobility.rotor.response(&rotor))
            + modes.dot(&modes.component_mul(&mobility.modes))
            + stator_tilt.dot(&stator_tilt) * mobility.stator_tilt;
        Self { rotor, modes, stator_tilt, compliance, moving: true, on_stator: true }
    }

    /// Against a tooth, without reaction on the stator.
    #[inline]
    pub(super) fn along_tooth(
        rotor: Twist<T>,
        modes: Vector3<T>,
        stator_tilt: Vector2<T>,
        mobility: &Mobility<T>,
    ) -> Self {
        let compliance = rotor.dot(&mobility.rotor.response(&rotor));
        Self { rotor, modes, stator_tilt, compliance, moving: true, on_stator: false }
    }

    /// Against something fixed.
    #[inline]
    pub(super) fn at_rest(rotor: Twist<T>, mobility: &Mobility<T>) -> Self {
        let still = Self::along_tooth(rotor, Vector3::zeros(), Vector2::zeros(), mobility);
        Self { moving: false, ..still }
    }

    /// The same without the shift.
    pub(super) fn without_shift(mut self) -> Self {
        self.rotor.shift = Vector2::zeros();
        self
    }

    /// Speed along it, `w`.
    #[inline]
    pub(super) fn speed(&self, velocities: &Velocities<T>) -> T {
        let speed = self.rotor_speed(&velocities.rotor);
        if self.moving { speed - self.surface_speed(velocities) } else { speed }
    }

    /// The rotor's part of it, for a rotor that moves with `motion`.
    #[inline]
    pub(super) fn rotor_speed(&self, motion: &Twist<T>) -> T {
        self.rotor.dot(motion)
    }

    /// Speed of the stator's surface along it.
    #[inline]
    pub(super) fn surface_speed(&self, velocities: &Velocities<T>) -> T {
        self.modes.dot(&velocities.modes) + self.stator_tilt.dot(&velocities.stator_tilt)
    }

    /// Applies an impulse.
    #[inline]
    pub(super) fn push(&self, impulse: T, mobility: &Mobility<T>, velocities: &mut Velocities<T>) {
        self.push_rotor(impulse, mobility, &mut velocities.rotor);
        if self.on_stator {
            velocities.modes -= self.modes.component_mul(&mobility.modes) * impulse;
            velocities.stator_tilt -= self.stator_tilt * (mobility.stator_tilt * impulse);
        }
    }

    /// What an impulse does to the rotor.
    #[inline]
    pub(super) fn push_rotor(&self, impulse: T, mobility: &Mobility<T>, rotor: &mut Twist<T>) {
        let by = mobility.rotor.response(&self.rotor);
        rotor.rise += by.rise * impulse;
        rotor.turn += by.turn * impulse;
        rotor.shift += by.shift * impulse;
        rotor.slope += by.slope * impulse;
    }

    /// Change of the speed along `self` per impulse along `other`.
    #[inline]
    pub(super) fn coupling(&self, other: &Self, mobility: &Mobility<T>) -> T {
        let on_rotor = self.coupling_on_rotor(other, mobility);
        if !(self.on_stator && other.on_stator) {
            return on_rotor;
        }
        on_rotor
            + self.modes.dot(&other.modes.component_mul(&mobility.modes))
            + self.stator_tilt.dot(&other.stator_tilt) * mobility.stator_tilt
    }

    /// The same by the rotor's motion alone.
    #[inline]
    pub(super) fn coupling_on_rotor(&self, other: &Self, mobility: &Mobility<T>) -> T {
        self.rotor.dot(&mobility.rotor.response(&other.rotor))
    }
}

/// A closed contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact<T> {
    pub(super) place: ContactPlace,
    /// Along which the gap opens.
    pub(super) normal: Direction<T>,
    /// Along the surface: at a tooth clockwise and outward, at the pin counter-clockwise and up.
    pub(super) along: [Direction<T>; 2],
    /// Largest tangential impulse per normal impulse.
    pub(super) friction: T,
    pub(super) restitution: T,
    pub(super) gap_m: T,
}
