//! The functions that FMI 2.0 and 3.0 have alike but for their names.
#![allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]

use crate::abi::{bring_back, keep, let_go, put, read_in, room, slice, with, write_out};
use crate::instance::Phase::{Continuous, Event, Initialization, Step, Terminated};
use crate::values::{ALIVE, READ};
use std::ffi::{c_int, c_void};

/// A function under its name in 2.0 and under that in 3.0: its arguments beside the instance, and what it does with the
/// instance, told its own name.
macro_rules! both {
    ($($two:ident $three:ident($($argument:ident: $of:ty),*) |$handle:ident, $name:ident| $act:expr;)*) => {$(
        both!(@one $two($($argument: $of),*) |$handle, $name| $act);
        both!(@one $three($($argument: $of),*) |$handle, $name| $act);
    )*};
    (@one $function:ident($($argument:ident: $of:ty),*) |$handle:ident, $name:ident| $act:expr) => {
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(instance: *mut c_void, $($argument: $of),*) -> c_int {
            let $name = stringify!($function);
            unsafe { with(instance, |$handle| $act) }
        }
    };
}

both! {
    fmi2ExitInitializationMode fmi3ExitInitializationMode() |handle, name| {
        handle.instance.allow(name, &[Initialization])?;
        handle.instance.exit_initialization()
    };
    fmi2Terminate fmi3Terminate() |handle, name| {
        handle.instance.go_into(name, &[Event, Continuous, Step], Terminated)
    };
    fmi2Reset fmi3Reset() |handle, name| {
        handle.instance.allow(name, &ALIVE)?;
        handle.instance.reset()
    };

    // States.
    fmi2GetFMUstate fmi3GetFMUState(state: *mut *mut c_void) |handle, name| keep(handle, name, state);
    fmi2SetFMUstate fmi3SetFMUState(state: *mut c_void) |handle, name| bring_back(handle, name, state);
    fmi2FreeFMUstate fmi3FreeFMUState(state: *mut *mut c_void) |handle, _name| let_go(handle, state);
    fmi2SerializedFMUstateSize fmi3SerializedFMUStateSize(state: *mut c_void, size: *mut usize) |handle, _name| {
        put(size, handle.state(state)?.bytes()?.len())
    };
    fmi2SerializeFMUstate fmi3SerializeFMUState(state: *mut c_void, bytes: *mut u8, size: usize) |handle, _name| {
        write_out(handle, state, room(bytes, size)?)
    };
    fmi2DeSerializeFMUstate fmi3DeserializeFMUState(bytes: *const u8, size: usize, state: *mut *mut c_void)
    |handle, _name| {
        read_in(handle, slice(bytes, size)?, state)
    };

    // Model exchange.
    fmi2SetTime fmi3SetTime(time: f64) |handle, name| {
        handle.instance.exchanged(name, &[Event, Continuous])?;
        handle.instance.set_time(time)
    };
    fmi2SetContinuousStates fmi3SetContinuousStates(x: *const f64, n: usize) |handle, name| {
        handle.instance.allow(name, &[Continuous])?;
        handle.instance.set_states(slice(x, n)?)
    };
    fmi2GetContinuousStates fmi3GetContinuousStates(x: *mut f64, n: usize) |handle, name| {
        handle.instance.exchanged(name, &READ)?;
        handle.instance.states(room(x, n)?)
    };
    fmi2GetDerivatives fmi3GetContinuousStateDerivatives(rates: *mut f64, n: usize) |handle, name| {
        handle.instance.exchanged(name, &READ)?;
        handle.instance.rates(room(rates, n)?)
    };
    fmi2GetEventIndicators fmi3GetEventIndicators(values: *mut f64, n: usize) |handle, name| {
        handle.instance.exchanged(name, &READ)?;
        handle.instance.residuals(room(values, n)?)
    };
    fmi2GetNominalsOfContinuousStates fmi3GetNominalsOfContinuousStates(x: *mut f64, n: usize) |handle, name| {
        handle.instance.exchanged(name, &ALIVE)?;
        handle.instance.nominals(room(x, n)?)
    };
}
