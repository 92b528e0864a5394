//! Belt-driven axes: described in a file, simulated exactly.
//!
//! An axis is a motor, two pulleys, a toothed belt and a cart. [`case`] reads what it is and what is done with it,
//! [`solve`] computes the motion, and the result is a [`trajectory`]: named columns over time.
//!
//! ```
//! use taut::case::{Case, TEMPLATE};
//! use taut::metrics::Meter;
//! use taut::solve::{Ending, Flow, Solver, simulate, stream_observed};
//!
//! // A case file, here the one that `taut init` writes, with another mass.
//! let case = Case::from_text_with("axis.toml", TEMPLATE, &["cart.mass=0.5 kg"])?;
//! let experiment = &case.experiments[0];
//!
//! // The motion, exact to rounding.
//! let solution = simulate(&case.machine, experiment, Solver::Exact)?;
//! assert_eq!(solution.outcome.ending, Ending::Complete);
//!
//! // Where the cart is, and where an encoder at the drive pulley says it is.
//! let last = |column: &str| *solution.trajectory.get(column).unwrap().last().unwrap();
//! let (cart, encoder) = (last("cart_position"), case.machine.pulley_radius * last("drive_angle"));
//! assert!(cart > 0.04 && (cart - encoder).abs() < 5e-6);
//!
//! // Who stuck and slipped, and when.
//! let first = solution.outcome.events[0];
//! assert_eq!((first.time, first.part.name(), first.to.word()), (0.0, "drive pulley", "forward"));
//!
//! // The key figures.
//! let mut meter = Meter::new(&case.machine, experiment);
//! let outcome = stream_observed(&case.machine, experiment, Solver::Exact, &mut meter, &mut |_| Flow::Continue)?;
//! let metrics = meter.finish(&outcome.events);
//! assert!(metrics.settled && metrics.stop_time < Some(0.5));
//! # Ok::<(), taut::Error>(())
//! ```
//!
//! # Modules
//!
//! Those of the crates `taut-core`, `taut-case`, `taut-control`, `taut-identify` and `taut-export`, in the order of
//! dependence; each uses only those above it.
//!
//! - [`error`]: what is wrong, where, what is allowed, what to do next.
//! - [`quantity`]: `"19.4 mm"` becomes 0.0194, with the dimension checked. Everywhere else numbers are in SI units.
//! - [`trajectory`]: columns with units, and their files.
//! - [`friction`], [`machine`]: what the machine is.
//! - [`parameter`]: the one table of everything a case file can say; numbers of a machine that are free.
//! - [`signal`]: what is fed into it, and the references of its moves. [`design`]: what a controller is, in data.
//! - [`mechanism`]: a machine as bodies, springs and drives, and its equations of motion, mode by mode.
//! - [`log`]: measured columns in. [`case`]: the case file in.
//! - [`solve`]: the motion. [`measure`]: what a recorder makes of it. [`metrics`]: what it shows. [`reduction`]: how
//!   far a reduced model is from the elastic one.
//! - [`linear`]: state space, poles, zeros, frequency response, resonance along the travel.
//! - [`control`]: controllers stepped in time around the exact plant; input shapers, from spectra and from the model.
//! - [`fit`]: parameters from logs, and what the logs cannot tell.
//! - [`sweep`]: many runs with parameters varied.
//! - [`tune`]: gains of a controller, good for the worst axis that parameters, loads and places can make.
//! - [`planning`]: the fastest moves. [`learning`]: the next feed-forward signal of a repeated move.
//! - [`export`]: machines and controllers as texts for other tools. [`stages`]: machines to begin with.
//! - `json`: results as data (feature `json`).
//!
//! # Later versions
//!
//! Results, and enumerations that will get further variants, are `#[non_exhaustive]`: further fields and variants do
//! not break a program that reads them. What a program makes itself has a constructor for its necessary values, such as
//! [`Machine::axis`](machine::Machine::axis), [`Motor::brushed`](machine::Motor::brushed),
//! [`Experiment::new`](plan::Experiment::new), [`Design::new`](design::Design::new) and
//! [`Setup::new`](control::Setup::new), or a `Default`; further fields can be set by `..`, and a version may add some:
//!
//! ```
//! use taut::design::{Design, Pid, Structure};
//!
//! let pid = Pid { derivative: 10.0, ..Pid::new(2000.0) }; // V s/m, V/m
//! let design = Design { limit: Some(12.0), ..Design::new(1e-3, Structure::Pid(pid)) }; // V, s
//! # assert_eq!((design.limit, pid.filter), (Some(12.0), 200.0));
//! ```
//!
//! Hidden modules are used by the program and its reports, and change without notice.
//!
//! # Features
//!
//! `parquet` adds Parquet files; `json` adds results as data. Without them the library is the physics alone. A program
//! that only simulates, without case files, needs `taut-core` alone. Figures and reports are a crate of their own,
//! `taut-report`.

#[cfg(feature = "json")]
pub mod json;
pub mod overview;
pub mod reduction;
pub mod stages;
pub mod sweep;

#[doc(hidden)]
pub use taut_case::files;
pub use taut_case::{case, log};
pub use taut_control::{control, frf, learning, linear, planning, tune};
pub use taut_core::{
    Error, Result, design, error, friction, machine, measure, mechanism, metrics, parameter, plan, quantity, reach,
    signal, solve,
};
#[doc(hidden)]
pub use taut_core::{chance, number, polyline};
pub use taut_export as export;
pub use taut_identify::fit;

/// Columns with units, and their files.
pub mod trajectory {
    pub use taut_case::files::CsvWriter;
    #[cfg(feature = "parquet")]
    pub use taut_case::files::ParquetWriter;
    pub use taut_core::trajectory::*;
}
