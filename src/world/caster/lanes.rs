//! Single-precision numbers in SIMD registers.
//!
//! The operations are those of scalar numbers, without fused multiplication and addition, so that the results have the
//! same bits for any width of the registers.

use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// The numbers of one register.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    value: S::f32s,
}

/// A truth value for each number of a register.
#[derive(Clone, Copy)]
pub(super) struct Mask<S: Simd> {
    simd: S,
    value: S::m32s,
}

impl<S: Simd> Lanes<S> {
    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(simd: S, number: f32) -> Self {
        Self { simd, value: simd.splat_f32s(number) }
    }

    /// The numbers of an array that fill register number `register`.
    #[inline(always)]
    pub fn load(simd: S, numbers: &[f32], register: usize) -> Self {
        Self { simd, value: S::as_simd_f32s(numbers).0[register] }
    }

    /// Writes the numbers to the place in an array from which [`Self::load`] reads them.
    #[inline(always)]
    pub fn store(self, numbers: &mut [f32], register: usize) {
        S::as_mut_simd_f32s(numbers).0[register] = self.value;
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self { value: self.simd.max_f32s(self.value, other.value), ..self }
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self { value: self.simd.min_f32s(self.value, other.value), ..self }
    }

    /// One divided by each number.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        Self { value: self.simd.div_f32s(self.simd.splat_f32s(1.0), self.value), ..self }
    }

    /// The largest number.
    #[inline(always)]
    pub fn largest(self) -> f32 {
        self.simd.reduce_max_f32s(self.value)
    }

    /// The smallest number.
    #[inline(always)]
    pub fn smallest(self) -> f32 {
        self.simd.reduce_min_f32s(self.value)
    }

    /// Where a number is at most that of `other`; false for NaN.
    #[inline(always)]
    pub fn at_most(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, value: self.simd.less_than_or_equal_f32s(self.value, other.value) }
    }

    /// Where a number is below that of `other`; false for NaN.
    #[inline(always)]
    pub fn below(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, value: self.simd.less_than_f32s(self.value, other.value) }
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.simd.add_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.simd.sub_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.simd.mul_f32s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Mask<S> {
    #[inline(always)]
    pub fn and(self, other: Self) -> Self {
        Self { value: self.simd.and_m32s(self.value, other.value), ..self }
    }

    /// Whether any lane is true.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.simd.first_true_m32s(self.value) < S::F32_LANES
    }

    /// The number of `yes` where true, else that of `no`.
    #[inline(always)]
    pub fn select(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes { value: self.simd.select_f32s(self.value, yes.value, no.value), ..yes }
    }

    /// Overwrites the integers of a register in an array where true.
    #[inline(always)]
    pub fn write(self, integer: u32, integers: &mut [u32], register: usize) {
        let old = &mut S::as_mut_simd_u32s(integers).0[register];
        *old = self.simd.select_u32s(self.value, self.simd.splat_u32s(integer), *old);
    }
}

/// Three coordinates, each in the lanes of a register.
pub(super) type Lanes3<S> = [Lanes<S>; 3];

/// Register number `register` of three arrays.
#[inline(always)]
pub(super) fn load3<S: Simd, const N: usize>(simd: S, xyz: &[[f32; N]; 3], register: usize) -> Lanes3<S> {
    let [x, y, z] = xyz;
    [Lanes::load(simd, x, register), Lanes::load(simd, y, register), Lanes::load(simd, z, register)]
}

/// The same vector in all lanes.
#[inline(always)]
pub(super) fn splat3<S: Simd>(simd: S, xyz: &[f32; 3]) -> Lanes3<S> {
    let [x, y, z] = *xyz;
    [Lanes::splat(simd, x), Lanes::splat(simd, y), Lanes::splat(simd, z)]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(a: &Lanes3<S>, b: &Lanes3<S>) -> Lanes<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<S: Simd>(a: &Lanes3<S>, b: &Lanes3<S>) -> Lanes3<S> {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// The smallest and the largest number of an array.
#[inline(always)]
pub(super) fn range<S: Simd, const N: usize>(simd: S, numbers: &[f32; N]) -> (f32, f32) {
    let (mut lower, mut upper) = (Lanes::load(simd, numbers, 0), Lanes::load(simd, numbers, 0));
    for register in 1..N / S::F32_LANES {
        let next = Lanes::load(simd, numbers, register);
        (lower, upper) = (lower.min(next), upper.max(next));
    }
    (lower.smallest(), upper.largest())
}
