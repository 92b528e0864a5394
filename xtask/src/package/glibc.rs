//! The C library that a program needs.

use crate::output;
use std::path::Path;
use std::process::Command;

/// Returns the newest version of glibc whose symbols a program or shared object imports, by `objdump -T`; none: it
/// imports none. Errors: there is no objdump that reads it.
pub fn newest(file: &Path) -> Result<Option<(u32, u32)>, String> {
    let mut list = Command::new("objdump");
    list.arg("-T").arg(file);
    let listed = output(list).map_err(|error| format!("{error}\nobjdump is in Debian's package binutils"))?;
    Ok(newest_in(&String::from_utf8_lossy(&listed)))
}

/// The newest version in what `objdump -T` prints.
fn newest_in(listed: &str) -> Option<(u32, u32)> {
    let version = |word: &str| {
        let mut numbers = word.trim_matches(['(', ')']).strip_prefix("GLIBC_")?.split('.');
        Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
    };
    listed.split_whitespace().filter_map(version).max()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_version_counts_by_its_numbers() {
        let listed = "\
0000000000000000      DF *UND*  0000000000000000 (GLIBC_2.4)  __stack_chk_fail
0000000000000000      DF *UND*  0000000000000000  GLIBC_2.17  clock_gettime
0000000000000000      DO *UND*  0000000000000000 (GLIBC_2.2.5) stdout
0000000000000000      DF *UND*  0000000000000000 (GLIBC_PRIVATE) _dl_argv";
        assert_eq!(newest_in(listed), Some((2, 17)));
        assert_eq!(newest_in("0000000000000000 g    DF .text  0000000000000010  Base        GLIBCXX_3"), None);
    }

    #[test]
    fn a_file_that_is_no_program_is_an_error() {
        assert!(newest(Path::new("Cargo.toml")).unwrap_err().contains("objdump"));
    }
}
