//! A test that the feature `unroll` changes no bit: both builds are held to the same digest.

use nalgebra::{Matrix2, SMatrix, SVector};

use crate::test_support::Rounded;
use crate::{Blocks2, Dense, NoiseSource, Transition, UdCovariance, UpperTriangular};

/// By blocks, triangular, dense, and triangular with more states than are unrolled.
const DOUBLE: [u64; 4] =
    [0xc842_3d8a_fc93_685f, 0x0def_79c4_145e_f9ba, 0x412d_9b04_bcb3_219a, 0x2821_702f_3829_9b71];
const SINGLE: [u64; 4] =
    [0x0881_d529_39e9_7959, 0xb803_e915_fefa_bf47, 0x3a8b_77ff_116a_4e90, 0xe8e3_74d1_f8fc_909e];

/// Some steps of a model, by each kind of step that is unrolled; the digest of state and factors.
fn digest<T: Rounded, const N: usize>(transition: &impl Transition<T, N>, bits: impl Fn(T) -> u64) -> u64 {
    let number = |i: usize| T::rounded(0.3 + 0.1 * ((7 * i) % 11) as f64);
    let noise = [2, 5].map(|k| NoiseSource {
        gain: SVector::from_fn(|i, _| if i <= k { number(i + k) } else { T::zero() }),
        variance: T::rounded(0.01),
    });
    let mut p = UdCovariance::from_diagonal(&SVector::from_fn(|i, _| number(i)));
    let mut x = SVector::<T, N>::zeros();
    for step in 0..20 {
        x = transition.carry(&x);
        p.predict(transition, &noise).unwrap();
        let row = SVector::from_fn(|i, _| number(i + step) - T::rounded(0.8));
        p.update(&row, T::rounded(0.1), T::one() - row.dot(&x), &mut x).unwrap();
        p.update_state::<1>(T::rounded(0.2), -x[1], &mut x).unwrap();
    }
    // Fowler, Noll and Vo, by numbers in place of bytes.
    let numbers = x.iter().chain(p.unit.iter().flatten()).chain(&p.weights);
    numbers.fold(0xcbf2_9ce4_8422_2325, |digest, &x| (digest ^ bits(x)).wrapping_mul(0x0100_0000_01b3))
}

fn digests<T: Rounded>(bits: impl Fn(T) -> u64 + Copy) -> [u64; 4] {
    let rotation = Matrix2::new(0.8, 0.5, -0.6, 0.7).map(T::rounded);
    let dense = SMatrix::<T, 6, 6>::from_fn(|i, j| T::rounded(0.1 * ((3 * i + 5 * j) % 7) as f64 - 0.2));
    // More states than are unrolled.
    let many = SMatrix::<T, 14, 14>::from_fn(|i, j| {
        T::rounded(if i == j { 0.9 } else { 0.01 * ((i + 2 * j) % 5) as f64 })
    });
    [
        digest::<T, 10>(&Blocks2([rotation; 5]), bits),
        digest(&UpperTriangular(dense + SMatrix::identity()), bits),
        digest(&Dense(dense), bits),
        digest(&UpperTriangular(many), bits),
    ]
}

#[test]
fn exact_unrolling_changes_no_bit() {
    assert_eq!(digests::<f64>(f64::to_bits), DOUBLE);
    assert_eq!(digests::<f32>(|x| u64::from(x.to_bits())), SINGLE);
}
