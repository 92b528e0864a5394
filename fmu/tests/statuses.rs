//! Every way of using an instance wrongly gives the standard's answer, and the instance lives on.

use crate::unit::{DISCARD, ERROR, OK, Unit};
use std::ffi::CString;
use taut_fmu::{fmi2, fmi3};

#[test]
fn functions_out_of_order_are_errors() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let instance = unit.three(false, false);
    let c = instance.pointer;
    let mut x = [0.0; 6];
    unsafe {
        // Before the start.
        assert_eq!(instance.try_step(0.0, 0.1).0, ERROR);
        assert_eq!(fmi3::fmi3ExitInitializationMode(c), ERROR);
        assert_eq!(fmi3::fmi3Terminate(c), ERROR);
        assert_eq!(fmi3::fmi3EnterStepMode(c), ERROR);
        let reference = unit.reference("cart_position");
        assert_eq!(fmi3::fmi3GetFloat64(c, &reference, 1, x.as_mut_ptr(), 1), ERROR);
        instance.start();
        // Twice, and of the other kind.
        assert_eq!(fmi3::fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0), ERROR);
        assert_eq!(fmi3::fmi3EnterEventMode(c), ERROR);
        assert_eq!(fmi3::fmi3EnterContinuousTimeMode(c), ERROR);
        assert_eq!(fmi3::fmi3SetTime(c, 0.1), ERROR);
        assert_eq!(fmi3::fmi3SetContinuousStates(c, x.as_ptr(), 6), ERROR);
        assert_eq!(fmi3::fmi3GetContinuousStateDerivatives(c, x.as_mut_ptr(), 6), ERROR);
        assert_eq!(fmi3::fmi3EnterConfigurationMode(c), ERROR);
        // It lives on.
        instance.step(0.0, 0.1);
        assert_eq!(fmi3::fmi3Terminate(c), OK);
        assert_eq!(instance.try_step(0.1, 0.1).0, ERROR);
        assert_eq!(fmi3::fmi3GetFloat64(c, &reference, 1, x.as_mut_ptr(), 1), OK);
        assert_eq!(fmi3::fmi3Reset(c), OK);
        instance.start();
        instance.step(0.0, 0.1);
    }
}

#[test]
fn unknown_references_wrong_types_and_nulls_are_errors() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let instance = unit.three(false, false);
    instance.start();
    let (c, mut real, mut whole) = (instance.pointer, 0.0, 0);
    let (position, state) = (unit.reference("cart_position"), unit.reference("cart_state"));
    unsafe {
        assert_eq!(fmi3::fmi3GetFloat64(c, &99_999, 1, &mut real, 1), ERROR);
        assert_eq!(fmi3::fmi3SetFloat64(c, &99_999, 1, &real, 1), ERROR);
        assert_eq!(fmi3::fmi3GetFloat64(c, &state, 1, &mut real, 1), ERROR);
        assert_eq!(fmi3::fmi3GetInt32(c, &position, 1, &mut whole, 1), ERROR);
        assert_eq!(fmi3::fmi3GetInt32(c, &state, 1, &mut whole, 1), OK);
        assert_eq!(fmi3::fmi3GetBoolean(c, &position, 1, std::ptr::null_mut(), 1), ERROR);
        assert_eq!(fmi3::fmi3GetBoolean(c, std::ptr::null(), 0, std::ptr::null_mut(), 0), OK);
        assert_eq!(fmi3::fmi3GetFloat64(c, std::ptr::null(), 1, &mut real, 1), ERROR);
        assert_eq!(fmi3::fmi3GetFloat64(c, &position, 1, std::ptr::null_mut(), 1), ERROR);
        assert_eq!(fmi3::fmi3GetFloat64(c, &position, 1, &mut real, 2), ERROR);
        assert_eq!(fmi3::fmi3SetFMUState(c, std::ptr::null_mut()), ERROR);
        assert_eq!(fmi3::fmi3SetFMUState(c, 0x10 as *mut _), ERROR);
        assert_eq!(fmi3::fmi3GetFMUState(c, std::ptr::null_mut()), ERROR);
        assert_eq!(fmi3::fmi3FreeFMUState(c, std::ptr::null_mut()), OK);
        // No instance at all.
        let none = std::ptr::null_mut();
        assert_eq!(fmi3::fmi3GetFloat64(none, &position, 1, &mut real, 1), ERROR);
        assert_eq!(fmi3::fmi3Terminate(none), ERROR);
        fmi3::fmi3FreeInstance(none);
        fmi2::fmi2FreeInstance(none);
        assert_eq!(fmi2::fmi2DoStep(none, 0.0, 0.1, 0), ERROR);
    }
}

#[test]
fn what_is_no_number_is_an_error_and_changes_nothing() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let instance = unit.three(false, false);
    instance.start();
    assert_eq!(instance.set("command", 3.0), OK);
    let names = [unit.reference("command"), unit.reference("cart_force")];
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(instance.set("command", wrong), ERROR);
        // The first of two is not set where the second cannot be.
        let both = [7.0, wrong];
        assert_eq!(unsafe { fmi3::fmi3SetFloat64(instance.pointer, names.as_ptr(), 2, both.as_ptr(), 2) }, ERROR);
    }
    assert_eq!(instance.get("command"), 3.0);
    assert_eq!(instance.set("cart.mass", -1.0), ERROR);
    assert_eq!(instance.get("cart.mass"), 0.362);
    assert_eq!(instance.set("cart_position", 0.1), ERROR, "it is under way");
    assert_eq!(instance.set("voltage", 1.0), ERROR, "an output");
    let exchange = unit.exchange();
    exchange.start();
    unsafe {
        assert_eq!(fmi3::fmi3EnterContinuousTimeMode(exchange.pointer), OK);
        assert_eq!(fmi3::fmi3SetTime(exchange.pointer, f64::NAN), ERROR);
        let states = [0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0];
        assert_eq!(fmi3::fmi3SetContinuousStates(exchange.pointer, states.as_ptr(), 6), ERROR);
        assert_eq!(fmi3::fmi3SetContinuousStates(exchange.pointer, states.as_ptr(), 5), ERROR);
    }
}

#[test]
fn steps_of_no_size_backward_and_from_elsewhere_are_errors() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let instance = unit.three(false, false);
    unsafe {
        assert_eq!(fmi3::fmi3EnterInitializationMode(instance.pointer, 0, 0.0, 0.0, 1, 0.5), OK);
        assert_eq!(fmi3::fmi3ExitInitializationMode(instance.pointer), OK);
    }
    for (time, size) in [(0.0, 0.0), (0.0, -0.1), (0.0, f64::NAN), (f64::NAN, 0.1), (0.3, 0.1), (0.0, 0.6)] {
        assert_eq!(instance.try_step(time, size).0, ERROR, "{size} from {time}");
    }
    instance.step(0.0, 0.5);
    assert_eq!(instance.try_step(0.5, 0.1).0, ERROR, "behind the stop time");
    let other = unit.three(false, false);
    assert_eq!(unsafe { fmi3::fmi3EnterInitializationMode(other.pointer, 0, 0.0, f64::NAN, 0, 0.0) }, ERROR);
    assert_eq!(unsafe { fmi3::fmi3EnterInitializationMode(other.pointer, 0, 0.0, 1.0, 1, 0.5) }, ERROR);
}

#[test]
fn another_token_or_no_resources_make_no_instance() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let wrong = CString::new("{0}").unwrap();
    assert!(unit.two(1, &wrong).is_null());
    assert!(unit.two(7, &unit.token()).is_null());
    unsafe {
        let (null, none) = (std::ptr::null(), std::ptr::null_mut());
        assert!(fmi3::fmi3InstantiateModelExchange(null, null, null, 0, 0, none, None).is_null());
        let nowhere = c"/nowhere";
        let made = fmi3::fmi3InstantiateModelExchange(null, unit.token().as_ptr(), nowhere.as_ptr(), 0, 0, none, None);
        assert!(made.is_null());
    }
}

#[test]
fn friction_that_was_none_gave_more_conditions_than_there_was_room_for() {
    // A body without friction has no modes; with friction set before the start it has, and was watched by conditions
    // that the description did not count: a panic of a thousandth of all random sequences.
    let unit = Unit::with("sollmann-jouaneh/table4.toml", &["cart.friction.coulomb=0 N"], false);
    let one = unit.exchange();
    assert_eq!(one.set("cart.friction.coulomb", 3.0), OK);
    one.start();
    let (mut count, mut values) = (0, vec![0.0; 64]);
    unsafe {
        assert_eq!(fmi3::fmi3GetNumberOfEventIndicators(one.pointer, &mut count), OK);
        assert_eq!(fmi3::fmi3GetEventIndicators(one.pointer, values.as_mut_ptr(), count), OK);
    }
    assert_eq!(values.iter().filter(|value| (**value - 3.0).abs() < 1e-9).count(), 2, "{values:?}");
    // Which quantities there are to integrate is fixed: an inductance that was none cannot come.
    let other = unit.exchange();
    assert_eq!(other.set("motor.inductance", 1e-3), ERROR);
    assert_eq!(other.get_parameter("motor.inductance"), 0.0);
}

#[test]
fn a_cart_that_leaves_its_travel_ends_the_run() {
    let changes = ["travel={ min = \"-0.01 m\", max = \"0.01 m\" }"];
    let unit = Unit::with("sollmann-jouaneh/table4.toml", &changes, false);
    let instance = unit.three(false, false);
    instance.start();
    assert_eq!(instance.set("command", 10.0), OK);
    let step = instance.step(0.0, 1.0);
    assert!(step.terminate == 1 && step.early == 1 && step.last < 0.5, "{step:?}");
    assert!((instance.get("cart_position") - 0.01).abs() < 1e-9, "{}", instance.get("cart_position"));
    let (two, command, mut over, mut last) = (unit.two(1, &unit.token()), unit.reference("command"), 0, 0.0);
    unsafe {
        assert_eq!(fmi2::fmi2SetupExperiment(two, 0, 0.0, 0.0, 0, 0.0), OK);
        assert_eq!(fmi2::fmi2EnterInitializationMode(two), OK);
        assert_eq!(fmi2::fmi2ExitInitializationMode(two), OK);
        assert_eq!(fmi2::fmi2SetReal(two, &command, 1, &10.0), OK);
        assert_eq!(fmi2::fmi2DoStep(two, 0.0, 1.0, 0), DISCARD);
        assert_eq!(fmi2::fmi2GetBooleanStatus(two, 3, &mut over), OK);
        assert_eq!(fmi2::fmi2GetRealStatus(two, 2, &mut last), OK);
        assert_eq!((over, last), (1, step.last));
        assert_eq!(fmi2::fmi2CancelStep(two), ERROR);
        fmi2::fmi2FreeInstance(two);
    }
}
