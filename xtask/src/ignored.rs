//! Tests that did nothing because a file is not there: they append their name and the file to a list, which is shown
//! and counted.

use std::fs;
use std::path::{Path, PathBuf};

/// The variable of the environment that names the list.
pub const VARIABLE: &str = "TAUT_IGNORED";

/// The list of one run.
pub struct Ignored(PathBuf);

impl Ignored {
    /// An empty one.
    pub fn new() -> Result<Self, String> {
        let folder = crate::host::target();
        let file = folder.join(format!("ignored-{}.txt", std::process::id()));
        fs::create_dir_all(&folder)
            .and_then(|()| fs::write(&file, ""))
            .map_err(|error| format!("{} cannot be written: {error}", file.display()))?;
        Ok(Self(file))
    }

    /// Where it is.
    pub fn file(&self) -> &Path {
        &self.0
    }

    /// One line a test; a test that wants several files is one test.
    pub fn tests(&self) -> Vec<String> {
        let mut lines: Vec<String> =
            fs::read_to_string(&self.0).unwrap_or_default().lines().map(str::to_string).collect();
        lines.sort();
        lines.dedup_by(|a, b| a.split(": ").next() == b.split(": ").next());
        lines
    }
}

impl Drop for Ignored {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_that_wants_two_files_is_one_test() {
        let ignored = Ignored::new().unwrap();
        fs::write(ignored.file(), "b::x: needs 1\na::y: needs 2\nb::x: needs 2\n").unwrap();
        assert_eq!(ignored.tests(), ["a::y: needs 2", "b::x: needs 1"]);
        let file = ignored.file().to_path_buf();
        drop(ignored);
        assert!(!file.exists());
    }
}
