//! The genie: an oracle-aided lower bound. It is a Kalman filter that is given every kick of the rate.
//!
//! ```text
//! state (angle, rate):   angle += rate dt + a_k,   rate += r_k,   camera = angle + noise of variance R
//! ```
//!
//! `r_k` is the change of the rotor's rate in step `k` of the plant, by impacts, by friction in sustained contact and
//! by air. `a_k` is what that change adds to the angle within the step. A genie that is given them exactly has no
//! process noise. A genie that knows each kick of a contact to a share `s` is given `(1 + s n) (a_k, r_k)`, where `n`
//! is a standard normal number, drawn anew for every step with contact. It takes `(s r_k)^2` as the variance of the
//! kick.
//!
//! # Why it is a bound
//!
//! Every filter has to infer the kicks from the vibrometer and the camera. The mean square error of the best estimate
//! cannot rise when they are given. Given the kicks the system is linear, with white camera noise of variance R. It
//! starts at a known rate (rest) and at the angle of the first frame. For a linear system with Gaussian noise the
//! covariance of the Kalman filter is the posterior Cramer-Rao bound (Tichavsky, Muravchik and Nehorai 1998, IEEE
//! Trans. Signal Processing 46, 1386-1396, section III). Of all noise of variance R the Gaussian is the least
//! informative. So this bounds every estimator that uses no more of the camera's noise than its variance. An estimator
//! that knew the cells of the quantiser could be a little better. With inexact kicks the bound is one among estimators
//! that know the kicks to that share.
//!
//! The errors of an inexact genie are independent from step to step. Through a long sustained contact they average out.
//! The friction error of a real model does not. So the bound holds for a real model too.
//!
//! # State
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | angle | rad | angle of the rotor | the first frame's, variance R |
//! | 1 | rate | rad/s | rate of the rotor | 0 at the start, variance 1e-12 rad^2/s^2, with every kick since |

use std::collections::VecDeque;

use estimator::{
    AngleRateCovariance, CameraFrame, Estimate, Innovation, Rejection, Source, TrackCovariance as _, Verdict,
};
use motor_model::{Angle, AngleAccumulator, Time};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::kicks::Kick;
use simulation::math::random_streams;

/// Variance of the rate of a rotor that is known to start at rest, in rad^2/s^2.
const REST_RAD2_S2: f64 = 1e-12;

/// A kick as the genie is given it, with its variance in rad^2/s^2.
#[derive(Clone, Copy, Debug)]
struct GivenKick {
    kick: Kick,
    variance_rad2_s2: f64,
}

impl GivenKick {
    /// Both parts of the span, cut at `at` inside it, as if the acceleration were constant.
    fn cut(self, at: Time) -> [Self; 2] {
        let Self { kick, variance_rad2_s2 } = self;
        let late_s: f64 = kick.until.seconds_since(at);
        let part = 1.0 - late_s / kick.span_s;
        let early_s = part * kick.span_s;
        let early_rad_s = part * kick.rate_rad_s;
        let early_rad = part * part * kick.angle_rad;
        let early =
            Kick { until: at, span_s: early_s, angle_rad: early_rad, rate_rad_s: early_rad_s, ..kick };
        let late = Kick {
            span_s: late_s,
            angle_rad: kick.angle_rad - early_rad - early_rad_s * late_s,
            rate_rad_s: kick.rate_rad_s - early_rad_s,
            ..kick
        };
        [
            Self { kick: early, variance_rad2_s2: part * variance_rad2_s2 },
            Self { kick: late, variance_rad2_s2: (1.0 - part) * variance_rad2_s2 },
        ]
    }
}

/// The Kalman filter that is given the kicks.
#[derive(Clone, Debug)]
pub struct Genie {
    share: f64,
    errors: Pcg64,
    camera_rad2: f64,
    /// Angle and rate at the last frame.
    track: Option<GenieTrack>,
    /// The kicks since.
    given: VecDeque<GivenKick>,
    /// The track carried through the kicks.
    ahead: Option<GenieTrack>,
}

/// Angle and rate at an instant, with their covariance.
#[derive(Clone, Copy, Debug)]
struct GenieTrack {
    at: Time,
    angle: AngleAccumulator<f64>,
    rate_rad_s: f64,
    covariance: AngleRateCovariance<f64>,
}

impl GenieTrack {
    fn through(&mut self, given: &GivenKick) {
        let Kick { until, span_s, angle_rad, rate_rad_s, .. } = given.kick;
        self.angle.turn_by_radians(self.rate_rad_s * span_s + angle_rad);
        self.rate_rad_s += rate_rad_s;
        self.covariance.predict(span_s, 0.0);
        if given.variance_rad2_s2 > 0.0 {
            self.covariance.widen_rate(given.variance_rad2_s2);
        }
        self.at = until;
    }

    /// Applies the kicks of `given` up to `until`, and removes them.
    fn advance(&mut self, given: &mut VecDeque<GivenKick>, until: Time) {
        while let Some(next) = given.pop_front() {
            if next.kick.until <= until {
                self.through(&next);
            } else if until.seconds_since::<f64>(self.at) > 0.0 {
                let [early, late] = next.cut(until);
                self.through(&early);
                return given.push_front(late);
            } else {
                return given.push_front(next);
            }
        }
    }
}

impl Genie {
    /// A genie that knows each kick to `share` of it, and the variance of the camera in rad^2.
    pub fn new(share: f64, camera_rad2: f64, seed: u64) -> Self {
        let errors = random_streams::stream(seed, random_streams::RandomSource::GenieKicks);
        Self { share, errors, camera_rad2, track: None, given: VecDeque::new(), ahead: None }
    }

    /// Gives it a kick.
    pub fn give(&mut self, kick: &Kick) {
        let mut given = GivenKick { kick: *kick, variance_rad2_s2: 0.0 };
        if kick.contact && self.share > 0.0 {
            let error: f64 = StandardNormal.sample(&mut self.errors);
            given.kick.angle_rad *= 1.0 + self.share * error;
            given.kick.rate_rad_s *= 1.0 + self.share * error;
            let deviation_rad_s = self.share * kick.rate_rad_s;
            given.variance_rad2_s2 = deviation_rad_s * deviation_rad_s;
        }
        if let Some(ahead) = &mut self.ahead {
            ahead.through(&given);
        }
        self.given.push_back(given);
    }

    /// Corrects by a frame, at its exposure or at the end of the last kick, whichever is earlier.
    pub fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<f64> {
        let (innovation_rad, variance_rad2, verdict) = match self.track.take() {
            Some(track) if frame.exposed_at <= track.at => {
                self.track = Some(track);
                (0.0, 0.0, Verdict::Rejected(Rejection::OutOfHorizon))
            }
            Some(track) => self.corrected(track, frame),
            None => self.started(frame),
        };
        self.ahead = self.track;
        if let Some(ahead) = &mut self.ahead {
            self.given.iter().for_each(|given| ahead.through(given));
        }
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad,
            variance_rad2,
            verdict,
        }
    }

    /// Begins at the frame's angle and at the rate of a rotor that was at rest before the first kick.
    fn started(&mut self, frame: &CameraFrame) -> (f64, f64, Verdict) {
        let mut track = GenieTrack {
            at: Time::ZERO,
            angle: AngleAccumulator::default(),
            rate_rad_s: 0.0,
            covariance: AngleRateCovariance::diagonal(self.camera_rad2, REST_RAD2_S2),
        };
        track.advance(&mut self.given, frame.exposed_at);
        track.angle = AngleAccumulator::at(frame.angle);
        self.track = Some(track);
        (0.0, 0.0, Verdict::Restarted)
    }

    fn corrected(&mut self, mut track: GenieTrack, frame: &CameraFrame) -> (f64, f64, Verdict) {
        track.advance(&mut self.given, frame.exposed_at);
        let innovation_rad = frame.angle.minus(track.angle.angle()).wrapped().radians_since(Angle::ZERO);
        let variance_rad2 = track.covariance.innovation_rad2(self.camera_rad2);
        let [angle, rate] = track.covariance.update_angle(self.camera_rad2);
        track.angle.turn_by_radians(angle * innovation_rad);
        track.rate_rad_s += rate * innovation_rad;
        self.track = Some(track);
        (innovation_rad, variance_rad2, Verdict::Used)
    }

    /// Angle and rate at the end of the last kick; `None` before the first frame.
    pub fn estimate(&self) -> Option<Estimate<f64>> {
        self.ahead.map(|ahead| Estimate {
            at: ahead.at,
            angle: ahead.angle.angle(),
            rate_rad_s: ahead.rate_rad_s,
            angle_rad2: ahead.covariance.angle_rad2(),
            angle_rate_rad2_s: ahead.covariance.angle_rate_rad2_s(),
            rate_rad2_s2: ahead.covariance.rate_rad2_s2(),
            resting: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPAN_S: f64 = 1e-4;
    const CAMERA_RAD2: f64 = 8.8e-8;

    fn kick(n: u64, rate_rad_s: f64) -> Kick {
        Kick {
            until: Time::from_micros(100 * n),
            span_s: SPAN_S,
            angle_rad: 0.5 * SPAN_S * rate_rad_s,
            rate_rad_s,
            contact: true,
        }
    }

    /// A rotor that starts at rest and is kicked in both directions, with an exact camera after each span. Its true
    /// angle and rate at the end.
    fn follow(genie: &mut Genie, spans: u64) -> (f64, f64) {
        let (mut angle_rad, mut rate_rad_s) = (0.0, 0.0);
        for n in 1..=spans {
            #[expect(clippy::cast_precision_loss, reason = "small numbers")]
            let kick = kick(n, 3.0 * motor_model::math::sin_cos(0.7 * n as f64).0);
            angle_rad += rate_rad_s * SPAN_S + kick.angle_rad;
            rate_rad_s += kick.rate_rad_s;
            genie.give(&kick);
            let angle = Angle::from_degrees(angle_rad.to_degrees()).wrapped();
            genie.update_camera(&CameraFrame::new(kick.until, angle));
        }
        (angle_rad, rate_rad_s)
    }

    /// Kicks known and the rate at the start too, so n frames are n measurements of one unknown angle: variance R / n.
    #[test]
    fn exact_with_exact_kicks_the_variance_is_that_of_a_mean() {
        let mut genie = Genie::new(0.0, CAMERA_RAD2, 1);
        let (angle_rad, rate_rad_s) = follow(&mut genie, 50);
        let estimate = genie.estimate().unwrap();
        assert!((estimate.angle_rad2 / (CAMERA_RAD2 / 50.0) - 1.0).abs() < 1e-3, "{}", estimate.angle_rad2);
        let off_rad: f64 =
            estimate.angle.minus(Angle::from_degrees(angle_rad.to_degrees())).radians_since(Angle::ZERO);
        assert!(off_rad.abs() < 1e-8 && (estimate.rate_rad_s - rate_rad_s).abs() < 1e-6, "{off_rad}");
    }

    /// A kick that no frame has shown adds (s r)^2 to the variance of the rate and, later, dt^2 times that to the
    /// angle's.
    #[test]
    fn exact_an_inexact_kick_adds_its_variance() {
        let mut genie = Genie::new(0.1, CAMERA_RAD2, 1);
        genie.update_camera(&CameraFrame::new(Time::ZERO, Angle::ZERO));
        genie.give(&kick(1, 2.0));
        let kicked = genie.estimate().unwrap();
        assert!((kicked.rate_rad2_s2 - 0.04).abs() < 1e-9, "{}", kicked.rate_rad2_s2);
        assert!((kicked.angle_rad2 - CAMERA_RAD2).abs() < 1e-12);
        genie.give(&kick(2, 0.0));
        let later = genie.estimate().unwrap();
        assert!((later.angle_rad2 - CAMERA_RAD2 - SPAN_S * SPAN_S * 0.04).abs() < 1e-12);
    }

    /// The errors of the kicks have the variance that it takes for them: the mean square of (given - true) over it is
    /// 1.
    #[test]
    fn law_an_inexact_genie_is_given_errors_of_its_variance() {
        let mut genie = Genie::new(0.03, CAMERA_RAD2, 9);
        (1..=10_000).for_each(|n| genie.give(&kick(n, 2.0)));
        let squares = genie.given.iter().map(|given| {
            let error = given.kick.rate_rad_s - 2.0;
            error * error / given.variance_rad2_s2
        });
        let mean = squares.sum::<f64>() / 1e4;
        // Four standard errors of the mean of 10,000 squares of a normal.
        assert!((mean - 1.0).abs() < 0.057, "{mean}");
    }

    #[test]
    fn exact_air_drag_is_known_to_every_genie() {
        let mut genie = Genie::new(0.1, CAMERA_RAD2, 1);
        let kick = Kick { contact: false, ..kick(1, 2.0) };
        genie.give(&kick);
        assert_eq!(genie.given[0].kick, kick);
        assert!(genie.given[0].variance_rad2_s2 <= 0.0);
    }

    /// A span that is cut in two ends where the whole span ends.
    #[test]
    fn law_a_frame_within_a_span_changes_nothing_of_the_motion() {
        let through = |cuts: &[u64]| {
            let whole =
                GivenKick { kick: Kick { angle_rad: 0.3 * SPAN_S, ..kick(1, 1.0) }, variance_rad2_s2: 0.04 };
            let mut track = GenieTrack {
                at: Time::ZERO,
                angle: AngleAccumulator::default(),
                rate_rad_s: 5.0,
                covariance: AngleRateCovariance::diagonal(CAMERA_RAD2, 1.0),
            };
            let mut given = VecDeque::from([whole]);
            for &us in cuts {
                track.advance(&mut given, Time::from_micros(us));
            }
            track
        };
        let (whole, cut) = (through(&[100]), through(&[17, 17, 60, 100]));
        assert_eq!(whole.at, cut.at);
        assert!((whole.angle.angle().units() - cut.angle.angle().units()).abs() <= 3);
        assert!((whole.rate_rad_s - cut.rate_rad_s).abs() < 1e-12);
        let variances = [&whole, &cut].map(|track| track.covariance.rate_rad2_s2());
        assert!((variances[0] - variances[1]).abs() < 1e-12);
    }
}
