//! One binary of system tests.
//!
//! Helpers first, then the tests in the order of the data: stator, rotor, contact, account, heights, whole motor, estimator's core, command
//! line, closed loop.

mod closeness;
mod command;
mod fault_bench;
mod live_teeth;
mod oscillator;
mod precise_filter;
mod scene;
mod steady;
mod tooth;

mod exact_beating;
mod exact_drive_phase;
mod exact_resonance;
mod exact_switching;

mod exact_flight;
mod exact_long_runs;

mod exact_located_impacts;
mod law_impact;
mod law_pressed;
mod law_rebound;
mod law_rest;

mod law_energy;

mod law_heights;

mod dual_precision;
mod dual_step_convergence;
mod law_any_motor;
mod law_every_phase;
mod law_hard_cases;
mod law_hour_at_rest;
mod law_rotation_sense;
mod law_twin_filter;
mod tool_steady_rates;

mod dual_covariance;
mod law_camera_faults;
mod law_consistency;
mod law_covariance_endurance;
mod law_faults_of_many_motors;
mod law_impact_aided;
mod law_vibrometer_faults;

mod tool_accuracy;
mod tool_calibrate;
mod tool_command_line;
mod tool_estimate;
mod tool_filters;
mod tool_positioning;
