//! Columns of numbers from CSV, and every mistake told with its line.
//!
//! A row names the columns, or they go by number; they are parted by commas, semicolons, tabs or blanks. Blank lines
//! and lines that start with `#`, `%` or `//` are passed over. Rows are read one at a time: a file may be larger than
//! memory, a line not longer than 1 MiB.

use super::lines::{Fields, Lines, open};
use super::locator::Locator;
use super::sheet::{ColumnId, Dialect, Request, Sheet, check_numbers};
use super::words::{count, near, shown};
use crate::error::{Error, Result};
use std::io::BufRead;
use std::path::Path;

const NUMBER: &str = "a number such as 0.25 or -1.5e-3";

const EMPTY: &str = "correct the value, or leave the field empty: it then counts as missing";

/// How many lines may stand above the names.
const PREAMBLE: usize = 200;

/// Reads the wanted columns of a file.
pub(super) fn read(file: &Path, request: &Request<'_>) -> Result<Sheet> {
    read_from(file, open(file)?, request)
}

fn read_from<R: BufRead>(file: &Path, input: R, request: &Request<'_>) -> Result<Sheet> {
    let mut lines = Lines::new(file, input);
    if !lines.advance()? {
        let what =
            if lines.number == 0 { "the file is empty" } else { "the file has nothing but blank lines and comments" };
        let allowed = "a row that names the columns, then rows of numbers";
        return Err(lines.error(what).allowed(allowed).next("check that the recording was saved"));
    }
    let layout = Layout::read(&mut lines, request)?;
    let mut sheet = Sheet { is_text: true, names: layout.shown_names(request), ..Sheet::default() };
    sheet.units = layout.units();
    sheet.begin(request);
    let mut fields = Fields::new(layout.separator);
    let mut first = true;
    let mut metadata = request.preset.is_some_and(|preset| preset.has_metadata);
    // The first row of numbers may be at hand already.
    let mut more = !layout.is_heading || lines.advance()?;
    while more {
        if let Some(end) = request.preset.and_then(|preset| preset.end(&lines.text)) {
            sheet.ended = end.is_loss.then(|| end.line.to_string());
            break;
        }
        fields.split(&lines)?;
        let row = Row { lines: &lines, fields: &fields, layout: &layout, request };
        metadata &= row.texts().next().is_none_or(|text| !numeric(text));
        if metadata {
            more = lines.advance()?;
            continue;
        }
        row.check_length()?;
        if std::mem::take(&mut first)
            && request.units_row
            && layout.is_heading
            && let Some(units) = row.units()
        {
            for (mine, theirs) in sheet.units.iter_mut().zip(units) {
                *mine = theirs.or(mine.take());
            }
        } else {
            row.take(&mut sheet)?;
        }
        more = lines.advance()?;
    }
    let numbers = sheet.columns.iter().any(|column| !column.is_empty()) || !sheet.filtered.is_empty();
    if !numbers && sheet.rows.is_empty() {
        let error = lines.error("the file names its columns but has no rows").allowed("at least one row of numbers");
        return Err(error.next("check that the recording was saved"));
    }
    sheet.fields = Some(Locator {
        separator: layout.separator,
        heading: layout.heading_line,
        wanted: layout.wanted[..request.columns.len()].to_vec(),
    });
    Ok(sheet)
}

/// The names in the first line that has one of these among them.
pub(super) fn heading(file: &Path, wanted: &[&str]) -> Result<Option<Vec<String>>> {
    let mut lines = Lines::new(file, open(file)?);
    let mut passed = 0;
    while passed < PREAMBLE && lines.advance()? {
        for separator in SEPARATORS {
            let mut fields = Fields::new(separator);
            if fields.split(&lines).is_err() {
                continue;
            }
            let names: Vec<String> = (0..fields.len()).map(|k| fields.get(k).to_string()).collect();
            if names.iter().any(|name| wanted.contains(&name.as_str())) {
                return Ok(Some(names));
            }
        }
        passed += 1;
    }
    Ok(None)
}

/// The names of all columns: those above the first row of numbers, or the places of the columns where nothing names
/// them.
pub(super) fn names(file: &Path) -> Result<Vec<ColumnId>> {
    let mut lines = Lines::new(file, open(file)?);
    let request = Request::complete(&[]);
    let mut above: Vec<String> = Vec::new();
    for _ in 0..PREAMBLE {
        if !lines.advance()? {
            break;
        }
        let candidate = Layout::candidate(&lines, &lines.text, &request, &[])?;
        let names = candidate.names;
        let numbers = names.iter().filter(|text| numeric(text)).count();
        // A column of words may stand among those of numbers.
        if numbers == 0 || 2 * names.iter().filter(|text| numeric(text) || is_missing(text)).count() < names.len() {
            // Units may stand between the names and the numbers.
            if above.len() != names.len() {
                above = names;
            }
            continue;
        }
        // As some programs write it, the names stand in a remark above the numbers.
        let remark = match lines.remark.is_empty() {
            true => Vec::new(),
            false => Layout::candidate(&lines, &lines.remark, &request, &[]).map_or(Vec::new(), |found| found.names),
        };
        let named = |those: &[String]| those.len() == names.len() && those.iter().all(|name| !numeric(name));
        let there = if named(&above) { above } else { remark };
        let place = |k: usize| there.get(k).filter(|name| named(&there) && !name.is_empty());
        return Ok((0..names.len())
            .map(|k| place(k).map_or(ColumnId::Number(k + 1), |name| ColumnId::Name(name.clone())))
            .collect());
    }
    let error = Error::new("no line of this file has numbers in columns").in_file(file);
    Err(error.allowed("a row that names the columns, then rows of numbers").next("check that the recording was saved"))
}

/// One row, and what is needed to complain about it.
struct Row<'a, R> {
    lines: &'a Lines<'a, R>,
    fields: &'a Fields,
    layout: &'a Layout,
    request: &'a Request<'a>,
}

impl<R: BufRead> Row<'_, R> {
    /// Adds the row to the sheet, if it is wanted.
    fn take(&self, sheet: &mut Sheet) -> Result<()> {
        let mut rest = self.request.columns.len()..;
        if let Some(filter) = self.request.filter {
            let text = self.fields.get(self.layout.wanted[rest.next().unwrap_or_default()]);
            sheet.note_filtered(text);
            if !filter.keeps(text) {
                return Ok(());
            }
        }
        if self.request.split.is_some() {
            let i = rest.next().unwrap_or_default();
            let text = self.fields.get(self.layout.wanted[i]);
            if is_missing(text) {
                let column = self.layout.shown_name(i);
                let error =
                    self.error(i, format!("column {column}, which tells the runs apart, has no value in this row"));
                return Err(error
                    .allowed("a number or a word in every row")
                    .next("fill in the value, or delete the row"));
            }
            let label = text.parse::<f64>().map_or_else(|_| text.to_string(), crate::quantity::shortest);
            sheet.note_run(&label);
        }
        for i in 0..self.request.columns.len() {
            let number = self.number(i)?;
            sheet.columns[i].push(number);
        }
        sheet.rows.push(self.lines.number);
        check_numbers(self.lines.file, self.request.columns.len(), sheet.rows.len())
    }

    /// The number in the i-th wanted column; NaN where it is missing and may be.
    fn number(&self, i: usize) -> Result<f64> {
        let text = self.fields.get(self.layout.wanted[i]);
        match parse(text, self.request.dialect) {
            Some(number) if number.is_finite() => Ok(number),
            _ if i >= self.request.complete && is_missing(text) => Ok(f64::NAN),
            parsed => Err(self.not_a_number(i, text, parsed.is_some())),
        }
    }

    fn not_a_number(&self, i: usize, text: &str, infinite: bool) -> Error {
        let column = self.layout.shown_name(i);
        let value = shown(text);
        let may_miss = i >= self.request.complete;
        if text.is_empty() {
            let what = format!("column {column} has no value in this row");
            return self.error(i, what).allowed(NUMBER).next("fill in the value, or delete the row");
        }
        if infinite {
            let what = format!("{value} in column {column} is not a finite number");
            let next = if may_miss { EMPTY } else { "fill in the value, or delete the row" };
            return self.error(i, what).allowed(NUMBER).next(next);
        }
        let comma = self.request.dialect.decimal_comma;
        if !comma && text.matches(',').count() == 1 && text.replace(',', ".").parse::<f64>().is_ok() {
            let what = format!("{value} in column {column} has a decimal comma");
            let next = match self.request.units_row {
                true => "write decimal = \",\" in the log's table of the case file, or export with decimal points",
                false => "export the file with decimal points",
            };
            return self.error(i, what).allowed(NUMBER).next(next);
        }
        if comma && text.contains('.') && text.contains(',') {
            let what = format!("{value} in column {column} has points between its thousands");
            return self.error(i, what).allowed("a number such as 0,25 or -1,5e-3").next("export it without them");
        }
        let what = format!("{value} in column {column} is not a number");
        let digits = text.trim_end_matches(|c: char| c.is_alphabetic() || "%°/^·*²³ ".contains(c));
        let next = if comma && text.parse::<f64>().is_ok() {
            "leave decimal = \",\" out of the case file: this number has a decimal point"
        } else if text.contains(':') {
            "give times as seconds, not as a date or a time of day"
        } else if text.starts_with("0x") || text.starts_with("0X") {
            "export the numbers as decimal ones"
        } else if digits.parse::<f64>().is_ok() {
            "leave the number alone in its field; a unit belongs in the column's name"
        } else if may_miss {
            EMPTY
        } else {
            "correct the value, or delete the row"
        };
        let allowed = if comma { "a number such as 0,25 or -1,5e-3" } else { NUMBER };
        self.error(i, what).allowed(allowed).next(next)
    }

    /// As many values as the header has names; empty ones may follow.
    fn check_length(&self) -> Result<()> {
        let expected = self.layout.names.len();
        let found = self.fields.len();
        let extra = (expected..found).find(|&k| !self.fields.get(k).is_empty());
        if found >= expected && extra.is_none() {
            return Ok(());
        }
        let what = match self.layout.is_heading || self.layout.heading_line.is_some() {
            true => format!("this row has {}, the header names {}", count(found, "value"), count(expected, "column")),
            false => format!("this row has {}, the first one has {expected}", count(found, "value")),
        };
        let allowed =
            if expected == 1 { "1 value in each row".into() } else { format!("{expected} values in each row") };
        let (range, next) = if let Some(extra) = extra {
            let next = if self.layout.separator == b',' && found == 2 * expected {
                "if these are decimal commas, export the numbers with decimal points; if not, name every column"
            } else {
                "name every column in the header, or remove what is too much"
            };
            (self.fields.extent(&self.lines.text, extra).start..self.lines.text.len(), next)
        } else if self.lines.complete {
            (0..self.lines.text.len(), "fill in the missing values, or delete the row")
        } else {
            (0..self.lines.text.len(), "the file breaks off here: delete its last line")
        };
        Err(Error::new(what).at(self.lines.place(range)).allowed(allowed).next(next))
    }

    /// The units of the wanted columns, if that is what the row holds: words, and no number.
    fn units(&self) -> Option<Vec<Option<String>>> {
        let texts: Vec<&str> = self.texts().collect();
        let word = |text: &str| !text.is_empty() && !numeric(text) && !is_missing(text);
        let words = texts.iter().any(|text| word(text)) && texts.iter().all(|text| text.is_empty() || word(text));
        let unit = |text: &str| (!text.is_empty()).then(|| without_brackets(text).to_string());
        words.then(|| texts.iter().map(|text| unit(text)).collect())
    }

    /// The texts of the wanted columns of numbers.
    fn texts(&self) -> impl Iterator<Item = &str> {
        self.layout.wanted[..self.request.columns.len()].iter().map(|&k| self.fields.get(k))
    }

    /// An error at the i-th column that was asked for.
    fn error(&self, i: usize, what: String) -> Error {
        let range = self.fields.extent(&self.lines.text, self.layout.wanted[i]);
        Error::new(what).at(self.lines.place(range))
    }
}

/// `[mm]` or `(mm)` as `mm`.
fn without_brackets(text: &str) -> &str {
    let inside = |open: char, close: char| text.strip_prefix(open).and_then(|text| text.strip_suffix(close));
    inside('[', ']').or_else(|| inside('(', ')')).unwrap_or(text).trim()
}

fn parse(text: &str, dialect: Dialect) -> Option<f64> {
    match dialect.decimal_comma {
        true if text.contains('.') => None,
        true => text.replacen(',', ".", 1).parse().ok(),
        false => text.parse().ok(),
    }
}

/// True if a text is meant as a number, commas or not.
fn numeric(text: &str) -> bool {
    text.replacen(',', ".", 1).parse::<f64>().is_ok_and(|number| !number.is_nan())
}

/// True if a text is one that programs write where they have no value.
fn is_missing(text: &str) -> bool {
    const WORDS: [&str; 10] = ["", "nan", "-nan", "nan(ind)", "-nan(ind)", "na", "n/a", "null", "none", "-"];
    WORDS.iter().any(|word| text.eq_ignore_ascii_case(word)) || text.contains("#QNAN") || text.contains("#IND")
}

/// The names of the columns, and which are wanted.
struct Layout {
    separator: u8,
    names: Vec<String>,
    /// For each column asked for, its place among `names`.
    wanted: Vec<usize>,
    /// True if the current line names the columns; otherwise it is the first row.
    is_heading: bool,
    /// The line that names the columns, if one does.
    heading_line: Option<usize>,
    /// The text between the names and the first row, where columns go by number.
    below: Vec<String>,
    /// The separator, if the case file says it.
    said: Option<char>,
    /// True if columns may be asked for by number.
    by_number: bool,
}

/// The separators, the most telling first.
const SEPARATORS: [u8; 4] = *b"\t;, ";

impl Layout {
    /// Finds the names; the current line is then that of the names, or the first row.
    fn read<R: BufRead>(lines: &mut Lines<'_, R>, request: &Request<'_>) -> Result<Self> {
        let ids: Vec<&ColumnId> = request.all_columns().collect();
        let names: Vec<&str> = ids.iter().filter_map(|id| id.name()).collect();
        if names.is_empty() {
            return Self::by_number(lines, request, &ids);
        }
        let first = Self::candidate(lines, &lines.text, request, &names)?;
        if first.hits < names.len() && first.is_numbers() && !lines.remark.is_empty() {
            // As some programs write it, the names stand in a remark above the numbers.
            let remark = Self::candidate(lines, &lines.remark, request, &names)?;
            if remark.hits == names.len() {
                let layout = Self { separator: remark.separator, names: remark.names, ..Self::of_numbers(request) };
                return layout.find_all(lines, &ids);
            }
        }
        let unknown = match first.hits == names.len() {
            true => return Self::of_heading(first, lines.number, request).find_all(lines, &ids),
            false => Self::of_heading(first, lines.number, request).find_all(lines, &ids).err(),
        };
        // Something may stand above the names.
        let (mut most, mut told) = (0, unknown);
        let mut passed = 1;
        while passed < PREAMBLE && lines.advance()? {
            passed += 1;
            let Ok(candidate) = Self::candidate(lines, &lines.text, request, &names) else { continue };
            let hits = candidate.hits;
            if hits == names.len() {
                return Self::of_heading(candidate, lines.number, request).find_all(lines, &ids);
            }
            if passed == 2 {
                most = most.max(hits);
            }
            if hits > most {
                most = hits;
                told = Self::of_heading(candidate, lines.number, request).find_all(lines, &ids).err();
            }
        }
        Err(told.unwrap_or_else(|| lines.error("the columns cannot be found")))
    }

    fn by_number<R: BufRead>(lines: &mut Lines<'_, R>, request: &Request<'_>, ids: &[&ColumnId]) -> Result<Self> {
        let (mut heading_line, mut names, mut below) = (None, Vec::new(), Vec::new());
        for _ in 0..PREAMBLE {
            let candidate = Self::candidate(lines, &lines.text, request, &[])?;
            let field = |id: &&&ColumnId| id.number().and_then(|k| candidate.names.get(k - 1));
            let wanted = &ids[..request.columns.len()];
            let numbers = wanted.iter().filter(|id| field(id).is_some_and(|text| numeric(text) || is_missing(text)));
            let some = wanted.iter().any(|id| field(&id).is_some_and(|text| numeric(text)));
            if some && numbers.count() > 0 {
                let named = names.len() == candidate.names.len();
                let layout = Self {
                    separator: candidate.separator,
                    heading_line: heading_line.filter(|_| named),
                    names: if named { names } else { candidate.names.iter().map(|_| String::new()).collect() },
                    below: if named { below } else { Vec::new() },
                    ..Self::of_numbers(request)
                };
                return layout.find_all(lines, ids);
            }
            if heading_line.is_none() || candidate.names.len() != names.len() {
                (heading_line, names, below) = (Some(lines.number), candidate.names, Vec::new());
            } else {
                below = candidate.names;
            }
            if !lines.advance()? {
                break;
            }
        }
        let list: Vec<String> = ids[..request.columns.len()].iter().map(|id| id.shown()).collect();
        let (plural, list) = (if list.len() == 1 { "column" } else { "columns" }, list.join(", "));
        let error = lines.error(format!("no row has numbers in {plural} {list}"));
        Err(error
            .allowed("rows of numbers, perhaps below their names")
            .next("check the numbers of the columns, from 1"))
    }

    /// The current line is the first row.
    fn of_numbers(request: &Request<'_>) -> Self {
        Self {
            separator: b',',
            names: Vec::new(),
            wanted: Vec::new(),
            is_heading: false,
            heading_line: None,
            below: Vec::new(),
            said: request.dialect.separator,
            by_number: request.units_row,
        }
    }

    fn of_heading(candidate: Candidate, line: usize, request: &Request<'_>) -> Self {
        let Candidate { separator, names, .. } = candidate;
        Self { separator, names, is_heading: true, heading_line: Some(line), ..Self::of_numbers(request) }
    }

    /// A line cut by the separator that yields the most of the wanted names; then by the one there is.
    fn candidate<R: BufRead>(
        lines: &Lines<'_, R>,
        text: &str,
        request: &Request<'_>,
        wanted: &[&str],
    ) -> Result<Candidate> {
        let mut best: Option<(usize, bool, Candidate)> = None;
        let said = request.dialect.separator.map(|c| c as u8);
        let comma = request.dialect.decimal_comma;
        let separators =
            SEPARATORS.into_iter().filter(|s| said.is_none_or(|said| said == *s) && !(comma && *s == b','));
        for separator in separators {
            let mut fields = Fields::new(separator);
            fields.split_text(lines, text)?;
            let mut names: Vec<String> = (0..fields.len()).map(|k| fields.get(k).to_string()).collect();
            if names.len() > 1 && names.last().is_some_and(String::is_empty) {
                names.pop();
            }
            let hits = wanted.iter().filter(|name| names.iter().any(|n| n == *name)).count();
            let parts = fields.len() > 1;
            if best.as_ref().is_none_or(|&(h, p, _)| (hits, parts) > (h, p)) {
                best = Some((hits, parts, Candidate { separator, names, hits }));
            }
        }
        best.map(|(_, _, candidate)| candidate).ok_or_else(|| {
            lines.error("a comma cannot separate both columns and decimals").next("name another separator")
        })
    }

    fn find_all<R: BufRead>(mut self, lines: &Lines<'_, R>, ids: &[&ColumnId]) -> Result<Self> {
        for id in ids {
            let place = match id {
                ColumnId::Name(name) => self.find(lines, name)?,
                ColumnId::Number(number) => self.numbered(lines, *number)?,
            };
            self.wanted.push(place);
        }
        Ok(self)
    }

    fn numbered<R: BufRead>(&self, lines: &Lines<'_, R>, number: usize) -> Result<usize> {
        let there = self.names.len();
        if (1..=there).contains(&number) {
            return Ok(number - 1);
        }
        let error = lines.error(format!("there is no column {number}"));
        Err(error.allowed(format!("columns 1 to {there}, as line {} has them", lines.number)).next(
            "correct the column's number in the case file; if there should be more columns, state the separator: \
             separator = \";\"",
        ))
    }

    fn find<R: BufRead>(&self, lines: &Lines<'_, R>, name: &str) -> Result<usize> {
        let mut found = (0..self.names.len()).filter(|&k| self.names[k] == name);
        match (found.next(), found.next()) {
            (Some(k), None) => Ok(k),
            (Some(k), Some(other)) => {
                let mut fields = Fields::new(self.separator);
                fields.split(lines)?;
                let what = format!("columns {} and {} are both called {}", k + 1, other + 1, shown(name));
                let place = lines.place(fields.extent(&lines.text, other));
                Err(Error::new(what).at(place).next("give one of them another name"))
            }
            (None, _) => Err(self.unknown(lines, name)),
        }
    }

    fn unknown<R: BufRead>(&self, lines: &Lines<'_, R>, name: &str) -> Error {
        let by_number = self.by_number;
        let mut list: Vec<String> = self.names.iter().take(10).map(|n| shown(n)).collect();
        if self.names.len() > list.len() {
            list.push(format!("and {} more", self.names.len() - list.len()));
        }
        let error = lines.error(format!("there is no column {}", shown(name)));
        if self.names.iter().all(|n| numeric(n)) {
            let error = error.allowed("a first row that names the columns; here it holds numbers");
            return error.next(match by_number {
                true => "put a row of names above the numbers, or name columns by number, as in time = 1",
                false => "put a row of names above the numbers",
            });
        }
        let error = error.allowed(list.join(", "));
        if let (Some(said), 1) = (self.said, self.names.len()) {
            let next =
                format!("the case file has the separator `{said}`, and line {} does not contain it", lines.number);
            return error.next(next);
        }
        match near(name, self.names.iter().map(String::as_str)) {
            Some(near) => error.next(format!("did you mean {}?", shown(near))),
            _ => error.next("name one of these columns"),
        }
    }

    /// The name of the i-th wanted column in messages.
    fn shown_name(&self, i: usize) -> String {
        let k = self.wanted[i];
        if self.names[k].is_empty() { (k + 1).to_string() } else { shown(&self.names[k]) }
    }

    fn shown_names(&self, request: &Request<'_>) -> Vec<String> {
        (0..request.columns.len()).map(|i| self.shown_name(i)).collect()
    }

    /// Units that stand in brackets at the end of the wanted names.
    fn units(&self) -> Vec<Option<String>> {
        let unit = |&k: &usize| {
            if let Some(below) = self.below.get(k).filter(|text| !text.is_empty()) {
                return Some(without_brackets(below).to_string());
            }
            let name = self.names[k].trim();
            let open = match name.chars().last()? {
                ']' => '[',
                ')' => '(',
                _ => return None,
            };
            let (_, unit) = name[..name.len() - 1].rsplit_once(open)?;
            Some(unit.trim().to_string())
        };
        self.wanted.iter().map(unit).collect()
    }
}

/// A line as names of columns.
struct Candidate {
    separator: u8,
    names: Vec<String>,
    /// How many of the wanted names are there.
    hits: usize,
}

impl Candidate {
    fn is_numbers(&self) -> bool {
        self.names.iter().all(|name| numeric(name) || is_missing(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(text: &str, names: &[&str]) -> Vec<Vec<f64>> {
        let ids: Vec<ColumnId> = names.iter().map(|name| ColumnId::from(*name)).collect();
        let sheet = read_from(Path::new("log.csv"), text.as_bytes(), &Request::complete(&ids));
        sheet.unwrap_or_else(|e| panic!("{text:?}: {e}")).columns
    }

    #[test]
    fn separators_quotes_marks_and_line_ends() {
        let expected = [vec![5.0, -0.005], vec![0.0, 0.1]];
        for text in [
            "t,u\n0,5\n0.1,-5e-3\n",
            "t,u\n0,5\n0.1,-5e-3",
            "t;u\r\n0;5\r\n0.1;-5e-3\r\n",
            "\u{feff}t\tu\n0\t5\n0.1\t-5e-3\n",
            "# made by a scope\n\n \"t\" , u ,\n 0 , +5 ,\n# a pause\n\"0.1\",-5.E-3,\n\n",
            "n,t,comment,u\n1,0,\"a, b\",5\n2,.1,,-5e-3\n",
            "t, s;t;u\n9;0;5\n9;0.1;-5e-3\n",
            "t,u,\n0,5\n0.1,-5e-3,,\n",
            "  t   u\n  0    5\n0.1 \t -5e-3  \n",
            "scope 3\nmade, today\nt,u\n0,5\n0.1,-5e-3\n",
            "# t u\n0 5\n0.1 -5e-3\n",
            "% made by a script\n// twice\nt,u\n0,5\n0.1,-5e-3\n",
        ] {
            assert_eq!(columns(text, &["u", "t"]), expected, "{text:?}");
        }
        assert_eq!(columns("u\n1\n2\n", &["u", "u"]), [[1.0, 2.0], [1.0, 2.0]]);
    }

    #[test]
    fn long_files_are_read_row_by_row() {
        let mut text = String::from("t,u\n");
        for k in 0..100_000 {
            text += &format!("{},{}\n", f64::from(k) * 1e-3, k);
        }
        let read = columns(&text, &["t", "u"]);
        assert_eq!((read[0].len(), read[1][99_999]), (100_000, 99_999.0));
    }

    #[test]
    fn text_is_cut_and_cleaned_before_it_is_shown() {
        assert_eq!(shown("a\u{1b}[31m"), "`a·[31m`");
        assert_eq!(shown(&"ä".repeat(50)), format!("`{}…`", "ä".repeat(40)));
    }
}
