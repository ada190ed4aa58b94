//! Interrupts of the board that come late.
//!
//! ```text
//! tick k of a program's time:  k T            what the program takes the time for
//! its command:                 k T + late_k   when it begins to act
//! its samples:                 the same, where the interrupt takes them; on time, where a timer does
//! ```
//!
//! What is late is a whole number of steps of the plant, 0 up to the bound, any as likely, drawn for each tick.

use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;

use crate::math::plain_number::plain;
use crate::math::random_streams::{self, RandomSource};
use crate::scene::{Scene, SceneError};

/// The bound of a scene.
pub(super) const KEY: &str = "board.interrupt_late_s";

/// By how much interrupts are late.
#[derive(Clone, Debug)]
pub struct LateInterrupts {
    takes_samples: bool,
    law: Uniform<u64>,
    draws: Pcg64,
}

impl LateInterrupts {
    /// Those of a scene; `None` of a board whose interrupts are on time.
    ///
    /// # Errors
    /// When the bound is less than a step of the plant.
    pub fn of(scene: &Scene) -> Result<Option<Self>, SceneError> {
        let (bound_s, step_s) = (scene.number(KEY), scene.number("plant.step_s"));
        let takes_samples = scene.choice("board.sampling") == "interrupt";
        if bound_s <= 0.0 {
            return Ok(None);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 400")]
        let most = (bound_s / step_s * (1.0 + 1e-9)) as u64;
        if most == 0 {
            return Err(SceneError::Conflict {
                conflict: format!(
                    "{KEY} = {} s is less than a step of the plant, plant.step_s = {} s",
                    plain(bound_s),
                    plain(step_s)
                ),
                hint: "plant.step_s=1e-6".to_owned(),
            });
        }
        let draws = random_streams::stream(scene.noise_seed(), RandomSource::LateInterrupts);
        Ok(Uniform::new_inclusive(0, most).ok().map(|law| Self { takes_samples, law, draws }))
    }

    /// Whether they take the vibrometer's samples.
    pub fn takes_samples(&self) -> bool {
        self.takes_samples
    }

    /// Steps of the plant by which the interrupt of the next tick is late.
    pub fn draw(&mut self) -> u64 {
        self.law.sample(&mut self.draws)
    }
}

#[cfg(test)]
mod tests {
    use controller::{Drive as _, Sense as _};
    use motor_model::{Angle, DriveCommand, DriveMode, Time};

    use super::*;
    use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};

    fn late(sets: &[&str]) -> Result<Option<LateInterrupts>, SceneError> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        LateInterrupts::of(&Scene::of_sets(&sets).unwrap())
    }

    #[test]
    fn exact_a_bound_below_a_step_is_refused_and_none_is_none() {
        assert!(late(&[]).unwrap().is_none());
        let refused = late(&["board.interrupt_late_s=4e-6", "plant.step_s=5e-6"]).unwrap_err().one_line();
        let expected = "error: board.interrupt_late_s = 4e-6 s is less than a step of the plant, plant.step_s = \
                        5e-6 s; hint: plant.step_s=1e-6";
        assert_eq!(refused, expected);
    }

    /// 0 to 4 steps of 1 us: a fifth of 10,000 draws each, within four standard deviations, 160; 0 to 3 of 3.9 us.
    #[test]
    fn law_every_step_up_to_the_bound_is_as_likely() {
        for (bound, values) in [("4e-6", 5), ("3.9e-6", 4)] {
            let mut late = late(&[&format!("board.interrupt_late_s={bound}")]).unwrap().unwrap();
            let mut counts = vec![0_usize; values];
            (0..10_000).for_each(|_| counts[usize::try_from(late.draw()).unwrap()] += 1);
            assert!(counts.iter().all(|count| count.abs_diff(10_000 / values) < 180), "{counts:?}");
        }
    }

    /// Drives at once, and tells the time that it is given, the plant's, and the stamps of the samples.
    struct Driving;

    impl TickProgram for Driving {
        type Report = (Time, Time, Angle, Vec<Time>);

        fn tick(&mut self, now: Time, ports: &mut RigPorts) -> Self::Report {
            ports.drive(DriveCommand::full(DriveMode::B));
            let stamps = std::iter::from_fn(|| ports.ldv_sample()).map(|sample| sample.taken_at).collect();
            (now, ports.plant().now(), ports.plant().rotor().angle, stamps)
        }
    }

    /// Times and stamps are those of the ticks. The plant has run on by 0 to 4 us, and the truth is that of the tick.
    #[test]
    fn exact_a_program_takes_late_ticks_for_those_on_time() {
        for (bound, sampling, most_nanos) in
            [("0", "interrupt", 0), ("4e-6", "timer", 4_000), ("4e-6", "interrupt", 4_000)]
        {
            let sets = [format!("board.interrupt_late_s={bound}"), format!("board.sampling={sampling}")];
            let scene = Scene::of_sets(&sets).unwrap();
            let mut driver = TickDriver::new(&scene, Driving)
                .unwrap()
                .with_interrupts(LateInterrupts::of(&scene).unwrap());
            let mut seen = [false; 5];
            for tick in 1..=20_000 {
                let moment = driver.next_tick();
                let at = Time::from_micros(10 * tick);
                let (now, plant_at, plant_angle, stamps) = moment.report;
                assert_eq!((now, moment.at), (at, at));
                assert_eq!(stamps, [Time::from_micros(10 * tick - 5), at]);
                let late_nanos = plant_at.nanos_since(at);
                assert!(late_nanos <= most_nanos, "{tick}: {late_nanos}");
                seen[usize::try_from(late_nanos / 1000).unwrap()] = true;
                let turns = tick > 10_000 && moment.rate_rad_s > 1.0 && late_nanos > 0;
                assert!(!turns || plant_angle != moment.angle, "{tick}");
            }
            assert_eq!(seen.iter().filter(|seen| **seen).count(), if bound == "0" { 1 } else { 5 });
        }
    }
}
