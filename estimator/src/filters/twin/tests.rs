use crate::filters::constant_rate::RandomWalkTuning;
use motor_model::{Angle, DriveMode, Motor, MotorParams, MotorSetup, MotorState, Parameter};
use proptest::prelude::*;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng as _;

use super::*;
use crate::filters::twin::states::{DRIVE_PHASE, HEIGHT, MASS_RATIO, MODE_PARAMETERS, Row};
use crate::innovation::Verdict;
use crate::instruments::Instruments;

/// The filter of the nominal motor under the default instruments.
pub(super) fn filter<T: Real>() -> TwinFilter<T> {
    let params = MotorParams::nominal();
    let motor = CheckedMotor::try_new(&params).unwrap();
    TwinFilter::new(&motor, &TwinTuning::new(&params, &Instruments::default()))
}

/// Sets the entry of a state within the support of `row`.
pub(super) fn set_entry<T: Real>(row: &mut Row<T>, state: usize, value: T) {
    if state < MASS_RATIO {
        row.lead[state - HEIGHT] = value;
    } else {
        row.last[state - MASS_RATIO] = value;
    }
}

/// The nominal motor at full drive, with exact samples and noisy frames.
struct Rig {
    motor: Motor<f64>,
    state: MotorState<f64>,
    command: DriveCommand,
    noise: Pcg64,
    /// Whether the camera delivers nothing.
    camera_off: bool,
    /// What the vibrometer makes of a velocity.
    scale: f64,
}

impl Rig {
    fn new(mode: DriveMode) -> Self {
        let motor = Motor::try_new(&MotorParams::nominal(), &MotorSetup::with_step(5e-6)).unwrap();
        let (state, command) = (MotorState::default(), DriveCommand::full(mode));
        Self { motor, state, command, noise: Pcg64::seed_from_u64(1), camera_off: false, scale: 1.0 }
    }

    /// Runs until `micros`; the vibrometer may be silent.
    fn run(&mut self, filter: &mut TwinFilter<f64>, micros: u64, sampled: bool) {
        while self.state.steps * 5 < micros {
            self.motor.step(&mut self.state, self.command);
            let (at, rotor) = (Time::from_micros(self.state.steps * 5), &self.state.rotor);
            if sampled {
                filter.update_ldv(&LdvSample {
                    taken_at: at,
                    velocity_m_s: (self.scale * rotor.velocity_m_s) as f32,
                });
            }
            if self.state.steps.is_multiple_of(20) && !self.camera_off {
                let noise: f64 = StandardNormal.sample(&mut self.noise);
                let off = noise * filter.tuning.without_stator.constant_rate.track.camera_rad2.sqrt();
                let angle = Angle::from_degrees(rotor.angle.angle().degrees() + off.to_degrees());
                filter.update_camera(&CameraFrame::new(at, angle));
            }
        }
    }
}

#[test]
fn law_the_estimate_needs_a_frame_and_the_health_follows_the_vibrometer() {
    let mut filter = filter::<f64>();
    assert_eq!(filter.health(Time::ZERO), Health::Waiting);
    assert!(filter.estimate(Time::ZERO).is_none());
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::C));
    let mut rig = Rig::new(DriveMode::C);
    rig.run(&mut filter, 20_000, true);
    let (now, later) = (Time::from_micros(20_000), Time::from_micros(21_100));
    assert_eq!(filter.health(now), Health::Good);
    rig.run(&mut filter, 21_000, false);
    assert_eq!(filter.health(later), Health::Degraded(Reason::VibrometerSilent));
    rig.run(&mut filter, 23_000, false);
    rig.run(&mut filter, 30_000, true);
    assert_eq!(filter.health(Time::from_micros(30_000)), Health::Good);
}

/// Two milliseconds ago, with the frames since, the error is as large as the estimate says and smaller than at the
/// time. A hundred errors 10 ms apart, which are independent: the mean of their squares over the variance is 1 within
/// 3.3 of `sqrt(2 / 100)`. Frames of both sides halve the variance of a random walk of the rate, and nearly so here.
#[test]
fn law_the_past_is_as_uncertain_as_it_says_and_less_than_the_present() {
    for mode in [DriveMode::B, DriveMode::C] {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(mode));
        let mut rig = Rig::new(mode);
        let (mut past, mut present) = ([0.0; 2], [0.0; 2]);
        for n in 1..=100 {
            rig.run(&mut filter, 100_000 + 10_000 * n - 2_000, true);
            let (then, angle) = (Time::from_micros(rig.state.steps * 5), rig.state.rotor.angle.angle());
            let add = |sums: &mut [f64; 2], estimate: Estimate<f64>| {
                let off_rad: f64 = estimate.angle.radians_since(angle);
                sums[0] += off_rad * off_rad / estimate.angle_rad2 / 100.0;
                sums[1] += estimate.angle_rad2 / 100.0;
            };
            add(&mut present, filter.estimate(then).unwrap());
            rig.run(&mut filter, 100_000 + 10_000 * n, true);
            add(&mut past, filter.smoothed(then).unwrap());
        }
        assert!((0.53..1.47).contains(&past[0]), "{mode:?}: {past:?}");
        assert!((0.1..0.6).contains(&(past[1] / present[1])), "{mode:?}: {past:?} {present:?}");
    }
}

/// The propagated track equals a prediction through all kicks again, also after a kick was refined.
#[test]
fn dual_the_propagated_track_is_the_prediction_made_again() {
    for mode in [DriveMode::B, DriveMode::C] {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(mode));
        let mut rig = Rig::new(mode);
        let mut kept = 0;
        for micros in (30..60_000).step_by(25) {
            rig.run(&mut filter, micros, true);
            let mut again = filter.clone();
            kept += u32::from(again.propagated.take().is_some());
            let now = Time::from_micros(micros);
            let Some((kept, gone)) = filter.estimate(now).zip(again.estimate(now)) else { continue };
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
            assert!(close(kept.rate_rad_s, gone.rate_rad_s), "{kept:?} {gone:?}");
            assert!(close(kept.rate_rad2_s2, gone.rate_rad2_s2), "{kept:?} {gone:?}");
            assert!(close(kept.angle_rad2, gone.angle_rad2), "{kept:?} {gone:?}");
        }
        assert!(kept > 20, "{kept}");
    }
}

/// Without a camera there are as many kicks as are kept, and more. An estimate applies none of them again, and equals
/// the prediction through all.
#[test]
fn dual_without_a_camera_an_estimate_predicts_through_no_kick_again() {
    for mode in [DriveMode::B, DriveMode::C] {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(mode));
        let mut rig = Rig::new(mode);
        rig.run(&mut filter, 20_000, true);
        rig.camera_off = true;
        for micros in (20_000..700_000).step_by(1015) {
            rig.run(&mut filter, micros, true);
            let from = filter.tracker.track().unwrap().state.at;
            let Some(newest) = filter.kicks.back().filter(|newest| newest.at > from) else { continue };
            let Some(kept) = &filter.propagated else { panic!("propagated again at every tick") };
            assert_eq!(kept.state.at, newest.at);
            assert!(kept.serves(from, Time::from_micros(micros), false), "{kept:?} {from:?}");
            let mut again = filter.clone();
            again.propagated = None;
            let now = Time::from_micros(micros);
            let (kept, gone) = (filter.estimate(now).unwrap(), again.estimate(now).unwrap());
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
            assert!(close(kept.rate_rad_s, gone.rate_rad_s), "{kept:?} {gone:?}");
            assert!(close(kept.angle_rad2, gone.angle_rad2), "{kept:?} {gone:?}");
        }
        assert_eq!(filter.kicks.len(), 128);
    }
}

/// Without samples the rate wanders as in the simplest filter: so does its variance.
#[test]
fn dual_without_a_vibrometer_the_noise_is_that_of_the_simplest_filter() {
    let mut filter = filter::<f64>();
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    Rig::new(DriveMode::B).run(&mut filter, 20_000, true);
    // Just after the flight is no longer believed: both have the simplest filter's jitter.
    let believed_until = Time::from_micros(20_000 + 200).plus_nanos(1);
    let (near, far) = (
        filter.estimate(believed_until).unwrap(),
        filter.estimate(believed_until.plus_nanos(1_000_000)).unwrap(),
    );
    let grown = far.rate_rad2_s2 - near.rate_rad2_s2;
    let intensity = RandomWalkTuning::<f64>::default().impacted_b_rad2_s3;
    assert!((grown - intensity * 1e-3).abs() < 1e-6, "{grown}");
}

/// One input of a filter.
#[derive(Clone, Copy, Debug)]
enum Input {
    Sample(f32),
    Frame(f64),
    Drive(Option<DriveMode>, f32),
}

fn input() -> impl Strategy<Value = Input> {
    let wild = prop_oneof![
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(-f32::INFINITY),
        Just(f32::MAX),
        Just(1e-40),
        Just(0.0),
        -2.5..2.5_f32
    ];
    let mode = prop_oneof![Just(None), Just(Some(DriveMode::B)), Just(Some(DriveMode::C))];
    prop_oneof![
        20 => (-0.1..0.1_f32).prop_map(Input::Sample),
        4 => wild.prop_map(Input::Sample),
        4 => (-400.0..400.0_f64).prop_map(Input::Frame),
        1 => (mode, 0.0..1.0_f32).prop_map(|(mode, amplitude)| Input::Drive(mode, amplitude)),
    ]
}

/// Feeds a sequence in which most times are 5 us apart, some run back, repeat or jump.
fn feed<T: Real>(script: &[(Input, u8, u64)]) -> TwinFilter<T> {
    let (mut filter, mut at) = (filter::<T>(), Time::from_micros(10_000));
    for &(input, kind, nanos) in script {
        at = match kind {
            0 => Time::from_nanos(at.nanos().saturating_sub(nanos)),
            1 => at.plus_nanos(nanos),
            2 => at,
            3 => at.plus_nanos(nanos * 1000),
            _ => at.plus_nanos(5000),
        };
        match input {
            Input::Sample(velocity_m_s) => {
                filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
            }
            Input::Frame(degrees) => {
                filter.update_camera(&CameraFrame::new(at, Angle::from_degrees(degrees)));
            }
            Input::Drive(mode, amplitude) => {
                let command =
                    mode.map_or(DriveCommand::OFF, |mode| DriveCommand::saturating(mode, amplitude));
                filter.drive(at, command);
            }
        }
        if let Some(estimate) = filter.estimate(at) {
            let numbers =
                [estimate.rate_rad_s, estimate.angle_rad2, estimate.angle_rate_rad2_s, estimate.rate_rad2_s2];
            assert!(numbers.iter().all(|x| x.to_f64().is_finite()), "{estimate:?}");
            assert!(estimate.angle_rad2 > T::zero() && estimate.rate_rad2_s2 > T::zero(), "{estimate:?}");
        }
    }
    filter
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 200, ..ProptestConfig::default() })]

    /// Whatever the inputs and their order, the estimate is finite with positive variances, and the stator is sound.
    #[test]
    fn law_any_inputs_leave_a_finite_estimate_and_a_sound_stator(
        script in proptest::collection::vec((input(), 0..30_u8, 0..3_000_000_u64), 1..300)
    ) {
        prop_assert!(feed::<f32>(&script).stator.is_sound());
        prop_assert!(feed::<f64>(&script).stator.is_sound());
    }
}

/// Impacts of metres a second, gaps and times that run back leave a sound stator. In each of these runs the impacts
/// drive mode A towards the limit of a millimetre.
#[test]
fn law_a_wild_vibrometer_leaves_a_sound_stator() {
    for seed in [551, 611, 916, 1006, 1660, 1996, 2451, 2884] {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut part = move || (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let (mut single, mut double) = (filter::<f32>(), filter::<f64>());
        let mut at = Time::from_micros(10_000);
        let speed_m_s = [0.02, 0.1, 0.5, 1.9][(part() * 4.0) as usize];
        let mut driven = false;
        for _ in 0..600 {
            at = match part() {
                x if x < 0.005 => at.plus_nanos((3e6 * part()) as u64),
                x if x < 0.007 => at.plus_nanos((3e9 * part()) as u64),
                x if x < 0.009 => Time::from_nanos(at.nanos().saturating_sub((3e6 * part()) as u64)),
                _ => at.plus_nanos(5000),
            };
            let what = part();
            if what < 0.01 || !driven {
                driven = true;
                let command = match (part() * 3.0) as u32 {
                    0 => DriveCommand::OFF,
                    1 => DriveCommand::saturating(DriveMode::B, part() as f32),
                    _ => DriveCommand::saturating(DriveMode::C, part() as f32),
                };
                single.drive(at, command);
                double.drive(at, command);
            } else if what < 0.05 {
                let frame = CameraFrame::new(at, Angle::from_degrees(400.0 * part()));
                single.update_camera(&frame);
                double.update_camera(&frame);
            } else {
                let velocity_m_s = (speed_m_s * (2.0 * part() - 1.0)) as f32;
                let sample = LdvSample { taken_at: at, velocity_m_s };
                single.update_ldv(&sample);
                double.update_ldv(&sample);
            }
            assert!(single.stator.is_sound() && double.stator.is_sound(), "{seed}");
        }
    }
}

/// A vibrometer whose sign is inverted, and one whose scale is off by a half, until it is told, within 200 ms: once the
/// fault is over, what was learnt of the motor before it is known as well as then, and within five of its standard
/// deviations.
#[test]
fn law_what_was_learnt_survives_a_fault_of_the_vibrometer() {
    for scale in [-1.0, 0.5] {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
        let mut rig = Rig::new(DriveMode::B);
        rig.run(&mut filter, 1_200_000, true);
        let before = filter.stator.clone();
        rig.scale = scale;
        let mut micros = 1_200_000;
        while !filter.detector.has_fault() {
            micros += 1000;
            rig.run(&mut filter, micros, true);
            assert!(micros < 1_400_000, "{scale}: not told");
        }
        rig.scale = 1.0;
        while filter.detector.has_fault() {
            micros += 5;
            rig.run(&mut filter, micros, true);
            assert!(micros < 2_000_000, "{scale}: for ever");
        }
        for state in MODE_PARAMETERS..DRIVE_PHASE {
            let [then, now] = [&before, &filter.stator].map(|stator| stator.covariance.variances()[state]);
            // Less than a third of it had been learnt in the last 0.3 s before the fault.
            assert!(now < 2.0 * then, "{scale}: state {state} {:e} and {:e}", then.sqrt(), now.sqrt());
            // The nominal motor differs from nominal by nothing.
            let off = filter.stator.parameters[state];
            assert!(off * off < 25.0 * now, "{scale}: state {state} {off:e} of {:e}", now.sqrt());
        }
    }
}

/// A vibrometer that shows a fifth too much: a clock that runs back takes nothing of the learnt scale away.
#[test]
fn law_the_learnt_scale_survives_a_clock_that_runs_back() {
    let mut filter = filter::<f64>();
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    let mut rig = Rig::new(DriveMode::B);
    rig.scale = 1.2;
    rig.run(&mut filter, 600_000, true);
    let one = |taken_at| LdvSample { taken_at, velocity_m_s: 1.0 };
    let scaled = |filter: &TwinFilter<f64>| 1.2 * filter.detector.scaled(&one(Time::ZERO)).velocity_m_s - 1.0;
    assert!(scaled(&filter).abs() < 0.05, "{}", scaled(&filter));
    let newest = filter.detector.newest;
    for n in 0..300 {
        let velocity_m_s = 1e-4 * (n % 7) as f32;
        filter.update_ldv(&LdvSample { velocity_m_s, ..one(Time::from_micros(100_000 + 5 * n)) });
    }
    assert!(filter.detector.newest < newest);
    assert!(scaled(&filter).abs() < 0.05, "{}", scaled(&filter));
}

/// The stator swings by the drive of before until the drive changes, however long ago the last sample came.
#[test]
fn exact_the_stator_is_driven_until_the_drive_changes() {
    let b = DriveCommand::full(DriveMode::B);
    let mut filter = filter::<f64>();
    let mut expected = filter.stator.clone();
    filter.drive(Time::ZERO, b);
    filter.update_ldv(&LdvSample { taken_at: Time::from_micros(5), velocity_m_s: 1e-4 });
    filter.drive(Time::from_micros(1000), DriveCommand::OFF);
    expected.advance(Time::ZERO, DriveCommand::OFF);
    for micros in [5, 1000] {
        expected.advance(Time::from_micros(micros), b);
    }
    assert_eq!(filter.stator.at, Some(Time::from_micros(1000)));
    assert_eq!(filter.stator.state.modes, expected.state.modes);
    assert!(expected.state.modes.velocity_m_s.y.abs() > 0.01, "{}", expected.state.modes.velocity_m_s);
}

/// Frames contradicted the kicks of a vibrometer that showed the rotor pulled down. Once that fault is over, 50 ms
/// after its last sign, kicks are taken again at once.
#[test]
fn exact_contradictions_end_with_the_fault_that_made_them() {
    let mut filter = filter::<f64>();
    filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
    for n in 1..=10_200_u64 {
        let (at, pulled) = (Time::from_micros(5 * n), if (100..102).contains(&n) { 0.1 } else { 0.0 });
        let velocity_m_s = (9.81 * 5e-6 * (200.0 - (n % 400) as f64) - pulled) as f32;
        filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s });
        if n == 1000 {
            assert!(filter.detector.erratic_until.is_some());
            (0..4).for_each(|_| filter.contradict(at));
        }
    }
    assert!(!filter.detector.has_fault());
    filter.misfit = MisfitMonitor::trusted();
    filter.review_kick_use(Time::from_micros(51_000));
    assert!(filter.kick_use.taken);
}

/// A motor whose mode B and drive are off by 0.3 % in frequency: the health says that the impacts are not explained,
/// and the estimate stays within eight of its standard deviations.
#[test]
fn law_the_health_says_that_impacts_are_not_explained() {
    let mut filter = filter::<f64>();
    let command = DriveCommand::full(DriveMode::B);
    filter.drive(Time::ZERO, command);
    let mut rig = Rig::new(DriveMode::B);
    let nominal = MotorParams::nominal();
    let off = nominal.get(Parameter::ModeBFrequency) * 1.003;
    let params = nominal.with(Parameter::ModeBFrequency, off).unwrap();
    rig.motor = Motor::try_new(&params, &MotorSetup::with_step(5e-6)).unwrap();
    let mut unexplained = 0;
    for micros in (50_000..300_000).step_by(1000) {
        rig.run(&mut filter, micros, true);
        let now = Time::from_micros(micros);
        unexplained += u32::from(filter.health(now) == Health::Degraded(Reason::ImpactsUnexplained));
        let estimate = filter.estimate(now).unwrap();
        let off: f64 = estimate.angle.radians_since(rig.state.rotor.angle.angle());
        assert!(off * off < 64.0 * estimate.angle_rad2, "{off} {estimate:?}");
    }
    assert!(unexplained > 150, "{unexplained}");
}

/// The misfit of an impact is the sum of its normalised innovations squared. Beyond 40 its kick is as uncertain as
/// without the stator filter, and no later sample refines it. A height that is off makes such impacts.
#[test]
fn law_an_impact_that_fits_badly_gives_no_kick_of_the_stator() {
    let (mut badly, mut well) = (0, 0);
    for off_m in [0.0, 1e-7, 2e-7, 3e-7, 5e-7, 8e-7] {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
        let mut rig = Rig::new(DriveMode::B);
        rig.run(&mut filter, 50_000, true);
        filter.stator.height_m += off_m;
        let innovation = (0..2000).find_map(|_| {
            rig.motor.step(&mut rig.state, rig.command);
            let velocity_m_s = rig.state.rotor.velocity_m_s as f32;
            filter.update_ldv(&LdvSample { taken_at: Time::from_micros(5 * rig.state.steps), velocity_m_s })
        });
        let ImpactInnovation { contact, verdict, .. } = innovation.expect("an impact within 10 ms");
        let misfit =
            contact.gap_m.powi(2) / contact.gap_m2 + contact.approach_m_s.powi(2) / contact.approach_m2_s2;
        let is_refinable = filter.kicks.iter().next_back().is_some_and(|kick| kick.refinable);
        assert_eq!(
            (verdict == Verdict::Used, is_refinable),
            (misfit < 40.0, misfit < 40.0),
            "{off_m:e}: {misfit}"
        );
        badly += u32::from(misfit >= 40.0);
        well += u32::from(misfit < 40.0);
    }
    assert!(badly > 0 && well > 0, "{badly} {well}");
}

/// Samples at rest have twice the noise that is described: detector and height go by what they show. The height, the
/// integral of samples of this noise, has the process noise `sigma^2 T`. Ten thousand samples tell a deviation to less
/// than a percent.
#[test]
fn law_the_noise_that_rest_shows_is_that_of_detector_and_height() {
    let mut filter = filter::<f64>();
    let (true_m_s, period_s) = (2.0 * filter.detector.noise_m_s(), 5e-6);
    let camera_rad = filter.tuning.without_stator.constant_rate.track.camera_rad2.sqrt();
    let mut source = Pcg64::seed_from_u64(4);
    let mut noise = move |deviation: f64| {
        let normal: f64 = StandardNormal.sample(&mut source);
        deviation * normal
    };
    for n in 1..=400_000_u64 {
        let at = Time::from_micros(5 * n);
        filter.update_ldv(&LdvSample { taken_at: at, velocity_m_s: noise(true_m_s) as f32 });
        if n.is_multiple_of(20) {
            filter.update_camera(&CameraFrame::new(at, Angle::from_degrees(noise(camera_rad).to_degrees())));
        }
    }
    let (ours_m_s, ours_m2_s) = (filter.detector.noise_m_s(), filter.stator.height_noise_m2_s);
    assert!((ours_m_s / true_m_s - 1.0).abs() < 0.05, "{ours_m_s:e}");
    assert!((ours_m2_s / (true_m_s * true_m_s * period_s) - 1.0).abs() < 0.1, "{ours_m2_s:e}");
}
