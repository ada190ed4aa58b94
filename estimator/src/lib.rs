//! Rotor angle and rate from what a camera and a laser-Doppler vibrometer (LDV) see.
//!
//! # In the order of the data
//!
//! - [`CameraFrame`], [`LdvSample`]: measurements, each with the time at which it was taken.
//! - [`RestDetector`]: from the rotor's vertical velocity, whether it is still being struck; with the drive, [`MotionWatch`] makes a [`Motion`] of it.
//! - [`ImpactDetector`]: from its jumps, when it is struck and how hard.
//! - [`AngleFilter`]: what every filter does. [`ConstantRate`]: angle and rate from the camera alone. [`ImpactAided`]: the same two states, kicked where
//!   the vibrometer hears an impact. [`TwinFilter`]: the motor's twin, carried through each impact that was heard, says which tooth struck and how much it kicked.
//!   Their covariances are kept factorised, in [`AngleRateCovariance`] and the core; gate, lag of late frames, new start and rest are one code for all.
//! - [`UdCovariance`]: the numerical core, for any small number of states (below).
//! - [`AngleFilter::smoothed`]: the same after the fact, from the frames since as well.
//! - [`Innovation`]: what became of a measurement, used or not, and why.
//! - [`Estimate`]: angle and rate at an instant, with their variances. [`Health`]: whether it may be used.
//!
//! # The core
//!
//! [`UdCovariance`] keeps the covariance of N states as `P = U D U'`, so that it is symmetric and not negative by construction, in `f32` as in
//! `f64`. It is predicted through a [`Transition`] whose shape is known by its type - [`UpperTriangular`] for chains of integrators, [`Blocks2`] for
//! lightly damped modes, [`Dense`] for the rest - and a list of [`NoiseSource`]s; takes scalar measurements in one by one, refusing what is no number
//! with a reason ([`Refusal`]); and passes through any linear map, such as an impact's saltation matrix ([`UdCovariance::transform`]). The
//! filter's state is a vector of the caller's: [`Transition::carry`] moves it, [`UdCovariance::update`] corrects it.
//!
//! ```
//! use estimator::{Blocks2, NoiseSource, Transition, UdCovariance};
//! use nalgebra::{Matrix2, Vector2};
//!
//! // A mode (displacement, velocity over natural frequency), 0.1 rad a step, whose displacement is measured.
//! let transition = Blocks2([Matrix2::new(0.995, 0.0998, -0.0998, 0.995)]);
//! let noise = [NoiseSource { gain: Vector2::new(0.0, 1.0), variance: 1e-6 }];
//! let mut covariance = UdCovariance::from_diagonal(&Vector2::new(1.0_f32, 1.0));
//! let mut state = Vector2::new(0.0_f32, 0.0);
//! for measured in [0.10, 0.19, 0.29] {
//!     state = transition.carry(&state);
//!     covariance.predict(&transition, &noise);
//!     let innovation = measured - state.x;
//!     let correction = covariance.update(&Vector2::new(1.0, 0.0), 1e-4, innovation, &mut state)?;
//!     assert!(correction.normalised_squared < 9.0);
//! }
//! assert!((state.x - 0.29).abs() < 0.01 && covariance.variance::<0>() < 1e-4);
//! # Ok::<(), estimator::Refusal>(())
//! ```
//!
//! [`ConstantRate`]'s two states have their factors written out by hand in
//! [`AngleRateCovariance`]: the zeros and ones of its model save a tenth of the time there.
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code. No call can fail or panic; every measurement passes a gate and leaves an
//! [`Innovation`]. Angles are integers ([`motor_model::Angle`]), so nothing is lost over a million turns in `f32`.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | innovation | measurement less its prediction |
//! | test ratio | innovation squared over the gate's limit of its variance: above 1 is refused |
//! | gain | correction of each state per innovation |
//! | noise source | a random input of known variance and its effect on each state |
//! | process noise | how much the rate may wander in a second, in rad^2/s^3 |
//! | kick | sudden change of the rate at an impact |
//! | zero-rate update | telling the filter that a rotor at rest does not turn |

#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::disallowed_methods,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a test fails by panicking, and takes its yardsticks from another library"
    )
)]

mod camera;
mod factorised;
mod filter;
mod filters;
mod innovation;
mod measurement;
#[cfg(test)]
mod test_support;
mod vibrometer;

pub use camera::track::{Jitter, TrackTuning};
pub use camera::tracker::{FRAMES_KEPT, STUCK_FRAMES};
pub use factorised::angle_rate::AngleRateCovariance;
pub use factorised::transition::{Blocks2, Dense, Transition, UpperTriangular};
pub use factorised::ud_covariance::{Correction, NoiseSource, NotPositiveDefinite, Refusal, UdCovariance};
pub use filter::{AngleFilter, Estimate, Health, Reason};
pub use filters::constant_rate::{ConstantRate, ConstantRateTuning, WanderTuning};
pub use filters::impact_aided::ringing::RingingTuning;
pub use filters::impact_aided::{IMPACTS_KEPT_MAX, ImpactAided, ImpactAidedTuning};
pub use filters::twin::{ContactTuning, TwinFilter, TwinPrior, TwinTuning};
pub use innovation::{Innovation, Rejection, Source, Verdict};
pub use measurement::{CameraFrame, LdvSample};
pub use vibrometer::impact_detector::{ImpactDetector, ImpactDetectorTuning, VibrometerEvent};
pub use vibrometer::motion::{Motion, MotionWatch};
pub use vibrometer::rest::{RestDetector, RestTuning};
