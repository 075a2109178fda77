//! MCAP files that are in order as far as lengths and checksums go, whatever is in them: random bytes never are.
//!
//! The bytes are commands: a channel, a message, metadata, any record, a chunk. See mcap.dev/spec for the layout.

use crc::{CRC_32_ISO_HDLC, Crc};

use crate::bytes::Bytes;

/// How every file begins and ends.
pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const MOST_RECORDS: usize = 400;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const METADATA: u8 = 12;
const DATA_END: u8 = 15;

const TOPICS: [&str; 12] = [
    "/sample",
    "/event",
    "/state",
    "/link",
    "/simulation",
    "/one/sample",
    "/one/event",
    "/two/sample",
    "/one/state",
    "",
    "/",
    "é",
];
/// `@` is a number.
const MESSAGES: [&str; 10] = [
    r#"{"t_s":@,"tick":1,"enable":1,"duty":0.5,"adc":1000}"#,
    r#"{"t_s":@,"duty":@,"adc":@}"#,
    r#"{"t_s":0.5,"voltage_v":@,"angle_rad":@,"enable":@}"#,
    r#"{"t_s":@,"state":"Speed","fault":null,"tracking":true}"#,
    r#"{"t_s":@,"state":"Fault","fault":"Stall","tracking":@}"#,
    r#"{"t_s":@,"rate_hz":@,"loss":@,"latency_s":@,"rssi_dbm":@}"#,
    r#"{"t_s":@,"kind":"order","text":"freq 7","command":{"Speed":{"omega":@}}}"#,
    r#"{"t_s":@,"kind":"answer","text":"done","outcome":"done"}"#,
    r#"{"t_s":@,"kind":"unheard of"}"#,
    r#"[@]"#,
];
const NUMBERS: [&str; 12] =
    ["0", "-1", "1", "0.25", "65536", "1e308", "-1e308", "1e999", "null", "true", "\"\"", "18446744073709551616"];
const METADATA_TEXTS: [&str; 4] = ["robot = \"one\"", "seed = -1", "start_state = \"Fault\"", "robot = \"one\"\nrobot"];

/// The file that the commands make.
pub fn file(mut bytes: Bytes) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    record(&mut file, HEADER, &[text(b""), text(b"any")].concat());
    let (mut chunk, mut clock_ms): (Option<Vec<u8>>, u32) = (None, 0);
    for _ in 0..MOST_RECORDS {
        let Some(command) = bytes.next() else { break };
        let to = chunk.as_mut().unwrap_or(&mut file);
        match command % 16 {
            0..=7 => message(to, &mut bytes, &mut clock_ms),
            8..=10 => channel(to, &mut bytes),
            11 => metadata(to, &mut bytes),
            12 => {
                let (opcode, body) = (bytes.u8(), bytes.some());
                record(to, opcode, body);
                // The length is not true.
                if command & 0x40 != 0 {
                    let at = to.len() - body.len() - 8;
                    to[at] = bytes.u8();
                }
            }
            13 | 14 => match chunk.take() {
                None => chunk = Some(Vec::new()),
                Some(records) => close(&mut file, &records, bytes.u8()),
            },
            // Cut off.
            _ => return file,
        }
    }
    if let Some(records) = chunk {
        close(&mut file, &records, 0);
    }
    record(&mut file, DATA_END, &[0; 4]);
    record(&mut file, FOOTER, &[0; 20]);
    file.extend(MAGIC);
    file
}

fn record(to: &mut Vec<u8>, opcode: u8, body: &[u8]) {
    to.push(opcode);
    to.extend((body.len() as u64).to_le_bytes());
    to.extend(body);
}

fn text(text: &[u8]) -> Vec<u8> {
    let length = u32::try_from(text.len()).expect("short");
    [&length.to_le_bytes()[..], text].concat()
}

fn map(key: &[u8], value: &[u8]) -> Vec<u8> {
    text(&[text(key), text(value)].concat())
}

fn channel(to: &mut Vec<u8>, bytes: &mut Bytes) {
    let id = u16::from(bytes.u8() % 4);
    let topic = usize::from(bytes.u8());
    let topic = TOPICS.get(topic % (TOPICS.len() + 2)).map_or_else(|| bytes.some(), |topic| topic.as_bytes());
    let (encoding, named) = if bytes.u8() == 255 { (&b"cbor"[..], bytes.some()) } else { (&b"json"[..], &b"one"[..]) };
    record(
        to,
        CHANNEL,
        &[&id.to_le_bytes()[..], &[0; 2], &text(topic), &text(encoding), &map(b"robot", named)].concat(),
    );
}

fn message(to: &mut Vec<u8>, bytes: &mut Bytes, clock_ms: &mut u32) {
    let id = u16::from(bytes.u8() % 4);
    let template = usize::from(bytes.u8()) % (MESSAGES.len() + 1);
    let data = match MESSAGES.get(template) {
        None => bytes.some().to_vec(),
        Some(template) => {
            // Mostly a time after the last one, so that a sample is taken.
            *clock_ms += 1;
            let mut data = String::new();
            for (index, part) in template.split('@').enumerate() {
                if index > 0 {
                    let number = usize::from(bytes.u8());
                    let time = format!("{}e-3", *clock_ms);
                    data.push_str(NUMBERS.get(number).copied().unwrap_or(if index == 1 { &time } else { "0.5" }));
                }
                data.push_str(part);
            }
            data.into_bytes()
        }
    };
    record(to, MESSAGE, &[&id.to_le_bytes()[..], &[0; 20], &data].concat());
}

fn metadata(to: &mut Vec<u8>, bytes: &mut Bytes) {
    let toml = usize::from(bytes.u8());
    let toml = METADATA_TEXTS.get(toml).map_or_else(|| bytes.some(), |toml| toml.as_bytes());
    record(to, METADATA, &[text(b"run"), map(b"toml", toml)].concat());
}

/// A chunk; with `wrong`, something about it is not true.
fn close(file: &mut Vec<u8>, records: &[u8], wrong: u8) {
    let length = records.len() as u64;
    let said = if wrong == 1 { u64::MAX } else { length };
    let crc = CRC.checksum(records) ^ u32::from(wrong == 2);
    let compression: &[u8] = if wrong == 3 { b"zstd" } else { b"" };
    let head = [&[0; 16][..], &said.to_le_bytes(), &crc.to_le_bytes(), &text(compression)].concat();
    record(file, CHUNK, &[&head[..], &length.to_le_bytes(), records].concat());
}
