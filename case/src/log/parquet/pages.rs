//! How large the pages of a column are once unpacked, before one is: the reader takes the memory that a page's header
//! asks for.
//!
//! A page begins with a structure of Thrift's compact protocol, of which fields 2 and 3 are its sizes unpacked and
//! packed.

use super::damaged;
use crate::error::{Error, Result};
use crate::log::lines::unreadable;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::ParquetMetaData;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Largest page, bytes once unpacked; programs write pages of about 1 MiB.
const LARGEST: i64 = 1 << 28;

/// Bytes that are read for a header: of a column of numbers it has some 20 to 100.
const HEADER: u64 = 4096;

/// Refuses a column with a page that is too large, or with something else in the place of a page.
pub(super) fn check(file: &Path, metadata: &ParquetMetaData, column: usize) -> Result<()> {
    let mut input = crate::files::open(file).map_err(|error| unreadable(file, &error))?;
    for group in metadata.row_groups() {
        let chunk = group.column(column);
        let starts = [Some(chunk.data_page_offset()), chunk.dictionary_page_offset()];
        let begin = starts.into_iter().flatten().min().and_then(|start| u64::try_from(start).ok());
        let (Some(mut place), Ok(length)) = (begin, u64::try_from(chunk.compressed_size())) else { continue };
        let end = place.saturating_add(length);
        while place < end {
            let mut bytes = Vec::new();
            let read =
                input.seek(SeekFrom::Start(place)).and_then(|_| (&mut input).take(HEADER).read_to_end(&mut bytes));
            read.map_err(|error| unreadable(file, &error))?;
            let Some(header) = Header::read(&bytes) else {
                return Err(damaged(file, &ParquetError::General("the header of a page is damaged".into())));
            };
            if header.unpacked > LARGEST {
                let what = format!("a page of this Parquet file takes {} MiB once unpacked", header.unpacked >> 20);
                return Err(Error::new(what)
                    .in_file(file)
                    .allowed(format!("up to {} MiB", LARGEST >> 20))
                    .next("write it again with smaller pages, 1 MiB is usual; or as CSV"));
            }
            place = place.saturating_add(header.length).saturating_add(header.packed);
        }
    }
    Ok(())
}

/// The header of a page.
struct Header {
    /// Sizes of its data, bytes.
    unpacked: i64,
    packed: u64,
    /// Its own length, bytes.
    length: u64,
}

impl Header {
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut input = Compact { bytes };
        let (mut unpacked, mut packed) = (None, None);
        let mut field = 0;
        while let Some(kind) = input.field(&mut field)? {
            match (field, kind) {
                (2, INTEGER) => unpacked = Some(input.integer()?),
                (3, INTEGER) => packed = Some(input.integer()?),
                _ => input.skip(kind, 0)?,
            }
        }
        Some(Self {
            unpacked: unpacked?,
            packed: u64::try_from(packed?).ok()?,
            length: (bytes.len() - input.bytes.len()) as u64,
        })
    }
}

/// A number of 32 bits.
const INTEGER: u8 = 5;

/// Deepest nesting that is followed.
const DEEPEST: usize = 8;

/// Thrift's compact protocol, from its specification.
struct Compact<'a> {
    bytes: &'a [u8],
}

impl Compact<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&byte, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(byte)
    }

    fn pass(&mut self, count: usize) -> Option<()> {
        self.bytes = self.bytes.get(count..)?;
        Some(())
    }

    /// Seven bits to a byte, the lowest first.
    fn unsigned(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    /// 0, −1, 1, −2, … as 0, 1, 2, 3, …
    fn integer(&mut self) -> Option<i64> {
        let code = self.unsigned()?;
        Some((code >> 1) as i64 ^ -((code & 1) as i64))
    }

    /// The kind of the next field, whose number is counted on; none within at the end of the structure.
    fn field(&mut self, number: &mut i64) -> Option<Option<u8>> {
        let head = self.byte()?;
        if head == 0 {
            return Some(None);
        }
        *number = match head >> 4 {
            0 => self.integer()?,
            step => *number + i64::from(step),
        };
        Some(Some(head & 0x0F))
    }

    fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        if depth > DEEPEST {
            return None;
        }
        match kind {
            // Truth values stand in the kind itself.
            1 | 2 => Some(()),
            3 => self.pass(1),
            4..=6 => self.unsigned().map(|_| ()),
            7 => self.pass(8),
            8 => {
                let length = self.unsigned()?;
                self.pass(usize::try_from(length).ok()?)
            }
            9 | 10 => {
                let head = self.byte()?;
                let count = if head >> 4 == 15 { self.unsigned()? } else { u64::from(head >> 4) };
                (0..count).try_for_each(|_| match head & 0x0F {
                    1 | 2 => self.pass(1),
                    kind => self.skip(kind, depth + 1),
                })
            }
            12 => {
                let mut number = 0;
                while let Some(kind) = self.field(&mut number)? {
                    self.skip(kind, depth + 1)?;
                }
                Some(())
            }
            _ => None,
        }
    }
}
