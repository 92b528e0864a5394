//! The most operations of a step of an exported plant: counted, against the bounds that its header states.

use super::c::{MACHINES, STEPPER, exported};
use super::machines::commands;
use super::tools::{are_there, file, run, write_doubles};
use std::fs;
use taut::case::Case;

/// A step once computed 25,499 products where the header said 11,536: halvings, turns of root-finding and changes of
/// mode were left out.
#[test]
fn no_step_computes_more_than_its_header_states() {
    if !are_there(&["g++"]) {
        return;
    }
    for (k, (case, changes, size)) in MACHINES.into_iter().chain([STEPPER]).enumerate() {
        let opened = Case::read_with(file(case), changes).unwrap();
        let drives = taut::export::mechanism(&opened).drives.len();
        // Calm commands, wild ones, and steps of another length.
        for (real, step, wild) in [("double", "1 ms", 1.0), ("float", "1 ms", 10.0), ("double", "10 ms", 3.0)] {
            let folder = exported(&file(case), changes, &["--real", real, "--part", "plant", "--step", step]);
            // Its commands cannot be wilder.
            let wild = if case == STEPPER.0 { 1.0 } else { wild };
            let values = commands(drives, wild * size, 11 + k as u64);
            write_doubles(&folder.path().join("in.bin"), values.iter().flatten().copied());
            let header = folder.path().join("model.h");
            let text = fs::read_to_string(&header).unwrap();
            let counted = text.replace(&format!("typedef {real} model_real;"), "typedef counted model_real;");
            assert_ne!(text, counted);
            fs::write(&header, counted.replace("#include <stdint.h>", "#include <stdint.h>\n#include \"counted.h\""))
                .unwrap();
            for name in ["counted.h", "counted.cpp"] {
                fs::copy(file(&format!("cli/tests/export/{name}")), folder.path().join(name)).unwrap();
            }
            let base = format!("-DBASE={real}");
            let words = ["-O1", "-w", &base, "counted.cpp", "-x", "c++", "model.c", "-o", "counted"];
            run(folder.path(), "g++", &words);
            let told = run(folder.path(), folder.path().join("counted"), &[]);
            println!("{case} {changes:?} {real} {step}: {}", told.trim());
            let numbers: Vec<u64> = told.split_whitespace().map(|word| word.parse().unwrap()).collect();
            let [products, most_products, sums, most_sums, events, _] = numbers[..] else { panic!("{told}") };
            assert!(products <= most_products && sums <= most_sums, "{case} {changes:?} {real} {step}: {told}");
            // It moved, and the bound is one of this machine.
            assert!(events > 0 && products > most_products / 1000, "{case} {changes:?} {real} {step}: {told}");
        }
    }
}
