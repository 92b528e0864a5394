//! The shared object for FMUs, which a wheel of a release build carries as the program does.

#[path = "../cli/carry.rs"]
mod carry;

fn main() {
    carry::carry();
}
