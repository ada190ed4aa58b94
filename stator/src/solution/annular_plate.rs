//! Exact frequencies of a thin annular plate (Kirchhoff), for tests.
//!
//! ```text
//! W = A J_n(k r) + B Y_n(k r) + C I_n(k r) + D K_n(k r)
//! clamped rim:  W = 0, W' = 0
//! free rim:     L - (1 - nu) (W' / r - n^2 W / r^2) = 0,   L' - (1 - nu) n^2 / r^2 (W' - W / r) = 0,  L = Laplace W
//! ```
//!
//! `L` is `-k^2 W` for J and Y, `+k^2 W` for I and K. The four conditions have a solution at the roots of their
//! determinant; `omega a^2 sqrt(rho t / D) = (k a)^2` (Leissa, Vibration of Plates, NASA SP-160, 1969).

/// How a rim is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rim {
    Free,
    Clamped,
}

fn bessel_i(n: i32, x: f64) -> f64 {
    let n = n.unsigned_abs();
    let half = 0.5 * x;
    let mut term = (1..=n).fold(1.0, |term, m| term * half / f64::from(m));
    let mut sum = term;
    for m in 1..200 {
        term *= half * half / (f64::from(m) * f64::from(m + n));
        sum += term;
    }
    sum
}

/// The integral of `exp(-x cosh t) cosh(n t)` over t from 0, by the trapezoidal rule, which is exact to rounding here.
fn bessel_k(n: i32, x: f64) -> f64 {
    let h = 0.01;
    let f = |t: f64| libm::exp(-x * libm::cosh(t)) * libm::cosh(f64::from(n) * t);
    h * (0.5 * f(0.0) + (1..2000).map(|m| f(h * f64::from(m))).sum::<f64>())
}

/// The four functions of order n with their slopes, at `x`.
fn functions(n: i32, x: f64) -> [(f64, f64); 4] {
    let half = |below: f64, above: f64| 0.5 * (below + above);
    [
        (libm::jn(n, x), half(libm::jn(n - 1, x), -libm::jn(n + 1, x))),
        (libm::yn(n, x), half(libm::yn(n - 1, x), -libm::yn(n + 1, x))),
        (bessel_i(n, x), half(bessel_i(n - 1, x), bessel_i(n + 1, x))),
        (bessel_k(n, x), -half(bessel_k(n - 1, x), bessel_k(n + 1, x))),
    ]
}

/// Both conditions at a rim, for a plate of outer radius 1.
fn conditions(n: i32, k: f64, r: f64, nu: f64, rim: Rim) -> [[f64; 4]; 2] {
    let square = f64::from(n * n);
    let signs = [-1.0, -1.0, 1.0, 1.0];
    let at = functions(n, k * r);
    let row = |second: bool| {
        std::array::from_fn(|which| {
            let (w, slope) = (at[which].0, k * at[which].1);
            let laplace = signs[which] * k * k;
            match (rim, second) {
                (Rim::Clamped, false) => w,
                (Rim::Clamped, true) => slope,
                (Rim::Free, false) => laplace * w - (1.0 - nu) * (slope / r - square * w / (r * r)),
                (Rim::Free, true) => laplace * slope - (1.0 - nu) * square / (r * r) * (slope - w / r),
            }
        })
    };
    [row(false), row(true)]
}

fn determinant(mut m: [[f64; 4]; 4]) -> f64 {
    let mut value = 1.0;
    for column in 0..4 {
        let pivot = (column..4).max_by(|a, b| m[*a][column].abs().total_cmp(&m[*b][column].abs())).unwrap();
        if pivot != column {
            m.swap(pivot, column);
            value = -value;
        }
        value *= m[column][column];
        for row in column + 1..4 {
            let factor = m[row][column] / m[column][column];
            let pivot_row = m[column];
            for (value, pivot) in m[row].iter_mut().zip(pivot_row) {
                *value -= factor * pivot;
            }
        }
    }
    value
}

/// The lowest `(k a)^2` above 1 of order `n`, of a plate whose inner radius is `ratio` of the outer one.
pub(super) fn lowest_root(n: i32, ratio: f64, nu: f64, inner: Rim, outer: Rim) -> f64 {
    let f = |k: f64| {
        let [a, b] = conditions(n, k, ratio, nu, inner);
        let [c, d] = conditions(n, k, 1.0, nu, outer);
        determinant([a, b, c, d])
    };
    let mut low = 1.0;
    while f(low).signum() == f(low + 0.01).signum() {
        low += 0.01;
    }
    let mut high = low + 0.01;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == f(low).signum() { low = middle } else { high = middle }
    }
    low * low
}

/// Leissa's table for a free plate of ratio 0.5 and Poisson's ratio 0.3, three digits, and one of a clamped rim.
#[test]
fn exact_roots_are_those_of_leissas_tables() {
    for (n, expected) in [(2, 4.271), (0, 9.313), (3, 11.425), (1, 17.198)] {
        let found = lowest_root(n, 0.5, 0.3, Rim::Free, Rim::Free);
        assert!((found - expected).abs() < 1e-3, "{n}: {found}");
    }
    for (n, expected) in [(0, 17.60), (1, 21.79), (2, 31.78)] {
        let found = lowest_root(n, 0.5, 1.0 / 3.0, Rim::Free, Rim::Clamped);
        assert!((found - expected).abs() < 0.02, "{n}: {found}");
    }
}
