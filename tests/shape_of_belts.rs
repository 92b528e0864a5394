//! The looser of two belts from two spectra.

use crate::common::chance::Chance;
use crate::common::data;
use crate::common::shaken::{Counts, Disturbed, Machine, judged};
use std::path::{Path, PathBuf};
use taut::control::diagonals::Diagonals;
use taut::control::recommendation::{Question, recommend};

fn compared(files: &[PathBuf]) -> taut::Result<Diagonals> {
    let question = Question { belts: true, ..Question::default() };
    Ok(recommend(&question, files)?.belts.unwrap())
}

fn temporary(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("belts-{name}.csv"));
    std::fs::write(&path, text).unwrap();
    path
}

/// Files of both tests of a machine.
fn files(test: &str, machine: &Machine, chance: &mut Chance) -> [PathBuf; 2] {
    [0, 1].map(|belt| temporary(&format!("{test}-{belt}"), &machine.file(belt, chance)))
}

/// 20 machines, four with each kind of disturbance; with `TAUT_CASES`, that many.
#[test]
fn the_looser_belt_is_named_rightly() {
    let machines = std::env::var("TAUT_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(20);
    let [mut unequal, mut alike] = [Counts::default(); 2];
    for seed in 0..machines {
        let (disturbed, _) = Disturbed::ALL[seed as usize % Disturbed::ALL.len()];
        unequal.add(&judged(70_000 + seed, disturbed, false));
        if seed % 2 == 0 {
            alike.add(&judged(80_000 + seed, disturbed, true));
        }
    }
    println!("{unequal:?} {alike:?}");
    let told = format!("{unequal:?} {alike:?}");
    // 97.6 % of those that are named; of alike belts at most 5 % are named.
    assert!(unequal.wrong as f64 <= 0.024 * unequal.named[0] as f64, "{told}");
    assert!(alike.wrong as f64 <= 0.05 * alike.machines as f64, "{told}");
    assert!(unequal.held as f64 >= 0.9 * (unequal.machines - unequal.refused) as f64, "{told}");
    assert!(unequal.named[1] as f64 >= 0.8 * unequal.unequal as f64, "{told}");
}

/// Exchanged files exchange the belts, and the ratio is inverted.
#[test]
fn exchanged_spectra_exchange_the_belts() {
    let mut chance = Chance::new(5);
    let machine = Machine::drawn(&mut chance, 0.82, Disturbed::Little);
    let [a, b] = files("exchanged", &machine, &mut chance);
    let one = compared(&[a.clone(), b.clone()]).unwrap().stated.unwrap();
    let other = compared(&[b, a]).unwrap().stated.unwrap();
    assert_eq!((one.looser(), other.looser()), (Some(1), Some(0)));
    assert!((one.ratio / 0.82 - 1.0).abs() < 0.01 && (one.ratio * other.ratio - 1.0).abs() < 0.01, "{one:?} {other:?}");
    assert!(one.words().starts_with("belt B is looser than belt A: 18"), "{}", one.words());
}

/// Spectra of a printer whose axes have a belt each state nothing about two belts.
#[test]
fn a_cartesian_printer_is_refused() {
    let names = ["x_20210701_223821", "x_20210821_152037", "y_20210630_223910", "y_20210630_230110"];
    let Some(all) = data::data(names.map(|name| format!("klipper-ender3/resonances_{name}.csv"))) else { return };
    for one in &all {
        for other in all.iter().filter(|other| *other != one) {
            let found = compared(&[one.clone(), other.clone()]).unwrap();
            let looser = found.stated.as_ref().ok().and_then(|belts| belts.looser());
            assert_eq!(looser, None, "{} {}: {}", one.display(), other.display(), found.words());
        }
    }
}

#[test]
fn what_is_no_pair_of_spectra_is_refused() {
    let mut chance = Chance::new(6);
    let machine = Machine::drawn(&mut chance, 0.9, Disturbed::Little);
    let [a, b] = files("refused", &machine, &mut chance);
    let told = |files: &[PathBuf], question: Question| recommend(&question, files).unwrap_err().to_string();
    let asked = || Question { belts: true, ..Question::default() };
    assert!(told(&[a.clone(), a.clone()], asked()).contains("the same values as in"));
    let pair = "give the spectra of TEST_RESONANCES AXIS=1,1 and AXIS=1,-1, in this order";
    let alone = told(std::slice::from_ref(&a), asked());
    assert_eq!(alone, format!("--belts: 1 file for two belts\n  allowed: two spectra\n  next: {pair}"));
    let three = told(&[a.clone(), b.clone(), b.clone()], asked());
    assert_eq!(three, format!("--belts: 3 files for two belts\n  allowed: two spectra\n  next: {pair}"));
    let case = told(&["stages/core-xy/belts.toml".into(), b.clone()], asked());
    let next = pair.replace("give", "leave --belts out, or give");
    assert_eq!(case, format!("stages/core-xy/belts.toml: a case file has no spectra of two belts\n  next: {next}"));
    let together = told(&[a.clone(), b.clone()], Question { together: true, ..asked() });
    assert_eq!(
        together,
        "--together: --belts compares two spectra, --together joins them\n  next: leave --together out"
    );
    let axis = Some(taut::control::spectrum::Axis::X);
    let along = told(&[a.clone(), b.clone()], Question { axis, ..asked() });
    assert_eq!(along, "--axis: --belts evaluates x and y of each spectrum\n  next: leave --axis out");
    // No content along y.
    let text = std::fs::read_to_string(&b).unwrap();
    let without: Vec<String> = text
        .lines()
        .enumerate()
        .map(|(k, line)| {
            let mut fields: Vec<&str> = line.split(',').collect();
            if k > 0 {
                fields[2] = "0";
            }
            fields.join(",") + "\n"
        })
        .collect();
    let flat = temporary("flat", &without.concat());
    let told = told(&[a, flat], asked());
    assert!(told.contains("flat.csv: no vibration along y from 5 to 200 Hz\n  allowed: densities above 0"), "{told}");
}
