//! Structured Text: its grammar by a public one, and its function blocks run by an interpreter.

use super::interpreter::Block;
use super::machines::{noisy, observed, observed_drives};
use super::tools::{file, python, run, taut};
use std::fs;
use taut::case::Case;

/// Inputs of a block, in the order of what a controller sees: of an axis the slide is called "", of a gantry "bridge_"
/// and "cart_".
fn names(slides: &[&str]) -> Vec<String> {
    let derivatives = ["position", "speed", "acceleration", "jerk", "snap"];
    let of = ["now_", "ahead_"].into_iter().flat_map(|of| slides.iter().map(move |slide| format!("{of}{slide}")));
    let references = of.flat_map(|of| derivatives.map(|derivative| format!("{of}{derivative}")));
    references.chain(["measured", "current"].map(String::from)).collect()
}

fn exported(name: &str) -> String {
    changed(name, &[])
}

pub fn changed(name: &str, changes: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let mut words = vec!["export", "st", name, "--out", "x.st"];
    changes.iter().for_each(|change| words.extend(["--set", change]));
    let output = taut(folder.path(), &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(folder.path().join("x.st")).unwrap()
}

/// The commands of the block of an axis that is called with what a controller saw.
pub fn replayed(text: &str, seen: &[([f64; 12], f64)]) -> Vec<f64> {
    commands(text, &[""], seen.iter().map(|(seen, _)| &seen[..]))
}

/// The commands of a block that takes the references of these slides.
fn commands<'s>(text: &str, slides: &[&str], seen: impl Iterator<Item = &'s [f64]>) -> Vec<f64> {
    let (mut block, names) = (Block::new(text), names(slides));
    assert!(block.name.ends_with("_CONTROLLER"), "{}", block.name);
    let step = |seen: &[f64]| {
        assert_eq!(seen.len(), names.len());
        for (name, value) in names.iter().zip(seen).filter(|(name, _)| block.has(name)).collect::<Vec<_>>() {
            block.set(name, *value);
        }
        block.call();
        block.get("command")
    };
    seen.map(step).collect()
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

/// A function block for each motor, in one file.
#[test]
fn a_function_block_is_the_controller_of_each_motor_of_a_gantry() {
    for (path, changes) in super::c::gantries() {
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let case = Case::read_with(file(&path), &changes).unwrap();
        let text = changed(&file(&path), &changes);
        let blocks: Vec<&str> = text.split_inclusive("END_FUNCTION_BLOCK\n").collect();
        assert_eq!(blocks.len(), case.machine.drives.len());
        for ((side, block), seen) in case.machine.geometry().sides().zip(blocks).zip(observed_drives(&case, 0)) {
            assert!(block.contains(&format!("FUNCTION_BLOCK x_{side}_controller")), "{side}");
            let given = commands(block, &["bridge_", "cart_"], seen.iter().map(|(seen, _)| &seen[..]));
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
    let controllers =
        super::c::CONTROLLERS.iter().map(|name| format!("stages/sollmann-jouaneh/controllers/{name}.toml"));
    let axes = controllers.map(|path| (path, Vec::new()));
    for (number, (path, changes)) in axes.chain(super::c::gantries().take(super::c::GANTRIES.len())).enumerate() {
        let text = changed(&file(&path), &changes.iter().map(String::as_str).collect::<Vec<_>>());
        fs::write(folder.path().join(format!("{number}.st")), text).unwrap();
        words.push(format!("{number}.st"));
    }
    run(folder.path(), python, &words.iter().map(String::as_str).collect::<Vec<_>>());
}
