//! The filter that hears impacts against the one that does not, on motors that neither knows: ten drawn plants in steady motion, and then at rest.

use estimator::{AngleFilter, ConstantRate, ConstantRateTuning, ImpactAided, ImpactAidedTuning, Verdict};
use host_sim::Scene;
use host_sim::instruments::{Camera, Ldv};
use host_sim::plant::Plant;
use motor_model::{DriveCommand, DriveMode, MotorParams};

/// Others than those from which the filter's shares of unexplained kick come.
const SEEDS: std::ops::RangeInclusive<u64> = 101..=110;

/// Plant, instruments and both filters, which see the same.
struct Bench {
    plant: Plant,
    camera: Camera,
    ldv: Ldv,
    plain: ConstantRate<f32>,
    aided: ImpactAided<f32>,
}

/// Sums over a span of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    plain_mdeg2: f64,
    aided_mdeg2: f64,
    /// Normalised error squared of the aided angle.
    aided_nees: f64,
    count: f64,
    aided_nis: f64,
    frames: f64,
}

impl Sums {
    fn rms_mdeg(&self) -> [f64; 2] {
        [self.plain_mdeg2, self.aided_mdeg2].map(|sum| (sum / self.count).sqrt())
    }
}

impl Bench {
    fn new(seed: u64) -> Self {
        let mut scene = Scene::default();
        scene.set("seed", &seed.to_string()).unwrap();
        Self {
            plant: Plant::draw(&scene).unwrap(),
            camera: Camera::new(&scene, 100_000),
            ldv: Ldv::new(&scene),
            plain: ConstantRate::new(&ConstantRateTuning::default()),
            aided: ImpactAided::new(&ImpactAidedTuning::new(&MotorParams::nominal())),
        }
    }

    /// Runs for `micros` under `command`, and adds up the errors at the end of every 10 us.
    fn run(&mut self, command: DriveCommand, micros: u64, sums: &mut Sums) {
        let now = self.plant.now();
        self.plain.drive(now, command);
        self.aided.drive(now, command);
        for n in 1..=micros {
            self.plant.step(command);
            let (now, rotor) = (self.plant.now(), self.plant.state().rotor);
            if n % 5 == 0 {
                self.ldv.sample(now, rotor.velocity_m_s);
            }
            if n % 100 == 0 {
                self.camera.expose(now, rotor.angle.angle());
            }
            if n % 10 == 0 {
                self.tick(sums);
            }
        }
    }

    fn tick(&mut self, sums: &mut Sums) {
        let now = self.plant.now();
        while let Some(sample) = self.ldv.read() {
            self.plain.update_ldv(&sample);
            self.aided.update_ldv(&sample);
        }
        while let Some(frame) = self.camera.arrived(now) {
            self.plain.update_camera(&frame);
            let innovation = self.aided.update_camera(&frame);
            if innovation.verdict == Verdict::Used {
                sums.aided_nis += f64::from(innovation.normalised_squared().unwrap());
                sums.frames += 1.0;
            }
        }
        let truth = self.plant.state().rotor.angle.angle();
        let (Some(plain), Some(aided)) = (self.plain.estimate(now), self.aided.estimate(now)) else { return };
        let error_mdeg = 1e3 * aided.angle.minus(truth).degrees();
        sums.plain_mdeg2 += (1e3 * plain.angle.minus(truth).degrees()).powi(2);
        sums.aided_mdeg2 += error_mdeg.powi(2);
        sums.aided_nees +=
            error_mdeg.powi(2) / (f64::from(aided.angle_rad2) * 1e6 * 1_f64.to_degrees().powi(2));
        sums.count += 1.0;
    }
}

/// 0.2 s of each motor in steady motion, after 0.1 s of start.
fn steady(mode: DriveMode) -> Sums {
    let mut sums = Sums::default();
    for seed in SEEDS {
        let mut bench = Bench::new(seed);
        bench.run(DriveCommand::full(mode), 100_000, &mut Sums::default());
        bench.run(DriveCommand::full(mode), 200_000, &mut sums);
    }
    let [plain, aided] = sums.rms_mdeg();
    println!(
        "{mode:?}: {plain:.2} mdeg, {aided:.2} with impacts; NIS {:.3}, NEES of the angle {:.3}",
        sums.aided_nis / sums.frames,
        sums.aided_nees / sums.count
    );
    sums
}

#[test]
fn law_impacts_help_in_mode_b() {
    let [plain, aided] = steady(DriveMode::B).rms_mdeg();
    assert!(aided <= 8.0 && aided < plain, "{plain} {aided}");
}

#[test]
fn law_impacts_help_in_mode_c() {
    let [plain, aided] = steady(DriveMode::C).rms_mdeg();
    assert!(aided < plain, "{plain} {aided}");
}

/// Driven for 50 ms and left alone: at most 0.7 milli-degrees 100 ms after it has stopped, 0.3 after a second, and as good as it says.
#[test]
fn law_rest_is_measured_to_a_fraction_of_a_milli_degree() {
    let (mut soon, mut late) = (Sums::default(), Sums::default());
    for seed in SEEDS {
        let mut bench = Bench::new(seed);
        bench.run(DriveCommand::full(DriveMode::B), 50_000, &mut Sums::default());
        let still = |bench: &Bench| bench.plant.state().rotor.rate_rad_s.abs() < 1e-6;
        for _ in 0..1000 {
            bench.run(DriveCommand::OFF, 1000, &mut Sums::default());
            if still(&bench) {
                break;
            }
        }
        assert!(still(&bench), "seed {seed}");
        bench.run(DriveCommand::OFF, 100_000, &mut Sums::default());
        bench.run(DriveCommand::OFF, 100, &mut soon);
        bench.run(DriveCommand::OFF, 900_000, &mut Sums::default());
        bench.run(DriveCommand::OFF, 100, &mut late);
    }
    let [soon_mdeg, late_mdeg] = [&soon, &late].map(|sums| sums.rms_mdeg());
    println!("at rest: {soon_mdeg:.3?} mdeg after 0.1 s, {late_mdeg:.3?} after 1 s");
    println!("NEES of the angle {:.2}, {:.2}", soon.aided_nees / soon.count, late.aided_nees / late.count);
    for (soon, late) in soon_mdeg.into_iter().zip(late_mdeg) {
        assert!(soon <= 0.7 && late <= 0.3, "{soon_mdeg:?} {late_mdeg:?}");
    }
}
