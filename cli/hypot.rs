//! √(x² + y²) in the place of the C library's: glibc has a new version of it since 2.35, and for it alone what is linked
//! here would run on no older one. A part of the program, of the Python package and of the shared object for FMUs;
//! `cli/wrap.rs` has the linker take it.
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
