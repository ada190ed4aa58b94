//! The motor linearised about a run, for filters: what becomes of a small deviation of the state.
//!
//! The state in the order of [`STATES`], each degree of freedom as (position, velocity):
//!
//! ```text
//! x = (g_A, g_A', g_B, g_B', g_C, g_C', z, v_z, angle, rate)      in m, m/s, rad, rad/s
//! ```
//!
//! # Between impacts
//!
//! Free motion is linear, and no degree of freedom acts on another: `dx(t) = F dx(0)` with a block of 2 x 2 for each, the very propagators that
//! the step uses ([`FreeFlow`]). The drive adds the same to all states and is not seen in F.
//!
//! # Across an impact
//!
//! Pair p strikes where its gap `h(x) = z - phi . g` falls to zero, and the state jumps, `x+ = R(x-)` (see [`crate::ImpactLaw`]). A run that starts with a
//! deviation `dx` meets the tooth later by `dt = -n . dx / n . f`, with `n = grad h` and `f = x'` just before. Until then it still moves with `f`, where
//! the other run has jumped and moves with `f+`. Compared at one instant after both have struck,
//!
//! ```text
//! x~ = R(x- + dx + f dt) - f+ dt = x+ + Xi dx,      Xi = DR + (f+ - DR f) n' / (n . f)
//! ```
//!
//! This is the saltation matrix. Here `n . f = -a`, the speed of approach, so a graze has no linearisation. With `alpha . x = u' - v_z`, and the
//! rows `rho` by which the jump of the rate changes (stick and slip differ),
//!
//! ```text
//! DR = I + j alpha' + e_rate rho',      j = c (-recoil on g', +1 on v_z),   c = (1 + e) / (1 + r)
//! Xi = I + j alpha' + e_rate rho' + t n' / (n . f),     t = f+ - f - j (alpha . f) - e_rate (rho . f)
//! ```
//!
//! The identity and three terms of rank one: normal impulse, tangential impulse, timing ([`Saltation`]). Where the teeth slip under Coulomb's law,
//! `rho` is a multiple of `alpha` and the rank is two. Timing is what makes the motor chaotic: `t` on `g` and `z` is the jump of the velocities, so
//! a height that is off by 1 um at an approach of 0.1 m/s has moved the instant by 10 us.
//!
//! The derivative does not exist at a graze, where friction changes from slip to stick, nor where the paper's coefficient changes branch. There one of the two
//! sides is given.
//!
//! Sources: Aizerman and Gantmacher, "On the stability of periodic motions", J. Appl. Math. Mech. 22 (1958) 1065-1078; Leine and Nijmeijer,
//! "Dynamics and Bifurcations of Non-Smooth Mechanical Systems" (Springer, 2004), chapter 7; Kong, Payne, Zhu and Johnson, "Saltation Matrices:
//! The Essential Tool for Linearizing Hybrid Dynamical Systems", Proc. IEEE 112 (2024) 585-608.

mod flow;
mod saltation;
#[cfg(test)]
mod tests;

pub use flow::FreeFlow;
pub use saltation::{RankOne, Saltation};

/// Number of states: five degrees of freedom, A, B, C, height, angle, each with its velocity.
pub const STATES: usize = 10;
