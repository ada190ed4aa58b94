//! A second discretisation of a drawing, for tests: a thin laminate plate, where the first is made of bricks.
//!
//! Mindlin's plate in cylinder coordinates about the face between foil and silicon: displacements u, v, w of that face
//! along radius, angle (t) and height, and a rotation b of the normal, so that a point at height z moves in the plane
//! by `u + z b_r` and `v + z b_t`. Its strains are
//!
//! ```text
//! e = [ u_r,  (u + v_t)/r,  u_t/r + v_r - v/r ] + z [ b_r_r,  (b_r + b_t_t)/r,  b_r_t/r + b_t_r - b_t/r ]
//! g = [ w_r + b_r,  w_t/r + b_t ]
//! ```
//!
//! with the stiffness of each layer in plane stress, integrated over the height, and 5/6 of its shear stiffness. Ring,
//! teeth and springs are cells of one grid of radii and angles; a tooth is a thick layer. On a cell all five are cubic
//! along radius and angle (Lagrange). Shear matters at the edges of the narrow arms, whose torsion it softens by a
//! seventh. Neither the elements, nor the theory, nor the solver is that of the bricks. Lengths in mm, masses in t,
//! stresses in MPa.
//!
//! A stem is a sector of the same width at its middle. Springs are equal.

mod eigenvalues;
mod grid;

use nalgebra::{Matrix3, SMatrix};

use crate::drawing::{Drawing, Silicon};
use eigenvalues::{Skyline, lowest};
use grid::{Cell, Grid};

/// A layer: from and to a height, stiffness in plane stress along radius and angle and in shear across, density.
struct Layer {
    from: f64,
    to: f64,
    stiffness: Matrix3<f64>,
    shear: f64,
    density: f64,
}

/// Part of the shear stiffness of a section that bends.
const SHEAR: f64 = 5.0 / 6.0;

fn isotropic(modulus: f64, poisson: f64) -> Matrix3<f64> {
    let plane = modulus / (1.0 - poisson * poisson);
    Matrix3::new(
        plane,
        plane * poisson,
        0.0,
        plane * poisson,
        plane,
        0.0,
        0.0,
        0.0,
        0.5 * plane * (1.0 - poisson),
    )
}

/// A cubic crystal in plane stress whose axes are turned by `angle` from radius and angle.
fn cubic([c11, c12, c44]: [f64; 3], angle: f64) -> Matrix3<f64> {
    let (q11, q12) = (c11 - c12 * c12 / c11, c12 - c12 * c12 / c11);
    // What makes it differ from a material that is alike in all directions goes with four times the angle.
    let excess = 0.25 * (q11 - q12 - 2.0 * c44);
    let (sin, cos) = libm::sincos(4.0 * angle);
    let (same, turned) = (excess * (1.0 - cos), excess * sin);
    Matrix3::new(q11 - same, q12 + same, -turned, q12 + same, q11 - same, turned, -turned, turned, c44 + same)
}

/// The layers of a cell at an angle.
fn layers(drawing: &Drawing, cell: Cell, theta: f64) -> Vec<Layer> {
    let n = &drawing.numbers;
    let shear = |modulus_pa: f64, poisson: f64| 0.5e-6 * modulus_pa / (1.0 + poisson);
    let (silicon, silicon_shear) = match drawing.silicon {
        Silicon::Isotropic => (
            isotropic(1e-6 * n.silicon_modulus_pa, n.silicon_poisson),
            shear(n.silicon_modulus_pa, n.silicon_poisson),
        ),
        Silicon::Crystal => {
            let constants = [n.silicon_c11_pa, n.silicon_c12_pa, n.silicon_c44_pa].map(|pa| 1e-6 * pa);
            (cubic(constants, theta - n.crystal_angle_deg.to_radians()), constants[2])
        }
    };
    let tooth = if cell == Cell::Tooth { n.tooth_height_m } else { 0.0 };
    let mut layers = vec![Layer {
        from: 0.0,
        to: 1e3 * (n.silicon_thickness_m + tooth),
        stiffness: silicon,
        shear: silicon_shear,
        density: 1e-12 * n.silicon_density_kg_m3,
    }];
    if cell != Cell::Spring {
        layers.push(Layer {
            from: -1e3 * n.foil_thickness_m,
            to: 0.0,
            stiffness: isotropic(1e-6 * n.foil_modulus_pa, n.foil_poisson),
            shear: shear(n.foil_modulus_pa, n.foil_poisson),
            density: 1e-12 * n.foil_density_kg_m3,
        });
    }
    layers
}

type Strains = SMatrix<f64, 8, 8>;

/// Stiffness of the eight strains: in the plane, of bending, of shear; and mass, first and second moment per area.
fn laminate(layers: &[Layer]) -> (Strains, [f64; 3]) {
    let (mut stiffness, mut inertia) = (Strains::zeros(), [0.0; 3]);
    for layer in layers {
        let power = |n: i32| {
            let of = |height: f64| libm::pow(height, f64::from(n));
            (of(layer.to) - of(layer.from)) / f64::from(n)
        };
        for (row, column, n) in [(0, 0, 1), (0, 3, 2), (3, 0, 2), (3, 3, 3)] {
            let mut block = stiffness.fixed_view_mut::<3, 3>(row, column);
            block += layer.stiffness * power(n);
        }
        for across in [6, 7] {
            stiffness[(across, across)] += SHEAR * layer.shear * power(1);
        }
        for (moment, n) in inertia.iter_mut().zip(1..) {
            *moment += layer.density * power(n);
        }
    }
    (stiffness, inertia)
}

/// Cubic functions of four even places on an edge of length `h` at a share `s` of it, each with its derivative.
fn cubics(s: f64, h: f64) -> [[f64; 2]; 4] {
    let at = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
    std::array::from_fn(|own| {
        let others = [0, 1, 2, 3].into_iter().filter(|other| *other != own);
        let norm: f64 = others.clone().map(|other| at[own] - at[other]).product();
        let value: f64 = others.clone().map(|other| s - at[other]).product();
        let without = |left_out: usize| -> f64 {
            others.clone().filter(|other| *other != left_out).map(|other| s - at[other]).product()
        };
        let slope: f64 = others.clone().map(without).sum();
        [value / norm, slope / (norm * h)]
    })
}

/// Points of Gauss on an edge, as shares of it, and their weights.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Unknowns of a cell: u, v, w and both rotations at sixteen places.
const PER_CELL: usize = 5 * 16;
type CellMatrix = SMatrix<f64, PER_CELL, PER_CELL>;

/// Stiffness and mass of a cell between two radii and two angles.
fn cell_matrices(drawing: &Drawing, cell: Cell, [r0, r1]: [f64; 2], [t0, t1]: [f64; 2]) -> Vec<CellMatrix> {
    let mut matrices = vec![CellMatrix::zeros(); 2];
    for (along_r, weight_r) in GAUSS {
        for (along_t, weight_t) in GAUSS {
            let (r, theta) = (r0 + along_r * (r1 - r0), t0 + along_t * (t1 - t0));
            let area = weight_r * weight_t * (r1 - r0) * (t1 - t0) * r;
            let (radial, angular) = (cubics(along_r, r1 - r0), cubics(along_t, t1 - t0));
            let mut strains = SMatrix::<f64, 8, PER_CELL>::zeros();
            let mut motion = SMatrix::<f64, 5, PER_CELL>::zeros();
            for place in 0..16 {
                let ([f, f_r], [g, g_t]) = (radial[place % 4], angular[place / 4]);
                let (n, n_r, n_t) = (f * g, f_r * g, f * g_t / r);
                let at = 5 * place;
                // Strains in the plane of u and v, and those of bending of the rotations, have one form.
                for (row, first) in [(0, at), (3, at + 3)] {
                    strains.fixed_view_mut::<3, 1>(row, first).copy_from_slice(&[n_r, n / r, n_t]);
                    strains.fixed_view_mut::<3, 1>(row, first + 1).copy_from_slice(&[0.0, n_t, n_r - n / r]);
                }
                for (row, slope) in [(6, n_r), (7, n_t)] {
                    (strains[(row, at + 2)], strains[(row, at + row - 3)]) = (slope, n);
                }
                for field in 0..5 {
                    motion[(field, at + field)] = n;
                }
            }
            let (stiffness, [mass, first, second]) = laminate(&layers(drawing, cell, theta));
            let mut inertia = SMatrix::<f64, 5, 5>::from_diagonal_element(mass);
            for (face, rotation) in [(0, 3), (1, 4)] {
                inertia[(rotation, rotation)] = second;
                (inertia[(face, rotation)], inertia[(rotation, face)]) = (first, first);
            }
            matrices[0] += strains.transpose() * stiffness * strains * area;
            matrices[1] += motion.transpose() * inertia * motion * area;
        }
    }
    matrices
}

/// The lowest frequencies of a flat drawing that is held, Hz, rising.
pub(super) fn frequencies_hz(drawing: &Drawing, count: usize) -> Vec<f64> {
    let grid = Grid::of(drawing);
    let unknowns = grid.unknowns();
    let mut matrices = [Skyline::new(&unknowns), Skyline::new(&unknowns)];
    for (i, j, cell) in grid.cells() {
        let parts = cell_matrices(drawing, cell, grid.radii_of(i), grid.angles_of(j));
        let places = grid.numbers(i, j, &unknowns);
        for (whole, part) in matrices.iter_mut().zip(&parts) {
            for (row, at) in places.iter().enumerate() {
                for (column, other) in places.iter().enumerate() {
                    if let (Some(at), Some(other)) = (at, other)
                        && other <= at
                    {
                        whole.add(*at, *other, part[(row, column)]);
                    }
                }
            }
        }
    }
    let [stiffness, mass] = matrices;
    let squares = lowest(&stiffness, &mass, count);
    squares.into_iter().map(|square| libm::sqrt(square) / (2.0 * std::f64::consts::PI)).collect()
}
