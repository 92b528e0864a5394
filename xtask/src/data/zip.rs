//! One file out of a ZIP archive (PKWARE's APPNOTE.TXT 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16), stored or deflated.

use flate2::read::DeflateDecoder;
use std::io::Read;

/// Larger files are refused, whatever they were packed into.
const LARGEST: u64 = 100_000_000;

/// The content of the only file whose name is this, in whatever folder.
pub fn member(archive: &[u8], name: &str) -> Result<Vec<u8>, String> {
    let broken = || "this is no whole ZIP archive".to_string();
    // The end of the central directory stands last, before a remark of at most 65,535 bytes.
    let last = archive.len().saturating_sub(22 + 65_535);
    let end = (last..archive.len().saturating_sub(21)).rev().find(|at| archive[*at..].starts_with(b"PK\x05\x06"));
    let end = end.ok_or_else(broken)?;
    let count = number(archive, end + 10, 2).ok_or_else(broken)?;
    let mut at = number(archive, end + 16, 4).ok_or_else(broken)?;
    let (mut found, mut names) = (None, Vec::new());
    for _ in 0..count {
        let of = |offset: usize, bytes: usize| number(archive, at + offset, bytes).ok_or_else(broken);
        let (name_length, extra, remark) = (of(28, 2)?, of(30, 2)?, of(32, 2)?);
        let own = archive.get(at + 46..at + 46 + name_length).ok_or_else(broken)?;
        let own = String::from_utf8_lossy(own).into_owned();
        if own.rsplit(['/', '\\']).next() == Some(name) {
            found = Some((of(10, 2)?, of(20, 4)?, of(42, 4)?));
        }
        names.push(own);
        at += 46 + name_length + extra + remark;
    }
    let (method, packed, start) =
        found.ok_or_else(|| format!("the archive holds no {name}, but {}", names.join(", ")))?;
    let of = |offset: usize| number(archive, start + offset, 2).ok_or_else(broken);
    let begin = start + 30 + of(26)? + of(28)?;
    let bytes = archive.get(begin..begin + packed).ok_or_else(broken)?;
    match method {
        0 => Ok(bytes.to_vec()),
        8 => {
            let mut out = Vec::new();
            let read = DeflateDecoder::new(bytes).take(LARGEST).read_to_end(&mut out);
            read.map(|_| out).map_err(|error| format!("{name} cannot be unpacked: {error}"))
        }
        other => Err(format!("{name} is packed by method {other}; stored (0) and deflated (8) are known")),
    }
}

/// A little-endian number.
fn number(bytes: &[u8], at: usize, length: usize) -> Option<usize> {
    Some(bytes.get(at..at + length)?.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte)))
}
