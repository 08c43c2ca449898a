//! FMI 3.0: truth values are bytes, a function for each type of variables, resources come as a path.
use super::crash::{guarded, Scene};
use super::library::{call, done, failed, freed, functions, open};
use super::log::{self, Journal, Status};
use super::{rounded, runs, Calls, Handle, Kind, Spec, Stepped, Updated, Variable};
use std::ffi::{c_char, c_int, c_void, CStr, CString};
use std::ptr::{null, null_mut};
use std::sync::Arc;

type C = *mut c_void;
type Logger = unsafe extern "C" fn(C, c_int, *const c_char, *const c_char);

functions! {
    Table {
        couple = "fmi3InstantiateCoSimulation"
            (*const c_char, *const c_char, *const c_char, u8, u8, u8, u8, *const u32, usize, C, Logger, *const c_void) -> C;
        exchange = "fmi3InstantiateModelExchange" (*const c_char, *const c_char, *const c_char, u8, u8, C, Logger) -> C;
        free = "fmi3FreeInstance" (C);
        terminate = "fmi3Terminate" (C) -> c_int;
        enter_initialisation = "fmi3EnterInitializationMode" (C, u8, f64, f64, u8, f64) -> c_int;
        exit_initialisation = "fmi3ExitInitializationMode" (C) -> c_int;
        get_float64 = "fmi3GetFloat64" (C, *const u32, usize, *mut f64, usize) -> c_int;
        get_float32 = "fmi3GetFloat32" (C, *const u32, usize, *mut f32, usize) -> c_int;
        get_int8 = "fmi3GetInt8" (C, *const u32, usize, *mut i8, usize) -> c_int;
        get_uint8 = "fmi3GetUInt8" (C, *const u32, usize, *mut u8, usize) -> c_int;
        get_int16 = "fmi3GetInt16" (C, *const u32, usize, *mut i16, usize) -> c_int;
        get_uint16 = "fmi3GetUInt16" (C, *const u32, usize, *mut u16, usize) -> c_int;
        get_int32 = "fmi3GetInt32" (C, *const u32, usize, *mut i32, usize) -> c_int;
        get_uint32 = "fmi3GetUInt32" (C, *const u32, usize, *mut u32, usize) -> c_int;
        get_int64 = "fmi3GetInt64" (C, *const u32, usize, *mut i64, usize) -> c_int;
        get_uint64 = "fmi3GetUInt64" (C, *const u32, usize, *mut u64, usize) -> c_int;
        get_boolean = "fmi3GetBoolean" (C, *const u32, usize, *mut u8, usize) -> c_int;
        set_float64 = "fmi3SetFloat64" (C, *const u32, usize, *const f64, usize) -> c_int;
        set_float32 = "fmi3SetFloat32" (C, *const u32, usize, *const f32, usize) -> c_int;
        set_int8 = "fmi3SetInt8" (C, *const u32, usize, *const i8, usize) -> c_int;
        set_uint8 = "fmi3SetUInt8" (C, *const u32, usize, *const u8, usize) -> c_int;
        set_int16 = "fmi3SetInt16" (C, *const u32, usize, *const i16, usize) -> c_int;
        set_uint16 = "fmi3SetUInt16" (C, *const u32, usize, *const u16, usize) -> c_int;
        set_int32 = "fmi3SetInt32" (C, *const u32, usize, *const i32, usize) -> c_int;
        set_uint32 = "fmi3SetUInt32" (C, *const u32, usize, *const u32, usize) -> c_int;
        set_int64 = "fmi3SetInt64" (C, *const u32, usize, *const i64, usize) -> c_int;
        set_uint64 = "fmi3SetUInt64" (C, *const u32, usize, *const u64, usize) -> c_int;
        set_boolean = "fmi3SetBoolean" (C, *const u32, usize, *const u8, usize) -> c_int;
        set_string = "fmi3SetString" (C, *const u32, usize, *const *const c_char, usize) -> c_int;
        get_state = "fmi3GetFMUState" (C, *mut C) -> c_int;
        set_state = "fmi3SetFMUState" (C, C) -> c_int;
        free_state = "fmi3FreeFMUState" (C, *mut C) -> c_int;
        directional = "fmi3GetDirectionalDerivative"
            (C, *const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize) -> c_int;
        step = "fmi3DoStep" (C, f64, f64, u8, *mut u8, *mut u8, *mut u8, *mut f64) -> c_int;
        enter_event = "fmi3EnterEventMode" (C) -> c_int;
        update = "fmi3UpdateDiscreteStates" (C, *mut u8, *mut u8, *mut u8, *mut u8, *mut u8, *mut f64) -> c_int;
        enter_continuous = "fmi3EnterContinuousTimeMode" (C) -> c_int;
        completed = "fmi3CompletedIntegratorStep" (C, u8, *mut u8, *mut u8) -> c_int;
        set_time = "fmi3SetTime" (C, f64) -> c_int;
        set_states = "fmi3SetContinuousStates" (C, *const f64, usize) -> c_int;
        get_states = "fmi3GetContinuousStates" (C, *mut f64, usize) -> c_int;
        derivatives = "fmi3GetContinuousStateDerivatives" (C, *mut f64, usize) -> c_int;
        indicators = "fmi3GetEventIndicators" (C, *mut f64, usize) -> c_int;
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
    // it goes last
    _library: libloading::Library,
}

// SAFETY: the instance is used by one thread at a time, as FMI demands
unsafe impl Send for Instance {}

impl Instance {
    pub fn new(spec: &Arc<Spec>) -> Result<Instance, String> {
        let library = open(spec)?;
        let functions = Table::new(&library);
        let (journal, scene) = (Journal::new(spec), Scene::new(spec));
        let environment: *const Journal = &*journal;
        let environment: C = environment.cast_mut().cast();
        let text = |s: &str| CString::new(s).map_err(|_| "a name of it holds the letter 0".to_string());
        let (name, token, resources) = (text(&spec.card)?, text(&spec.token)?, text(&spec.resources)?);
        let (name, token, resources) = (name.as_ptr(), token.as_ptr(), resources.as_ptr());
        let (logs, function) = (u8::from(spec.logs), if spec.exchange { EXCHANGE } else { COUPLED });
        let missing = || format!("its library has no function {}", function.to_string_lossy());
        // SAFETY: the strings live through the call, the journal as long as the instance
        let component = if spec.exchange {
            let made = functions.exchange.ok_or_else(missing)?;
            guarded(&scene, function, || unsafe { made(name, token, resources, 0, logs, environment, log::three) })
        } else {
            let made = functions.couple.ok_or_else(missing)?;
            guarded(&scene, function, || unsafe {
                made(name, token, resources, 0, logs, 0, 0, null(), 0, environment, log::three, null())
            })
        };
        if component.is_null() {
            return Err(failed(function, Status::Error, &journal.reason()));
        }
        Ok(Instance {
            component,
            functions,
            over: None,
            scene,
            journal,
            spec: spec.clone(),
            begun: false,
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

const EXCHANGE: &CStr = c"fmi3InstantiateModelExchange";
const COUPLED: &CStr = c"fmi3InstantiateCoSimulation";

impl Drop for Instance {
    fn drop(&mut self) {
        if self.begun {
            let _ = call!(self, terminate, c"fmi3Terminate");
        }
        freed!(self, free, c"fmi3FreeInstance");
    }
}

impl Calls for Instance {
    fn set(&mut self, variables: &[Variable], values: &[f64]) -> Result<(), String> {
        for run in runs(variables) {
            let references: Vec<u32> = variables[run.clone()].iter().map(|v| v.reference).collect();
            let (vr, n, values) = (references.as_ptr(), references.len(), &values[run.clone()]);
            macro_rules! whole {
                ($field:ident, $name:literal, $type:ty) => {{
                    let whole: Vec<$type> = values.iter().map(|&v| rounded!($type, v)).collect();
                    done!(self, $field, $name, vr, n, whole.as_ptr(), n)?
                }};
            }
            match variables[run.start].kind {
                Kind::Float64 => done!(self, set_float64, c"fmi3SetFloat64", vr, n, values.as_ptr(), n)?,
                Kind::Float32 => {
                    let single: Vec<f32> = values.iter().map(|&v| v as f32).collect();
                    done!(self, set_float32, c"fmi3SetFloat32", vr, n, single.as_ptr(), n)?;
                }
                Kind::Boolean => {
                    let whole: Vec<u8> = values.iter().map(|&v| u8::from(v > 0.5)).collect();
                    done!(self, set_boolean, c"fmi3SetBoolean", vr, n, whole.as_ptr(), n)?;
                }
                Kind::Int8 => whole!(set_int8, c"fmi3SetInt8", i8),
                Kind::UInt8 => whole!(set_uint8, c"fmi3SetUInt8", u8),
                Kind::Int16 => whole!(set_int16, c"fmi3SetInt16", i16),
                Kind::UInt16 => whole!(set_uint16, c"fmi3SetUInt16", u16),
                Kind::Int32 => whole!(set_int32, c"fmi3SetInt32", i32),
                Kind::UInt32 => whole!(set_uint32, c"fmi3SetUInt32", u32),
                Kind::Int64 => whole!(set_int64, c"fmi3SetInt64", i64),
                Kind::UInt64 => whole!(set_uint64, c"fmi3SetUInt64", u64),
            }
        }
        Ok(())
    }

    fn set_text(&mut self, reference: u32, text: &str) -> Result<(), String> {
        let text = CString::new(text).map_err(|_| "a text with the letter 0".to_string())?;
        done!(self, set_string, c"fmi3SetString", &reference, 1, &text.as_ptr(), 1)
    }

    fn get(&mut self, variables: &[Variable], values: &mut [f64]) -> Result<(), String> {
        for run in runs(variables) {
            let references: Vec<u32> = variables[run.clone()].iter().map(|v| v.reference).collect();
            let (vr, n, kind) = (references.as_ptr(), references.len(), variables[run.start].kind);
            let values = &mut values[run];
            macro_rules! read {
                ($field:ident, $name:literal, $type:ty) => {{
                    let mut found: Vec<$type> = vec![Default::default(); n];
                    done!(self, $field, $name, vr, n, found.as_mut_ptr(), n)?;
                    values.iter_mut().zip(found).for_each(|(value, found)| *value = found as f64)
                }};
            }
            match kind {
                Kind::Float64 => done!(self, get_float64, c"fmi3GetFloat64", vr, n, values.as_mut_ptr(), n)?,
                Kind::Float32 => read!(get_float32, c"fmi3GetFloat32", f32),
                Kind::Boolean => read!(get_boolean, c"fmi3GetBoolean", u8),
                Kind::Int8 => read!(get_int8, c"fmi3GetInt8", i8),
                Kind::UInt8 => read!(get_uint8, c"fmi3GetUInt8", u8),
                Kind::Int16 => read!(get_int16, c"fmi3GetInt16", i16),
                Kind::UInt16 => read!(get_uint16, c"fmi3GetUInt16", u16),
                Kind::Int32 => read!(get_int32, c"fmi3GetInt32", i32),
                Kind::UInt32 => read!(get_uint32, c"fmi3GetUInt32", u32),
                Kind::Int64 => read!(get_int64, c"fmi3GetInt64", i64),
                Kind::UInt64 => read!(get_uint64, c"fmi3GetUInt64", u64),
            }
        }
        Ok(())
    }

    fn enter_initialisation(&mut self, t: f64) -> Result<(), String> {
        let (tolerance, stop) = (self.spec.tolerance, self.spec.stop);
        let (has, near) = (u8::from(tolerance.is_some()), tolerance.unwrap_or(0.0));
        let (has_stop, stop) = (u8::from(stop.is_finite()), if stop.is_finite() { stop } else { 0.0 });
        done!(self, enter_initialisation, c"fmi3EnterInitializationMode", has, near, t, has_stop, stop)
    }

    fn exit_initialisation(&mut self) -> Result<(), String> {
        done!(self, exit_initialisation, c"fmi3ExitInitializationMode")?;
        self.begun = true;
        Ok(())
    }

    fn step(&mut self, t: f64, h: f64) -> Result<Stepped, String> {
        let (mut event, mut ends, mut early, mut last) = (0, 0, 0, t);
        let stays = u8::from(!self.spec.returns);
        let status = call!(self, step, c"fmi3DoStep", t, h, stays, &mut event, &mut ends, &mut early, &mut last)?;
        if Status::of(status) == Status::Discard {
            return Ok(Stepped { until: Some(last), ends: ends != 0 });
        }
        self.judged(c"fmi3DoStep", status)?;
        Ok(Stepped { until: (early != 0).then_some(last), ends: ends != 0 })
    }

    fn keep(&mut self) -> Result<Handle, String> {
        let mut state = null_mut();
        done!(self, get_state, c"fmi3GetFMUState", &mut state)?;
        Ok(Handle(state))
    }

    fn put_back(&mut self, state: Handle) -> Result<(), String> {
        done!(self, set_state, c"fmi3SetFMUState", state.0)
    }

    fn release(&mut self, mut state: Handle) {
        freed!(self, free_state, c"fmi3FreeFMUState", &mut state.0);
    }

    fn is_over(&self) -> bool {
        self.over.is_some()
    }

    fn set_time(&mut self, t: f64) -> Result<(), String> {
        done!(self, set_time, c"fmi3SetTime", t)
    }

    fn set_states(&mut self, x: &[f64]) -> Result<(), String> {
        done!(self, set_states, c"fmi3SetContinuousStates", x.as_ptr(), x.len())
    }

    fn states(&mut self, x: &mut [f64]) -> Result<(), String> {
        done!(self, get_states, c"fmi3GetContinuousStates", x.as_mut_ptr(), x.len())
    }

    fn derivatives(&mut self, dx: &mut [f64]) -> Result<(), String> {
        done!(self, derivatives, c"fmi3GetContinuousStateDerivatives", dx.as_mut_ptr(), dx.len())
    }

    fn indicators(&mut self, z: &mut [f64]) -> Result<(), String> {
        done!(self, indicators, c"fmi3GetEventIndicators", z.as_mut_ptr(), z.len())
    }

    fn completed(&mut self) -> Result<(bool, bool), String> {
        let (mut event, mut ends) = (0, 0);
        done!(self, completed, c"fmi3CompletedIntegratorStep", 0, &mut event, &mut ends)?;
        Ok((event != 0, ends != 0))
    }

    fn enter_event(&mut self) -> Result<(), String> {
        done!(self, enter_event, c"fmi3EnterEventMode")
    }

    fn update(&mut self) -> Result<Updated, String> {
        let (mut again, mut ends, mut nominals, mut moved, mut has_next, mut next) = (0, 0, 0, 0, 0, 0.0);
        let (a, b, c, d, e) = (&mut again, &mut ends, &mut nominals, &mut moved, &mut has_next);
        done!(self, update, c"fmi3UpdateDiscreteStates", a, b, c, d, e, &mut next)?;
        Ok(Updated { again: again != 0, ends: ends != 0, moved: moved != 0, next: (has_next != 0).then_some(next) })
    }

    fn enter_continuous(&mut self) -> Result<(), String> {
        done!(self, enter_continuous, c"fmi3EnterContinuousTimeMode")
    }

    fn directional(&mut self, unknowns: &[u32], known: u32, out: &mut [f64]) -> Result<(), String> {
        let (vr, n, seed) = (unknowns.as_ptr(), unknowns.len(), 1.0);
        done!(self, directional, c"fmi3GetDirectionalDerivative", vr, n, &known, 1, &seed, 1, out.as_mut_ptr(), n)
    }
}
