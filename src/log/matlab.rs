//! Columns from MATLAB files of versions 5 to 7, plain or compressed, of either byte order.
//!
//! Read are real arrays of any numeric class: a vector, or one column or row of a matrix as in `data(:,2)`. Text, structs, cells
//! and objects are passed over and named where one is asked for. Files of version 7.3 are HDF5: they are refused with a remedy.
//!
//! After "MAT-File Format" (MathWorks, R2019b): a header of 128 bytes, then elements, each of type, size and data.

use super::csv::{near, shown};
use super::lines::unreadable;
use super::sheet::{ColumnId, Request, Sheet};
use crate::error::{Error, Result};
use flate2::read::ZlibDecoder;
use std::io::{self, Read};
use std::path::Path;

/// Bytes of the header.
const HEADER: usize = 128;

/// Largest file, and largest array once unpacked, bytes.
const LARGEST: u64 = 1 << 30;

/// How MATLAB and Python write what is read here.
const SAVE: &str = "save it again, in MATLAB with save('log.mat', '-v7'), in Python with scipy.io.savemat";

/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Whether a file is one of MATLAB's, by how it begins or, where that says nothing, by its name.
pub(super) fn is_matlab(file: &Path, beginning: &[u8]) -> bool {
    let binary = beginning.contains(&0);
    let named = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("mat"));
    beginning.starts_with(b"MATLAB") || is_hdf5(beginning) || (binary && (named || is_version_5(beginning)))
}

/// Version and byte order at the end of the header.
fn is_version_5(beginning: &[u8]) -> bool {
    matches!(beginning.get(124..HEADER), Some(b"\x00\x01IM" | b"\x01\x00MI"))
}

fn is_hdf5(beginning: &[u8]) -> bool {
    let mark = b"\x89HDF\r\n\x1A\n";
    beginning.starts_with(mark) || beginning.get(512..).is_some_and(|rest| rest.starts_with(mark))
}

/// Reads the wanted variables.
pub(super) fn read(file: &Path, beginning: &[u8], request: &Request<'_>) -> Result<Sheet> {
    let fail = |what: &str| Error::new(what).in_file(file);
    if is_hdf5(beginning) || beginning.starts_with(b"MATLAB 7.3") {
        return Err(fail("this is a MATLAB file of version 7.3, or another HDF5 file")
            .allowed("MATLAB files of versions 5 to 7")
            .next(SAVE));
    }
    if !is_version_5(beginning) {
        return Err(fail("this is no MATLAB file of version 5 to 7; it may be one of version 4, or damaged").next(SAVE));
    }
    let wanted = request.all_columns().map(|id| Wanted::new(file, id)).collect::<Result<Vec<_>>>()?;
    let mut bytes = Vec::new();
    let input = std::fs::File::open(file).map_err(|error| unreadable(file, &error))?;
    input.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|error| unreadable(file, &error))?;
    if bytes.len() as u64 > LARGEST {
        return Err(fail("this file is larger than 1 GiB").next("save only the variables that are needed"));
    }
    let variables = variables(&bytes, &wanted).map_err(|error| {
        let told = match error.kind() {
            io::ErrorKind::UnexpectedEof => "this MATLAB file breaks off before its end".to_string(),
            _ => format!("this MATLAB file is damaged: {error}"),
        };
        fail(&told).next(SAVE)
    })?;
    let columns = wanted.iter().map(|wanted| wanted.values(file, &variables)).collect::<Result<Vec<_>>>()?;
    let lengths = columns.iter().map(Vec::len).zip(&wanted);
    if let Some((first, (length, other))) =
        columns.first().map(Vec::len).zip(lengths.into_iter().find(|(n, _)| *n != columns[0].len()))
    {
        let what = format!("{} has {first} values and {} has {length}", shown(&wanted[0].text), shown(&other.text));
        return Err(fail(&what).allowed("variables of the same length").next("save them with one value per sample"));
    }
    if columns.first().is_none_or(Vec::is_empty) {
        return Err(fail("the variables are empty").next("check that the recording was saved"));
    }
    let names = wanted.iter().take(request.columns.len()).map(|wanted| shown(&wanted.text)).collect();
    Sheet::from_columns(file, names, &columns, request)
}

/// A variable that is asked for, or a column or row of one.
struct Wanted {
    /// As it was asked for: `data(:,2)`.
    text: String,
    name: String,
    part: Part,
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    Vector,
    Column(usize),
    Row(usize),
}

impl Wanted {
    fn new(file: &Path, id: &ColumnId) -> Result<Self> {
        let ColumnId::Name(text) = id else {
            let what =
                format!("column {} is asked for by number; this MATLAB file holds variables with names", id.shown());
            return Err(Error::new(what).in_file(file).next("name the variable, or a column of one as \"data(:,2)\""));
        };
        let whole = Self { text: text.clone(), name: text.clone(), part: Part::Vector };
        let Some((name, rest)) = text.strip_suffix(')').and_then(|text| text.split_once('(')) else { return Ok(whole) };
        let number = |text: &str| text.trim().parse::<usize>().ok().filter(|&k| k > 0);
        let part = match rest.split_once(',') {
            Some((all, k)) if all.trim() == ":" => number(k).map(Part::Column),
            Some((k, all)) if all.trim() == ":" => number(k).map(Part::Row),
            _ => None,
        };
        match part {
            Some(part) => Ok(Self { name: name.trim().to_string(), part, ..whole }),
            None => Err(Error::new(format!("{} is neither a variable nor a part of one", shown(text)))
                .in_file(file)
                .allowed("a name such as x, a column such as x(:,2), a row such as x(2,:)")),
        }
    }

    fn values(&self, file: &Path, variables: &[Variable]) -> Result<Vec<f64>> {
        let fail = |what: String| Error::new(what).in_file(file);
        let name = shown(&self.name);
        let Some(variable) = variables.iter().find(|variable| variable.name == self.name) else {
            let list: Vec<String> = variables.iter().take(20).map(Variable::described).collect();
            let error = fail(format!("there is no variable {name}")).allowed(list.join(", "));
            return Err(match near(&self.name, variables.iter().map(|v| v.name.as_str())) {
                Some(near) => error.next(format!("did you mean {}?", shown(near))),
                None => error.next("name one of these variables"),
            });
        };
        let size = variable.size();
        let Content::Numbers(values) = &variable.content else {
            let kind = variable.kind();
            return Err(fail(format!("{name} is {kind}, which is not read")).allowed("arrays of real numbers").next(
                format!(
                    "save what is in it as variables of their own: t = {}.t; save('log.mat', 't', '-v7')",
                    self.name
                ),
            ));
        };
        let &[rows, columns] = &variable.dimensions[..] else {
            return Err(fail(format!("{name} has {} dimensions ({size})", variable.dimensions.len()))
                .allowed("vectors and matrices")
                .next("save the part that is the log as a variable of its own"));
        };
        match self.part {
            Part::Vector if rows == 1 || columns == 1 || values.is_empty() => Ok(values.clone()),
            Part::Vector => {
                let (part, other) =
                    if rows >= columns { ("(:,1)", "its first column") } else { ("(1,:)", "its first row") };
                Err(fail(format!("{name} is a matrix of {size} numbers"))
                    .allowed("a vector, or a part of a matrix")
                    .next(format!("write \"{}{part}\" for {other}, and so on", self.name)))
            }
            Part::Column(k) if k <= columns => Ok(values[(k - 1) * rows..k * rows].to_vec()),
            Part::Row(k) if k <= rows => Ok(values[k - 1..].iter().step_by(rows).copied().collect()),
            Part::Column(_) | Part::Row(_) => {
                let what = format!("{} is outside of {name}, which has {size} numbers", shown(&self.text));
                let (word, most) =
                    if matches!(self.part, Part::Row(_)) { ("rows", rows) } else { ("columns", columns) };
                Err(fail(what).allowed(format!("{word} 1 to {most}")))
            }
        }
    }
}

/// A variable of the file.
struct Variable {
    name: String,
    class: u8,
    dimensions: Vec<usize>,
    content: Content,
}

enum Content {
    Numbers(Vec<f64>),
    Complex,
    /// Of another kind, or not asked for.
    Passed,
}

impl Variable {
    fn size(&self) -> String {
        self.dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join("x")
    }

    fn kind(&self) -> &'static str {
        match (self.class, &self.content) {
            (1, _) => "a cell array",
            (2, _) => "a struct",
            (4, _) => "text",
            (5, _) => "a sparse matrix",
            (_, Content::Complex) => "an array of complex numbers",
            _ => "an object",
        }
    }

    fn is_numeric(&self) -> bool {
        (6..=15).contains(&self.class)
    }

    fn described(&self) -> String {
        match self.is_numeric() {
            true => format!("{} ({})", shown(&self.name), self.size()),
            false => format!("{} ({})", shown(&self.name), self.kind()),
        }
    }
}

/// All variables of a file, with the numbers of the wanted ones.
fn variables(bytes: &[u8], wanted: &[Wanted]) -> io::Result<Vec<Variable>> {
    let big = bytes.get(126..HEADER) == Some(b"MI");
    let mut input = bytes.get(HEADER..).ok_or(io::ErrorKind::UnexpectedEof)?;
    let mut found = Vec::new();
    while !input.is_empty() {
        let mut outer = Elements { input, big };
        let (kind, size, _) = outer.tag()?;
        let body = outer.input.get(..size).ok_or(io::ErrorKind::UnexpectedEof)?;
        let variable = match kind {
            COMPRESSED => {
                let mut inner = Elements { input: ZlibDecoder::new(body), big };
                match inner.tag()? {
                    (MATRIX, ..) => Some(inner.variable(wanted)?),
                    _ => None,
                }
            }
            MATRIX => Some(Elements { input: body, big }.variable(wanted)?),
            _ => None,
        };
        // What has no name is MATLAB's own.
        found.extend(variable.filter(|variable| !variable.name.is_empty()));
        // Compressed elements are not filled up to eight bytes.
        let size = if kind == COMPRESSED { size } else { size.next_multiple_of(8) };
        input = outer.input.get(size..).unwrap_or_default();
    }
    Ok(found)
}

/// Elements one after another.
struct Elements<R> {
    input: R,
    big: bool,
}

impl<R: Read> Elements<R> {
    fn word(&mut self) -> io::Result<[u8; 4]> {
        let mut word = [0; 4];
        self.input.read_exact(&mut word)?;
        Ok(word)
    }

    fn number(&self, word: [u8; 4]) -> u32 {
        if self.big { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) }
    }

    /// Type and size of the next element, and its data where they are so short that they stand in its tag.
    fn tag(&mut self) -> io::Result<(u32, usize, Option<[u8; 4]>)> {
        let first = self.word()?;
        let first = self.number(first);
        let second = self.word()?;
        match first >> 16 {
            0 => Ok((first, self.number(second) as usize, None)),
            size @ 1..=4 => Ok((first & 0xFFFF, size as usize, Some(second))),
            _ => Err(bad("an element is longer than its place")),
        }
    }

    /// The next element whole.
    fn element(&mut self) -> io::Result<(u32, Vec<u8>)> {
        let (kind, size, short) = self.tag()?;
        if let Some(data) = short {
            return Ok((kind, data[..size].to_vec()));
        }
        if size as u64 > LARGEST {
            return Err(bad("an array is larger than 1 GiB"));
        }
        let mut data = Vec::new();
        let all = size.next_multiple_of(8);
        (&mut self.input).take(all as u64).read_to_end(&mut data)?;
        // The last element may lack what fills it up.
        if data.len() < size {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        data.truncate(size);
        Ok((kind, data))
    }

    /// A variable, whose tag has been read.
    fn variable(&mut self, wanted: &[Wanted]) -> io::Result<Variable> {
        let (_, flags) = self.element()?;
        let flags = flags.get(..4).and_then(|word| word.try_into().ok()).ok_or(bad("an array has no class"))?;
        let flags = self.number(flags);
        let class = flags as u8;
        let complex = flags & 0x800 != 0;
        let dimensions = if class == 17 {
            Vec::new()
        } else {
            let (kind, data) = self.element()?;
            values(kind, &data, self.big)?.into_iter().map(|n| n as usize).collect()
        };
        let (_, name) = self.element()?;
        let name = String::from_utf8_lossy(&name).into_owned();
        let mut variable = Variable { name, class, dimensions, content: Content::Passed };
        if !variable.is_numeric() || wanted.iter().all(|wanted| wanted.name != variable.name) {
            return Ok(variable);
        }
        if complex {
            variable.content = Content::Complex;
            return Ok(variable);
        }
        let (kind, data) = self.element()?;
        let numbers = values(kind, &data, self.big)?;
        if variable.dimensions.iter().try_fold(1usize, |n, &d| n.checked_mul(d)) != Some(numbers.len()) {
            return Err(bad("an array does not have as many numbers as it says"));
        }
        variable.content = Content::Numbers(numbers);
        Ok(variable)
    }
}

fn bad(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// The numbers of an element.
fn values(kind: u32, data: &[u8], big: bool) -> io::Result<Vec<f64>> {
    fn each<const N: usize>(data: &[u8], big: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let (words, _) = data.as_chunks::<N>();
        let in_order = |word: &[u8; N]| {
            let mut word = *word;
            if big {
                word.reverse();
            }
            number(word)
        };
        words.iter().map(in_order).collect()
    }
    Ok(match kind {
        1 => each(data, big, |b| f64::from(i8::from_le_bytes(b))),
        2 => each(data, big, |b| f64::from(u8::from_le_bytes(b))),
        3 => each(data, big, |b| f64::from(i16::from_le_bytes(b))),
        4 => each(data, big, |b| f64::from(u16::from_le_bytes(b))),
        5 => each(data, big, |b| f64::from(i32::from_le_bytes(b))),
        6 => each(data, big, |b| f64::from(u32::from_le_bytes(b))),
        7 => each(data, big, |b| f64::from(f32::from_le_bytes(b))),
        9 => each(data, big, f64::from_le_bytes),
        12 => each(data, big, |b| i64::from_le_bytes(b) as f64),
        13 => each(data, big, |b| u64::from_le_bytes(b) as f64),
        _ => return Err(bad("an array has numbers of an unknown type")),
    })
}
