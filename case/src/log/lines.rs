//! The lines of a text file, one at a time and of bounded length, and their fields.

use crate::error::{Error, Result, SourceLocation};
use crate::files::Source;
use std::io::{self, BufRead, BufReader, Read};
use std::ops::Range;
use std::path::Path;

/// The longest line that is read, bytes.
const LINE_LIMIT: usize = 1 << 20;

/// The most columns a file may have.
const COLUMN_LIMIT: usize = 10_000;

/// A line cut into fields, with quotes taken off.
pub(super) struct Fields {
    separator: u8,
    reader: Box<csv_core::Reader>,
    text: Vec<u8>,
    ends: Vec<usize>,
    used: usize,
}

impl Fields {
    pub fn new(separator: u8) -> Self {
        let reader = Box::new(csv_core::ReaderBuilder::new().delimiter(separator).build());
        Self { separator, reader, text: Vec::new(), ends: vec![0; COLUMN_LIMIT + 2], used: 0 }
    }

    /// Cuts the current line.
    pub fn split<R: BufRead>(&mut self, lines: &Lines<'_, R>) -> Result<()> {
        self.split_text(lines, &lines.text)
    }

    /// Cuts a text as if it were the current line.
    pub fn split_text<R: BufRead>(&mut self, lines: &Lines<'_, R>, text: &str) -> Result<()> {
        use csv_core::ReadRecordResult::{InputEmpty, OutputEndsFull, Record};
        let blanks;
        let line = match self.separator {
            b' ' => {
                blanks = single_blanks(text);
                blanks.as_str()
            }
            _ => text,
        };
        if self.text.len() < line.len() + 1 {
            self.text.resize(line.len() + 1, 0);
        }
        let reader = &mut self.reader;
        reader.reset();
        let (result, _, written, ends) = reader.read_record(line.as_bytes(), &mut self.text, &mut self.ends);
        self.used = ends;
        let result = if matches!(result, InputEmpty) {
            let (result, _, _, ends) = reader.read_record(b"\n", &mut self.text[written..], &mut self.ends[ends..]);
            self.used += ends;
            result
        } else {
            result
        };
        if matches!(result, OutputEndsFull) || self.used > COLUMN_LIMIT + 1 {
            return Err(too_many_columns(lines));
        }
        if !matches!(result, Record) {
            let start = line.rfind('"').unwrap_or(0);
            let what = "this quote is not closed on its line";
            return Err(Error::new(what).at(lines.place(start..start + 1)).next("remove it, or close it on this line"));
        }
        Ok(())
    }

    pub fn len(&self) -> usize {
        self.used
    }

    /// The k-th field without spaces and quotes around it; empty if there is none.
    pub fn get(&self, k: usize) -> &str {
        let Some(&end) = self.ends[..self.used].get(k) else { return "" };
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        let text = std::str::from_utf8(&self.text[start..end]).unwrap_or_default().trim();
        // Strictly, a quote after a space quotes nothing; many programs write it all the same.
        text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).map_or(text, str::trim)
    }

    /// Where the k-th field stands in the line it was cut from, quotes included, spaces around it not.
    pub fn extent(&self, line: &str, k: usize) -> Range<usize> {
        let (mut field, mut start, mut quoted) = (0, 0, false);
        let mut end = line.len();
        let blank = |byte: u8| self.separator == b' ' && matches!(byte, b' ' | b'\t');
        let mut before = b' ';
        for (i, byte) in line.bytes().enumerate() {
            quoted ^= byte == b'"';
            let parts = if blank(byte) { !blank(before) } else { byte == self.separator };
            before = byte;
            if parts && !quoted {
                if field == k {
                    end = i;
                    break;
                }
                field += 1;
                start = i + 1;
            }
        }
        let text = &line[start..end];
        if text.trim().is_empty() {
            return start..end;
        }
        let start = start + text.len() - text.trim_start().len();
        start..start + text.trim().len()
    }
}

/// The line with one space where there are blanks, and none at its ends; quotes are left alone.
fn single_blanks(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    let (mut quoted, mut pending) = (false, false);
    for c in line.trim().chars() {
        quoted ^= c == '"';
        if !quoted && matches!(c, ' ' | '\t') {
            pending = true;
            continue;
        }
        if std::mem::take(&mut pending) {
            text.push(' ');
        }
        text.push(c);
    }
    text
}

/// The beginnings of a line that is a remark.
const REMARKS: [&str; 3] = ["#", "%", "//"];

/// The lines of a file, one at a time.
pub(super) struct Lines<'a, R> {
    pub file: &'a Path,
    input: R,
    /// Of the current line, from 1.
    pub number: usize,
    pub text: String,
    /// True if the current line ended as lines do.
    pub complete: bool,
    /// The last remark before the current line, without its mark.
    pub remark: String,
}

impl<'a, R: BufRead> Lines<'a, R> {
    /// Before the first line.
    pub fn new(file: &'a Path, input: R) -> Self {
        Self { file, input, number: 0, text: String::new(), complete: true, remark: String::new() }
    }

    /// Goes to the next line that is neither blank nor a comment; false at the end.
    pub fn advance(&mut self) -> Result<bool> {
        loop {
            let mut bytes = std::mem::take(&mut self.text).into_bytes();
            bytes.clear();
            let limited = (&mut self.input).take(LINE_LIMIT as u64 + 1).read_until(b'\n', &mut bytes);
            if limited.map_err(|error| unreadable(self.file, &error))? == 0 {
                return Ok(false);
            }
            self.number += 1;
            if self.number == 1 {
                self.check_kind(&bytes)?;
                if bytes.starts_with(b"\xEF\xBB\xBF") {
                    bytes.drain(..3);
                }
            }
            self.complete = bytes.last() == Some(&b'\n');
            while matches!(bytes.last(), Some(b'\n' | b'\r')) {
                bytes.pop();
            }
            if bytes.contains(&0) {
                let what = format!("line {} has zero bytes: this is not a text file", self.number);
                return Err(self.error(what).allowed("CSV in UTF-8").next("export the data as CSV, in UTF-8"));
            }
            if bytes.len() > LINE_LIMIT {
                self.text = String::from_utf8_lossy(&bytes).into_owned();
                return Err(self.too_long());
            }
            if bytes.contains(&b'\r') {
                let what = format!("line {} has a carriage return within it", self.number);
                return Err(self
                    .error(what)
                    .allowed("lines that end with a line feed, or a carriage return and a line feed")
                    .next("save the file with Windows or Unix line ends"));
            }
            self.text = String::from_utf8(bytes).map_err(|error| {
                let at = error.utf8_error().valid_up_to();
                let what = format!("byte {} of line {} is not UTF-8", at + 1, self.number);
                self.error(what).allowed("text in UTF-8").next("save the file again as UTF-8")
            })?;
            if self.text.trim().is_empty() {
                continue;
            }
            match REMARKS.iter().find_map(|mark| self.text.trim_start().strip_prefix(mark)) {
                Some(remark) => self.remark = remark.to_string(),
                None => return Ok(true),
            }
        }
    }

    /// Other kinds of file that people have at hand, by how they begin.
    fn check_kind(&self, bytes: &[u8]) -> Result<()> {
        let kinds: [(&[u8], &str); 5] = [
            (b"PK\x03\x04", "a ZIP archive, such as a spreadsheet"),
            (b"\xD0\xCF\x11\xE0", "an old spreadsheet"),
            (b"\x1F\x8B", "a compressed file"),
            (b"\xFF\xFE", "text in UTF-16"),
            (b"\xFE\xFF", "text in UTF-16"),
        ];
        match kinds.into_iter().find(|(start, _)| bytes.starts_with(start)) {
            Some((_, kind)) => Err(self
                .error(format!("this is {kind}"))
                .allowed("CSV in UTF-8")
                .next("export the data as CSV, in UTF-8")),
            None => Ok(()),
        }
    }

    fn too_long(&self) -> Error {
        if b"\t;,".iter().any(|c| self.text.bytes().filter(|b| b == c).count() > COLUMN_LIMIT) {
            return too_many_columns(self);
        }
        self.error(format!("line {} is longer than 1 MiB", self.number))
            .allowed("lines of at most 1 MiB")
            .next("check that the file is CSV, with one row to a line")
    }

    /// An error about the whole file.
    pub fn error(&self, what: impl Into<String>) -> Error {
        Error::new(what).in_file(self.file)
    }

    /// The bytes `range` of the current line.
    pub fn place(&self, range: Range<usize>) -> SourceLocation {
        let mut place = SourceLocation::in_text(self.file, &self.text, range);
        if let Some(span) = &mut place.span {
            span.line = self.number;
        }
        place
    }
}

fn too_many_columns<R: BufRead>(lines: &Lines<'_, R>) -> Error {
    let what = format!("line {} has more than 10,000 columns", lines.number);
    lines.error(what).allowed("at most 10,000 columns").next("keep only the columns you need; samples go down, in rows")
}

pub(super) fn open(file: &Path) -> Result<BufReader<Source>> {
    Ok(BufReader::with_capacity(1 << 16, crate::files::open(file).map_err(|error| unreadable(file, &error))?))
}

/// The first bytes of a file, enough to tell what kind it is.
pub(super) fn beginning(file: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(file)?.take(1024).read_to_end(&mut bytes).map_err(|error| unreadable(file, &error))?;
    Ok(bytes)
}

pub(super) fn unreadable(file: &Path, error: &io::Error) -> Error {
    let (what, next) = match error.kind() {
        io::ErrorKind::NotFound => ("there is no such file".into(), "check the name and the folder it is in"),
        io::ErrorKind::PermissionDenied => ("you may not read this file".into(), "check its permissions"),
        io::ErrorKind::IsADirectory => ("this is a folder, not a file".into(), "name a file in it"),
        io::ErrorKind::InvalidInput => (error.to_string(), "write what it holds to a file, and name that"),
        io::ErrorKind::Unsupported => (error.to_string(), "drop the file on the page"),
        _ => (format!("the file cannot be read: {error}"), "check the disk or the connection to it"),
    };
    Error::new(what).in_file(file).next(next)
}
