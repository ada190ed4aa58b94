//! `differential-equations`: Dormand-Prince 5(4) with dense output. Its event detection skips the first step after a
//! restart, where a short flight ends, so the output hook finds the impact.

use differential_equations::prelude::*;

use super::super::vibrating_plate::{ABSOLUTE_TOLERANCE, Ball, RELATIVE_TOLERANCE, VibratingPlate};
use super::{PEER_STEP_S, descent};

struct BallInFlight<'a>(&'a VibratingPlate);

impl ODE<f64, [f64; 2]> for BallInFlight<'_> {
    fn diff(&self, _: f64, y: &[f64; 2], dydt: &mut [f64; 2]) {
        *dydt = [y[1], self.0.acceleration_m_s2(y[1])];
    }
}

struct Bounce<'a> {
    plate: &'a VibratingPlate,
    times_s: Vec<f64>,
}

impl Solout<f64, [f64; 2]> for Bounce<'_> {
    fn solout<I: Interpolation<f64, [f64; 2]> + ?Sized>(
        &mut self,
        now_s: f64,
        before_s: f64,
        now: &[f64; 2],
        _: &[f64; 2],
        interpolator: &mut I,
        _: &mut Solution<f64, [f64; 2]>,
    ) -> ControlFlag<f64, [f64; 2]> {
        if now_s <= before_s || now[0] > self.plate.height_m(now_s) {
            return ControlFlag::Continue;
        }
        let interpolator = std::cell::RefCell::new(interpolator);
        let at = |time_s| {
            let [height_m, velocity_m_s] = interpolator.borrow_mut().interpolate(time_s).unwrap_or(*now);
            Ball { time_s, height_m, velocity_m_s }
        };
        let time_s = descent(before_s, now_s, |time_s| self.plate.gap_m(&at(time_s)));
        self.times_s.push(time_s);
        let ball = self.plate.after_impact(&at(time_s));
        ControlFlag::ModifyState(ball.time_s, [ball.height_m, ball.velocity_m_s])
    }
}

/// Times of the impacts.
pub fn impacts(plate: &VibratingPlate, start_m: f64, until_s: f64) -> Result<Vec<f64>, String> {
    let method = ExplicitRungeKutta::dopri5()
        .rtol(RELATIVE_TOLERANCE)
        .atol(ABSOLUTE_TOLERANCE)
        .h_max(PEER_STEP_S)
        .max_steps(1_000_000);
    let mut bounce = Bounce { plate, times_s: Vec::new() };
    differential_equations::ode::solve_ode(
        &mut { method },
        &BallInFlight(plate),
        0.0,
        until_s,
        &[start_m, 0.0],
        &mut bounce,
    )
    .map_err(|error| format!("{error:?}"))?;
    Ok(bounce.times_s)
}
