//! FMI 2.0: truth values are integers, the experiment is set up apart, resources come as a URI.
use super::crash::{guarded, Scene};
use super::library::{call, done, failed, freed, functions, open};
use super::log::{self, Journal, Status};
use super::{rounded, runs, Calls, Handle, Kind, Spec, Stepped, Updated, Variable};
use std::ffi::{c_char, c_int, c_void, CStr, CString};
use std::ptr::{null, null_mut};
use std::sync::Arc;

type C = *mut c_void;

#[repr(C)]
struct Callbacks {
    logger: *const c_void,
    allocate: unsafe extern "C" fn(usize, usize) -> C,
    free: unsafe extern "C" fn(C),
    finished: *const c_void,
    environment: C,
}

#[repr(C)]
#[derive(Default)]
struct EventInfo {
    again: c_int,
    ends: c_int,
    nominals: c_int,
    values: c_int,
    has_next: c_int,
    next: f64,
}

functions! {
    Table {
        instantiate = "fmi2Instantiate" (*const c_char, c_int, *const c_char, *const c_char, *const Callbacks, c_int, c_int) -> C;
        free = "fmi2FreeInstance" (C);
        terminate = "fmi2Terminate" (C) -> c_int;
        setup = "fmi2SetupExperiment" (C, c_int, f64, f64, c_int, f64) -> c_int;
        enter_initialisation = "fmi2EnterInitializationMode" (C) -> c_int;
        exit_initialisation = "fmi2ExitInitializationMode" (C) -> c_int;
        get_real = "fmi2GetReal" (C, *const u32, usize, *mut f64) -> c_int;
        get_integer = "fmi2GetInteger" (C, *const u32, usize, *mut c_int) -> c_int;
        get_boolean = "fmi2GetBoolean" (C, *const u32, usize, *mut c_int) -> c_int;
        set_real = "fmi2SetReal" (C, *const u32, usize, *const f64) -> c_int;
        set_integer = "fmi2SetInteger" (C, *const u32, usize, *const c_int) -> c_int;
        set_boolean = "fmi2SetBoolean" (C, *const u32, usize, *const c_int) -> c_int;
        set_string = "fmi2SetString" (C, *const u32, usize, *const *const c_char) -> c_int;
        get_state = "fmi2GetFMUstate" (C, *mut C) -> c_int;
        set_state = "fmi2SetFMUstate" (C, C) -> c_int;
        free_state = "fmi2FreeFMUstate" (C, *mut C) -> c_int;
        directional = "fmi2GetDirectionalDerivative" (C, *const u32, usize, *const u32, usize, *const f64, *mut f64) -> c_int;
        step = "fmi2DoStep" (C, f64, f64, c_int) -> c_int;
        real_status = "fmi2GetRealStatus" (C, c_int, *mut f64) -> c_int;
        boolean_status = "fmi2GetBooleanStatus" (C, c_int, *mut c_int) -> c_int;
        enter_event = "fmi2EnterEventMode" (C) -> c_int;
        update = "fmi2NewDiscreteStates" (C, *mut EventInfo) -> c_int;
        enter_continuous = "fmi2EnterContinuousTimeMode" (C) -> c_int;
        completed = "fmi2CompletedIntegratorStep" (C, c_int, *mut c_int, *mut c_int) -> c_int;
        set_time = "fmi2SetTime" (C, f64) -> c_int;
        set_states = "fmi2SetContinuousStates" (C, *const f64, usize) -> c_int;
        get_states = "fmi2GetContinuousStates" (C, *mut f64, usize) -> c_int;
        derivatives = "fmi2GetDerivatives" (C, *mut f64, usize) -> c_int;
        indicators = "fmi2GetEventIndicators" (C, *mut f64, usize) -> c_int;
    }
}

pub struct Instance {
    component: C,
    functions: Table,
    /// the error behind which it is not called
    over: Option<Status>,
    scene: Scene,
    journal: Box<Journal>,
    spec: Arc<Spec>,
    begun: bool,
    // what the library points to until the instance is gone, and the library itself, which goes last
    _callbacks: Box<Callbacks>,
    _library: libloading::Library,
}

// SAFETY: the instance is used by one thread at a time, as FMI demands
unsafe impl Send for Instance {}

impl Instance {
    pub fn new(spec: &Arc<Spec>) -> Result<Instance, String> {
        let library = open(spec)?;
        let functions = Table::new(&library);
        let journal = Journal::new(spec);
        let environment: *const Journal = &*journal;
        let callbacks = Box::new(Callbacks {
            logger: log::two as *const c_void,
            allocate: libc::calloc,
            free: libc::free,
            finished: null(),
            environment: environment.cast_mut().cast(),
        });
        let scene = Scene::new(spec);
        let text = |s: &str| CString::new(s).map_err(|_| "a name of it holds the letter 0".to_string());
        let (name, token, resources) = (text(&spec.card)?, text(&spec.token)?, text(&spec.resources)?);
        let made = functions.instantiate.ok_or("its library has no function fmi2Instantiate")?;
        // fmi2Type: 0 model exchange, 1 co-simulation
        let kind = c_int::from(!spec.exchange);
        // SAFETY: strings and callbacks live through the call, and the latter as long as the instance
        let component = guarded(&scene, c"fmi2Instantiate", || unsafe {
            made(name.as_ptr(), kind, token.as_ptr(), resources.as_ptr(), &*callbacks, 0, c_int::from(spec.logs))
        });
        if component.is_null() {
            return Err(failed(c"fmi2Instantiate", Status::Error, &journal.reason()));
        }
        Ok(Instance {
            component,
            functions,
            over: None,
            scene,
            journal,
            spec: spec.clone(),
            begun: false,
            _callbacks: callbacks,
            _library: library,
        })
    }

    fn judged(&mut self, function: &CStr, status: c_int) -> Result<(), String> {
        let status = Status::of(status);
        if status <= Status::Warning {
            return Ok(());
        }
        // after an error it may be freed, and no more; after a fatal one not even that; what is discarded may be asked at another point
        self.begun &= status == Status::Discard;
        self.over = (status != Status::Discard).then_some(status);
        Err(failed(function, status, &self.journal.reason()))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if self.begun {
            let _ = call!(self, terminate, c"fmi2Terminate");
        }
        freed!(self, free, c"fmi2FreeInstance");
    }
}

impl Calls for Instance {
    fn set(&mut self, variables: &[Variable], values: &[f64]) -> Result<(), String> {
        for run in runs(variables) {
            let references: Vec<u32> = variables[run.clone()].iter().map(|v| v.reference).collect();
            let (vr, n, values) = (references.as_ptr(), references.len(), &values[run.clone()]);
            match variables[run.start].kind {
                Kind::Float64 => done!(self, set_real, c"fmi2SetReal", vr, n, values.as_ptr())?,
                Kind::Boolean => {
                    let whole: Vec<c_int> = values.iter().map(|&v| c_int::from(v > 0.5)).collect();
                    done!(self, set_boolean, c"fmi2SetBoolean", vr, n, whole.as_ptr())?;
                }
                _ => {
                    let whole: Vec<c_int> = values.iter().map(|&v| rounded!(c_int, v)).collect();
                    done!(self, set_integer, c"fmi2SetInteger", vr, n, whole.as_ptr())?;
                }
            }
        }
        Ok(())
    }

    fn set_text(&mut self, reference: u32, text: &str) -> Result<(), String> {
        let text = CString::new(text).map_err(|_| "a text with the letter 0".to_string())?;
        done!(self, set_string, c"fmi2SetString", &reference, 1, &text.as_ptr())
    }

    fn get(&mut self, variables: &[Variable], values: &mut [f64]) -> Result<(), String> {
        for run in runs(variables) {
            let references: Vec<u32> = variables[run.clone()].iter().map(|v| v.reference).collect();
            let (vr, n, kind) = (references.as_ptr(), references.len(), variables[run.start].kind);
            let values = &mut values[run];
            if kind == Kind::Float64 {
                done!(self, get_real, c"fmi2GetReal", vr, n, values.as_mut_ptr())?;
                continue;
            }
            let mut whole: Vec<c_int> = vec![0; n];
            match kind {
                Kind::Boolean => done!(self, get_boolean, c"fmi2GetBoolean", vr, n, whole.as_mut_ptr())?,
                _ => done!(self, get_integer, c"fmi2GetInteger", vr, n, whole.as_mut_ptr())?,
            }
            // (in C any number but 0 is true)
            let number = |whole: c_int| if kind == Kind::Boolean { c_int::from(whole != 0) } else { whole };
            values.iter_mut().zip(whole).for_each(|(value, whole)| *value = f64::from(number(whole)));
        }
        Ok(())
    }

    fn enter_initialisation(&mut self, t: f64) -> Result<(), String> {
        let (tolerance, stop) = (self.spec.tolerance, self.spec.stop);
        let (has, near) = (c_int::from(tolerance.is_some()), tolerance.unwrap_or(0.0));
        let (has_stop, stop) = (c_int::from(stop.is_finite()), if stop.is_finite() { stop } else { 0.0 });
        done!(self, setup, c"fmi2SetupExperiment", has, near, t, has_stop, stop)?;
        done!(self, enter_initialisation, c"fmi2EnterInitializationMode")
    }

    fn exit_initialisation(&mut self) -> Result<(), String> {
        done!(self, exit_initialisation, c"fmi2ExitInitializationMode")?;
        self.begun = true;
        Ok(())
    }

    fn step(&mut self, t: f64, h: f64) -> Result<Stepped, String> {
        let status = call!(self, step, c"fmi2DoStep", t, h, c_int::from(!self.spec.returns))?;
        if Status::of(status) != Status::Discard {
            return self.judged(c"fmi2DoStep", status).map(|()| Stepped::default());
        }
        // fmi2StatusKind: 2 the last time that was reached, 3 whether it has ended
        let (mut until, mut ends) = (t, 0);
        let _ = call!(self, real_status, c"fmi2GetRealStatus", 2, &mut until);
        let _ = call!(self, boolean_status, c"fmi2GetBooleanStatus", 3, &mut ends);
        Ok(Stepped { until: Some(until), ends: ends != 0 })
    }

    fn keep(&mut self) -> Result<Handle, String> {
        let mut state = null_mut();
        done!(self, get_state, c"fmi2GetFMUstate", &mut state)?;
        Ok(Handle(state))
    }

    fn put_back(&mut self, state: Handle) -> Result<(), String> {
        done!(self, set_state, c"fmi2SetFMUstate", state.0)
    }

    fn release(&mut self, mut state: Handle) {
        freed!(self, free_state, c"fmi2FreeFMUstate", &mut state.0);
    }

    fn is_over(&self) -> bool {
        self.over.is_some()
    }

    fn set_time(&mut self, t: f64) -> Result<(), String> {
        done!(self, set_time, c"fmi2SetTime", t)
    }

    fn set_states(&mut self, x: &[f64]) -> Result<(), String> {
        done!(self, set_states, c"fmi2SetContinuousStates", x.as_ptr(), x.len())
    }

    fn states(&mut self, x: &mut [f64]) -> Result<(), String> {
        done!(self, get_states, c"fmi2GetContinuousStates", x.as_mut_ptr(), x.len())
    }

    fn derivatives(&mut self, dx: &mut [f64]) -> Result<(), String> {
        done!(self, derivatives, c"fmi2GetDerivatives", dx.as_mut_ptr(), dx.len())
    }

    fn indicators(&mut self, z: &mut [f64]) -> Result<(), String> {
        done!(self, indicators, c"fmi2GetEventIndicators", z.as_mut_ptr(), z.len())
    }

    fn completed(&mut self) -> Result<(bool, bool), String> {
        let (mut event, mut ends) = (0, 0);
        done!(self, completed, c"fmi2CompletedIntegratorStep", 0, &mut event, &mut ends)?;
        Ok((event != 0, ends != 0))
    }

    fn enter_event(&mut self) -> Result<(), String> {
        done!(self, enter_event, c"fmi2EnterEventMode")
    }

    fn update(&mut self) -> Result<Updated, String> {
        let mut info = EventInfo::default();
        done!(self, update, c"fmi2NewDiscreteStates", &mut info)?;
        let next = (info.has_next != 0).then_some(info.next);
        Ok(Updated { again: info.again != 0, ends: info.ends != 0, moved: info.values != 0, next })
    }

    fn enter_continuous(&mut self) -> Result<(), String> {
        done!(self, enter_continuous, c"fmi2EnterContinuousTimeMode")
    }

    fn directional(&mut self, unknowns: &[u32], known: u32, out: &mut [f64]) -> Result<(), String> {
        let (vr, n, seed) = (unknowns.as_ptr(), unknowns.len(), 1.0);
        done!(self, directional, c"fmi2GetDirectionalDerivative", vr, n, &known, 1, &seed, out.as_mut_ptr())
    }
}
