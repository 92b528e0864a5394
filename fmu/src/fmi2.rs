//! The functions of FMI 2.0, as the standard names them.
#![allow(non_snake_case, missing_docs, clippy::missing_safety_doc, clippy::too_many_arguments)]

use crate::abi::{Log, Logger2, free, instantiate, put, room, slice, with};
pub use crate::both::{
    fmi2DeSerializeFMUstate, fmi2ExitInitializationMode, fmi2FreeFMUstate, fmi2GetContinuousStates, fmi2GetDerivatives,
    fmi2GetEventIndicators, fmi2GetFMUstate, fmi2GetNominalsOfContinuousStates, fmi2Reset, fmi2SerializeFMUstate,
    fmi2SerializedFMUstateSize, fmi2SetContinuousStates, fmi2SetFMUstate, fmi2SetTime, fmi2Terminate,
};
use crate::instance::Phase::{Continuous, Event, Initialization, Instantiated, Step, Terminated};
use crate::instance::{Instance, Refusable, Refusal, Status, Use};
use crate::step::Halt;
use crate::values::{ALIVE, READ, SET};
use std::ffi::{c_char, c_int, c_uint, c_void};

type Component = *mut c_void;
type References = *const c_uint;

/// Functions of the importer.
#[repr(C)]
pub struct Callbacks {
    logger: Option<Logger2>,
    allocate: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    release: Option<unsafe extern "C" fn(*mut c_void)>,
    finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    environment: *mut c_void,
}

/// Changes that an event has brought about.
#[repr(C)]
pub struct EventInfo {
    needed: c_int,
    terminate: c_int,
    nominals: c_int,
    values: c_int,
    next_defined: c_int,
    next: f64,
}

const EXCHANGE: c_int = 0;
const CO_SIMULATION: c_int = 1;

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    c: Component,
    on: c_int,
    n: usize,
    categories: *const *const c_char,
) -> c_int {
    unsafe {
        with(c, |handle| {
            slice(categories, n)?;
            handle.is_logging = on != 0;
            Ok(())
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resources: *const c_char,
    functions: *const Callbacks,
    _visible: c_int,
    logging: c_int,
) -> Component {
    let (logger, environment) = match unsafe { functions.as_ref() } {
        Some(callbacks) => (callbacks.logger, callbacks.environment),
        None => (None, std::ptr::null_mut()),
    };
    let purpose = match kind {
        EXCHANGE => Use::ModelExchange,
        CO_SIMULATION => Use::CoSimulation { events: false, early: false },
        _ => return std::ptr::null_mut(),
    };
    unsafe { instantiate([name, guid, resources], purpose, Log::Two(logger), environment, logging != 0) }.cast()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
    unsafe { free(c) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: Component,
    tolerance_defined: c_int,
    tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2SetupExperiment", &[Instantiated])?;
            if tolerance_defined != 0 && !(tolerance.is_finite() && tolerance > 0.0) {
                return Err(Refusal::error(format!("a tolerance cannot be {tolerance}; allowed: above zero")));
            }
            handle.instance.set_up(start, (stop_defined != 0).then_some(stop))
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(c: Component) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2EnterInitializationMode", &[Instantiated])?;
            handle.instance.enter_initialization()
        })
    }
}

// --- values ---------------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(c: Component, vr: References, n: usize, values: *mut f64) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2GetReal", &READ)?;
            handle.instance.reals(slice(vr, n)?, room(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(c: Component, vr: References, n: usize, values: *mut c_int) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2GetInteger", &READ)?;
            handle.instance.wholes(slice(vr, n)?, room(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(c: Component, vr: References, n: usize, values: *const f64) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2SetReal", &SET)?;
            handle.instance.set_reals(slice(vr, n)?, slice(values, n)?)
        })
    }
}

/// Functions on variables of a type that there are none of.
macro_rules! none_of {
    ($($name:ident($($pointer:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(c: Component, _vr: References, n: usize, $(_: $pointer),*) -> c_int {
            unsafe { with(c, |handle| none(&handle.instance, stringify!($name), n)) }
        }
    )*};
}

none_of! {
    fmi2GetBoolean(*mut c_int);
    fmi2GetString(*mut *const c_char);
    fmi2SetInteger(*const c_int);
    fmi2SetBoolean(*const c_int);
    fmi2SetString(*const *const c_char);
}

fn none(instance: &Instance, function: &str, count: usize) -> Refusable<()> {
    instance.allow(function, &ALIVE)?;
    match count {
        0 => Ok(()),
        _ => Err(Refusal::error(format!(
            "{function}: there is no such variable; allowed: those of modelDescription.xml"
        ))),
    }
}

// --- derivatives ----------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    c: Component,
    unknowns: References,
    n: usize,
    knowns: References,
    m: usize,
    seed: *const f64,
    sensitivity: *mut f64,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2GetDirectionalDerivative", &READ)?;
            let (unknowns, knowns) = (slice(unknowns, n)?, slice(knowns, m)?);
            handle.instance.directional(unknowns, knowns, slice(seed, m)?, room(sensitivity, n)?)
        })
    }
}

// --- model exchange -------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterEventMode(c: Component) -> c_int {
    unsafe { with(c, |handle| handle.instance.go_into("fmi2EnterEventMode", &[Continuous], Event)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2NewDiscreteStates(c: Component, info: *mut EventInfo) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2NewDiscreteStates", &[Event])?;
            let settled = handle.instance.settle()?;
            put(
                info,
                EventInfo {
                    needed: 0,
                    terminate: c_int::from(settled.over),
                    nominals: 0,
                    values: c_int::from(settled.moved),
                    next_defined: c_int::from(settled.next.is_some()),
                    next: settled.next.unwrap_or(0.0),
                },
            )
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterContinuousTimeMode(c: Component) -> c_int {
    unsafe { with(c, |handle| handle.instance.go_into("fmi2EnterContinuousTimeMode", &[Event], Continuous)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2CompletedIntegratorStep(
    c: Component,
    _no_set_before: c_int,
    event: *mut c_int,
    terminate: *mut c_int,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2CompletedIntegratorStep", &[Continuous])?;
            put(event, c_int::from(handle.instance.has_fallen()?))?;
            put(terminate, 0)
        })
    }
}

// --- co-simulation --------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    c: Component,
    vr: References,
    n: usize,
    orders: *const c_int,
    values: *const f64,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.only("fmi2SetRealInputDerivatives", !handle.instance.exchanges())?;
            handle.instance.allow("fmi2SetRealInputDerivatives", &[Instantiated, Initialization, Step])?;
            handle.instance.set_input_derivatives(slice(vr, n)?, slice(orders, n)?, slice(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    c: Component,
    vr: References,
    n: usize,
    orders: *const c_int,
    values: *mut f64,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.only("fmi2GetRealOutputDerivatives", !handle.instance.exchanges())?;
            handle.instance.allow("fmi2GetRealOutputDerivatives", &[Step, Terminated])?;
            handle.instance.output_derivatives(slice(vr, n)?, slice(orders, n)?, room(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(c: Component, current: f64, size: f64, _no_set_before: c_int) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi2DoStep", &[Step])?;
            let end = handle.instance.step_end(current, size)?;
            match handle.instance.go(end, false)? {
                Halt::Arrived | Halt::Event => Ok(()),
                Halt::Over => Err(Refusal {
                    status: Status::Discard,
                    message: format!("the cart left its travel at {} s: the run ends there", handle.instance.time()),
                }),
            }
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2CancelStep(c: Component) -> c_int {
    unsafe { with(c, |_| Err(Refusal::error("fmi2CancelStep: no step is under way; steps end before they return"))) }
}

const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(c: Component, kind: c_int, value: *mut f64) -> c_int {
    unsafe {
        with(c, |handle| match kind {
            LAST_SUCCESSFUL_TIME => put(value, handle.instance.time()),
            _ => Err(no_status("fmi2GetRealStatus")),
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(c: Component, kind: c_int, value: *mut c_int) -> c_int {
    unsafe {
        with(c, |handle| match kind {
            TERMINATED => put(value, c_int::from(handle.instance.is_over())),
            _ => Err(no_status("fmi2GetBooleanStatus")),
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStatus(c: Component, _kind: c_int, _value: *mut c_int) -> c_int {
    unsafe { with(c, |_| Err(no_status("fmi2GetStatus"))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetIntegerStatus(c: Component, _kind: c_int, _value: *mut c_int) -> c_int {
    unsafe { with(c, |_| Err(no_status("fmi2GetIntegerStatus"))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStringStatus(c: Component, _kind: c_int, _value: *mut *const c_char) -> c_int {
    unsafe { with(c, |_| Err(no_status("fmi2GetStringStatus"))) }
}

fn no_status(function: &str) -> Refusal {
    let message = format!("{function}: no step is ever pending; allowed: fmi2LastSuccessfulTime, fmi2Terminated");
    Refusal { status: Status::Discard, message }
}
