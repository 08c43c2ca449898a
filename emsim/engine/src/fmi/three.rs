//! FMI 3.0. (Standard: fmi-standard.org, version 3.0.2.) Truth values are bytes.
use super::{category, Log, ERROR, OK};
use super::{free, free_state, get, instantiate, keep_state, put, put_state, set, slice, slice_mut, text_at, with};
use std::ffi::{c_char, c_int, c_void, CStr};
use std::path::PathBuf;

type Logger = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

#[no_mangle]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

fn logging(logger: Option<Logger>, environment: *mut c_void) -> Log {
    Box::new(move |_: &CStr, status, text: &CStr| {
        if let Some(logger) = logger {
            // SAFETY: the caller's function, with its own environment
            unsafe { logger(environment, status, category(status).as_ptr(), text.as_ptr()) };
        }
    })
}

/// # Safety
/// As FMI demands; so of all that follow.
#[no_mangle]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: u8,
    _logging: u8,
    event_mode: u8,
    _early_return: u8,
    _intermediate: *const u32,
    _n: usize,
    environment: *mut c_void,
    logger: Option<Logger>,
    _update: *const c_void,
) -> *mut c_void {
    let log = logging(logger, environment);
    let name = text_at(name).unwrap_or("");
    if event_mode != 0 {
        log(&super::c_text(name), ERROR, c"this FMU has no event mode: events are found within its steps");
        return std::ptr::null_mut();
    }
    instantiate(name, text_at(token).unwrap_or(""), text_at(resources).map(PathBuf::from), false, log)
}

#[no_mangle]
pub unsafe extern "C" fn fmi3InstantiateModelExchange(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: u8,
    _logging: u8,
    environment: *mut c_void,
    logger: Option<Logger>,
) -> *mut c_void {
    let (log, folder) = (logging(logger, environment), text_at(resources).map(PathBuf::from));
    instantiate(text_at(name).unwrap_or(""), text_at(token).unwrap_or(""), folder, true, log)
}

#[no_mangle]
pub extern "C" fn fmi3InstantiateScheduledExecution() -> *mut c_void {
    std::ptr::null_mut()
}

#[no_mangle]
pub unsafe extern "C" fn fmi3FreeInstance(c: *mut c_void) {
    free(c);
}

of_component! {
    fmi3SetDebugLogging: |_| Ok(());
    fmi3EnterInitializationMode: |c, has_tolerance: u8, tolerance: f64, start: f64, has_stop: u8, stop: f64| {
        c.instance.set_up(start, (has_stop != 0).then_some(stop), (has_tolerance != 0).then_some(tolerance))?;
        c.instance.enter_initialisation()
    };
    fmi3ExitInitializationMode: |c| c.instance.exit_initialisation();
    fmi3Terminate: |c| c.instance.terminate();
    fmi3Reset: |c| {
        c.instance.reset();
        Ok(())
    };
    fmi3GetFloat64: |c, vr: *const u32, n: usize, values: *mut f64, room: usize| get(c, slice(vr, n), slice_mut(values, room));
    fmi3SetFloat64: |c, vr: *const u32, n: usize, values: *const f64, given: usize| set(c, slice(vr, n), slice(values, given));
    fmi3DoStep: |c, t: f64, h: f64, _no_return: u8, event: *mut u8, terminate: *mut u8, early: *mut u8, last: *mut f64| {
        for flag in [event, terminate, early] {
            put(flag, 0);
        }
        let done = c.instance.step(t, h);
        put(last, c.instance.time());
        done
    };
    fmi3SetTime: |c, t: f64| c.instance.put_time(t);
    fmi3SetContinuousStates: |c, x: *const f64, n: usize| c.instance.put_states(slice(x, n));
    fmi3GetContinuousStates: |c, x: *mut f64, n: usize| c.instance.get_states(slice_mut(x, n));
    fmi3GetNominalsOfContinuousStates: |c, x: *mut f64, n: usize| c.instance.nominals(slice_mut(x, n));
    fmi3GetContinuousStateDerivatives: |c, rates: *mut f64, n: usize| c.instance.rates(slice_mut(rates, n));
    fmi3GetEventIndicators: |c, z: *mut f64, n: usize| c.instance.event_indicators(slice_mut(z, n));
    fmi3GetNumberOfEventIndicators: |c, n: *mut usize| {
        put(n, c.instance.indicators());
        Ok(())
    };
    fmi3GetNumberOfContinuousStates: |c, n: *mut usize| {
        put(n, c.instance.states());
        Ok(())
    };
    fmi3CompletedIntegratorStep: |c, _no_return: u8, event: *mut u8, terminate: *mut u8| {
        put(terminate, 0);
        c.instance.completed_step().map(|asks| put(event, u8::from(asks)))
    };
    fmi3EnterEventMode: |c| c.instance.enter_event_mode();
    fmi3EnterContinuousTimeMode: |c| c.instance.enter_continuous_time_mode();
    fmi3UpdateDiscreteStates: |c, again: *mut u8, end: *mut u8, nominals: *mut u8, states: *mut u8, has: *mut u8, next: *mut f64| {
        let update = c.instance.update_discrete_states()?;
        for flag in [again, end, nominals] {
            put(flag, 0);
        }
        put(states, u8::from(update.states_changed));
        put(has, u8::from(update.next_event.is_some()));
        put(next, update.next_event.unwrap_or(0.0));
        Ok(())
    };
    fmi3GetDirectionalDerivative: |c, of: *const u32, n: usize, by: *const u32, m: usize, seed: *const f64, k: usize, out: *mut f64, room: usize| {
        c.instance.directional(slice(of, n), slice(by, m), slice(seed, k), slice_mut(out, room))
    };
    fmi3GetFMUState: |c, state: *mut *mut c_void| keep_state(c, state);
    fmi3SetFMUState: |c, state: *mut c_void| put_state(c, state);
}

#[no_mangle]
pub unsafe extern "C" fn fmi3FreeFMUState(_c: *mut c_void, state: *mut *mut c_void) -> c_int {
    free_state(state);
    OK
}

// variables of other types
no_variables!("Float64": fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetInt32 fmi3GetUInt32 fmi3GetInt64);
no_variables!("Float64": fmi3GetUInt64 fmi3GetBoolean fmi3GetString fmi3GetBinary fmi3GetClock);
no_variables!("Float64": fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16 fmi3SetUInt16 fmi3SetInt32 fmi3SetUInt32 fmi3SetInt64);
no_variables!("Float64": fmi3SetUInt64 fmi3SetBoolean fmi3SetString fmi3SetBinary fmi3SetClock);
no_variables!("Float64": fmi3GetOutputDerivatives fmi3GetIntervalDecimal fmi3GetIntervalFraction fmi3GetShiftDecimal);
no_variables!("Float64": fmi3GetShiftFraction fmi3SetIntervalDecimal fmi3SetIntervalFraction fmi3SetShiftDecimal fmi3SetShiftFraction);

refused!(fmi3EnterStepMode fmi3EnterConfigurationMode fmi3ExitConfigurationMode fmi3EvaluateDiscreteStates);
refused!(fmi3GetNumberOfVariableDependencies fmi3GetVariableDependencies fmi3GetAdjointDerivative fmi3ActivateModelPartition);
refused!(fmi3SerializedFMUStateSize fmi3SerializeFMUState fmi3DeserializeFMUState);
