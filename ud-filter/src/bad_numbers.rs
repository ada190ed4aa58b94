//! Tests that an infinity or NaN never becomes certainty: through every way in, and every shape of transition.

use nalgebra::{Matrix2, SMatrix, SVector};
use proptest::prelude::*;

use crate::test_support::Rounded;
use crate::{
    Blocks, Blocks2, Dense, NoiseSource, NotAVariance, NotFactors, PredictionRefusal, Refusal, Transition,
    UdCovariance, UpperTriangular, WhitenedMeasurement,
};

type Vector<T> = SVector<T, 4>;
type Matrix<T> = SMatrix<T, 4, 4>;

/// No numbers, in `f64`; in `f32` too.
const BAD: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// A covariance of four correlated states.
fn correlated<T: Rounded>() -> UdCovariance<T, 4> {
    let mut p = UdCovariance::from_diagonal(&Vector::from([1.0, 2.0, 0.5, 3.0].map(T::rounded)));
    let mix = Matrix::from_fn(|i, j| T::rounded(if i == j { 1.0 } else { 0.1 * (1 + i + 2 * j) as f64 }));
    p.transform(&mix).unwrap();
    p
}

fn with_entry<T: Rounded>(i: usize, j: usize, bad: T) -> Matrix<T> {
    let mut f = Matrix::<T>::identity();
    f[(i, j)] = bad;
    f
}

/// `f` in each shape that reads its entry (`i`, `j`).
fn each_shape<T: Rounded>(f: &Matrix<T>, (i, j): (usize, usize), mut see: impl FnMut(&dyn Carrier<T>)) {
    see(&Dense(*f));
    if i <= j {
        see(&UpperTriangular(*f));
    }
    if i / 2 == j / 2 {
        let block = |b: usize| f.fixed_view::<2, 2>(2 * b, 2 * b).into_owned();
        see(&Blocks2([block(0), block(1)]));
    }
    if (i == 0) == (j == 0) {
        see(&Blocks((f.fixed_view::<1, 1>(0, 0).into_owned(), f.fixed_view::<3, 3>(1, 1).into_owned())));
    }
    if (i == 3) == (j == 3) {
        see(&Blocks((f.fixed_view::<3, 3>(0, 0).into_owned(), f.fixed_view::<1, 1>(3, 3).into_owned())));
    }
}

/// A transition whose type is not known: both ways to use it.
trait Carrier<T: Rounded> {
    fn predict(&self, p: &mut UdCovariance<T, 4>) -> Result<(), PredictionRefusal>;
    fn carry_factors(&self, p: &mut UdCovariance<T, 4>);
}

impl<T: Rounded, F: Transition<T, 4>> Carrier<T> for F {
    fn predict(&self, p: &mut UdCovariance<T, 4>) -> Result<(), PredictionRefusal> {
        p.predict(self, &[])
    }
    fn carry_factors(&self, p: &mut UdCovariance<T, 4>) {
        Transition::carry_factors(self, p);
    }
}

/// Whether no variance of `after` is smaller than before, rounding aside. An infinity or NaN is not smaller.
fn none_is_smaller<T: Rounded>(before: &UdCovariance<T, 4>, after: &UdCovariance<T, 4>) -> bool {
    let rounding = if size_of::<T>() == 4 { 1e-5 } else { 1e-12 };
    let smaller = |(before, after): (&T, &T)| after.wide() < before.wide() * (1.0 - rounding);
    let (before, after) = (before.variances(), after.variances());
    !before.iter().zip(after.iter()).any(smaller)
}

fn assert_a_transition_is_refused<T: Rounded>() {
    for (place, bad) in (0..16).flat_map(|place| BAD.map(|bad| (place, T::rounded(bad)))) {
        let at = (place / 4, place % 4);
        each_shape(&with_entry(at.0, at.1, bad), at, |f| {
            let mut p = correlated::<T>();
            assert_eq!(f.predict(&mut p), Err(PredictionRefusal::Transition), "{at:?} {bad:?}");
            assert_eq!(p, correlated());
        });
    }
}

#[test]
fn law_a_transition_that_is_no_number_is_refused() {
    assert_a_transition_is_refused::<f32>();
    assert_a_transition_is_refused::<f64>();
}

fn assert_an_unchecked_transition_is_no_certainty<T: Rounded>() {
    for (place, bad) in (0..16).flat_map(|place| BAD.map(|bad| (place, T::rounded(bad)))) {
        let at = (place / 4, place % 4);
        each_shape(&with_entry(at.0, at.1, bad), at, |f| {
            let mut p = correlated::<T>();
            f.carry_factors(&mut p);
            assert!(none_is_smaller(&correlated(), &p), "{at:?} {bad:?} {p:?}");
            assert!(!p.variances()[at.0].wide().is_finite(), "{at:?} {bad:?} {p:?}");
            let one_by_one = [p.variance::<0>(), p.variance::<1>(), p.variance::<2>(), p.variance::<3>()];
            assert!(!one_by_one[at.0].wide().is_finite(), "{at:?} {bad:?} {p:?}");
            // Once more: what is not finite stays so, whatever comes.
            each_shape(&Matrix::identity(), at, |next| {
                let mut p = p;
                next.carry_factors(&mut p);
                assert!(!p.variances()[at.0].wide().is_finite(), "{at:?} {bad:?} {p:?}");
            });
        });
    }
}

#[test]
fn law_an_unchecked_transition_that_is_no_number_is_no_certainty() {
    assert_an_unchecked_transition_is_no_certainty::<f32>();
    assert_an_unchecked_transition_is_no_certainty::<f64>();
}

fn assert_noise_is_refused<T: Rounded>() {
    let plain = NoiseSource { gain: Vector::repeat(T::one()), variance: T::one() };
    let mut cases = BAD.map(|bad| NoiseSource { variance: T::rounded(bad), ..plain }).to_vec();
    cases.push(NoiseSource { variance: -T::one(), ..plain });
    for (state, bad) in (0..4).flat_map(|state| BAD.map(|bad| (state, T::rounded(bad)))) {
        let mut gain = plain.gain;
        gain[state] = bad;
        cases.push(NoiseSource { gain, ..plain });
    }
    let f = Blocks2([Matrix2::identity(); 2]);
    for bad in cases {
        let mut p = correlated::<T>();
        assert_eq!(p.predict(&f, &[plain, bad]), Err(PredictionRefusal::Noise), "{bad:?}");
        assert_eq!(p.predict(&f, &[bad, plain]), Err(PredictionRefusal::Noise), "{bad:?}");
        assert_eq!(p, correlated());
        let is_negative = bad.variance < T::zero();
        for sources in [[plain, bad], [bad, plain]] {
            let mut p = correlated::<T>();
            p.add_noise(&sources);
            assert!(none_is_smaller(&correlated(), &p), "{bad:?} {p:?}");
            let finite = p.variances().iter().all(|variance| variance.wide().is_finite());
            assert_eq!(finite, is_negative, "{bad:?} {p:?}");
        }
    }
}

#[test]
fn law_noise_that_is_no_number_is_refused_or_told() {
    assert_noise_is_refused::<f32>();
    assert_noise_is_refused::<f64>();
}

/// With few states, whose noise takes the published form.
#[test]
fn law_infinite_noise_on_two_states_is_told() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut p = UdCovariance::<f32, 2>::from_diagonal(&SVector::from([1.0, 1.0]));
        p.add_rank_one(&SVector::from([0.5, 1.0]), bad);
        assert!(p.variances().iter().all(|variance| !variance.is_finite()), "{p:?}");
    }
}

fn assert_a_prior_is_refused<T: Rounded>() {
    let plain = [1.0, 2.0, 0.5, 3.0].map(T::rounded);
    let made = UdCovariance::try_from_diagonal(&Vector::from(plain)).unwrap();
    let mut set = correlated();
    set.try_set_diagonal(&Vector::from(plain)).unwrap();
    assert_eq!(set, made);
    assert_eq!(made.covariance(), Matrix::from_diagonal(&Vector::from(plain)));
    // A state may be known exactly.
    assert_eq!(UdCovariance::try_from_diagonal(&Vector::<T>::zeros()), Ok(UdCovariance::known()));
    for (state, bad) in (0..4).flat_map(|state| [f64::NAN, f64::INFINITY, -1.0].map(|bad| (state, bad))) {
        let mut variances = plain;
        variances[state] = T::rounded(bad);
        let variances = Vector::from(variances);
        assert_eq!(UdCovariance::try_from_diagonal(&variances), Err(NotAVariance { state }));
        let mut set = correlated();
        assert_eq!(set.try_set_diagonal(&variances), Err(NotAVariance { state }));
        assert_eq!(set, correlated());
        assert!(UdCovariance::from_covariance(&Matrix::from_diagonal(&variances)).is_err());
        let (mut p, mut x) = (UdCovariance::from_diagonal(&variances), Vector::zeros());
        assert!(!p.variances()[state].wide().is_finite(), "{p:?}");
        let row = Vector::from_fn(|i, _| if i == state { T::one() } else { T::zero() });
        assert_eq!(p.update(&row, T::one(), T::one(), &mut x), Err(Refusal::Uncertain));
        assert_eq!(x, Vector::zeros());
    }
}

#[test]
fn law_a_prior_that_is_no_number_is_refused_or_told() {
    assert_a_prior_is_refused::<f32>();
    assert_a_prior_is_refused::<f64>();
}

#[test]
fn law_factors_that_are_no_numbers_are_refused() {
    let p = correlated::<f32>();
    let (unit, weights) = (p.unit_factor(), p.weights());
    assert_eq!(UdCovariance::from_factors(&unit, &weights), Ok(p));
    for bad in BAD.map(|bad| bad as f32) {
        for (row, column) in (0..16).map(|place| (place / 4, place % 4)) {
            let mut unit = unit;
            unit[(row, column)] = bad;
            let refused = UdCovariance::from_factors(&unit, &weights);
            assert_eq!(refused, Err(NotFactors::Unit { row, column }));
        }
        for state in 0..4 {
            let mut weights = weights;
            weights[state] = bad;
            let refused = UdCovariance::from_factors(&unit, &weights);
            assert_eq!(refused, Err(NotFactors::Variance(NotAVariance { state })));
        }
    }
    // Finite factors whose product is not.
    let mut unit = unit;
    unit[(1, 3)] = 1e20;
    let refused = UdCovariance::from_factors(&unit, &weights);
    assert_eq!(refused, Err(NotFactors::Variance(NotAVariance { state: 1 })));
}

/// A state that is forgotten takes what the others shared with it along, even if that is no number.
#[test]
fn law_a_state_replaced_leaves_its_bad_numbers_with_the_others() {
    for bad in [f64::NAN, f64::INFINITY] {
        let mut p = correlated::<f64>();
        p.weights[3] = bad;
        p.replace_state(3, 1.0);
        assert!(p.variances().iter().take(3).all(|variance| !variance.is_finite()), "{p:?}");
        let mut p = correlated::<f64>();
        p.inflate::<2>(bad);
        assert!(p.variances().iter().take(2).all(|variance| !variance.is_finite()), "{p:?}");
        let mut p = correlated::<f64>();
        p.add_effects(1, &[(3, [bad])]);
        assert!(!p.variances()[1].is_finite() && none_is_smaller(&correlated(), &p), "{p:?}");
    }
}

/// Numbers that are finite, but whose square is none of this precision: the true variance is near 1.
#[test]
fn exact_a_scale_whose_square_underflows_is_no_certainty() {
    let scale = 1e-25_f32;
    let p = UdCovariance::<f32, 2>::from_covariance(&Matrix2::new(2.0, 1.0, 1.0, 1.0)).unwrap();
    let mut triangular = p;
    triangular.predict(&UpperTriangular(Matrix2::new(1.0, 0.0, 0.0, scale)), &[]).unwrap();
    assert!((triangular.variance::<0>() - 2.0).abs() < 1e-5, "{triangular:?}");
    let mut singles = p;
    let block = SMatrix::<f32, 1, 1>::new;
    singles.predict(&Blocks((block(1.0), block(scale))), &[]).unwrap();
    assert!((singles.variance::<0>() - 2.0).abs() < 1e-5, "{singles:?}");
    let mut blocks = p;
    blocks.predict(&Blocks2([Matrix2::new(scale, 0.0, 0.0, 1.0)]), &[]).unwrap();
    assert!((blocks.variance::<1>() - 1.0).abs() < 1e-5, "{blocks:?}");
    // F P F' by hand, with rows (1, 0) and (1, 1e-25): both variances are 2.
    let mut blocks = p;
    blocks.predict(&Blocks2([Matrix2::new(1.0, 0.0, 1.0, scale)]), &[]).unwrap();
    assert!(blocks.variances().iter().all(|variance| (variance - 2.0).abs() < 1e-5), "{blocks:?}");
}

/// Numbers that are finite, and whose products are not.
#[test]
fn law_an_overflow_is_no_certainty() {
    let huge = 1e30_f32;
    let start = UdCovariance::<f32, 2>::from_diagonal(&SVector::from([1e20, 1e20]));
    let f = Matrix2::new(1.0, 0.0, huge, 1.0);
    let mut blocks = start;
    blocks.predict(&Blocks2([f]), &[]).unwrap();
    let mut dense = start;
    dense.predict(&Dense(f), &[]).unwrap();
    let mut triangular = start;
    triangular.predict(&UpperTriangular(f.transpose()), &[]).unwrap();
    for (p, state) in [(blocks, 1), (dense, 1), (triangular, 0)] {
        assert!(!p.variances()[state].is_finite(), "{p:?}");
        assert!(p.variances().iter().all(|&variance| variance.is_nan() || variance > 0.99e20), "{p:?}");
    }
    // A sum of products of both signs: infinity less infinity.
    let mut p = UdCovariance::<f32, 3>::from_diagonal(&SVector::repeat(1.0));
    p.unit[2] = [1e20, 1e20, 1.0];
    let f = SMatrix::<f32, 3, 3>::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, huge, -huge, 1.0);
    p.predict(&Dense(f), &[]).unwrap();
    assert!(p.variances().iter().all(|variance| !variance.is_finite()), "{p:?}");
}

/// What a step of a sequence does with a bad number.
#[derive(Clone, Copy, Debug)]
struct Step {
    operation: u8,
    /// Which of [`BAD`].
    bad: usize,
    place: usize,
    gain: [f64; 4],
}

prop_compose! {
    fn step()(
        operation in 0..8_u8, bad in 0..3_usize, place in 0..16_usize,
        gain in prop::array::uniform4(-2.0..2.0_f64),
    ) -> Step {
        Step { operation, bad, place, gain }
    }
}

impl Step {
    fn take<T: Rounded>(&self, p: &mut UdCovariance<T, 4>, x: &mut Vector<T>) {
        let bad = T::rounded(BAD[self.bad]);
        let (i, j) = (self.place / 4, self.place % 4);
        let plain = Vector::from(self.gain.map(T::rounded));
        let mut poisoned = plain;
        poisoned[i] = bad;
        let one = T::one();
        let mut shape = 0;
        match self.operation {
            0 => each_shape(&with_entry(i, j, bad), (i, j), |f| assert!(f.predict(p).is_err())),
            // One of the shapes, without the check.
            1 => each_shape(&with_entry(i, j, bad), (i, j), |f| {
                if shape == j % 3 {
                    f.carry_factors(p);
                }
                shape += 1;
            }),
            2 => p.add_noise(&[NoiseSource { gain: plain, variance: bad }]),
            3 => p.add_rank_one(&poisoned, one),
            4 => assert!(p.update(&poisoned, one, one, x).is_err()),
            5 => assert!(p.update(&plain, bad, one, x).is_err()),
            6 => assert!(p.update_state::<2>(one, bad, x).is_err()),
            _ => {
                let [row] = &plain.data.0;
                let bad = WhitenedMeasurement { row, noise: one, innovation: bad };
                assert_eq!(
                    p.update_pair([WhitenedMeasurement { innovation: one, ..bad }, bad]),
                    Vector::zeros()
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// No sequence of steps, each with a bad number, makes a variance smaller or changes the state.
    #[test]
    fn law_no_bad_number_makes_a_variance_smaller(steps in prop::collection::vec(step(), 1..8)) {
        let (mut single, mut double) = (correlated::<f32>(), correlated::<f64>());
        let (mut x, mut y) = (Vector::zeros(), Vector::zeros());
        for step in &steps {
            step.take(&mut single, &mut x);
            step.take(&mut double, &mut y);
        }
        prop_assert!(none_is_smaller(&correlated(), &single), "{single:?}");
        prop_assert!(none_is_smaller(&correlated(), &double), "{double:?}");
        prop_assert!(x == Vector::zeros() && y == Vector::zeros());
    }
}
