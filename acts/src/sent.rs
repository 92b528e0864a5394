//! Files that pages send: their bounds and their names.

use taut::error::Error;

/// Largest file, bytes.
pub const FILE: usize = 64 << 20;

/// Largest total of all files, bytes.
pub const ALL: usize = 512 << 20;

/// The message for files beyond these bounds.
pub fn too_large() -> String {
    format!("a file may have {} MB, and all together {} MB", FILE >> 20, ALL >> 20)
}

/// The error for a path that belongs to no file of a page.
pub fn unknown() -> Error {
    Error::new("this file was not sent by this page").next("drop it on the page again")
}

/// The name under which a file is kept, without characters that could lead to another folder.
pub fn name(given: &str) -> String {
    let plain: String = given.chars().filter(|c| c.is_ascii_alphanumeric() || "._-".contains(*c)).take(100).collect();
    let plain = plain.trim_start_matches('.');
    if plain.is_empty() { "file".to_string() } else { plain.to_string() }
}

#[cfg(test)]
mod tests {
    use super::name;

    #[test]
    fn a_name_leads_nowhere() {
        let names = ["log.csv", "../../etc/passwd", "..", "a b/ä.mat", "", "%2e%2e%2fx"].map(name);
        assert_eq!(names, ["log.csv", "etcpasswd", "file", "ab.mat", "file", "2e2e2fx"]);
        assert_eq!(name(&"x".repeat(1000)).len(), 100);
    }
}
