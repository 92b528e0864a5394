//! The shared object for FMUs, which a wheel of a release build carries as the program does.

#[path = "../cli/carry.rs"]
mod carry;
#[path = "../cli/notices.rs"]
mod notices;
#[path = "../cli/wrap.rs"]
mod wrap;

fn main() {
    carry::carry();
    wrap::wrap_hypot("cdylib");
}
