//! The functions of FMI 3.0, as the standard names them. Its booleans come in as bytes: what is not zero is true.
#![allow(non_snake_case, missing_docs, clippy::missing_safety_doc, clippy::too_many_arguments)]

pub use crate::abi::IntermediateUpdate;
use crate::abi::{Handle, Log, Logger3, free, instantiate, put, room, slice, with};
pub use crate::both::{
    fmi3DeserializeFMUState, fmi3ExitInitializationMode, fmi3FreeFMUState, fmi3GetContinuousStateDerivatives,
    fmi3GetContinuousStates, fmi3GetEventIndicators, fmi3GetFMUState, fmi3GetNominalsOfContinuousStates, fmi3Reset,
    fmi3SerializeFMUState, fmi3SerializedFMUStateSize, fmi3SetContinuousStates, fmi3SetFMUState, fmi3SetTime,
    fmi3Terminate,
};
use crate::instance::Phase::{Continuous, Event, Instantiated, Step, Terminated};
use crate::instance::{Refusable, Refusal, Status, Use};
use crate::step::Halt;
use crate::values::{ALIVE, READ, SET};
use std::ffi::{c_char, c_int, c_void};

type Component = *mut c_void;
type References = *const u32;

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    c: Component,
    on: u8,
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

// --- instances ------------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateModelExchange(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: u8,
    logging: u8,
    environment: *mut c_void,
    log: Option<Logger3>,
) -> Component {
    let purpose = Use::ModelExchange;
    unsafe { instantiate([name, token, resources], purpose, Log::Three(log), environment, logging != 0) }.cast()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: u8,
    logging: u8,
    event_mode: u8,
    early_return: u8,
    _intermediate: References,
    _intermediates: usize,
    environment: *mut c_void,
    log: Option<Logger3>,
    update: Option<IntermediateUpdate>,
) -> Component {
    let purpose = Use::CoSimulation { events: event_mode != 0, early: early_return != 0 };
    let made = unsafe { instantiate([name, token, resources], purpose, Log::Three(log), environment, logging != 0) };
    if let Some(handle) = unsafe { made.as_mut() } {
        handle.intermediate = update;
    }
    made.cast()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
    _name: *const c_char,
    _token: *const c_char,
    _resources: *const c_char,
    _visible: u8,
    _logging: u8,
    _environment: *mut c_void,
    _log: Option<Logger3>,
    _clock: *const c_void,
    _lock: *const c_void,
    _unlock: *const c_void,
) -> Component {
    std::ptr::null_mut()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(c: Component) {
    unsafe { free(c) }
}

// --- phases ---------------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    c: Component,
    tolerance_defined: u8,
    tolerance: f64,
    start: f64,
    stop_defined: u8,
    stop: f64,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3EnterInitializationMode", &[Instantiated])?;
            if tolerance_defined != 0 && !(tolerance.is_finite() && tolerance > 0.0) {
                return Err(Refusal::error(format!("a tolerance cannot be {tolerance}; allowed: above zero")));
            }
            handle.instance.set_up(start, (stop_defined != 0).then_some(stop))?;
            handle.instance.enter_initialization()
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterEventMode(c: Component) -> c_int {
    unsafe {
        with(c, |handle| {
            let from = match handle.instance.purpose {
                Use::ModelExchange => Continuous,
                Use::CoSimulation { events: true, .. } => Step,
                Use::CoSimulation { events: false, .. } => {
                    return Err(Refusal::error("fmi3EnterEventMode: event mode was not asked for"));
                }
            };
            handle.instance.go_into("fmi3EnterEventMode", &[from], Event)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterContinuousTimeMode(c: Component) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.only("fmi3EnterContinuousTimeMode", handle.instance.exchanges())?;
            handle.instance.go_into("fmi3EnterContinuousTimeMode", &[Event], Continuous)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterStepMode(c: Component) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.only("fmi3EnterStepMode", !handle.instance.exchanges())?;
            handle.instance.go_into("fmi3EnterStepMode", &[Event], Step)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterConfigurationMode(c: Component) -> c_int {
    unsafe { with(c, |_| Err(Refusal::error("fmi3EnterConfigurationMode: there are no structural parameters"))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitConfigurationMode(c: Component) -> c_int {
    unsafe { with(c, |_| Err(Refusal::error("fmi3ExitConfigurationMode: there are no structural parameters"))) }
}

// --- values ---------------------------------------------------------------------------------------------------------

/// Refuses as many values as there are no references for: every variable is a number and no array.
fn alike(references: usize, values: usize) -> Refusable<()> {
    match references == values {
        true => Ok(()),
        false => {
            Err(Refusal::error(format!("{values} values cannot be; allowed: {references}, one for each variable")))
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    c: Component,
    vr: References,
    n: usize,
    values: *mut f64,
    count: usize,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3GetFloat64", &READ)?;
            alike(n, count)?;
            handle.instance.reals(slice(vr, n)?, room(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetInt32(c: Component, vr: References, n: usize, values: *mut i32, count: usize) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3GetInt32", &READ)?;
            alike(n, count)?;
            handle.instance.wholes(slice(vr, n)?, room(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    c: Component,
    vr: References,
    n: usize,
    values: *const f64,
    count: usize,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3SetFloat64", &SET)?;
            alike(n, count)?;
            handle.instance.set_reals(slice(vr, n)?, slice(values, n)?)
        })
    }
}

/// Functions on variables of a type that there are none of: the references, their number, and what else.
macro_rules! none_of {
    ($($name:ident($($rest:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(c: Component, _vr: References, n: usize, $(_: $rest),*) -> c_int {
            unsafe { with(c, |handle| none(handle, stringify!($name), n)) }
        }
    )*};
}

none_of! {
    fmi3GetFloat32(*mut f32, usize);
    fmi3GetInt8(*mut i8, usize);
    fmi3GetUInt8(*mut u8, usize);
    fmi3GetInt16(*mut i16, usize);
    fmi3GetUInt16(*mut u16, usize);
    fmi3GetUInt32(*mut u32, usize);
    fmi3GetInt64(*mut i64, usize);
    fmi3GetUInt64(*mut u64, usize);
    fmi3GetBoolean(*mut u8, usize);
    fmi3GetString(*mut *const c_char, usize);
    fmi3GetBinary(*mut usize, *mut *const u8, usize);
    fmi3GetClock(*mut u8);
    fmi3SetFloat32(*const f32, usize);
    fmi3SetInt8(*const i8, usize);
    fmi3SetUInt8(*const u8, usize);
    fmi3SetInt16(*const i16, usize);
    fmi3SetUInt16(*const u16, usize);
    fmi3SetInt32(*const i32, usize);
    fmi3SetUInt32(*const u32, usize);
    fmi3SetInt64(*const i64, usize);
    fmi3SetUInt64(*const u64, usize);
    fmi3SetBoolean(*const u8, usize);
    fmi3SetString(*const *const c_char, usize);
    fmi3SetBinary(*const usize, *const *const u8, usize);
    fmi3SetClock(*const u8);
    fmi3GetIntervalDecimal(*mut f64, *mut c_int);
    fmi3GetIntervalFraction(*mut u64, *mut u64, *mut c_int);
    fmi3GetShiftDecimal(*mut f64);
    fmi3GetShiftFraction(*mut u64, *mut u64);
    fmi3SetIntervalDecimal(*const f64);
    fmi3SetIntervalFraction(*const u64, *const u64);
    fmi3SetShiftDecimal(*const f64);
    fmi3SetShiftFraction(*const u64, *const u64);
}

fn none(handle: &mut Handle, function: &str, count: usize) -> Refusable<()> {
    handle.instance.allow(function, &ALIVE)?;
    match count {
        0 => Ok(()),
        _ => Err(Refusal::error(format!(
            "{function}: there is no such variable; allowed: those of modelDescription.xml"
        ))),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetNumberOfVariableDependencies(c: Component, _vr: u32, _n: *mut usize) -> c_int {
    unsafe { with(c, |_| Err(no_dependencies("fmi3GetNumberOfVariableDependencies"))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetVariableDependencies(
    c: Component,
    _vr: u32,
    _elements: *mut usize,
    _independents: *mut u32,
    _of_independents: *mut usize,
    _kinds: *mut c_int,
    _n: usize,
) -> c_int {
    unsafe { with(c, |_| Err(no_dependencies("fmi3GetVariableDependencies"))) }
}

fn no_dependencies(function: &str) -> Refusal {
    Refusal::error(format!("{function}: dependencies are those of modelDescription.xml, and no others"))
}

// --- derivatives ----------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetDirectionalDerivative(
    c: Component,
    unknowns: References,
    n: usize,
    knowns: References,
    m: usize,
    seed: *const f64,
    seeds: usize,
    sensitivity: *mut f64,
    sensitivities: usize,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3GetDirectionalDerivative", &READ)?;
            alike(n, sensitivities)?;
            alike(m, seeds)?;
            let (unknowns, knowns) = (slice(unknowns, n)?, slice(knowns, m)?);
            handle.instance.directional(unknowns, knowns, slice(seed, m)?, room(sensitivity, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetAdjointDerivative(
    c: Component,
    _unknowns: References,
    _n: usize,
    _knowns: References,
    _m: usize,
    _seed: *const f64,
    _seeds: usize,
    _sensitivity: *mut f64,
    _sensitivities: usize,
) -> c_int {
    let no = || Refusal::error("fmi3GetAdjointDerivative: there are directional derivatives, and no adjoint ones");
    unsafe { with(c, |_| Err(no())) }
}

// --- events ---------------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EvaluateDiscreteStates(c: Component) -> c_int {
    let no = || Refusal::error("fmi3EvaluateDiscreteStates: discrete states are those of fmi3UpdateDiscreteStates");
    unsafe { with(c, |_| Err(no())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3UpdateDiscreteStates(
    c: Component,
    needed: *mut u8,
    terminate: *mut u8,
    nominals: *mut u8,
    values: *mut u8,
    next_defined: *mut u8,
    next: *mut f64,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3UpdateDiscreteStates", &[Event])?;
            let settled = handle.instance.settle()?;
            put(needed, 0)?;
            put(terminate, u8::from(settled.over))?;
            put(nominals, 0)?;
            put(values, u8::from(settled.moved))?;
            put(next_defined, u8::from(settled.next.is_some()))?;
            put(next, settled.next.unwrap_or(0.0))
        })
    }
}

// --- model exchange -------------------------------------------------------------------------------------------------

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3CompletedIntegratorStep(
    c: Component,
    _no_set_before: u8,
    event: *mut u8,
    terminate: *mut u8,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.allow("fmi3CompletedIntegratorStep", &[Continuous])?;
            put(event, u8::from(handle.instance.has_fallen()?))?;
            put(terminate, 0)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetNumberOfEventIndicators(c: Component, n: *mut usize) -> c_int {
    unsafe { with(c, |handle| put(n, handle.instance.model().conditions)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetNumberOfContinuousStates(c: Component, n: *mut usize) -> c_int {
    unsafe { with(c, |handle| put(n, handle.instance.model().quantities.len())) }
}

// --- co-simulation --------------------------------------------------------------------------------------------------

/// The state of a step under way.
struct Stepped {
    end: f64,
    event: bool,
    early: bool,
    over: bool,
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetOutputDerivatives(
    c: Component,
    vr: References,
    n: usize,
    orders: *const i32,
    values: *mut f64,
    count: usize,
) -> c_int {
    unsafe {
        with(c, |handle| {
            handle.instance.only("fmi3GetOutputDerivatives", !handle.instance.exchanges())?;
            handle.instance.allow("fmi3GetOutputDerivatives", &[Step, Terminated])?;
            alike(n, count)?;
            handle.instance.output_derivatives(slice(vr, n)?, slice(orders, n)?, room(values, n)?)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    c: Component,
    current: f64,
    size: f64,
    _no_set_before: u8,
    event: *mut u8,
    terminate: *mut u8,
    early: *mut u8,
    last: *mut f64,
) -> c_int {
    let mut step = Stepped { end: 0.0, event: false, early: false, over: false };
    let begun = unsafe {
        with(c, |handle| {
            handle.instance.only("fmi3DoStep", !handle.instance.exchanges())?;
            handle.instance.allow("fmi3DoStep", &[Step])?;
            put(event, 0)?;
            put(terminate, 0)?;
            put(early, 0)?;
            put(last, handle.instance.time())?;
            step.end = handle.instance.step_end(current, size)?;
            Ok(())
        })
    };
    if begun != Status::Ok as c_int {
        return begun;
    }
    // Each part of the step holds the instance; the importer's callback, which reads from it, is called between parts.
    loop {
        let mut call: Option<Call> = None;
        let done = unsafe { with(c, |handle| part(handle, &mut step, &mut call)) };
        if done != Status::Ok as c_int {
            return done;
        }
        let goes_on = call.as_ref().is_some_and(|call| !call.is_last);
        if let Some(call) = call
            && call.asks(&mut step)
        {
            step.early = true;
            break;
        }
        if !goes_on {
            break;
        }
    }
    unsafe {
        with(c, |handle| {
            put(event, u8::from(step.event))?;
            put(terminate, u8::from(step.over))?;
            put(early, u8::from(step.early))?;
            put(last, handle.instance.time())
        })
    }
}

/// One part of a step: to its end, or to the next event where somebody wants to know of it.
fn part(handle: &mut Handle, step: &mut Stepped, call: &mut Option<Call>) -> Refusable<()> {
    let Use::CoSimulation { events, early } = handle.instance.purpose else { return Ok(()) };
    let hands_over = events && early;
    let update = handle.intermediate;
    let halt = handle.instance.go(step.end, hands_over || update.is_some())?;
    let is_last = match halt {
        Halt::Arrived => true,
        Halt::Event if hands_over => {
            (step.event, step.early) = (true, handle.instance.time() < step.end);
            true
        }
        // At the very end of the step there is nothing left to do.
        Halt::Event => handle.instance.time() >= step.end,
        Halt::Over => {
            (step.over, step.early) = (true, handle.instance.time() < step.end);
            true
        }
    };
    let time = handle.instance.time();
    *call = update.map(|update| Call { update, environment: handle.environment(), time, early, is_last });
    Ok(())
}

/// The importer's callback, about to be called.
struct Call {
    update: IntermediateUpdate,
    environment: *mut c_void,
    time: f64,
    early: bool,
    is_last: bool,
}

impl Call {
    /// Calls it; whether it wants the step to end here.
    fn asks(&self, step: &mut Stepped) -> bool {
        let (mut requested, mut when) = (0u8, self.time);
        let can_return = self.early && self.time < step.end;
        // The importer's own function, as 3.0 declares it; nobody holds the instance now.
        unsafe {
            (self.update)(self.environment, self.time, false, true, true, can_return, &mut requested, &mut when);
        }
        if requested == 0 || !can_return {
            return false;
        }
        // It may name a later time: the step is shortened to that.
        if when > self.time && when < step.end {
            (step.end, step.early) = (when, true);
            return false;
        }
        when <= self.time
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ActivateModelPartition(c: Component, _clock: u32, _time: f64) -> c_int {
    unsafe { with(c, |_| Err(Refusal::error("fmi3ActivateModelPartition: there is no scheduled execution"))) }
}
