//! The true motion as kicks: changes of the rate, each over a span of time, which add up to the whole motion.

use motor_model::{Angle, Time};

use simulation::world::rotor_path::RotorPoint;

/// What a span of time changed of the motion. Without a kick the rotor turns on at the rate that it had.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kick {
    /// The end of the span.
    pub until: Time,
    /// Its length in s.
    pub span_s: f64,
    /// Angle turned beyond `rate * span`, in rad, with the rate at the start.
    pub angle_rad: f64,
    /// Change of the rate, in rad/s.
    pub rate_rad_s: f64,
    /// Whether teeth touched the rotor: otherwise the change is air drag, which is known.
    pub contact: bool,
}

/// The true motion at an instant.
#[derive(Clone, Copy, Debug)]
pub struct TrueMotion {
    pub at: Time,
    pub angle: Angle,
    pub rate_rad_s: f64,
}

impl TrueMotion {
    pub fn of(rotor: &RotorPoint) -> Self {
        Self { at: rotor.at, angle: rotor.angle, rate_rad_s: rotor.rate_rad_s }
    }

    fn kick_since(&self, before: &Self, contact: bool) -> Kick {
        let span_s: f64 = self.at.seconds_since(before.at);
        Kick {
            until: self.at,
            span_s,
            angle_rad: self.angle.minus(before.angle).radians_since::<f64>(Angle::ZERO)
                - before.rate_rad_s * span_s,
            rate_rad_s: self.rate_rad_s - before.rate_rad_s,
            contact,
        }
    }
}

/// Divides the motion into kicks: one for every step in which teeth changed the rate, one for all steps between two of
/// those.
#[derive(Clone, Debug, Default)]
pub struct FreeMotion {
    /// Where the steps began in which teeth change nothing.
    free_since: Option<TrueMotion>,
}

impl FreeMotion {
    pub fn step(
        &mut self,
        before: &TrueMotion,
        after: &TrueMotion,
        touched: bool,
        mut emit: impl FnMut(Kick),
    ) {
        let changed = before.rate_rad_s.to_bits() != after.rate_rad_s.to_bits();
        if touched && changed {
            self.close(before, &mut emit);
            emit(after.kick_since(before, true));
        } else if self.free_since.is_none() {
            self.free_since = Some(*before);
        }
    }

    /// Ends the steps in which teeth changed nothing at `now`.
    pub fn close(&mut self, now: &TrueMotion, mut emit: impl FnMut(Kick)) {
        if let Some(since) = self.free_since.take() {
            emit(now.kick_since(&since, false));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kicks add up to the motion, and only those of contact are marked so.
    #[test]
    fn law_the_kicks_are_the_whole_motion() {
        // The last change but one is air drag.
        let rates = [1.0, 1.0, 3.0, 2.5, 2.4, 2.0];
        let touched = [false, true, true, false, true];
        let mut angle_units = 0;
        let instants: Vec<TrueMotion> = (0_u32..)
            .zip(rates)
            .map(|(n, rate_rad_s)| {
                angle_units += i64::from(n) * 1000;
                let at = Time::from_micros(u64::from(n));
                TrueMotion { at, angle: Angle::from_units(angle_units), rate_rad_s }
            })
            .collect();
        let (mut free_motion, mut kicks) = (FreeMotion::default(), Vec::new());
        for (pair, touched) in instants.windows(2).zip(touched) {
            free_motion.step(&pair[0], &pair[1], touched, |kick| kicks.push(kick));
        }
        free_motion.close(&instants[5], |kick| kicks.push(kick));
        let contacts: Vec<bool> = kicks.iter().map(|kick| kick.contact).collect();
        assert_eq!(contacts, [false, true, true, false, true]);
        let (mut angle_rad, mut rate) = (0.0, 1.0);
        for kick in &kicks {
            angle_rad += rate * kick.span_s + kick.angle_rad;
            rate += kick.rate_rad_s;
        }
        assert!((rate - 2.0).abs() < 1e-12);
        let expected: f64 = instants[5].angle.minus(instants[0].angle).radians_since(Angle::ZERO);
        assert!((angle_rad - expected).abs() < 1e-12);
    }
}
