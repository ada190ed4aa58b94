//! Numbers as a person writes them.

/// The shortest text of a number, with an exponent below 1e-3 and from 1e6 on.
pub fn plain(x: f64) -> String {
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) { format!("{x:e}") } else { format!("{x}") }
}
