//! Source of the build: what the shared object is linked with.

#[path = "../cli/wrap.rs"]
mod wrap;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../cli/wrap.rs");
    wrap::wrap_hypot("cdylib");
}
