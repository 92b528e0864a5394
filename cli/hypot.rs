//! √(x² + y²) in place of the C library's: glibc has a new version of it since 2.35, which alone would keep programs
//! linked here from running with an older glibc. Part of the program, the Python package and the shared object for
//! FMUs; `cli/wrap.rs` makes the linker use it.
//!
//! Only the linker calls these two.

#[unsafe(no_mangle)]
extern "C" fn __wrap_hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

#[unsafe(no_mangle)]
extern "C" fn __wrap_hypotf(x: f32, y: f32) -> f32 {
    libm::hypotf(x, y)
}
