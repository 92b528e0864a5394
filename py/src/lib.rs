//! The Python package `taut`: what is below its Python sources in `python/taut`.
//!
//! Every class here is wrapped there by one with docstrings, types, tables and plots. Work that takes long runs without
//! the interpreter's lock and asks now and then whether Ctrl-C was pressed.

mod case;
mod columns;
mod controller;
mod error;
mod fmu;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[path = "../../cli/hypot.rs"]
mod hypot;
mod interrupt;
mod logs;
mod modes;
mod runs;
mod shape;
mod spoken;
mod sweep;
mod value;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::case::{Case, Fit, template};
    #[pymodule_export]
    use crate::controller::Observation;
    #[pymodule_export]
    use crate::error::{Bug, Error, fail_as_a_bug};
    #[pymodule_export]
    use crate::runs::{Run, moves, simulation, write};
    #[pymodule_export]
    use crate::shape::shape;
    #[pymodule_export]
    use crate::sweep::Sweep;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
