//! Mode shapes from above, and the spread of an ensemble.

use std::f64::consts::PI;

use motor_model::math;
use stator::modes::Places;

use super::SolvedStator;
use super::members::Ensemble;
use super::quantities::QUANTITIES;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;

/// Shades of a deflection, up and down.
const SHADES: usize = 5;
/// A ring is drawn on so many outer radii, the room beside it included.
const ROOM: f64 = 2.3;

/// A ring from above: points with a value each, and where on the picture it stands.
struct Map<'a> {
    name: &'static str,
    circles: &'a [Vec<f64>],
    radii: &'a [f64],
    angles: &'a [f64],
    centre: f64,
}

impl Map<'_> {
    fn at(&self, r: f64, theta: f64) -> (f64, f64) {
        let (sin, cos) = math::sin_cos(theta);
        (1e3 * (self.centre + r * cos), 1e3 * r * sin)
    }

    /// The points of each shade: down from the strongest, then up to the strongest.
    fn shades(&self) -> Vec<Vec<(f64, f64)>> {
        let largest = self.circles.iter().flatten().fold(0.0_f64, |largest, w| largest.max(w.abs()));
        let mut shades = vec![Vec::new(); 2 * SHADES];
        for (circle, r) in self.circles.iter().zip(self.radii) {
            for (w, theta) in circle.iter().zip(self.angles) {
                let level = (w / largest * real(SHADES)).clamp(-real(SHADES) + 1e-9, real(SHADES) - 1e-9);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "0 to twice the shades"
                )]
                let shade = (level.floor() + real(SHADES)) as usize;
                shades[shade].push(self.at(*r, *theta));
            }
        }
        shades
    }

    /// Where the deflection is zero: between two nodes of different sign, along a circle and along a radius.
    fn nodal(&self) -> Vec<(f64, f64)> {
        let mut points = Vec::new();
        let zero = |a: f64, b: f64| (a.signum() != b.signum()).then(|| a / (a - b));
        for (circle, r) in self.circles.iter().zip(self.radii) {
            for (at, w) in circle.iter().enumerate() {
                let next = (at + 1) % circle.len();
                let end = if next == 0 { self.angles[0] + 2.0 * PI } else { self.angles[next] };
                if let Some(share) = zero(*w, circle[next]) {
                    points.push(self.at(*r, self.angles[at] + share * (end - self.angles[at])));
                }
            }
        }
        for (pair, radii) in self.circles.windows(2).zip(self.radii.windows(2)) {
            for ((inner, outer), theta) in pair[0].iter().zip(&pair[1]).zip(self.angles) {
                if let Some(share) = zero(*inner, *outer) {
                    points.push(self.at(radii[0] + share * (radii[1] - radii[0]), *theta));
                }
            }
        }
        points
    }
}

impl SolvedStator {
    fn radii(&self) -> Vec<f64> {
        let mesh = &self.solution.mesh;
        mesh.circles.iter().map(|circle| mesh.nodes[circle[0]].r).collect()
    }

    /// Outlines of rims, teeth and springs' axes about a centre.
    fn outlines(&self, map: &Map<'_>) -> Vec<Series> {
        let n = &self.drawing.numbers;
        let turn = |r: f64| (0..=120).map(|part| map.at(r, PI * f64::from(part) / 60.0)).collect::<Vec<_>>();
        let line = |points: Vec<(f64, f64)>| Series::line(points).colour(Colour::Black);
        let mut series = vec![line(turn(n.inner_radius_m)), line(turn(n.outer_radius_m))];
        for number in 0..4 {
            let axis = 0.5 * PI * f64::from(number);
            let reach = n.outer_radius_m + n.spring_stem_m;
            series.push(line(vec![map.at(n.outer_radius_m, axis), map.at(reach, axis)]).width(2.5));
            if self.drawing.has_teeth() {
                let middle = axis + n.tooth_angle_deg.to_radians();
                let half = 0.5 * n.tooth_tangential_m / (n.tooth_radius_m + 0.5 * n.tooth_radial_m);
                let (inner, outer) = (n.tooth_radius_m, n.tooth_radius_m + n.tooth_radial_m);
                let corners = [(inner, -half), (outer, -half), (outer, half), (inner, half), (inner, -half)];
                series
                    .push(line(corners.iter().map(|(r, off)| map.at(*r, middle + off)).collect()).width(2.0));
            }
        }
        series
    }

    /// The modes from above.
    pub(super) fn shapes(&self) -> Figure {
        let Ok(places) = Places::of(&self.solution) else { return Figure::new("No modes") };
        let n = &self.drawing.numbers;
        let modes = [
            ("A", places.a),
            ("tilt 1", places.tilt[0]),
            ("tilt 2", places.tilt[1]),
            ("B", places.b),
            ("C", places.c),
        ];
        let (radii, angles) = (self.radii(), self.solution.mesh.angles());
        let step = ROOM * n.outer_radius_m;
        let x = Axis::new("x (mm), each ring beside the other").within(0.0..5e3 * step);
        let y = Axis::new("y (mm)").within(-500.0 * step..500.0 * step);
        let mut panel =
            Panel::new("Blue: down. Red: up. Black: teeth, springs' axes, nodal lines.", x, y).height(232);
        for (place, (name, mode)) in modes.into_iter().enumerate() {
            let mode = &self.solution.modes[mode];
            let circles = self.solution.deflections(mode);
            let centre = (real(place) + 0.5) * step;
            let map = Map { name, circles: &circles, radii: &radii, angles: &angles, centre };
            for (shade, points) in map.shades().into_iter().enumerate() {
                let up = shade >= SHADES;
                let strength = if up { shade - SHADES } else { SHADES - 1 - shade };
                panel = panel.series(
                    Series::points(points)
                        .colour(if up { Colour::Vermilion } else { Colour::Blue })
                        .opacity((real(strength) + 0.6) / real(SHADES))
                        .width(2.2),
                );
            }
            panel = panel.series(Series::points(map.nodal()).colour(Colour::Black).width(1.1));
            for outline in self.outlines(&map) {
                panel = panel.series(outline);
            }
            let said = format!("{}, {:.0} Hz", map.name, mode.frequency_hz);
            let corner = (1e3 * (centre - 0.45 * step), 450.0 * step);
            panel =
                panel.series(Series::names(vec![(corner.0, 0.93 * corner.1, said)]).colour(Colour::Black));
        }
        Figure::new("Modes of the stator, from above").panel(panel)
    }
}

impl Ensemble {
    /// Each member as a dot, quantity by quantity.
    pub(super) fn picture(&self) -> Figure {
        let groups: [(&str, &str, &[usize]); 6] = [
            ("Frequencies of the tilting modes", "frequency (Hz)", &[1, 2]),
            ("Modal masses over the stator mass", "share (1)", &[6, 7, 8, 9]),
            ("Exponents at the teeth", "exponent (1)", &[10, 11, 12, 13]),
            ("Mode shifts", "angle (deg)", &[14, 15]),
            ("Masses", "mass (mg)", &[18, 19, 20]),
            ("Force of the foil", "force per strain (mN/ppm)", &[26, 27]),
        ];
        let mut figure = Figure::new("What the drawing leaves open").caption(
            "Each dot is a stator that meets the frequencies of A, B and C; bars are standard deviations.",
        );
        for (title, label, places) in groups {
            let names = places.iter().map(|place| QUANTITIES[*place].name.to_owned()).collect();
            let mut dots = Vec::new();
            let mut bars = Vec::new();
            for (at, place) in places.iter().enumerate() {
                let quantity = QUANTITIES[*place];
                let x = real(at + 1);
                dots.extend(self.met().map(|member| (x + 0.08, (quantity.of)(member))));
                let spread = self.spread(quantity);
                bars.push((x - 0.08, spread.mean, spread.sd));
            }
            figure = figure.panel(
                Panel::new(title, Axis::of_names("", names), Axis::new(label))
                    .series(Series::points(dots).colour(Colour::Blue).opacity(0.6))
                    .series(Series::error_bars(bars).colour(Colour::Vermilion).width(1.8)),
            );
        }
        figure
    }
}
