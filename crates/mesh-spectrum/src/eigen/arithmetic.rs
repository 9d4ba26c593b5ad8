//! Eight numbers at a time: how each kind of processor holds, multiplies and adds them.
//!
//! Products are written once, for any [`Arithmetic`]. Lanes are the registers themselves, because how often a number is
//! read decides how fast a product is, and from loops over arrays the compiler reads it again for every use.

use crate::eigen::block::{Row, WIDTH};

/// How a product and a sum are rounded, once unless it is said otherwise, and the registers that hold a row.
pub(crate) trait Arithmetic {
    /// Eight numbers.
    type Lanes: Copy;
    /// a·b + c.
    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
    /// The same in single precision.
    #[inline(always)]
    fn fma_single(a: f32, b: f32, c: f32) -> f32 {
        a.mul_add(b, c)
    }
    fn load(row: &Row) -> Self::Lanes;
    fn store(lanes: Self::Lanes, row: &mut Row);
    /// One number eight times.
    fn splat(x: f64) -> Self::Lanes;
    /// a·b + c of eight numbers.
    fn multiply_add(a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
}

/// Lanes that are arrays, which the compiler puts into whatever registers there are.
macro_rules! on_arrays {
    ($name:ident { $($fma:item)* }) => {
        impl Arithmetic for $name {
            type Lanes = Row;
            $($fma)*
            #[inline(always)]
            fn load(row: &Row) -> Row {
                *row
            }
            #[inline(always)]
            fn store(lanes: Row, row: &mut Row) {
                *row = lanes;
            }
            #[inline(always)]
            fn splat(x: f64) -> Row {
                [x; WIDTH]
            }
            #[inline(always)]
            fn multiply_add(a: Row, b: Row, c: Row) -> Row {
                std::array::from_fn(|k| Self::fma(a[k], b[k], c[k]))
            }
        }
    };
}

/// Two roundings: any processor.
pub(crate) struct Plain;

on_arrays!(Plain {
    #[inline(always)]
    fn fma(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
    #[inline(always)]
    fn fma_single(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }
});

/// Processors with a fused instruction that every program may use.
#[cfg(target_arch = "aarch64")]
pub(crate) struct Fused;

#[cfg(target_arch = "aarch64")]
on_arrays!(Fused {});

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512};

/// AVX2 and AVX-512. What is here may only be called from functions that are compiled for these, and that are
/// called where the processor has them.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m256d, __m512d, _mm256_fmadd_pd, _mm256_loadu_pd, _mm256_set1_pd, _mm256_storeu_pd, _mm512_fmadd_pd,
        _mm512_loadu_pd, _mm512_set1_pd, _mm512_storeu_pd,
    };

    use super::Arithmetic;
    use crate::eigen::block::{Row, WIDTH};

    /// Two registers of four numbers.
    pub(crate) struct Avx2;

    impl Arithmetic for Avx2 {
        type Lanes = [__m256d; 2];
        #[inline(always)]
        fn load(row: &Row) -> [__m256d; 2] {
            let (halves, _) = row.as_chunks::<{ WIDTH / 2 }>();
            // SAFETY: four numbers each; and see the module.
            unsafe { [_mm256_loadu_pd(halves[0].as_ptr()), _mm256_loadu_pd(halves[1].as_ptr())] }
        }
        #[inline(always)]
        fn store(lanes: [__m256d; 2], row: &mut Row) {
            let (halves, _) = row.as_chunks_mut::<{ WIDTH / 2 }>();
            for (half, lanes) in halves.iter_mut().zip(lanes) {
                // SAFETY: four numbers; and see the module.
                unsafe { _mm256_storeu_pd(half.as_mut_ptr(), lanes) };
            }
        }
        #[inline(always)]
        fn splat(x: f64) -> [__m256d; 2] {
            // SAFETY: see the module.
            [unsafe { _mm256_set1_pd(x) }; 2]
        }
        #[inline(always)]
        fn multiply_add(a: [__m256d; 2], b: [__m256d; 2], c: [__m256d; 2]) -> [__m256d; 2] {
            // SAFETY: see the module.
            unsafe { [_mm256_fmadd_pd(a[0], b[0], c[0]), _mm256_fmadd_pd(a[1], b[1], c[1])] }
        }
    }

    /// A register of eight numbers.
    pub(crate) struct Avx512;

    impl Arithmetic for Avx512 {
        type Lanes = __m512d;
        #[inline(always)]
        fn load(row: &Row) -> __m512d {
            // SAFETY: eight numbers; and see the module.
            unsafe { _mm512_loadu_pd(row.as_ptr()) }
        }
        #[inline(always)]
        fn store(lanes: __m512d, row: &mut Row) {
            // SAFETY: eight numbers; and see the module.
            unsafe { _mm512_storeu_pd(row.as_mut_ptr(), lanes) };
        }
        #[inline(always)]
        fn splat(x: f64) -> __m512d {
            // SAFETY: see the module.
            unsafe { _mm512_set1_pd(x) }
        }
        #[inline(always)]
        fn multiply_add(a: __m512d, b: __m512d, c: __m512d) -> __m512d {
            // SAFETY: see the module.
            unsafe { _mm512_fmadd_pd(a, b, c) }
        }
    }
}
