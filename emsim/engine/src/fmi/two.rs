//! FMI 2.0. (Standard: fmi-standard.org, version 2.0.5.)
use super::{category, Log, OK};
use super::{
    free, free_state, get, instantiate, keep_state, path_of, put, put_state, set, slice, slice_mut, text_at, with,
    ERROR,
};
use std::ffi::{c_char, c_int, c_void, CStr};

type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);

#[repr(C)]
pub struct Callbacks {
    logger: Option<Logger>,
    allocate: *const c_void,
    free: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

const DISCARD: c_int = 2;

/// fmi2EventInfo
#[repr(C)]
pub struct EventInfo {
    again: c_int,
    terminate: c_int,
    nominals_changed: c_int,
    states_changed: c_int,
    has_next: c_int,
    next: f64,
}

#[no_mangle]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[no_mangle]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// # Safety
/// As FMI demands; so of all that follow.
#[no_mangle]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    token: *const c_char,
    resources: *const c_char,
    functions: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut c_void {
    let (logger, environment) = functions.as_ref().map_or((None, std::ptr::null_mut()), |f| (f.logger, f.environment));
    let log: Log = Box::new(move |name: &CStr, status, text: &CStr| {
        if let Some(logger) = logger {
            // the message is a format
            let text = super::c_text(&text.to_string_lossy().replace('%', "%%"));
            logger(environment, name.as_ptr(), status, category(status).as_ptr(), text.as_ptr());
        }
    });
    let name = text_at(name).unwrap_or("");
    // fmi2Type: 0 model exchange, 1 co-simulation
    if kind != 0 && kind != 1 {
        log(&super::c_text(name), ERROR, c"there are FMUs for model exchange and for co-simulation");
        return std::ptr::null_mut();
    }
    instantiate(name, text_at(token).unwrap_or(""), text_at(resources).map(path_of), kind == 0, log)
}

#[no_mangle]
pub unsafe extern "C" fn fmi2FreeInstance(c: *mut c_void) {
    free(c);
}

of_component! {
    fmi2SetDebugLogging: |_| Ok(());
    fmi2SetupExperiment: |c, has_tolerance: c_int, tolerance: f64, start: f64, has_stop: c_int, stop: f64| {
        c.instance.set_up(start, (has_stop != 0).then_some(stop), (has_tolerance != 0).then_some(tolerance))
    };
    fmi2EnterInitializationMode: |c| c.instance.enter_initialisation();
    fmi2ExitInitializationMode: |c| c.instance.exit_initialisation();
    fmi2Terminate: |c| c.instance.terminate();
    fmi2Reset: |c| {
        c.instance.reset();
        Ok(())
    };
    fmi2GetReal: |c, vr: *const u32, n: usize, values: *mut f64| get(c, slice(vr, n), slice_mut(values, n));
    fmi2SetReal: |c, vr: *const u32, n: usize, values: *const f64| set(c, slice(vr, n), slice(values, n));
    fmi2SetRealInputDerivatives: |c, vr: *const u32, n: usize, orders: *const c_int, values: *const f64| {
        for ((&vr, &order), &value) in slice(vr, n).iter().zip(slice(orders, n)).zip(slice(values, n)) {
            match order {
                1 => c.instance.set_slope(vr, value)?,
                // a line is what it is interpolated by
                _ if value == 0.0 => {}
                _ => return Err(format!("inputs are straight lines: there is no derivative of order {order}")),
            }
        }
        Ok(())
    };
    fmi2DoStep: |c, t: f64, h: f64, _no_return: c_int| c.instance.step(t, h);
    fmi2SetTime: |c, t: f64| c.instance.put_time(t);
    fmi2SetContinuousStates: |c, x: *const f64, n: usize| c.instance.put_states(slice(x, n));
    fmi2GetContinuousStates: |c, x: *mut f64, n: usize| c.instance.get_states(slice_mut(x, n));
    fmi2GetNominalsOfContinuousStates: |c, x: *mut f64, n: usize| c.instance.nominals(slice_mut(x, n));
    fmi2GetDerivatives: |c, rates: *mut f64, n: usize| c.instance.rates(slice_mut(rates, n));
    fmi2GetEventIndicators: |c, z: *mut f64, n: usize| c.instance.event_indicators(slice_mut(z, n));
    fmi2CompletedIntegratorStep: |c, _no_return: c_int, event: *mut c_int, terminate: *mut c_int| {
        put(terminate, 0);
        c.instance.completed_step().map(|asks| put(event, c_int::from(asks)))
    };
    fmi2EnterEventMode: |c| c.instance.enter_event_mode();
    fmi2EnterContinuousTimeMode: |c| c.instance.enter_continuous_time_mode();
    fmi2NewDiscreteStates: |c, info: *mut EventInfo| {
        let update = c.instance.update_discrete_states()?;
        put(info, EventInfo {
            again: 0,
            terminate: 0,
            nominals_changed: 0,
            states_changed: c_int::from(update.states_changed),
            has_next: c_int::from(update.next_event.is_some()),
            next: update.next_event.unwrap_or(0.0),
        });
        Ok(())
    };
    fmi2GetDirectionalDerivative: |c, of: *const u32, n: usize, by: *const u32, m: usize, seed: *const f64, out: *mut f64| {
        c.instance.directional(slice(of, n), slice(by, m), slice(seed, m), slice_mut(out, n))
    };
    fmi2GetFMUstate: |c, state: *mut *mut c_void| keep_state(c, state);
    fmi2SetFMUstate: |c, state: *mut c_void| put_state(c, state);
    /// All that there is to say: steps end as they are asked to, or fail.
    fmi2GetRealStatus: |c, _kind: c_int, value: *mut f64| {
        put(value, c.instance.time());
        Ok(())
    };
    fmi2GetBooleanStatus: |_, _kind: c_int, value: *mut c_int| {
        put(value, 0);
        Ok(())
    };
}

#[no_mangle]
pub unsafe extern "C" fn fmi2FreeFMUstate(_c: *mut c_void, state: *mut *mut c_void) -> c_int {
    free_state(state);
    OK
}

/// Steps are done when they return: nothing is pending.
macro_rules! never_pending {
    ($($name:ident)*) => {$(
        #[no_mangle]
        pub extern "C" fn $name() -> c_int {
            DISCARD
        }
    )*};
}
never_pending!(fmi2GetStatus fmi2GetIntegerStatus fmi2GetStringStatus fmi2CancelStep);

// variables of other types
no_variables!("real": fmi2GetInteger fmi2GetBoolean fmi2GetString fmi2SetInteger fmi2SetBoolean fmi2SetString);
no_variables!("real": fmi2GetRealOutputDerivatives);

refused!(fmi2SerializedFMUstateSize fmi2SerializeFMUstate fmi2DeSerializeFMUstate);
