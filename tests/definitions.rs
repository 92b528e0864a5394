//! Definitions of the documents, made again from their words: inputs, random numbers, devices, runs of a sweep.
//!
//! Nothing here calls the library's own function for what it makes; each text stands in `docs/case-file.md` or
//! `docs/random.md`. A change of either that the other does not follow fails here. Controllers are in
//! `definitions_control.rs`.

use crate::common::document;
use document::{Pcg, mix};
use std::f64::consts::PI;
use taut::case::{Case, Experiment, TEMPLATE};
use taut::measure::measure;
use taut::signal::Signal;
use taut::solve::{Grid, Solver, simulate};
use taut::sweep::Sweep;

fn case(changes: &[&str]) -> Case {
    Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap_or_else(|error| panic!("{error}"))
}

/// The signal of an input as the case file writes it.
fn input(text: &str) -> Signal {
    case(&[&format!("experiment.0.input={text}"), "experiment.0.until=60", "experiment.0.every=1"]).experiments[0]
        .inputs[0]
        .clone()
}

/// A signal and its pieces, against the formula of the document.
fn same(text: &str, end: f64, tolerance: f64, formula: impl Fn(f64) -> f64) {
    let signal = input(text);
    for k in -20..4001 {
        // Times that are no seams, and a few that are.
        let t = f64::from(k) * end / 4000.0;
        let (ours, theirs) = (signal.value(t), formula(t));
        assert!((ours - theirs).abs() <= tolerance, "{text} at {t}: {ours}, and by the document {theirs}");
        let piece = signal.piece(t).value(t);
        assert!((piece - theirs).abs() <= tolerance, "{text} at {t}: {piece}, and by the document {theirs}");
    }
}

// ---- docs/case-file.md, Inputs ----

#[test]
fn waves_and_edges_are_those_of_the_document() {
    let before = |t: f64, u: f64| if t < 0.0 { 0.0 } else { u };
    same("{ step = 5, at = 0.1003 }", 1.0, 0.0, |t| if t >= 0.1003 { 5.0 } else { 0.0 });
    same("{ pulse = 5, for = 0.25, at = 0.1 }", 1.0, 0.0, |t| if (0.1..0.35).contains(&t) { 5.0 } else { 0.0 });
    same("{ ramp = 1.2, over = 0.5, at = 0.1 }", 1.0, 1e-15, |t| match t {
        t if t < 0.1 => 0.0,
        t if t < 0.6 => 1.2 * (t - 0.1) / 0.5,
        _ => 1.2,
    });
    same("{ triangle = 3, frequency = 7 }", 1.0, 1e-12, |t| {
        let s = 7.0 * t - (7.0 * t + 0.5).floor();
        before(
            t,
            match s {
                s if s > 0.25 => 4.0 * 3.0 * (0.5 - s),
                s if s < -0.25 => -4.0 * 3.0 * (0.5 + s),
                s => 4.0 * 3.0 * s,
            },
        )
    });
    same("{ square = 3, frequency = 8, duty = 0.3 }", 1.0, 0.0, |t| {
        let turns = 8.0 * t;
        before(t, if turns - turns.floor() < 0.3 - 1e-12 { 3.0 } else { -3.0 })
    });
    same("{ sine = 3, frequency = 7, phase = 0.4, offset = 0.1 }", 1.0, 1e-12, |t| {
        before(t, 0.1 + 3.0 * (2.0 * PI * 7.0 * t + 0.4).sin())
    });
}

#[test]
fn a_chirp_and_a_multisine_are_those_of_the_document() {
    let before = |t: f64, u: f64| if t < 0.0 { 0.0 } else { u };
    for (f1, f2, length) in [(1.0, 300.0, 2.0), (80.0, 0.0, 0.7)] {
        let text = format!("{{ chirp = 2, from = {f1}, to = {f2}, over = {length} }}");
        same(&text, 1.5 * length, 1e-11, |t| {
            let turns = f1 * t + (f2 - f1) * t * t / (2.0 * length);
            before(t, if t < length { 2.0 * (2.0 * PI * turns).sin() } else { 0.0 })
        });
    }
    let sum = |t: f64, frequencies: &[f64]| {
        let n = frequencies.len() as f64;
        let tone = |(j, f): (usize, &f64)| {
            let k = (j + 1) as f64;
            (2.0 * PI * f * t - PI * k * (k - 1.0) / n).sin()
        };
        before(t, 0.2 * frequencies.iter().enumerate().map(tone).sum::<f64>())
    };
    let spread: Vec<f64> = (1..=50).map(|k| 1.0 + (50.0 - 1.0) * f64::from(k - 1) / 49.0).collect();
    same("{ multisine = 0.2, from = 1, to = 50, tones = 50 }", 2.0, 1e-11, |t| sum(t, &spread));
    same("{ multisine = 0.2, frequencies = [1, 3, 10] }", 2.0, 1e-11, |t| sum(t, &[1.0, 3.0, 10.0]));
}

#[test]
fn the_bits_of_a_prbs_are_those_of_the_document() {
    const P: usize = 1_048_575;
    // b_k = b_{k−3} ⊕ b_{k−20}, b₋₁ = 1 and b₋₂ … b₋₂₀ = 0
    let mut bits = vec![0u8; 19];
    bits.push(1);
    for k in 20..P + 20 {
        bits.push(bits[k - 3] ^ bits[k - 20]);
    }
    let bits = &bits[20..];
    assert_eq!(mix(0), 0xe220_a839_7b1d_cdaf);
    assert_eq!(mix(1) % P as u64, 143_240);
    let text: String = (0..32).map(|k| char::from(b'0' + bits[(143_240 + k) % P])).collect();
    let document = include_str!("../docs/case-file.md");
    assert!(document.contains(&format!("With seed 1 the first 32 are `{text}`, and o is 143240.")));
    for seed in [0, 1, 2, 12345, (1 << 53) + 1, i64::MAX as u64] {
        let o = (mix(seed) % P as u64) as usize;
        let signal = input(&format!("{{ prbs = 3, bit = 0.02, seed = {seed} }}"));
        for k in 0..3000 {
            let expected = if bits[(o + k) % P] == 1 { 3.0 } else { -3.0 };
            assert_eq!(signal.value((k as f64 + 0.5) * 0.02), expected, "seed {seed}, bit {k}");
            assert_eq!(signal.value(k as f64 * 0.02), expected, "seed {seed}, edge of bit {k}");
        }
        assert_eq!(signal.value(-1e-9), 0.0);
    }
    // It comes again after P bits.
    let (signal, o) = (input("{ prbs = 3, bit = 1e-4 }"), 143_240);
    for k in [P - 1, P, P + 1] {
        assert_eq!(signal.value((k as f64 + 0.5) * 1e-4), if bits[(o + k) % P] == 1 { 3.0 } else { -3.0 });
    }
}

/// A file was held before its first row and after its last, or not: the document did not say which.
#[test]
fn a_file_and_a_table_are_zero_before_and_held_after() {
    let folder = std::env::temp_dir().join(format!("taut-definitions-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("u.csv"), "t,u\n0.1,5\n0.2,7\n0.25,-1\n0.4,2\n").unwrap();
    let rows = [[0.1, 5.0], [0.2, 7.0], [0.25, -1.0], [0.4, 2.0]];
    let line = |t: f64| {
        let k = rows.iter().position(|row| row[0] > t);
        match k {
            Some(0) => 0.0,
            None => 2.0,
            Some(k) => {
                let ([t0, v0], [t1, v1]) = (rows[k - 1], rows[k]);
                v0 + (v1 - v0) * (t - t0) / (t1 - t0)
            }
        }
    };
    let held = |t: f64| rows.iter().rev().find(|row| row[0] <= t).map_or(0.0, |row| row[1]);
    let read = |input: &str| {
        let changes = [format!("experiment.0.input={input}")];
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let case = Case::from_text_with(folder.join("axis.toml"), TEMPLATE, &changes);
        case.unwrap_or_else(|error| panic!("{error}")).experiments[0].inputs[0].clone()
    };
    let check = |input: &str, formula: &dyn Fn(f64) -> f64| {
        let signal = read(input);
        for t in [-1.0, 0.0, 0.0999, 0.1, 0.15, 0.19999, 0.2, 0.22, 0.25, 0.3, 0.3999, 0.4, 0.5, 100.0] {
            let (value, piece) = (signal.value(t), signal.piece(t).value(t));
            assert!(
                (value - formula(t)).abs() < 1e-12 && (piece - formula(t)).abs() < 1e-12,
                "{input} at {t}: {value}"
            );
        }
    };
    check("{ file = 'u.csv', time = 't', column = 'u' }", &held);
    check("{ file = 'u.csv', time = 't', column = 'u', hold = 'linear' }", &line);
    check("{ table = [[0.1, 5], [0.2, 7], [0.25, -1], [0.4, 2]] }", &line);
    // In a sequence they last up to their last time; the last value is left as soon as it is reached.
    let file = "{ file = 'u.csv', time = 't', column = 'u', hold = 'linear' }";
    check(&format!("{{ sequence = [{file}, {{ step = 9, at = 0.05 }}] }}"), &|t| match t {
        t if t < 0.4 => line(t),
        t if t < 0.45 => 0.0,
        _ => 9.0,
    });
    check(&format!("{{ sum = [{file}, {{ step = 9, at = 0.05 }}] }}"), &|t| {
        line(t) + if t >= 0.05 { 9.0 } else { 0.0 }
    });
    let _ = std::fs::remove_dir_all(&folder);
}

// ---- docs/random.md ----

/// The PCG64 of a device.
fn device(seed: u64, experiment: &str, name: &str) -> (u64, Pcg) {
    let mut h = 14_695_981_039_346_656_037u64;
    for byte in seed.to_le_bytes().iter().chain(experiment.as_bytes()).chain(&[0]).chain(name.as_bytes()) {
        h = (h ^ u64::from(*byte)).wrapping_mul(1_099_511_628_211);
    }
    (h, Pcg::new(h))
}

#[test]
fn the_generator_begins_as_the_document_says() {
    let mut random = Pcg::new(1);
    assert_eq!([random.next(), random.next()], [15_492_934_433_077_865_799, 319_104_231_195_455_319]);
    assert_eq!(device(1, "5 V pulse", "jitter").0, 1_923_885_783_084_046_118);
}

#[test]
fn noise_steps_and_counts_are_those_of_the_document() {
    for seed in [1, (1 << 53) + 1] {
        let case = case(&[
            &format!("measurement.seed={seed}"),
            "measurement.motor_current={ step = 0.01, noise = 0.05, range = 1.234 }",
            "measurement.cart_speed.noise=0.002",
            "motor.gear_ratio=5.9",
        ]);
        let (experiment, measurement) = (&case.experiments[0], case.measurement.as_ref().unwrap());
        let log = measure(&case.machine, measurement, experiment, Solver::Exact).unwrap().trajectory;
        let run = simulate(&case.machine, experiment, Solver::Exact).unwrap().trajectory;
        let encoder = case.machine.encoder.unwrap();
        let (mut noise, mut other) =
            (device(seed, "5 V pulse", "motor_current").1, device(seed, "5 V pulse", "cart_speed").1);
        let counts = 4.0 * 5.9 * encoder.lines / (2.0 * PI);
        for k in 0..run.len() {
            let of = |name: &str| run.get(name).unwrap()[k];
            let seen = |name: &str| log.get(name).unwrap()[k];
            let steps = ((of("motor_current") + 0.05 * noise.normal()) / 0.01).round().clamp(-123.0, 123.0);
            assert!((seen("motor_current") - 0.01 * steps).abs() < 1e-12, "row {k}");
            assert!((seen("cart_speed") - (of("cart_speed") + 0.002 * other.normal())).abs() < 1e-15, "row {k}");
            let count = (of("drive_angle") * counts).round();
            assert_eq!(seen("encoder_count"), count);
            assert!((seen("drive_angle") - count / counts).abs() < 1e-12);
        }
        assert!(log.get("motor_current").unwrap().contains(&1.23), "the range is reached");
    }
}

/// Whether a sample beyond half an interval was drawn again or clipped, and what it saw there, nobody could know.
#[test]
fn jitter_is_clipped_at_half_an_interval() {
    let case = case(&[
        "experiment.0.input={ sine = 5, frequency = 3 }",
        "measurement.jitter=0.25 ms",
        "measurement.delay=0.4 ms",
        "measurement.every=1 ms",
        "measurement.cart_position={}",
        "measurement.seed=3",
    ]);
    let (experiment, measurement) = (&case.experiments[0], case.measurement.as_ref().unwrap());
    let log = measure(&case.machine, measurement, experiment, Solver::Exact).unwrap().trajectory;
    // The run at every T/100, and beyond its end.
    let fine = Experiment { every: 1e-5, until: 1.002, log: None, ..experiment.clone() };
    let run = simulate(&case.machine, &fine, Solver::Exact).unwrap().trajectory;
    let truth = run.get("cart_position").unwrap();
    let (mut random, mut clipped) = (device(3, "5 V pulse", "jitter").1, 0);
    for k in 0..=1000 {
        let drawn = 0.25e-3 * random.normal();
        let late = drawn.clamp(-0.5e-3, 0.5e-3);
        clipped += usize::from(late != drawn);
        let instant = f64::from(k) * 1e-3 - 0.4e-3 + late;
        let expected = if instant < 0.0 {
            0.0
        } else {
            let place = instant / 1e-5;
            let (j, share) = (place as usize, place.fract());
            truth[j] + share * (truth[j + 1] - truth[j])
        };
        let seen = log.get("cart_position").unwrap()[k as usize];
        // Joined by straight lines at every T/20 there, at every T/100 here: (T/20)² |ẍ| / 8, |ẍ| < 30 m/s²
        assert!((seen - expected).abs() < 1e-8, "sample {k}: {seen} and {expected}");
        assert_eq!(log.get("time").unwrap()[k as usize], Grid::new(1e-3, 1.0).time(k as u64));
    }
    assert!((30..65).contains(&clipped), "{clipped} of 1001: 4.6 % of samples");
}

/// The permutation of 0 … n − 1.
fn permuted(i: u64, n: u64, key: u64) -> u64 {
    let length = if n <= 1 { 0 } else { 64 - (n - 1).leading_zeros() };
    let b = length.div_ceil(2).max(1);
    let mut value = i;
    loop {
        let (mut l, mut r) = (value >> b, value & ((1 << b) - 1));
        for round in 0..6u64 {
            (l, r) = (r, l ^ (mix(key ^ mix((round << 40) ^ r)) & ((1 << b) - 1)));
        }
        value = (l << b) | r;
        if value < n {
            return value;
        }
    }
}

fn swept(design: &str, seed: u64, runs: u64) -> Vec<Vec<f64>> {
    let changes = [
        format!("sweep.runs={runs}"),
        format!("sweep.seed={seed}"),
        format!("sweep.design=\"{design}\""),
        "sweep.vary.\"cart.mass\"=uniform(1 kg, 2 kg)".into(),
        "sweep.vary.\"motor.resistance\"=uniform(1 ohm, 3 ohm)".into(),
        "sweep.vary.\"cart.load\"=values(5 N, 6 N, 7 N)".into(),
    ];
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    let table = Sweep::new(&case(&changes)).unwrap().values(0, runs as usize);
    (1..4).map(|column| table.columns[column].values.clone()).collect()
}

#[test]
fn runs_of_a_sweep_are_those_of_the_document() {
    let value = |j: usize, u: f64| match j {
        0 => 1.0 + u,
        1 => 1.0 + 2.0 * u,
        _ => [5.0, 6.0, 7.0][(u * 3.0) as usize],
    };
    let n = 100;
    for seed in [1, 7, (1 << 60) + 1] {
        let mut random = Pcg::new(seed);
        let x: Vec<f64> = (0..3 * n).map(|_| ((random.next() >> 11) as f64 + 0.5) * 2f64.powi(-53)).collect();
        let (plain, cube, sobol) =
            (swept("random", seed, n), swept("latin-hypercube", seed, n), swept("sobol", seed, n));
        for i in 0..n {
            for j in 0..3 {
                let u = x[3 * i as usize + j];
                let close = |found: &[Vec<f64>], u: f64| {
                    let (found, wanted) = (found[j][i as usize], value(j, u));
                    assert!((found - wanted).abs() < 1e-12, "seed {seed}, run {i}, parameter {j}: {found}, {wanted}");
                };
                close(&plain, u);
                close(&cube, (permuted(i, n, mix(seed ^ mix(j as u64))) as f64 + u) / n as f64);
                close(&sobol, scrambled(i, j, seed));
            }
        }
    }
}

/// Sobol' point i of the first three dimensions, scrambled.
fn scrambled(i: u64, j: usize, seed: u64) -> f64 {
    // new-joe-kuo-6.21201: d s a m: 2 1 0 1; 3 2 1 1 3
    let mut m: Vec<u64> = match j {
        0 => vec![1; 53],
        1 => vec![1],
        _ => vec![1, 3],
    };
    while m.len() < 53 {
        let k = m.len();
        m.push(match j {
            1 => (m[k - 1] << 1) ^ m[k - 1],
            _ => (m[k - 1] << 1) ^ (m[k - 2] << 2) ^ m[k - 2],
        });
    }
    let bits = (0..53).filter(|k| i >> k & 1 == 1).fold(0, |bits, k| bits ^ (m[k] << (52 - k)));
    let key = mix(seed ^ mix(j as u64 + 1));
    let mut flips = 0u64;
    for b in 0..32u32 {
        let above = if b == 0 { 0 } else { bits >> (53 - b) };
        flips |= (mix(key ^ ((1u64 << b) + above)) >> 63) << (52 - b);
    }
    flips |= mix(key ^ ((1u64 << 32) + (bits >> 21))) >> 43;
    ((bits ^ flips) as f64 + 0.5) * 2f64.powi(-53)
}
