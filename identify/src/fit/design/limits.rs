//! How far an experiment may go, and how far one goes.

use super::Request;
use crate::case::{Case, Experiment};
use crate::error::{Error, Result};
use crate::machine::{AmplifierMode, Machine, Travel};
use crate::mechanism::State;
use crate::signal::Signal;
use crate::solve::{Bench, Detail, Ending, Flow};

/// Where a limit comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The request.
    Asked,
    /// The machine of the case.
    Machine,
    /// The greatest value in the case's own experiments.
    Experiments,
}

impl Origin {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Asked => "as asked for",
            Self::Machine => "of the machine",
            Self::Experiments => "the most of the case's experiments",
        }
    }
}

/// The limits of an experiment, without the margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Greatest input, V or A, before the amplifier's gain.
    pub input: (f64, Origin),
    /// Greatest current, A, if there is a limit.
    pub current: Option<(f64, Origin)>,
    /// Length of the way that the cart may take, m.
    pub travel: (f64, Origin),
    /// Its middle, where the case says where the travel is.
    pub middle: Option<f64>,
    /// Share of each that is left free.
    pub margin: f64,
}

/// How far an experiment goes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reached {
    /// Greatest input, V or A.
    pub input: f64,
    /// Greatest current, A.
    pub current: f64,
    /// Least and greatest cart position, m.
    pub positions: [f64; 2],
    /// Greatest speed, m/s.
    pub speed: f64,
}

impl Reached {
    /// Greatest minus least position, m.
    pub fn way(&self) -> f64 {
        self.positions[1] - self.positions[0]
    }
}

impl Limits {
    pub(super) fn new(case: &Case, request: &Request) -> Result<Self> {
        let amplifier = &case.machine.drives[0].amplifier;
        let seen = seen(case);
        let most = |of: fn(&Reached) -> f64| {
            seen.iter().map(of).filter(|value| *value > 0.0).reduce(f64::max).map(|value| (value, Origin::Experiments))
        };
        let machine = match amplifier.mode {
            AmplifierMode::Voltage => amplifier.voltage_limit,
            AmplifierMode::Current | AmplifierMode::Position => amplifier.current_limit,
        };
        let machine = machine.map(|limit| (limit / amplifier.gain.abs(), Origin::Machine));
        let asked = |value: Option<f64>| value.map(|value| (value, Origin::Asked));
        let input = asked(request.input).or(machine).or_else(|| most(|one| one.input)).ok_or_else(|| {
            Error::new("the input is unlimited: the amplifier has no limit, and the case no experiment")
                .next("say how large it may get with --amplitude, or give amplifier.voltage_limit or current_limit")
        })?;
        if let (Some((limit, _)), Some(asked)) = (machine, request.input)
            && asked > limit
        {
            return Err(Error::new(format!("an input of {asked} is beyond what the amplifier gives"))
                .allowed(format!("up to {limit}"))
                .next("reduce --amplitude: beyond its limit the amplifier saturates"));
        }
        let current = asked(request.current).or(amplifier.current_limit.map(|limit| (limit, Origin::Machine)));
        let own = case.machine.cart.travel.map(|Travel { min, max, .. }| (max - min, Origin::Machine));
        if let (Some((length, _)), Some(asked)) = (own, request.travel)
            && asked > length
        {
            return Err(Error::new(format!("{asked} m is more than the travel of the case"))
                .allowed(format!("up to {length} m")));
        }
        let travel = asked(request.travel).or(own).or_else(|| most(Reached::way)).ok_or_else(|| {
            Error::new("the travel of the cart is unlimited: the case has no [travel] and no experiment")
                .next("say how far it may go with --travel \"0.4 m\", or add [travel] with min and max")
        })?;
        let middle = case.machine.cart.travel.map(|travel| 0.5 * (travel.min + travel.max));
        Ok(Self { input, current, travel, middle, margin: request.margin })
    }

    /// The greatest of the shares of the limits that is used, the margin being none of them: 1 is just within.
    pub fn used(&self, reached: &Reached) -> f64 {
        let room = 1.0 - self.margin;
        let current = self.current.map_or(0.0, |(limit, _)| reached.current / (room * limit));
        (reached.input / (room * self.input.0)).max(reached.way() / (room * self.travel.0)).max(current)
    }
}

/// A machine that the cart does not leave: how far it goes is looked at afterwards. Spans that follow the cart need
/// their travel.
pub(super) fn unbounded(stage: &Machine) -> Machine {
    let mut stage = stage.clone();
    if !stage.belt.follows_cart {
        stage.cart.travel = None;
    }
    stage
}

/// How far the case's own experiments go; those that do not get to their end are left out.
fn seen(case: &Case) -> Vec<Reached> {
    let stage = unbounded(&case.machine);
    let one = |experiment: &Experiment| {
        reach(&stage, &experiment.inputs[0], experiment.initial, experiment.every, experiment.until)
    };
    case.experiments.iter().filter_map(one).collect()
}

/// How far an input goes on a machine; none where the run does not get to its end.
pub(super) fn reach(stage: &Machine, input: &Signal, initial: State, every: f64, until: f64) -> Option<Reached> {
    let mut reached = Reached { positions: [f64::INFINITY, f64::NEG_INFINITY], ..Reached::default() };
    let experiment = Experiment { name: String::new(), inputs: vec![input.clone()], until, every, initial, log: None };
    let mut bench = Bench::default();
    bench.mount(stage).ok()?;
    let outcome = bench.run(&experiment, Detail::Full, &mut |block| {
        let most = |name: &str, most: f64| {
            block.get(name).unwrap_or_default().iter().fold(most, |most: f64, value| most.max(value.abs()))
        };
        reached.current = most("motor_current", reached.current);
        reached.speed = most("cart_speed", reached.speed);
        for &x in block.get("cart_position").unwrap_or_default() {
            reached.positions = [reached.positions[0].min(x), reached.positions[1].max(x)];
        }
        for &t in block.get("time").unwrap_or_default() {
            reached.input = reached.input.max(input.value(t).abs());
        }
        Flow::Continue
    });
    let complete = outcome.is_ok_and(|outcome| outcome.ending == Ending::Complete);
    (complete && reached.positions[1].is_finite()).then_some(reached)
}
