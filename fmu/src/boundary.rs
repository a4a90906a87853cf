//! The functions of FMI 3.0 co-simulation as C calls them. Those for variables and modes that our FMUs do not have are in
//! `unsupported.rs`.

use crate::instance::Instance;
use crate::refusal::Refusal;
use crate::state::State;
use anhyst_ipc::FieldKind;
use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub const OK: i32 = 0;
pub const ERROR: i32 = 3;
const FATAL: i32 = 4;

type LogMessage = Option<unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char)>;

/// What an `fmi3Instance` points to.
pub struct Handle {
    instance: Instance,
    environment: *mut c_void,
    log: LogMessage,
}

/// Tells the simulation a sentence. Refusals are always told: FMI's switch for logging is for less than that.
fn tell(log: LogMessage, environment: *mut c_void, status: i32, sentence: &str) {
    let Some(log) = log else { return };
    let sentence = CString::new(sentence.replace('\0', " ")).unwrap_or_default();
    let category = if status == FATAL {
        c"logStatusFatal"
    } else {
        c"logStatusError"
    };
    // SAFETY: the caller's function, with its own environment; both texts end with a zero byte and live until it returns.
    unsafe { log(environment, status, category.as_ptr(), sentence.as_ptr()) };
}

/// Runs a function's body on an instance. What is refused is logged, and so is a panic, which must not unwind into C.
///
/// # Safety
/// `pointer` is null or comes from `fmi3InstantiateCoSimulation` and was not freed; nobody else uses it meanwhile.
pub unsafe fn with(pointer: *mut c_void, body: impl FnOnce(&mut Instance) -> Result<(), Refusal>) -> i32 {
    // SAFETY: the caller's promise.
    let Some(handle) = (unsafe { pointer.cast::<Handle>().as_mut() }) else {
        return ERROR;
    };
    let (log, environment) = (handle.log, handle.environment);
    match catch_unwind(AssertUnwindSafe(|| body(&mut handle.instance))) {
        Ok(Ok(())) => OK,
        Ok(Err(refusal)) => {
            tell(log, environment, ERROR, &refusal.0);
            ERROR
        }
        Err(_) => {
            tell(
                log,
                environment,
                FATAL,
                "the library has a fault: see the standard error output",
            );
            FATAL
        }
    }
}

/// A C array; empty for a length of 0, whatever the pointer.
///
/// # Safety
/// `pointer` is null or has `length` values that live as long as the result.
unsafe fn slice<'a, T>(pointer: *const T, length: usize) -> Result<&'a [T], Refusal> {
    match (pointer.is_null(), length) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(Refusal::new("an array is null")),
        // SAFETY: not null; the rest is the caller's promise.
        (false, _) => Ok(unsafe { std::slice::from_raw_parts(pointer, length) }),
    }
}

/// The same, to be written.
///
/// # Safety
/// As for [`slice`], and nobody else uses it.
unsafe fn slice_mut<'a, T>(pointer: *mut T, length: usize) -> Result<&'a mut [T], Refusal> {
    match (pointer.is_null(), length) {
        (_, 0) => Ok(&mut []),
        (true, _) => Err(Refusal::new("an array is null")),
        // SAFETY: not null; the rest is the caller's promise.
        (false, _) => Ok(unsafe { std::slice::from_raw_parts_mut(pointer, length) }),
    }
}

/// Writes to where C wants it, if it does.
///
/// # Safety
/// `place` is null or can be written.
unsafe fn put<T>(place: *mut T, value: T) {
    if !place.is_null() {
        // SAFETY: not null; the rest is the caller's promise.
        unsafe { place.write(value) };
    }
}

/// A C string; none for null or what is no UTF-8.
///
/// # Safety
/// `text` is null or ends with a zero byte.
unsafe fn text<'a>(text: *const c_char) -> Option<&'a str> {
    if text.is_null() {
        return None;
    }
    // SAFETY: not null; the rest is the caller's promise.
    unsafe { CStr::from_ptr(text) }.to_str().ok()
}

/// The version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// # Safety
/// `instance` is one of ours.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    instance: *mut c_void,
    _on: bool,
    _count: usize,
    _categories: *const *const c_char,
) -> i32 {
    // SAFETY: the caller's promise. What is logged are refusals, and they always are.
    unsafe { with(instance, |_| Ok(())) }
}

/// Null on error, with the reason logged.
///
/// # Safety
/// The texts are null or end with a zero byte; `log` can be called with `environment` until the instance is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _event_mode: bool,
    _early_return: bool,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: *mut c_void,
    log: LogMessage,
    _update: *const c_void,
) -> *mut c_void {
    // SAFETY: the caller's promise.
    let (token, resources) = unsafe { (text(token), text(resources)) };
    let open = || match (token, resources) {
        (Some(token), Some(resources)) => Instance::open(Path::new(resources), token),
        _ => Err(Refusal::new("token and path of the resources must be given, as UTF-8")),
    };
    match catch_unwind(open) {
        Ok(Ok(instance)) => Box::into_raw(Box::new(Handle {
            instance,
            environment,
            log,
        }))
        .cast(),
        Ok(Err(refusal)) => {
            tell(log, environment, ERROR, &refusal.0);
            std::ptr::null_mut()
        }
        Err(_) => {
            tell(
                log,
                environment,
                FATAL,
                "the library has a fault: see the standard error output",
            );
            std::ptr::null_mut()
        }
    }
}

/// # Safety
/// `instance` is null or one of ours, and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: not null, made by `Box::into_raw`, and by the caller's promise freed only once.
        drop(unsafe { Box::from_raw(instance.cast::<Handle>()) });
    }
}

/// # Safety
/// `instance` is one of ours.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: *mut c_void,
    _tolerance_defined: bool,
    _tolerance: f64,
    start_time_s: f64,
    _stop_time_defined: bool,
    _stop_time_s: f64,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe { with(instance, |own| own.enter_initialization(start_time_s)) }
}

/// Functions that only go on to another mode.
macro_rules! modes {
    ($($function:ident => $method:expr),* $(,)?) => { $(
        /// # Safety
        /// `instance` is one of ours.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(instance: *mut c_void) -> i32 {
            // SAFETY: the caller's promise.
            unsafe { with(instance, $method) }
        }
    )* };
}
modes! {
    fmi3ExitInitializationMode => Instance::exit_initialization,
    fmi3Terminate => Instance::terminate,
    fmi3Reset => |own| { own.reset(); Ok(()) },
}

/// Reading and writing of the two types that we have; both have eight bytes, and bits are what is kept.
macro_rules! variables {
    ($($get:ident, $set:ident: $type:ty as $kind:ident),* $(,)?) => { $(
        /// # Safety
        /// `instance` is one of ours; the arrays have the said lengths.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            instance: *mut c_void,
            references: *const u32,
            reference_count: usize,
            values: *mut $type,
            value_count: usize,
        ) -> i32 {
            // SAFETY: the caller's promise; every bit pattern of eight bytes is a value of both types.
            unsafe {
                with(instance, |own| {
                    refuse_lengths(reference_count, value_count)?;
                    own.get(slice(references, reference_count)?, FieldKind::$kind, slice_mut(values.cast(), value_count)?)
                })
            }
        }

        /// # Safety
        /// `instance` is one of ours; the arrays have the said lengths.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            instance: *mut c_void,
            references: *const u32,
            reference_count: usize,
            values: *const $type,
            value_count: usize,
        ) -> i32 {
            // SAFETY: the caller's promise; every bit pattern of eight bytes is a value of both types.
            unsafe {
                with(instance, |own| {
                    refuse_lengths(reference_count, value_count)?;
                    own.set(slice(references, reference_count)?, FieldKind::$kind, slice(values.cast(), value_count)?)
                })
            }
        }
    )* };
}
variables! {
    fmi3GetFloat64, fmi3SetFloat64: f64 as F64,
    fmi3GetUInt64, fmi3SetUInt64: u64 as U64,
}

fn refuse_lengths(references: usize, values: usize) -> Result<(), Refusal> {
    if references == values {
        return Ok(());
    }
    Err(Refusal::new(format!(
        "{references} value references have {values} values: each of our variables has one"
    )))
}

/// # Safety
/// `instance` is one of ours; the others are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: *mut c_void,
    point_s: f64,
    step_s: f64,
    _no_way_back: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    reached_s: *mut f64,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        for flag in [event, terminate, early] {
            put(flag, false);
        }
        with(instance, |own| {
            put(reached_s, own.time_s());
            put(reached_s, own.step(point_s, step_s)?);
            Ok(())
        })
    }
}

/// # Safety
/// `instance` is one of ours, `state` points to null or to a state of ours.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: *mut c_void, state: *mut *mut c_void) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |own| {
            let place = state.as_mut().ok_or_else(no_state)?;
            match place.cast::<State>().as_mut() {
                // FMI: a state that is there already is overwritten.
                Some(kept) => *kept = own.state.clone(),
                None => *place = Box::into_raw(Box::new(own.state.clone())).cast(),
            }
            Ok(())
        })
    }
}

/// # Safety
/// `instance` is one of ours, `state` is null or a state of an instance of the same FMU.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(instance: *mut c_void, state: *mut c_void) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |own| {
            own.state = state.cast::<State>().as_ref().ok_or_else(no_state)?.clone();
            Ok(())
        })
    }
}

/// # Safety
/// `instance` is one of ours, `state` is null or points to null or to a state of ours.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(instance: *mut c_void, state: *mut *mut c_void) -> i32 {
    // SAFETY: the caller's promise; made by `Box::into_raw`, and set to null with its end.
    unsafe {
        with(instance, |_| {
            if let Some(place) = state.as_mut().filter(|place| !place.is_null()) {
                drop(Box::from_raw(place.cast::<State>()));
                *place = std::ptr::null_mut();
            }
            Ok(())
        })
    }
}

fn no_state() -> Refusal {
    Refusal::new("the FMU state is null")
}
