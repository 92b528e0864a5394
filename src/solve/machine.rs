//! A machine that is stepped from outside.

use super::exact::{self, Kernel};
use super::inputs::Pieces;
use super::{Ending, Event, PositionError, Solver, check, general};
use crate::error::{Error, Result};
use crate::mechanism::{Form, Heading, Layout, Mechanism, Mode, Shown, SpringLaw, State, What};
use crate::signal::Piece;
use crate::stage::Stage;
use std::sync::Arc;

/// The interval that steps are computed fastest for, where none is named, s; and its halves, quarters and so on.
const INTERVAL: f64 = 1e-3;

/// A machine under way, which owns all that it needs: stepped, looked at, copied, sent elsewhere. A clone is its saved state, and goes on
/// bit for bit as it would have.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::signal::Signal;
/// use taut::solve::{Machine, Solver};
/// use taut::stage::axis::CART;
///
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let mut machine = Machine::new(&case.stage, Solver::Exact)?;
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
#[derive(Clone)]
pub struct Machine {
    engine: Engine,
    inputs: Pieces,
    /// Whether inputs were set since it was advanced last.
    is_set: bool,
}

#[derive(Clone)]
enum Engine {
    Straight(Box<exact::Core<8, 10>>),
    Rotor(Box<exact::Core<12, 14>>),
    Smooth(Box<exact::Core<16, 18>>),
    Two(Box<exact::Core<16, 19>>),
    TwoSmooth(Box<exact::Core<28, 31>>),
    General(Box<general::Core>),
}

/// The same for the core of any engine.
macro_rules! each {
    ($engine:expr, $core:ident => $what:expr) => {
        match $engine {
            Engine::Straight($core) => $what,
            Engine::Rotor($core) => $what,
            Engine::Smooth($core) => $what,
            Engine::Two($core) => $what,
            Engine::TwoSmooth($core) => $what,
            Engine::General($core) => $what,
        }
    };
}

impl Engine {
    /// The exact engine of a mechanism in `start`.
    fn exact(mechanism: Arc<Mechanism>, start: &State, interval: f64, smooth: bool) -> Self {
        let space = exact::Space::new(&mechanism, smooth);
        let kernel = Kernel::of(&space);
        let (space, reach) = (Arc::new(space), (interval, f64::INFINITY));
        match kernel {
            Kernel::Straight => Engine::Straight(Box::new(exact::Core::new(mechanism, space, start, reach, vec![]))),
            Kernel::Rotor => Engine::Rotor(Box::new(exact::Core::new(mechanism, space, start, reach, vec![]))),
            Kernel::Smooth => Engine::Smooth(Box::new(exact::Core::new(mechanism, space, start, reach, vec![]))),
            Kernel::Two => Engine::Two(Box::new(exact::Core::new(mechanism, space, start, reach, vec![]))),
            Kernel::TwoSmooth => Engine::TwoSmooth(Box::new(exact::Core::new(mechanism, space, start, reach, vec![]))),
        }
    }

    /// The same engine with room for inputs that bend.
    fn smooth(self) -> Self {
        match self {
            Engine::Straight(core) => Engine::Smooth(Box::new(core.smooth())),
            Engine::Rotor(core) => Engine::Smooth(Box::new(core.smooth())),
            Engine::Two(core) => Engine::TwoSmooth(Box::new(core.smooth())),
            other => other,
        }
    }

    fn is_smooth(&self) -> bool {
        matches!(self, Engine::Smooth(_) | Engine::TwoSmooth(_) | Engine::General(_))
    }
}

impl Machine {
    /// An axis at rest at the origin, its inputs zero. Errors: what makes no sense as a machine, or what the solver does not take.
    pub fn new(stage: &Stage, solver: Solver) -> Result<Self> {
        check::stage(stage)?;
        Self::of_mechanism(&stage.mechanism(), &State::default(), solver, INTERVAL)
    }

    /// Any mechanism in `start` at time zero, its inputs zero. Steps of `interval`, s, and of its halves, quarters and so on are
    /// computed fastest by the exact solver; others are as exact.
    pub fn of_mechanism(mechanism: &Mechanism, start: &State, solver: Solver, interval: f64) -> Result<Self> {
        if !(interval.is_finite() && interval > 0.0) {
            return Err(Error::new(format!("an interval of {interval:e} s cannot be")).allowed("above zero"));
        }
        check::state(start)?;
        let engine = match solver {
            Solver::Exact => {
                check::piecewise_linear(mechanism)?;
                let layout = Layout::new(mechanism);
                Engine::exact(Arc::new(mechanism.seen_from(&layout, start)), start, interval, false)
            }
            Solver::General { tolerance } => {
                let fastest = check::fastest_rate(mechanism);
                general::check(fastest, 0.0, tolerance)?;
                let reach = (tolerance, fastest, f64::INFINITY);
                Engine::General(Box::new(general::Core::new(mechanism, Layout::new(mechanism), start, reach)))
            }
            Solver::Table3 { .. } => {
                return Err(Error::new("the paper's Table 3 is not stepped from outside")
                    .next("take the exact solver, or the general one"));
            }
        };
        Ok(Self { engine, inputs: Pieces::held(&[], 0.0, f64::INFINITY), is_set: true })
    }

    /// The mechanism, its ways counted from where it began.
    pub fn mechanism(&self) -> &Mechanism {
        each!(&self.engine, core => core.mechanism())
    }

    /// Where it stands, s.
    pub fn time(&self) -> f64 {
        each!(&self.engine, core => core.time())
    }

    /// The input of a drive from now on, until another is set: a polynomial that has begun, or begins now. Inputs of several drives that are
    /// set at one time act at once.
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
        self.inputs.coefficients[drive] = Pieces::shifted(&piece.coefficients, now - piece.start);
        self.is_set = true;
        Ok(())
    }

    /// Goes on to `until`, s, and adds the events on the way to `events`. An early end is told, and where it stands then; it goes no further.
    pub fn advance(&mut self, until: f64, events: &mut Vec<Event>) -> std::result::Result<(), Ending> {
        if std::mem::take(&mut self.is_set) {
            if self.inputs.degree() > 1 && !self.engine.is_smooth() {
                self.engine = self.engine.clone().smooth();
            }
            let inputs = self.inputs.since(self.time());
            each!(&mut self.engine, core => core.take_input(&inputs));
        }
        if self.inputs.degree() > 1 {
            let inputs = self.inputs;
            each!(&mut self.engine, core => core.bound_input(&inputs, until));
        }
        each!(&mut self.engine, core => core.go_to(until, events))
    }

    /// The state in angles and positions.
    pub fn state(&self) -> State {
        each!(&self.engine, core => core.state())
    }

    /// What its parts do.
    pub fn mode(&self) -> &Mode {
        each!(&self.engine, core => &core.mode)
    }

    /// By how much positions may be off, m; of the general solver nothing is known.
    pub fn error(&self) -> Option<PositionError> {
        match &self.engine {
            Engine::Straight(core) => Some(core.clone().error()),
            Engine::Rotor(core) => Some(core.clone().error()),
            Engine::Smooth(core) => Some(core.clone().error()),
            Engine::Two(core) => Some(core.clone().error()),
            Engine::TwoSmooth(core) => Some(core.clone().error()),
            Engine::General(_) => None,
        }
    }

    /// The columns that [`Machine::outputs`] gives: those of a run.
    pub fn columns(&self) -> &[Heading] {
        &self.mechanism().columns
    }

    /// The value of each of [`Machine::columns`] now, in SI units; `into` has a place for each.
    pub fn outputs(&self, into: &mut [f64]) {
        let (mechanism, mode) = (self.mechanism(), self.mode());
        let state = self.state();
        let value = |form: &Form| each!(&self.engine, core => core.value(form));
        let within = |value: f64, limit: Option<f64>| limit.map_or(value, |limit| value.clamp(-limit, limit));
        let input = each!(&self.engine, core => core.input());
        for (into, heading) in into.iter_mut().zip(&mechanism.columns) {
            *into = match heading.shown {
                Shown::Time => self.time(),
                Shown::Input(drive) => input[drive],
                Shown::Voltage(drive) => {
                    within(value(&mechanism.voltage(drive, mode)), mechanism.drives[drive].amplifier.voltage_limit)
                }
                Shown::Current(drive) => {
                    within(value(&mechanism.current(drive, mode)), mechanism.drives[drive].amplifier.current_limit)
                }
                Shown::Position(body, factor) => state.position[body] * factor,
                Shown::Speed(body, factor) => state.speed[body] * factor,
                Shown::Stretch(spring) => value(&Form::stretch(spring)),
                Shown::Force(spring, factor) => {
                    let extra = each!(&self.engine, core => core.extra().force[spring]);
                    (value(&mechanism.spring_force(spring, mode)) + extra) * factor
                }
                Shown::Friction(body) => self.friction(body, mechanism, mode, &state, &value),
                Shown::Motion(body) => f64::from(mode.motion[body].code()),
                Shown::Bristle(body) => each!(&self.engine, core => core.extra().bristle[body]),
                Shown::Contact(spring) => {
                    let what = match mechanism.springs[spring].law {
                        SpringLaw::Tension { .. } => What::Span(spring),
                        _ => What::Gap(spring),
                    };
                    f64::from(mode.status(what).code())
                }
                Shown::Counts(body, counts) => (state.position[body] * counts).round(),
            } + 0.0;
        }
    }

    /// Friction on a body now.
    fn friction(
        &self,
        body: usize,
        mechanism: &Mechanism,
        mode: &Mode,
        state: &State,
        value: &dyn Fn(&Form) -> f64,
    ) -> f64 {
        let extra = each!(&self.engine, core => core.extra());
        // What holds a body at rest is what acts on it, least and most by the way that a gear with losses counts.
        let load = |positive: bool, forward: bool| value(&mechanism.load(body, forward, &mode.with_torque(positive)));
        let all = [load(true, true), load(true, false), load(false, true), load(false, false)];
        let least = all.iter().fold(f64::INFINITY, |a: f64, b| a.min(*b));
        let most = all.iter().fold(f64::NEG_INFINITY, |a: f64, b| a.max(*b));
        let beyond: f64 = (mechanism.springs.iter().zip(extra.force))
            .flat_map(|(spring, force)| spring.arms.iter().map(move |arm| (arm, force)))
            .filter(|((other, _), _)| mechanism.leader(*other) == body)
            .map(|((other, arm), force)| -mechanism.ratio(*other) * arm * force)
            .sum();
        mechanism.friction_value(body, mode.motion[body], state.speed[body], (least + beyond, most + beyond))
            + extra.friction[body]
    }
}
