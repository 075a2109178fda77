//! Whether the chunks of an MCAP file hold whole records, before anything in them is believed.
//!
//! `mcap` 0.26.0 subtracts a record's length from what is left of its chunk without a look whether it fits
//! (`sans_io::LinearReader`): of a damaged length it makes a panic, or in release reads on where no record begins. Here the
//! lengths alone are followed; what else is wrong is for whoever reads the contents.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Result};
use std::path::Path;

use mcap::records::op;

use super::RecordingError;

const MAGIC: usize = mcap::MAGIC.len();
/// Opcode and length.
const RECORD_HEAD: usize = 9;
/// Of a chunk, before the name of its compression: two times, a size, a CRC and the name's length.
const CHUNK_HEAD: usize = 32;

/// Fails where a record is longer than what is left of its chunk.
pub(super) fn check(path: &Path) -> std::result::Result<(), RecordingError> {
    let walked = File::open(path).and_then(|file| walk(&mut BufReader::with_capacity(1 << 16, file)));
    match walked {
        Ok(true) => Ok(()),
        Ok(false) => Err(RecordingError::Format {
            path: path.to_owned(),
            problem: "a record is longer than the chunk that it is in".into(),
            help: "the file is damaged: `mcap recover` (mcap.dev) saves its whole chunks".into(),
        }),
        // A file may be cut off anywhere.
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(()),
        Err(error) => Err(RecordingError::io(path, error)),
    }
}

fn walk(file: &mut BufReader<File>) -> Result<bool> {
    if read::<MAGIC>(file)? != *mcap::MAGIC {
        return Ok(true);
    }
    loop {
        let (opcode, length) = record_head(file)?;
        match opcode {
            // Zeros behind the last write, or the end.
            0 | op::FOOTER => return Ok(true),
            op::CHUNK => {
                if !chunk(file, length)? {
                    return Ok(false);
                }
            }
            _ => skip(file, length)?,
        }
    }
}

fn chunk(file: &mut BufReader<File>, length: u64) -> Result<bool> {
    let head: [u8; CHUNK_HEAD] = read(file)?;
    let [.., a, b, c, d] = head;
    let name = u64::from(u32::from_le_bytes([a, b, c, d]));
    skip(file, name)?;
    let records = u64::from_le_bytes(read(file)?);
    let padding = length.checked_sub(CHUNK_HEAD as u64 + name + 8).and_then(|rest| rest.checked_sub(records));
    // The reader refuses one that is too short for that, and one that is compressed.
    let Some(padding) = padding.filter(|_| name == 0) else { return Err(ErrorKind::UnexpectedEof.into()) };
    let mut left = records;
    while left > 0 {
        let Some(behind_head) = left.checked_sub(RECORD_HEAD as u64) else { return Ok(false) };
        let (_, length) = record_head(file)?;
        let Some(behind) = behind_head.checked_sub(length) else { return Ok(false) };
        skip(file, length)?;
        left = behind;
    }
    skip(file, padding)?;
    Ok(true)
}

fn record_head(file: &mut BufReader<File>) -> Result<(u8, u64)> {
    let [opcode, length @ ..] = read::<RECORD_HEAD>(file)?;
    Ok((opcode, u64::from_le_bytes(length)))
}

fn read<const N: usize>(file: &mut BufReader<File>) -> Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// Beyond the end, too: the next read tells.
fn skip(file: &mut BufReader<File>, length: u64) -> Result<()> {
    file.seek_relative(i64::try_from(length).map_err(|_| ErrorKind::UnexpectedEof)?)
}
