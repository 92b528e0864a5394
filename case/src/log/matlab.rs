//! Columns from MATLAB files of versions 5 to 7, plain or compressed, of either byte order.
//!
//! Read are real arrays of any numeric class: a vector, or one column or row of a matrix as in `data(:,2)`. Text,
//! structs, cells and objects are passed over and named where one is asked for. Files of version 7.3 are HDF5: they are
//! refused with a remedy.
//!
//! After "MAT-File Format" (MathWorks, R2019b): a header of 128 bytes, then elements, each of type, size and data.

use super::lines::unreadable;
use super::sheet::{ColumnId, Request, Sheet};
use super::words::{near, shown};
use crate::error::{Error, Result};
use crate::files::Source;
use flate2::read::ZlibDecoder;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes of the header.
const HEADER: usize = 128;

/// Largest file, and what the wanted variables may take once unpacked, all together, bytes.
const LARGEST: u64 = 1 << 30;

/// Longest description of an array that stands before its numbers, bytes: class, dimensions or name.
const LONGEST_WORDS: usize = 4096;

/// Most variables.
const MOST_VARIABLES: usize = 100_000;

/// Numbers that are unpacked at a time.
const BLOCK: usize = 8192;

/// How MATLAB and Python write what is read here.
const SAVE: &str = "save it again, in MATLAB with save('log.mat', '-v7'), in Python with scipy.io.savemat";

/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// True if a file is one of MATLAB's, by how it begins or, where that says nothing, by its name.
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
    let mut input = Input::open(file)?;
    if input.length > LARGEST {
        return Err(fail("this file is larger than 1 GiB").next("save only the variables that are needed"));
    }
    let damaged = |error: io::Error| {
        let told = match error.kind() {
            io::ErrorKind::UnexpectedEof => "this MATLAB file breaks off before its end".to_string(),
            _ => format!("this MATLAB file is damaged: {error}"),
        };
        fail(&told).next(SAVE)
    };
    let variables = input.variables().map_err(damaged)?;
    let parts = wanted.iter().map(|wanted| wanted.part(file, &variables)).collect::<Result<Vec<_>>>()?;
    if let Some((other, part)) = wanted.iter().zip(&parts).find(|(_, part)| part.length != parts[0].length) {
        let (first, length) = (parts[0].length, part.length);
        let what = format!("{} has {first} values and {} has {length}", shown(&wanted[0].text), shown(&other.text));
        return Err(fail(&what).allowed("variables of the same length").next("save them with one value per sample"));
    }
    if parts.first().is_none_or(|part| part.length == 0) {
        return Err(fail("the variables are empty").next("check that the recording was saved"));
    }
    within_budget(file, &variables, &parts)?;
    let columns = input.columns(&variables, &parts, request.ordered).map_err(damaged)?;
    let names = wanted.iter().take(request.columns.len()).map(|wanted| shown(&wanted.text)).collect();
    Sheet::from_columns(file, names, columns, request)
}

/// Refuses what would take too much memory, by what the variables say of themselves; they hold no more than that.
fn within_budget(file: &Path, variables: &[Variable], parts: &[Part]) -> Result<()> {
    super::sheet::check_numbers(file, parts.len(), parts[0].length)?;
    let read = variables.iter().enumerate().filter(|(k, _)| parts.iter().any(|part| part.variable == *k));
    // As doubles: how they are stored is known only when they are unpacked.
    let bytes = read.fold(0u64, |sum, (_, variable)| sum.saturating_add(8 * variable.count().unwrap_or(0) as u64));
    if bytes <= LARGEST {
        return Ok(());
    }
    Err(Error::new(format!("the wanted variables take {} MiB once unpacked", bytes >> 20))
        .in_file(file)
        .allowed("up to 1024 MiB")
        .next("save the columns that are needed as variables of their own"))
}

/// A variable that is asked for, or a column or row of one.
struct Wanted {
    /// As it was asked for: `data(:,2)`.
    text: String,
    name: String,
    which: Which,
}

#[derive(Clone, Copy, PartialEq)]
enum Which {
    Vector,
    Column(usize),
    Row(usize),
}

/// Where the numbers of a wanted variable are: within the variable, stored column by column, every `step`-th from
/// `first` on.
struct Part {
    variable: usize,
    first: usize,
    step: usize,
    length: usize,
}

/// The names of all vectors of numbers, and of the columns of matrices.
pub(super) fn names(file: &Path, beginning: &[u8]) -> Result<Vec<ColumnId>> {
    if is_hdf5(beginning) || beginning.starts_with(b"MATLAB 7.3") || !is_version_5(beginning) {
        // The reader says what is wrong with it.
        return read(file, beginning, &Request::complete(&[ColumnId::from("time")])).map(|_| Vec::new());
    }
    let variables = Input::open(file)?.variables().map_err(|error| unreadable(file, &error))?;
    let mut names = Vec::new();
    for variable in variables.iter().filter(|variable| variable.is_numeric() && !variable.complex) {
        let &[rows, columns] = &variable.dimensions[..] else { continue };
        match (rows.min(columns), rows >= columns) {
            (0, _) => {}
            (1, _) if rows.max(columns) > 1 => names.push(ColumnId::Name(variable.name.clone())),
            (1, _) => {}
            (few, true) => names.extend((1..=few).map(|k| ColumnId::Name(format!("{}(:,{k})", variable.name)))),
            (few, false) => names.extend((1..=few).map(|k| ColumnId::Name(format!("{}({k},:)", variable.name)))),
        }
    }
    Ok(names)
}

impl Wanted {
    fn new(file: &Path, id: &ColumnId) -> Result<Self> {
        let ColumnId::Name(text) = id else {
            let what =
                format!("column {} is asked for by number; this MATLAB file holds variables with names", id.shown());
            return Err(Error::new(what).in_file(file).next("name the variable, or a column of one as \"data(:,2)\""));
        };
        let whole = Self { text: text.clone(), name: text.clone(), which: Which::Vector };
        let Some((name, rest)) = text.strip_suffix(')').and_then(|text| text.split_once('(')) else { return Ok(whole) };
        let number = |text: &str| text.trim().parse::<usize>().ok().filter(|&k| k > 0);
        let which = match rest.split_once(',') {
            Some((all, k)) if all.trim() == ":" => number(k).map(Which::Column),
            Some((k, all)) if all.trim() == ":" => number(k).map(Which::Row),
            _ => None,
        };
        match which {
            Some(which) => Ok(Self { name: name.trim().to_string(), which, ..whole }),
            None => Err(Error::new(format!("{} is neither a variable nor a part of one", shown(text)))
                .in_file(file)
                .allowed("a name such as x, a column such as x(:,2), a row such as x(2,:)")),
        }
    }

    fn part(&self, file: &Path, variables: &[Variable]) -> Result<Part> {
        let fail = |what: String| Error::new(what).in_file(file);
        let name = shown(&self.name);
        let Some(place) = variables.iter().position(|variable| variable.name == self.name) else {
            let list: Vec<String> = variables.iter().take(20).map(Variable::described).collect();
            let error = fail(format!("there is no variable {name}")).allowed(list.join(", "));
            return Err(match near(&self.name, variables.iter().map(|v| v.name.as_str())) {
                Some(near) => error.next(format!("did you mean {}?", shown(near))),
                None => error.next("name one of these variables"),
            });
        };
        let variable = &variables[place];
        let size = variable.size();
        if !variable.is_numeric() || variable.complex {
            let kind = variable.kind();
            let error = fail(format!("{name} is {kind}, which is not read")).allowed("arrays of real numbers");
            return Err(error.next(variable.remedy()));
        }
        let &[rows, columns] = &variable.dimensions[..] else {
            return Err(fail(format!("{name} has {} dimensions ({size})", variable.dimensions.len()))
                .allowed("vectors and matrices")
                .next("save the part that is the log as a variable of its own"));
        };
        let part = |first: usize, step: usize, length: usize| Part { variable: place, first, step, length };
        match self.which {
            Which::Vector if rows.min(columns) <= 1 => Ok(part(0, 1, rows.saturating_mul(columns))),
            Which::Vector => {
                let (part, other) =
                    if rows >= columns { ("(:,1)", "its first column") } else { ("(1,:)", "its first row") };
                Err(fail(format!("{name} is a matrix of {size} numbers"))
                    .allowed("a vector, or a part of a matrix")
                    .next(format!("write \"{}{part}\" for {other}, and so on", self.name)))
            }
            Which::Column(k) if k <= columns => Ok(part((k - 1).saturating_mul(rows), 1, rows)),
            Which::Row(k) if k <= rows => Ok(part(k - 1, rows, columns)),
            Which::Column(_) | Which::Row(_) => {
                let what = format!("{} is outside of {name}, which has {size} numbers", shown(&self.text));
                let (word, most) =
                    if matches!(self.which, Which::Row(_)) { ("rows", rows) } else { ("columns", columns) };
                Err(fail(what).allowed(format!("{word} 1 to {most}")))
            }
        }
    }
}

/// A variable of the file.
struct Variable {
    name: String,
    class: u8,
    complex: bool,
    dimensions: Vec<usize>,
    /// Where its element is in the file, behind its tag; its length, and whether it is packed.
    begin: u64,
    length: u64,
    packed: bool,
}

impl Variable {
    fn size(&self) -> String {
        self.dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join("x")
    }

    fn kind(&self) -> &'static str {
        match self.class {
            1 => "a cell array",
            2 => "a struct",
            4 => "text",
            5 => "a sparse matrix",
            _ if self.complex => "an array of complex numbers",
            _ => "an object",
        }
    }

    fn remedy(&self) -> String {
        let name = &self.name;
        let made = match self.class {
            1 => format!("t = cell2mat({name}(:,1))"),
            4 => format!("t = str2double({name})"),
            5 => format!("t = full({name})"),
            _ if self.complex => format!("t = real({name})"),
            _ => format!("t = {name}.t"),
        };
        format!("save its numbers as a variable of their own: {made}; save('log.mat', 't', '-v7')")
    }

    /// How many numbers it says it has.
    fn count(&self) -> Option<usize> {
        self.dimensions.iter().try_fold(1usize, |n, &d| n.checked_mul(d))
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

/// The file, of which only what is wanted is unpacked.
struct Input {
    file: BufReader<Source>,
    length: u64,
    big: bool,
}

impl Input {
    fn open(file: &Path) -> Result<Self> {
        let open = || {
            let mut input = BufReader::new(crate::files::open(file)?);
            let length = input.seek(SeekFrom::End(0))?;
            input.seek(SeekFrom::Start(126))?;
            let mut order = [0; 2];
            input.read_exact(&mut order)?;
            Ok(Self { file: input, length, big: order == *b"MI" })
        };
        open().map_err(|error| unreadable(file, &error))
    }

    /// The headers of all variables.
    fn variables(&mut self) -> io::Result<Vec<Variable>> {
        let mut place = HEADER as u64;
        let mut found = Vec::new();
        while place < self.length {
            self.file.seek(SeekFrom::Start(place))?;
            let (kind, length, short) = Elements { input: &mut self.file, big: self.big }.tag()?;
            let (begin, length) = (place + 8, if short.is_some() { 0 } else { length as u64 });
            if begin + length > self.length {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            if matches!(kind, MATRIX | COMPRESSED) {
                let described = self.element(begin, length, kind == COMPRESSED)?.map(|mut inner| inner.variable());
                let described =
                    described.transpose()?.map(|v| Variable { begin, length, packed: kind == COMPRESSED, ..v });
                // What has no name is MATLAB's own.
                found.extend(described.filter(|variable| !variable.name.is_empty()));
                if found.len() > MOST_VARIABLES {
                    return Err(bad("it has more than 100,000 variables"));
                }
            }
            // Compressed elements are not filled up to eight bytes.
            place = begin + if kind == COMPRESSED { length } else { length.next_multiple_of(8) };
        }
        Ok(found)
    }

    /// The inside of an array that lies here; none if it is of another kind.
    fn element(&mut self, begin: u64, length: u64, packed: bool) -> io::Result<Option<Elements<Box<dyn Read + '_>>>> {
        self.file.seek(SeekFrom::Start(begin))?;
        let body = (&mut self.file).take(length);
        let input: Box<dyn Read> = if packed { Box::new(ZlibDecoder::new(body)) } else { Box::new(body) };
        let mut inner = Elements { input, big: self.big };
        Ok(match packed.then(|| inner.tag()).transpose()? {
            None | Some((MATRIX, ..)) => Some(inner),
            Some(_) => None,
        })
    }

    /// The numbers of the parts, each variable unpacked once. Where the first part has to increase, all end with the
    /// first number that does not: what follows is of no use, and a file may be packed a thousand times over.
    fn columns(&mut self, variables: &[Variable], parts: &[Part], ordered: bool) -> io::Result<Vec<Vec<f64>>> {
        let mut columns: Vec<Vec<f64>> = parts.iter().map(|_| Vec::new()).collect();
        let mut length = parts.first().map_or(0, |part| part.length);
        let first = usize::from(ordered);
        if ordered {
            self.numbers(&variables[parts[0].variable], parts, &[0], &mut columns, length, true)?;
            length = columns[0].len();
        }
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for k in first..parts.len() {
            match groups.iter_mut().find(|group| parts[group[0]].variable == parts[k].variable) {
                Some(group) => group.push(k),
                None => groups.push(vec![k]),
            }
        }
        for group in groups {
            self.numbers(&variables[parts[group[0]].variable], parts, &group, &mut columns, length, false)?;
        }
        Ok(columns)
    }

    /// So many numbers of `these` parts, which are of one variable.
    fn numbers(
        &mut self,
        variable: &Variable,
        parts: &[Part],
        these: &[usize],
        columns: &mut [Vec<f64>],
        length: usize,
        ordered: bool,
    ) -> io::Result<()> {
        let big = self.big;
        let inner = self.element(variable.begin, variable.length, variable.packed)?;
        let mut inner = inner.ok_or(io::ErrorKind::UnexpectedEof)?;
        inner.variable()?;
        let (kind, size, short) = inner.tag()?;
        let width = width(kind)?;
        if variable.count().and_then(|n| n.checked_mul(width)) != Some(size) {
            return Err(bad("an array does not have as many numbers as it says"));
        }
        let mut data: Box<dyn Read> = match &short {
            Some(data) => Box::new(&data[..size]),
            None => inner.input,
        };
        let end = these.iter().map(|&k| parts[k].first + parts[k].step * (length - 1) + 1).max().unwrap_or(0);
        let mut block = vec![0; width * BLOCK];
        for begin in (0..end).step_by(BLOCK) {
            let bytes = &mut block[..width * BLOCK.min(end - begin)];
            data.read_exact(bytes)?;
            let numbers = values(kind, bytes, big)?;
            for &k in these {
                parts[k].take(&numbers, begin, length, &mut columns[k]);
            }
            let times = &mut columns[these[0]];
            let known = begin.saturating_sub(parts[these[0]].first) / parts[these[0]].step;
            if ordered && let Some(i) = (known.max(1)..times.len()).find(|&i| times[i] <= times[i - 1]) {
                times.truncate(i + 1);
                return Ok(());
            }
        }
        Ok(())
    }
}

impl Part {
    /// Adds what a block of the variable's numbers, from number `begin` on, has of it, up to `length` in all.
    fn take(&self, block: &[f64], begin: usize, length: usize, column: &mut Vec<f64>) {
        while column.len() < length {
            let place = self.first + self.step * column.len();
            let Some(number) = place.checked_sub(begin).and_then(|place| block.get(place)) else { return };
            column.push(*number);
        }
    }
}

/// Bytes of a number.
fn width(kind: u32) -> io::Result<usize> {
    Ok(match kind {
        1 | 2 => 1,
        3 | 4 => 2,
        5..=7 => 4,
        9 | 12 | 13 => 8,
        _ => return Err(bad("an array has numbers of an unknown type")),
    })
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

    /// The next element whole; it is short.
    fn element(&mut self) -> io::Result<(u32, Vec<u8>)> {
        let (kind, size, short) = self.tag()?;
        if let Some(data) = short {
            return Ok((kind, data[..size].to_vec()));
        }
        if size > LONGEST_WORDS {
            return Err(bad("the name or the dimensions of an array are longer than 4096 bytes"));
        }
        let mut data = vec![0; size];
        self.input.read_exact(&mut data)?;
        let filling = (size.next_multiple_of(8) - size) as u64;
        io::copy(&mut (&mut self.input).take(filling), &mut io::sink())?;
        Ok((kind, data))
    }

    /// The header of a variable; its tag has been read.
    fn variable(&mut self) -> io::Result<Variable> {
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
        Ok(Variable { name, class, complex, dimensions, begin: 0, length: 0, packed: false })
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
