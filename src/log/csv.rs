//! Columns of numbers from CSV, and every mistake told with its line.
//!
//! The first row names the columns; they are parted by commas, semicolons or tabs. Blank lines and lines that start with
//! `#` are passed over. Rows are read one at a time: a file may be larger than memory, a line not longer than 1 MiB.

use super::lines::{Fields, Lines, open};
use crate::error::{Error, Result};
use std::io::BufRead;
use std::path::Path;

const NUMBER: &str = "a number such as 0.25 or -1.5e-3";

/// The columns called `names` of a CSV file, in that order; numbers as they stand, in whatever unit the file has.
pub fn read_columns(file: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>> {
    let mut columns = vec![Vec::new(); names.len()];
    read_rows(file, open(file)?, names, |_, values| {
        columns.iter_mut().zip(values).for_each(|(column, &value)| column.push(value));
        Ok(())
    })?;
    Ok(columns)
}

/// The columns called `time` and `column` of a CSV file; the times must increase from row to row.
pub fn read_samples(file: &Path, time: &str, column: &str) -> Result<(Vec<f64>, Vec<f64>)> {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    let mut last_line = 0;
    read_rows(file, open(file)?, &[time, column], |row, numbers| {
        let &[t, value] = numbers else { return Ok(()) };
        if let Some(&before) = times.last()
            && t <= before
        {
            let line = row.lines.number;
            let (what, next) = if t == before {
                (format!("time {t} in line {line} repeats that of line {last_line}"), "keep one row of each time")
            } else {
                (
                    format!("time {t} in line {line} is before {before} in line {last_line}"),
                    "sort the rows by time, or cut the file where a second recording begins",
                )
            };
            return Err(row.error(0, what).allowed("times that increase from row to row").next(next));
        }
        times.push(t);
        values.push(value);
        last_line = row.lines.number;
        Ok(())
    })?;
    Ok((times, values))
}

/// Hands every row's numbers in the columns `names` to `take`.
fn read_rows<R: BufRead>(
    file: &Path,
    input: R,
    names: &[&str],
    mut take: impl FnMut(&Row<'_, R>, &[f64]) -> Result<()>,
) -> Result<()> {
    let mut lines = Lines::new(file, input);
    if !lines.advance()? {
        let what =
            if lines.number == 0 { "the file is empty" } else { "the file has nothing but blank lines and comments" };
        let allowed = "a row that names the columns, then rows of numbers";
        return Err(lines.error(what).allowed(allowed).next("check that the recording was saved"));
    }
    let header = Header::read(&lines, names)?;
    let mut fields = Fields::new(header.separator);
    let mut numbers = vec![0.0; names.len()];
    let mut rows = 0;
    while lines.advance()? {
        fields.split(&lines)?;
        let row = Row { lines: &lines, fields: &fields, header: &header };
        row.check_length()?;
        for (i, number) in numbers.iter_mut().enumerate() {
            *number = row.number(i)?;
        }
        take(&row, &numbers)?;
        rows += 1;
    }
    if rows == 0 {
        let error = lines.error("the file names its columns but has no rows").allowed("at least one row of numbers");
        return Err(error.next("check that the recording was saved"));
    }
    Ok(())
}

/// One row, and what is needed to complain about it.
struct Row<'a, R> {
    lines: &'a Lines<'a, R>,
    fields: &'a Fields,
    header: &'a Header,
}

impl<R: BufRead> Row<'_, R> {
    /// The number in the i-th column that was asked for.
    fn number(&self, i: usize) -> Result<f64> {
        let text = self.fields.get(self.header.wanted[i]);
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            parsed => Err(self.not_a_number(i, text, parsed.is_ok())),
        }
    }

    fn not_a_number(&self, i: usize, text: &str, infinite: bool) -> Error {
        let column = shown(&self.header.names[self.header.wanted[i]]);
        let value = shown(text);
        if text.is_empty() {
            let what = format!("column {column} has no value in this row");
            return self.error(i, what).allowed(NUMBER).next("fill in the value, or delete the row");
        }
        if infinite {
            let what = format!("{value} in column {column} is not a finite number");
            return self.error(i, what).allowed(NUMBER).next("fill in the value, or delete the row");
        }
        if text.matches(',').count() == 1 && text.replace(',', ".").parse::<f64>().is_ok() {
            let what = format!("{value} in column {column} has a decimal comma");
            return self.error(i, what).allowed(NUMBER).next("export the file with decimal points");
        }
        let what = format!("{value} in column {column} is not a number");
        let digits = text.trim_end_matches(|c: char| c.is_alphabetic() || "%°/^·*²³ ".contains(c));
        let next = if digits.parse::<f64>().is_ok() {
            "leave the number alone in its field; a unit belongs in the column's name"
        } else {
            "correct the value, or delete the row"
        };
        self.error(i, what).allowed(NUMBER).next(next)
    }

    /// As many values as the header has names; empty ones may follow.
    fn check_length(&self) -> Result<()> {
        let expected = self.header.names.len();
        let found = self.fields.len();
        let extra = (expected..found).find(|&k| !self.fields.get(k).is_empty());
        if found >= expected && extra.is_none() {
            return Ok(());
        }
        let what = format!("this row has {}, the header names {}", count(found, "value"), count(expected, "column"));
        let allowed =
            if expected == 1 { "1 value in each row".into() } else { format!("{expected} values in each row") };
        let (range, next) = if let Some(extra) = extra {
            let next = if self.header.separator == b',' && found == 2 * expected {
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

    /// An error at the i-th column that was asked for.
    fn error(&self, i: usize, what: String) -> Error {
        let range = self.fields.extent(&self.lines.text, self.header.wanted[i]);
        Error::new(what).at(self.lines.place(range))
    }
}

/// The first row: what the columns are called, and which are wanted.
struct Header {
    separator: u8,
    names: Vec<String>,
    /// For each column asked for, its place among `names`.
    wanted: Vec<usize>,
}

impl Header {
    fn read<R: BufRead>(lines: &Lines<'_, R>, wanted: &[&str]) -> Result<Self> {
        // The separator is the one that yields the most of the wanted names; then the one there is.
        let mut best: Option<(usize, bool, u8, Vec<String>)> = None;
        for separator in *b"\t;," {
            let mut fields = Fields::new(separator);
            fields.split(lines)?;
            let mut names: Vec<String> = (0..fields.len()).map(|k| fields.get(k).to_string()).collect();
            if names.len() > 1 && names.last().is_some_and(String::is_empty) {
                names.pop();
            }
            let hits = wanted.iter().filter(|name| names.iter().any(|n| n == name.trim())).count();
            let parts = fields.len() > 1;
            if best.as_ref().is_none_or(|&(h, p, ..)| (hits, parts) > (h, p)) {
                best = Some((hits, parts, separator, names));
            }
        }
        let (_, _, separator, names) = best.unwrap_or((0, false, b',', Vec::new()));
        let mut header = Self { separator, names, wanted: Vec::new() };
        for name in wanted {
            let place = header.find(lines, name.trim())?;
            header.wanted.push(place);
        }
        Ok(header)
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
        let mut list: Vec<String> = self.names.iter().take(10).map(|n| shown(n)).collect();
        if self.names.len() > list.len() {
            list.push(format!("and {} more", self.names.len() - list.len()));
        }
        let error = lines.error(format!("there is no column {}", shown(name)));
        if self.names.iter().all(|n| n.replace(',', ".").parse::<f64>().is_ok()) {
            let error = error.allowed("a first row that names the columns; here it holds numbers");
            return error.next("put a row of names above the numbers");
        }
        let error = error.allowed(list.join(", "));
        // Names that differ in case, or in at most one letter of three, are near.
        let distance = |n: &&String| strsim::damerau_levenshtein(&n.to_lowercase(), &name.to_lowercase());
        match self.names.iter().min_by_key(distance) {
            Some(n) if 3 * distance(&n) <= name.chars().count() => error.next(format!("did you mean {}?", shown(n))),
            _ => error.next("name one of these columns"),
        }
    }
}

/// `text` between backquotes, at most 40 characters of it.
fn shown(text: &str) -> String {
    let cut: String = text.chars().take(40).map(|c| if c.is_control() { '·' } else { c }).collect();
    if cut.len() < text.len() && text.chars().count() > 40 { format!("`{cut}…`") } else { format!("`{cut}`") }
}

fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(text: &str, names: &[&str]) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::new(); names.len()];
        let path = Path::new("log.csv");
        let read = read_rows(path, text.as_bytes(), names, |_, values| {
            columns.iter_mut().zip(values).for_each(|(column, &value)| column.push(value));
            Ok(())
        });
        assert_eq!(read.map_err(|e| e.to_string()), Ok(()), "{text:?}");
        columns
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
