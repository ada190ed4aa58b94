use std::path::PathBuf;
use std::sync::LazyLock;

use super::annular_plate::{Rim, lowest_root};
use super::*;
use crate::bimetal_ring;
use crate::drawing::{Clamp, Silicon, Springs};
use crate::modes::StatorFigures;

fn solver() -> Solver {
    Solver::default()
}

fn figures(drawing: &Drawing) -> StatorFigures {
    StatorFigures::of(drawing, &solver()).unwrap()
}

/// The default drawing, solved once for all tests.
static DEFAULT: LazyLock<StatorFigures> = LazyLock::new(|| figures(&Drawing::default()));

/// A plain ring of one isotropic material, half as wide inside as outside.
fn plate(clamp: Clamp, poisson: f64) -> Drawing {
    let mut drawing =
        Drawing { springs: Springs::None, silicon: Silicon::Isotropic, clamp, ..Drawing::default() };
    let n = &mut drawing.numbers;
    n.inner_radius_m = 0.5 * n.outer_radius_m;
    n.foil_thickness_m = 0.0025 * n.outer_radius_m;
    n.silicon_thickness_m = n.foil_thickness_m;
    n.tooth_radial_m = 0.0;
    n.foil_modulus_pa = n.silicon_modulus_pa;
    n.foil_density_kg_m3 = n.silicon_density_kg_m3;
    n.silicon_poisson = poisson;
    n.foil_poisson = poisson;
    drawing
}

/// The lowest mode of an order, as `w a^2 sqrt(rho t / D)`.
fn number_of(solution: &Solution, drawing: &Drawing, order: usize) -> f64 {
    let mode = solution.modes.iter().find(|mode| mode.order == order).unwrap();
    plate_number(drawing) * mode.frequency_hz
}

/// `2 pi a^2 sqrt(rho t / D)`.
fn plate_number(drawing: &Drawing) -> f64 {
    let n = &drawing.numbers;
    let thickness = n.foil_thickness_m + n.silicon_thickness_m;
    let stiffness = n.silicon_modulus_pa * thickness * thickness * thickness
        / (12.0 * (1.0 - n.silicon_poisson * n.silicon_poisson));
    let square = n.outer_radius_m * n.outer_radius_m;
    2.0 * PI * square * libm::sqrt(n.silicon_density_kg_m3 * thickness / stiffness)
}

/// The plate is thin, t/a = 0.005: shear and rotary inertia take 1e-4 off. What is left is the mesh: less than the
/// half per cent that a mesh may cost.
#[test]
fn exact_frequencies_of_free_and_clamped_annular_plates() {
    for (clamp, poisson, inner, outer, orders) in [
        (Clamp::Nothing, 0.3, Rim::Free, Rim::Free, &[2, 0, 3, 1][..]),
        (Clamp::InnerRim, 1.0 / 3.0, Rim::Clamped, Rim::Free, &[0, 1, 2]),
        (Clamp::OuterRim, 1.0 / 3.0, Rim::Free, Rim::Clamped, &[0, 1, 2]),
    ] {
        let drawing = plate(clamp, poisson);
        let solution = Solution::of(&drawing, &solver()).unwrap();
        for &order in orders {
            let n = i32::try_from(order).unwrap();
            let expected = lowest_root(n, 0.5, poisson, inner, outer);
            let found = number_of(&solution, &drawing, order);
            println!("{clamp:?} {order}: {found} for {expected}, {}", found / expected - 1.0);
            assert!((found / expected - 1.0).abs() < 5e-3, "{clamp:?} {order}: {found} for {expected}");
        }
    }
}

/// The plate of the second discretisation against the same roots: cubic elements of a fifth of the radius are good to a
/// thousandth, and a stiffness that is wrong by a per cent would show.
#[test]
fn exact_frequencies_of_the_laminate_plate() {
    for (clamp, inner, outer) in
        [(Clamp::InnerRim, Rim::Clamped, Rim::Free), (Clamp::OuterRim, Rim::Free, Rim::Clamped)]
    {
        let mut drawing = plate(clamp, 1.0 / 3.0);
        drawing.numbers.mesh_size_m = 0.8e-3;
        let mut expected: Vec<f64> =
            (0..3).map(|order| lowest_root(order, 0.5, 1.0 / 3.0, inner, outer)).collect();
        // All modes but the first of these come in pairs.
        expected.extend([expected[1], expected[2]]);
        expected.sort_by(f64::total_cmp);
        let found = laminate_plate::frequencies_hz(&drawing, 5);
        let lowest = plate_number(&drawing);
        for (found, expected) in found.iter().zip(expected) {
            println!("{clamp:?} {} for {expected}", lowest * found);
            assert!((lowest * found / expected - 1.0).abs() < 1e-3, "{clamp:?} {found} for {expected}");
        }
    }
}

/// A laminate plate of thin theory, of other elements and with another solver, has the frequencies of the bricks within
/// a per cent: with springs, with teeth and without, for silicon that is alike in all directions and for crystals.
#[test]
fn dual_a_laminate_plate_has_the_frequencies_of_the_bricks() {
    for (teeth, silicon) in [(true, Silicon::Crystal), (false, Silicon::Crystal), (true, Silicon::Isotropic)]
    {
        let mut drawing = Drawing { silicon, ..Drawing::default() };
        if !teeth {
            drawing.numbers.tooth_radial_m = 0.0;
        }
        let bricks = if drawing == Drawing::default() { *DEFAULT } else { figures(&drawing) };
        let [a, b, c] = bricks.abc_hz();
        let [t1, t2] = bricks.tilt.map(|tilt| tilt.frequency_hz);
        // As for the plain plates: good to a thousandth.
        drawing.numbers.mesh_size_m = 0.8e-3;
        let plate = laminate_plate::frequencies_hz(&drawing, 5);
        for (brick, plate) in [a, t1, t2, b, c].into_iter().zip(plate) {
            println!("{teeth} {silicon:?}: bricks {brick:.1} Hz, plate {plate:.1} Hz, {:.4}", plate / brick);
            assert!((plate / brick - 1.0).abs() < 0.01, "bricks {brick} Hz, plate {plate} Hz");
        }
    }
}

/// Two layers of equal Poisson's ratio that expand differently bend into a sphere, `bow = curvature (a^2 - b^2) / 2`:
/// [`bimetal_ring`].
#[test]
fn exact_bow_of_a_bimetal_ring() {
    let drawing = bimetal_ring::drawing();
    let n = &drawing.numbers;
    let strain =
        (n.foil_expansion_per_k - n.silicon_expansion_per_k) * (n.bonding_temperature_c - n.temperature_c);
    let curvature = strain * bimetal_ring::curvature_per_strain(&drawing);
    let (a, b) = (n.outer_radius_m, n.inner_radius_m);
    let expected = 0.5 * curvature * (a * a - b * b);
    let solution = Solution::of(&drawing, &solver()).unwrap();
    println!("{} {}", solution.bow_m, solution.bow_m / expected - 1.0);
    // The rims' free edges matter within a thickness of them, 2 % of the width.
    assert!((solution.bow_m / expected - 1.0).abs() < 5e-3, "{} for {expected}", solution.bow_m);
    // A sphere: the same height all along the outer rim.
    let [low, high] = [f64::min, f64::max].map(|least| solution.cooled_rim().reduce(least).unwrap());
    let outer = solution.cooled_profile().last().unwrap().1;
    assert!(
        (low - outer).abs() < 1e-3 * expected && (high - outer).abs() < 1e-3 * expected,
        "{low} {high} {outer}"
    );
    assert_eq!(solution.cooled_rim().count(), solution.mesh.angles().len());
}

/// A ring so large and so stiff that its arms are straight beams between two fixed walls, one of which moves:
///
/// ```text
/// f_A = sqrt(8 (12 E I / l^3) / m) / 2 pi,      I = width t^3 / 12,     Poisson's ratio 0
/// f_T / f_A = sqrt(m R_s^2 / (2 J)),                     springs that push at the radius R_s
/// ```
///
/// A beam that leaves a plate bends up to two widths inside it: 4 % of its length, so that the frequency may be lower
/// by 1.5 times that. The stem pushes within half its width and the arms' width, 2 % of the radius.
#[test]
fn exact_rigid_ring_on_springs() {
    let mut drawing = Drawing { silicon: Silicon::Isotropic, ..Drawing::default() };
    let n = &mut drawing.numbers;
    n.inner_radius_m = 38e-3;
    n.outer_radius_m = 40e-3;
    n.tooth_radius_m = 39e-3;
    n.tooth_radial_m = 0.0;
    n.foil_thickness_m = 1e-3;
    n.foil_modulus_pa = 1e13;
    n.foil_poisson = 0.0;
    n.silicon_poisson = 0.0;
    n.silicon_thickness_m = 25e-6;
    n.spring_arm_width_m = 0.05e-3;
    n.spring_stem_width_m = 2e-3;
    n.spring_stem_m = 20e-6;
    n.spring_half_angle_deg = 8.5;
    n.mesh_size_m = 1.5e-3;
    let solution = Solution::of(&drawing, &solver()).unwrap();
    let n = &drawing.numbers;
    let radius = n.outer_radius_m + n.spring_stem_m + 0.5 * n.spring_arm_width_m;
    let length = radius * n.spring_half_angle_deg.to_radians() - 0.5 * n.spring_stem_width_m;
    let cube = |value: f64| value * value * value;
    let stiffness = n.silicon_modulus_pa * n.spring_arm_width_m * cube(n.silicon_thickness_m) / cube(length);
    let expected = libm::sqrt(8.0 * stiffness / solution.mass.mass_kg) / (2.0 * PI);
    let a = solution.modes.iter().find(|mode| mode.order == 0).unwrap();
    let tilt = solution.modes.iter().find(|mode| mode.order == 1).unwrap();
    let ratio = libm::sqrt(solution.mass.mass_kg * radius * radius / (2.0 * solution.mass.transverse_kg_m2));
    println!("{} {} {}", a.frequency_hz / expected, tilt.frequency_hz / a.frequency_hz / ratio, length);
    assert!((0.94..1.0).contains(&(a.frequency_hz / expected)), "{} for {expected}", a.frequency_hz);
    assert!((tilt.frequency_hz / a.frequency_hz / ratio - 1.0).abs() < 0.02);
    // It moves as a whole: by its mass, and by its moment of inertia over the square of the teeth's radius.
    let at_teeth = solution.mass.transverse_kg_m2 / (n.tooth_radius_m * n.tooth_radius_m);
    for (mode, modal_mass, exponent) in [(a, solution.mass.mass_kg, 0.0), (tilt, at_teeth, 1.0)] {
        assert!(
            (solution.modal_mass_kg(mode) / modal_mass - 1.0).abs() < 1e-3,
            "{}",
            solution.modal_mass_kg(mode)
        );
        assert!((solution.exponent(mode) - exponent).abs() < 1e-3, "{}", solution.exponent(mode));
    }
}

/// The tooth angle of the parametric modal model is `theta_t + theta_m`: with it mode C is `cos 2 theta` at the teeth.
/// The teeth stiffen the ring near them, which takes up to a tenth off the sinusoid; a mode shift of the wrong sign
/// would be a fifth off. The lever is that of a rigid tooth on the middle plane, `(t_s + 2 h_t) / R_t`, within a tenth:
/// the neutral plane lies off the middle by a seventh of the thickness, which is a seventieth of the lever.
#[test]
fn law_the_mode_shift_adds_to_the_tooth_angle() {
    let drawing = coarse(false);
    let n = &drawing.numbers;
    let solution = Solution::of(&drawing, &solver()).unwrap();
    let figures = StatorFigures::read(&solution, &drawing).unwrap();
    let mode = &solution.modes[crate::modes::Places::of(&solution).unwrap().c];
    let [c, s] = solution.parts_at_teeth(mode);
    let at = |shift_deg: f64| libm::cos(2.0 * (n.tooth_angle_deg + shift_deg).to_radians()).abs();
    for (_, [_, _, w]) in solution.at_tips(mode) {
        let share = w.abs() / libm::hypot(c, s);
        let [right, wrong] = [figures.mode_shift_deg[1], -figures.mode_shift_deg[1]].map(at);
        assert!((share / right - 1.0).abs() < 0.1, "{share} {right} {wrong}");
        assert!((right / wrong - 1.0).abs() > 0.1, "the test tells both signs apart: {right} {wrong}");
    }
    let thickness = n.foil_thickness_m + n.silicon_thickness_m;
    let lever = (thickness + 2.0 * n.tooth_height_m) / n.tooth_radius_m;
    assert!(
        figures.lever.iter().all(|found| (found / lever - 1.0).abs() < 0.1),
        "{:?} {lever}",
        figures.lever
    );
}

fn coarse(stressed: bool) -> Drawing {
    let mut drawing = Drawing { stressed, ..Drawing::default() };
    drawing.numbers.mesh_size_m = 0.7e-3;
    drawing
}

/// Equal springs, mirror images about their axes, and no teeth: both kinds of antinodes lie on axes of symmetry, and
/// the tilting modes are a pair. Seven digits are printed.
#[test]
fn law_equal_springs_without_teeth_turn_no_antinode() {
    let mut drawing = coarse(false);
    drawing.numbers.tooth_radial_m = 0.0;
    let figures = StatorFigures::of(&drawing, &solver()).unwrap();
    assert!(figures.mode_shift_deg.iter().all(|turn| turn.abs() < 1e-3), "{:?}", figures.mode_shift_deg);
    let [t1, t2] = figures.tilt;
    assert!((t2.frequency_hz / t1.frequency_hz - 1.0).abs() < 1e-5);
    assert!(figures.effective_tooth_mass_kg.abs() < f64::EPSILON);
}

/// A drawing seen in a mirror turns its antinodes the other way, and has the same frequencies.
#[test]
fn law_a_mirrored_drawing_turns_the_other_way() {
    let drawing = coarse(false);
    let mut mirrored = drawing;
    mirrored.numbers.tooth_angle_deg = 90.0 - drawing.numbers.tooth_angle_deg;
    let [one, other] = [drawing, mirrored].map(|drawing| StatorFigures::of(&drawing, &solver()).unwrap());
    for place in 0..2 {
        let (turn, back) = (one.mode_shift_deg[place], other.mode_shift_deg[place]);
        assert!(turn.abs() > 0.1 && (turn + back).abs() < 1e-3, "{turn} {back}");
        assert!((one.lever[place] / other.lever[place] - 1.0).abs() < 1e-4);
    }
    for (a, b) in one.abc_hz().into_iter().zip(other.abc_hz()) {
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }
}

/// A stator that was bonded one kelvin warmer is hardly stressed: its bow is that of linear theory, its modes are those
/// of the flat one, and both are computed in another way, on the same mesh, however coarse.
#[test]
fn law_without_stress_the_stressed_modes_are_the_flat_ones() {
    let figures = [false, true].map(|stressed| {
        let mut drawing = coarse(stressed);
        drawing.numbers.mesh_size_m = 1.2e-3;
        drawing.numbers.bonding_temperature_c = drawing.numbers.temperature_c + 1.0;
        StatorFigures::of(&drawing, &solver()).unwrap()
    });
    let [flat, stressed] = figures;
    assert!((stressed.bow_m / flat.bow_m - 1.0).abs() < 0.01, "{} {}", stressed.bow_m, flat.bow_m);
    for (a, b) in flat.abc_hz().into_iter().zip(stressed.abc_hz()) {
        assert!((a / b - 1.0).abs() < 2e-3, "{a} {b}");
    }
}

/// A ring of one material whose outer rim is held is stretched by cooling, which makes it stiffer, and pressed by
/// warming. The squares of its frequencies go with the stress, so that both change by the same amount on any mesh.
#[test]
fn law_tension_stiffens_and_compression_softens() {
    let square = |stressed, kelvin: f64| {
        let mut drawing = Drawing { stressed, ..plate(Clamp::OuterRim, 0.3) };
        drawing.numbers.mesh_size_m = 1.2e-3;
        drawing.numbers.foil_expansion_per_k = drawing.numbers.silicon_expansion_per_k;
        drawing.numbers.bonding_temperature_c = drawing.numbers.temperature_c + kelvin;
        let solution = Solution::of(&drawing, &solver()).unwrap();
        let mode = solution.modes.iter().find(|mode| mode.order == 0).unwrap();
        mode.frequency_hz * mode.frequency_hz
    };
    let (flat, cooled, warmed) = (square(false, 5.0), square(true, 5.0), square(true, -5.0));
    let (up, down) = (cooled / flat - 1.0, 1.0 - warmed / flat);
    assert!(up > 0.02 && down > 0.02, "{up} {down}");
    assert!((up / down - 1.0).abs() < 0.1, "{up} {down}");
}

/// A fifth of the bricks of a fine mesh give its frequencies within half a per cent, which is what a mesh may cost.
#[test]
fn law_the_default_mesh_has_converged() {
    let mut fine = Drawing::default();
    fine.numbers.mesh_size_m *= 0.5;
    let (one, other) = (*DEFAULT, figures(&fine));
    let all = |figures: &StatorFigures| [figures.a, figures.tilt[0], figures.b, figures.c];
    for (coarse, fine) in all(&one).into_iter().zip(all(&other)) {
        println!("{} {}", coarse.frequency_hz, fine.frequency_hz);
        assert!((coarse.frequency_hz / fine.frequency_hz - 1.0).abs() < 5e-3, "{coarse:?} {fine:?}");
        assert!((coarse.modal_mass_kg / fine.modal_mass_kg - 1.0).abs() < 5e-3, "{coarse:?} {fine:?}");
    }
    assert!((one.bow_m / other.bow_m - 1.0).abs() < 5e-3);
}

/// The output of another drawing has other volumes, and is refused; a ring without springs has no mode A.
#[cfg(unix)]
#[test]
fn law_what_is_not_of_this_drawing_is_refused() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let script = "#!/bin/sh\ncp $0.dat stator.dat\n";
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let drawing = coarse(false);
    let kept = folder.path().join("kept");
    let real = Solver { cache: Some(kept.clone()), ..solver() };
    Solution::of(&drawing, &real).unwrap();
    let result: PathBuf = std::fs::read_dir(&kept).unwrap().next().unwrap().unwrap().path();
    std::fs::copy(&result, folder.path().join("program.dat")).unwrap();
    let other = Solver { program, ..solver() };
    let mut thicker = drawing;
    thicker.numbers.silicon_thickness_m *= 1.01;
    let said = Solution::of(&thicker, &other).unwrap_err().to_string();
    assert!(said.ends_with("its volumes are not those of the drawing"), "{said}");

    let mut empty = Solution::of(&drawing, &real).unwrap();
    empty.modes.truncate(3);
    let said = StatorFigures::read(&empty, &drawing).unwrap_err().to_string();
    assert_eq!(said, "no mode B among the 3 lowest modes of this stator");
}
