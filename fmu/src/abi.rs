//! Pointers into slices, texts out of pointers, panics into statuses.

use crate::instance::{Instance, Refusable, Refusal, Status, Use};
use crate::values::ALIVE;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use taut_export::fmu::Model;

/// Where messages go.
pub(crate) enum Log {
    /// The logger of 2.0, which formats as printf does.
    Two(Option<Logger2>),
    /// The logger of 3.0.
    Three(Option<Logger3>),
}

pub(crate) type Logger2 = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);
pub(crate) type Logger3 = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// Is called within a step of 3.0: environment, time, whether values can be set and read, whether the step is done,
/// whether it can return early, whether it shall, and when.
pub type IntermediateUpdate = unsafe extern "C" fn(*mut c_void, f64, bool, bool, bool, bool, *mut u8, *mut f64);

/// An instance as importers hold it.
pub struct Handle {
    pub(crate) instance: Instance,
    name: CString,
    log: Log,
    environment: *mut c_void,
    /// Categories that are wanted: errors, events.
    pub(crate) is_logging: bool,
    /// States that were handed out and not freed yet.
    states: Vec<*mut Instance>,
    /// The callback of 3.0 at events within a step.
    pub(crate) intermediate: Option<IntermediateUpdate>,
}

impl Handle {
    /// One that says nothing by itself.
    pub(crate) fn new(instance: Instance, name: CString, log: Log, environment: *mut c_void, is_logging: bool) -> Self {
        Self { instance, name, log, environment, is_logging, states: Vec::new(), intermediate: None }
    }

    /// The importer's own pointer.
    pub(crate) fn environment(&self) -> *mut c_void {
        self.environment
    }

    /// Tells the importer.
    fn tell(&self, status: Status, message: &str) {
        if self.is_logging {
            tell(&self.log, self.environment, &self.name, status, message);
        }
    }

    /// Hands out a state.
    pub(crate) fn hand_out(&mut self, state: Instance) -> *mut c_void {
        let state = Box::into_raw(Box::new(state));
        self.states.push(state);
        state.cast()
    }

    /// A state that was handed out.
    pub(crate) fn state(&self, state: *mut c_void) -> Refusable<&Instance> {
        match self.states.iter().find(|known| known.cast() == state) {
            // It is in the list, so it was made here and is not freed.
            Some(known) => Ok(unsafe { &**known }),
            None => Err(Refusal::error("this is no state of this instance; allowed: what GetFMUState gave")),
        }
    }

    /// Frees a state that was handed out; a null pointer is free already.
    pub(crate) fn free(&mut self, state: *mut c_void) -> Refusable<()> {
        if state.is_null() {
            return Ok(());
        }
        match self.states.iter().position(|known| known.cast() == state) {
            Some(place) => {
                // It was made by `hand_out`, and nobody has it any more.
                drop(unsafe { Box::from_raw(self.states.swap_remove(place)) });
                Ok(())
            }
            None => Err(Refusal::error("this is no state of this instance; allowed: what GetFMUState gave")),
        }
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        for state in std::mem::take(&mut self.states) {
            // Made by `hand_out`, and not freed yet.
            drop(unsafe { Box::from_raw(state) });
        }
    }
}

/// Tells an importer.
pub(crate) fn tell(log: &Log, environment: *mut c_void, name: &CStr, status: Status, message: &str) {
    let category = c"logStatusError".as_ptr();
    let plain = message.replace('\0', " ");
    match log {
        Log::Two(Some(logger)) => {
            let text = CString::new(plain.replace('%', "%%")).unwrap_or_default();
            // The importer's own function, as 2.0 declares it; the message asks for no further arguments.
            unsafe { logger(environment, name.as_ptr(), status as c_int, category, text.as_ptr()) }
        }
        Log::Three(Some(logger)) => {
            let text = CString::new(plain).unwrap_or_default();
            // The importer's own function, as 3.0 declares it.
            unsafe { logger(environment, status as c_int, category, text.as_ptr()) }
        }
        Log::Two(None) | Log::Three(None) => {}
    }
}

/// Does something with an instance and says how it ended. What panics ends here.
///
/// # Safety
///
/// `instance` is null, or was made by an instantiate function, is not freed, and is in nobody else's hands now.
pub(crate) unsafe fn with(instance: *mut c_void, act: impl FnOnce(&mut Handle) -> Refusable<()>) -> c_int {
    let Some(handle) = (unsafe { instance.cast::<Handle>().as_mut() }) else { return Status::Error as c_int };
    match catch_unwind(AssertUnwindSafe(|| act(handle))) {
        Ok(Ok(())) => Status::Ok as c_int,
        Ok(Err(Refusal { status, message })) => {
            handle.tell(status, &message);
            status as c_int
        }
        Err(_) => {
            handle.instance.break_down();
            handle.tell(Status::Fatal, "this is a defect of taut: it panicked; the instance cannot be used any more");
            Status::Fatal as c_int
        }
    }
}

/// Frees an instance, be it null.
///
/// # Safety
///
/// As for [`with`]; nobody uses it afterwards.
pub(crate) unsafe fn free(instance: *mut c_void) {
    if !instance.is_null() {
        let _ = catch_unwind(AssertUnwindSafe(|| drop(unsafe { Box::from_raw(instance.cast::<Handle>()) })));
    }
}

/// Values from outside. Errors: none where there should be some.
///
/// # Safety
///
/// `values` is null or has `count` elements.
pub(crate) unsafe fn slice<'a, T>(values: *const T, count: usize) -> Refusable<&'a [T]> {
    match (values.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Refusal::error("a null pointer was given for values")),
        (false, _) => Ok(unsafe { std::slice::from_raw_parts(values, count) }),
    }
}

/// Room outside. Errors: none where there should be some.
///
/// # Safety
///
/// `values` is null or has room for `count` elements, which nobody else looks at now.
pub(crate) unsafe fn room<'a, T>(values: *mut T, count: usize) -> Refusable<&'a mut [T]> {
    match (values.is_null(), count) {
        (_, 0) => Ok(&mut []),
        (true, _) => Err(Refusal::error("a null pointer was given for values")),
        (false, _) => Ok(unsafe { std::slice::from_raw_parts_mut(values, count) }),
    }
}

/// Puts one value outside. Errors: nowhere to put it.
///
/// # Safety
///
/// `place` is null or can be written to.
pub(crate) unsafe fn put<T>(place: *mut T, value: T) -> Refusable<()> {
    match place.is_null() {
        true => Err(Refusal::error("a null pointer was given for a result")),
        false => {
            unsafe { place.write(value) };
            Ok(())
        }
    }
}

/// A text from outside; empty where there is none.
///
/// # Safety
///
/// `text` is null or ends with a zero.
pub(crate) unsafe fn text(text: *const c_char) -> String {
    match text.is_null() {
        true => String::new(),
        false => unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned(),
    }
}

/// The folder that a path, or a URI of the kind `file:`, names.
pub(crate) fn folder(given: &str) -> PathBuf {
    let Some(rest) = given.strip_prefix("file:") else { return PathBuf::from(given) };
    let rest = rest.strip_prefix("//localhost").or_else(|| rest.strip_prefix("//")).unwrap_or(rest);
    let bytes = rest.as_bytes();
    let (mut plain, mut k) = (Vec::with_capacity(bytes.len()), 0);
    while k < bytes.len() {
        let hex = |at: usize| char::from(*bytes.get(at)?).to_digit(16);
        match (bytes[k], hex(k + 1), hex(k + 2)) {
            (b'%', Some(high), Some(low)) => {
                plain.push((16 * high + low) as u8);
                k += 3;
            }
            (byte, ..) => {
                plain.push(byte);
                k += 1;
            }
        }
    }
    let path = String::from_utf8_lossy(&plain).into_owned();
    // /C:/folder is C:/folder.
    let drive = path.as_bytes().get(2) == Some(&b':') && path.starts_with('/');
    PathBuf::from(if drive { path[1..].to_string() } else { path })
}

/// Makes an instance of the machine in a folder of resources. Errors: no such machine, or another one than the importer
/// means.
fn open(resources: &str, token: &str, purpose: Use) -> Refusable<Instance> {
    let path = folder(resources).join("machine.toml");
    let text = std::fs::read_to_string(&path).map_err(|e| {
        Refusal::error(format!("{} cannot be read: {e}; allowed: the folder resources of the FMU", path.display()))
    })?;
    let plain = Model::of_resource(&text, false)?;
    let model = match plain.token == token {
        true => plain,
        // With the controller inside there are other variables.
        false => match Model::of_resource(&text, true) {
            Ok(model) if model.token == token => model,
            _ => {
                return Err(Refusal::error(format!(
                    "{token} is not the token of this FMU; allowed: the one in its modelDescription.xml"
                )));
            }
        },
    };
    Ok(Instance::new(Arc::new(model), purpose))
}

/// Makes an instance, or tells why not: null then.
///
/// # Safety
///
/// All texts are null or end with a zero.
pub(crate) unsafe fn instantiate(
    [name, token, resources]: [*const c_char; 3],
    purpose: Use,
    log: Log,
    environment: *mut c_void,
    is_logging: bool,
) -> *mut Handle {
    let made = catch_unwind(AssertUnwindSafe(|| {
        let [name, token, resources] = [name, token, resources].map(|given| unsafe { text(given) });
        let name = CString::new(name).unwrap_or_default();
        match open(&resources, &token, purpose) {
            Ok(instance) => Box::into_raw(Box::new(Handle::new(instance, name, log, environment, is_logging))),
            Err(refusal) => {
                tell(&log, environment, &name, refusal.status, &refusal.message);
                std::ptr::null_mut()
            }
        }
    }));
    made.unwrap_or(std::ptr::null_mut())
}

// --- states that are handed out -------------------------------------------------------------------------------------

/// Keeps a state; one that was handed out before is written over.
pub(crate) unsafe fn keep(handle: &mut Handle, function: &str, state: *mut *mut c_void) -> Refusable<()> {
    handle.instance.allow(function, &ALIVE)?;
    let Some(place) = (unsafe { state.as_mut() }) else {
        return Err(Refusal::error("a null pointer was given for a state"));
    };
    let copy = handle.instance.clone();
    if handle.state(*place).is_ok() {
        let old = *place;
        *place = std::ptr::null_mut();
        handle.free(old)?;
    }
    *place = handle.hand_out(copy);
    Ok(())
}

/// Goes on from a state.
pub(crate) fn bring_back(handle: &mut Handle, function: &str, state: *mut c_void) -> Refusable<()> {
    handle.instance.allow(function, &ALIVE)?;
    handle.instance = handle.state(state)?.clone();
    Ok(())
}

/// Frees a state.
pub(crate) unsafe fn let_go(handle: &mut Handle, state: *mut *mut c_void) -> Refusable<()> {
    let Some(place) = (unsafe { state.as_mut() }) else { return Ok(()) };
    handle.free(*place)?;
    *place = std::ptr::null_mut();
    Ok(())
}

/// A state as bytes.
pub(crate) fn write_out(handle: &mut Handle, state: *mut c_void, into: &mut [u8]) -> Refusable<()> {
    let bytes = handle.state(state)?.bytes()?;
    if into.len() < bytes.len() {
        let message = format!("there is room for {} bytes; allowed: {} and more", into.len(), bytes.len());
        return Err(Refusal::error(message));
    }
    into[..bytes.len()].copy_from_slice(&bytes);
    Ok(())
}

/// A state of bytes.
pub(crate) unsafe fn read_in(handle: &mut Handle, bytes: &[u8], state: *mut *mut c_void) -> Refusable<()> {
    let Some(place) = (unsafe { state.as_mut() }) else {
        return Err(Refusal::error("a null pointer was given for a state"));
    };
    let other = handle.instance.of_bytes(bytes)?;
    *place = handle.hand_out(other);
    Ok(())
}
