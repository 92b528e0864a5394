//! Directional derivatives against the equations of the paper, derivatives of outputs against where outputs go.

use crate::unit::{ERROR, OK, Three, Unit};
use taut::export::fmu::{Causality, Variability, Variable};
use taut_fmu::fmi3;

fn derivative(unit: &Unit, pointer: *mut std::ffi::c_void, unknown: &str, known: &str) -> f64 {
    let (unknown, known, seed, mut into) = (unit.reference(unknown), unit.reference(known), 2.0, f64::NAN);
    let status = unsafe { fmi3::fmi3GetDirectionalDerivative(pointer, &unknown, 1, &known, 1, &seed, 1, &mut into, 1) };
    assert_eq!(status, OK);
    into / seed
}

#[test]
fn rates_and_forces_change_as_the_paper_says() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
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

/// The derivative of an output with respect to time, or the status that refuses it.
fn of_output(one: &Three, name: &str, order: i32) -> Result<f64, i32> {
    let (reference, mut value) = (one.unit.reference(name), f64::NAN);
    match unsafe { fmi3::fmi3GetOutputDerivatives(one.pointer, &reference, 1, &order, &mut value, 1) } {
        OK => Ok(value),
        status => Err(status),
    }
}

fn is_continuous_output(variable: &&Variable) -> bool {
    variable.causality() == Causality::Output && variable.variability() == Variability::Continuous
}

/// Outputs a moment later are those now and Taylor's series of their derivatives, of all seven orders.
#[test]
fn outputs_go_on_as_their_derivatives_say() {
    // Sliding; a cart that friction holds while its belt pulls; two drives; with the controller inside, between
    // samples.
    for (case, input, value, inside, now) in [
        ("sollmann-jouaneh/table4.toml", "command", 5.0, false, 0.05),
        ("sollmann-jouaneh/table4.toml", "command", 5.0, false, 2e-4),
        ("two-mass/two-mass.toml", "command", 2.0, false, 0.05),
        ("h-frame/h-frame.toml", "left_command", 6.0, false, 0.05),
        ("sollmann-jouaneh/controllers/pid.toml", "reference", 0.01, true, 0.0502),
    ] {
        let unit = Unit::new(case, inside);
        let one = unit.three(false, false);
        one.start();
        assert_eq!(one.set(input, value), OK);
        let later = 2e-5;
        one.step(0.0, now);
        let outputs: Vec<&Variable> = unit.model.variables.iter().filter(is_continuous_output).collect();
        let series: Vec<(f64, f64)> = outputs
            .iter()
            .map(|output| {
                let (mut sum, mut size, mut power) = (one.get(&output.name), 0.0_f64, 1.0);
                for order in 1..=7 {
                    power *= later / f64::from(order);
                    let term = power * of_output(&one, &output.name, order).unwrap();
                    sum += term;
                    size = size.max(term.abs());
                }
                (sum, size)
            })
            .collect();
        one.step(now, later);
        let mut moved = 0;
        for (output, (sum, size)) in outputs.iter().zip(series) {
            let is = one.get(&output.name);
            let scale = is.abs().max(size).max(1e-9);
            assert!((is - sum).abs() <= 1e-10 * scale, "{case}: {} is {is}, the series says {sum}", output.name);
            moved += usize::from(size > 0.0);
        }
        assert!(moved >= 2, "{case}: only {moved} outputs change");
    }
}

#[test]
fn derivatives_that_there_are_none_of_are_refused() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let one = unit.three(false, false);
    one.start();
    one.step(0.0, 0.01);
    assert_eq!(of_output(&one, "cart_position", 1), Ok(one.get("cart_speed")));
    for (name, order) in [("cart_position", 0), ("cart_position", 8), ("cart_position", -1), ("command", 1)] {
        assert_eq!(of_output(&one, name, order), Err(ERROR), "{name}, {order}");
    }
    assert_eq!(of_output(&one, "cart_state", 1), Err(ERROR), "it is a whole number");
    // The curves of a machine's friction have no table of derivatives; its description says so.
    let curved = Unit::new("core-xy/follows.toml", false);
    let one = curved.three(false, false);
    one.start();
    one.step(0.0, 0.01);
    assert_eq!(of_output(&one, "cart_position", 1), Err(ERROR));
    for (unit, orders) in [(&unit, 7), (&curved, 0)] {
        for version in [taut::export::fmu::Version::Two, taut::export::fmu::Version::Three] {
            let text = taut::export::fmu::description(&unit.model, version, false).unwrap();
            assert!(text.contains(&format!("maxOutputDerivativeOrder=\"{orders}\"")), "{text}");
        }
    }
}
