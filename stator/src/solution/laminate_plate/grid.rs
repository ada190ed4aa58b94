//! The grid of the plate: lines of radius and angle, which cells there are, and the numbers of the unknowns.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::drawing::{Clamp, Drawing, Springs};

/// What a cell is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cell {
    Ring,
    Tooth,
    Spring,
}

/// Lines in mm and rad.
pub(super) struct Grid {
    drawing: Drawing,
    radii: Vec<f64>,
    angles: Vec<f64>,
}

/// Unknowns of a place: u, v, w and both rotations. Places divide each edge of a cell into thirds.
const PER_PLACE: usize = 5;

/// Numbers of the unknowns of every place, `None` of those that are held or not there.
pub(super) struct Unknowns {
    numbers: Vec<Option<usize>>,
    /// For each unknown the least one that shares a cell with it.
    pub(super) first: Vec<usize>,
}

/// Lines on every mark, and so many between that none is further than `size` from the next.
fn lines(marks: &[f64], size: f64) -> Vec<f64> {
    let mut lines = vec![marks[0]];
    for pair in marks.windows(2).filter(|pair| pair[1] - pair[0] > 1e-9) {
        let parts = (1..20).find(|parts| (pair[1] - pair[0]) / f64::from(*parts) <= size).unwrap_or(20);
        lines.extend((1..=parts).map(|part| {
            if part == parts {
                pair[1]
            } else {
                pair[0] + (pair[1] - pair[0]) * f64::from(part) / f64::from(parts)
            }
        }));
    }
    lines
}

/// An angle less that of the nearest spring or tooth, of which there is one each quarter turn from `first`.
fn off(theta: f64, first: f64) -> f64 {
    (theta - first + 0.5 * FRAC_PI_2).rem_euclid(FRAC_PI_2) - 0.5 * FRAC_PI_2
}

impl Grid {
    pub(super) fn of(drawing: &Drawing) -> Self {
        let n = &drawing.numbers;
        let size = 1e3 * n.mesh_size_m;
        let mut marks = vec![n.inner_radius_m, n.tooth_radius_m];
        if drawing.has_teeth() {
            marks.push(n.tooth_radius_m + n.tooth_radial_m);
        }
        marks.push(n.outer_radius_m);
        let mut edges = Vec::new();
        if drawing.springs == Springs::T {
            let arms = n.outer_radius_m + n.spring_stem_m;
            marks.extend([arms, arms + n.spring_arm_width_m]);
            let end = n.spring_half_angle_deg.to_radians();
            let stem = stem_half_angle(drawing);
            edges.extend([-end, -stem, stem, end]);
        }
        if drawing.has_teeth() {
            let (middle, half) = (off(n.tooth_angle_deg.to_radians(), 0.0), drawing.tooth_half_angle());
            edges.extend([middle - half, middle + half]);
        }
        let marks: Vec<f64> = marks.iter().map(|metres| 1e3 * metres).collect();
        let start = -0.5 * FRAC_PI_2;
        let mut turn: Vec<f64> = (0..4)
            .flat_map(|quarter| edges.iter().map(move |edge| edge + f64::from(quarter) * FRAC_PI_2))
            .map(|angle| (angle - start).rem_euclid(2.0 * PI) + start)
            .chain([start, start + 2.0 * PI])
            .collect();
        turn.sort_by(f64::total_cmp);
        let middle = 0.5e3 * (n.inner_radius_m + n.outer_radius_m);
        Self { drawing: *drawing, radii: lines(&marks, size), angles: lines(&turn, size / middle) }
    }

    pub(super) fn radii_of(&self, i: usize) -> [f64; 2] {
        [self.radii[i], self.radii[i + 1]]
    }

    pub(super) fn angles_of(&self, j: usize) -> [f64; 2] {
        [self.angles[j], self.angles[j + 1]]
    }

    fn cell(&self, i: usize, j: usize) -> Option<Cell> {
        let n = &self.drawing.numbers;
        let [r, theta] = [self.radii_of(i), self.angles_of(j)].map(|[from, to]| 0.5 * (from + to));
        let r = 1e-3 * r;
        if r < n.outer_radius_m {
            let beside = off(theta, n.tooth_angle_deg.to_radians()).abs();
            let across = (0.0..n.tooth_radial_m).contains(&(r - n.tooth_radius_m));
            let is_tooth = self.drawing.has_teeth() && across && beside < self.drawing.tooth_half_angle();
            return Some(if is_tooth { Cell::Tooth } else { Cell::Ring });
        }
        let reach = if r < n.outer_radius_m + n.spring_stem_m {
            stem_half_angle(&self.drawing)
        } else {
            n.spring_half_angle_deg.to_radians()
        };
        (off(theta, 0.0).abs() < reach).then_some(Cell::Spring)
    }

    /// All cells by the numbers of their first lines.
    pub(super) fn cells(&self) -> impl Iterator<Item = (usize, usize, Cell)> + '_ {
        let all = (0..self.angles.len() - 1).flat_map(|j| (0..self.radii.len() - 1).map(move |i| (i, j)));
        all.filter_map(|(i, j)| Some((i, j, self.cell(i, j)?)))
    }

    /// Places along the radius and along the turn.
    fn extent(&self) -> [usize; 2] {
        [3 * (self.radii.len() - 1) + 1, 3 * (self.angles.len() - 1)]
    }

    /// The places of a cell, along the radius first.
    fn places_of(&self, i: usize, j: usize) -> [(usize, usize); 16] {
        let [_, turn] = self.extent();
        std::array::from_fn(|place| (3 * i + place % 4, (3 * j + place / 4) % turn))
    }

    /// Whether a place is held.
    fn is_held(&self, (i, j): (usize, usize)) -> bool {
        let n = &self.drawing.numbers;
        match self.drawing.clamp {
            Clamp::Arms => {
                let end = n.spring_half_angle_deg.to_radians();
                let is_end = j % 3 == 0 && (off(self.angles[j / 3], 0.0).abs() - end).abs() < 1e-9;
                is_end && 1e-3 * self.radii[i / 3] > n.outer_radius_m + 0.5 * n.spring_stem_m
            }
            Clamp::InnerRim => i == 0,
            Clamp::OuterRim => i + 1 == self.extent()[0],
            Clamp::Nothing => false,
        }
    }

    /// Numbers the unknowns column by column, from both sides of the turn at once: neighbours stay near each other.
    pub(super) fn unknowns(&self) -> Unknowns {
        let [rows, turn] = self.extent();
        let mut is_there = vec![false; rows * turn];
        for (i, j, _) in self.cells() {
            for (i, j) in self.places_of(i, j) {
                is_there[j * rows + i] = true;
            }
        }
        let mut numbers = vec![None; rows * turn * PER_PLACE];
        let mut count = 0;
        let order = (0..turn).map(|place| if place % 2 == 0 { place / 2 } else { turn - place.div_ceil(2) });
        for j in order {
            for i in (0..rows).filter(|i| is_there[j * rows + i] && !self.is_held((*i, j))) {
                for unknown in 0..PER_PLACE {
                    numbers[(j * rows + i) * PER_PLACE + unknown] = Some(count);
                    count += 1;
                }
            }
        }
        let mut unknowns = Unknowns { numbers, first: (0..count).collect() };
        for (i, j, _) in self.cells() {
            let numbers = self.numbers(i, j, &unknowns);
            if let Some(least) = numbers.iter().flatten().min().copied() {
                for number in numbers.into_iter().flatten() {
                    unknowns.first[number] = unknowns.first[number].min(least);
                }
            }
        }
        unknowns
    }

    /// Numbers of the unknowns of a cell, place by place.
    pub(super) fn numbers(&self, i: usize, j: usize, unknowns: &Unknowns) -> Vec<Option<usize>> {
        let [rows, _] = self.extent();
        let of = |(i, j): (usize, usize)| {
            let begin = (j * rows + i) * PER_PLACE;
            unknowns.numbers[begin..begin + PER_PLACE].iter().copied()
        };
        self.places_of(i, j).into_iter().flat_map(of).collect()
    }
}

/// Half of the angle of a stem, whose width at its middle is that of the drawing.
fn stem_half_angle(drawing: &Drawing) -> f64 {
    let n = &drawing.numbers;
    0.5 * n.spring_stem_width_m / (n.outer_radius_m + 0.5 * n.spring_stem_m)
}
