//! Tests that something is missing for.

use std::fs::OpenOptions;
use std::io::Write;

/// Tells that this test does nothing, as it needs something that is not there: its name is appended to the file that
/// `TAUT_IGNORED` names. With `TAUT_REQUIRE=all` it fails instead.
pub fn ignored(needs: &str) {
    let thread = std::thread::current();
    let name = thread.name().unwrap_or("a test");
    assert!(std::env::var_os("TAUT_REQUIRE").is_none_or(|all| all != "all"), "{name} needs {needs}");
    println!("ignored: {name}: needs {needs}");
    if let Some(list) = std::env::var_os("TAUT_IGNORED") {
        let mut list = OpenOptions::new().append(true).create(true).open(list).unwrap();
        list.write_all(format!("{name}: needs {needs}\n").as_bytes()).unwrap();
    }
}
