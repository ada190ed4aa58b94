//! The digest of a run: any bit of any state, impact or report changes it.
//!
//! Enumerations enter as numbers. Where the link has the same numbers ([`link::numbering`]), they are the link's. The
//! verdict on a frame and the phase of positioning have numbers of their own here, so that digests of earlier runs stay
//! valid. A new variant does not compile without a number. Only a reason to stop has none here: its number is its place
//! in the definition of [`controller::StopReason`].

use core::hash::Hasher;

use controller::{PositioningPhase as Positioning, TickReport};
use estimator::{Estimate, Innovation, Rejection, Verdict};
use fnv::FnvHasher;
use link::Numbered;
use motor_model::{DriveCommand, Impact, ModalState, MotorState, RotorState};

/// FNV-1a, 64 bits, of words taken least significant byte first on every machine.
///
/// Structs are destructured, so that this module does not compile when a field is missing here.
#[derive(Default)]
pub(super) struct Digest(FnvHasher);

impl Digest {
    pub(super) fn value(&self) -> u64 {
        self.0.finish()
    }

    fn word(&mut self, word: u64) {
        self.0.write(&word.to_le_bytes());
    }

    /// The link's number of a value.
    fn number(&mut self, value: impl Numbered) {
        self.word(value.number().into());
    }

    fn scalar(&mut self, value: f32) {
        self.0.write(&value.to_bits().to_le_bytes());
    }

    pub(super) fn state(&mut self, state: &MotorState<f32>) {
        let MotorState { steps, phase, modes, rotor, forcing, in_contact } = state;
        self.word(*steps);
        self.word(phase.units());
        self.modes(modes);
        self.rotor(rotor);
        // The gains of the forcing are private; they have an effect on the modes.
        self.word(forcing.increment().units());
        self.command(forcing.command());
        self.word(u64::from(in_contact[0]) | u64::from(in_contact[1]) << 1);
    }

    pub(super) fn report(&mut self, report: &TickReport) {
        let TickReport { estimate, health, camera, command, applied, phase } = report;
        self.word(u64::from(estimate.is_some()));
        if let Some(estimate) = estimate {
            self.estimate(estimate);
        }
        self.number(*health);
        self.word(u64::from(camera.is_some()));
        if let Some(innovation) = camera {
            self.innovation(innovation);
        }
        self.command(*command);
        self.command(*applied);
        let (phase, since_nanos) = match phase {
            // Which drive it is, the command shows.
            Positioning::Cruise { cruise: _, since, progress: _ } => (0, since.nanos()),
            // What it waits for follows from the estimates.
            Positioning::Settling(_) => (1, 0),
            Positioning::Holding => (2, 0),
            Positioning::Burst { family: _, burst: _, since } => (3, since.nanos()),
            // The reason is in the health of the report.
            Positioning::Waiting(_) => (4, 0),
            Positioning::Stopped(why) => (5, *why as u64),
            Positioning::Brake { mode: _, since } => (6, since.nanos()),
        };
        self.word(phase);
        self.word(since_nanos);
    }

    fn estimate(&mut self, estimate: &Estimate<f32>) {
        let Estimate { at, angle, rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2, resting } =
            estimate;
        self.word(at.nanos());
        self.word(angle.units().cast_unsigned());
        for value in [rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2] {
            self.scalar(*value);
        }
        self.word(u64::from(*resting));
    }

    fn innovation(&mut self, innovation: &Innovation<f32>) {
        let Innovation { source, taken_at, innovation_rad, variance_rad2, verdict } = innovation;
        self.number(*source);
        self.word(taken_at.nanos());
        self.scalar(*innovation_rad);
        self.scalar(*variance_rad2);
        self.word(match verdict {
            Verdict::Used => 0,
            Verdict::Restarted => 1,
            Verdict::Rejected(Rejection::Duplicate) => 2,
            Verdict::Rejected(Rejection::Gate) => 3,
            Verdict::Rejected(Rejection::Repeated) => 4,
            Verdict::Rejected(Rejection::OutOfHorizon) => 5,
            Verdict::Rejected(Rejection::Future) => 6,
            Verdict::Rejected(Rejection::Stuck) => 7,
        });
    }

    fn modes(&mut self, modes: &ModalState<f32>) {
        let ModalState { displacement_m, velocity_m_s } = modes;
        for &value in displacement_m.iter().chain(velocity_m_s) {
            self.scalar(value);
        }
    }

    fn rotor(&mut self, rotor: &RotorState<f32>) {
        let RotorState { height_m, velocity_m_s, angle, rate_rad_s } = rotor;
        self.scalar(*height_m);
        self.scalar(*velocity_m_s);
        self.word(angle.angle().units().cast_unsigned());
        self.scalar(angle.residual_units());
        self.scalar(*rate_rad_s);
    }

    fn command(&mut self, command: DriveCommand) {
        self.number(command.mode());
        self.scalar(command.amplitude());
        self.scalar(command.frequency_offset_hz());
    }

    pub(super) fn impact(&mut self, impact: &Impact<f32>) {
        let Impact {
            pair,
            before_end_s,
            approach_m_s,
            normal_impulse_n_s,
            slip_m_s,
            tangential_impulse_n_s,
            gap_m,
        } = impact;
        self.word(u64::from(*pair));
        for value in [before_end_s, approach_m_s, normal_impulse_n_s, slip_m_s, tangential_impulse_n_s, gap_m]
        {
            self.scalar(*value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::{Angle, AngleAccumulator, DriveMode, Motor, MotorParams, MotorSetup, Phase};

    /// A change of a value.
    type Change<'a, T> = dyn Fn(&mut T) + 'a;

    /// Each change changes the digest.
    fn assert_all_count<T: Copy>(value: &T, digest: fn(&mut Digest, &T), changes: &[&Change<'_, T>]) {
        let of = |change: &Change<'_, T>| {
            let (mut changed, mut sum) = (*value, Digest::default());
            change(&mut changed);
            digest(&mut sum, &changed);
            sum.value()
        };
        let same = of(&|_| ());
        for (index, change) in changes.iter().enumerate() {
            assert_ne!(of(change), same, "change {index}");
        }
    }

    /// The lowest bit of each number of a state and of an impact reaches the digest.
    #[test]
    fn exact_every_bit_counts() {
        fn up(value: &mut f32) {
            *value = value.next_up();
        }
        let params = MotorParams::nominal();
        let motor = Motor::<f32>::try_new(&params, &MotorSetup::with_step(10e-6)).unwrap();
        let mut state = MotorState::default();
        for _ in 0..1000 {
            motor.step(&mut state, DriveCommand::full(DriveMode::B));
        }
        let other_drive = |command| motor.modes().forcing(command);
        let b = DriveMode::B;
        let changes: [&Change<'_, MotorState<f32>>; 17] = [
            &|s| s.in_contact[0] = !s.in_contact[0],
            &|s| s.in_contact[1] = !s.in_contact[1],
            &|s| s.steps += 1,
            &|s| s.phase = s.phase.advanced(Phase::from_units(1)),
            &|s| up(&mut s.modes.displacement_m.x),
            &|s| up(&mut s.modes.displacement_m.y),
            &|s| up(&mut s.modes.displacement_m.z),
            &|s| up(&mut s.modes.velocity_m_s.x),
            &|s| up(&mut s.modes.velocity_m_s.y),
            &|s| up(&mut s.modes.velocity_m_s.z),
            &|s| up(&mut s.rotor.height_m),
            &|s| up(&mut s.rotor.velocity_m_s),
            &|s| up(&mut s.rotor.rate_rad_s),
            &|s| {
                let angle = s.rotor.angle.angle().plus(Angle::from_units(1));
                s.rotor.angle = AngleAccumulator::at(angle);
            },
            &|s| s.forcing = other_drive(DriveCommand::full(DriveMode::C)),
            &|s| s.forcing = other_drive(DriveCommand::try_new(b, 0.9_f32.next_up()).unwrap()),
            &|s| {
                let command = DriveCommand::try_new(b, 0.9).unwrap();
                s.forcing = other_drive(command.with_frequency_offset(f32::from_bits(1)).unwrap());
            },
        ];
        assert_all_count(&state, Digest::state, &changes);

        let impact = Impact {
            pair: 0,
            before_end_s: 1e-6,
            approach_m_s: 0.1,
            normal_impulse_n_s: 1e-6,
            slip_m_s: 0.2,
            tangential_impulse_n_s: 1e-7,
            gap_m: -1e-7,
        };
        let changes: [&Change<'_, Impact<f32>>; 7] = [
            &|i| i.pair = 1,
            &|i| up(&mut i.before_end_s),
            &|i| up(&mut i.approach_m_s),
            &|i| up(&mut i.normal_impulse_n_s),
            &|i| up(&mut i.slip_m_s),
            &|i| up(&mut i.tangential_impulse_n_s),
            &|i| up(&mut i.gap_m),
        ];
        assert_all_count(&impact, Digest::impact, &changes);
    }
}
