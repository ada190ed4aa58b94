//! The twin alone: both modes, full and partial drive, frequency offsets, changes of command, the drive off until the
//! rotor is at rest, and both friction laws.

use core::fmt;

use motor_model::{
    DriveCommand, DriveMode, FrictionLaw, ImpactRule, Impacts, Motor, MotorParams, MotorSetup, MotorState,
    OutOfBounds,
};

use super::digest::Digest;

/// The twin's step in s.
const STEP_S: f64 = 10e-6;

/// Result of the run. Its text is that of the program: one `key value` a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TwinRun {
    /// The rule by which impacts are found.
    pub rule: ImpactRule,
    /// FNV-1a, 64 bits, over the bits of all states and impacts.
    pub digest: u64,
    /// Steps taken.
    pub steps: u64,
    /// Number of impacts.
    pub impacts: u32,
    /// The rotor's angle at the end, in units of 2^-32 turn.
    pub angle_units: i64,
}

impl fmt::Display for TwinRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rule, digest, steps, impacts, angle_units } = self;
        let name = match rule {
            ImpactRule::EndOfStep => "twin",
            ImpactRule::Located => "located_twin",
        };
        writeln!(f, "{name}_digest {digest:#018x}")?;
        writeln!(f, "{name}_steps {steps}")?;
        writeln!(f, "{name}_impacts {impacts}")?;
        write!(f, "{name}_angle_units {angle_units}")
    }
}

impl TwinRun {
    /// Steps of the run.
    pub const STEPS: u32 = 10_000;

    /// Runs the twin under one rule and digests it.
    ///
    /// # Errors
    /// When the model refuses the nominal motor or a command of the schedule: never, unless their bounds are changed.
    pub fn compute(rule: ImpactRule) -> Result<Self, OutOfBounds> {
        let mut digest = Digest::default();
        let mut impact_count = 0;
        let end = run_schedule(rule, |state, impacts| {
            digest.state(state);
            for impact in impacts {
                digest.impact(impact);
                impact_count += 1;
            }
        })?;
        Ok(Self {
            rule,
            digest: digest.value(),
            steps: end.steps,
            impacts: impact_count,
            angle_units: end.rotor.angle.angle().units(),
        })
    }
}

/// A segment of the schedule: one command and one friction law.
struct Segment {
    steps: u32,
    command: DriveCommand,
    friction_law: FrictionLaw,
}

/// Drives the twin through the schedule. `observe` gets each state and the impacts of its step; the result is the last
/// state.
fn run_schedule(
    rule: ImpactRule,
    mut observe: impl FnMut(&MotorState<f32>, &Impacts<f32>),
) -> Result<MotorState<f32>, OutOfBounds> {
    let params = MotorParams::nominal();
    let coulomb = MotorSetup { impact_rule: rule, ..MotorSetup::with_step(STEP_S) };
    let paper = MotorSetup { friction_law: FrictionLaw::Paper, ..coulomb };
    let coulomb = Motor::<f32>::try_new(&params, &coulomb)?;
    let paper = Motor::<f32>::try_new(&params, &paper)?;

    let mut state = MotorState::default();
    for segment in schedule()? {
        let motor = match segment.friction_law {
            FrictionLaw::Coulomb => &coulomb,
            FrictionLaw::Paper => &paper,
        };
        for _ in 0..segment.steps {
            let impacts = motor.step(&mut state, segment.command);
            observe(&state, &impacts);
        }
    }
    Ok(state)
}

/// Commands and friction laws of the run, of [`TwinRun::STEPS`] steps in all.
fn schedule() -> Result<[Segment; 8], OutOfBounds> {
    use DriveMode::{B, C};
    use FrictionLaw::{Coulomb, Paper};

    let segment = |steps, command, friction_law| Segment { steps, command, friction_law };
    let off = DriveCommand::OFF;
    Ok([
        segment(2500, DriveCommand::full(B), Coulomb),
        segment(2000, off, Coulomb),
        segment(1500, DriveCommand::try_new(C, 0.3)?.with_frequency_offset(7.5)?, Coulomb),
        segment(500, DriveCommand::full(C), Coulomb),
        segment(1000, DriveCommand::try_new(B, 0.55)?.with_frequency_offset(-31.25)?, Paper),
        segment(1000, DriveCommand::full(C), Paper),
        segment(1000, off, Paper),
        segment(500, DriveCommand::try_new(B, 0.9)?, Coulomb),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::Parameter;

    #[test]
    fn exact_the_schedule_has_the_steps_it_says() {
        let segments = schedule().unwrap();
        assert_eq!(segments.iter().map(|segment| segment.steps).sum::<u32>(), TwinRun::STEPS);
        for rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
            assert_eq!(TwinRun::compute(rule).unwrap().steps, u64::from(TwinRun::STEPS));
        }
    }

    /// Equal digests prove nothing about code that the run does not execute.
    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "rounded as the model rounds it")]
    fn law_the_run_executes_all_that_the_twin_can_do() {
        let friction = MotorParams::nominal().get(Parameter::Friction) as f32;
        let mut impacts_of_pair = [0; 2];
        let (mut slid, mut stuck, mut double) = (0, 0, 0);
        let (mut fastest, mut slowest) = (0.0_f32, 0.0_f32);
        let mut resting = [0; 2];
        run_schedule(ImpactRule::EndOfStep, |state, impacts| {
            for impact in impacts {
                impacts_of_pair[usize::from(impact.pair)] += 1;
                if impact.tangential_impulse_n_s.abs() < 0.999 * friction * impact.normal_impulse_n_s {
                    stuck += 1;
                } else {
                    slid += 1;
                }
            }
            double += usize::from(impacts.len() == 2);
            fastest = fastest.max(state.rotor.rate_rad_s);
            slowest = slowest.min(state.rotor.rate_rad_s);
            let still = state.rotor.height_m.abs() < 1e-6 && state.rotor.velocity_m_s.abs() < 1e-3;
            if still && state.forcing.command() == DriveCommand::OFF {
                resting[usize::from(state.steps > 5000)] += 1;
            }
        })
        .unwrap();
        assert!(impacts_of_pair.iter().all(|&n| n > 100), "{impacts_of_pair:?}");
        assert!(slid > 100 && stuck > 100 && double > 20, "{slid} {stuck} {double}");
        assert!(fastest > 5.0 && slowest < -1.0, "{fastest} {slowest}");
        assert!(resting.iter().all(|&steps| steps > 200), "{resting:?}");
    }

    /// Impacts inside the step, several in one step, and sustained contact of one pair of teeth and of both.
    #[test]
    fn law_the_located_run_executes_all_that_it_can_do() {
        let (mut inside, mut several) = (0, 0);
        let (mut one_in_contact, mut both_in_contact) = (0, 0);
        run_schedule(ImpactRule::Located, |state, impacts| {
            inside += impacts.iter().filter(|impact| impact.before_end_s > 0.0).count();
            several += usize::from(impacts.len() > 1);
            match state.in_contact {
                [true, true] => both_in_contact += 1,
                [false, false] => {}
                _ => one_in_contact += 1,
            }
        })
        .unwrap();
        assert!(inside > 100 && several > 10, "{inside} {several}");
        assert!(one_in_contact > 20 && both_in_contact > 200, "{one_in_contact} {both_in_contact}");
    }
}
