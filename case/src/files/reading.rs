//! Opening files that are read. What is no regular file is refused, or read with a bound: a pipe that nobody writes to
//! would hold the program for ever.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest wait for the next byte of a pipe.
const PATIENCE: Duration = Duration::from_secs(5);

/// An open file.
pub type Source = File;

/// Opens a regular file, and nothing else: a named pipe, a socket or a device is an error of kind `InvalidInput`.
pub fn open(path: impl AsRef<Path>) -> io::Result<File> {
    let file = open_anything(path.as_ref())?;
    let kind = file.metadata()?.file_type();
    if kind.is_file() {
        return Ok(file);
    }
    Err(match kind.is_dir() {
        true => ErrorKind::IsADirectory.into(),
        false => io::Error::new(ErrorKind::InvalidInput, "this is a pipe or a device, not a file"),
    })
}

/// The first `most` bytes of a file or of a pipe. A pipe that stays silent for 5 s is an error of kind `TimedOut`.
pub fn read(path: impl AsRef<Path>, most: usize) -> io::Result<Vec<u8>> {
    let file = open_anything(path.as_ref())?;
    let mut bytes = Vec::new();
    if file.metadata()?.is_file() {
        file.take(most as u64).read_to_end(&mut bytes)?;
        return Ok(bytes);
    }
    let (mut part, mut since) = (vec![0; 1 << 16], Instant::now());
    loop {
        let wanted = part.len().min(most - bytes.len());
        match (&file).read(&mut part[..wanted]) {
            // A pipe that nobody has opened for writing yet is at its end, too.
            Ok(0) if !bytes.is_empty() || wanted == 0 => return Ok(bytes),
            Ok(0) => {}
            Ok(n) => {
                bytes.extend_from_slice(&part[..n]);
                since = Instant::now();
                continue;
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(e) => return Err(e),
        }
        if since.elapsed() > PATIENCE {
            let told = format!("nothing was written to this pipe for {} s", PATIENCE.as_secs());
            return Err(io::Error::new(ErrorKind::TimedOut, told));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Opens without waiting: a named pipe that nobody writes to would not open otherwise.
fn open_anything(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK | libc::O_NOCTTY);
    options.open(path)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::process::Command;

    fn pipe(name: &str) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("taut-pipe-{name}-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    }

    /// A case that named a pipe held a thread of the studio for ever.
    #[test]
    fn a_pipe_is_refused_at_once_or_read_with_a_bound() {
        let path = pipe("bound");
        assert_eq!(open(&path).unwrap_err().kind(), ErrorKind::InvalidInput);
        let begin = Instant::now();
        assert_eq!(read(&path, 10).unwrap_err().kind(), ErrorKind::TimedOut);
        assert!(begin.elapsed() < 2 * PATIENCE);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_pipe_that_is_written_to_is_read_to_its_end() {
        let path = pipe("read");
        let text = "0123456789".repeat(20_000);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(100));
                std::fs::write(&path, &text).unwrap();
            });
            assert!(read(&path, 1 << 20).unwrap() == text.as_bytes());
        });
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn folders_and_devices_are_no_files() {
        assert_eq!(open("/").unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(open("/dev/zero").unwrap_err().kind(), ErrorKind::InvalidInput);
        assert_eq!(read("/dev/zero", 100_000).unwrap(), vec![0; 100_000]);
    }
}
