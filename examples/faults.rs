//! Logs with a known fault, and logs that are as they should be: how many of them `taut fit` warns about. With
//! `--belts`, spectra of CoreXY printers instead: how often `taut shape --belts` names the looser belt.
//!
//! `cargo xtask faults [--seeds N] [--seed N] [--words] [--belts]` prints a table.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use taut::case::{Case, Plan, TEMPLATE};
use taut::chance::normal;
use taut::fit::fit;
use taut::log::{Log, Output, Quantity};
use taut::machine::AmplifierMode;
use taut::signal::{Hold, Signal};
use taut::solve::{Flow, Solver, simulate};

/// Between samples, s.
const EVERY: f64 = 1e-3;

/// Counts of the encoder in a turn.
const COUNTS: f64 = 2048.0;

/// The free parameters.
const KEYS: [&str; 3] = ["cart.friction.viscous", "cart.friction.coulomb", "cart.mass"];

#[path = "../tests/common/mod.rs"]
mod common;

use common::shaken::{Counts, Disturbed, judged};

struct Chance(Pcg64);

impl Chance {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.0.next_u64() >> 11) as f64 * 2f64.powi(-53))
    }
}

/// A fault of a log.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    Sign,
    Millimetres,
    SmallInput,
    QuickTime,
    Exchanged,
    SpeedsExchanged,
    ClippedInput,
    ClippedOutput,
    Late,
    Wraps,
    LostCounts,
    Outliers,
    Gap,
    /// Nothing, with parameters that are rough.
    None,
    /// A cart above its resonance.
    Resonance,
    /// A motor whose constants make newtons of its input.
    Newtons,
    /// Speeds of few steps.
    CoarseSpeed,
    /// A log that ends at rest at an end of its way, with a short gap there.
    GapAtRest,
}

/// Name, fault, and the codes of the warnings that find it; none where nothing is wrong.
const FAULTS: &[(&str, Fault, &[&str])] = &[
    ("the output's sign is flipped", Fault::Sign, &["sign"]),
    ("mm for m", Fault::Millimetres, &["unit"]),
    ("the input is 1000 times too small", Fault::SmallInput, &["unit"]),
    ("the time passes 10 times too quickly", Fault::QuickTime, &["time-unit", "unit"]),
    ("input and output are swapped", Fault::Exchanged, &["swapped"]),
    ("two speeds are swapped", Fault::SpeedsExchanged, &["swapped"]),
    ("the logged input is clipped", Fault::ClippedInput, &["saturation"]),
    ("the output is clipped at both ends", Fault::ClippedOutput, &["saturation"]),
    ("the output is 8 ms late", Fault::Late, &["delay"]),
    ("the angle wraps", Fault::Wraps, &["wraps"]),
    ("the counter loses 300 counts", Fault::LostCounts, &["jumps"]),
    ("five outliers", Fault::Outliers, &["outliers"]),
    ("a gap of 60 ms in motion", Fault::Gap, &["gap-in-motion"]),
    ("good: parameters off by up to 2", Fault::None, &[]),
    ("good: a cart above its resonance", Fault::Resonance, &[]),
    ("good: a gain in newtons", Fault::Newtons, &[]),
    ("good: speeds of few steps", Fault::CoarseSpeed, &[]),
    ("good: a gap of 20 ms at rest", Fault::GapAtRest, &[]),
];

/// Random levels, with a rest between them; or a sum of sines.
fn input(fault: Fault, chance: &mut Chance, count: usize) -> Vec<f64> {
    let mut values = vec![0.0; count];
    match fault {
        Fault::ClippedInput => {
            let tones: Vec<[f64; 3]> =
                (0..6).map(|k| [chance.between(1.0, 3.0), 0.7 + f64::from(k), chance.between(0.0, TAU)]).collect();
            for (k, value) in values.iter_mut().enumerate() {
                let t = k as f64 * EVERY;
                *value = tones.iter().map(|[size, f, phase]| size * (TAU * f * t + phase).sin()).sum();
            }
        }
        Fault::Resonance => {
            let (size, f) = (chance.between(8.0, 12.0), chance.between(30.0, 40.0));
            for (k, value) in values.iter_mut().enumerate() {
                *value = size * (TAU * f * k as f64 * EVERY).sin();
            }
        }
        _ => {
            let (mut k, mut sign) = (50, 1.0);
            while k + 600 < count {
                let (size, lasts) = (chance.between(4.0, 8.0), chance.between(0.15, 0.3));
                let next = k + (lasts / EVERY) as usize;
                values[k..next].fill(sign * size);
                sign = -sign;
                k = next + (chance.between(0.0, 0.15) / EVERY) as usize;
            }
        }
    }
    values
}

/// The case that a person would have, with the log of another machine of the kind.
fn made(fault: Fault, seed: u64) -> Case {
    let mut chance = Chance(Pcg64::seed_from_u64(seed));
    let mut case = Case::from_text("axis.toml", TEMPLATE).unwrap_or_else(|error| panic!("{error}"));
    let machine = &mut case.machine;
    if fault == Fault::Newtons {
        machine.drives[0].amplifier.mode = AmplifierMode::Current;
        machine.drives[0].amplifier.gain = 0.5;
        (machine.drives[0].motor.torque_constant, machine.drives[0].motor.back_emf_constant) =
            (machine.pulley_radius, 0.0);
    }
    if fault == Fault::Resonance {
        machine.belt.stiffness = [3e3; 3].into();
        machine.cart.friction.forward.coulomb *= 0.1;
        machine.cart.friction.backward.coulomb *= 0.1;
        machine.cart.friction.forward.breakaway *= 0.1;
        machine.cart.friction.backward.breakaway *= 0.1;
        machine.cart.friction.forward.viscous *= 0.05;
        machine.cart.friction.backward.viscous *= 0.05;
    }
    let mut truth = machine.clone();
    let rough = |chance: &mut Chance| 2f64.powf(chance.between(-1.0, 1.0));
    truth.cart.mass *= if fault == Fault::Resonance { 1.1 } else { rough(&mut chance) };
    let (b, c) = (rough(&mut chance), rough(&mut chance));
    for side in [&mut truth.cart.friction.forward, &mut truth.cart.friction.backward] {
        side.viscous *= b;
        side.coulomb *= c;
        side.breakaway *= c;
    }
    let count = 3001;
    let mut values = input(fault, &mut chance, count);
    let mut time: Vec<f64> = (0..count).map(|k| k as f64 * EVERY).collect();
    let mut experiment = case.experiments[0].clone();
    (experiment.until, experiment.every) = ((count - 1) as f64 * EVERY, EVERY);
    experiment.inputs[0] = Signal::Sampled { times: time.clone(), values: values.clone(), hold: Hold::Zero };
    let run =
        simulate(&truth, &experiment, Solver::for_machine(&truth)).unwrap_or_else(|error| panic!("{error}")).trajectory;
    let column = |name: &str| run.get(name).unwrap_or_else(|| panic!("no column {name}")).to_vec();
    let step = TAU / COUNTS;
    let mut counted = |values: Vec<f64>, step: f64, tremble: f64| -> Vec<f64> {
        values.iter().map(|v| step * ((v + tremble * normal(&mut chance.0)) / step).round()).collect()
    };
    let arm = case.machine.pulley_radius;
    let output = |quantity, values| Output { quantity, absolute: false, values };
    let mut outputs = match fault {
        Fault::Millimetres | Fault::Resonance => {
            vec![output(Quantity::CartPosition, counted(column("cart_position"), 2e-6, 1e-6))]
        }
        Fault::SpeedsExchanged => vec![
            output(Quantity::DriveSpeed, counted(column("cart_speed"), 1e-4, 1e-4)),
            output(Quantity::CartSpeed, counted(column("drive_speed"), 5e-3, 5e-3)),
        ],
        Fault::CoarseSpeed => {
            let angle = counted(column("drive_angle"), step, 0.3 * step);
            let way = 10;
            let speed = (0..count).map(|k| (angle[k] - angle[k.saturating_sub(way)]) / (way as f64 * EVERY)).collect();
            vec![output(Quantity::DriveAngle, angle), output(Quantity::DriveSpeed, speed)]
        }
        _ => vec![output(Quantity::DriveAngle, counted(column("drive_angle"), step, 0.3 * step))],
    };
    let shown = &mut outputs[0].values;
    let (least, most) = shown.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    match fault {
        Fault::Sign => shown.iter_mut().for_each(|v| *v = -*v),
        Fault::Millimetres => shown.iter_mut().for_each(|v| *v *= 1e3),
        Fault::SmallInput => values.iter_mut().for_each(|u| *u *= 1e-3),
        Fault::QuickTime => time.iter_mut().for_each(|t| *t *= 0.1),
        Fault::Exchanged => std::mem::swap(&mut values, shown),
        Fault::ClippedInput => {
            let limit = 0.6 * values.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
            values.iter_mut().for_each(|u| *u = u.clamp(-limit, limit));
        }
        Fault::ClippedOutput => {
            let (low, high) = (least + 0.15 * (most - least), most - 0.15 * (most - least));
            shown.iter_mut().for_each(|v| *v = v.clamp(low, high));
        }
        Fault::Late => {
            shown.rotate_right(8);
            let first = shown[8];
            shown[..8].fill(first);
        }
        Fault::LostCounts => {
            let place = 300 + chance.between(0.0, 2400.0) as usize;
            shown[place..].iter_mut().for_each(|v| *v -= 300.0 * step);
        }
        Fault::Wraps => shown.iter_mut().for_each(|v| *v = (*v + 3.0).rem_euclid(TAU)),
        Fault::Outliers => {
            for _ in 0..5 {
                let place = 100 + chance.between(0.0, 2800.0) as usize;
                shown[place] += 0.3 * (most - least) * chance.between(-1.0, 1.0).signum();
            }
        }
        Fault::Gap | Fault::GapAtRest => {
            // Where it is quickest, or at the end.
            let quickest = (100..2500).max_by(|&a, &b| {
                let speed = |k: usize| (shown[k + 10] - shown[k]).abs();
                speed(a).total_cmp(&speed(b))
            });
            let first = if fault == Fault::Gap { quickest.unwrap_or(500) - 30 } else { count - 40 };
            let rows = first..first + if fault == Fault::Gap { 60 } else { 20 };
            drop(time.drain(rows.clone()));
            drop(values.drain(rows.clone()));
            drop(shown.drain(rows));
        }
        Fault::SpeedsExchanged | Fault::None | Fault::Resonance | Fault::Newtons | Fault::CoarseSpeed => {}
    }
    let _ = arm;
    experiment.name = "log".into();
    experiment.inputs[0] = Signal::Sampled { times: time.clone(), values: values.clone(), hold: Hold::Zero };
    experiment.log = Some(Arc::new(Log {
        name: "log".into(),
        file: Default::default(),
        time,
        inputs: vec![values],
        hold: Hold::Zero,
        added: None,
        reference: None,
        outputs,
        ended: None,
    }));
    case.experiments = vec![experiment];
    case
}

/// Prints a table of the statements about belts, of so many machines with each kind of disturbance.
fn belts(seeds: u64, seed: u64) -> ExitCode {
    println!("| spectra | named | of these wrong | refused | undecided | interval holds the ratio |");
    println!("|---|---|---|---|---|---|");
    let mut all = [Counts::default(), Counts::default()];
    for (disturbed, name) in Disturbed::ALL {
        for is_equal in [false, true] {
            let next = AtomicU64::new(0);
            let worker = || {
                let mut counts = Counts::default();
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= seeds {
                        return counts;
                    }
                    counts.add(&judged(seed.wrapping_mul(1_000_003) + k, disturbed, is_equal));
                }
            };
            let mut counts = Counts::default();
            std::thread::scope(|scope| {
                let count = std::thread::available_parallelism().map_or(1, usize::from);
                let workers: Vec<_> = (0..count).map(|_| scope.spawn(worker)).collect();
                workers.into_iter().for_each(|one| counts.add(&one.join().unwrap_or_default()));
            });
            all[usize::from(is_equal)].add(&counts);
            row(&format!("{name}, belts {}", if is_equal { "alike" } else { "from 0.7 to 1.4" }), &counts);
        }
    }
    row("all, belts from 0.7 to 1.4", &all[0]);
    row("all, belts alike", &all[1]);
    let [unequal, alike] = &all;
    println!("{} of {} belts that differ by 5 % or more are named", unequal.named[1], unequal.unequal);
    // 97.6 % of the named belts are right, and at most 5 % of those that are alike are named.
    let is_good =
        unequal.wrong as f64 <= 0.024 * unequal.named[0] as f64 && alike.wrong as f64 <= 0.05 * seeds as f64 * 5.0;
    if is_good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn row(name: &str, counts: &Counts) {
    let &Counts { machines, named: [named, _], wrong, refused, held, .. } = counts;
    let undecided = machines - named - refused;
    println!(
        "| {name} | {named} of {machines} | {wrong} | {refused} | {undecided} | {held} of {} |",
        machines - refused
    );
}

fn main() -> ExitCode {
    let (mut seeds, mut seed, mut aloud, mut of_belts) = (10, 1, false, false);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let number = |value: Option<String>| value.and_then(|value| value.parse::<u64>().ok());
        match word.as_str() {
            "--seeds" => seeds = number(words.next()).unwrap_or(seeds),
            "--seed" => seed = number(words.next()).unwrap_or(seed),
            "--words" => aloud = true,
            "--belts" => of_belts = true,
            _ => {
                eprintln!("usage: cargo xtask faults [--seeds N] [--seed N] [--words] [--belts]");
                return ExitCode::from(2);
            }
        }
    }
    if of_belts {
        return belts(seeds, seed);
    }
    println!("| log | found | warned of something | exit 0 |");
    println!("|---|---|---|---|");
    let mut good = true;
    for (name, fault, codes) in FAULTS {
        let (mut found, mut warned, mut silent) = (0, 0, 0);
        for k in 0..seeds {
            let case = made(*fault, seed.wrapping_mul(1_000_003) + k);
            let plan = Plan { free: KEYS.iter().map(|key| key.to_string()).collect(), ..Plan::default() };
            let fitted = fit(&case, &plan, None, &mut |_| Flow::Continue);
            let Ok(fitted) = fitted else {
                warned += 1;
                continue;
            };
            found += u64::from(fitted.warnings().any(|one| codes.contains(&one.code)));
            warned += u64::from(fitted.warnings().next().is_some());
            silent += u64::from(fitted.is_reliable());
            if aloud {
                fitted.warnings().for_each(|one| eprintln!("{name} {k}: {one}"));
            }
        }
        let is_good = codes.is_empty();
        good &= if is_good { warned == 0 } else { warned == seeds };
        let share = |count: u64| format!("{count} of {seeds}");
        println!(
            "| {name} | {} | {} | {} |",
            if is_good { "–".into() } else { share(found) },
            share(warned),
            share(silent)
        );
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
