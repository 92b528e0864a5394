//! The files that a result is made from, which it must not replace.

use crate::error::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// Files that are read: no output may take the place of one.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    files: Vec<(PathBuf, Identity)>,
}

/// The file that a name leads to: the same for all names of it, be they relative, symbolic or hard links.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().map(|data| (data.dev(), data.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    fs::canonicalize(path).ok()
}

impl Inputs {
    /// These files, as the user named them.
    pub fn new<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Self {
        let mut inputs = Self::default();
        paths.into_iter().for_each(|path| inputs.add(path));
        inputs
    }

    /// One more; a file that is not there cannot be replaced.
    pub fn add(&mut self, path: impl AsRef<Path>) {
        let path = path.as_ref();
        if let Some(identity) = identity(path) {
            self.files.push((path.to_path_buf(), identity));
        }
    }

    /// Refuses an output that is one of these files, by whatever name.
    pub fn check(&self, output: &Path) -> Result<()> {
        let Some(found) = identity(output) else { return Ok(()) };
        match self.files.iter().find(|(_, identity)| *identity == found) {
            None => Ok(()),
            Some((input, _)) => {
                let what = match input == output {
                    true => "this result would replace the file that it is made from, and nothing was written".into(),
                    false => format!(
                        "this result would replace {}, which it is made from, and nothing was written",
                        input.display()
                    ),
                };
                Err(Error::new(what).in_file(output).next("write to another place, or move that file"))
            }
        }
    }

    /// Refuses a folder that is to be removed when all is done, if one of these files lies in it.
    pub fn check_folder(&self, folder: &Path) -> Result<()> {
        let Ok(whole) = fs::canonicalize(folder) else { return Ok(()) };
        let lies_in = |path: &Path| fs::canonicalize(path).is_ok_and(|path| path.starts_with(&whole));
        match self.files.iter().find(|(input, _)| lies_in(input)) {
            None => Ok(()),
            Some((input, _)) => Err(Error::new(format!(
                "{} is read and is in this folder, which would be removed at the end; nothing was written",
                input.display()
            ))
            .in_file(folder)
            .next("move that file, or write to another place")),
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_file_is_known_by_all_its_names() {
        let folder = std::env::temp_dir().join(format!("taut-inputs-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("sub")).unwrap();
        let at = |name: &str| folder.join(name);
        for name in ["log.csv", "other.csv"] {
            fs::write(at(name), "1").unwrap();
        }
        symlink("log.csv", at("link.csv")).unwrap();
        symlink(".", at("here")).unwrap();
        fs::hard_link(at("log.csv"), at("hard.csv")).unwrap();
        for given in ["log.csv", "link.csv", "hard.csv", "sub/../log.csv"] {
            let inputs = Inputs::new([at(given)]);
            for output in ["log.csv", "link.csv", "hard.csv", "./log.csv", "sub/../log.csv", "here/log.csv"] {
                assert!(inputs.check(&at(output)).is_err(), "{given} {output}");
            }
            for output in ["other.csv", "new.csv", "sub/log.csv", "sub"] {
                assert_eq!(inputs.check(&at(output)), Ok(()), "{given} {output}");
            }
        }
        assert!(Inputs::new([at("link.csv")]).check_folder(&at("here")).is_err());
        assert_eq!(Inputs::new([at("log.csv")]).check_folder(&at("sub")), Ok(()));
        fs::remove_dir_all(&folder).unwrap();
    }
}
