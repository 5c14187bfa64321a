//! Vectors of `f32` and the choice of instruction set at run time.
//!
//! Every kernel of the feature stage is written once, generic over [`Lanes`], and compiled for each instruction set.
//! Only addition, subtraction, multiplication, minimum, maximum and comparison are used, one rounding each, never a
//! fused multiply-add; every lane is independent. So the results are the same bits on every instruction set.
//!
//! # Safety
//! This is the only module of the feature stage with `unsafe` code. It rests on two invariants: a value of
//! [`InstructionSet`] other than the portable one exists only after the processor was asked for its features, and
//! the vector types are private to this module, so they are only reached through [`InstructionSet::run`].
#![allow(unsafe_code, reason = "vector instructions need it; each block states why it is sound")]

use std::ops::{Add, Mul, Sub};

/// The instruction set the kernels run on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct InstructionSet(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl InstructionSet {
    /// The fastest this processor has.
    pub(super) fn detect() -> Self {
        Self::available().last().copied().unwrap_or(Self(Kind::Portable))
    }

    /// All this processor has, slowest first; the first is the portable one.
    pub(super) fn available() -> Vec<Self> {
        #[allow(unused_mut)]
        let mut found = vec![Self(Kind::Portable)];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                found.push(Self(Kind::Avx2));
            }
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx2") {
                found.push(Self(Kind::Avx512));
            }
        }
        found
    }

    /// Runs a kernel compiled for this instruction set.
    #[inline]
    pub(super) fn run<K: VectorKernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Kind::Portable => kernel.run::<Portable>(),
            // SAFETY: this value exists only if `available` found AVX2.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { x86::run_avx2(kernel) },
            // SAFETY: this value exists only if `available` found AVX-512F.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { x86::run_avx512(kernel) },
        }
    }
}

/// A piece of work written once for all vector widths.
///
/// `run` and everything it calls must be `#[inline(always)]`, so that it is compiled with the caller's instructions.
pub(super) trait VectorKernel {
    /// What the work returns.
    type Output;
    /// Does the work with vectors of type `L`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// A vector of [`Lanes::COUNT`] numbers.
pub(super) trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Numbers in a vector; divides [`MAX_LANES`].
    const COUNT: usize;
    /// All lanes `value`.
    fn splat(value: f32) -> Self;
    /// The numbers from `source[at]` on. Panics if there are not enough.
    fn load(source: &[f32], at: usize) -> Self;
    /// Writes the numbers from `target[at]` on. Panics if there is not enough room.
    fn store(self, target: &mut [f32], at: usize);
    /// Lane by lane `self > other ? self : other`; `other` where one is not a number.
    fn max(self, other: Self) -> Self;
    /// Lane by lane `self < other ? self : other`; `other` where one is not a number.
    fn min(self, other: Self) -> Self;
    /// Bit k is set where lane k of `self` is at least lane k of `other`; clear where one is not a number.
    fn at_least(self, other: Self) -> u32;
}

/// The widest vector's lanes; rows are padded to multiples of it.
pub(super) const MAX_LANES: usize = 16;

/// Vectors that every processor has, left to the compiler.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; 8]);

macro_rules! portable_operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|lane| self.0[lane] $operator other.0[lane]))
            }
        }
    };
}
portable_operator!(Add, add, +);
portable_operator!(Sub, sub, -);
portable_operator!(Mul, mul, *);

impl Lanes for Portable {
    const COUNT: usize = 8;
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; 8])
    }
    #[inline(always)]
    fn load(source: &[f32], at: usize) -> Self {
        let source = &source[at..at + Self::COUNT];
        Self(std::array::from_fn(|lane| source[lane]))
    }
    #[inline(always)]
    fn store(self, target: &mut [f32], at: usize) {
        target[at..at + Self::COUNT].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| if self.0[lane] > other.0[lane] { self.0[lane] } else { other.0[lane] }))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| if self.0[lane] < other.0[lane] { self.0[lane] } else { other.0[lane] }))
    }
    #[inline(always)]
    fn at_least(self, other: Self) -> u32 {
        (0..Self::COUNT).fold(0, |mask, lane| mask | (u32::from(self.0[lane] >= other.0[lane]) << lane))
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m256, __m512, _CMP_GE_OQ, _mm256_add_ps, _mm256_cmp_ps, _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps,
        _mm256_movemask_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_storeu_ps, _mm256_sub_ps, _mm512_add_ps,
        _mm512_cmp_ps_mask, _mm512_loadu_ps, _mm512_max_ps, _mm512_min_ps, _mm512_mul_ps, _mm512_set1_ps,
        _mm512_storeu_ps, _mm512_sub_ps,
    };
    use std::ops::{Add, Mul, Sub};

    use super::{Lanes, VectorKernel};

    /// Compiles the kernel with AVX2.
    #[target_feature(enable = "avx2")]
    pub(super) fn run_avx2<K: VectorKernel>(kernel: K) -> K::Output {
        kernel.run::<Eight>()
    }

    /// Compiles the kernel with AVX-512F.
    #[target_feature(enable = "avx512f,avx2")]
    pub(super) fn run_avx512<K: VectorKernel>(kernel: K) -> K::Output {
        kernel.run::<Sixteen>()
    }

    /// An AVX vector.
    #[derive(Clone, Copy)]
    pub(super) struct Eight(__m256);

    /// An AVX-512 vector.
    #[derive(Clone, Copy)]
    pub(super) struct Sixteen(__m512);

    macro_rules! vector {
        ($name:ident, $count:literal, $add:ident, $sub:ident, $mul:ident, $min:ident, $max:ident, $splat:ident,
         $load:ident, $store:ident, |$a:ident, $b:ident| $at_least:expr) => {
            impl Add for $name {
                type Output = Self;
                #[inline(always)]
                fn add(self, other: Self) -> Self {
                    // SAFETY: reached only through `run_avx2` or `run_avx512`, whose callers checked the processor.
                    Self(unsafe { $add(self.0, other.0) })
                }
            }
            impl Sub for $name {
                type Output = Self;
                #[inline(always)]
                fn sub(self, other: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $sub(self.0, other.0) })
                }
            }
            impl Mul for $name {
                type Output = Self;
                #[inline(always)]
                fn mul(self, other: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $mul(self.0, other.0) })
                }
            }
            impl Lanes for $name {
                const COUNT: usize = $count;
                #[inline(always)]
                fn splat(value: f32) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $splat(value) })
                }
                #[inline(always)]
                fn load(source: &[f32], at: usize) -> Self {
                    let source = &source[at..at + $count];
                    // SAFETY: as above, and the slice holds a whole vector; the load needs no alignment.
                    Self(unsafe { $load(source.as_ptr()) })
                }
                #[inline(always)]
                fn store(self, target: &mut [f32], at: usize) {
                    let target = &mut target[at..at + $count];
                    // SAFETY: as above, and the slice has room for a whole vector; the store needs no alignment.
                    unsafe { $store(target.as_mut_ptr(), self.0) }
                }
                #[inline(always)]
                fn max(self, other: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $max(self.0, other.0) })
                }
                #[inline(always)]
                fn min(self, other: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $min(self.0, other.0) })
                }
                #[inline(always)]
                fn at_least(self, other: Self) -> u32 {
                    let ($a, $b) = (self.0, other.0);
                    // SAFETY: as above.
                    unsafe { $at_least }
                }
            }
        };
    }

    vector!(
        Eight,
        8,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_mul_ps,
        _mm256_min_ps,
        _mm256_max_ps,
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        |a, b| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(a, b)).cast_unsigned()
    );
    vector!(
        Sixteen,
        16,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_mul_ps,
        _mm512_min_ps,
        _mm512_max_ps,
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        |a, b| u32::from(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(a, b))
    );
}
