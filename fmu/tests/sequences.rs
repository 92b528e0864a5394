//! Random sequences of calls, sensible and not: no crash, no panic, no status that the standard has not.
//!
//! `TAUT_SEQUENCES` says how many; `cargo xtask fmu` runs 10,000 under address sanitizer.

use crate::unit::{Random, Unit};
use std::ffi::{CString, c_int, c_void};
use taut_fmu::{fmi2, fmi3};

/// Statuses: OK, warning, discard, error. Fatal is a panic that was caught.
fn sane(status: c_int, what: u64) {
    assert!((0..=3).contains(&status), "call {what} answers {status}");
}

/// Times, sizes and values as importers may send them.
fn number(random: &mut Random) -> f64 {
    match random.below(12) {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => -1.0,
        3 => 0.0,
        4 => 1e300,
        5 => 5e-324,
        _ => 20.0 * random.share() - 10.0,
    }
}

struct Session<'u> {
    unit: &'u Unit,
    pointer: *mut c_void,
    states: Vec<*mut c_void>,
    bytes: Vec<u8>,
    time: f64,
}

impl Session<'_> {
    fn reference(&self, random: &mut Random) -> u32 {
        match random.below(10) {
            0 => random.next() as u32,
            _ => self.unit.model.variables[random.below(self.unit.model.variables.len() as u64) as usize].reference,
        }
    }

    /// One call of FMI 3.0.
    unsafe fn three(&mut self, random: &mut Random) {
        let (c, what) = (self.pointer, random.below(31));
        let (mut flags, mut last) = ([0u8; 5], 0.0);
        let [a, b, d, e, f] = &mut flags;
        let (reference, value, mut real, mut whole) = (self.reference(random), number(random), 0.0, 0);
        let mut many = [0.0; 64];
        let status = unsafe {
            match what {
                0 => fmi3::fmi3EnterInitializationMode(c, 0, 0.0, 0.0, random.below(2) as u8, 1.0),
                1 => fmi3::fmi3ExitInitializationMode(c),
                2 => fmi3::fmi3EnterEventMode(c),
                3 => fmi3::fmi3EnterStepMode(c),
                4 => fmi3::fmi3EnterContinuousTimeMode(c),
                5 if random.below(8) == 0 => fmi3::fmi3Terminate(c),
                6 if random.below(8) == 0 => fmi3::fmi3Reset(c),
                7 | 8 => fmi3::fmi3GetFloat64(c, &reference, 1, &mut real, 1),
                9 => fmi3::fmi3GetInt32(c, &reference, 1, &mut whole, 1),
                10..=12 => fmi3::fmi3SetFloat64(c, &reference, 1, &value, 1),
                13 => self.keep(random),
                14 => fmi3::fmi3SetFMUState(c, self.any_state(random)),
                15 => self.free_one(random),
                16 => self.bytes_and_back(random),
                17 => self.of_bytes(random),
                18 => {
                    let known = self.reference(random);
                    fmi3::fmi3GetDirectionalDerivative(c, &reference, 1, &known, 1, &value, 1, &mut real, 1)
                }
                19 => fmi3::fmi3UpdateDiscreteStates(c, a, b, d, e, f, &mut last),
                20 => fmi3::fmi3CompletedIntegratorStep(c, 1, a, b),
                21 => fmi3::fmi3SetTime(c, value),
                22 => fmi3::fmi3SetContinuousStates(c, many.as_ptr(), random.below(10) as usize),
                23 => fmi3::fmi3GetContinuousStateDerivatives(c, many.as_mut_ptr(), self.unit.model.quantities.len()),
                24 => fmi3::fmi3GetEventIndicators(c, many.as_mut_ptr(), self.unit.model.conditions),
                25 => fmi3::fmi3GetFloat64(c, std::ptr::null(), 3, &mut real, 3),
                26 => {
                    let order = random.below(10) as i32 - 1;
                    fmi3::fmi3GetOutputDerivatives(c, &reference, 1, &order, &mut real, 1)
                }
                _ => {
                    let (time, size) = match random.below(4) {
                        0 => (value, 1e-3),
                        1 => (self.time, value),
                        _ => (self.time, 1e-3 + 0.01 * random.share()),
                    };
                    // Long enough steps end what takes too long here.
                    if size > 1.0 && size < 1e300 {
                        return;
                    }
                    let status = fmi3::fmi3DoStep(c, time, size.min(1e-2), 0, a, b, d, &mut last);
                    if status == 0 {
                        self.time = last;
                    }
                    status
                }
            }
        };
        sane(status, what);
    }

    fn any_state(&self, random: &mut Random) -> *mut c_void {
        match self.states.len() as u64 {
            0 => std::ptr::null_mut(),
            n => self.states[random.below(n) as usize],
        }
    }

    unsafe fn keep(&mut self, random: &mut Random) -> c_int {
        let mut state = match random.below(3) {
            0 => self.any_state(random),
            _ => std::ptr::null_mut(),
        };
        let before = state;
        let status = unsafe { fmi3::fmi3GetFMUState(self.pointer, &mut state) };
        if status == 0 {
            self.states.retain(|known| *known != before);
            self.states.push(state);
        }
        status
    }

    unsafe fn free_one(&mut self, random: &mut Random) -> c_int {
        if self.states.is_empty() {
            return 0;
        }
        let place = random.below(self.states.len() as u64) as usize;
        let mut state = self.states.swap_remove(place);
        unsafe { fmi3::fmi3FreeFMUState(self.pointer, &mut state) }
    }

    unsafe fn bytes_and_back(&mut self, random: &mut Random) -> c_int {
        let (state, mut size) = (self.any_state(random), 0);
        let status = unsafe { fmi3::fmi3SerializedFMUStateSize(self.pointer, state, &mut size) };
        if status != 0 {
            return status;
        }
        self.bytes.resize(size, 0);
        unsafe { fmi3::fmi3SerializeFMUState(self.pointer, state, self.bytes.as_mut_ptr(), size) }
    }

    unsafe fn of_bytes(&mut self, random: &mut Random) -> c_int {
        let mut bytes = self.bytes.clone();
        // Now and then a bit is wrong, or the end is missing.
        if !bytes.is_empty() && random.below(2) == 0 {
            let place = random.below(bytes.len() as u64) as usize;
            bytes[place] ^= 1 << random.below(8);
            bytes.truncate(bytes.len() - 8 * random.below(2) as usize);
        }
        let mut state = std::ptr::null_mut();
        let status = unsafe { fmi3::fmi3DeserializeFMUState(self.pointer, bytes.as_ptr(), bytes.len(), &mut state) };
        if status == 0 {
            self.states.push(state);
        }
        status
    }
}

#[test]
fn random_sequences_of_calls_end_well() {
    let wanted: u64 = std::env::var("TAUT_SEQUENCES").ok().and_then(|count| count.parse().ok()).unwrap_or(200);
    let units = [
        Unit::new("sollmann-jouaneh/table4.toml", false),
        Unit::new("core-xy/core-xy.toml", false),
        Unit::new("core-xy/follows.toml", false),
        Unit::new("dual-belt/dual-belt.toml", false),
        Unit::new("sollmann-jouaneh/controllers/pid.toml", true),
        Unit::with("sollmann-jouaneh/table4.toml", &["travel={ min = \"-1 mm\", max = \"1 mm\" }"], false),
    ];
    for sequence in 0..wanted {
        let mut random = Random(sequence);
        let unit = &units[sequence as usize % units.len()];
        let one = match random.below(3) {
            0 => unit.exchange(),
            _ => unit.three(random.below(2) == 0, random.below(2) == 0),
        };
        let mut session = Session { unit, pointer: one.pointer, states: Vec::new(), bytes: Vec::new(), time: 0.0 };
        // Every other one begins as it should.
        if random.below(2) == 0 {
            one.start();
        }
        (0..60).for_each(|_| unsafe { session.three(&mut random) });
        // Those of 2.0, on an instance of its own.
        unsafe { two(unit, &mut random) };
    }
}

/// A short life by 2.0.
unsafe fn two(unit: &Unit, random: &mut Random) {
    let token: CString = unit.token();
    let c = unit.two(random.below(2) as c_int, &token);
    assert!(!c.is_null());
    let mut info = std::mem::MaybeUninit::<[u64; 8]>::uninit();
    let mut time = 0.0;
    for _ in 0..20 {
        let (what, value) = (random.below(16), number(random));
        let reference = unit.model.variables[random.below(unit.model.variables.len() as u64) as usize].reference;
        let (mut real, mut whole, mut many) = (0.0, 0, [0.0; 64]);
        let status = unsafe {
            match what {
                0 => fmi2::fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0),
                1 => fmi2::fmi2EnterInitializationMode(c),
                2 => fmi2::fmi2ExitInitializationMode(c),
                3 => fmi2::fmi2GetReal(c, &reference, 1, &mut real),
                4 => fmi2::fmi2SetReal(c, &reference, 1, &value),
                5 => fmi2::fmi2GetInteger(c, &reference, 1, &mut whole),
                6 => fmi2::fmi2NewDiscreteStates(c, info.as_mut_ptr().cast()),
                7 => fmi2::fmi2EnterContinuousTimeMode(c),
                8 => fmi2::fmi2GetDerivatives(c, many.as_mut_ptr(), unit.model.quantities.len()),
                9 => fmi2::fmi2SetRealInputDerivatives(c, &reference, 1, &(random.below(9) as c_int), &value),
                10 => fmi2::fmi2GetRealStatus(c, random.below(4) as c_int, &mut real),
                11 => fmi2::fmi2SetBoolean(c, &reference, 1, &whole),
                12 => fmi2::fmi2GetRealOutputDerivatives(c, &reference, 1, &(random.below(9) as c_int), &mut real),
                _ => {
                    let status = fmi2::fmi2DoStep(c, time, 1e-3, 0);
                    if status == 0 {
                        time += 1e-3;
                    }
                    status
                }
            }
        };
        sane(status, 100 + what);
    }
    unsafe { fmi2::fmi2FreeInstance(c) };
}
