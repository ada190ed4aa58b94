//! Free motion: one block of 2 x 2 for each degree of freedom.

use super::STATES;
use crate::math::Real;
use crate::motor::Motor;

/// What a deviation becomes over some time of free motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeFlow<T> {
    /// The blocks, by rows, of modes A, B, C, of (height, vertical velocity) and of (angle, rate).
    pub blocks: [[[T; 2]; 2]; STATES / 2],
}

impl<T: Real> FreeFlow<T> {
    /// `F dx`.
    #[must_use]
    pub fn carry(&self, deviation: &[T; STATES]) -> [T; STATES] {
        let mut carried = *deviation;
        let pairs = carried.as_chunks_mut::<2>().0;
        for ([x, v], [[xx, xv], [vx, vv]]) in pairs.iter_mut().zip(self.blocks) {
            (*x, *v) = (xx * *x + xv * *v, vx * *x + vv * *v);
        }
        carried
    }
}

impl<T: Real> Motor<T> {
    /// Free motion over the fraction `part` of a step, in `0..=1`; no transcendental call.
    pub fn free_flow(&self, part: T) -> FreeFlow<T> {
        let ([a, b, c], [height, angle]) =
            (self.modes().part(part).slopes(), self.flight().part(part).slopes());
        FreeFlow { blocks: [a, b, c, height, angle] }
    }
}
