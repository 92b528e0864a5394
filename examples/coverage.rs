//! How often 95 % intervals hold the truth: machines with random friction and mass, logs with a disturbance that is
//! known, a fit each.
//!
//! `cargo xtask coverage [--machines N] [--seed N] [--threads N] [--cell WORDS]...` prints a table; with `--causes` for
//! machines that differ from a rigid axis with viscous and Coulomb friction, integrated without taut's solvers, and for
//! gantries that lack one element, and with `--told` the findings of each.

// Each of them is used in part.
#[allow(dead_code)]
#[path = "../tests/common"]
mod common {
    pub mod chance;
    pub mod gantries;
    pub mod logged;
    pub mod truths;
}

use common::gantries::{self, Lacks};
use common::truths::{Truth, drawn};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use taut::case::{Case, Plan, TEMPLATE};
use taut::chance::normal;
use taut::fit::least_squares::{Differences, Residuals};
use taut::fit::{Finding, Grade, Problem, fit, inverse_of_square};
use taut::friction::{Law, Shape};
use taut::log::{Log, Output, Quantity};
use taut::machine::axis::{CART, DRIVE, IDLER};
use taut::mechanism::State;
use taut::signal::{Hold, Signal};
use taut::solve::{Flow, Solver, simulate};

/// The free parameters.
const KEYS: [&str; 3] = ["cart.friction.viscous", "cart.friction.coulomb", "cart.mass"];

/// Counts of the encoder in a turn.
const COUNTS: f64 = 2048.0;

/// Between samples, s.
const EVERY: f64 = 1e-3;

/// Parts into which a log is cut where friction drifts along it.
const PARTS: usize = 20;

/// The error of the angle, or of the machine.
#[derive(Clone, Copy)]
enum Fault {
    /// White noise, rad.
    White(f64),
    /// First order: rad, s; and white noise beside it, rad.
    First(f64, f64, f64),
    /// Two of them: rad, s, rad, s; and white noise.
    Two(f64, f64, f64, f64, f64),
    /// Swings: rad, Hz, s, infinite for a tone; and white noise.
    Swinging(f64, f64, f64, f64),
    /// A random walk of so much in a second, rad; and white noise.
    Walk(f64, f64),
    /// A mean of white noise over so many samples, rad.
    Mean(usize, f64),
    /// A pulley out of centre: rad, times in a turn; and white noise.
    Cogging(f64, f64, f64),
    /// White noise that grows with speed: rad at rest, rad per rad/s.
    Uneven(f64, f64),
    /// Friction drifts along each log by this share to each side, with white noise, rad.
    Drift(f64, f64),
    /// The same, up in some and down in others.
    DriftEither(f64, f64),
    /// Each log has a friction of its own, off by this share, with white noise.
    Campaigns(f64, f64),
    /// Breakaway over Coulomb friction, Stribeck velocity, m/s, white noise.
    Stribeck(f64, f64, f64),
    /// Only counts, so many of the encoder's at once.
    Counts(f64),
}

/// A kind of machine with its logs.
struct Cell {
    name: &'static str,
    /// Logs, by name.
    logs: &'static [&'static str],
    fault: Fault,
}

const SHORT: &[&str] = &["there and back"];
const LONG: &[&str] = &["steps"];
const FOUR: &[&str] = &["there and back", "steps", "slow", "there and back"];

const CELLS: &[Cell] = &[
    Cell { name: "white 10 mrad; 1.5 s", logs: SHORT, fault: Fault::White(10e-3) },
    Cell { name: "first order 5 mrad, 20 ms; 1.5 s", logs: SHORT, fault: Fault::First(5e-3, 0.02, 0.0) },
    Cell { name: "the same + white 10 mrad; 1.5 s", logs: SHORT, fault: Fault::First(5e-3, 0.02, 10e-3) },
    Cell {
        name: "first order 5 mrad, 100 ms + white 10 mrad; 1.5 s",
        logs: SHORT,
        fault: Fault::First(5e-3, 0.1, 10e-3),
    },
    Cell { name: "white 10 mrad; 4 s", logs: LONG, fault: Fault::White(10e-3) },
    Cell { name: "first order 5 mrad, 20 ms; 4 s", logs: LONG, fault: Fault::First(5e-3, 0.02, 0.0) },
    Cell { name: "the same + white 10 mrad; 4 s", logs: LONG, fault: Fault::First(5e-3, 0.02, 10e-3) },
    Cell { name: "first order 5 mrad, 100 ms + white 10 mrad; 4 s", logs: LONG, fault: Fault::First(5e-3, 0.1, 10e-3) },
    Cell { name: "friction drifts by ±10 %, white 1 mrad; four logs", logs: FOUR, fault: Fault::Drift(0.1, 1e-3) },
    Cell {
        name: "friction drifts by ±10 % up or down, white 1 mrad; four logs",
        logs: FOUR,
        fault: Fault::DriftEither(0.1, 1e-3),
    },
    Cell { name: "friction drifts by ±10 %, white 10 mrad; four logs", logs: FOUR, fault: Fault::Drift(0.1, 10e-3) },
    Cell {
        name: "friction differs by ±10 % from log to log, white 1 mrad; four logs",
        logs: FOUR,
        fault: Fault::Campaigns(0.1, 1e-3),
    },
    Cell { name: "Stribeck in truth, white 1 mrad; 4 s", logs: LONG, fault: Fault::Stribeck(1.5, 0.03, 1e-3) },
    Cell { name: "Stribeck in truth, white 1 mrad; four logs", logs: FOUR, fault: Fault::Stribeck(1.5, 0.03, 1e-3) },
    Cell { name: "counts of 12 mrad; 4 s", logs: LONG, fault: Fault::Counts(4.0) },
    Cell {
        name: "first order 3 mrad, 10 ms and 200 ms + white 5 mrad; 4 s",
        logs: LONG,
        fault: Fault::Two(3e-3, 0.01, 3e-3, 0.2, 5e-3),
    },
    Cell {
        name: "swings at 8 Hz, 5 mrad, 100 ms + white 5 mrad; 4 s",
        logs: LONG,
        fault: Fault::Swinging(5e-3, 8.0, 0.1, 5e-3),
    },
    Cell {
        name: "a tone of 50 Hz, 10 mrad + white 0.1 mrad; 4 s",
        logs: LONG,
        fault: Fault::Swinging(10e-3, 50.0, f64::INFINITY, 1e-4),
    },
    Cell {
        name: "a tone of 17.3 Hz, 10 mrad + white 0.1 mrad; 4 s",
        logs: LONG,
        fault: Fault::Swinging(10e-3, 17.3, f64::INFINITY, 1e-4),
    },
    Cell { name: "random walk 5 mrad in 1 s + white 5 mrad; 4 s", logs: LONG, fault: Fault::Walk(5e-3, 5e-3) },
    Cell { name: "mean of 20, 5 mrad; 4 s", logs: LONG, fault: Fault::Mean(20, 5e-3) },
    Cell {
        name: "cogging 3 mrad, 5 in a turn + white 3 mrad; 4 s",
        logs: LONG,
        fault: Fault::Cogging(3e-3, 5.0, 3e-3),
    },
    Cell { name: "white 2 mrad + 1 mrad per rad/s; 4 s", logs: LONG, fault: Fault::Uneven(2e-3, 1e-3) },
];

/// The inputs that a log may have: value and how long, s.
fn input(log: &str) -> (&'static [(f64, f64)], f64) {
    match log {
        "steps" => {
            (&[(5.0, 0.4), (0.0, 0.3), (-8.0, 0.35), (0.0, 0.3), (3.0, 0.6), (-3.0, 0.6), (8.0, 0.3), (-5.0, 0.3)], 4.0)
        }
        "slow" => (&[(3.0, 0.6), (0.0, 0.2), (-3.0, 0.6), (4.0, 0.3), (0.0, 0.2), (-4.0, 0.3)], 3.0),
        _ => (&[(5.0, 0.25), (0.0, 0.25), (-5.0, 0.25)], 1.5),
    }
}

struct Chance(Pcg64);

impl Chance {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.0.next_u64() >> 11) as f64 * 2f64.powi(-53))
    }

    fn normal(&mut self) -> f64 {
        normal(&mut self.0)
    }
}

impl Fault {
    /// The error that it adds to the angle `phi` with this speed.
    fn add(self, phi: &[f64], chance: &mut Chance) -> Vec<f64> {
        let n = phi.len();
        let first = |deviation: f64, time: f64, chance: &mut Chance| -> Vec<f64> {
            let decay = (-EVERY / time).exp();
            let mut x = deviation * chance.normal();
            (0..n)
                .map(|_| {
                    let own = x;
                    x = decay * x + deviation * (1.0 - decay * decay).sqrt() * chance.normal();
                    own
                })
                .collect()
        };
        let mut added = vec![0.0; n];
        let mut white = 0.0;
        let add = |added: &mut Vec<f64>, other: Vec<f64>| added.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        match self {
            Fault::White(deviation)
            | Fault::Drift(_, deviation)
            | Fault::DriftEither(_, deviation)
            | Fault::Campaigns(_, deviation)
            | Fault::Stribeck(_, _, deviation) => {
                white = deviation;
            }
            Fault::First(deviation, time, beside) => {
                add(&mut added, first(deviation, time, chance));
                white = beside;
            }
            Fault::Two(a, quick, b, slow, beside) => {
                add(&mut added, first(a, quick, chance));
                add(&mut added, first(b, slow, chance));
                white = beside;
            }
            Fault::Swinging(deviation, frequency, time, beside) => {
                let (a, b) = (first(deviation, time, chance), first(deviation, time, chance));
                let angle = |k: usize| TAU * frequency * k as f64 * EVERY;
                add(&mut added, (0..n).map(|k| a[k] * angle(k).cos() + b[k] * angle(k).sin()).collect());
                white = beside;
            }
            Fault::Walk(deviation, beside) => {
                let mut x = 0.0;
                for added in &mut added {
                    x += deviation * EVERY.sqrt() * chance.normal();
                    *added += x;
                }
                white = beside;
            }
            Fault::Mean(count, deviation) => {
                let raw: Vec<f64> = (0..n + count).map(|_| chance.normal()).collect();
                let scale = deviation / (count as f64).sqrt();
                add(&mut added, raw.windows(count).take(n).map(|w| scale * w.iter().sum::<f64>()).collect());
            }
            Fault::Cogging(deviation, times, beside) => {
                let phase = chance.between(0.0, TAU);
                add(&mut added, phi.iter().map(|phi| deviation * (times * phi + phase).sin()).collect());
                white = beside;
            }
            Fault::Uneven(rest, slope) => {
                for k in 0..n {
                    let speed = (phi[(k + 1).min(n - 1)] - phi[k.saturating_sub(1)]) / (2.0 * EVERY);
                    added[k] += (rest + slope * speed.abs()) * chance.normal();
                }
            }
            Fault::Counts(_) => {}
        }
        added.iter_mut().for_each(|a| *a += white * chance.normal());
        added
    }
}

/// The case with the logs of a machine, and the variance of the angle's error where it is one of noise.
fn recorded(cell: &Cell, truth: [f64; 3], chance: &mut Chance) -> Case {
    let mut case = Case::from_text("axis.toml", TEMPLATE).unwrap_or_else(|error| panic!("{error}"));
    let pattern = case.experiments[0].clone();
    case.experiments.clear();
    let mut share: Vec<f64> = Vec::new();
    if let Fault::Campaigns(off, _) = cell.fault {
        share = cell.logs.iter().map(|_| chance.between(-off, off)).collect();
        let mean = share.iter().sum::<f64>() / share.len() as f64;
        share.iter_mut().for_each(|s| *s -= mean);
    }
    for (place, name) in cell.logs.iter().enumerate() {
        let (pieces, until) = input(name);
        let count = (until / EVERY).round() as usize;
        let mut voltage = vec![0.0; count + 1];
        let mut k = 0;
        for (value, lasts) in pieces {
            let next = k + (lasts / EVERY).round() as usize;
            voltage[k..next.min(count + 1)].fill(*value);
            k = next;
        }
        let mut angle = Vec::with_capacity(count + 1);
        let parts = if matches!(cell.fault, Fault::Drift(..) | Fault::DriftEither(..)) { PARTS } else { 1 };
        let mut initial = State::default();
        let sign = if matches!(cell.fault, Fault::DriftEither(..)) { chance.normal().signum() } else { 1.0 };
        for part in 0..parts {
            let (begin, end) = (count * part / parts, count * (part + 1) / parts);
            let off = match cell.fault {
                Fault::Drift(off, _) | Fault::DriftEither(off, _) => {
                    sign * off * ((2 * part + 1) as f64 / parts as f64 - 1.0)
                }
                _ => share.get(place).copied().unwrap_or(0.0),
            };
            let mut machine = case.machine.clone();
            machine.cart.mass = truth[2];
            let friction = &mut machine.cart.friction;
            for side in [&mut friction.forward, &mut friction.backward] {
                side.viscous = truth[0] * (1.0 + off);
                side.coulomb = truth[1] * (1.0 + off);
                side.breakaway = side.coulomb;
                if let Fault::Stribeck(ratio, ..) = cell.fault {
                    side.breakaway = ratio * side.coulomb;
                }
            }
            if let Fault::Stribeck(_, velocity, _) = cell.fault {
                friction.law = Law::Stribeck { velocity, shape: Shape::Gaussian };
            }
            let rows = begin..=end;
            let input = Signal::Sampled {
                times: rows.clone().map(|k| (k - begin) as f64 * EVERY).collect(),
                values: voltage[rows].to_vec(),
                hold: Hold::Zero,
            };
            let mut experiment = pattern.clone();
            (experiment.inputs[0], experiment.initial, experiment.every) = (input, initial, EVERY);
            experiment.until = (end - begin) as f64 * EVERY;
            let run = simulate(&machine, &experiment, Solver::for_machine(&machine))
                .unwrap_or_else(|error| panic!("{error}"))
                .trajectory;
            let column = |name: &str| run.get(name).unwrap_or_else(|| panic!("no column {name}"));
            let last = |name: &str| *column(name).last().unwrap_or(&0.0);
            angle.extend_from_slice(&column("drive_angle")[usize::from(part > 0)..]);
            for (body, [position, speed]) in [
                (DRIVE, ["drive_angle", "drive_speed"]),
                (CART, ["cart_position", "cart_speed"]),
                (IDLER, ["idler_angle", "idler_speed"]),
            ] {
                (initial.position[body], initial.speed[body]) = (last(position), last(speed));
            }
        }
        let added = cell.fault.add(&angle, chance);
        let step = TAU / COUNTS * if let Fault::Counts(times) = cell.fault { times } else { 1.0 };
        let values = angle.iter().zip(added).map(|(phi, off)| step * ((phi + off) / step).round()).collect();
        let time: Vec<f64> = (0..=count).map(|k| k as f64 * EVERY).collect();
        let log = Log {
            name: format!("{name} {place}"),
            file: Default::default(),
            time: time.clone(),
            inputs: vec![voltage.clone()],
            hold: Hold::Zero,
            added: None,
            reference: None,
            outputs: vec![Output { quantity: Quantity::DriveAngle, absolute: false, values }],
            ended: None,
        };
        let mut experiment = pattern.clone();
        (experiment.name, experiment.until, experiment.every) = (log.name.clone(), until, EVERY);
        experiment.inputs[0] = Signal::Sampled { times: time, values: voltage, hold: Hold::Zero };
        experiment.log = Some(Arc::new(log));
        case.experiments.push(experiment);
    }
    case
}

/// Half-widths of the intervals that noises of first order would have if they were known, with the weights of the fit;
/// none for other faults.
fn known(cell: &Cell, case: &Case, plan: &Plan, truth: [f64; 3], noise: &[(Quantity, f64)]) -> Option<[f64; 3]> {
    let (slow, white) = match cell.fault {
        Fault::White(white) => (vec![], white),
        Fault::First(deviation, time, white) => (vec![(deviation, time)], white),
        Fault::Two(a, quick, b, slow, white) => (vec![(a, quick), (b, slow)], white),
        _ => return None,
    };
    let mut case = case.clone();
    let friction = &mut case.machine.cart.friction;
    for side in [&mut friction.forward, &mut friction.backward] {
        (side.viscous, side.coulomb, side.breakaway) = (truth[0], truth[1], truth[1]);
    }
    case.machine.cart.mass = truth[2];
    let mut problem = Problem::new(&case, plan).ok()?;
    for &(quantity, deviation) in noise {
        problem.weigh(quantity, deviation, true);
    }
    problem.doubt_starts(noise);
    let x = problem.start();
    let mut residuals = vec![0.0; problem.rows()];
    if !problem.evaluate(&x, &mut residuals) {
        return None;
    }
    let bounds = problem.bounds();
    let jacobian = problem.jacobian(&x, &residuals, &bounds, &Differences::Central)?;
    let inverse = inverse_of_square(&jacobian)?;
    let influence = &jacobian * inverse;
    let step = TAU / COUNTS;
    let white = white * white + step * step / 12.0;
    Some(std::array::from_fn(|j| {
        let mut sum = 0.0;
        for (index, run) in problem.runs.iter().enumerate() {
            let (first, n) = (problem.first_row(index), run.time.len());
            let mut moves: Vec<f64> = (0..n).map(|k| influence[(first + k, j)] * run.seen[0].weights[k]).collect();
            // The start is known by the first value, and as far as that is.
            for (k, deviation) in run.extras.iter().filter_map(|extra| extra.known).enumerate() {
                moves[0] += influence[(first + n + k, j)] * case.machine.pulley_radius / deviation;
            }
            sum += moves.iter().map(|w| w * w * white).sum::<f64>();
            for (deviation, time) in &slow {
                let mut state = 0.0;
                for w in &moves {
                    sum += deviation * deviation * (w * w + 2.0 * w * state);
                    state = (state + w) * (-EVERY / time).exp();
                }
            }
        }
        1.96 * sum.sqrt() * problem.slope(j, truth[j])
    }))
}

/// The results of the fits of a cell.
#[derive(Default)]
struct CellResults {
    machines: usize,
    /// Intervals that hold the truth, of the parameters and of the force at tested speeds.
    held: [usize; 4],
    /// Intervals there are.
    there: [usize; 3],
    /// Half-widths over those of a known covariance.
    wide: [Vec<f64>; 3],
    /// Half-widths as a part of the value, and errors.
    relative: [Vec<f64>; 3],
    off: [Vec<f64>; 3],
    refused: usize,
}

fn one(cell: &Cell, seed: u64, found: &Mutex<CellResults>) {
    let mut chance = Chance(Pcg64::seed_from_u64(seed));
    let truth = [chance.between(10.0, 35.0), chance.between(0.1, 1.5), chance.between(0.2, 1.0)];
    let case = recorded(cell, truth, &mut chance);
    let plan = Plan { free: KEYS.iter().map(|key| key.to_string()).collect(), ..Plan::default() };
    let fitted = fit(&case, &plan, None, &mut |_| Flow::Continue);
    let noise = fitted.as_ref().map_or(&[][..], |fitted| &fitted.noise);
    let known = known(cell, &case, &plan, truth, noise);
    let mut found = found.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    found.machines += 1;
    let Ok(fitted) = fitted else {
        found.refused += 1;
        return;
    };
    for (j, estimate) in fitted.estimates.iter().enumerate() {
        let Some([low, high]) = estimate.interval.filter(|ends| ends.iter().all(|end| end.is_finite())) else {
            continue;
        };
        found.there[j] += 1;
        found.held[j] += usize::from(low <= truth[j] && truth[j] <= high);
        found.relative[j].push(0.5 * (high - low) / truth[j]);
        found.off[j].push((estimate.value - truth[j]) / truth[j]);
        if let Some(known) = known {
            found.wide[j].push(0.5 * (high - low) / known[j]);
        }
    }
    // Force F = C + b v at the steady speeds of 3, 5 and 8 V, with its standard error from the covariance.
    let (b, c) = (&fitted.estimates[0], &fitted.estimates[1]);
    if let (Some(sb), Some(sc)) = (b.error, c.error) {
        let correlation = fitted.correlation[0][1];
        let speeds = [0.12, 0.22, 0.35];
        let inside = speeds.iter().filter(|&&v| {
            let off = (c.value - truth[1]) + v * (b.value - truth[0]);
            let variance = sc * sc + 2.0 * v * correlation * sb * sc + v * v * sb * sb;
            off.abs() <= 1.96 * variance.sqrt()
        });
        found.held[3] += inside.count();
    }
}

/// Findings of the fits for one kind of true machine.
#[derive(Default)]
struct Named {
    machines: usize,
    held: [usize; 3],
    /// Half-widths of the mass's interval, relative to it.
    wide: Vec<f64>,
    /// The cause is the right one; another one.
    right: usize,
    wrong: usize,
    /// Intervals that hold, or of which a warning names the right cause.
    safe: usize,
    /// Machines all of whose intervals do.
    safe_machines: usize,
    warned: usize,
}

impl Truth {
    /// The keys of causes that are right of it.
    fn causes(self) -> &'static [&'static str] {
        match self {
            Truth::Right | Truth::NarrowBand => &[],
            Truth::Spring | Truth::SpringAtMotor => &["spring"],
            Truth::Play => &["play"],
            Truth::SensorPlay => &["sensor_play"],
            Truth::Late => &["delay"],
            Truth::LuGre => &["lugre"],
            Truth::Drag => &["drag"],
            Truth::Limited => &["limit"],
            Truth::Drift => &["drift", "sway"],
        }
    }
}

fn named(truth: Truth, seed: u64, is_told: bool, sum: &Mutex<Named>) {
    let (case, values) = drawn(seed, truth);
    let Some(plan) = &case.fit else { return };
    let fitted = fit(&case, plan, None, &mut |_| Flow::Continue);
    let mut sum = sum.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    sum.machines += 1;
    let Ok(fitted) = fitted else { return };
    let inside = |j: usize| {
        let interval = fitted.estimates[j].interval;
        interval.is_some_and(|[low, high]| low <= values[j] && values[j] <= high)
    };
    (0..3).filter(|&j| inside(j)).for_each(|j| sum.held[j] += 1);
    sum.wide.extend(fitted.estimates[0].interval.map(|[low, high]| 0.5 * (high - low) / values[0]));
    let codes = [
        "spring",
        "play",
        "sensor_play",
        "delay",
        "limit",
        "inductance",
        "drag",
        "stribeck",
        "lugre",
        "load",
        "apart",
        "other_law",
        "place",
    ];
    let is_right = |code: &str| truth.causes().contains(&code);
    if is_told {
        let off = |j: usize| if inside(j) { "holds" } else { "does not hold" };
        let lines: Vec<String> = fitted.findings.iter().map(|one| format!("\n  {}: {one}", one.code)).collect();
        eprintln!("{seed}: {}, {}, {}{}", off(0), off(1), off(2), lines.concat());
    }
    // A friction law by its own name.
    let key = |one: &Finding| match (one.code, &fitted.other_law) {
        ("other_law", Some(law)) => law.key,
        (code, _) => code,
    };
    let told: Vec<(&str, Grade)> =
        fitted.findings.iter().filter(|one| codes.contains(&one.code)).map(|one| (key(one), one.grade)).collect();
    sum.right += usize::from(told.iter().any(|(code, _)| is_right(code)));
    sum.wrong += usize::from(told.iter().any(|(code, _)| !is_right(code)));
    sum.warned += usize::from(fitted.findings.iter().any(|one| one.grade == Grade::Warning));
    let is_named = told.iter().any(|(code, grade)| *grade == Grade::Warning && is_right(code));
    sum.safe += (0..3).filter(|&j| is_named || inside(j)).count();
    sum.safe_machines += usize::from(is_named || (0..3).all(inside));
}

/// Calls `work` with the numbers below `count`, in threads.
fn for_each(count: u64, threads: u64, work: impl Fn(u64) + Sync) {
    let next = AtomicU64::new(0);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= count {
                        return;
                    }
                    work(k);
                }
            });
        }
    });
}

/// True if a row with this name is asked for; without words, each is.
fn is_asked(only: &[String], name: &str) -> bool {
    only.is_empty() || only.iter().any(|words| name.contains(words.as_str()))
}

/// Findings of this work on many machines, each with a seed of its own, on several threads.
fn summed<S: Default + Send>(machines: u64, seed: u64, threads: u64, work: impl Fn(u64, &Mutex<S>) + Sync) -> S {
    let sum = Mutex::new(S::default());
    for_each(machines, threads, |k| work(seed.wrapping_mul(1_000_003) + k, &sum));
    sum.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The table of causes.
fn causes(machines: u64, seed: u64, threads: u64, (only, is_told): (&[String], bool)) {
    println!(
        "| what the model lacks | mass | viscous | Coulomb | half-width of the mass | named | another cause | a warning | an interval holds, or a warning names it | all three do |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for truth in Truth::ALL {
        if !is_asked(only, truth.name()) {
            continue;
        }
        let mut sum: Named = summed(machines, seed, threads, |seed, sum| named(truth, seed, is_told, sum));
        sum.wide.sort_by(f64::total_cmp);
        let share = |count: usize| format!("{:.0} %", 100.0 * count as f64 / sum.machines.max(1) as f64);
        let wide = sum.wide.get(sum.wide.len() / 2).copied().unwrap_or(f64::NAN);
        let [mass, viscous, coulomb] = sum.held.map(share);
        println!(
            "| {} | {mass} | {viscous} | {coulomb} | {:.2} % | {} | {} | {} | {:.0} % | {} |",
            truth.name(),
            100.0 * wide,
            share(sum.right),
            share(sum.wrong),
            share(sum.warned),
            100.0 * sum.safe as f64 / (3 * sum.machines.max(1)) as f64,
            share(sum.safe_machines)
        );
    }
}

/// Findings of the fits of gantries that lack one element.
#[derive(Default)]
struct OfGantries {
    machines: usize,
    /// The cause is the right one, with the part that has it; the right one with another part; another one.
    right: usize,
    elsewhere: usize,
    wrong: usize,
    /// The right cause is another one that the logs hardly tell from the named one.
    alike: usize,
    warned: usize,
    /// Intervals that hold, of how many.
    held: [usize; 2],
    /// Those that hold, or of whose fit a warning names the right cause.
    safe: usize,
}

fn of_gantry(lacks: Lacks, seed: u64, is_told: bool, sum: &Mutex<OfGantries>) {
    let gantries::Drawn { case, plan, values, part, size } = gantries::drawn(seed, lacks);
    let fitted = fit(&case, &plan, None, &mut |_| Flow::Continue);
    let mut sum = sum.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    sum.machines += 1;
    let Ok(fitted) = fitted else { return };
    let inside = |(name, value): &(String, f64)| {
        let own = fitted.estimates.iter().find(|one| one.name == *name);
        own.and_then(|one| one.interval).is_some_and(|[low, high]| low <= *value && *value <= high)
    };
    let held = values.iter().filter(|own| inside(own)).count();
    sum.held[0] += held;
    sum.held[1] += values.len();
    let cause = fitted.cause.as_ref();
    let is_right = cause.is_some_and(|cause| cause.key == lacks.key());
    let first = cause.map_or("", |cause| cause.words.split(", or ").next().unwrap_or_default());
    let is_of_part = first.contains(&part);
    sum.right += usize::from(is_right && is_of_part);
    sum.elsewhere += usize::from(is_right && !is_of_part);
    sum.wrong += usize::from(cause.is_some() && !is_right);
    sum.alike += usize::from(cause.is_some_and(|cause| !is_right && cause.words.contains("hardly tell apart")));
    sum.warned += usize::from(fitted.findings.iter().any(|one| one.grade == Grade::Warning));
    let is_named = is_right && fitted.findings.iter().any(|one| one.code == lacks.key() && one.grade == Grade::Warning);
    sum.safe += if is_named { values.len() } else { held };
    if is_told {
        let kind = case.machine.kind.word();
        let lines: Vec<String> = fitted.findings.iter().map(|one| format!("\n  {}: {one}", one.code)).collect();
        eprintln!("{seed} {kind}, {part} {size:.4e}: {held} of {} hold{}", values.len(), lines.concat());
    }
}

/// The table of causes of gantries.
fn causes_of_gantries(machines: u64, seed: u64, threads: u64, (only, is_told): (&[String], bool)) {
    println!(
        "| what the model lacks | machines | named | of another part | another cause | alike | a warning | intervals that hold | that hold, or a warning names it |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for lacks in Lacks::ALL {
        if !is_asked(only, lacks.name()) {
            continue;
        }
        let sum: OfGantries = summed(machines, seed, threads, |seed, sum| of_gantry(lacks, seed, is_told, sum));
        let OfGantries { machines, right, elsewhere, wrong, alike, warned, held: [held, all], safe } = sum;
        println!(
            "| {} | {machines} | {right} | {elsewhere} | {wrong} | {alike} | {warned} | {held} of {all} | {:.0} % |",
            lacks.name(),
            100.0 * safe as f64 / all.max(1) as f64
        );
    }
}

fn main() -> ExitCode {
    let (mut machines, mut seed, mut threads, mut only) = (2000, 1, 2, Vec::new());
    let (mut of_causes, mut is_told) = (false, false);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        if word == "--causes" {
            of_causes = true;
            continue;
        }
        if word == "--told" {
            is_told = true;
            continue;
        }
        let value = words.next();
        let number = value.as_deref().and_then(|value| value.parse::<u64>().ok());
        match (word.as_str(), number, value) {
            ("--machines", Some(n), _) => machines = n,
            ("--seed", Some(n), _) => seed = n,
            ("--threads", Some(n), _) => threads = n,
            ("--cell", _, Some(value)) => only.push(value),
            _ => {
                eprintln!(
                    "usage: cargo xtask coverage [--machines N] [--seed N] [--threads N] [--cell WORDS]... [--causes [--told]]"
                );
                return ExitCode::from(2);
            }
        }
    }
    if of_causes {
        causes(machines, seed, threads, (&only, is_told));
        causes_of_gantries(machines, seed, threads, (&only, is_told));
        return ExitCode::SUCCESS;
    }
    println!("| disturbance; log | viscous | Coulomb | mass | force | half-width | without an interval |");
    println!("|---|---|---|---|---|---|---|");
    for (place, cell) in CELLS.iter().enumerate() {
        if !is_asked(&only, cell.name) {
            continue;
        }
        let found = Mutex::new(CellResults::default());
        let first = seed.wrapping_mul(1_000_003) + 100_000 * place as u64;
        for_each(machines, threads, |k| one(cell, first + k, &found));
        let mut found = found.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
        let n = found.machines as f64;
        let share = |count: usize| format!("{:.1} %", 100.0 * count as f64 / n);
        let middle = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let wide: Vec<String> = (0..3)
            .map(|j| {
                let own = middle(&mut found.wide[j]);
                let relative = middle(&mut found.relative[j]);
                let off = (found.off[j].iter().map(|e| e * e).sum::<f64>() / found.off[j].len().max(1) as f64).sqrt();
                if own.is_nan() {
                    format!("{:.2} % ({:.2} %)", 100.0 * relative, 196.0 * off)
                } else {
                    format!("{own:.2}")
                }
            })
            .collect();
        let lost = 3 * found.machines - found.there.iter().sum::<usize>();
        println!(
            "| {} | {} | {} | {} | {:.1} % | {} | {:.1} % |",
            cell.name,
            share(found.held[0]),
            share(found.held[1]),
            share(found.held[2]),
            100.0 * found.held[3] as f64 / (3.0 * n),
            wide.join(", "),
            100.0 * lost as f64 / (3.0 * n)
        );
    }
    ExitCode::SUCCESS
}
