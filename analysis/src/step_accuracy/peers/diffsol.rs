//! `diffsol`: Tsitouras 5(4) with its own root finding. It has no largest step. A stop time after every step keeps it
//! from stepping over an impact.

use diffsol::{NalgebraMat, OdeBuilder, OdeSolverMethod as _, OdeSolverStopReason, Vector as _};

use super::super::vibrating_plate::{ABSOLUTE_TOLERANCE, Ball, RELATIVE_TOLERANCE, VibratingPlate};
use super::PEER_STEP_S;

/// Times of the impacts.
pub fn impacts(plate: &VibratingPlate, start_m: f64, until_s: f64) -> Result<Vec<f64>, String> {
    run(plate, start_m, until_s).map_err(|error| error.to_string())
}

fn run(plate: &VibratingPlate, start_m: f64, until_s: f64) -> Result<Vec<f64>, diffsol::error::DiffsolError> {
    let problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(RELATIVE_TOLERANCE)
        .atol([ABSOLUTE_TOLERANCE, ABSOLUTE_TOLERANCE])
        .h0(PEER_STEP_S)
        .rhs(|y, _p, _t, dy| {
            dy[0] = y[1];
            dy[1] = plate.acceleration_m_s2(y[1]);
        })
        .init(
            |_p, _t, y| {
                y[0] = start_m;
                y[1] = 0.0;
            },
            2,
        )
        .root(|y, _p, t, gap| gap[0] = y[0] - plate.height_m(t), 1)
        .build()?;
    let mut solver = problem.tsit45()?;
    let mut times_s = Vec::new();
    while solver.state().t < until_s {
        let stop_s = (solver.state().t + PEER_STEP_S).min(until_s);
        solver.set_stop_time(stop_s)?;
        loop {
            match solver.step()? {
                OdeSolverStopReason::InternalTimestep => {}
                OdeSolverStopReason::TstopReached => break,
                OdeSolverStopReason::RootFound(time_s, _) => {
                    times_s.push(time_s);
                    let met = solver.interpolate(time_s)?;
                    let (height_m, velocity_m_s) = (met.get_index(0), met.get_index(1));
                    let ball = plate.after_impact(&Ball { time_s, height_m, velocity_m_s });
                    solver.state_mut_back(time_s)?;
                    let state = solver.state_mut();
                    *state.t = ball.time_s;
                    state.y.set_index(0, ball.height_m);
                    state.y.set_index(1, ball.velocity_m_s);
                    state.dy.set_index(0, ball.velocity_m_s);
                    state.dy.set_index(1, plate.acceleration_m_s2(ball.velocity_m_s));
                    break;
                }
            }
        }
    }
    Ok(times_s)
}
