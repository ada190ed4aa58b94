//! The families of bursts, and values of which each family has one.

use motor_model::DriveMode;

/// Bursts of one mode that differ in amplitude or in length only, ordered by their turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Mode C, two cycles, the amplitude differs.
    Step,
    /// Mode C, amplitude 0.3, the length differs.
    Walk,
    /// Mode C, full, the length differs.
    Stride,
    /// Mode B, one cycle, the amplitude differs.
    Nudge,
    /// Mode B, full, the length differs.
    Throw,
}

impl Family {
    /// Every family, in the order of their discriminants.
    pub const ALL: [Self; 5] = [Self::Step, Self::Walk, Self::Stride, Self::Nudge, Self::Throw];

    /// Its name in a map's file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Walk => "walk",
            Self::Stride => "stride",
            Self::Nudge => "nudge",
            Self::Throw => "throw",
        }
    }

    /// The mode that its bursts drive.
    pub const fn mode(self) -> DriveMode {
        match self {
            Self::Step | Self::Walk | Self::Stride => DriveMode::C,
            Self::Nudge | Self::Throw => DriveMode::B,
        }
    }
}

/// A value for each family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PerFamily<T> {
    /// In the order of [`Family::ALL`].
    values: [T; Family::ALL.len()],
}

impl<T> PerFamily<T> {
    /// The values in the order of [`Family::ALL`].
    pub(crate) const fn of(values: [T; Family::ALL.len()]) -> Self {
        Self { values }
    }

    /// The value of `family`.
    pub(crate) const fn get(&self, family: Family) -> &T {
        let [step, walk, stride, nudge, throw] = &self.values;
        match family {
            Family::Step => step,
            Family::Walk => walk,
            Family::Stride => stride,
            Family::Nudge => nudge,
            Family::Throw => throw,
        }
    }

    /// The value of `family`, to change it.
    pub(crate) const fn get_mut(&mut self, family: Family) -> &mut T {
        let [step, walk, stride, nudge, throw] = &mut self.values;
        match family {
            Family::Step => step,
            Family::Walk => walk,
            Family::Stride => stride,
            Family::Nudge => nudge,
            Family::Throw => throw,
        }
    }
}
