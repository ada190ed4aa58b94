//! Cost and error of a step of the fixed-step model.
//!
//! [`motor_model::Motor`] is timed, and compared with an event-driven integrator, [`mod@reference`], which shares no
//! line of its step. The motion is chaotic: two trajectories agree for about four impacts in `f64` and two in `f32`. So
//! single impacts from equal states are compared, and statistics.
//!
//! | module | what it is |
//! |---|---|
//! | [`method`] | what is compared: rule of impacts, precision, step |
//! | [`impact_map`] | time of the first impact, and the map from it to the next, from equal states |
//! | [`steady_motion`] | mean rate, impacts per second and collision frequency of steady motion |
//! | [`bursts`] | net displacement of a few cycles from rest |
//! | [`method_row`] | all of these of each method |
//! | [`averaged_moves`] | the averaged motor on long moves |
//! | [`step_cost`] | time of a step, and of a simulated millisecond |
//! | [`vibrating_plate`] | a ball on a vibrating plate: a problem for any integrator with events |
//! | [`peers`] | integrators of other crates and of SciPy on that problem |

pub mod averaged_moves;
pub mod bursts;
pub mod impact_map;
pub mod method;
pub mod method_row;
pub mod peers;
pub mod reference;
pub mod steady_motion;
pub mod step_cost;
pub mod vibrating_plate;
