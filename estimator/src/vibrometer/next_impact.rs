//! The impacts that no sample has shown yet: whether one can come before an instant ahead of the newest sample.
//!
//! A loop with latency asks for the angle some ticks ahead, and a slow vibrometer leaves the present ahead of its
//! newest sample. An impact in between kicks the rate. Whether one can come, the flight tells: only a rotor that is
//! about as low as where it was struck before can be struck again (F20).
//!
//! ```text
//! height above the last impact    h = sum v^ dt               v^: velocity in flight, falling if negative
//! h + v^ t < reach                random walk of the rate     q = n min(k^2, k_max^2),    reach = 3 um + 0.3 A a
//! h + v^ t >= reach               the same, far weaker        q / 200
//! mean square of its kicks        k^2 = c_u^2 (dv^2 + 2 pi A a w (|v^| + g / f) / p^2)
//! ```
//!
//! with the amplitude A of the driven mode at the teeth, its frequency f and w = 2 pi f, the drive's amplitude a, the
//! jump dv of the last impact, the mean square `c_u^2` of a kick of unknown sign per that of its jump, and the approach
//! per jump p of [`crate::filters::impact_aided`].
//!
//! - A rotor that falls at v^ falls by d = v^ / f in a period. It meets the teeth up to that far below their crest,
//!   half of it on average, where they rise at `w sqrt(A a d)`: the second term of k^2.
//! - A rotor that was struck deep below the crest is still there: the first term.
//! - In a second n = 4000 impacts strike a rotor within reach. Friction at most stops the slip, which bounds the kick:
//!   `k_max = 3.5 rad/s`.
//! - Out of reach an impact is rare. A rate that takes it for impossible is off by tens of standard deviations until
//!   the next sample: hence q / 200.
//!
//! The next 160 us change the rate of a rotor at full drive in mode B by 0.76 rad/s rms, but by 0.05 rad/s while it is
//! out of reach, six sevenths of the time. A rotor that chatters on the crests is kicked less than these formulas say:
//! variances ahead are up to twice the mean square errors there.

use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter, Real, Time};

use crate::camera::process::Wandering;
use crate::vibrometer::impact_detector::ImpactDetector;
use crate::vibrometer::motion::Motion;
use crate::vibrometer::motion_history::MotionPiece;

/// How long after the newest sample the flight is believed at least, in ns: longer than the longest latency of a loop,
/// 160 us.
const AHEAD_NANOS: u64 = 200_000;

/// A rotor that needs longer than this to come within reach, or out of it, stays where it is, in s.
const SLOW_S: f64 = 1.0;

/// Part of the intensity that is left out of reach.
const OUT_OF_REACH: f64 = 0.005;

/// `n`: impacts in a second of a rotor within reach of the teeth.
const IMPACTS_PER_S: f64 = 4000.0;

/// `k_max^2`: mean square of the kicks that stop the slip, in rad^2/s^2.
const KICK_MAX_RAD2_S2: f64 = 12.0;

/// Reach without drive, in m, and its growth with the amplitude of the teeth.
const REACH_AT_REST_M: f64 = 3e-6;
const REACH_PER_AMPLITUDE: f64 = 0.3;

/// A driven mode at full drive.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Swing<T> {
    /// `0.3 A`, in m.
    reach_m: T,
    /// `2 pi A w / p^2`, in m/s.
    jump2_per_fall_m_s: T,
}

/// What the next impact depends on, of motor and vibrometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NextImpactTuning<T> {
    /// Modes B and C.
    swings: [Swing<T>; 2],
    /// `c_u^2`, in rad^2/m^2.
    kick_per_jump_rad2_m2: T,
    /// `g / f`, in m/s.
    fall_in_a_period_m_s: T,
    /// How long after the newest sample the flight is believed, in ns.
    ahead_nanos: u64,
}

impl<T: Real> NextImpactTuning<T> {
    /// For a motor of `params` with the mean square `c_u^2` of a kick per that of its jump and the approach per jump
    /// `p`, under a vibrometer whose samples are at most `gap_nanos` apart.
    pub(crate) fn new(params: &MotorParams, kick_rad2_m2: f64, approach: f64, gap_nanos: u32) -> Self {
        let tau = core::f64::consts::TAU;
        let swing = |amplitude, frequency| {
            let amplitude_m = params.get(amplitude);
            let rise2_m_s = tau * amplitude_m * tau * params.get(frequency);
            Swing {
                reach_m: T::from_f64(REACH_PER_AMPLITUDE * amplitude_m),
                jump2_per_fall_m_s: T::from_f64(rise2_m_s / (approach * approach)),
            }
        };
        let period_s = 1.0 / params.get(Parameter::ModeBFrequency);
        Self {
            swings: [
                swing(Parameter::ModeBToothAmplitude, Parameter::ModeBFrequency),
                swing(Parameter::ModeCToothAmplitude, Parameter::ModeCFrequency),
            ],
            kick_per_jump_rad2_m2: T::from_f64(kick_rad2_m2),
            fall_in_a_period_m_s: T::from_f64(params.get(Parameter::Gravity) * period_s),
            ahead_nanos: AHEAD_NANOS.max(gap_nanos.into()),
        }
    }

    /// The impacts after the newest sample of `detector`, under `drive`; after none, where the vibrometer is at fault
    /// or impacts are not `taken`.
    pub(crate) fn unseen<'a>(
        &'a self,
        detector: &'a ImpactDetector<T>,
        drive: DriveCommand,
        taken: bool,
    ) -> UnseenImpacts<'a, T> {
        let newest = detector.newest.filter(|_| taken && !detector.has_fault());
        let (known_until, believed_nanos) =
            newest.map_or((Time::ZERO, 0), |newest| (newest, self.ahead_nanos));
        UnseenImpacts { tuning: self, detector, drive, known_until, believed_nanos }
    }

    fn swing(&self, drive: DriveCommand) -> &Swing<T> {
        let [of_b, of_c] = &self.swings;
        if drive.mode() == Some(DriveMode::C) { of_c } else { of_b }
    }

    /// Height of the reach above the last impact under `drive`, in m.
    fn reach_m(&self, drive: DriveCommand) -> T {
        T::from_f64(REACH_AT_REST_M) + self.swing(drive).reach_m * T::from_f32(drive.amplitude())
    }

    /// `q`: intensity of the kicks of a rotor within reach, in the flight of `detector` under `drive`, in rad^2/s^3.
    fn intensity_rad2_s3(&self, detector: &ImpactDetector<T>, drive: DriveCommand) -> T {
        let (velocity_m_s, jump_m_s) = (detector.flight.velocity_m_s, detector.jump_m_s);
        let fall_m_s = velocity_m_s.abs() + self.fall_in_a_period_m_s;
        let by_fall_m2_s2 = self.swing(drive).jump2_per_fall_m_s * T::from_f32(drive.amplitude()) * fall_m_s;
        let kick_rad2_s2 = self.kick_per_jump_rad2_m2 * (jump_m_s * jump_m_s + by_fall_m2_s2);
        T::from_f64(IMPACTS_PER_S) * kick_rad2_s2.at_most(T::from_f64(KICK_MAX_RAD2_S2))
    }
}

/// The impacts after the newest sample, which are not known yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnseenImpacts<'a, T> {
    tuning: &'a NextImpactTuning<T>,
    detector: &'a ImpactDetector<T>,
    /// The drive at present.
    drive: DriveCommand,
    /// Until when all impacts are known: the newest sample, or time zero, where impacts are not taken.
    pub(crate) known_until: Time,
    /// How long from then on the flight is believed to go on as the newest sample shows it, in ns; 0 where impacts are
    /// not taken.
    believed_nanos: u64,
}

impl<T: Real> UnseenImpacts<'_, T> {
    /// Whether the flight is believed at `at`, or all impacts until then are known.
    #[inline]
    pub(crate) fn covers(&self, at: Time) -> bool {
        at.nanos_since(self.known_until) < self.believed_nanos
    }

    /// The random walk of the rate right after `at` by impacts that no sample has shown yet; `None` where nothing is
    /// known of them.
    #[inline]
    pub(crate) fn wandering(&self, at: Time) -> Option<Wandering<T>> {
        if at < self.known_until {
            Some(Wandering { intensity_rad2_s3: T::zero(), until: self.known_until })
        } else {
            self.covers(at).then(|| self.may_come(at))
        }
    }

    /// The same in `piece`, of a filter that takes kicks since `taken_since`. A quiet rotor is not struck. Before kicks
    /// are taken nothing is known of them, and the piece ends when they are.
    #[inline]
    pub(crate) fn wandering_in(
        &self,
        piece: &mut MotionPiece,
        taken_since: Time,
        at: Time,
    ) -> Option<Wandering<T>> {
        if piece.motion == Motion::Quiet {
            return None;
        }
        if at < taken_since {
            piece.until = piece.until.min(taken_since);
            return None;
        }
        let unseen = self.wandering(at)?;
        Some(Wandering { until: piece.until.min(unseen.until), ..unseen })
    }

    /// The same after the newest sample, while the flight is believed.
    #[inline(never)]
    fn may_come(&self, at: Time) -> Wandering<T> {
        let Self { tuning, detector, drive, known_until, believed_nanos } = *self;
        let believed_until = known_until.plus_nanos(believed_nanos);
        let above_m = detector.flight.height_m - tuning.reach_m(drive);
        let low = above_m < T::zero();
        let crosses_at =
            nanos_to_cross(above_m, detector.flight.velocity_m_s).map(|nanos| known_until.plus_nanos(nanos));
        let (within_reach, until) = match crosses_at {
            Some(crosses_at) if at < crosses_at => (low, crosses_at.min(believed_until)),
            Some(_) => (!low, believed_until),
            None => (low, believed_until),
        };
        let part = if within_reach { T::one() } else { T::from_f64(OUT_OF_REACH) };
        let intensity_rad2_s3 = part * tuning.intensity_rad2_s3(detector, drive);
        Wandering { intensity_rad2_s3, until }
    }
}

/// Time in ns in which a rotor that is `above_m` the reach crosses it; `None` if it goes away from it, or takes
/// [`SLOW_S`] or more.
fn nanos_to_cross<T: Real>(above_m: T, velocity_m_s: T) -> Option<u64> {
    let (distance_m, towards_m_s) =
        if above_m < T::zero() { (-above_m, velocity_m_s) } else { (above_m, -velocity_m_s) };
    (towards_m_s * T::from_f64(SLOW_S) > distance_m)
        .then(|| u64::from((distance_m / towards_m_s * T::from_f64(1e9)).whole().unsigned_abs()))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::filters::impact_aided::ImpactAidedTuning;
    use crate::instruments::Instruments;
    use crate::measurement::LdvSample;
    use crate::vibrometer::impact_detector::ImpactDetectorTuning;
    use proptest::prelude::*;

    /// A detector whose newest sample is at `newest`, 1 ms after an impact that threw the rotor up at `velocity_m_s`,
    /// which it keeps.
    pub(crate) fn flying(
        mut tuning: ImpactDetectorTuning<f64>,
        newest: Time,
        velocity_m_s: f32,
    ) -> ImpactDetector<f64> {
        (tuning.gravity_m_s2, tuning.damping_per_s) = (0.0, 0.0);
        let mut detector = ImpactDetector::new(tuning);
        let begun = newest.nanos_since(Time::from_micros(1000));
        for (nanos, velocity_m_s) in
            [(begun, -velocity_m_s)].into_iter().chain((1..=200).map(|n| (begun + 5000 * n, velocity_m_s)))
        {
            detector.observe(&LdvSample { taken_at: Time::from_nanos(nanos), velocity_m_s });
        }
        detector
    }

    const NEWEST: Time = Time::from_micros(5000);

    /// What may come right after each of `micros` after the newest sample of `detector`, under mode B at full drive:
    /// the intensity, and for how long from the newest sample on, in us.
    fn walks<const N: usize>(detector: &ImpactDetector<f64>, micros: [u64; N]) -> [(f64, f64); N] {
        let tuning =
            ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default()).next_impact;
        let unseen = tuning.unseen(detector, DriveCommand::full(DriveMode::B), true);
        let walk = |micros: u64| {
            let walk = unseen.wandering(NEWEST.plus_nanos(1000 * micros)).expect("a flight that is believed");
            (walk.intensity_rad2_s3, 1e-3 * walk.until.nanos_since(NEWEST) as f64)
        };
        micros.map(walk)
    }

    /// A detector 1 ms after an impact, at `height_m` and with `velocity_m_s`.
    fn at_height(height_m: f64, velocity_m_s: f64) -> ImpactDetector<f64> {
        let tuning = ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default()).detector;
        flying(tuning, NEWEST, 0.03).moved(height_m, velocity_m_s)
    }

    /// Reach: 3 um and 0.3 of 20.72 um. A rotor 2 um above it that falls at 40 mm/s is out of reach for 50 us; one 1 um
    /// below it that rises at 10 mm/s is within reach for 100 us; one that goes away stays where it is.
    #[test]
    fn exact_a_rotor_is_struck_within_reach_and_hardly_beyond() {
        let reach_m = 3e-6 + 0.3 * 20.72e-6;
        let expected = [
            (2e-6, -0.04, [(false, 50.0), (true, 200.0)]),
            (-1e-6, 0.01, [(true, 100.0), (false, 200.0)]),
            (2e-6, 0.04, [(false, 200.0), (false, 200.0)]),
            (-1e-6, -0.01, [(true, 200.0), (true, 200.0)]),
            (50e-6, -0.04, [(false, 200.0), (false, 200.0)]),
        ];
        for (above_m, velocity_m_s, expected) in expected {
            let [(within, _)] = walks(&at_height(0.0, velocity_m_s), [0]);
            let walks = walks(&at_height(reach_m + above_m, velocity_m_s), [0, 150]);
            for ((intensity, until_us), (struck, expected_us)) in walks.into_iter().zip(expected) {
                let expected = if struck { within } else { within / 200.0 };
                assert!((intensity / expected - 1.0).abs() < 1e-9, "{above_m} {velocity_m_s}: {intensity}");
                assert!((until_us - expected_us).abs() < 0.01, "{above_m} {velocity_m_s}: {until_us}");
            }
        }
    }

    /// The intensity by F20, of a rotor that sinks slowly after a jump of 60 mm/s, and the bound of
    /// one that falls fast: 4000 kicks of 3.5 rad/s in a second.
    #[test]
    fn exact_intensity_is_that_of_the_formula() {
        let params = MotorParams::nominal();
        let get = |parameter| params.get(parameter);
        let c = get(Parameter::Friction) * get(Parameter::RotorMass) * get(Parameter::ToothRadius)
            / get(Parameter::RotorInertia);
        let p = (1.0 + params.tooth_mass_ratio()) / (1.0 + get(Parameter::Restitution));
        let (tau, f) = (core::f64::consts::TAU, get(Parameter::ModeBFrequency));
        let rise2 =
            tau * get(Parameter::ModeBToothAmplitude) * tau * f * (0.001 + get(Parameter::Gravity) / f);
        let slow = at_height(0.0, -0.001).struck(0.005);
        let expected = 4000.0 * 0.68 * c * c * (0.005 * 0.005 + rise2 / (p * p));
        let [(intensity, _)] = walks(&slow, [0]);
        assert!((intensity / expected - 1.0).abs() < 1e-9 && expected < 40_000.0, "{intensity} {expected}");
        let [(intensity, _)] = walks(&at_height(0.0, -0.1), [0]);
        assert!((intensity - 48_000.0).abs() < 1e-6, "{intensity}");
    }

    /// Before the newest sample all is known, and beyond the flight nothing; nor is it where impacts are not taken, or
    /// the vibrometer is at fault.
    #[test]
    fn exact_nothing_is_told_beyond_the_flight() {
        let tuning =
            ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default()).next_impact;
        let detector = at_height(0.0, -0.01);
        let drive = DriveCommand::full(DriveMode::B);
        let unseen = tuning.unseen(&detector, drive, true);
        let before = unseen.wandering(Time::from_micros(4999)).expect("known");
        assert!(before.intensity_rad2_s3 <= 0.0 && before.until == NEWEST, "{before:?}");
        assert!(unseen.wandering(Time::from_micros(5199)).is_some());
        assert!(unseen.wandering(Time::from_micros(5200)).is_none());
        assert!(tuning.unseen(&detector, drive, false).wandering(NEWEST).is_none());
        let mut unfit = detector;
        unfit.set_noise(1.0);
        assert_eq!(unfit.fault, Some(crate::Reason::VibrometerUnfit));
        assert!(tuning.unseen(&unfit, drive, true).wandering(NEWEST).is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever height and velocity: each piece ends after it has begun and no later than the flight
        /// is believed, and its intensity is neither negative nor beyond the bound.
        #[test]
        fn law_pieces_follow_each_other(
            height_m in -1e-3..1e-3_f64, velocity_m_s in prop_oneof![-2.5..2.5_f64, Just(0.0), Just(1e-30)],
            amplitude in 0.0..=1.0_f32, off in any::<bool>(), jump_m_s in 0.0..2.5_f64,
        ) {
            let tuning =
                ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default()).next_impact;
            let detector = at_height(height_m, velocity_m_s).struck(jump_m_s);
            let on = DriveCommand::saturating(DriveMode::C, amplitude);
            let drive = if off { DriveCommand::OFF } else { on };
            let unseen = tuning.unseen(&detector, drive, true);
            let (mut at, mut pieces) = (NEWEST, 0);
            while let Some(walk) = unseen.wandering(at) {
                prop_assert!(walk.until > at && walk.until <= NEWEST.plus_nanos(AHEAD_NANOS), "{walk:?}");
                prop_assert!((0.0..=48_000.0).contains(&walk.intensity_rad2_s3), "{walk:?}");
                at = walk.until;
                pieces += 1;
            }
            prop_assert!(pieces <= 2);
        }
    }
}
