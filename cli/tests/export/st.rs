//! Structured Text: its grammar by a public one, and its function blocks run by an interpreter.

use super::interpreter::Block;
use super::machines::{noisy, observed, observed_drives};
use super::tools::{file, python, run, taut};
use std::fs;
use taut::case::Case;

/// Inputs of a block, in the order of what a controller sees.
pub const SEEN: [&str; 12] = [
    "now_position",
    "now_speed",
    "now_acceleration",
    "now_jerk",
    "now_snap",
    "ahead_position",
    "ahead_speed",
    "ahead_acceleration",
    "ahead_jerk",
    "ahead_snap",
    "measured",
    "current",
];

fn exported(name: &str) -> String {
    changed(name, &[])
}

fn changed(name: &str, changes: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let mut words = vec!["export", "st", name, "--out", "x.st"];
    changes.iter().for_each(|change| words.extend(["--set", change]));
    let output = taut(folder.path(), &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(folder.path().join("x.st")).unwrap()
}

/// The commands of a block that is called with what a controller saw.
pub fn replayed(text: &str, seen: &[([f64; 12], f64)]) -> Vec<f64> {
    let mut block = Block::new(text);
    assert!(block.name.ends_with("_CONTROLLER"), "{}", block.name);
    let step = |(seen, _): &([f64; 12], f64)| {
        for (name, value) in SEEN.iter().zip(seen).filter(|(name, _)| block.has(name)).collect::<Vec<_>>() {
            block.set(name, *value);
        }
        block.call();
        block.get("command")
    };
    seen.iter().map(step).collect()
}

#[test]
fn function_blocks_replay_moves_bit_for_bit() {
    for name in super::c::CONTROLLERS {
        let path = file(&format!("stages/sollmann-jouaneh/controllers/{name}.toml"));
        let case = Case::read(&path).unwrap();
        let text = exported(&path);
        let exact = (0..case.moves.len()).map(|which| (which, observed(&case, which)));
        for (which, seen) in exact.chain([(0, noisy(&case, 0, 6))]) {
            let given = replayed(&text, &seen);
            let first = seen.iter().zip(&given).position(|((_, own), other)| own.to_bits() != other.to_bits());
            if let Some(k) = first {
                panic!("{name}, move {which}: sample {k} is {:e} and not {:e}", given[k], seen[k].1);
            }
        }
    }
}

/// One function block, an instance of it for each motor.
#[test]
fn a_function_block_is_the_controller_of_each_motor_of_a_gantry() {
    for (path, changes) in super::c::GANTRIES {
        let case = Case::read_with(file(path), changes).unwrap();
        let text = changed(&file(path), changes);
        for seen in observed_drives(&case, 0) {
            let given = replayed(&text, &seen);
            let first = seen.iter().zip(&given).position(|((_, own), other)| own.to_bits() != other.to_bits());
            assert_eq!(first, None, "{path} {changes:?}");
        }
    }
}

const GRAMMAR: &str = "
import sys, tree_sitter, tree_sitter_iec61131_3_st as st
parser = tree_sitter.Parser(tree_sitter.Language(st.language()))
def faults(text):
    found, open_ = [], [parser.parse(text).root_node]
    while open_:
        node = open_.pop()
        if node.is_error or node.is_missing:
            found.append((node.start_point, node.type))
        open_.extend(node.children)
    return found
for name in sys.argv[1:]:
    text = open(name, 'rb').read()
    assert not faults(text), (name, faults(text)[:5])
    # A mistake is found.
    assert faults(text.replace(b'END_IF;', b'END;', 1)), name
";

#[test]
fn a_public_grammar_takes_every_block() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("grammar.py"), GRAMMAR).unwrap();
    let mut words = vec!["grammar.py".to_string()];
    for name in super::c::CONTROLLERS {
        let text = exported(&file(&format!("stages/sollmann-jouaneh/controllers/{name}.toml")));
        fs::write(folder.path().join(format!("{name}.st")), text).unwrap();
        words.push(format!("{name}.st"));
    }
    run(folder.path(), python, &words.iter().map(String::as_str).collect::<Vec<_>>());
}
