//! `ode_solvers`: Dormand-Prince 5(4) without events. A step that ends below the plate stops it. The impact is a root
//! of the cubic through both ends of that step.

use ode_solvers::dop_shared::IntegrationError;
use ode_solvers::{Dopri5, OutputType, System, Vector2};

use super::super::vibrating_plate::{ABSOLUTE_TOLERANCE, Ball, RELATIVE_TOLERANCE, VibratingPlate};
use super::{PEER_STEP_S, descent};

struct BallInFlight<'a>(&'a VibratingPlate);

impl System<f64, Vector2<f64>> for BallInFlight<'_> {
    fn system(&self, _: f64, y: &Vector2<f64>, dy: &mut Vector2<f64>) {
        dy.x = y.y;
        dy.y = self.0.acceleration_m_s2(y.y);
    }

    fn solout(&mut self, x: f64, y: &Vector2<f64>, _: &Vector2<f64>) -> bool {
        y.x <= self.0.height_m(x)
    }
}

/// Times of the impacts.
pub fn impacts(plate: &VibratingPlate, start_m: f64, until_s: f64) -> Result<Vec<f64>, String> {
    let mut times_s = Vec::new();
    let mut ball = Ball { time_s: 0.0, height_m: start_m, velocity_m_s: 0.0 };
    while ball.time_s < until_s {
        let [before, after] = flight(plate, &ball, until_s).map_err(|error| error.to_string())?;
        if plate.gap_m(&after) > 0.0 {
            break;
        }
        let time_s = descent(before.time_s, after.time_s, |time_s| {
            plate.gap_m(&between(plate, &before, &after, time_s))
        });
        times_s.push(time_s);
        ball = plate.after_impact(&between(plate, &before, &after, time_s));
    }
    Ok(times_s)
}

/// The last step of a flight from `ball`.
fn flight(plate: &VibratingPlate, ball: &Ball, until_s: f64) -> Result<[Ball; 2], IntegrationError> {
    let start = Vector2::new(ball.height_m, ball.velocity_m_s);
    let mut solver = Dopri5::from_param(
        BallInFlight(plate),
        ball.time_s,
        until_s,
        until_s,
        start,
        RELATIVE_TOLERANCE,
        ABSOLUTE_TOLERANCE,
        0.9,
        0.04,
        0.2,
        10.0,
        PEER_STEP_S,
        PEER_STEP_S,
        1_000_000,
        1_000_000,
        OutputType::Sparse,
    );
    solver.integrate()?;
    let points = solver.x_out().iter().zip(solver.y_out());
    let mut last = points.map(|(&time_s, y)| Ball { time_s, height_m: y.x, velocity_m_s: y.y }).rev().take(2);
    let after = last.next().unwrap_or(*ball);
    Ok([last.next().unwrap_or(*ball), after])
}

/// The cubic through height and velocity at both ends, and its slope.
fn between(plate: &VibratingPlate, before: &Ball, after: &Ball, time_s: f64) -> Ball {
    let h = after.time_s - before.time_s;
    let x = (time_s - before.time_s) / h;
    let hermite = |from: f64, slope: f64, to: f64, end_slope: f64| {
        let rise = to - from;
        from + x
            * (slope * h
                + x * ((3.0 * rise - (2.0 * slope + end_slope) * h)
                    + x * ((slope + end_slope) * h - 2.0 * rise)))
    };
    let acceleration = |ball: &Ball| plate.acceleration_m_s2(ball.velocity_m_s);
    Ball {
        time_s,
        height_m: hermite(before.height_m, before.velocity_m_s, after.height_m, after.velocity_m_s),
        velocity_m_s: hermite(
            before.velocity_m_s,
            acceleration(before),
            after.velocity_m_s,
            acceleration(after),
        ),
    }
}
