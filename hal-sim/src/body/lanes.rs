//! Numbers side by side: the same arithmetic on several half-chains at once.
//!
//! Even lanes carry the front half of a body's chain, odd lanes the rear half of the same body: a body takes two lanes.
//! What a lane computes does not depend on the others, so that the width changes no result of a given precision.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdFrom, f32x8, f32x16, f64x2, f64x4, f64x8};

/// Several numbers in a register.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Proof that the processor has the instructions.
    type Token: Simd;
    /// The same numbers in memory.
    type Store: Store;

    /// Loads every lane.
    fn load(token: Self::Token, store: &Self::Store) -> Self;
    /// Stores every lane.
    fn store(self) -> Self::Store;
    /// One number in every lane.
    fn splat(token: Self::Token, value: f64) -> Self;
    /// `self·b + c`, fused where the processor can.
    fn fma(self, b: Self, c: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Larger value, lane by lane; where one is NaN, which one is the processor's choice.
    fn max(self, other: Self) -> Self;
    /// Smaller value, lane by lane.
    fn min(self, other: Self) -> Self;
    /// `yes` where `self > 0`, else `no`.
    fn if_positive(self, yes: Self, no: Self) -> Self;
    /// The neighbour's number: even and odd lanes change places.
    fn swap_halves(self) -> Self;
    /// Coefficients of the even polynomial `cos x = 1 + x²·p(x²)` and the odd `sin x = x + x³·p(x²)`, highest first.
    fn cos_sin_coefficients() -> (&'static [f64], &'static [f64]);
}

/// Several numbers in memory.
pub trait Store: Copy + Clone + Debug + PartialEq + Send + Sync + 'static {
    /// Number of lanes.
    const WIDTH: usize;
    /// One number in every lane.
    fn splat(value: f64) -> Self;
    /// Lane `lane`.
    fn get(&self, lane: usize) -> f64;
    /// Writes lane `lane`.
    fn set(&mut self, lane: usize, value: f64);

    /// Lane by lane.
    fn from_fn(mut lane: impl FnMut(usize) -> f64) -> Self {
        let mut all = Self::splat(0.0);
        for index in 0..Self::WIDTH {
            all.set(index, lane(index));
        }
        all
    }
}

/// A width and a precision.
pub trait Kind: Copy + Debug + Send + Sync + 'static {
    /// In memory.
    type Store: Store;
    /// In registers of a processor with the instructions `S`.
    type Lanes<S: Simd>: Lanes<Token = S, Store = Self::Store>;
    /// Bodies side by side.
    const BODIES: usize = Self::Store::WIDTH / 2;
}

macro_rules! kind {
    ($(#[$doc:meta])* $kind:ident, $row:ident: $element:ty, $width:literal, $align:literal,
        $lanes:ident, $slide:ident, $cos:ident, $sin:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $kind;

        impl Kind for $kind {
            type Store = $row;
            type Lanes<S: Simd> = $lanes<S>;
        }

        /// Numbers in memory, aligned as the register wants them and no more: with gaps between them, what a step hands from
        /// pass to pass would not fit into the first cache.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[repr(C, align($align))]
        pub struct $row([$element; $width]);

        impl Store for $row {
            const WIDTH: usize = $width;

            #[inline(always)]
            fn splat(value: f64) -> Self {
                Self([value as $element; $width])
            }

            #[inline(always)]
            fn get(&self, lane: usize) -> f64 {
                f64::from(self.0[lane])
            }

            #[inline(always)]
            fn set(&mut self, lane: usize, value: f64) {
                self.0[lane] = value as $element;
            }
        }

        impl<S: Simd> Lanes for $lanes<S> {
            type Token = S;
            type Store = $row;

            #[inline(always)]
            fn load(token: S, store: &Self::Store) -> Self {
                Self::simd_from(token, store.0)
            }

            #[inline(always)]
            fn store(self) -> Self::Store {
                $row(self.into())
            }

            #[inline(always)]
            fn splat(token: S, value: f64) -> Self {
                Self::simd_from(token, value as $element)
            }

            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                SimdFloat::mul_add(self, b, c)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                SimdFloat::sqrt(self)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                SimdBase::max(self, other)
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                SimdBase::min(self, other)
            }

            #[inline(always)]
            fn if_positive(self, yes: Self, no: Self) -> Self {
                self.simd_gt(Self::simd_from(self.simd, 0.0 as $element)).select(yes, no)
            }

            #[inline(always)]
            fn swap_halves(self) -> Self {
                kind!(@swap $slide, self)
            }

            #[inline(always)]
            fn cos_sin_coefficients() -> (&'static [f64], &'static [f64]) {
                (&$cos, &$sin)
            }
        }
    };
    (@swap pairs, $v:expr) => {{
        let v = $v;
        v.slide_within_blocks::<1>(v)
    }};
    (@swap quads, $v:expr) => {{
        let v = $v;
        let (even, odd) = v.deinterleave(v);
        let (low, _) = odd.interleave(even);
        low
    }};
}

kind!(
    /// One body in double precision.
    OneDouble, OneDoubleRow: f64, 2, 16, f64x2, pairs, COS_DOUBLE, SIN_DOUBLE
);
kind!(
    /// Two bodies in double precision.
    TwoDouble, TwoDoubleRow: f64, 4, 32, f64x4, pairs, COS_DOUBLE, SIN_DOUBLE
);
kind!(
    /// Four bodies in single precision.
    FourSingle, FourSingleRow: f32, 8, 32, f32x8, quads, COS_SINGLE, SIN_SINGLE
);

kind!(
    /// Four bodies in double precision.
    FourDouble, FourDoubleRow: f64, 8, 64, f64x8, pairs, COS_DOUBLE, SIN_DOUBLE
);
kind!(
    /// Eight bodies in single precision.
    EightSingle, EightSingleRow: f32, 16, 64, f32x16, quads, COS_SINGLE, SIN_SINGLE
);

/// Taylor's series to x¹² and x¹³: an error of 1e-15 at 30°, where hardly a hinge comes; 2e-11 at 60°.
const COS_DOUBLE: [f64; 6] = [1.0 / 479_001_600.0, -1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5];
const SIN_DOUBLE: [f64; 6] =
    [1.0 / 6_227_020_800.0, -1.0 / 39_916_800.0, 1.0 / 362_880.0, -1.0 / 5_040.0, 1.0 / 120.0, -1.0 / 6.0];
/// To x⁸ and x⁹: 4e-10 at 30°, 4e-7 at 60°.
const COS_SINGLE: [f64; 4] = [1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5];
const SIN_SINGLE: [f64; 4] = [1.0 / 362_880.0, -1.0 / 5_040.0, 1.0 / 120.0, -1.0 / 6.0];

/// Cosine and sine of a hinge's angle, rad.
#[inline(always)]
pub fn cos_sin<L: Lanes>(token: L::Token, x: L) -> (L, L) {
    let (cos, sin) = L::cos_sin_coefficients();
    let square = x * x;
    let one = L::splat(token, 1.0);
    (square.fma(horner(token, cos, square), one), (square * x).fma(horner(token, sin, square), x))
}

#[inline(always)]
fn horner<L: Lanes>(token: L::Token, coefficients: &[f64], x: L) -> L {
    let mut sum = L::splat(token, coefficients[0]);
    for coefficient in &coefficients[1..] {
        sum = sum.fma(x, L::splat(token, *coefficient));
    }
    sum
}
