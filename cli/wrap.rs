//! Has the linker take the functions of `cli/hypot.rs` for those of the C library. A part of build scripts.

use std::env;

/// In targets of this `kind`, as cargo names it: `bins`, or `cdylib`.
pub fn wrap_hypot(kind: &str) {
    let is = |name: &str, wanted: &str| env::var(name).is_ok_and(|value| value == wanted);
    if is("CARGO_CFG_TARGET_OS", "linux") && is("CARGO_CFG_TARGET_ENV", "gnu") {
        for name in ["hypot", "hypotf"] {
            println!("cargo::rustc-link-arg-{kind}=-Wl,--wrap={name}");
        }
    }
}
