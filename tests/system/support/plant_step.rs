//! The step of the true motor in tests of filters and of the closed loop.

/// Located contacts are converged at it (both `dual_step_convergence` of [`crate::motor`]): a fifth of the default's
/// steps for the same motion.
pub const CONVERGED: (&str, &str) = ("plant.step_s", "5e-6");
