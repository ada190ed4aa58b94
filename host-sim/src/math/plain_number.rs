//! Numbers as a person would write them.

/// The shortest text of a number, with an exponent where zeros would have to be counted.
pub fn plain(x: f64) -> String {
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) { format!("{x:e}") } else { format!("{x}") }
}
