//! What a step needs at least: its products and divisions, and the longest chain of operations that wait for each
//! other. A number counts the operations, and carries the length of the chain that led to it.

use std::cell::Cell;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign};
use std::thread::LocalKey;

use nalgebra::SVector;
use num_traits::{Bounded, Num, One, Zero};
use ud_filter::{Blocks2, NoiseSource, Transition, UdCovariance, UpperTriangular};

use crate::problem::{Problem, measurements};

/// Cycles of a sum or product, and of a division, on the processors that this project is timed on.
const SUM_CYCLES: u64 = 3;
const DIVISION_CYCLES: u64 = 13;

/// Steps that are counted, after as many that are not.
const STEPS: u32 = 500;

thread_local! {
    static PRODUCTS: Cell<u64> = const { Cell::new(0) };
    static DIVISIONS: Cell<u64> = const { Cell::new(0) };
}

/// A number, and the cycles after which it is known. Numbers are equal where their values are.
#[derive(Clone, Copy, Debug, Default)]
struct Counted {
    value: f64,
    known_at: u64,
}

impl Counted {
    fn after(self, other: Self, value: f64, cycles: u64) -> Self {
        Self { value, known_at: self.known_at.max(other.known_at) + cycles }
    }
}

fn count(counter: &'static LocalKey<Cell<u64>>) {
    counter.set(counter.get() + 1);
}

impl PartialEq for Counted {
    fn eq(&self, other: &Self) -> bool {
        self.value.eq(&other.value)
    }
}

impl PartialOrd for Counted {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

macro_rules! operation {
    ($operation:ident $call:ident, $assign:ident $assign_call:ident, $cycles:expr $(, $counter:ident)?) => {
        impl $operation for Counted {
            type Output = Self;
            fn $call(self, other: Self) -> Self {
                $(count(&$counter);)?
                self.after(other, self.value.$call(other.value), $cycles)
            }
        }
        impl $assign for Counted {
            fn $assign_call(&mut self, other: Self) {
                *self = self.$call(other);
            }
        }
    };
}

operation!(Add add, AddAssign add_assign, SUM_CYCLES);
operation!(Sub sub, SubAssign sub_assign, SUM_CYCLES);
operation!(Mul mul, MulAssign mul_assign, SUM_CYCLES, PRODUCTS);
operation!(Div div, DivAssign div_assign, DIVISION_CYCLES, DIVISIONS);
operation!(Rem rem, RemAssign rem_assign, DIVISION_CYCLES, DIVISIONS);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
}

impl From<f32> for Counted {
    fn from(value: f32) -> Self {
        Self { value: value.into(), known_at: 0 }
    }
}

impl Zero for Counted {
    fn zero() -> Self {
        Self::from(0.0)
    }
    fn is_zero(&self) -> bool {
        self.value.is_zero()
    }
}

impl One for Counted {
    fn one() -> Self {
        Self::from(1.0)
    }
}

impl Bounded for Counted {
    fn min_value() -> Self {
        Self { value: f64::MIN, known_at: 0 }
    }
    fn max_value() -> Self {
        Self { value: f64::MAX, known_at: 0 }
    }
}

impl Num for Counted {
    type FromStrRadixErr = <f64 as Num>::FromStrRadixErr;
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        <f64 as Num>::from_str_radix(text, radix).map(|value| Self { value, known_at: 0 })
    }
}

/// What a step needs on average.
pub struct Needs {
    /// Products.
    pub products: u64,
    /// Divisions.
    pub divisions: u64,
    /// Cycles from step to step, of sums, products and divisions that wait for each other.
    pub chain_cycles: u64,
}

fn counted(value: f64) -> Counted {
    Counted { value, known_at: 0 }
}

/// Of a structured step, as it is timed; `update` uses measurement `m`, which is z.
fn needs<F: Transition<Counted, N>, const N: usize, const S: usize, const M: usize>(
    problem: &Problem<f64, N, M>,
    transition: &F,
    mut update: impl FnMut(&mut UdCovariance<Counted, N>, &mut SVector<Counted, N>, usize, Counted),
) -> Needs {
    let sources = problem
        .sources::<S>()
        .map(|source| NoiseSource { gain: source.gain.map(counted), variance: counted(source.variance) });
    let mut covariance = UdCovariance::from_diagonal(&SVector::repeat(counted(problem.start_variance)));
    let mut state = SVector::<Counted, N>::zeros();
    let mut before = (0, 0, 0);
    let mut after = before;
    for (step, z) in (0..).zip(&measurements::<f64, M>(2 * STEPS)) {
        state = transition.carry(&state);
        covariance.predict(transition, &sources).expect("a plain model");
        for (m, &z) in z.iter().enumerate() {
            update(&mut covariance, &mut state, m, counted(z));
        }
        let all = covariance.unit.iter().flatten().chain(&covariance.weights).chain(&state);
        after = (PRODUCTS.get(), DIVISIONS.get(), all.map(|x| x.known_at).max().unwrap_or_default());
        if step + 1 == STEPS {
            before = after;
        }
    }
    let of_a_step = |after: u64, before: u64| (after - before) / u64::from(STEPS);
    Needs {
        products: of_a_step(after.0, before.0),
        divisions: of_a_step(after.1, before.1),
        chain_cycles: of_a_step(after.2, before.2),
    }
}

/// Two states, of which the first is measured.
pub fn of_two_states() -> Needs {
    let problem = Problem::<f64, 2, 1>::constant_rate();
    let transition = UpperTriangular(problem.transition.map(counted));
    needs::<_, 2, 2, 1>(&problem, &transition, |covariance, state, _, z| {
        let innovation = z - state.x;
        covariance.update_state::<0>(counted(1.0), innovation, state).expect("a plain measurement");
    })
}

/// Modes as 2 x 2 blocks, the states first on which noise acts.
pub fn of_modes<const N: usize, const B: usize, const M: usize>() -> Needs {
    let problem = Problem::<f64, N, M>::modal().noise_driven_first();
    let block = |b: usize| problem.transition.fixed_view::<2, 2>(2 * b, 2 * b).map(counted);
    let transition = Blocks2::<Counted, B>(std::array::from_fn(block));
    let rows: [SVector<Counted, N>; M] =
        std::array::from_fn(|m| problem.rows.row(m).transpose().map(counted));
    needs::<_, N, B, M>(&problem, &transition, |covariance, state, m, z| {
        let innovation = z - rows[m].dot(state);
        covariance.update(&rows[m], counted(1.0), innovation, state).expect("a plain measurement");
    })
}
