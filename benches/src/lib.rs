//! Benchmarks by criterion: `cargo bench -p benches`. This library holds what they share with the system tests.
//!
//! | benchmark | measures |
//! |---|---|
//! | `driven_step` | a driven step of the motor without impact, inlined into one loop |
//! | `motor_step` | a step of the motor, in flight, in steady motion and at rest |
//! | `kalman` | a step of a Kalman filter, by this project and by other crates |
//! | `kalman_table` | the same beside its error on ill-conditioned problems |

pub mod matrix_covariance;
