//! The drives of a map: cruises and bursts, and what the rotor does under each.

use core::f32::consts::PI;

use motor_model::{DriveCommand, DriveMode};

/// A drive that stays on until it is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cruise {
    /// The mode, which sets the direction.
    pub mode: DriveMode,
    /// Drive amplitude, 0 to 1.
    pub amplitude: f32,
    /// Mean rate over motors, in rad/s.
    pub rate_rad_s: f32,
    /// Standard deviation of the rate over motors, in rad/s.
    pub rate_sd_rad_s: f32,
    /// Coast per rate at the cut, in s.
    pub coast_s: f32,
    /// Standard deviation of the coast about that, in rad.
    pub coast_sd_rad: f32,
}

impl Cruise {
    /// A weaker cruise follows when the coast and a standard deviation of it are this part of what remains. An
    /// assumption.
    const COAST_PART: f32 = 0.6;

    /// Distance in rad below which a weaker cruise ends nearer to the target.
    pub fn room_rad(&self) -> f32 {
        (direction(self.mode) * self.rate_rad_s * self.coast_s + self.coast_sd_rad) / Self::COAST_PART
    }

    /// Whether nearly every motor turns under it: the mean rate is more than two standard deviations over motors.
    pub fn turns_every_motor(&self) -> bool {
        2.0 * self.rate_sd_rad_s < direction(self.mode) * self.rate_rad_s
    }
}

/// A burst from rest to rest, and the turn that it makes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    /// Drive amplitude, 0 to 1.
    pub amplitude: f32,
    /// Ticks of the loop for which the drive is on.
    pub ticks: u32,
    /// Magnitude of the mean turn over motors, in rad; the family's mode gives the sign.
    pub turn_rad: f32,
    /// Standard deviation over motors of a motor's mean turn, in rad.
    pub motors_sd_rad: f32,
    /// Standard deviation from burst to burst of one motor, in rad.
    pub repeat_sd_rad: f32,
}

impl Burst {
    /// Its time in s.
    #[expect(clippy::cast_precision_loss, reason = "at most some 10,000 ticks")]
    pub(crate) fn seconds(&self) -> f32 {
        1e-9 * self.ticks as f32 * crate::TICK_NANOS as f32
    }

    /// Its time in ns.
    pub(crate) fn nanos(&self) -> u64 {
        u64::from(self.ticks) * crate::TICK_NANOS
    }

    /// The burst `part` of the way to `other`, 0 to 1, with a whole number of ticks and the turn of those.
    pub(super) fn towards(&self, other: &Self, part: f32) -> Self {
        let between = |from: f32, to: f32, part: f32| from + (to - from) * part;
        let more = other.ticks.saturating_sub(self.ticks);
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most some 10,000 ticks, and not negative"
        )]
        let (added, part) = if more == 0 {
            (0, part)
        } else {
            let added = (part * more as f32 + 0.5) as u32;
            (added, added as f32 / more as f32)
        };
        Self {
            amplitude: between(self.amplitude, other.amplitude, part),
            ticks: self.ticks + added,
            turn_rad: between(self.turn_rad, other.turn_rad, part),
            motors_sd_rad: between(self.motors_sd_rad, other.motors_sd_rad, part),
            repeat_sd_rad: between(self.repeat_sd_rad, other.repeat_sd_rad, part),
        }
    }

    /// The command that drives it in `mode`.
    pub fn command(&self, mode: DriveMode) -> DriveCommand {
        DriveCommand::saturating(mode, self.amplitude)
    }
}

/// +1 for the clockwise mode, -1 for the other.
pub const fn direction(mode: DriveMode) -> f32 {
    match mode {
        DriveMode::B => 1.0,
        DriveMode::C => -1.0,
    }
}

/// A milli-degree in rad.
pub const RAD_PER_MDEG: f32 = PI / 180e3;

pub(super) const fn burst(
    amplitude: f32,
    ticks: u32,
    turn_mdeg: f32,
    motors_mdeg: f32,
    repeat_mdeg: f32,
) -> Burst {
    Burst {
        amplitude,
        ticks,
        turn_rad: turn_mdeg * RAD_PER_MDEG,
        motors_sd_rad: motors_mdeg * RAD_PER_MDEG,
        repeat_sd_rad: repeat_mdeg * RAD_PER_MDEG,
    }
}

pub(super) const fn cruise(
    (mode, amplitude): (DriveMode, f32),
    (rate_rad_s, rate_sd_rad_s): (f32, f32),
    (coast_s, coast_sd_mdeg): (f32, f32),
) -> Cruise {
    let coast_sd_rad = coast_sd_mdeg * RAD_PER_MDEG;
    Cruise { mode, amplitude, rate_rad_s, rate_sd_rad_s, coast_s, coast_sd_rad }
}
