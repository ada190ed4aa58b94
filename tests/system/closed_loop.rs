//! The closed loop of motor, instruments, filter and controller.

mod law_decisions;
mod law_interrupted_moves;
mod law_late_interrupts;
mod law_latency;
mod law_other_instruments;
mod law_quiet_stator;
mod law_rate_limits;
mod law_resonance;
mod law_slow_camera;
mod tool_calibrate;
mod tool_commission;
mod tool_position;
mod tool_positioning_trials;
mod tool_unforeseen_motors;
