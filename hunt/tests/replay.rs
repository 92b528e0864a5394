//! Drawn machines replayed event by event in exported C, Python and MATLAB, where their tools are installed;
//! `taut-hunt replay` replays more of them.

#[path = "../../tests/common/ignored.rs"]
mod ignored;

use taut_hunt::replay::{Tool, machines, replay};

/// Every change of every part is the same by taut and by this tool.
fn replays(tool: Tool, count: usize) {
    let Some(program) = tool.program() else {
        return ignored::ignored(&format!("the program for {}, which `cargo xtask export` installs", tool.name()));
    };
    let machines = machines(1, 0, count);
    let result = replay(tool, &program, &machines).unwrap();
    println!("{}", result.told(tool));
    assert!(result.different.is_empty(), "{}", result.different.join("\n"));
    // Where rounding, or an integrator's error, decides what happens nothing is compared.
    assert!(result.machines * 10 >= count * 9 && result.compared * 10 >= result.all * 7, "{}", result.told(tool));
}

#[test]
fn what_follows_an_event_is_the_same_in_c() {
    replays(Tool::C, 40);
}

#[test]
fn what_follows_an_event_is_the_same_in_python() {
    replays(Tool::Python, 10);
}

#[test]
fn what_follows_an_event_is_the_same_in_matlab() {
    replays(Tool::Octave, 10);
}
