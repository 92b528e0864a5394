//! Limits of an experiment, and their use.

use super::Request;
use crate::case::{Case, Experiment};
use crate::error::{Error, Result};
use crate::machine::{AmplifierMode, DriveUnit, Machine, Travel};
use crate::mechanism::State;
use crate::signal::Signal;
use crate::solve::{Bench, Detail, Ending, Flow};

/// Origin of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// The request.
    Asked,
    /// The machine of the case.
    Machine,
    /// The largest value in the case's own experiments.
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
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Greatest input of any drive, V or A, before the amplifier's gain.
    pub input: (f64, Origin),
    /// Greatest current of any motor, A, if there is a limit.
    pub current: Option<(f64, Origin)>,
    /// Travel available to each sliding part, m.
    pub travel: Vec<(f64, Origin)>,
    /// Middle of the travel, if the case defines it.
    pub middle: Vec<Option<f64>>,
    /// Fraction of each that is kept free.
    pub margin: f64,
}

/// Extremes of an experiment.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Reached {
    /// Greatest input, V or A.
    pub input: f64,
    /// Greatest current, A.
    pub current: f64,
    /// Least and greatest position of each sliding part, m.
    pub positions: Vec<[f64; 2]>,
    /// Greatest speed of any, m/s.
    pub speed: f64,
}

impl Reached {
    /// Greatest minus least position of a sliding part, m.
    pub fn way(&self, slide: usize) -> f64 {
        self.positions[slide][1] - self.positions[slide][0]
    }
}

impl Limits {
    pub(super) fn new(case: &Case, request: &Request) -> Result<Self> {
        let drives = &case.machine.drives;
        let seen = seen(case);
        let most = |of: &dyn Fn(&Reached) -> f64| {
            seen.iter().map(of).filter(|value| *value > 0.0).reduce(f64::max).map(|value| (value, Origin::Experiments))
        };
        let machine = |of: &dyn Fn(&DriveUnit) -> Option<f64>| {
            drives.iter().filter_map(of).reduce(f64::min).map(|limit| (limit, Origin::Machine))
        };
        let of_input = machine(&|DriveUnit { amplifier, .. }: &DriveUnit| {
            let limit = match amplifier.mode {
                AmplifierMode::Voltage => amplifier.voltage_limit,
                AmplifierMode::Current | AmplifierMode::Position => amplifier.current_limit,
            };
            limit.map(|limit| limit / amplifier.gain.abs())
        });
        let asked = |value: Option<f64>| value.map(|value| (value, Origin::Asked));
        let input = asked(request.input).or(of_input).or_else(|| most(&|one| one.input)).ok_or_else(|| {
            Error::new("the input is unlimited: the amplifier has no limit, and the case no experiment")
                .next("say how large it may get with --amplitude, or give amplifier.voltage_limit or current_limit")
        })?;
        if let (Some((limit, _)), Some(asked)) = (of_input, request.input)
            && asked > limit
        {
            return Err(Error::new(format!("an input of {asked} is beyond what the amplifier gives"))
                .allowed(format!("up to {limit}"))
                .next("reduce --amplitude: beyond its limit the amplifier saturates"));
        }
        let current = asked(request.current).or(machine(&|drive: &DriveUnit| drive.amplifier.current_limit));
        let (mut travel, mut middle) = (Vec::new(), Vec::new());
        for (slide, (label, own)) in case.machine.travels().enumerate() {
            let of_machine = own.map(|Travel { min, max, .. }| (max - min, Origin::Machine));
            if let (Some((length, _)), Some(asked)) = (of_machine, request.travel)
                && asked > length
            {
                return Err(Error::new(format!("{asked} m is more than the travel of the case"))
                    .allowed(format!("up to {length} m")));
            }
            let seen = || most(&|one| one.way(slide));
            travel.push(asked(request.travel).or(of_machine).or_else(seen).ok_or_else(|| {
                match label.key {
                    "cart" if case.machine.has_one_coordinate() => {
                        Error::new("the travel of the cart is unlimited: the case has no [travel] and no experiment")
                            .next("say how far it may go with --travel \"0.4 m\", or add [travel] with min and max")
                    }
                    key => Error::new(format!(
                        "the travel of the {} is unlimited: the case has no {key}.travel, and no experiment moves it",
                        label.name
                    ))
                    .next(format!(
                        "say how far it may go with --travel \"0.4 m\", or add {key}.travel with min and max"
                    )),
                }
            })?);
            middle.push(own.map(|travel| 0.5 * (travel.min + travel.max)));
        }
        Ok(Self { input, current, travel, middle, margin: request.margin })
    }

    /// Greatest used share of the limits without the margin: 1 is just within.
    pub fn used(&self, reached: &Reached) -> f64 {
        let room = 1.0 - self.margin;
        let current = self.current.map_or(0.0, |(limit, _)| reached.current / (room * limit));
        let ways = self.travel.iter().enumerate().map(|(slide, (limit, _))| reached.way(slide) / (room * limit));
        (reached.input / (room * self.input.0)).max(ways.fold(current, f64::max))
    }
}

/// The machine with unlimited travel, since travel is checked afterwards; spans that follow the cart keep their travel.
pub(super) fn unbounded(stage: &Machine) -> Machine {
    let mut stage = stage.clone();
    if !stage.belt.follows_cart {
        stage.cart.travel = None;
        stage.bridge.iter_mut().for_each(|bridge| bridge.travel = None);
    }
    stage
}

/// Extremes of the case's own experiments, without those that end early.
fn seen(case: &Case) -> Vec<Reached> {
    let stage = unbounded(&case.machine);
    let one = |experiment: &Experiment| {
        reach(&stage, &experiment.inputs, experiment.initial, experiment.every, experiment.until)
    };
    case.experiments.iter().filter_map(one).collect()
}

/// Extremes of a run with these inputs; `None` if it ends early.
pub(super) fn reach(stage: &Machine, inputs: &[Signal], initial: State, every: f64, until: f64) -> Option<Reached> {
    let geometry = stage.geometry();
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let mut reached = Reached { positions: vec![none; geometry.slides.len()], ..Reached::default() };
    let experiment = Experiment { name: String::new(), inputs: inputs.to_vec(), until, every, initial, log: None };
    let mut bench = Bench::default();
    bench.mount(stage).ok()?;
    let outcome = bench.run(&experiment, Detail::Full, &mut |block| {
        let most = |name: &str, most: f64| {
            block.get(name).unwrap_or_default().iter().fold(most, |most: f64, value| most.max(value.abs()))
        };
        for drive in geometry.drives {
            reached.current = most(drive.current_column, reached.current);
        }
        for (slide, positions) in geometry.slides.iter().zip(&mut reached.positions) {
            let name = geometry.label(slide.body).key;
            reached.speed = most(&format!("{name}_speed"), reached.speed);
            for &x in block.get(&format!("{name}_position")).unwrap_or_default() {
                *positions = [positions[0].min(x), positions[1].max(x)];
            }
        }
        for &t in block.get("time").unwrap_or_default() {
            reached.input = inputs.iter().fold(reached.input, |most, input| most.max(input.value(t).abs()));
        }
        Flow::Continue
    });
    let complete = outcome.is_ok_and(|outcome| outcome.ending == Ending::Complete);
    (complete && reached.positions.iter().all(|[_, most]| most.is_finite())).then_some(reached)
}
