//! Directional derivatives against the equations of the paper.

use crate::unit::{OK, Unit};
use taut_fmu::fmi3;

fn derivative(unit: &Unit, pointer: *mut std::ffi::c_void, unknown: &str, known: &str) -> f64 {
    let (unknown, known, seed, mut into) = (unit.reference(unknown), unit.reference(known), 2.0, f64::NAN);
    let status = unsafe { fmi3::fmi3GetDirectionalDerivative(pointer, &unknown, 1, &known, 1, &seed, 1, &mut into, 1) };
    assert_eq!(status, OK);
    into / seed
}

#[test]
fn rates_and_forces_change_as_the_paper_says() {
    let unit = Unit::of("sollmann-jouaneh/table4.toml", false);
    let one = unit.exchange();
    one.start();
    let (mut flags, mut next) = ([0u8; 5], 0.0);
    let [a, b, c, d, e] = &mut flags;
    assert_eq!(one.set("command", 5.0), OK);
    unsafe {
        assert_eq!(fmi3::fmi3UpdateDiscreteStates(one.pointer, a, b, c, d, e, &mut next), OK);
        assert_eq!(fmi3::fmi3EnterContinuousTimeMode(one.pointer), OK);
    }
    let (k, r, inertia, torque, resistance) = ([1.3276e5, 1.3276e5, 5.8885e4], 0.0194, 6.3e-5, 23e-3, 0.71);
    for (unknown, known, wanted) in [
        // (4) and (16): J φ̈₁ = K_t (u − K_e φ̇₁)/R − …
        ("der(drive_speed)", "command", torque / resistance / inertia),
        ("motor_current", "drive_speed", -23e-3 / resistance),
        ("span1_force", "drive_angle", k[0] * r),
        ("der(drive_speed)", "drive_angle", -(k[0] + k[2]) * r * r / inertia),
        ("der(drive_angle)", "drive_speed", 1.0),
        ("voltage", "command", 1.0),
    ] {
        let is = derivative(&unit, one.pointer, unknown, known);
        assert!((is - wanted).abs() < 1e-7 * wanted.abs(), "d {unknown}/d {known}: {is} instead of {wanted}");
    }
    // The force on a cart that is about to slide, and that of its belt.
    let is = derivative(&unit, one.pointer, "cart_friction", "cart_force");
    assert!((is + 1.0).abs() < 1e-6 || is.abs() < 1e-6 || (is - 1.0).abs() < 1e-6, "{is}");
    let co = unit.three(false, false);
    co.start();
    assert_eq!(co.set("command", 5.0), OK);
    let is = derivative(&unit, co.pointer, "motor_current", "command");
    assert!((is - 1.0 / resistance).abs() < 1e-7, "{is}");
}
