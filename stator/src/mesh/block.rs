//! A block of bricks: as many as its lines enclose, along radius, angle and height.

use super::brick::{Brick, LOCAL};
use super::{Material, Mesh, Node};

/// Lines that divide a stretch into edges of bricks, `from` and `to` among them.
///
/// The first and the last are what they were, to the last bit.
pub(super) fn divided(from: f64, to: f64, parts: usize) -> Vec<f64> {
    let part = |number: usize| {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let share = number as f64 / parts as f64;
        if number == parts { to } else { from + (to - from) * share }
    };
    (0..=parts).map(part).collect()
}

/// Into how many parts of at most `size` a `length` is divided.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the drawing's check")]
pub(super) fn parts(length: f64, size: f64) -> usize {
    (libm::ceil(length / size - 1e-9) as usize).max(1)
}

/// The value at half-step `index` along `lines`: a line if it is even, the middle between two if it is odd.
pub(super) fn halfway(lines: &[f64], index: usize) -> f64 {
    if index.is_multiple_of(2) { lines[index / 2] } else { 0.5 * (lines[index / 2] + lines[index / 2 + 1]) }
}

impl Mesh {
    /// Adds `counts` bricks along radius, angle and height whose nodes lie at `place`, a function of half-steps. Bricks
    /// that `is_there` denies are left out.
    pub(super) fn add_block(
        &mut self,
        counts: [usize; 3],
        material: Material,
        place: impl Fn([usize; 3]) -> Node,
        is_there: impl Fn([usize; 3]) -> bool,
    ) {
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    if !is_there([i, j, k]) {
                        continue;
                    }
                    let step =
                        |base: usize, local: i8| (2 * base + 1).wrapping_add_signed(isize::from(local));
                    let at = LOCAL.map(|[a, b, c]| place([step(i, a), step(j, b), step(k, c)]));
                    let brick = Brick(at.map(|node| self.node(node)));
                    self.bricks.push((brick, material));
                }
            }
        }
    }
}
