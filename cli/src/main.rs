//! The program `taut`.

mod paper;

fn main() {
    paper::scratch().unwrap();
}
