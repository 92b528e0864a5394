//! Exact sensitivities against differences of runs, on random stages with every element.

use crate::common;
use crate::common::gantries::{self, Lacks};
use crate::common::random::{Dry, cases, lined};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::sync::Arc;
use taut::case::Experiment;
use taut::friction::Motion;
use taut::machine::Machine;
use taut::mechanism::{BODIES, Cause, Drive, Equations, State};
use taut::parameter::{self, Free};
use taut::signal::{Hold, Signal};
use taut::solve::{Begun, Bench, Detail, Differentiated, Ending, Flow, Sensitivities, Variable};

/// Columns that are differentiated.
const COLUMNS: [&str; 6] =
    ["drive_angle", "drive_speed", "cart_position", "cart_speed", "motor_current", "span1_force"];

/// A stage, and what is done with it.
#[derive(Debug, Clone)]
struct Setup {
    machine: Machine,
    times: Vec<f64>,
    values: Vec<f64>,
    hold: Hold,
    delay: f64,
    offset: f64,
    speed: f64,
    position: f64,
}

const UNTIL: f64 = 0.12;
const EVERY: f64 = 1e-3;

impl Setup {
    fn experiment(&self) -> Experiment {
        let times = self.times.iter().map(|t| t + self.delay).collect();
        let values = self.values.iter().map(|u| u + self.offset).collect();
        let initial = self.machine.without_strain(&[self.position], &[self.speed]);
        let input = Signal::Sampled { times, values, hold: self.hold };
        Experiment { name: "drawn".into(), inputs: vec![input], until: UNTIL, every: EVERY, initial, log: None }
    }

    /// The columns of a run, and the number of its events; none where it does not reach its end.
    fn run(&self) -> Option<(Vec<Vec<f64>>, Vec<String>)> {
        let mut columns = vec![Vec::new(); COLUMNS.len()];
        let mut bench = Bench::default();
        bench.mount(&self.machine).ok()?;
        let outcome = bench.run(&self.experiment(), Detail::Full, &mut |block| {
            for (column, name) in columns.iter_mut().zip(COLUMNS) {
                column.extend_from_slice(block.get(name).unwrap_or(&[]));
            }
            Flow::Continue
        });
        let outcome = outcome.ok().filter(|outcome| outcome.ending == Ending::Complete)?;
        let told = |event: &taut::solve::Event| format!("{} {:?} {:?}", event.part.key(), event.from, event.to);
        Some((columns, outcome.events.iter().map(told).collect()))
    }

    fn begun(&self) -> Begun {
        let mechanism = Arc::new(self.machine.mechanism());
        Begun { start: mechanism.begun(&self.experiment().initial), mechanism }
    }

    /// The outputs that belong to the columns it has.
    fn outputs(&self) -> Vec<(usize, Differentiated)> {
        let mechanism = self.machine.mechanism();
        let shown = |name: &str| mechanism.columns.iter().find(|heading| heading.name == name).map(|h| h.shown);
        let found = COLUMNS.iter().enumerate().filter_map(|(i, name)| Some((i, Differentiated::Shown(shown(name)?))));
        found.collect()
    }
}

/// A variable by its name: what it does to a setup when it is changed by this much.
#[derive(Debug, Clone)]
enum Change {
    Number(Free),
    Delay,
    Offset,
    Speed,
    Position,
}

impl Change {
    fn name(&self) -> &str {
        match self {
            Change::Number(free) => &free.name,
            Change::Delay => "delay",
            Change::Offset => "offset",
            Change::Speed => "start speed",
            Change::Position => "start position",
        }
    }

    /// Its size.
    fn size(&self) -> f64 {
        match self {
            Change::Number(free) => free.start.abs(),
            Change::Delay => 1e-3,
            Change::Offset => 1.0,
            Change::Speed => 0.1,
            Change::Position => 1e-2,
        }
    }

    fn moved(&self, setup: &Setup, by: f64) -> Setup {
        let mut moved = setup.clone();
        match self {
            Change::Number(free) => free.set(&mut moved.machine, free.start + by),
            Change::Delay => moved.delay += by,
            Change::Offset => moved.offset += by,
            Change::Speed => moved.speed += by,
            Change::Position => moved.position += by,
        }
        moved
    }

    fn variable(&self, setup: &Setup) -> Variable {
        match self {
            Change::Delay => Variable::Delay { drive: None, unit: 1.0 },
            Change::Offset => Variable::Offset { drive: 0, unit: 1.0, from: setup.times[0] + setup.delay },
            Change::Number(_) | Change::Speed | Change::Position => {
                Variable::central(3e-5 * self.size(), |by| self.moved(setup, by).begun())
            }
        }
    }
}

/// Keys of numbers that are no machine's: tables, and what other numbers follow from.
fn numbers(machine: &Machine) -> Vec<Free> {
    let own = parameter::values(machine).into_iter().filter(|(_, value)| *value != 0.0 && value.is_finite());
    own.filter_map(|(key, _)| Free::new(machine, &key, &[], &[]).ok()).collect()
}

fn setup(dry: Dry) -> impl Strategy<Value = Setup> {
    let sample = (2e-3..2e-2_f64, -12.0..12.0_f64);
    let start = prop_oneof![2 => Just((0.0, 0.0)), 1 => (-0.5..0.5_f64, -0.02..0.02_f64)];
    let hold = prop_oneof![2 => Just(Hold::Zero), 1 => Just(Hold::Linear)];
    (lined(dry), prop::collection::vec(sample, 6..30), hold, 1e-5..3e-3_f64, start).prop_map(
        |(machine, samples, hold, delay, (speed, position))| {
            let (mut time, mut times, mut values) = (0.0, Vec::new(), Vec::new());
            for (wait, value) in samples {
                times.push(time);
                values.push(value);
                time += wait;
            }
            // Within the stops.
            let position = match &machine.cart.travel {
                Some(travel) => 0.5 * position.clamp(travel.min, travel.max),
                None => position,
            };
            Setup { machine, times, values, hold, delay, offset: 0.0, speed, position }
        },
    )
}

/// Slopes by central differences of two steps, by Richardson, and by how much that is off, row by row.
struct Differences {
    slope: Vec<Vec<f64>>,
    error: Vec<Vec<f64>>,
}

impl Differences {
    fn new(setup: &Setup, change: &Change, events: &[String], h: f64) -> Option<Self> {
        let h = h * change.size();
        let at = |by: f64| change.moved(setup, by).run().filter(|(_, own)| own == events).map(|(columns, _)| columns);
        let runs = [1.0, 0.5, 0.25].map(|part| Some((at(h * part)?, at(-h * part)?, h * part)));
        let [wide, middle, narrow] = runs;
        let slope = |(up, down, h): &(Vec<Vec<f64>>, Vec<Vec<f64>>, f64), i: usize, k: usize| {
            (up[i][k] - down[i][k]) / (2.0 * h)
        };
        let (wide, middle, narrow) = (wide?, middle?, narrow?);
        let (mut slopes, mut errors) = (Vec::new(), Vec::new());
        for i in 0..COLUMNS.len() {
            let (mut own, mut error) = (Vec::new(), Vec::new());
            for k in 0..wide.0[i].len() {
                let [a, b, c] = [slope(&wide, i, k), slope(&middle, i, k), slope(&narrow, i, k)];
                let (first, second) = ((4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0);
                own.push(second + (second - first) / 15.0);
                error.push((second - first).abs());
            }
            slopes.push(own);
            errors.push(error);
        }
        Some(Self { slope: slopes, error: errors })
    }
}

/// Of an output a change of the variable by its own size does no less than this part, or it does not count.
const FLOOR: f64 = 1e-4;

/// Rows to each side of one whose differences have to settle, too: one alone may by chance.
const BESIDE: usize = 4;

impl Differences {
    /// By how much the slope in a row may be off.
    fn error(&self, column: usize, row: usize) -> f64 {
        let errors = &self.error[column];
        let beside = row.saturating_sub(BESIDE)..(row + BESIDE + 1).min(errors.len());
        errors[beside].iter().copied().fold(0.0, f64::max)
    }
}

/// The slope that settles best, as far as it does and another one agrees.
fn settled(mut all: Vec<(f64, f64)>, size: f64) -> Option<(f64, f64)> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (best, next) = (all.first()?, all.get(1)?);
    (best.0 < 1e-8 * size && (best.1 - next.1).abs() < 3e-8 * size).then_some(*best)
}

/// How many rows were compared, and of those that could have been.
#[derive(Default)]
struct Count {
    compared: usize,
    rows: usize,
    stages: usize,
    without: usize,
    /// By variable.
    by: std::collections::BTreeMap<String, (usize, usize)>,
}

fn compare(setup: &Setup, changes: &[Change], count: &mut Count) -> Result<(), String> {
    let Some((values, events)) = setup.run() else { return Ok(()) };
    let outputs = setup.outputs();
    let variables: Vec<Variable> = changes.iter().map(|change| change.variable(setup)).collect();
    let shown: Vec<Differentiated> = outputs.iter().map(|(_, shown)| *shown).collect();
    let mut bench = Bench::default();
    bench.mount(&setup.machine).map_err(|error| error.to_string())?;
    let exact = bench.sensitivities(&setup.experiment(), &variables, &shown).map_err(|error| error.to_string())?;
    count.stages += 1;
    let Some(Sensitivities { columns, .. }) = exact else {
        count.without += 1;
        return Ok(());
    };
    for (j, change) in changes.iter().enumerate() {
        let differences = [1e-3, 1e-4, 1e-5].map(|h| Differences::new(setup, change, &events, h));
        let known = count.by.entry(change.name().to_string()).or_default();
        for (place, (i, _)) in outputs.iter().enumerate() {
            let own = &columns[place][j];
            let most = |values: &[f64]| values.iter().copied().fold(0.0, |most: f64, value| most.max(value.abs()));
            // What a variable does to an output that is less than this is less than rounding does.
            let size = most(own).max(FLOOR * most(&values[*i]) / change.size());
            count.rows += own.len();
            known.1 += own.len();
            for (k, &value) in own.iter().enumerate() {
                let all = differences.iter().flatten().map(|d| (d.error(*i, k), d.slope[*i][k]));
                let Some((_, slope)) = settled(all.collect(), size) else { continue };
                count.compared += 1;
                known.0 += 1;
                if (value - slope).abs() > 1e-7 * size {
                    let (name, column, time) = (change.name(), COLUMNS[*i], k as f64 * EVERY);
                    return Err(format!("{column} by {name} at {time:.3} s: {value:e}, not {slope:e}; most {size:e}"));
                }
            }
        }
    }
    Ok(())
}

/// Random stages with limits, play, losses, slack spans, end stops, inductance, reduced belts and friction of every
/// kind, each differentiated by four of its numbers, the delay and the offset of its input and where it starts.
#[test]
fn sensitivities_are_what_differences_tend_to() {
    let mut runner = TestRunner::new(cases(200));
    let mut count = Count::default();
    let mut wrong = Vec::new();
    let strategy = (setup(Dry::Any), prop::collection::vec(0.0..1.0_f64, 4));
    for number in 0..200 {
        let (setup, picks) = strategy.new_tree(&mut runner).expect("a stage").current();
        let own = numbers(&setup.machine);
        let mut changes: Vec<Change> =
            picks.iter().map(|pick| Change::Number(own[(pick * own.len() as f64) as usize].clone())).collect();
        changes.extend([Change::Delay, Change::Offset, Change::Position]);
        if setup.speed != 0.0 {
            changes.push(Change::Speed);
        }
        if let Err(error) = compare(&setup, &changes, &mut count) {
            wrong.push(format!("{number}: {error}"));
        }
    }
    let Count { compared, rows, stages, without, by } = count;
    for (name, (compared, rows)) in by {
        println!("{name}: {compared} of {rows}");
    }
    println!("{stages} stages, {without} without; {compared} of {rows} values");
    assert!(wrong.is_empty(), "{} of {stages}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(10 * without < stages && 10 * compared > 7 * rows, "{without} of {stages}, {compared} of {rows}");
}

/// Derivatives of a mode are put together from modes in which all bodies move alike.
#[test]
fn the_equation_of_a_body_depends_on_its_own_motion_alone() {
    let mut runner = TestRunner::new(cases(200));
    let strategy = (lined(Dry::Any), prop::collection::vec(0..3_usize, BODIES));
    let mut seen = [0; 3];
    for number in 0..200 {
        let (axis, picks) = strategy.new_tree(&mut runner).expect("a stage").current();
        let machine = if number % 2 == 0 { axis } else { gantries::drawn(number, Lacks::Nothing).case.machine };
        let mechanism = machine.mechanism();
        if mechanism.drives.iter().any(Drive::loses) {
            continue;
        }
        let motions = [Motion::Forward, Motion::Backward, Motion::Stuck];
        let mut mode = mechanism.first_mode(&State::default());
        for body in 0..mechanism.bodies.len() {
            let pick = picks[mechanism.leader(body)];
            mode.motion[body] = motions[pick];
            seen[pick] += 1;
        }
        let all = mechanism.equations(mode);
        let guards = |equations: &Equations, body: usize| {
            let own =
                |cause| matches!(cause, Cause::Stop(b) | Cause::BreakForward(b) | Cause::BreakBackward(b) if b == body);
            let guards = equations.guards.iter().filter(|guard| own(guard.transition.cause));
            guards.map(|guard| (guard.transition.cause, guard.form)).collect::<Vec<_>>()
        };
        for body in 0..mechanism.bodies.len() {
            let mut alike = mode;
            alike.motion = [mode.motion[body]; BODIES];
            let alike = mechanism.equations(alike);
            assert_eq!(all.acceleration[body], alike.acceleration[body], "{number}: {machine:?}");
            assert_eq!(guards(&all, body), guards(&alike, body), "{number}: {machine:?}");
        }
    }
    assert!(seen.iter().all(|count| *count > 100), "{seen:?}");
}

/// A curved law needs the general solver, and friction where there was none makes another machine: no derivatives, and
/// not wrong ones.
#[test]
fn where_there_are_no_derivatives_there_are_none() {
    let experiment = common::experiment(Signal::Step { value: 5.0, at: 0.0 }, 0.05);
    let speed = Differentiated::Shown(taut::mechanism::Shown::Speed(taut::machine::axis::CART, 1.0));
    let derivatives = |machine: &Machine, key: &str| {
        let free = Free::new(machine, key, &[], &[]).unwrap();
        let variable = Variable::central(1e-3, |by| {
            let mut machine = machine.clone();
            free.set(&mut machine, free.start + by);
            let mechanism = Arc::new(machine.mechanism());
            Begun { start: mechanism.begun(&experiment.initial), mechanism }
        });
        let mut bench = Bench::default();
        bench.mount(machine).unwrap();
        bench.sensitivities(&experiment, &[variable], &[speed]).unwrap()
    };
    assert!(derivatives(&common::table4(), "cart.friction.coulomb").is_some());
    assert!(derivatives(&common::with_stribeck(common::table4()), "cart.friction.coulomb").is_none());
    let mut smooth = common::table4();
    (smooth.cart.friction.forward.coulomb, smooth.cart.friction.backward.coulomb) = (0.0, 0.0);
    (smooth.cart.friction.forward.breakaway, smooth.cart.friction.backward.breakaway) = (0.0, 0.0);
    assert!(derivatives(&smooth, "cart.friction.coulomb").is_none());
    let unmounted = Bench::default().sensitivities(&experiment, &[], &[speed]).unwrap_err().to_string();
    assert_eq!(unmounted, "there is no stage to run\n  next: take one up with Bench::mount");
}
