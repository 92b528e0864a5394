//! Source of the build: what the shared object is linked with.

mod wrap;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=wrap.rs");
    // Whoever carries the object builds it from here.
    let folder = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    println!("cargo::metadata=folder={folder}");
    wrap::wrap_hypot("cdylib");
}
