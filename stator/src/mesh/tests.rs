use std::f64::consts::PI;

use super::*;
use crate::drawing::{Clamp, Springs};

fn plain_ring() -> Drawing {
    let mut drawing = Drawing { springs: Springs::None, clamp: Clamp::Nothing, ..Drawing::default() };
    drawing.numbers.tooth_height_m = 1e-7;
    drawing.numbers.tooth_radial_m = 0.0;
    drawing
}

/// Mass and both moments of inertia of two annular layers in closed form. Quadratic edges of 8 degrees miss a circle by
/// a ten-thousandth of the sagitta, some 1e-6 of the radius.
#[test]
fn exact_mass_and_inertia_of_a_ring() {
    let drawing = plain_ring();
    let found = Mesh::of(&drawing).unwrap().mass_properties(&drawing);
    let n = &drawing.numbers;
    let (a, b) = (n.outer_radius_m, n.inner_radius_m);
    let area = PI * (a * a - b * b);
    let layers = [
        (n.foil_density_kg_m3 * n.foil_thickness_m * area, 0.5 * n.foil_thickness_m, n.foil_thickness_m),
        (
            n.silicon_density_kg_m3 * n.silicon_thickness_m * area,
            n.foil_thickness_m + 0.5 * n.silicon_thickness_m,
            n.silicon_thickness_m,
        ),
    ];
    let mass: f64 = layers.iter().map(|layer| layer.0).sum();
    let centre = layers.iter().map(|layer| layer.0 * layer.1).sum::<f64>() / mass;
    let polar = 0.5 * mass * (a * a + b * b);
    let own = |(mass, z, t): &(f64, f64, f64)| mass * (t * t / 12.0 + (z - centre) * (z - centre));
    let transverse = 0.5 * polar + layers.iter().map(own).sum::<f64>();
    for (found, expected) in [
        (found.mass_kg, mass),
        (found.centre_m, centre),
        (found.polar_kg_m2, polar),
        (found.transverse_kg_m2, transverse),
    ] {
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} for {expected}");
    }
}

/// Teeth and springs weigh what their plan and height say: a tooth is a piece of an annulus, a stem a rectangle that
/// meets the rim along an arc, an arm a piece of an annulus.
#[test]
fn exact_mass_of_teeth_and_springs() {
    let mut drawing = Drawing::default();
    drawing.numbers.mesh_size_m = 0.3e-3;
    let all = Mesh::of(&drawing).unwrap().mass_properties(&drawing).mass_kg;
    let mut without = drawing;
    without.numbers.tooth_radial_m = 0.0;
    let toothless = Mesh::of(&without).unwrap().mass_properties(&without).mass_kg;
    let n = &drawing.numbers;
    let annulus = |inner: f64, width: f64, angle: f64| width * (inner + 0.5 * width) * angle;
    let tooth_width = n.tooth_tangential_m / (n.tooth_radius_m + 0.5 * n.tooth_radial_m);
    let tooth = annulus(n.tooth_radius_m, n.tooth_radial_m, tooth_width) * n.tooth_height_m;
    let expected = 4.0 * tooth * n.silicon_density_kg_m3;
    assert!(((all - toothless) / expected - 1.0).abs() < 1e-4, "{} {expected}", all - toothless);

    without.springs = Springs::None;
    without.clamp = Clamp::Nothing;
    let ring = Mesh::of(&without).unwrap().mass_properties(&without).mass_kg;
    let inner = n.outer_radius_m + n.spring_stem_m;
    let arms = annulus(inner, n.spring_arm_width_m, 2.0 * n.spring_half_angle_deg.to_radians());
    let springs = 4.0 * (n.spring_stem_m * n.spring_stem_width_m + arms);
    let expected = springs * n.silicon_thickness_m * n.silicon_density_kg_m3;
    assert!(((toothless - ring) / expected - 1.0).abs() < 1e-3, "{} {expected}", toothless - ring);
}

/// Every brick has a positive volume at each of its points, whatever is drawn; a node belongs to a brick; circles are
/// whole turns, and the tooth circle is where the teeth are.
#[test]
fn law_meshes_are_whole() {
    let mut drawings = vec![Drawing::default(), plain_ring()];
    for (tooth_angle, tooth, springs) in
        [(0.0, 0.6e-3, Springs::T), (4.9, 0.3e-3, Springs::L), (90.0, 0.2e-3, Springs::T)]
    {
        let mut drawing = Drawing { springs, spread_seed: 7, ..Drawing::default() };
        drawing.numbers.tooth_angle_deg = tooth_angle;
        drawing.numbers.tooth_tangential_m = tooth;
        drawing.numbers.spring_spread = 0.1;
        drawings.push(drawing);
    }
    for drawing in drawings {
        let mesh = Mesh::of(&drawing).unwrap();
        let mut used = vec![false; mesh.nodes.len()];
        for (brick, _) in &mesh.bricks {
            brick.integrate(&mesh.nodes, |_, volume| assert!(volume > 0.0));
            for number in brick.0 {
                used[number] = true;
            }
        }
        assert!(used.iter().all(|used| *used), "{drawing:?}");
        assert_eq!(mesh.tips.len(), if drawing.has_teeth() { 4 } else { 0 });
        assert_eq!(mesh.clamped.is_empty(), drawing.clamp == Clamp::Nothing);
        assert_eq!(mesh.clamped_in_height.is_empty(), drawing.clamp == Clamp::Nothing);
        let angles: Vec<f64> = mesh.circles[0].iter().map(|number| mesh.nodes[*number].theta).collect();
        assert!(
            angles.windows(2).all(|pair| pair[0] < pair[1]) && angles.last().unwrap() - angles[0] < 2.0 * PI
        );
        let tooth_radius = mesh.nodes[mesh.circles[mesh.tooth_circle][0]].r;
        assert!((tooth_radius - drawing.numbers.tooth_radius_m).abs() < 1e-12);
    }
}

/// The number of bricks does not change with what a fit changes.
#[test]
fn law_a_fit_keeps_the_mesh() {
    let count = |thickness: f64, half_angle: f64, stem: f64| {
        let mut drawing = Drawing::default();
        drawing.numbers.silicon_thickness_m = thickness;
        drawing.numbers.spring_half_angle_deg = half_angle;
        drawing.numbers.spring_stem_m = stem;
        let mesh = Mesh::of(&drawing).unwrap();
        (mesh.nodes.len(), mesh.bricks.len())
    };
    assert_eq!(count(40e-6, 25.0, 0.2e-3), count(70e-6, 38.0, 1.0e-3));
}
