//! A case as the hunt runs it: an axis or a gantry, along its inputs, along inputs that are held, or in a closed loop.

use crate::double::Double;
use crate::input::{self, Piece};
use crate::loops::{self, Looks};
use crate::machine::{BODIES, Model, Taken};
use crate::solve::{self, IndependentRun};
use taut::case::{Case, Experiment, Move};
use taut::machine::{Machine, MachineKind};
use taut::signal::Signal;

/// The subject of a run.
#[derive(Debug, Clone)]
pub enum Subject {
    /// An axis, its first experiment.
    Axis(Box<Case>),
    /// A gantry, its first experiment.
    Gantry(Box<Case>),
    /// An axis in a closed loop, its first move.
    Loop(Box<Case>),
}

/// How its inputs come.
#[derive(Debug, Clone, PartialEq)]
pub enum Fed {
    /// As the case has them; in a closed loop by the controller.
    AsGiven,
    /// Held between multiples of this time, s: the values of each drive.
    Held(f64, Vec<Vec<f64>>),
    /// By a controller that takes the machine for this one.
    ByModel(Box<Machine>),
    /// By a controller that is shown the reference at its samples alone, and goes on from there to look ahead.
    Sampled,
}

/// How the numbers of a case become ours.
pub struct Numbers<'a> {
    /// Those of the machine and its start.
    pub machine: Taken<'a>,
    /// Those of the input.
    pub input: Taken<'a>,
    /// The times at which a controller takes its reference.
    pub clock: Taken<'a>,
    /// The rounding of a state after each step, as if it were kept in fewer bits.
    pub kept: Option<Taken<'a>>,
    /// How much later than at zero every condition falls, in the SI unit that taut has for it.
    pub delayed: f64,
}

impl Subject {
    /// The case in this text; its first move where it has no experiment.
    pub fn new(name: &str, text: &str) -> Result<Self, String> {
        match Case::from_text_with(name, text, &[]) {
            Ok(case) if !case.is_axis() => Ok(Subject::Gantry(Box::new(case))),
            Ok(case) if case.experiments.is_empty() => Ok(Subject::Loop(Box::new(case))),
            Ok(case) => Ok(Subject::Axis(Box::new(case))),
            Err(error) => Err(format!("the case is refused: {error}")),
        }
    }

    /// The case.
    pub fn opened(&self) -> Case {
        let (Subject::Axis(case) | Subject::Loop(case) | Subject::Gantry(case)) = self;
        case.as_ref().clone()
    }

    /// End of the run and interval between rows, s.
    pub fn times(&self) -> [f64; 2] {
        match self {
            Subject::Axis(case) => [case.experiments[0].until, case.experiments[0].every],
            Subject::Gantry(case) => [case.experiments[0].until, case.experiments[0].every],
            Subject::Loop(case) => [case.moves[0].until, case.moves[0].every],
        }
    }

    /// The same with another interval between rows.
    pub fn with_every(mut self, every: f64) -> Self {
        match &mut self {
            Subject::Axis(case) => case.experiments[0].every = every,
            Subject::Gantry(case) => case.experiments[0].every = every,
            Subject::Loop(case) => case.moves[0].every = every,
        }
        self
    }

    /// Names of its bodies.
    pub fn names(&self) -> &'static [&'static str] {
        match self {
            Subject::Gantry(case) if case.machine.kind == MachineKind::DualBelt => {
                &["left pulley", "right pulley", "cart pulley", "bridge", "cart"]
            }
            Subject::Axis(_) | Subject::Loop(_) => &["drive pulley", "cart", "idler pulley"],
            Subject::Gantry(_) => &["left pulley", "right pulley", "bridge", "cart"],
        }
    }

    /// Names of the columns that hold their positions.
    pub fn columns(&self) -> &'static [&'static str] {
        match self {
            Subject::Gantry(case) if case.machine.kind == MachineKind::DualBelt => {
                &["left_angle", "right_angle", "cart_pulley_angle", "bridge_position", "cart_position"]
            }
            Subject::Axis(_) | Subject::Loop(_) => &["drive_angle", "cart_position", "idler_angle"],
            Subject::Gantry(_) => &["left_angle", "right_angle", "bridge_position", "cart_position"],
        }
    }

    /// True if the input moves otherwise than on straight lines.
    pub fn has_sines(&self) -> bool {
        self.signals().iter().any(|signal| signal.degree() > 1)
    }

    fn signals(&self) -> Vec<&Signal> {
        match self {
            Subject::Axis(case) => vec![&case.experiments[0].inputs[0]],
            Subject::Gantry(case) => case.experiments[0].inputs.iter().collect(),
            Subject::Loop(_) => Vec::new(),
        }
    }

    /// The machine at its start.
    pub fn machine(&self, taken: Taken) -> Model {
        match self {
            Subject::Axis(case) => Model::new(&case.machine, &case.experiments[0], taken),
            Subject::Gantry(case) => crate::gantry::machine(&case.machine, &case.experiments[0], taken),
            Subject::Loop(case) => Model::new(&case.machine, &at_rest(&case.moves[0], &case.machine), taken),
        }
    }

    /// Chains of its inputs up to `until`.
    pub fn chains(&self, until: f64, taken: Taken) -> Result<Vec<Vec<Piece>>, String> {
        self.signals().into_iter().map(|signal| input::chain(signal, until, &mut *taken)).collect()
    }

    /// Its inputs held between multiples of `every`.
    pub fn held(&self, every: f64) -> Result<Fed, String> {
        let [until, _] = self.times();
        let chains = self.chains(until, &mut Double::from)?;
        let count = (until / every).ceil() as usize;
        let values = |chain: &Vec<Piece>| (0..count).map(|k| input::value(chain, k as f64 * every).high).collect();
        Ok(Fed::Held(every, chains.iter().map(values).collect()))
    }

    /// The independent solver's run with rows at `times`.
    pub fn known(&self, fed: &Fed, times: &[f64], numbers: Numbers) -> Result<IndependentRun, String> {
        let machine = Model { delayed: numbers.delayed, ..self.machine(numbers.machine) };
        let end = times.last().copied().unwrap_or(0.0);
        if let Subject::Loop(case) = self {
            let model = if let Fed::ByModel(model) = fed { model } else { &case.machine };
            let looks = if *fed == Fed::Sampled { Looks::OnFromSample } else { Looks::Ahead };
            return loops::run((case, model, looks), &machine, times, (numbers.clock, numbers.kept));
        }
        let chains = match fed {
            Fed::AsGiven | Fed::ByModel(_) | Fed::Sampled => self.chains(end, numbers.input)?,
            Fed::Held(every, values) => values.iter().map(|values| held_chain(values, *every)).collect(),
        };
        Ok(solve::run(&machine, &chains, times, numbers.kept))
    }

    /// The same with all numbers as they are.
    pub fn known_as_is(&self, fed: &Fed, times: &[f64]) -> Result<IndependentRun, String> {
        let numbers = Numbers {
            machine: &mut Double::from,
            input: &mut Double::from,
            clock: &mut Double::from,
            kept: None,
            delayed: 0.0,
        };
        self.known(fed, times, numbers)
    }

    /// Positions in taut's units as positions along the belt from the start.
    pub fn along_the_belt(&self, machine: &Model, positions: &[f64]) -> [Double; BODIES] {
        std::array::from_fn(|body| match positions.get(body) {
            Some(&position) => machine.lever[body] * position - machine.origin[body],
            None => Double::ZERO,
        })
    }
}

/// A chain of held values.
fn held_chain(values: &[f64], every: f64) -> Vec<Piece> {
    let piece =
        |(k, value): (usize, &f64)| Piece::line(Double::from(k as f64 * every), Double::from(*value), Double::ZERO);
    values.iter().enumerate().map(piece).collect()
}

/// The start of a move as that of an experiment.
fn at_rest(motion: &Move, machine: &Machine) -> Experiment {
    Experiment {
        name: String::new(),
        inputs: vec![Signal::Step { value: 0.0, at: 0.0 }],
        until: motion.until,
        every: motion.every,
        initial: machine.at_rest(motion.profile().start()),
        log: None,
    }
}
