//! How long a second of the paper's axis takes in steps of a millisecond, by the functions of FMI 3.0, and beside it a
//! ball by the loop that the Reference FMUs have: one Euler step a millisecond, with bounces seen at its end alone.
//!
//! `cargo run --release --package taut-fmu --example steps`

use std::ffi::CString;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use taut::case::Case;
use taut::export::fmu::Model;
use taut_fmu::fmi3;

const RUNS: u32 = 200;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let case = Case::read_with(root.join("stages/sollmann-jouaneh/table4.toml"), &[]).expect("a bundled case");
    let model = Model::new(&case, false).expect("a machine");
    let folder = std::env::temp_dir().join(format!("taut-speed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("room for a folder");
    std::fs::write(folder.join("machine.toml"), &model.resource).expect("room for a file");
    let path = CString::new(folder.to_string_lossy().as_bytes()).expect("a path");
    let token = CString::new(model.token.as_str()).expect("a token");
    let named = |name: &str| model.variables.iter().find(|v| v.name == name).map_or(0, |v| v.reference);
    let (command, cart) = (named("command"), named("cart_position"));

    let (mut best, mut x) = (f64::INFINITY, 0.0);
    for _ in 0..RUNS {
        let (length, end) = pulse(&token, &path, command, cart);
        (best, x) = (best.min(length), end);
    }
    println!("axis, 1000 steps of 1 ms with its input set and its position read: {:.0} us, x = {x} m", 1e6 * best);
    let (mut ball, mut h) = (f64::INFINITY, 0.0);
    for _ in 0..RUNS {
        let begin = Instant::now();
        h = bounce();
        ball = ball.min(begin.elapsed().as_secs_f64());
    }
    println!("ball, 1000 Euler steps of 1 ms: {:.1} us, h = {h} m", 1e6 * ball);
    let _ = std::fs::remove_dir_all(folder);
}

/// A second of the pulse of 10 V without the making of the instance: how long it takes, s, and where the cart is.
fn pulse(token: &CString, path: &CString, command: u32, cart: u32) -> (f64, f64) {
    let (mut flags, mut last, mut x) = ([0u8; 3], 0.0, 0.0);
    let [event, terminate, early] = &mut flags;
    unsafe {
        let one = fmi3::fmi3InstantiateCoSimulation(
            c"one".as_ptr(),
            token.as_ptr(),
            path.as_ptr(),
            0,
            0,
            0,
            0,
            std::ptr::null(),
            0,
            std::ptr::null_mut(),
            None,
            None,
        );
        fmi3::fmi3EnterInitializationMode(one, 0, 0.0, 0.0, 0, 0.0);
        fmi3::fmi3ExitInitializationMode(one);
        let begin = Instant::now();
        for k in 0..1000 {
            let volts = if k < 250 { 10.0 } else { 0.0 };
            fmi3::fmi3SetFloat64(one, &command, 1, &volts, 1);
            fmi3::fmi3DoStep(one, f64::from(k) * 1e-3, 1e-3, 1, event, terminate, early, &mut last);
            fmi3::fmi3GetFloat64(one, &cart, 1, &mut x, 1);
        }
        let length = begin.elapsed().as_secs_f64();
        fmi3::fmi3FreeInstance(one);
        (length, x)
    }
}

/// ḣ = v, v̇ = −g, and v := −e v where h has fallen through the floor by the end of a step.
#[inline(never)]
fn bounce() -> f64 {
    let (mut h, mut v): (f64, f64) = (1.0, 0.0);
    for _ in 0..1000 {
        h += 1e-3 * black_box(v);
        v -= 1e-3 * 9.81;
        if h <= 0.0 && v < 0.0 {
            (h, v) = (f64::MIN_POSITIVE, -0.7 * v);
        }
    }
    black_box(h)
}
