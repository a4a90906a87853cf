//! The rest of FMI's functions: every library must have them all, and ours refuse what the description does not offer.
//!
//! Their arguments are not looked at, so they need not be named: a C caller passes what it likes.

use crate::boundary::with;
use crate::refusal::Refusal;
use std::ffi::c_void;

macro_rules! refused {
    ($what:literal: $($function:ident),* $(,)?) => { $(
        /// # Safety
        /// `instance` is null or one of ours.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $function(instance: *mut c_void) -> i32 {
            // SAFETY: the caller's promise.
            unsafe { with(instance, |_| Err(Refusal::new(concat!(stringify!($function), ": this FMU has no ", $what)))) }
        }
    )* };
}

refused! { "variables of this type, only Float64 and UInt64":
    fmi3GetFloat32, fmi3GetInt8, fmi3GetUInt8, fmi3GetInt16, fmi3GetUInt16, fmi3GetInt32, fmi3GetUInt32, fmi3GetInt64,
    fmi3GetBoolean, fmi3GetString, fmi3GetBinary, fmi3GetClock,
    fmi3SetFloat32, fmi3SetInt8, fmi3SetUInt8, fmi3SetInt16, fmi3SetUInt16, fmi3SetInt32, fmi3SetUInt32, fmi3SetInt64,
    fmi3SetBoolean, fmi3SetString, fmi3SetBinary, fmi3SetClock,
}
refused! { "dependencies that change":
    fmi3GetNumberOfVariableDependencies, fmi3GetVariableDependencies,
}
refused! { "states as bytes":
    fmi3SerializedFMUStateSize, fmi3SerializeFMUState, fmi3DeserializeFMUState,
}
refused! { "derivatives":
    fmi3GetDirectionalDerivative, fmi3GetAdjointDerivative, fmi3GetOutputDerivatives,
}
refused! { "configuration mode":
    fmi3EnterConfigurationMode, fmi3ExitConfigurationMode,
}
refused! { "clocks":
    fmi3GetIntervalDecimal, fmi3GetIntervalFraction, fmi3GetShiftDecimal, fmi3GetShiftFraction,
    fmi3SetIntervalDecimal, fmi3SetIntervalFraction, fmi3SetShiftDecimal, fmi3SetShiftFraction, fmi3ActivateModelPartition,
}
refused! { "event mode":
    fmi3EnterEventMode, fmi3EnterStepMode, fmi3EvaluateDiscreteStates, fmi3UpdateDiscreteStates,
}
refused! { "model exchange":
    fmi3EnterContinuousTimeMode, fmi3CompletedIntegratorStep, fmi3SetTime, fmi3SetContinuousStates,
    fmi3GetContinuousStateDerivatives, fmi3GetEventIndicators, fmi3GetContinuousStates,
    fmi3GetNominalsOfContinuousStates, fmi3GetNumberOfEventIndicators, fmi3GetNumberOfContinuousStates,
}

/// Null: these FMUs are for co-simulation.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange() -> *mut c_void {
    std::ptr::null_mut()
}

/// Null: these FMUs are for co-simulation.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution() -> *mut c_void {
    std::ptr::null_mut()
}
