//! An FMU on disk, its instances, and numbers that look random.

use std::ffi::{CString, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use taut::case::Case;
use taut::export::fmu::Model;
use taut_fmu::{fmi2, fmi3};
use tempfile::TempDir;

/// The statuses of the standard.
pub const OK: c_int = 0;
pub const DISCARD: c_int = 2;
pub const ERROR: c_int = 3;

/// A folder of resources, and the machine in it.
pub struct Unit {
    folder: TempDir,
    pub model: Model,
}

impl Unit {
    /// That of a case in `stages`.
    pub fn new(case: &str, with_controller: bool) -> Self {
        Self::with(case, &[], with_controller)
    }

    /// The same with changes of the case.
    pub fn with(case: &str, changes: &[&str], with_controller: bool) -> Self {
        let opened = Case::read_with(machine(case), changes).unwrap();
        let model = Model::new(&opened, with_controller).unwrap();
        let folder = TempDir::new().unwrap();
        std::fs::write(folder.path().join("machine.toml"), &model.resource).unwrap();
        Self { folder, model }
    }

    /// The reference of a variable.
    pub fn reference(&self, name: &str) -> u32 {
        self.model.variables.iter().find(|variable| variable.name == name).expect("a variable of this name").reference
    }

    pub fn token(&self) -> CString {
        CString::new(self.model.token.as_str()).unwrap()
    }

    pub fn path(&self) -> CString {
        CString::new(self.folder.path().to_str().unwrap()).unwrap()
    }

    /// An instance of FMI 3.0 for co-simulation.
    pub fn three(&self, events: bool, early: bool) -> Three<'_> {
        self.three_with(events, early, std::ptr::null_mut(), None)
    }

    /// The same with a callback within steps.
    pub fn three_with(
        &self,
        events: bool,
        early: bool,
        environment: *mut c_void,
        update: Option<fmi3::IntermediateUpdate>,
    ) -> Three<'_> {
        let pointer = unsafe {
            fmi3::fmi3InstantiateCoSimulation(
                c"one".as_ptr(),
                self.token().as_ptr(),
                self.path().as_ptr(),
                0,
                0,
                u8::from(events),
                u8::from(early),
                std::ptr::null(),
                0,
                environment,
                None,
                update,
            )
        };
        assert!(!pointer.is_null());
        Three { pointer, unit: self }
    }

    /// An instance of FMI 3.0 for model exchange.
    pub fn exchange(&self) -> Three<'_> {
        let null = std::ptr::null_mut();
        let pointer = unsafe {
            fmi3::fmi3InstantiateModelExchange(
                c"one".as_ptr(),
                self.token().as_ptr(),
                self.path().as_ptr(),
                0,
                0,
                null,
                None,
            )
        };
        assert!(!pointer.is_null());
        Three { pointer, unit: self }
    }

    /// An instance of FMI 2.0; null where it is refused.
    pub fn two(&self, kind: c_int, token: &CString) -> *mut c_void {
        let uri = CString::new(format!("file://{}", self.folder.path().to_str().unwrap())).unwrap();
        let null: *const c_char = std::ptr::null();
        let _ = null;
        unsafe { fmi2::fmi2Instantiate(c"one".as_ptr(), kind, token.as_ptr(), uri.as_ptr(), std::ptr::null(), 0, 0) }
    }
}

/// An instance of FMI 3.0, freed at the end.
pub struct Three<'u> {
    pub pointer: *mut c_void,
    pub unit: &'u Unit,
}

impl Drop for Three<'_> {
    fn drop(&mut self) {
        unsafe { fmi3::fmi3FreeInstance(self.pointer) }
    }
}

/// Answers of a step.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub struct Step {
    pub event: u8,
    pub terminate: u8,
    pub early: u8,
    pub last: f64,
}

impl Three<'_> {
    /// To where steps can be made, from time zero.
    pub fn start(&self) {
        unsafe {
            assert_eq!(fmi3::fmi3EnterInitializationMode(self.pointer, 0, 0.0, 0.0, 0, 0.0), OK);
            assert_eq!(fmi3::fmi3ExitInitializationMode(self.pointer), OK);
        }
    }

    pub fn set(&self, name: &str, value: f64) -> c_int {
        let reference = self.unit.reference(name);
        unsafe { fmi3::fmi3SetFloat64(self.pointer, &reference, 1, &value, 1) }
    }

    pub fn get(&self, name: &str) -> f64 {
        let (reference, mut value) = (self.unit.reference(name), f64::NAN);
        assert_eq!(unsafe { fmi3::fmi3GetFloat64(self.pointer, &reference, 1, &mut value, 1) }, OK, "{name}");
        value
    }

    /// The value of a parameter of an instance that has not begun, by beginning.
    pub fn get_parameter(&self, name: &str) -> f64 {
        self.start();
        self.get(name)
    }

    pub fn whole(&self, name: &str) -> i32 {
        let (reference, mut value) = (self.unit.reference(name), i32::MIN);
        assert_eq!(unsafe { fmi3::fmi3GetInt32(self.pointer, &reference, 1, &mut value, 1) }, OK, "{name}");
        value
    }

    pub fn try_step(&self, time: f64, size: f64) -> (c_int, Step) {
        let mut step = Step::default();
        let Step { event, terminate, early, last } = &mut step;
        let status = unsafe { fmi3::fmi3DoStep(self.pointer, time, size, 0, event, terminate, early, last) };
        (status, step)
    }

    pub fn step(&self, time: f64, size: f64) -> Step {
        let (status, step) = self.try_step(time, size);
        assert_eq!(status, OK, "a step of {size} from {time}");
        step
    }

    pub fn keep(&self) -> *mut c_void {
        let mut state = std::ptr::null_mut();
        assert_eq!(unsafe { fmi3::fmi3GetFMUState(self.pointer, &mut state) }, OK);
        state
    }

    pub fn bring_back(&self, state: *mut c_void) {
        assert_eq!(unsafe { fmi3::fmi3SetFMUState(self.pointer, state) }, OK);
    }
}

/// A case of the repository.
pub fn machine(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages").join(name)
}

/// Numbers that look random: those of Knuth's MMIX, its upper half.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0 >> 32
    }

    /// From 0 up to `end`, that not included.
    pub fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        self.next() as f64 / u32::MAX as f64
    }
}
