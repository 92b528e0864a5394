//! A ZIP archive: what an FMU is packed into. Names, sizes, sums; each file deflated where that makes it smaller.
//!
//! The format is that of PKWARE's application note, 4.3.7 (local headers), 4.3.12 (central directory) and 4.3.16 (its
//! end), without what an FMU has no use for: encryption, several disks, sizes beyond 4 GB.

use crate::error::{Error, Result};
use flate2::Crc;
use flate2::write::DeflateEncoder;
use std::io::Write;

/// First of January 1980, the earliest time that the format can say: archives of one content are one file.
const DATE: u16 = 0x21;

/// Names are UTF-8.
const UTF8: u16 = 1 << 11;

/// An archive that is being filled.
#[derive(Debug, Default)]
pub struct Archive {
    bytes: Vec<u8>,
    directory: Vec<u8>,
    names: Vec<String>,
}

impl Archive {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file; folders are in its name, with `/`. Errors: a second one of that name, or one that is too large.
    pub fn add(&mut self, name: &str, content: &[u8]) -> Result<()> {
        if self.names.iter().any(|other| other == name) {
            return Err(Error::new(format!("{name} would be in the archive twice")));
        }
        let too_large = || Error::new(format!("{name} is too large for an archive")).allowed("up to 4 GB in all");
        let mut deflate = DeflateEncoder::new(Vec::new(), flate2::Compression::default());
        let packed = deflate.write_all(content).and_then(|()| deflate.finish());
        let packed = packed.map_err(|e| Error::new(format!("{name} cannot be packed: {e}")))?;
        // 8 is deflated, 0 as it is.
        let (method, data): (u16, &[u8]) = if packed.len() < content.len() { (8, &packed) } else { (0, content) };
        let mut crc = Crc::new();
        crc.update(content);
        let size = |length: usize| u32::try_from(length).map_err(|_| too_large());
        let (offset, stored, whole) = (size(self.bytes.len())?, size(data.len())?, size(content.len())?);
        size(self.bytes.len() + data.len() + name.len() + 1024)?;
        let length = u16::try_from(name.len()).map_err(|_| too_large())?;

        let mut common = Vec::with_capacity(26);
        [20, UTF8, method, 0, DATE].into_iter().for_each(|field: u16| common.extend(field.to_le_bytes()));
        [crc.sum(), stored, whole].into_iter().for_each(|field: u32| common.extend(field.to_le_bytes()));
        [length, 0].into_iter().for_each(|field: u16| common.extend(field.to_le_bytes()));

        self.bytes.extend(b"PK\x03\x04");
        self.bytes.extend(&common);
        self.bytes.extend(name.as_bytes());
        self.bytes.extend(data);

        self.directory.extend(b"PK\x01\x02");
        // Made on Unix, so that the file's permissions are read: rw-r--r-- of a plain file.
        self.directory.extend((20u16 | 3 << 8).to_le_bytes());
        self.directory.extend(&common);
        [0u16, 0, 0].into_iter().for_each(|field| self.directory.extend(field.to_le_bytes()));
        [0o100_644u32 << 16, offset].into_iter().for_each(|field| self.directory.extend(field.to_le_bytes()));
        self.directory.extend(name.as_bytes());
        self.names.push(name.to_string());
        Ok(())
    }

    /// The names in it so far.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The whole of it.
    pub fn finish(mut self) -> Result<Vec<u8>> {
        let too_large = || Error::new("this is too large for an archive").allowed("up to 65535 files and 4 GB in all");
        let count = u16::try_from(self.names.len()).map_err(|_| too_large())?;
        let begin = u32::try_from(self.bytes.len()).map_err(|_| too_large())?;
        let length = u32::try_from(self.directory.len()).map_err(|_| too_large())?;
        self.bytes.append(&mut self.directory);
        self.bytes.extend(b"PK\x05\x06");
        [0, 0, count, count].into_iter().for_each(|field: u16| self.bytes.extend(field.to_le_bytes()));
        [length, begin].into_iter().for_each(|field: u32| self.bytes.extend(field.to_le_bytes()));
        self.bytes.extend(0u16.to_le_bytes());
        Ok(self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_earliest_date_and_its_sum() {
        let mut archive = Archive::new();
        archive.add("a.txt", b"123456789").unwrap();
        assert!(archive.add("a.txt", b"").unwrap_err().to_string().contains("twice"));
        let bytes = archive.finish().unwrap();
        let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        // Local header: stored, 0:00 on the first of January 1980.
        assert_eq!((&bytes[..4], word(8), word(10), word(12)), (&b"PK\x03\x04"[..], 0, 0, 1 << 5 | 1));
        // CRC-32 of these digits, by which its implementations are compared.
        assert_eq!(bytes[14..18], 0xcbf4_3926_u32.to_le_bytes());
        assert_eq!(&bytes[30..44], b"a.txt123456789");
    }
}
