//! A drawn motor on the rig, all filters beside it, and a fault between instruments and filters.

use estimator::{AngleFilter as _, CameraFrame, Health, LdvSample, Reason, Verdict};
use motor_model::{Angle, DriveCommand, DriveMode, Time, math};
use simulation::Scene;
use simulation::runs::filter::{AnyFilter, FILTERS};
use simulation::world::rig::Rig;

/// What the filters are told of a frame, or that there is none; of a sample likewise.
pub type Faults = (fn(Time, CameraFrame) -> Option<CameraFrame>, fn(Time, LdvSample) -> Option<LdvSample>);

/// No fault.
pub const NONE: Faults = (|_, frame| Some(frame), |_, sample| Some(sample));

/// From 0 to 1, for each number its own: multiples of the golden ratio's part, scrambled.
pub fn drawn(number: u64) -> f64 {
    let scrambled = number.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let scrambled = (scrambled ^ (scrambled >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    #[expect(clippy::cast_precision_loss, reason = "24 bits")]
    let part = (scrambled >> 40) as f64 / 16_777_216.0;
    part
}

/// A filter at the end of a tick.
#[derive(Clone, Debug)]
pub struct Look {
    pub name: &'static str,
    pub at: Time,
    pub health: Health,
    /// Of the angle: its magnitude, and in standard deviations that the filter gives; none without an estimate.
    pub error: Option<(f64, f64)>,
    /// The same at the exposure of the frame that came, if one did.
    pub error_at_exposure: Option<(f64, f64)>,
    /// What became of the frame, if one came.
    pub verdict: Option<Verdict>,
}

impl Look {
    pub fn is_good(&self) -> bool {
        self.health == Health::Good
    }

    pub fn is_unusable(&self, why: Reason) -> bool {
        self.health == Health::Unusable(why)
    }

    /// Believed to be good, and off by more than six standard deviations, which is one normal error in 5e8, and by more
    /// than three standard deviations of a frame, so that the next frame shows it. Smaller errors count
    /// in the mean squares of `law_consistency` and `law_vibrometer_told_or_covered`.
    pub fn is_false(&self) -> bool {
        self.is_good() && self.error.is_some_and(|(mdeg, sigmas)| sigmas > 6.0 && mdeg > 3.0 * FRAME_MDEG)
    }

    /// Whether it is good, but perhaps for whole turns that nobody could count.
    pub fn is_right_but_for_the_turn(&self) -> bool {
        self.is_good() || self.health == Health::Degraded(Reason::TurnUnknown)
    }

    pub fn error_mdeg(&self) -> f64 {
        self.error.map_or(f64::INFINITY, |(mdeg, _)| mdeg)
    }
}

/// Standard deviation of a frame of a single mark, in milli-degrees: 1 um of noise and 2 um of quantisation at 3.9 mm.
const FRAME_MDEG: f64 = 16.96;

/// Full drive in mode B.
pub const B: DriveCommand = DriveCommand::full(DriveMode::B);

pub struct Bench {
    rig: Rig,
    filters: Vec<(&'static str, AnyFilter)>,
    /// What the filters' time is ahead of the plant's.
    ahead_nanos: u64,
    /// Whether the filters are told the drive of a tick at its end, instead of at its start, where it begins to act.
    told_late: bool,
    /// The true angle at the end of every tick so far.
    angles: Vec<Angle>,
}

/// A camera that follows a single mark.
const ONE_MARK: &str = "camera.marks=1";

impl Bench {
    /// The motor of seed 21 under `sets`. The camera follows a single mark: bounds in standard deviations, and beside
    /// the filter without a vibrometer, are those of its frames.
    pub fn new(sets: &[&str]) -> Self {
        Self::ahead(sets, 0)
    }

    /// The same, of whose instruments the filters know all that `sets` says.
    pub fn described(sets: &[&str]) -> Self {
        let bench = Self::new(sets);
        let assumed: Vec<String> = [ONE_MARK].iter().chain(sets).map(|&set| set.to_owned()).collect();
        Self { filters: filters(&Scene::of_sets(&assumed).expect("a scene")), ..bench }
    }

    /// The same with all clocks ahead.
    pub fn ahead(sets: &[&str], ahead_nanos: u64) -> Self {
        let sets: Vec<String> = ["seed=21", ONE_MARK].iter().chain(sets).map(|&set| set.to_owned()).collect();
        let rig = Rig::new(&Scene::of_sets(&sets).expect("a scene")).expect("a rig");
        // What goes wrong is not told to the filters.
        let filters = filters(&Scene::of_sets(&[ONE_MARK.to_owned()]).expect("a scene"));
        Self { rig, filters, ahead_nanos, told_late: false, angles: Vec::new() }
    }

    /// The same bench, whose filters are told each drive a tick after it has begun to act.
    pub fn told_late(self) -> Self {
        Self { told_late: true, ..self }
    }

    /// The motor of seed 21 under `sets`, after 100 ms of `command` without faults.
    pub fn driven(sets: &[&str], command: DriveCommand) -> Self {
        let mut bench = Self::new(sets);
        let looks = bench.run(command, 100, NONE);
        assert!(looks.iter().rev().take(FILTERS.len()).all(|look| look.error.is_some()), "{sets:?}");
        bench
    }

    fn tell(&mut self, command: DriveCommand) {
        let now = self.now();
        self.filters.iter_mut().for_each(|(_, filter)| filter.drive(now, command));
    }

    /// Whether the rotor does not turn.
    pub fn is_still(&self) -> bool {
        self.rig.plant().rotor().rate_rad_s.abs() < 1e-6
    }

    pub fn now(&self) -> Time {
        self.rig.plant().now().plus_nanos(self.ahead_nanos)
    }

    /// Runs for `millis` under `command` with `faults`; every filter's looks, tick by tick. A tick is as in the loop
    /// ([`controller::tick`]): the filters are told its drive when it begins to act, and receive at its end what was
    /// measured in it.
    pub fn run(&mut self, command: DriveCommand, millis: u64, (of_frame, of_sample): Faults) -> Vec<Look> {
        let mut looks = Vec::new();
        for _ in 0..millis * 100 {
            if !self.told_late {
                self.tell(command);
            }
            self.rig.tick_in_steps(command, &mut |_, _| ());
            let (now, truth) = (self.now(), self.rig.plant().rotor().angle);
            self.angles.push(truth);
            let mut verdicts = vec![None; self.filters.len()];
            let mut exposed = None;
            while let Some(mut sample) = self.rig.ldv_sample() {
                sample.taken_at = sample.taken_at.plus_nanos(self.ahead_nanos);
                if let Some(sample) = of_sample(now, sample) {
                    self.filters.iter_mut().for_each(|(_, filter)| {
                        filter.update_ldv(&sample);
                    });
                }
            }
            while let Some(mut frame) = self.rig.camera_frame() {
                exposed = Some(frame.exposed_at);
                frame.exposed_at = frame.exposed_at.plus_nanos(self.ahead_nanos);
                if let Some(frame) = of_frame(now, frame) {
                    for ((_, filter), verdict) in self.filters.iter_mut().zip(&mut verdicts) {
                        *verdict = Some(filter.update_camera(&frame).verdict);
                    }
                }
            }
            if self.told_late {
                self.tell(command);
            }
            for ((name, filter), verdict) in self.filters.iter().zip(verdicts) {
                let at_exposure = exposed.and_then(|at| {
                    let truth = self.angles.get(usize::try_from(at.nanos() / 10_000 - 1).ok()?)?;
                    error(filter, at.plus_nanos(self.ahead_nanos), *truth)
                });
                looks.push(Look {
                    name,
                    at: now,
                    health: filter.health(now),
                    error: error(filter, now, truth),
                    error_at_exposure: at_exposure,
                    verdict,
                });
            }
        }
        looks
    }
}

/// All filters for the design and the instruments of a scene.
fn filters(assumed: &Scene) -> Vec<(&'static str, AnyFilter)> {
    FILTERS.iter().map(|&name| (name, AnyFilter::named(name, assumed).expect("the nominal motor"))).collect()
}

/// Of an estimate's angle, in milli-degrees and in standard deviations.
fn error(filter: &AnyFilter, at: Time, truth: Angle) -> Option<(f64, f64)> {
    let estimate = filter.estimate(at)?;
    let off_deg = estimate.angle.minus(truth).degrees().abs();
    let sigma_deg = math::sqrt(f64::from(estimate.angle_rad2)).to_degrees();
    assert!(sigma_deg.is_finite() && estimate.rate_rad_s.is_finite(), "{estimate:?}");
    Some((1e3 * off_deg, off_deg / sigma_deg))
}

/// The looks of each filter by itself, of those that have any.
pub fn by_filter(looks: &[Look]) -> Vec<Vec<&Look>> {
    let of = |name: &&str| -> Vec<&Look> { looks.iter().filter(|look| look.name == *name).collect() };
    FILTERS.iter().map(of).filter(|looks| !looks.is_empty()).collect()
}

/// The looks of each filter that takes impacts from the vibrometer.
pub fn of_filters_with_impacts(looks: &[Look]) -> Vec<Vec<&Look>> {
    by_filter(looks).into_iter().filter(|looks| looks[0].name != "constant_rate").collect()
}

/// Asserts that each filter's first look for which `is_it` holds comes within `most_ms` of the first look.
#[track_caller]
pub fn assert_within_ms(most_ms: f64, looks: &[Look], is_it: impl Fn(&Look) -> bool) {
    for (name, delay_ms) in delays_ms(looks, is_it) {
        assert!(delay_ms < most_ms, "{name}: {delay_ms} ms");
    }
}

/// Milliseconds from the first look to the first for which `is_it` holds, by filter.
#[track_caller]
pub fn delays_ms(looks: &[Look], is_it: impl Fn(&Look) -> bool) -> Vec<(&'static str, f64)> {
    let of_one = |looks: &Vec<&Look>| {
        let first =
            looks.iter().find(|look| is_it(look)).unwrap_or_else(|| panic!("never: {:?}", looks.last()));
        (first.name, 1e3 * first.at.seconds_since::<f64>(looks[0].at))
    };
    by_filter(looks).iter().map(of_one).collect()
}

/// Asserts that no filter was believed while it was wrong. A rotor that lands is out of its filter's reach until the
/// next frame, which in undisturbed motion takes up to 0.1 % of the time and eight standard deviations: up to 0.5 % is
/// let pass here, and none beyond twelve.
#[track_caller]
pub fn assert_never_false(looks: &[Look]) {
    assert_hardly_false(12.0, looks);
}

/// The same with another limit to the standard deviations.
#[track_caller]
pub fn assert_hardly_false(sigmas_most: f64, looks: &[Look]) {
    for looks in by_filter(looks) {
        let wrong: Vec<&&Look> = looks.iter().filter(|look| look.is_false()).collect();
        assert!(200 * wrong.len() <= looks.len(), "{} of {}, first {:?}", wrong.len(), looks.len(), wrong[0]);
        let far = wrong.iter().find(|look| look.error.is_some_and(|(_, sigmas)| sigmas > sigmas_most));
        assert!(far.is_none(), "{far:?}");
    }
}

/// Root mean square error by filter, in milli-degrees.
pub fn rms_mdeg(looks: &[Look]) -> Vec<(&'static str, f64)> {
    let of_one = |looks: &Vec<&Look>| {
        (looks[0].name, math::sqrt(mean_square(looks.iter().map(|look| look.error_mdeg()))))
    };
    by_filter(looks).iter().map(of_one).collect()
}

/// Each filter of `clean`, its error without the fault, is less than `factor` times as bad in `looks`.
#[track_caller]
pub fn assert_rms_at_most(factor: f64, clean: &[(&'static str, f64)], looks: &[Look]) {
    let spoilt = rms_mdeg(looks);
    for (name, clean) in clean {
        let spoilt = rms_of(&spoilt, name);
        assert!(spoilt < factor * clean, "{name}: {spoilt} for {clean}");
    }
}

/// The error of one filter.
#[track_caller]
pub fn rms_of(rms: &[(&'static str, f64)], name: &str) -> f64 {
    rms.iter().find(|(of, _)| *of == name).expect("a filter").1
}

/// Mean of the squares.
pub fn mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    sum / count
}
