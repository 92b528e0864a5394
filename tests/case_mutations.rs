//! Whatever bytes stand in a case file, it is read or refused: no panic, and not for long.

use proptest::prelude::*;
use std::time::Instant;
use taut::case::{Case, TEMPLATE};

const STAGE: &str = include_str!("../stages/sollmann-jouaneh/table4.toml");

fn read(text: &str, changes: &[&str]) {
    let begin = Instant::now();
    let result = Case::from_text_with("axis.toml", text, changes);
    if let Err(error) = result {
        assert!(!error.to_string().is_empty());
    }
    assert!(begin.elapsed().as_secs() < 5, "{text}");
}

fn cut(text: &str, at: usize) -> usize {
    (0..=at % (text.len() + 1)).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        read(&String::from_utf8_lossy(&bytes), &[]);
    }

    #[test]
    fn pieces_of_toml(parts in prop::collection::vec(prop::sample::select(vec![
        "[", "]", "[[", "]]", "{", "}", "=", ".", ",", "\"", "'", "\n", " ", "#", "cart", "mass", "experiment", "input", "name",
        "until", "1", "-", "e9", "kg", "\"1 kg\"", "nan", "inf", "true", "1979-05-27", "\\", "µ", "😀",
    ]), 0..60)) {
        read(&parts.concat(), &[]);
    }

    /// A stretch of a good file left out, doubled or replaced.
    #[test]
    fn mutations(machine in any::<bool>(), from in any::<usize>(), long in 0..40_usize, to in any::<usize>(),
                 put in "\\PC{0,12}", kind in 0..3) {
        let text = if machine { STAGE } else { TEMPLATE };
        let start = cut(text, from);
        let end = cut(text, (start + long).min(text.len())).max(start);
        let mut changed = format!("{}{}", &text[..start], &text[end..]);
        let at = cut(&changed, to);
        match kind {
            0 => {}
            1 => changed.insert_str(at, &text[start..end]),
            _ => changed.insert_str(at, &put),
        }
        read(&changed, &[]);
    }

    #[test]
    fn changes(key in "[a-z0-9_.\\[\\]\"]{0,20}", value in "\\PC{0,20}") {
        read(STAGE, &[&format!("{key}={value}")]);
    }
}
