//! The file of keys: any bytes, or a good file with some of it changed. Whatever is wrong, no message repeats a key.
//!
//! The first byte says which: 0 is followed by the file, anything else by so many changes to a good one.

use link::Keys;

use crate::bytes::Bytes;
use crate::scratch::Scratch;

const GOOD: &str = "\
# Whoever has these keys can drive the robots. Written by `scram pair`.
primary = \"00112233445566778899aabbccddeeff\"

[[robot]]
name = \"scram-26\"
address = \"7c:df:a1:00:11:22\"
dongle = \"02:00:00:00:00:01\"
local = \"a1a2a3a4a5a6a7a8a9aaabacadaeafb0\"
key = \"c0c1c2c3c4c5c6c7c8c9cacbcccdcecfd0d1d2d3d4d5d6d7d8d9dadbdcdddedf\"
";
/// So many hexadecimal digits in a row are eight bytes of a key.
const SECRET: usize = 16;

/// Reads a file.
pub fn keys_file(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let changes = bytes.u8();
    let file = if changes == 0 { bytes.rest().to_vec() } else { changed(changes, &mut bytes) };
    let scratch = Scratch::new();
    let path = scratch.file("keys.toml", &file);
    match Keys::load(&path) {
        Ok(keys) => comes_back(&scratch, keys, &file),
        Err(error) => {
            let messages = [error.to_string(), format!("{error:?}"), format!("{:?}", miette::Report::new(error))];
            messages.iter().for_each(|message| no_secret(message, &file));
        }
    }
}

fn changed(changes: u8, bytes: &mut Bytes) -> Vec<u8> {
    let mut file = GOOD.as_bytes().to_vec();
    for _ in 0..changes % 16 {
        let (at, other) = (bytes.below(file.len() + 1), bytes.below(file.len() + 1));
        let (low, high) = (at.min(other), at.max(other));
        match bytes.u8() % 6 {
            0 => file.splice(at..at, bytes.some().iter().copied()).for_each(drop),
            1 => file.truncate(at),
            2 => drop(file.drain(low..high.min(low + usize::from(bytes.u8())))),
            3 => {
                if let Some(byte) = file.get_mut(at) {
                    *byte = bytes.u8();
                }
            }
            // A key in another place.
            4 => {
                let part = file[low..high.min(low + 80)].to_vec();
                file.splice(at..at, part);
            }
            _ => {
                if let Some(byte) = file.get_mut(at) {
                    *byte = b"\n\"'=[]#\\{},\0"[usize::from(bytes.u8()) % 12];
                }
            }
        }
    }
    file
}

/// Saved and read again, and never shown.
fn comes_back(scratch: &Scratch, mut keys: Keys, file: &[u8]) {
    let path = scratch.file("again.toml", b"");
    keys.save(&path).expect("a temporary file");
    assert_eq!(Keys::load(&path).expect("what was saved is read"), keys);
    // A name is a person's to choose.
    keys.robots.iter_mut().for_each(|robot| robot.name.clear());
    no_secret(&format!("{keys:?}"), file);
}

/// No eight bytes of anything in the file that looks like a key.
fn no_secret(shown: &str, file: &[u8]) {
    for secret in file.windows(SECRET).filter(|window| window.iter().all(u8::is_ascii_hexdigit)) {
        let secret = std::str::from_utf8(secret).expect("digits");
        assert!(!shown.contains(secret), "`{secret}` is shown: {shown}");
    }
}
