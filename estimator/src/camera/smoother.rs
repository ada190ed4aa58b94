//! States at an earlier instant: a fixed-lag smoother over the frames that a filter keeps.
//!
//! Information of later frames is carried back from frame to frame ([`ud_filter::smooth`], after Rauch, Tung and
//! Striebel):
//!
//! ```text
//! C = P F' (P-)^-1,    x^s = x + C (x^s+ - x-),    P^s = (1 - C F) P (1 - C F)' + C (P^s+ + Q) C'
//! ```
//!
//! Here x, P are the filter's at the earlier instant, x-, P- the same carried to the later instant, and + marks the
//! smoothed values there. The Jacobian F of what happens on the way and the noise Q are found by carrying [`Carried`]
//! in place of the covariance. All states of a filter's track are smoothed together, since a kick mixes them. For a
//! linear process the result is the least-squares fit to all frames kept.

use motor_model::{AngleAccumulator, Real, Time};
use nalgebra::SVector;
use ud_filter::{Dense, KalmanFilter, SmootherStep, UdCovariance, smooth};

use crate::camera::process::{Jitter, Process};
use crate::camera::track::State;
use crate::camera::track_covariance::{Carried, SmoothedCovariance, TrackCovariance as _};
use crate::filter::Estimate;

/// The states at an earlier instant with their covariance, from the frames before and after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Smoothed<T: Real, const N: usize> {
    at: Time,
    angle: AngleAccumulator<T>,
    /// The states, with 0 in place of the angle.
    states: SVector<T, N>,
    covariance: UdCovariance<T, N>,
}

/// `states` with this angle.
fn with_angle<T: Real, const N: usize>(mut states: SVector<T, N>, angle_rad: T) -> SVector<T, N> {
    states.iter_mut().take(1).for_each(|angle| *angle = angle_rad);
    states
}

fn first_of<T: Real, const N: usize>(states: &SVector<T, N>) -> [T; 2] {
    [0, 1].map(|state| states.get(state).copied().unwrap_or_default())
}

impl<T: Real, const N: usize> Smoothed<T, N> {
    /// The filter's own estimate, at the newest frame.
    pub(crate) fn newest<B: SmoothedCovariance<T, N>>(state: &State<T, B>) -> Self {
        Self {
            at: state.at,
            angle: state.angle,
            states: state.covariance.states(state.rate_rad_s),
            covariance: state.covariance.ud_covariance(),
        }
    }

    /// The smoothed values at the earlier `state`. `kick_rad2_s2` is the variance of a kick right after it. `None`
    /// where the numbers are too large for the precision.
    pub(crate) fn step_back_to<B: SmoothedCovariance<T, N>>(
        &self,
        state: &State<T, B>,
        resting: bool,
        kick_rad2_s2: T,
        process: &impl Process<T, Carried<T, B, N>>,
    ) -> Option<Self> {
        let &State { at, mut angle, rate_rad_s, covariance } = state;
        let mut ahead = State { at, angle, rate_rad_s, covariance: Carried::along(covariance) };
        ahead.covariance.widen_rate(kick_rad2_s2);
        process.carry(&mut ahead, resting, self.at);
        let State { covariance: carried, .. } = &ahead;
        let filter =
            KalmanFilter { state: covariance.states(rate_rad_s), covariance: covariance.ud_covariance() };
        let off_rad = self.angle.angle().radians_since(ahead.angle.angle());
        let later = with_angle(self.states, off_rad);
        let mut step = [SmootherStep {
            filter,
            transition: Dense(carried.jacobian()),
            noise: carried.noise.ud_covariance().sources(),
            predicted: carried.covariance.states(ahead.rate_rad_s),
        }];
        smooth(&mut step, &KalmanFilter { state: later, covariance: self.covariance }).ok()?;
        let [SmootherStep { filter: KalmanFilter { state, covariance }, .. }] = step;
        let [turn_rad, _] = first_of(&state);
        angle.turn_by_radians(turn_rad);
        Some(Self { at, angle, states: with_angle(state, T::zero()), covariance })
    }

    pub(crate) fn estimate(&self, resting: bool, jitter: Jitter<T>) -> Estimate<T> {
        let [[angle_rad2, _], [angle_rate_rad2_s, rate_rad2_s2]] =
            [0, 1].map(|state| first_of(&self.covariance.column(state)));
        let [_, rate_rad_s] = first_of(&self.states);
        Estimate {
            at: self.at,
            angle: self.angle.angle(),
            rate_rad_s,
            angle_rad2: angle_rad2 + jitter.angle_rad2,
            angle_rate_rad2_s,
            rate_rad2_s2: rate_rad2_s2 + jitter.rate_rad2_s2,
            resting,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::camera::process::Jitter;
    use crate::filter::AngleFilter as _;
    use crate::filters::constant_rate::{ConstantRate, ConstantRateTuning};
    use crate::tests::{FRAME_NANOS, frame};
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
