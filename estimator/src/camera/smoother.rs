//! Angle and rate at an earlier instant: a fixed-lag smoother over the frames that a filter keeps.
//!
//! Information of later frames is carried back from frame to frame (Rauch, Tung and Striebel):
//!
//! ```text
//! C = P F' (P-)^-1,    x^s = x + C (x^s+ - x-),    P^s = (1 - C F) P (1 - C F)' + C (P^s+ + Q) C'
//! ```
//!
//! Here x, P are the filter's at the earlier instant, x-, P- the same carried to the later instant, and + marks the
//! smoothed values there. The last form is a sum of squares, so it is positive definite whatever the rounding. P- is
//! inverted by its factors.
//!
//! - Q is what the filter's process adds on the way, kicks included. It is found by propagating a state known exactly.
//! - F is the Jacobian of the process, `[1 f_angle; 0 f_rate]`: `[1 dt; 0 1]` between impacts. Where teeth stick, less
//!   than 1 of the rate's error remains. Its second column is found by propagating a unit error of the rate
//!   ([`RateErrorResponse`]).
//!
//! For a linear process the result is the least-squares fit to all frames kept, weighted by their variances. The
//! largest lag is that of [`crate::FRAMES_KEPT`].
//!
//! [`crate::TwinFilter`] has no smoother. Its track has further states, and a frame corrects all of them: with angle
//! and rate alone, information on friction would be taken for information on the rate. The gain of all states is a
//! system of four equations for each frame and impact, 32 frames back, and it would improve less, because the twin's
//! uncertainty of a kick is a tenth of the other filters'.
//!
//! Sources: Rauch, Tung and Striebel, AIAA Journal 3 (1965) 1445-1450; the form of the covariance: Bierman (1977),
//! chapter X.

use motor_model::{Angle, AngleAccumulator, Real, Time};
use nalgebra::{Matrix2, Vector2};

use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::camera::track::{Jitter, Process, State};
use crate::camera::track_covariance::TrackCovariance;
use crate::filter::Estimate;

/// Angle and rate at an earlier instant with their covariance, from the frames before and after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Smoothed<T: Real> {
    at: Time,
    angle: AngleAccumulator<T>,
    rate_rad_s: T,
    covariance: Matrix2<T>,
}

/// The covariance as a matrix.
fn dense<T: Real>(factors: &AngleRateCovariance<T>) -> Matrix2<T> {
    let cross = factors.angle_rate_rad2_s();
    Matrix2::new(factors.angle_rad2(), cross, cross, factors.rate_rad2_s2())
}

/// What becomes of a unit error of the rate: the second column of the Jacobian F. It is propagated in place of a
/// covariance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RateErrorResponse<T> {
    angle: T,
    rate: T,
}

impl<T: Real> TrackCovariance<T> for RateErrorResponse<T> {
    fn begin(_angle_rad2: T, _rate_rad2_s2: T, _before: Option<&Self>) -> Self {
        Self { angle: T::zero(), rate: T::one() }
    }

    fn angle_rad2(&self) -> T {
        self.angle * self.angle
    }

    fn angle_rate_rad2_s(&self) -> T {
        self.angle * self.rate
    }

    fn rate_rad2_s2(&self) -> T {
        self.rate * self.rate
    }

    fn predict(&mut self, dt_s: T, _noise_rad2_s3: T) {
        self.angle += self.rate * dt_s;
    }

    fn widen_rate(&mut self, _variance_rad2_s2: T) {}

    fn kick_rate(&mut self, kept: T, _variance_rad2_s2: T) {
        self.rate *= kept;
    }

    fn correct_by_angle(&mut self, _innovation_rad: T, _noise_rad2: T) -> [T; 2] {
        [T::zero(); 2]
    }

    fn correct_by_rate(&mut self, _innovation_rad_s: T, _noise_rad2_s2: T) -> [T; 2] {
        [T::zero(); 2]
    }
}

/// A process whose Jacobian the smoother can find.
pub(crate) trait Reversible<T>: Process<T> + Process<T, RateErrorResponse<T>> {}

impl<T, P: Process<T> + Process<T, RateErrorResponse<T>>> Reversible<T> for P {}

impl<T: Real> Smoothed<T> {
    /// The filter's own estimate, at the newest frame.
    pub(crate) fn newest(state: &State<T>) -> Self {
        Self {
            at: state.at,
            angle: state.angle,
            rate_rad_s: state.rate_rad_s,
            covariance: dense(&state.covariance),
        }
    }

    /// The smoothed values at the earlier `state`. `kick_rad2_s2` is the variance of a kick right after it.
    pub(crate) fn step_back_to(
        &self,
        state: &State<T>,
        resting: bool,
        kick_rad2_s2: T,
        process: &impl Reversible<T>,
    ) -> Self {
        let carried = |covariance: AngleRateCovariance<T>| {
            let mut ahead = State { covariance, ..*state };
            ahead.covariance.widen_rate(kick_rad2_s2);
            process.carry(&mut ahead, resting, self.at);
            ahead
        };
        let predicted = carried(state.covariance);
        let noise = dense(&carried(AngleRateCovariance::diagonal(T::zero(), T::zero())).covariance);
        let State { at, angle, rate_rad_s, .. } = *state;
        let mut response =
            State { at, angle, rate_rad_s, covariance: RateErrorResponse::begin(T::zero(), T::zero(), None) };
        process.carry(&mut response, resting, self.at);
        let transition =
            Matrix2::new(T::one(), response.covariance.angle, T::zero(), response.covariance.rate);
        let before = dense(&state.covariance);
        let [[a, b], [c, d]] = (before * transition.transpose()).transpose().data.0;
        let ([a, b], [c, d]) =
            (predicted.covariance.times_inverse([a, b]), predicted.covariance.times_inverse([c, d]));
        let gain = Matrix2::new(a, b, c, d);
        let off_rad: T = self.angle.angle().radians_since(predicted.angle.angle());
        let [[angle_rad, rate_rad_s]] =
            (gain * Vector2::new(off_rad, self.rate_rad_s - predicted.rate_rad_s)).data.0;
        let mut angle = state.angle;
        angle.turn_by_radians(angle_rad);
        let kept = Matrix2::identity() - gain * transition;
        let covariance =
            kept * before * kept.transpose() + gain * (self.covariance + noise) * gain.transpose();
        Self { at: state.at, angle, rate_rad_s: state.rate_rad_s + rate_rad_s, covariance }
    }

    /// As an estimate.
    pub(crate) fn estimate(&self, resting: bool, jitter: Jitter<T>) -> Estimate<T> {
        let [[angle_rad2, angle_rate_rad2_s], [_, rate_rad2_s2]] = self.covariance.data.0;
        let angle: Angle = self.angle.angle();
        Estimate {
            at: self.at,
            angle,
            rate_rad_s: self.rate_rad_s,
            angle_rad2: angle_rad2 + jitter.angle_rad2,
            angle_rate_rad2_s,
            rate_rad2_s2: rate_rad2_s2 + jitter.rate_rad2_s2,
            resting,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::camera::track::Jitter;
    use crate::filter::AngleFilter as _;
    use crate::filters::constant_rate::{ConstantRate, ConstantRateTuning};
    use crate::test_support::{FRAME_NANOS, frame};
    use motor_model::{Angle, DriveCommand, DriveMode, Time};
    use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    /// Frames, and twice as many unknowns.
    const N: usize = 20;

    /// The smoother at every exposure against all frames at once by least squares: start, steps and frames weighted by
    /// their variances.
    #[test]
    fn dual_smoother_is_the_batch_fit() {
        let mut tuning = ConstantRateTuning::<f64>::default();
        // The fit knows neither jitter nor a quantiser.
        tuning.random_walk.jitter_b = Jitter::none();
        tuning.track.floor_rad2 = 0.0;
        let (q, r, dt) =
            (tuning.random_walk.impacted_b_rad2_s3, tuning.track.camera_rad2, FRAME_NANOS as f64 * 1e-9);
        let f = Matrix2::new(1.0, dt, 0.0, 1.0);
        let noise = Matrix2::new(dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt) * q;
        for seed in 0..10 {
            let mut rng = Pcg64::seed_from_u64(seed);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let mut filter = ConstantRate::new(&tuning);
            filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
            let mut information = SMatrix::<f64, 40, 40>::zeros();
            let mut right = SVector::<f64, 40>::zeros();
            let (mut angle, mut rate) = (0.1, 8.0);
            for n in 0..N {
                let seen = frame(1 + n as u64, angle + r.sqrt() * normal());
                filter.update_camera(&seen);
                let seen_rad: f64 = seen.angle.radians_since(Angle::ZERO);
                information[(2 * n, 2 * n)] += 1.0 / r;
                right[2 * n] += seen_rad / r;
                if n == 0 {
                    information[(1, 1)] += 1.0 / 400.0;
                } else {
                    let weight = noise.try_inverse().unwrap();
                    let mut step = SMatrix::<f64, 2, 40>::zeros();
                    step.fixed_view_mut::<2, 2>(0, 2 * n - 2).copy_from(&-f);
                    step.fixed_view_mut::<2, 2>(0, 2 * n).copy_from(&Matrix2::identity());
                    information += step.transpose() * weight * step;
                }
                rate += (q * dt).sqrt() * normal();
                angle += rate * dt;
            }
            let covariance = information.try_inverse().unwrap();
            let fit = covariance * right;
            for n in 0..N {
                let smoothed = filter.smoothed(Time::from_nanos((1 + n as u64) * FRAME_NANOS)).unwrap();
                let p: Matrix2<f64> = covariance.fixed_view::<2, 2>(2 * n, 2 * n).into_owned();
                let x = Vector2::new(smoothed.angle.radians_since::<f64>(Angle::ZERO), smoothed.rate_rad_s);
                let off = x - fit.fixed_rows::<2>(2 * n);
                // Angles are whole units of 1.5e-9 rad; a standard deviation is 1e-4 rad, and 1 rad/s.
                assert!(off.x.abs() < 6e-9 && off.y.abs() < 1e-4, "{seed} {n} {off}");
                let own = [smoothed.angle_rad2, smoothed.angle_rate_rad2_s, smoothed.rate_rad2_s2];
                for (own, batch) in own.into_iter().zip([p.m11, p.m12, p.m22]) {
                    assert!((own - batch).abs() < 1e-5 * batch.abs(), "{seed} {n} {own} {batch}");
                }
            }
        }
    }

    /// Before the oldest frame kept there is no answer; at the newest and after it the filter's own.
    #[test]
    fn exact_ends_of_the_lag() {
        let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
        filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
        (1..=100).for_each(|n| {
            filter.update_camera(&frame(n, 1e-3 * n as f64));
        });
        let at = |n: u64| filter.smoothed(Time::from_nanos(n * FRAME_NANOS));
        assert!(at(68).is_none() && at(69).is_some());
        let ahead = Time::from_nanos(101 * FRAME_NANOS);
        assert_eq!(filter.smoothed(ahead), filter.estimate(ahead));
        let variance = |n: u64| at(n).unwrap().angle_rad2;
        assert!(variance(80) < 0.7 * variance(100) && variance(80) > 0.0);
    }
}
