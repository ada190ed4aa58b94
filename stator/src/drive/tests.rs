use super::*;
use crate::bimetal_ring;
use crate::modes::StatorFigures;
use crate::solver::Solver;

/// Under a strain e of the foil along the field and -e/2 across, a free bimetal ring bends into a saddle: along the
/// field as under the strain 3 e / 4 against the silicon ([`bimetal_ring`]), across it the other way.
///
/// ```text
/// w = curvature r^2 cos 2 theta / 2
/// ```
///
/// The force on a mode is `w_n^2` times the mass-weighted product of mode and saddle (Betti). What the foil's rims give
/// is compared with that. A mesh may cost half a per cent of a frequency, so one per cent of its square.
#[test]
fn exact_force_on_a_free_bimetal_ring() {
    let mut drawing = bimetal_ring::drawing();
    drawing.numbers.mesh_size_m = 0.25e-3;
    let n = &drawing.numbers;
    let curvature = 0.75 * bimetal_ring::curvature_per_strain(&drawing);
    let weight = n.foil_density_kg_m3 * n.foil_thickness_m + n.silicon_density_kg_m3 * n.silicon_thickness_m;

    let solution = Solution::of(&drawing, &Solver::default()).unwrap();
    let radii: Vec<f64> =
        solution.mesh.circles.iter().map(|circle| solution.mesh.nodes[circle[0]].r).collect();
    let angles = solution.mesh.angles();
    let mut tried = 0;
    for mode in solution.modes.iter().filter(|mode| mode.order == 2).take(2) {
        let parts: Vec<[f64; 2]> =
            solution.deflections(mode).iter().map(|circle| part(&angles, circle, 2)).collect();
        let w = 2.0 * PI * mode.frequency_hz;
        // Cosine and sine part of the product with a saddle along 0 and along 45 degrees.
        let expected = [0, 1].map(|which| {
            let integrand = |circle: usize| parts[circle][which] * libm::pow(radii[circle], 3.0);
            let trapezoids = (1..radii.len())
                .map(|to| 0.5 * (integrand(to - 1) + integrand(to)) * (radii[to] - radii[to - 1]));
            w * w * weight * PI * 0.5 * curvature * trapezoids.sum::<f64>()
        });
        let found = forces(&solution, &drawing, mode);
        let size = libm::hypot(expected[0], expected[1]);
        for (found, expected) in found.into_iter().zip(expected) {
            println!("{found} {expected} {}", found / expected - 1.0);
            assert!((found - expected).abs() < 0.015 * size, "{found} for {expected}");
        }
        tried += 1;
    }
    assert_eq!(tried, 2);
}

/// Equal springs and no teeth: the field drives B best at 45 degrees and C best along a spring. A mirrored drawing has
/// its best directions on the other side. The default one is driven as a laminate plate with cubic triangles was, drawn
/// over the same unknowns: 0.45 +- 0.05 N/1000 ppm in B and 0.42 +- 0.05 in C, best at 46 and at 0 to 2 degrees. Two of
/// these standard deviations are allowed, and a degree for what the laminate's stiff teeth cost.
#[test]
fn dual_force_and_best_direction_of_the_default_stator() {
    let drive = |change: &dyn Fn(&mut Drawing)| {
        let mut drawing = Drawing::default();
        drawing.numbers.mesh_size_m = 0.6e-3;
        change(&mut drawing);
        StatorFigures::of(&drawing, &Solver::default()).unwrap().drive
    };
    let [b, c] = drive(&|drawing| drawing.numbers.tooth_radial_m = 0.0).unwrap();
    assert!((b.best_field_deg - 45.0).abs() < 1e-3 && c.best_field_deg.abs() < 1e-3, "{b:?} {c:?}");
    let [b, c] = drive(&|_| ()).unwrap();
    println!("{b:?} {c:?}");
    let [mirrored_b, mirrored_c] =
        drive(&|drawing| drawing.numbers.tooth_angle_deg = 90.0 - drawing.numbers.tooth_angle_deg).unwrap();
    assert!((b.best_field_deg + mirrored_b.best_field_deg - 90.0).abs() < 1e-3, "{b:?} {mirrored_b:?}");
    assert!((c.best_field_deg + mirrored_c.best_field_deg).abs() < 1e-3, "{c:?} {mirrored_c:?}");
    assert!((b.force_per_strain_n - 450.0).abs() < 100.0 && (c.force_per_strain_n - 420.0).abs() < 100.0);
    assert!((b.best_field_deg - 46.0).abs() < 1.0 && (-1.0..3.0).contains(&c.best_field_deg), "{b:?} {c:?}");
    let stressed = drive(&|drawing| {
        drawing.stressed = true;
        drawing.numbers.mesh_size_m = 1.2e-3;
    });
    assert_eq!(stressed, None);
}

/// The fields that give both amplitudes give them, on either side of the second mode's worst direction.
#[test]
fn exact_fields_that_give_two_amplitudes() {
    let (amplitudes, per_strain, best) = ([20.72e-6, 1.81e-6], [3.0, 1.0], [46.0, 1.0]);
    let found = fields_of_both(amplitudes, per_strain, best);
    for field in found {
        for mode in 0..2 {
            let share = libm::cos(2.0 * (field.field_deg - best[mode]).to_radians()).abs();
            let amplitude = field.strain * per_strain[mode] * share;
            assert!((amplitude / amplitudes[mode] - 1.0).abs() < 1e-9, "{field:?}");
        }
    }
    let [one, other] = found.map(|field| field.field_deg);
    assert!((one - 46.0) * (other - 46.0) < 0.0, "{one} {other}");
}
