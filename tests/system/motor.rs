//! The model of the motor, in the order of the data: stator, rotor, contact, energy, heights, whole motor.

mod exact_drive_phase;
mod exact_resonance;
mod exact_switching;

mod exact_flight;
mod exact_long_runs;

mod exact_located_impacts;
mod law_impact;
mod law_rebound;
mod law_rest;
mod law_sustained_contact;

mod law_energy;

mod law_heights;

mod dual_precision;
mod dual_step_convergence;
mod law_any_motor;
mod law_every_phase;
mod law_hard_cases;
mod law_hour_at_rest;
mod law_rotation_sense;
mod tilting;
mod tool_steady_rates;
