//! Reads a table of text: CSV as loggers, spreadsheets and numerical programs write it.
//!
//! Between the cells is a comma, a semicolon or a tab, whichever the header has most of. Numbers have a decimal point or a
//! decimal comma, one of them in the whole file: a file with both has separators of thousands, which cannot be told from
//! decimals. Lines that begin with `#`, and before the header those that begin with `%` or `//`, are comments; a comment
//! just above the numbers is the header where there is no other, as `numpy.savetxt` writes it.

use std::io::{BufRead, BufReader, Read};
use std::ops::Range;
use std::path::Path;

use super::table::{Table, locate};
use crate::csv_read::{not_utf8, wrong_length};
use crate::{Place, Progress, RecordingError, RowNumber, progress};

/// Bytes of comments in front of a header at most; more is no table of text.
const MOST_PREAMBLE: usize = 1 << 20;
/// Bytes of a line at most.
const MOST_LINE: usize = 1 << 20;

/// Reads the wanted columns.
pub(super) fn read(path: &Path, wanted: &[String], watch: Option<Progress>) -> Result<Table, RecordingError> {
    let file = progress::open(path, watch).map_err(|e| RecordingError::io(path, e))?;
    let mut file = BufReader::with_capacity(1 << 16, file);
    let head = head(path, &mut file)?;
    let found = locate(path, &head.names, wanted)?;

    let mut table = Table {
        path: path.to_owned(),
        read: found.iter().map(|(name, _)| name.clone()).collect(),
        columns: vec![Vec::new(); found.len()],
        rows: Vec::new(),
        names: head.names,
    };
    let (mut marks, count) = (Marks::default(), table.names.len());
    let (mut line, mut text, mut cells) = (head.lines_before, head.first_row, Vec::new());
    loop {
        if text.is_empty() && !next_line(path, &mut file, &mut text)? {
            break;
        }
        line += 1;
        let row = without_end(&text);
        if !row.trim_ascii().is_empty() && !row.starts_with(b"#") {
            split(path, line, row, head.delimiter, &mut cells)?;
            // A separator behind the last cell of every line.
            if cells.len() == count + 1 && row[cells[count].clone()].trim_ascii().is_empty() {
                cells.pop();
            }
            if cells.len() != count {
                let last = !next_line(path, &mut file, &mut Vec::new())?;
                return Err(uneven(path, line, cells.len(), count, head.delimiter, last));
            }
            for ((name, index), column) in found.iter().zip(&mut table.columns) {
                let cell = Cell { path, line, name, first: table.rows.is_empty(), delimiter: head.delimiter };
                column.push(cell.number(unquoted(&row[cells[*index].clone()]), &mut marks)?);
            }
            table.rows.push(RowNumber::Line(line));
        }
        text.clear();
    }
    if table.rows.is_empty() {
        return Err(RecordingError::NoSamples { path: path.to_owned() });
    }
    Ok(table)
}

/// Reads a line with its end; says whether there was one.
fn next_line(path: &Path, file: &mut impl BufRead, line: &mut Vec<u8>) -> Result<bool, RecordingError> {
    line.clear();
    let read = file.by_ref().take(MOST_LINE as u64).read_until(b'\n', line).map_err(|e| RecordingError::io(path, e))?;
    if read == MOST_LINE && line.last() != Some(&b'\n') {
        return Err(RecordingError::Format {
            path: path.to_owned(),
            problem: "a line is longer than 1 MB".into(),
            help: "a table has one line a row: save it as CSV".into(),
        });
    }
    Ok(read > 0)
}

/// A line without what ends it.
fn without_end(line: &[u8]) -> &[u8] {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// Where the cells of a line are, with their quotes.
fn split(
    path: &Path,
    line: u64,
    text: &[u8],
    delimiter: u8,
    cells: &mut Vec<Range<usize>>,
) -> Result<(), RecordingError> {
    cells.clear();
    let (mut from, mut quoted) = (0, false);
    for (at, byte) in text.iter().enumerate() {
        quoted ^= *byte == b'"';
        if *byte == delimiter && !quoted {
            cells.push(from..at);
            from = at + 1;
        }
    }
    cells.push(from..text.len());
    if quoted {
        return Err(RecordingError::RowNumber {
            place: Place { path: path.to_owned(), row: RowNumber::Line(line) },
            problem: "a quoted cell does not end in this line".into(),
            help: "delete the quotation mark, or the break within the cell".into(),
        });
    }
    Ok(())
}

/// A cell without the quotes around it.
fn unquoted(cell: &[u8]) -> &[u8] {
    let cell = cell.trim_ascii();
    cell.strip_prefix(b"\"").and_then(|rest| rest.strip_suffix(b"\"")).unwrap_or(cell)
}

/// A line with another number of cells than the header.
fn uneven(path: &Path, line: u64, cells: usize, columns: usize, delimiter: u8, last: bool) -> RecordingError {
    if cells > columns && delimiter == b',' && cells.is_multiple_of(columns) {
        return RecordingError::RowNumber {
            place: Place { path: path.to_owned(), row: RowNumber::Line(line) },
            problem: format!("{cells} cells, the header has {columns}"),
            help: "if its numbers have a decimal comma, save the file with `;` between cells".into(),
        };
    }
    wrong_length(path, line, cells, columns, last)
}

/// What stands in front of the numbers.
struct Head {
    names: Vec<String>,
    delimiter: u8,
    /// Lines of the file before [`Head::first_row`].
    lines_before: u64,
    /// A line that is read already and belongs to the numbers; empty where the header was a line of its own.
    first_row: Vec<u8>,
}

fn head(path: &Path, file: &mut impl BufRead) -> Result<Head, RecordingError> {
    let (mut lines, mut bytes, mut delimiter) = (0, 0, None);
    let mut comment: Option<(u64, Vec<u8>)> = None;
    loop {
        let mut line = Vec::new();
        if !next_line(path, file, &mut line)? {
            return Err(RecordingError::Empty { path: path.to_owned() });
        }
        bytes += line.len();
        if lines == 0 {
            refuse_utf16(path, &line)?;
        }
        lines += 1;
        // Spreadsheets put a byte order mark in front. A tab at either end is an empty cell.
        let text = without_end(&line);
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        if let Some(rest) = text.strip_prefix(b"sep=")
            && let &[separator] = rest
        {
            delimiter = Some(separator);
            continue;
        }
        if let Some(rest) = comment_text(text.trim_ascii_start()) {
            comment = Some((lines, rest.to_vec()));
        } else if !text.trim_ascii().is_empty() {
            return head_of(path, lines, text, &line, delimiter, comment);
        }
        if bytes >= MOST_PREAMBLE {
            return Err(RecordingError::Format {
                path: path.to_owned(),
                problem: "there is no header within the first MB".into(),
                help: "the file needs one line with the names of its columns, before the numbers".into(),
            });
        }
    }
}

/// Takes a line apart that is no comment: it is the header, or the first row below a header in a comment.
fn head_of(
    path: &Path,
    line: u64,
    text: &[u8],
    whole: &[u8],
    delimiter: Option<u8>,
    comment: Option<(u64, Vec<u8>)>,
) -> Result<Head, RecordingError> {
    let chosen = delimiter.unwrap_or_else(|| most_frequent(text));
    let cells = cells(path, line, text, chosen)?;
    let is_number = |cell: &String| cell.is_empty() || number(cell, &mut None).is_some();
    if cells.iter().any(|cell| !is_number(cell)) {
        return Ok(Head { names: cells, delimiter: chosen, lines_before: line, first_row: Vec::new() });
    }
    if let Some((at, text)) = comment {
        let names = self::cells(path, at, &text, chosen)?;
        if names.len() == cells.len() && names.iter().any(|name| !is_number(name)) {
            return Ok(Head { names, delimiter: chosen, lines_before: line - 1, first_row: whole.to_vec() });
        }
    }
    Err(RecordingError::Format {
        path: path.to_owned(),
        problem: format!("line {line}: numbers, and no line above them names the columns"),
        help: format!("write a line with {} names above the numbers, with the same separator", cells.len()),
    })
}

fn refuse_utf16(path: &Path, line: &[u8]) -> Result<(), RecordingError> {
    if line.starts_with(b"\xff\xfe") || line.starts_with(b"\xfe\xff") || line.iter().take(64).any(|&byte| byte == 0) {
        return Err(not_utf8(path, 1, "1"));
    }
    Ok(())
}

fn comment_text(line: &[u8]) -> Option<&[u8]> {
    [&b"#"[..], b"%", b"//"].into_iter().find_map(|mark| line.strip_prefix(mark)).map(<[u8]>::trim_ascii)
}

/// The separator that a header has most of, outside quotes.
fn most_frequent(header: &[u8]) -> u8 {
    let mut counts = [(b',', 0), (b';', 0), (b'\t', 0)];
    let mut quoted = false;
    for byte in header {
        quoted ^= *byte == b'"';
        if let (false, Some((_, count))) = (quoted, counts.iter_mut().find(|(separator, _)| separator == byte)) {
            *count += 1;
        }
    }
    counts.into_iter().max_by_key(|(_, count)| *count).map_or(b',', |(separator, _)| separator)
}

/// The cells of one line.
fn cells(path: &Path, line: u64, text: &[u8], delimiter: u8) -> Result<Vec<String>, RecordingError> {
    let mut ranges = Vec::new();
    split(path, line, text, delimiter, &mut ranges)?;
    let mut names = Vec::new();
    for (index, range) in ranges.into_iter().enumerate() {
        let name =
            std::str::from_utf8(unquoted(&text[range])).map_err(|_| not_utf8(path, line, &format!("{}", index + 1)))?;
        names.push(name.trim().replace("\"\"", "\""));
    }
    // A separator behind the last name names no column.
    if names.len() > 1 && names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    Ok(names)
}

/// What marks the decimals of a file, and the line where that was seen first.
#[derive(Default)]
struct Marks {
    point: Option<u64>,
    comma: Option<u64>,
}

struct Cell<'a> {
    path: &'a Path,
    line: u64,
    name: &'a str,
    /// In the first row below the header.
    first: bool,
    delimiter: u8,
}

impl Cell<'_> {
    /// A cell as a number, NaN where nothing was measured.
    fn number(&self, cell: &[u8], marks: &mut Marks) -> Result<f64, RecordingError> {
        let cell = cell.trim_ascii();
        let text = std::str::from_utf8(cell).map_err(|_| not_utf8(self.path, self.line, self.name))?;
        let mut mark = None;
        let Some(value) = number(text, &mut mark) else {
            let help = if self.first {
                "cells are numbers, or empty where nothing was measured; if this line holds units, begin it with `#`"
            } else {
                "cells are numbers, or empty where nothing was measured; separators of thousands are not read"
            };
            return Err(self.error(format!("`{}` is not a number", text.chars().take(40).collect::<String>()), help));
        };
        if mark == Some(',') && self.delimiter == b',' && may_be_thousands(text) {
            let help = "save the file with `;` between cells, or without separators of thousands";
            return Err(self.error(format!("`{text}` may be a decimal number or one of thousands"), help));
        }
        match mark {
            Some('.') => marks.point = marks.point.or(Some(self.line)),
            Some(_) => marks.comma = marks.comma.or(Some(self.line)),
            None => {}
        }
        if let (Some(point), Some(comma)) = (marks.point, marks.comma) {
            return Err(self.error(
                format!("numbers with a decimal point (line {point}) and with a decimal comma (line {comma})"),
                "one of the two separates thousands: save the file without such separators",
            ));
        }
        Ok(value)
    }

    fn error(&self, problem: String, help: &str) -> RecordingError {
        RecordingError::Cell {
            place: Place { path: self.path.to_owned(), row: RowNumber::Line(self.line) },
            column: self.name.to_owned(),
            problem,
            help: help.into(),
        }
    }
}

/// Whether a comma stands where a separator of thousands would, as in `1,234`.
fn may_be_thousands(text: &str) -> bool {
    let digits = |text: &str| text.chars().all(|c| c.is_ascii_digit());
    text.trim_start_matches(['-', '+']).split_once(',').is_some_and(|(whole, rest)| {
        (1..=3).contains(&whole.len()) && rest.len() == 3 && whole != "0" && digits(whole) && digits(rest)
    })
}

/// A number with a decimal point or comma, a truth as 0 or 1, NaN where nothing was measured; says which mark it has.
fn number(text: &str, mark: &mut Option<char>) -> Option<f64> {
    const MISSING: [&str; 8] = ["", "nan", "na", "n/a", "null", "none", "-", "--"];
    if MISSING.iter().any(|missing| text.eq_ignore_ascii_case(missing)) {
        return Some(f64::NAN);
    }
    if text.eq_ignore_ascii_case("true") || text.eq_ignore_ascii_case("false") {
        return Some(f64::from(u8::from(text.eq_ignore_ascii_case("true"))));
    }
    *mark = text.chars().find(|c| ['.', ','].contains(c));
    let value: f64 = match mark {
        // A second mark leaves a text that is no number.
        Some(',') => text.replacen(',', ".", 1).parse().ok()?,
        _ => text.parse().ok()?,
    };
    Some(if value.is_finite() { value } else { f64::NAN })
}

#[cfg(test)]
mod tests {
    use super::*;
    use miette::Diagnostic;

    fn table(text: impl AsRef<[u8]>, wanted: &[&str]) -> Result<Table, RecordingError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("rig.csv");
        std::fs::write(&path, text).unwrap();
        read(&path, &wanted.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>(), None)
    }

    #[track_caller]
    fn refusal(text: impl AsRef<[u8]>, wanted: &[&str]) -> String {
        let error = table(text, wanted).expect_err("this file must be refused");
        format!("{error}; {}", error.help().map(|h| h.to_string()).unwrap_or_default())
    }

    #[track_caller]
    fn says(message: &str, parts: &[&str]) {
        for part in parts {
            assert!(message.contains(part), "`{message}` does not say `{part}`");
        }
    }

    #[test]
    fn every_separator_and_decimal_mark_is_read() {
        let files = [
            "t,x,note\n0.5,-1.25,a\n1,2e-3,b\n",
            "t;x;note\n0,5;-1,25;a\n1;2e-3;b\n",
            "t\tx\tnote\r\n0,5\t-1,25\ta\r\n1\t2e-3\tb\r\n",
            "\u{feff}sep=;\nt;x;note\n0,5;-1,25;a\n1;2e-3;b\n",
            "\"t\",\"x\",\"note, with a comma\"\n\"0,5\",\"-1,25\",a\n1,2e-3,b\n",
            "# logger 7\n% of 3\n// May\n\n t ; x ; note ;\n0,5 ; -1,25 ; a ;\n1;2e-3;b;\n",
        ];
        for file in files {
            let table = table(file, &["x", "t", "x"]).unwrap_or_else(|e| panic!("{file}: {e}"));
            assert_eq!(table.read, ["x", "t"], "{file}");
            assert_eq!(table.columns, [[-1.25, 2e-3], [0.5, 1.0]], "{file}");
            assert_eq!(table.unread().len(), 1, "{file}");
        }
    }

    #[test]
    fn empty_cells_at_the_ends_of_a_line_keep_their_place() {
        let table = table("\tt\tx\n0\t0.5\t\n\t1\t2\n", &["t", "x"]).unwrap();
        assert_eq!(table.columns[0], [0.5, 1.0]);
        assert!(table.columns[1][0].is_nan() && table.columns[1][1] == 2.0);
    }

    #[test]
    fn a_header_in_a_comment_is_one() {
        let table = table("# made by numpy\n# t x\n# t,x\n0,1\n1,2\n", &["x"]).unwrap();
        assert_eq!((table.columns, table.rows), (vec![vec![1.0, 2.0]], vec![RowNumber::Line(4), RowNumber::Line(5)]));
    }

    #[test]
    fn rows_know_their_lines_and_comments_between_them_are_skipped() {
        let table = table("# a\nt,x\n0,1\n# pause\n\n1,2\n", &["x"]).unwrap();
        assert_eq!(table.rows, [RowNumber::Line(3), RowNumber::Line(6)]);
    }

    #[test]
    fn what_was_not_measured_is_nan() {
        let table = table("t,x\n0,\n1,NaN\n2,inf\n3,n/a\n4, \n5,7\n6,True\n", &["x"]).unwrap();
        let seen: Vec<bool> = table.columns[0].iter().map(|x| x.is_nan()).collect();
        assert_eq!(seen, [true, true, true, true, true, false, false]);
        assert_eq!(table.columns[0][5..], [7.0, 1.0]);
    }

    #[test]
    fn broken_files_are_refused_with_their_place() {
        says(&refusal("", &["x"]), &["the file is empty"]);
        says(&refusal("# only\n", &["x"]), &["the file is empty"]);
        says(&refusal("t,x\n", &["x"]), &["a header and no sample"]);
        says(&refusal("t,x,x\n0,1,2\n", &["t"]), &["`x` occurs twice"]);
        says(
            &refusal("Time,Position,PWM\n0,1,2\n", &["Pos"]),
            &["rig.csv: column \"Pos\" is not there; the file has: Time, Position, PWM"],
        );
        says(&refusal("0,1\n1,2\n", &["x"]), &["line 1: numbers, and no line above them names the columns"]);
        says(
            &refusal("t,x\ns,deg\n0,1\n", &["x"]),
            &["line 2, column `x`: `deg` is not a number", "begin it with `#`"],
        );
        says(&refusal("t,x\n0,1\n0,1 V\n", &["x"]), &["line 3, column `x`: `1 V` is not a number"]);
        says(&refusal("t,x\n0,1\n1\n2,3\n", &["x"]), &["line 3: 1 cells, the header has 2"]);
        says(&refusal("t,x\n0,1\n1", &["x"]), &["line 3: the last line ends after 1 of 2 cells"]);
        says(&refusal("t,x\n0,5,1,2\n", &["x"]), &["line 2: 4 cells", "decimal comma"]);
        says(&refusal("t;x\n0;1.5\n1;2,5\n", &["x"]), &["decimal point (line 2)", "decimal comma (line 3)"]);
        says(&refusal("t,x\n0,\"1\n1,2\n", &["x"]), &["line 2: a quoted cell does not end"]);
        says(&refusal("t;x\n0;1.234,5\n", &["x"]), &["`1.234,5` is not a number", "column `x`"]);
        says(&refusal("t,x\n0,\"1,234\"\n", &["x"]), &["`1,234` may be a decimal number or one of thousands"]);
        says(&refusal(b"t;Winkel [\xb0]\n0;1\n", &["t"]), &["line 1", "not UTF-8"]);
        says(&refusal(b"\xff\xfet\0;\0x\0\n\0", &["t"]), &["not UTF-8"]);
    }
}
