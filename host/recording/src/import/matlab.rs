//! Reads MATLAB's `.mat` files of version 5 (saved with `-v6` or `-v7`, and by `scipy.io.savemat`): every numeric vector is a
//! column, a field of a structure is `structure.field`, a column of a matrix is `matrix(:,k)`.
//!
//! The format is MathWorks' "MAT-File Format", the level 5 part. Every length is checked against what is there before anything
//! is taken, so that a broken file costs no more memory than a whole one.

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::table::{Table, locate};
use crate::{RecordingError, RowNumber};

/// Bytes of a header: a text, the version and the byte order.
const HEADER: usize = 128;
/// Bytes of one compressed variable at most, uncompressed: 32 million numbers.
const MOST_BYTES: u64 = 1 << 28;
/// Numbers of all vectors at most: 1 GiB.
const MOST_NUMBERS: usize = 1 << 27;
/// Structures within structures that are looked into.
const MOST_DEPTH: u32 = 4;
/// Columns of a matrix that are called one by one; a wider one is a picture or a map.
const MOST_COLUMNS: usize = 64;

/// Types of data elements.
const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;
/// Classes of arrays.
const STRUCTURE: u8 = 2;
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
const COMPLEX: u32 = 0x0800;

/// A vector of a file.
struct Vector {
    name: String,
    values: Vec<f64>,
}

/// Reads the wanted vectors, which are of equal length.
pub(super) fn read(path: &Path, wanted: &[String]) -> Result<Table, RecordingError> {
    let bytes = std::fs::read(path).map_err(|e| RecordingError::io(path, e))?;
    let vectors = vectors(&bytes).map_err(|problem| problem.of(path))?;
    let names: Vec<String> = vectors.iter().map(|vector| vector.name.clone()).collect();
    let found = locate(path, &names, wanted)?;
    let length = found.first().map_or(0, |(_, index)| vectors[*index].values.len());
    for (name, index) in &found {
        let own = vectors[*index].values.len();
        if own != length {
            return Err(RecordingError::Format {
                path: path.to_owned(),
                problem: format!("\"{name}\" has {own} values, \"{}\" has {length}", found[0].0),
                help: "columns of one run have one value a row: save them at the same times".into(),
            });
        }
    }
    if length == 0 && !found.is_empty() {
        return Err(RecordingError::NoSamples { path: path.to_owned() });
    }
    Ok(Table {
        path: path.to_owned(),
        names,
        columns: found.iter().map(|(_, index)| finite(&vectors[*index].values)).collect(),
        read: found.into_iter().map(|(name, _)| name).collect(),
        rows: (1..=length as u64).map(RowNumber::Entry).collect(),
    })
}

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| if value.is_finite() { *value } else { f64::NAN }).collect()
}

/// Why a file is not read.
#[derive(Debug, PartialEq, Eq)]
enum Problem {
    Empty,
    /// Version 7.3 is HDF5.
    Hdf5,
    /// Version 4, or no such file at all.
    NotMat,
    /// Bytes are missing or do not fit together, at this place.
    Broken(usize),
    NoVectors,
    TooLarge,
}

impl Problem {
    fn of(self, path: &Path) -> RecordingError {
        let (problem, help) = match self {
            Self::Empty => return RecordingError::Empty { path: path.to_owned() },
            Self::Hdf5 => (
                "a file of version 7.3 (HDF5), which is not read".to_owned(),
                "save it again in MATLAB: s = load('FILE.mat'); save('FILE7.mat', '-struct', 's', '-v7')",
            ),
            Self::NotMat => (
                "not a .mat file of version 5 to 7".to_owned(),
                "save it in MATLAB with save('FILE.mat', …, '-v7'), in Octave with save -v7, in Python with scipy.io.savemat",
            ),
            Self::Broken(at) => (
                format!("the file is damaged or cut off at byte {at}"),
                "save it again, and compare the sizes if it was copied",
            ),
            Self::NoVectors => (
                "no numeric vectors are in it".to_owned(),
                "save the signals as vectors, or as fields of a structure; tables, timetables, timeseries and other objects are not \
                 read: save('FILE.mat', 'time', 'angle', 'duty', '-v7')",
            ),
            Self::TooLarge => {
                ("its signals take more than 1 GiB".to_owned(), "save the signals of one run alone, as vectors")
            }
        };
        RecordingError::Format { path: path.to_owned(), problem, help: help.into() }
    }
}

/// Every vector of a file, in its order.
fn vectors(bytes: &[u8]) -> Result<Vec<Vector>, Problem> {
    if bytes.is_empty() {
        return Err(Problem::Empty);
    }
    if bytes.starts_with(b"\x89HDF") || bytes.starts_with(b"MATLAB 7.3") {
        return Err(Problem::Hdf5);
    }
    let big = match bytes.get(HEADER - 2..HEADER) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(Problem::NotMat),
    };
    let mut found = Vec::new();
    let mut all = Elements { bytes, at: HEADER, big, origin: 0, compressed: false };
    while let Some(element) = all.next()? {
        match element.kind {
            COMPRESSED => {
                let mut inflated = Vec::new();
                ZlibDecoder::new(element.data)
                    .take(MOST_BYTES + 1)
                    .read_to_end(&mut inflated)
                    .map_err(|_| Problem::Broken(element.at))?;
                if inflated.len() as u64 > MOST_BYTES {
                    return Err(Problem::TooLarge);
                }
                // What is wrong within is told at the place of the whole.
                let mut within = Elements { bytes: &inflated, at: 0, big, origin: element.at, compressed: true };
                while let Some(element) = within.next()? {
                    if element.kind == MATRIX {
                        array(&element, None, MOST_DEPTH, &mut found)?;
                    }
                }
            }
            MATRIX => array(&element, None, MOST_DEPTH, &mut found)?,
            _ => {}
        }
    }
    if found.is_empty() { Err(Problem::NoVectors) } else { Ok(found) }
}

/// A data element.
struct Element<'a> {
    kind: u32,
    data: &'a [u8],
    /// Where its data begin, for messages.
    at: usize,
    big: bool,
    compressed: bool,
}

impl<'a> Element<'a> {
    fn parts(&self) -> Elements<'a> {
        Elements { bytes: self.data, at: 0, big: self.big, origin: self.at, compressed: self.compressed }
    }

    /// Its numbers, whatever their type.
    fn numbers(&self) -> Result<Vec<f64>, Problem> {
        macro_rules! read {
            ($type:ty) => {{
                const SIZE: usize = size_of::<$type>();
                let value = |chunk: &[u8]| {
                    let mut bytes = [0; SIZE];
                    bytes.copy_from_slice(chunk);
                    if self.big { <$type>::from_be_bytes(bytes) as f64 } else { <$type>::from_le_bytes(bytes) as f64 }
                };
                let chunks = self.data.chunks_exact(SIZE);
                if !chunks.remainder().is_empty() {
                    return Err(Problem::Broken(self.at));
                }
                chunks.map(value).collect()
            }};
        }
        Ok(match self.kind {
            1 => read!(i8),
            2 => read!(u8),
            3 => read!(i16),
            4 => read!(u16),
            5 => read!(i32),
            6 => read!(u32),
            7 => read!(f32),
            9 => read!(f64),
            12 => read!(i64),
            13 => read!(u64),
            _ => return Err(Problem::Broken(self.at)),
        })
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(self.data).trim_end_matches('\0').to_owned()
    }
}

/// Data elements one after the other.
struct Elements<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
    /// Where these bytes are in the file, for messages.
    origin: usize,
    /// These bytes are not in the file, but inflated: all of them are told as its `origin`.
    compressed: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Option<u32> {
        let bytes: [u8; 4] = self.bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn place(&self, at: usize) -> usize {
        if self.compressed { self.origin } else { self.origin + at }
    }

    /// The next element; none at the end.
    fn next(&mut self) -> Result<Option<Element<'a>>, Problem> {
        if self.at >= self.bytes.len() {
            return Ok(None);
        }
        let broken = Problem::Broken(self.place(self.at));
        let Some(tag) = self.word(self.at) else { return Err(broken) };
        // Up to four bytes stand in the tag itself, whose upper half is then their number.
        let (kind, from, length) = if tag >> 16 != 0 {
            (tag & 0xffff, self.at + 4, (tag >> 16) as usize)
        } else {
            let Some(length) = self.word(self.at + 4) else { return Err(broken) };
            (tag, self.at + 8, length as usize)
        };
        let small = tag >> 16 != 0;
        let Some(data) = from.checked_add(length).and_then(|to| self.bytes.get(from..to)) else { return Err(broken) };
        if small && length > 4 {
            return Err(broken);
        }
        // Elements begin at multiples of eight, but for compressed ones.
        let padding = if kind == COMPRESSED { 0 } else { length.next_multiple_of(8) - length };
        self.at = if small { self.at + 8 } else { from + length + padding };
        let (at, big, compressed) = (self.place(from), self.big, self.compressed);
        Ok(Some(Element { kind, data, at, big, compressed }))
    }

    fn needed(&mut self) -> Result<Element<'a>, Problem> {
        let at = self.place(self.at);
        self.next()?.ok_or(Problem::Broken(at))
    }
}

/// Takes the vectors out of an array: itself, the columns of a matrix, the fields of a structure. Within a structure the name
/// comes from there.
fn array(element: &Element<'_>, name: Option<&str>, depth: u32, found: &mut Vec<Vector>) -> Result<(), Problem> {
    let mut parts = element.parts();
    // An empty field has no parts.
    let Some(flags) = parts.next()? else { return Ok(()) };
    let flags = flags.parts().word(0).ok_or(Problem::Broken(element.at))?;
    let class = (flags & 0xff) as u8;
    let sizes = parts.needed()?.numbers()?;
    let own = parts.needed()?.text();
    let name = name.map_or(own, str::to_owned);
    if class == STRUCTURE {
        return if sizes.iter().product::<f64>() == 1.0 { fields(&mut parts, &name, depth, found) } else { Ok(()) };
    }
    if !NUMBERS.contains(&class) || flags & COMPLEX != 0 {
        return Ok(());
    }
    let values = parts.needed()?;
    // A number takes a byte in the file at least.
    if found.iter().map(|vector| vector.values.len()).sum::<usize>() + values.data.len() > MOST_NUMBERS {
        return Err(Problem::TooLarge);
    }
    let values = values.numbers()?;
    let [rows, columns] = sizes[..] else { return Ok(()) };
    let (rows, columns) = (rows as usize, columns as usize);
    if rows.checked_mul(columns) != Some(values.len()) {
        return Err(Problem::Broken(element.at));
    }
    if rows.min(columns) <= 1 {
        // A single number is a constant, no signal.
        if values.len() > 1 {
            found.push(Vector { name, values });
        }
    } else if columns <= MOST_COLUMNS {
        for (index, column) in values.chunks_exact(rows).enumerate() {
            found.push(Vector { name: format!("{name}(:,{})", index + 1), values: column.to_vec() });
        }
    }
    Ok(())
}

/// Takes the vectors out of the fields of a structure.
fn fields(parts: &mut Elements<'_>, name: &str, depth: u32, found: &mut Vec<Vector>) -> Result<(), Problem> {
    let lengths = parts.needed()?;
    let length = lengths.numbers()?.first().copied().unwrap_or_default() as usize;
    let names = parts.needed()?;
    if length == 0 || depth == 0 {
        return Ok(());
    }
    for field in names.data.chunks_exact(length) {
        let end = field.iter().position(|byte| *byte == 0).unwrap_or(length);
        let field = String::from_utf8_lossy(&field[..end]);
        let value = parts.needed()?;
        if value.kind == MATRIX {
            array(&value, Some(&format!("{name}.{field}")), depth - 1, found)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
    }

    fn names(path: &Path) -> Vec<String> {
        vectors(&std::fs::read(path).unwrap()).unwrap().into_iter().map(|vector| vector.name).collect()
    }

    #[test]
    fn vectors_matrices_and_structures_are_read_compressed_or_not() {
        for name in ["scipy.mat", "scipy-compressed.mat"] {
            let path = fixture(name);
            let expected = ["t", "pos", "pwm", "single", "log.t", "log.inner.volts", "two(:,1)", "two(:,2)"];
            assert_eq!(names(&path), expected, "{name}");
            let wanted = ["t", "pwm", "log.inner.volts", "two(:,2)", "single"].map(String::from);
            let table = read(&path, &wanted).unwrap();
            for row in 0..50 {
                let t = f64::from(row as u16) * 0.01;
                let expected = [t, f64::from(row as u16) - 20.0, 7.5 - t, 2.0 * t];
                for (column, expected) in table.columns.iter().zip(expected) {
                    assert!((column[row] - expected).abs() < 1e-12, "{name}, row {row}: {} {expected}", column[row]);
                }
            }
            assert!(table.columns[4][3].is_nan() && table.columns[4][4] == 4.0, "a NaN is missing");
        }
    }

    /// A file with a vector `x` of two numbers, as a machine of the other byte order writes it, said to have some columns.
    fn other_order(columns: u32) -> Vec<u8> {
        let word = |value: u32| value.to_be_bytes();
        let element = |kind: u32, data: &[u8]| [&word(kind)[..], &word(data.len() as u32), data].concat();
        let sizes = [word(1), word(columns)].concat();
        let small_name = [&[0, 1, 0, 1][..], b"x\0\0\0"].concat();
        let values = [1.5_f64.to_be_bytes(), (-2.0_f64).to_be_bytes()].concat();
        let parts = [element(6, &[word(6), word(0)].concat()), element(5, &sizes), small_name, element(9, &values)];
        let mut file = vec![b' '; HEADER];
        file[HEADER - 2..].copy_from_slice(b"MI");
        file.extend(element(MATRIX, &parts.concat()));
        file
    }

    #[test]
    fn the_other_byte_order_is_read() {
        let found = vectors(&other_order(2)).unwrap();
        assert_eq!((found[0].name.as_str(), found[0].values.as_slice()), ("x", &[1.5, -2.0][..]));
    }

    #[test]
    fn a_size_that_its_numbers_do_not_have_is_refused() {
        assert_eq!(vectors(&other_order(3)).map(|_| ()), Err(Problem::Broken(HEADER + 8)));
    }

    #[test]
    fn a_file_that_is_cut_off_or_damaged_is_refused_and_never_panics() {
        for name in ["scipy.mat", "scipy-compressed.mat"] {
            let whole = std::fs::read(fixture(name)).unwrap();
            for length in 1..whole.len() {
                let _ = vectors(&whole[..length]);
            }
            assert!(matches!(vectors(&whole[..whole.len() - 9]), Err(Problem::Broken(_))), "{name}");
            for at in HEADER..whole.len() {
                for bit in [0x01, 0x80, 0xff] {
                    let mut damaged = whole.clone();
                    damaged[at] ^= bit;
                    let _ = vectors(&damaged);
                }
            }
        }
    }

    #[test]
    fn other_kinds_of_files_are_told_apart() {
        let kind = |bytes: &[u8]| vectors(bytes).map(|_| ()).unwrap_err();
        let mut header = vec![b' '; HEADER];
        header[HEADER - 2..].copy_from_slice(b"IM");
        assert_eq!(kind(b""), Problem::Empty);
        assert_eq!(kind(b"t,pos\n0,1\n"), Problem::NotMat);
        assert_eq!(kind(b"MATLAB 7.3 MAT-file, Platform: GLNXA64"), Problem::Hdf5);
        assert_eq!(kind(b"\x89HDF\r\n\x1a\n"), Problem::Hdf5);
        assert_eq!(kind(&header), Problem::NoVectors);
    }

    #[test]
    fn columns_of_different_length_are_no_run() {
        let error = read(&fixture("scipy.mat"), &["t".into(), "log.t".into()]).unwrap_err().to_string();
        assert!(error.contains("\"log.t\" has 5 values, \"t\" has 50"), "{error}");
        let error = read(&fixture("scipy.mat"), &["angle".into()]).unwrap_err().to_string();
        assert!(
            error.contains("the file has: t, pos, pwm, single, log.t, log.inner.volts, two(:,1), two(:,2)"),
            "{error}"
        );
    }
}
