//! A machine that is stepped from outside.

use super::engine::{Engine, shown};
use super::exact::{self, Make};
use super::inputs::Pieces;
use super::saved::{Pass, Passed, restored};
use super::{Ending, Event, PositionError, Solver, check, general};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::mechanism::{DRIVES, Heading, Layout, Mechanism, Mode, State};
use crate::signal::{DEGREE, Piece, shifted};
use std::sync::Arc;

/// Default interval, s, for which steps are computed fastest; likewise its halves, quarters and so on.
const INTERVAL: f64 = 1e-3;

/// A running machine that owns all its data, and can be stepped, inspected, copied and sent to another thread. A clone
/// continues bit for bit as the original would.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::signal::Signal;
/// use taut::solve::{Simulator, Solver};
/// use taut::machine::axis::CART;
///
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let mut machine = Simulator::new(&case.machine, Solver::Exact)?;
/// let mut events = Vec::new();
/// machine.set_input(0, &Signal::Step { value: 10.0, at: 0.0 }.piece(0.0))?;
/// while machine.state().position[CART] < 0.05 {
///     machine.advance(machine.time() + 1e-3, &mut events).expect("nothing ends it early");
/// }
/// // What would have happened a tenth of a second later?
/// let mut copy = machine.clone();
/// copy.advance(machine.time() + 0.1, &mut Vec::new()).expect("nothing ends it early");
/// assert!(copy.state().position[CART] > machine.state().position[CART]);
/// # Ok::<(), taut::Error>(())
/// ```
pub struct Simulator {
    engine: Box<dyn Engine>,
    inputs: Pieces,
    /// True if inputs were set since it was advanced last.
    is_set: bool,
}

impl Clone for Simulator {
    fn clone(&self) -> Self {
        Self { engine: self.engine.copy(), inputs: self.inputs, is_set: self.is_set }
    }
}

/// Makes the exact engine of a mechanism in `start`, its inputs held.
struct Exact<'s> {
    mechanism: Arc<Mechanism>,
    space: Arc<exact::Space>,
    start: &'s State,
    interval: f64,
}

impl Make for Exact<'_> {
    type Made = Box<dyn Engine>;

    fn make<const N: usize>(self) -> Self::Made {
        let Self { mechanism, space, start, interval } = self;
        Box::new(exact::Core::<N>::new(mechanism, space, start, (interval, f64::INFINITY), vec![]))
    }
}

impl Simulator {
    /// An axis at rest at the origin with zero inputs. Errors: an invalid machine, or one that the solver does not
    /// support.
    pub fn new(machine: &Machine, solver: Solver) -> Result<Self> {
        check::machine(machine)?;
        Self::of_mechanism(&machine.mechanism(), &State::default(), solver, INTERVAL)
    }

    /// Any mechanism in `start` at time zero with zero inputs. Steps of `interval`, s, and of its halves, quarters and
    /// so on are computed fastest by the exact solver; others are as exact.
    pub fn of_mechanism(mechanism: &Mechanism, start: &State, solver: Solver, interval: f64) -> Result<Self> {
        if !(interval.is_finite() && interval > 0.0) {
            return Err(Error::new(format!("an interval of {interval:e} s cannot be")).allowed("above zero"));
        }
        check::state(start)?;
        let engine: Box<dyn Engine> = match solver {
            Solver::Exact => {
                check::piecewise_linear(mechanism)?;
                let space = Arc::new(exact::Space::new(mechanism, 0));
                let mechanism = Arc::new(mechanism.seen_from(&space.layout, start));
                exact::in_kernel(space.size(), Exact { mechanism, space, start, interval })
            }
            Solver::General { tolerance } => {
                let fastest = check::fastest_rate(mechanism);
                general::check(fastest, 0.0, tolerance)?;
                let (layout, steps) = (Layout::new(mechanism), (interval, f64::INFINITY));
                Box::new(general::Core::new(mechanism, layout, start, (tolerance, fastest), steps))
            }
            Solver::Table3 { .. } => {
                return Err(Error::new("the paper's Table 3 is not stepped from outside")
                    .next("take the exact solver, or the general one"));
            }
        };
        Ok(Self { engine, inputs: Pieces::held(&[], 0.0, f64::INFINITY), is_set: true })
    }

    /// The mechanism, with positions relative to its start.
    pub fn mechanism(&self) -> &Mechanism {
        self.engine.mechanism()
    }

    /// Present time, s.
    pub fn time(&self) -> f64 {
        self.engine.time()
    }

    /// Sets the input of a drive from now on: a polynomial that has begun, or begins now. Inputs of several drives that
    /// are set at one time act simultaneously.
    pub fn set_input(&mut self, drive: usize, piece: &Piece) -> Result<()> {
        let drives = self.mechanism().drives.len();
        if drive >= drives {
            return Err(Error::new(format!("there is no drive {drive}")).allowed(format!("from 0 to {}", drives - 1)));
        }
        let now = self.time();
        if piece.start > now || !piece.coefficients.iter().all(|c| c.is_finite()) {
            return Err(Error::new(format!("an input that begins at {} s cannot be set at {now} s", piece.start))
                .allowed("a polynomial of finite coefficients that begins now, or has begun"));
        }
        let pieces = self.inputs.since(now);
        self.inputs = pieces;
        self.inputs.coefficients[drive] = shifted(&piece.coefficients, now - piece.start);
        self.is_set = true;
        Ok(())
    }

    /// Advances to `until`, s, and appends the events to `events`. Returns an early ending, after which the machine
    /// stays at the time it reached.
    pub fn advance(&mut self, until: f64, events: &mut Vec<Event>) -> std::result::Result<(), Ending> {
        if self.mechanism().is_stepped() {
            return self.advance_in_microsteps(until, events);
        }
        if std::mem::take(&mut self.is_set) {
            let degree = self.inputs.degree();
            if degree > self.engine.degree() {
                self.engine = self.engine.raised(degree);
            }
            let inputs = self.inputs.since(self.time());
            self.engine.take_input(&inputs);
        }
        if self.inputs.degree() > 1 {
            let inputs = self.inputs;
            self.engine.bound_input(&inputs, until);
        }
        self.engine.go_to(until, events)
    }

    /// Advances steppers from edge to edge of their microsteps.
    fn advance_in_microsteps(&mut self, until: f64, events: &mut Vec<Event>) -> std::result::Result<(), Ending> {
        self.is_set = false;
        while self.time() < until {
            let pieces = self.inputs.since(self.time()).applied(self.mechanism(), until);
            self.engine.take_input(&pieces);
            self.engine.go_to(pieces.end.min(until), events)?;
        }
        Ok(())
    }

    /// The state in angles and positions.
    pub fn state(&self) -> State {
        self.engine.state()
    }

    /// The states of its parts.
    pub fn mode(&self) -> &Mode {
        self.engine.mode()
    }

    /// Its solver.
    pub(super) fn engine(&self) -> &dyn Engine {
        &*self.engine
    }

    /// Polynomials of its inputs in powers of the time from now.
    pub(super) fn input_coefficients(&self) -> [[f64; DEGREE + 1]; DRIVES] {
        self.inputs.since(self.time()).coefficients
    }

    /// Bound of the position error, m; `None` for the general solver.
    pub fn error(&self) -> Option<PositionError> {
        self.engine.error()
    }

    /// Columns of [`Simulator::outputs`], as in a run.
    pub fn columns(&self) -> &[Heading] {
        &self.mechanism().columns
    }

    /// Present value of each of [`Simulator::columns`], in SI units; `into` has an element for each.
    pub fn outputs(&self, into: &mut [f64]) {
        shown(&*self.engine, into);
    }

    /// Continues with other parameters of the same mechanism: masses, friction, stiffness, motor constants, forces. Its
    /// geometry, which relates positions to lengths, and its states must stay the same.
    pub fn replace(&mut self, mechanism: &Mechanism) {
        self.engine.replace(mechanism);
        self.is_set = true;
    }

    /// The complete state as plain numbers; `None` after an early end.
    pub fn save(&self) -> Option<Vec<u64>> {
        let mut copy = self.clone();
        let mut list = vec![self.engine.degree() as u64];
        copy.pass(&mut Pass::Out(&mut list))?;
        Some(list)
    }

    /// Continues bit for bit from the result of [`Simulator::save`] of a machine with the same parameters and initial
    /// state. Returns `None`, and changes nothing, if `saved` does not belong to such a machine.
    pub fn restore(&mut self, saved: &[u64]) -> Option<()> {
        let (degree, rest) = saved.split_first()?;
        let mut copy = self.clone();
        if *degree > copy.engine.degree() as u64 && *degree <= DEGREE as u64 {
            copy.engine = copy.engine.raised(*degree as usize);
        }
        if *degree != copy.engine.degree() as u64 {
            return None;
        }
        *self = restored(&copy, rest, Self::pass)?;
        Some(())
    }

    fn pass(&mut self, pass: &mut Pass) -> Passed {
        pass.pieces(&mut self.inputs)?;
        pass.flag(&mut self.is_set)?;
        self.engine.pass(pass)
    }
}
