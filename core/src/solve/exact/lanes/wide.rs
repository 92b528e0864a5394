//! Numbers side by side, one for each machine, and arithmetic on them in the widest vectors of the processor.
//!
//! Vector instructions are named, not left to the compiler: it gives up on long chains of operations, and then code for
//! vectors is slower than code for single numbers; and what is computed in closures, those of `array::from_fn` too, is
//! not compiled for the vectors of the function around them. Every implementation does the same operations in the same
//! order, products and sums are rounded separately (no FMA), and no operation mixes lanes, so that a machine's bits
//! depend neither on the processor nor on its neighbours.

/// Machines side by side: as many 64-bit numbers as the widest vectors hold.
pub(super) const LANES: usize = 8;

/// A number of each machine.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lanes(pub [f64; LANES]);

impl Lanes {
    pub(super) const ZERO: Self = Self([0.0; LANES]);

    pub(super) const fn all(value: f64) -> Self {
        Self([value; LANES])
    }
}

/// Arithmetic on numbers side by side. An implementation with vector instructions is used only within functions that
/// are compiled for them and called on processors that have them.
pub(super) trait Wide: Copy {
    /// Its form in memory.
    type Kept: Copy;
    /// The result of a comparison.
    type Mask: Copy;
    fn load(kept: &Self::Kept) -> Self;
    fn keep(self, kept: &mut Self::Kept);
    fn all(value: f64) -> Self;
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;
    /// The smaller one; the other one if either is no number.
    fn smaller(self, other: Self) -> Self;
    fn larger(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn root(self) -> Self;
    /// True where it is less than the other one.
    fn below(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, `no` elsewhere.
    fn pick(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// One bit for each lane.
    fn bits(mask: Self::Mask) -> u32;
}

impl Wide for f64 {
    type Kept = f64;
    type Mask = bool;
    #[inline(always)]
    fn load(kept: &f64) -> Self {
        *kept
    }
    #[inline(always)]
    fn keep(self, kept: &mut f64) {
        *kept = self;
    }
    #[inline(always)]
    fn all(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self * other
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn below(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn pick(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn bits(mask: bool) -> u32 {
        u32::from(mask)
    }
}

/// For any processor.
#[derive(Clone, Copy)]
pub(super) struct Plain([f64; LANES]);

/// A loop over lanes, not a closure: closures are not compiled for the vectors of the function that they are in.
macro_rules! each {
    ($lane:ident: $value:expr) => {{
        let mut all = [Default::default(); LANES];
        for $lane in 0..LANES {
            all[$lane] = $value;
        }
        all
    }};
}

impl Wide for Plain {
    type Kept = Lanes;
    type Mask = [bool; LANES];
    #[inline(always)]
    fn load(kept: &Lanes) -> Self {
        Self(kept.0)
    }
    #[inline(always)]
    fn keep(self, kept: &mut Lanes) {
        kept.0 = self.0;
    }
    #[inline(always)]
    fn all(value: f64) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(each!(l: self.0[l] + other.0[l]))
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self(each!(l: self.0[l] - other.0[l]))
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self(each!(l: self.0[l] * other.0[l]))
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self(each!(l: self.0[l].smaller(other.0[l])))
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(each!(l: self.0[l].larger(other.0[l])))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(each!(l: f64::abs(self.0[l])))
    }
    #[inline(always)]
    fn root(self) -> Self {
        Self(each!(l: self.0[l].sqrt()))
    }
    #[inline(always)]
    fn below(self, other: Self) -> [bool; LANES] {
        each!(l: self.0[l] < other.0[l])
    }
    #[inline(always)]
    fn pick(mask: [bool; LANES], yes: Self, no: Self) -> Self {
        Self(each!(l: if mask[l] { yes.0[l] } else { no.0[l] }))
    }
    #[inline(always)]
    fn bits(mask: [bool; LANES]) -> u32 {
        let mut bits = 0;
        for (lane, is) in mask.iter().enumerate() {
            bits |= u32::from(*is) << lane;
        }
        bits
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Lanes, Wide};
    use std::arch::x86_64::*;

    /// For processors with AVX-512.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx512(__m512d);

    // SAFETY of all that follows: see [`Wide`]; `Lanes` are aligned to 64 bytes.
    impl Wide for Avx512 {
        type Kept = Lanes;
        type Mask = __mmask8;
        #[inline(always)]
        fn load(kept: &Lanes) -> Self {
            Self(unsafe { _mm512_load_pd(kept.0.as_ptr()) })
        }
        #[inline(always)]
        fn keep(self, kept: &mut Lanes) {
            unsafe { _mm512_store_pd(kept.0.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn all(value: f64) -> Self {
            Self(unsafe { _mm512_set1_pd(value) })
        }
        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            Self(unsafe { _mm512_add_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            Self(unsafe { _mm512_sub_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            Self(unsafe { _mm512_mul_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn smaller(self, other: Self) -> Self {
            Self(unsafe { _mm512_min_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            Self(unsafe { _mm512_max_pd(self.0, other.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { _mm512_abs_pd(self.0) })
        }
        #[inline(always)]
        fn root(self) -> Self {
            Self(unsafe { _mm512_sqrt_pd(self.0) })
        }
        #[inline(always)]
        fn below(self, other: Self) -> __mmask8 {
            unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn pick(mask: __mmask8, yes: Self, no: Self) -> Self {
            Self(unsafe { _mm512_mask_blend_pd(mask, no.0, yes.0) })
        }
        #[inline(always)]
        fn bits(mask: __mmask8) -> u32 {
            u32::from(mask)
        }
    }

    /// For processors with AVX2.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2(__m256d, __m256d);

    impl Wide for Avx2 {
        type Kept = Lanes;
        type Mask = (__m256d, __m256d);
        #[inline(always)]
        fn load(kept: &Lanes) -> Self {
            unsafe { Self(_mm256_load_pd(kept.0.as_ptr()), _mm256_load_pd(kept.0[4..].as_ptr())) }
        }
        #[inline(always)]
        fn keep(self, kept: &mut Lanes) {
            unsafe {
                _mm256_store_pd(kept.0.as_mut_ptr(), self.0);
                _mm256_store_pd(kept.0[4..].as_mut_ptr(), self.1);
            }
        }
        #[inline(always)]
        fn all(value: f64) -> Self {
            unsafe { Self(_mm256_set1_pd(value), _mm256_set1_pd(value)) }
        }
        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            unsafe { Self(_mm256_add_pd(self.0, other.0), _mm256_add_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            unsafe { Self(_mm256_sub_pd(self.0, other.0), _mm256_sub_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            unsafe { Self(_mm256_mul_pd(self.0, other.0), _mm256_mul_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn smaller(self, other: Self) -> Self {
            unsafe { Self(_mm256_min_pd(self.0, other.0), _mm256_min_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            unsafe { Self(_mm256_max_pd(self.0, other.0), _mm256_max_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe {
                let sign = _mm256_set1_pd(-0.0);
                Self(_mm256_andnot_pd(sign, self.0), _mm256_andnot_pd(sign, self.1))
            }
        }
        #[inline(always)]
        fn root(self) -> Self {
            unsafe { Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
        }
        #[inline(always)]
        fn below(self, other: Self) -> Self::Mask {
            unsafe { (_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0), _mm256_cmp_pd::<_CMP_LT_OQ>(self.1, other.1)) }
        }
        #[inline(always)]
        fn pick(mask: Self::Mask, yes: Self, no: Self) -> Self {
            unsafe { Self(_mm256_blendv_pd(no.0, yes.0, mask.0), _mm256_blendv_pd(no.1, yes.1, mask.1)) }
        }
        #[inline(always)]
        fn bits(mask: Self::Mask) -> u32 {
            unsafe { _mm256_movemask_pd(mask.0) as u32 | (_mm256_movemask_pd(mask.1) as u32) << 4 }
        }
    }
}
