//! The brick of 20 nodes: eight corners, twelve middles of edges, in the order of CalculiX and Abaqus.

use super::Node;

/// Local coordinates of the nodes, each -1, 0 or 1. Corners first (lower face, upper face), then the middles of the
/// lower, the upper and the upright edges.
pub const LOCAL: [[i8; 3]; 20] = [
    [-1, -1, -1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, 1, 1],
    [-1, 1, 1],
    [0, -1, -1],
    [1, 0, -1],
    [0, 1, -1],
    [-1, 0, -1],
    [0, -1, 1],
    [1, 0, 1],
    [0, 1, 1],
    [-1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
];

/// A brick, by its nodes' numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Brick(pub [usize; 20]);

/// Shape function of the node with local coordinates `node` at `at`, with its derivatives (serendipity).
fn shape(node: [i8; 3], at: [f64; 3]) -> (f64, [f64; 3]) {
    let a = node.map(f64::from);
    // A factor for each direction and its derivative: 1 + a x at a corner, 1 - x^2 at a middle.
    let factor = |i: usize| if node[i] == 0 { 1.0 - at[i] * at[i] } else { 1.0 + a[i] * at[i] };
    let slope = |i: usize| if node[i] == 0 { -2.0 * at[i] } else { a[i] };
    let f = [factor(0), factor(1), factor(2)];
    let others = [f[1] * f[2], f[0] * f[2], f[0] * f[1]];
    if node.contains(&0) {
        let gradient = std::array::from_fn(|i| 0.25 * slope(i) * others[i]);
        return (0.25 * f[0] * f[1] * f[2], gradient);
    }
    let sum = a[0] * at[0] + a[1] * at[1] + a[2] * at[2] - 2.0;
    let product = f[0] * f[1] * f[2];
    (0.125 * product * sum, std::array::from_fn(|i| 0.125 * (slope(i) * others[i] * sum + product * a[i])))
}

impl Brick {
    /// Calls `visit` with place, m, and volume, m3, of each of 27 points of Gauss.
    pub(crate) fn integrate(&self, nodes: &[Node], mut visit: impl FnMut([f64; 3], f64)) {
        let g = libm::sqrt(0.6);
        let points = [(-g, 5.0 / 9.0), (0.0, 8.0 / 9.0), (g, 5.0 / 9.0)];
        let corners = self.0.map(|number| nodes[number].xyz());
        for (x, wx) in points {
            for (y, wy) in points {
                for (z, wz) in points {
                    let (mut place, mut jacobian) = ([0.0; 3], [[0.0; 3]; 3]);
                    for (local, corner) in LOCAL.iter().zip(&corners) {
                        let (value, gradient) = shape(*local, [x, y, z]);
                        for i in 0..3 {
                            place[i] += value * corner[i];
                            for j in 0..3 {
                                jacobian[i][j] += corner[i] * gradient[j];
                            }
                        }
                    }
                    visit(place, determinant(&jacobian) * wx * wy * wz);
                }
            }
        }
    }
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each function is 1 at its node and 0 at the others; together they are 1, and their gradients cancel.
    #[test]
    fn exact_shape_functions() {
        for (number, node) in LOCAL.iter().enumerate() {
            for (other, at) in LOCAL.iter().enumerate() {
                let expected = if number == other { 1.0 } else { 0.0 };
                assert!((shape(*node, at.map(f64::from)).0 - expected).abs() < 1e-15);
            }
        }
        let at = [0.3, -0.7, 0.1];
        let sum: f64 = LOCAL.iter().map(|node| shape(*node, at).0).sum();
        assert!((sum - 1.0).abs() < 1e-14);
        for i in 0..3 {
            let sum: f64 = LOCAL.iter().map(|node| shape(*node, at).1[i]).sum();
            assert!(sum.abs() < 1e-14);
            let step = |h: f64| {
                let mut at = at;
                at[i] += h;
                shape(LOCAL[5], at).0
            };
            let difference = (step(1e-6) - step(-1e-6)) / 2e-6;
            assert!((shape(LOCAL[5], at).1[i] - difference).abs() < 1e-9);
        }
    }
}
