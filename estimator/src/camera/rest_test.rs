//! Whether a quiet and slow rotor has stopped: the hypothesis of a rate of zero, against the frames.
//!
//! A quiet rotor whose estimated rate is small may lie still, or turn on without friction. The frames of a window
//! decide, by their least-squares slope and its variance:
//!
//! ```text
//! slope = sum (t - mean t) y / S,    variance = R / S,    S = sum t^2 - (sum t)^2 / n
//! ```
//!
//! A window ends when the standard deviation of the slope is 0.15 rad/s, and not before 1.6 ms: friction stops a rotor
//! of ten times that rate in that time. The first window passes for the rotor to stop. It is at rest if the slope of
//! the second is within four standard deviations of zero; else another window follows.
//!
//! A slope that is not zero, or a rotor at rest that the frames show to have moved, contradicts the hypothesis. After
//! four slopes, or one such motion, windows take twice the time, up to 32 times: the standard deviation falls by 2.8
//! each time. Where the vibrometer still shows a flight they take at least eight times: a rotor that tilts goes on
//! bouncing when one of this design has long come to lie. So a rotor that coasts without friction is not called at rest
//! for more than a small part of the time, and a slower one is found out as well. The next drive ends this.

use motor_model::{Angle, Real, Time};

/// Standard deviation of the slope at the end of a window, in rad/s.
pub(crate) const SLOPE_RAD_S: f64 = 0.15;
/// Least time of a window in ns: in two the least friction of Table 1 stops a rotor of 2 rad/s.
const WINDOW_NANOS: u64 = 1_600_000;
/// Square of the standard deviations within which the slope is zero.
const GATE: f64 = 16.0;
/// Variance of a slope that the ringing of the stator causes, in rad^2/s^2: twice 0.6 mrad/s.
const RINGING_RAD2_S2: f64 = 1.4e-6;
/// What a motion at rest counts, in contradicting slopes, and how many of those double the time.
const WITHDRAWN: u8 = 4;
const CONTRADICTIONS_MAX: u8 = 23;
/// Doublings of the time where the vibrometer shows a motion.
const DISPUTED_DOUBLINGS: u8 = 3;

/// Sums over the frames of a window.
#[derive(Clone, Copy, Debug, Default)]
struct Window<T> {
    first: Option<(Time, Angle)>,
    newest: Time,
    n: T,
    t: T,
    tt: T,
    y: T,
    ty: T,
}

/// The frames of a rotor that may have stopped.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RestTest<T> {
    window: Window<T>,
    /// Whether the first window has passed.
    slow: bool,
    contradictions: u8,
    /// Whether the vibrometer shows a flight.
    pub(crate) disputed: bool,
}

impl<T: Real> RestTest<T> {
    pub(crate) fn begin(&mut self) {
        self.window = Window::default();
    }

    /// The rotor is not slow: begins with the first window.
    pub(crate) fn restart(&mut self) {
        self.begin();
        self.slow = false;
    }

    /// The frames contradict rest.
    pub(crate) fn withdraw(&mut self) {
        self.contradictions = self.contradictions.saturating_add(WITHDRAWN).min(CONTRADICTIONS_MAX);
        self.restart();
    }

    /// Takes in a frame of a slow rotor, of variance `camera_rad2`; returns whether it is at rest. A frame that is not
    /// newer begins the window anew: the tracker has gone back for a late one.
    pub(crate) fn confirms(&mut self, at: Time, angle: Angle, camera_rad2: T) -> bool {
        if self.window.first.is_some() && at <= self.window.newest {
            self.begin();
        }
        self.window.newest = at;
        let Window { first, n, t: sum_t, tt, y: sum_y, ty, .. } = &mut self.window;
        let (first_at, first_angle) = *first.get_or_insert((at, angle));
        let t: T = at.seconds_since(first_at);
        let y: T = angle.minus(first_angle).wrapped().radians_since(Angle::ZERO);
        *n += T::one();
        *sum_t += t;
        *tt += t * t;
        *sum_y += y;
        *ty += t * y;
        // slope = product / spread, its variance noise / spread.
        let (spread, noise) = (*tt * *n - *sum_t * *sum_t, camera_rad2 * *n);
        let product = *ty * *n - *sum_t * *sum_y;
        let doublings =
            (self.contradictions / WITHDRAWN).max(if self.disputed { DISPUTED_DOUBLINGS } else { 0 });
        let slope_rad2_s2 = T::from_f64(SLOPE_RAD_S * SLOPE_RAD_S) / T::from_i32(1 << (3 * doublings));
        // Written so that one frame is too few.
        let known = spread > T::zero() && spread * slope_rad2_s2 >= noise;
        if !known || at.nanos_since(first_at) < WINDOW_NANOS << doublings {
            return false;
        }
        self.begin();
        let first_window = !core::mem::replace(&mut self.slow, true);
        let limit = T::from_f64(GATE) * spread * (noise + T::from_f64(RINGING_RAD2_S2) * spread);
        let zero = product * product <= limit;
        if !zero && !first_window {
            self.contradictions = self.contradictions.saturating_add(1).min(CONTRADICTIONS_MAX);
        }
        zero && !first_window
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instruments::CameraDescription;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// Frames of a camera with this variance in rad^2 and period in us until a rotor that shows nothing but one angle
    /// is at rest.
    fn frames(test: &mut RestTest<f64>, camera_rad2: f64, period_us: u64) -> u64 {
        let at = |n: u64| Time::from_micros(1_000_000 + period_us * n);
        (1..100_000).find(|&n| test.confirms(at(n), Angle::ZERO, camera_rad2)).unwrap()
    }

    /// Two windows of the default camera on one mark, by hand: `S = dt^2 n (n^2 - 1) / 12` is R / 0.0225 of 16.8
    /// frames. Two marks reach it in 1.4 ms and wait for 1.6; two frames of a slow camera are enough; a hundred times
    /// the variance takes the cube root of it, 4.6 times as long.
    #[test]
    fn exact_frames_of_the_default_and_of_extreme_cameras() {
        for (camera_rad2, period_us, expected) in [
            (8.766e-8, 100, 34),
            (4.383e-8, 100, 34),
            (1e-7, 100_000, 4),
            (0.0, 100_000, 4),
            (8.766e-6, 100, 156),
        ] {
            assert_eq!(frames(&mut RestTest::default(), camera_rad2, period_us), expected, "{camera_rad2}");
        }
    }

    /// A rotor that the vibrometer sees fly is watched eight times as long, whatever was withdrawn before, and as
    /// long as that lasts.
    #[test]
    fn exact_a_disputed_rest_takes_longer() {
        let mut test = RestTest::default();
        let mut taken = |disputed: bool, withdrawn: bool| {
            test.restart();
            test.disputed = disputed;
            if withdrawn {
                test.withdraw();
            }
            frames(&mut test, 8.766e-8, 100)
        };
        assert_eq!(
            [taken(false, false), taken(true, false), taken(true, true), taken(false, false)],
            [34, 268, 268, 68]
        );
    }

    /// The share of windows that a rotor of this rate passes after so many withdrawals.
    fn passed(rate_rad_s: f64, withdrawals: u8) -> f64 {
        let (camera, runs) = (CameraDescription::default(), 400);
        let mut rng = Pcg64::seed_from_u64(7);
        let mut count = 0;
        for _ in 0..runs {
            let mut test = RestTest::<f32>::default();
            (0..withdrawals).for_each(|_| test.withdraw());
            let mut ended = 0;
            for n in 0.. {
                let at = Time::from_micros(100 * n);
                let noise: f64 = StandardNormal.sample(&mut rng);
                let angle = rate_rad_s * 1e-4 * n as f64 + camera.variance_rad2().sqrt() * noise;
                let zero =
                    test.confirms(at, Angle::from_degrees(angle.to_degrees()), camera.variance_rad2() as f32);
                ended += u32::from(test.window.first.is_none());
                if ended == 2 {
                    count += u32::from(zero);
                    break;
                }
            }
        }
        f64::from(count) / f64::from(runs)
    }

    /// Four standard deviations: a rotor at rest passes (6e-5 do not), one of 1.05 rad/s, seven of them, does not (1 in
    /// 700 does), and after five doublings of the time neither does one of 6 mrad/s.
    #[test]
    fn law_a_rotor_at_rest_passes_and_one_that_coasts_does_not() {
        assert!(passed(0.0, 0) > 0.99);
        assert!(passed(1.05, 0) < 0.02);
        assert!(passed(0.02, 5) < 0.02);
    }

    /// A rotor that turns contradicts its rest in every window but the first, and every fourth contradiction makes the
    /// windows twice as long: `n (n^2 - 1) = 12 R / (0.15 dt)^2` times 1, 8 and 64 is 17, 34 and 67 frames.
    #[test]
    fn exact_contradictions_make_the_windows_longer() {
        let (mut test, mut begun, mut lengths) = (RestTest::<f64>::default(), 0, [0; 10]);
        let mut n = 0;
        for length in &mut lengths {
            loop {
                n += 1;
                let angle = Angle::from_degrees((5e-4 * n as f64).to_degrees());
                assert!(!test.confirms(Time::from_micros(100 * n), angle, 8.766e-8));
                if test.window.first.is_none() {
                    break;
                }
            }
            *length = n - core::mem::replace(&mut begun, n);
        }
        assert_eq!(lengths, [17, 17, 17, 17, 17, 34, 34, 34, 34, 67]);
    }
}
