//! Functions in two versions, for any processor and for one with AVX2: the same source, compiled twice.

/// Defines a function that calls the second one named, or, if the processor has AVX2, the third, which is the second
/// compiled for AVX2. The second has to be `#[inline(always)]`. Both versions compute the same bits, since wider
/// vectors do not change the order of any sum.
///
/// ```text
/// widest! { fn sum(values: &[f64]) -> f64 = sum_by_any, sum_by_avx2; }
/// #[inline(always)]
/// fn sum_by_any(values: &[f64]) -> f64 { … }
/// ```
#[doc(hidden)]
#[macro_export]
macro_rules! widest {
    // A method that reads.
    ($(#[$meta:meta])* $vis:vis fn $name:ident(&self $(, $arg:ident: $type:ty)*) $(-> $out:ty)?
        = $any:ident, $wide:ident;) => {
        widest!(@both [$(#[$meta])* $vis fn $name] [fn $wide] [&self $(, $arg: $type)*] [$(-> $out)?]
            [self.$any($($arg),*)] [self.$wide($($arg),*)]);
    };
    // One that writes.
    ($(#[$meta:meta])* $vis:vis fn $name:ident(&mut self $(, $arg:ident: $type:ty)*) $(-> $out:ty)?
        = $any:ident, $wide:ident;) => {
        widest!(@both [$(#[$meta])* $vis fn $name] [fn $wide] [&mut self $(, $arg: $type)*] [$(-> $out)?]
            [self.$any($($arg),*)] [self.$wide($($arg),*)]);
    };
    // A function of a type.
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),*) $(-> $out:ty)?
        = Self::$any:ident, $wide:ident;) => {
        widest!(@both [$(#[$meta])* $vis fn $name] [fn $wide] [$($arg: $type),*] [$(-> $out)?]
            [Self::$any($($arg),*)] [Self::$wide($($arg),*)]);
    };
    // One by itself.
    ($(#[$meta:meta])* $vis:vis fn $name:ident $([$($generic:tt)*])? ($($arg:ident: $type:ty),*) $(-> $out:ty)?
        = $any:ident, $wide:ident;) => {
        widest!(@both [$(#[$meta])* $vis fn $name $(<$($generic)*>)?] [fn $wide $(<$($generic)*>)?]
            [$($arg: $type),*] [$(-> $out)?] [$any($($arg),*)] [$wide($($arg),*)]);
    };
    (@both [$($head:tt)*] [$($twin:tt)*] [$($args:tt)*] [$($out:tt)*] [$($any:tt)*] [$($wide:tt)*]) => {
        $($head)*($($args)*) $($out)* {
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has AVX2.
                return unsafe { $($wide)* };
            }
            $($any)*
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        $($twin)*($($args)*) $($out)* {
            $($any)*
        }
    };
}

pub(in crate::solve) use widest;
