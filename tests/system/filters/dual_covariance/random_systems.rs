//! Random systems of six states, against the yardstick and against the same step in another form.

use motor_model::Real;
use nalgebra::{Matrix2, SMatrix, SVector};
use proptest::prelude::*;
use ud_filter::{Blocks2, Dense, NoiseSource, UdCovariance, UpperTriangular};

use super::pair::{Pair, all_positive, distance, epsilon, rounded};

/// Shape of the transition; gain and decimal logarithm of the variance of a noise source, and of a measurement.
type Step = (u8, [f64; 6], f64, [f64; 6], f64);

/// Entries of a system of six states in three blocks.
#[derive(Clone, Debug)]
struct Scenario {
    start: [f64; 6],
    blocks: [[f64; 4]; 3],
    upper: Vec<f64>,
    steps: Vec<Step>,
}

prop_compose! {
    fn scenario()(
        start in prop::array::uniform6(-3.0..3.0_f64),
        blocks in prop::array::uniform3(prop::array::uniform4(-1.0..1.0_f64)),
        upper in prop::collection::vec(-0.5..0.5_f64, 36),
        steps in prop::collection::vec((
            0..3_u8,
            prop::array::uniform6(-1.0..1.0_f64), -4.0..0.0_f64,
            prop::array::uniform6(-1.0..1.0_f64), -4.0..2.0_f64,
        ), 1..12)
    ) -> Scenario {
        Scenario { start: start.map(|x| 10.0_f64.powf(x)), blocks, upper, steps }
    }
}

impl Scenario {
    /// The worst distance over the steps, in units of rounding times the square root of the condition number.
    fn worst<T: Real>(&self) -> f64 {
        let mut pair = Pair::<T, 6>::new(self.start);
        // Near a rotation by a quarter, so that what lies below the diagonal is large and no block is nearly singular.
        let blocks = Blocks2(self.blocks.map(|[a, b, c, d]| {
            rounded::<T, 2, 2>(&Matrix2::new(0.3 * a, 1.0 + 0.3 * b, -1.0 + 0.3 * c, 0.3 * d))
        }));
        let full = rounded::<T, 6, 6>(
            &(SMatrix::<f64, 6, 6>::identity() + SMatrix::from_column_slice(&self.upper) * 0.5),
        );
        let triangular = UpperTriangular(full.upper_triangle());
        let mut worst = 0.0_f64;
        for (shape, gain, q, row, r) in &self.steps {
            let mut gain = *gain;
            gain[4..].iter_mut().for_each(|g| *g = if *r > 0.0 { 0.0 } else { *g });
            let noise = [NoiseSource {
                gain: rounded(&SVector::from(gain)),
                variance: T::from_f64(10.0_f64.powf(*q)),
            }];
            match shape {
                0 => pair.predict(&blocks, &blocks.matrix(), &noise),
                1 => pair.predict(&triangular, &triangular.0, &noise),
                _ => pair.predict(&Dense(full), &full, &noise),
            }
            let gain_error = pair.update(*row, 10.0_f64.powf(*r), 0.1);
            assert!(all_positive(&pair.factors));
            let exact = pair.precise.covariance();
            let eigenvalues = correlation(&exact).symmetric_eigenvalues();
            let condition = (eigenvalues.max() / eigenvalues.min().max(f64::MIN_POSITIVE)).sqrt();
            worst = worst.max(pair.distance().max(gain_error) / (epsilon::<T>() * condition));
        }
        worst
    }
}

/// The covariance in units of its own standard errors.
fn correlation<const N: usize>(p: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    SMatrix::from_fn(|i, j| p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Random systems, every shape of transition: definite, symmetric to the bit, and off by rounding times the root of
    /// the condition only.
    #[test]
    fn dual_random_systems_agree_to_rounding(scenario in scenario()) {
        let (single, double) = (scenario.worst::<f32>(), scenario.worst::<f64>());
        prop_assert!(single < 100.0 && double < 100.0, "{single} {double}");
    }

    /// A structured transition against the dense one on the same numbers.
    #[test]
    fn dual_structured_transitions_equal_the_dense_one(scenario in scenario()) {
        let start = SVector::from(scenario.start);
        let blocks = Blocks2(scenario.blocks.map(|[a, b, c, d]| Matrix2::new(a, b, c, d)));
        let full = SMatrix::<f64, 6, 6>::from_column_slice(&scenario.upper).upper_triangle();
        let triangular = UpperTriangular(full);
        let mut p = UdCovariance::from_diagonal(&start);
        let mix = SMatrix::<f64, 6, 6>::identity() + SMatrix::from_column_slice(&scenario.upper);
        p.transform(&mix).expect("a plain model");
        let (mut by_blocks, mut by_triangle, mut dense) = (p, p, p);
        by_blocks.predict(&blocks, &[]).expect("a plain model");
        dense.transform(&blocks.matrix()).expect("a plain model");
        let scale = |p: &UdCovariance<f64, 6>| p.variances().max();
        prop_assert!((by_blocks.covariance() - dense.covariance()).abs().max() <= 1e-12 * scale(&dense));
        by_triangle.predict(&triangular, &[]).expect("a plain model");
        dense = p;
        dense.transform(&full).expect("a plain model");
        prop_assert!((by_triangle.covariance() - dense.covariance()).abs().max() <= 1e-12 * scale(&dense));
    }

    /// A measured state against the same measurement as a row.
    #[test]
    fn dual_a_measured_state_is_a_row_of_the_unit_matrix(scenario in scenario(), r in -8.0..2.0_f64) {
        let mut p = UdCovariance::from_diagonal(&SVector::from(scenario.start));
        let mix = SMatrix::<f64, 6, 6>::identity() + SMatrix::from_column_slice(&scenario.upper);
        p.transform(&mix).expect("a plain model");
        let (mut by_row, mut by_state) = (p, p);
        let (mut x, mut y) = (SVector::zeros(), SVector::zeros());
        let row = SVector::<f64, 6>::ith(2, 1.0);
        let r = 10.0_f64.powf(r);
        by_row.update(&row, r, 0.3, &mut x).unwrap();
        by_state.update_state::<2>(r, 0.3, &mut y).unwrap();
        prop_assert!((x - y).component_div(&p.variances().map(f64::sqrt)).abs().max() < 1e-9 / r.sqrt());
        prop_assert!(distance(&by_row.covariance(), &by_state.covariance()) < 1e-8);
    }
}
