//! What is in the flash: any contents, of the parameters' partition, the pairing's or the gait's.
//!
//! The first byte says which partition; then come commands: keep something, damage what is there, or put in a record whose
//! checksum is right and whose content is not.

use std::ops::Range;

use control::gait::Name;
use control::protocol::pairing::Pairing;
use control::protocol::radio::Source;
use control::protocol::secure::Key;
use control::{Gait, Parameters};
use crc::{CRC_32_ISO_HDLC, Crc};
use embassy_futures::block_on;
use postcard_schema::key::Key as Layout;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};
use shell::store::{gait, pairing, parameters};

use crate::bytes::Bytes;
use crate::flash::{Flash, PAGE};
use crate::robot_commands::{FACTORY, damaged};

/// Two for each half.
const PAGES: usize = 4;
const MOST_STEPS: usize = 12;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Whose partition it is.
#[derive(Clone, Copy)]
enum Partition {
    Parameters,
    Pairing,
    Gait,
}

/// Runs the commands, and then looks what is there and keeps something new.
pub fn store(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let partition = match bytes.u8() & 3 {
        1 => Partition::Pairing,
        3 => Partition::Gait,
        _ => Partition::Parameters,
    };
    let mut flash = Flash::blank(PAGES);
    for _ in 0..MOST_STEPS {
        let Some(command) = bytes.next() else { break };
        match command % 8 {
            0 => keep(&mut flash, partition, bytes.u8()),
            1 => put(&mut flash, partition, &mut bytes),
            _ => damage(&mut flash, command, &mut bytes),
        }
        if command & 0x80 != 0 {
            check(&mut flash, partition);
        }
    }
    check(&mut flash, partition);
    keep(&mut flash, partition, bytes.u8());
}

fn range() -> Range<u32> {
    0..u32::try_from(PAGES * PAGE).expect("small")
}

/// What is loaded may be run on.
fn check(flash: &mut Flash, partition: Partition) {
    match partition {
        Partition::Parameters => {
            let (set, source) = block_on(parameters::load(flash, range(), &FACTORY));
            assert_eq!(set.check(), Ok(()), "{source:?}");
            assert!(source == Source::Stored || set == *FACTORY, "{source:?} is not the factory's");
        }
        Partition::Pairing => drop(block_on(pairing::load(flash, range()))),
        Partition::Gait => {
            let gait = block_on(gait::load(flash, range()));
            assert!(gait.is_none_or(|gait| gait.check_form().is_ok()), "{gait:?}");
        }
    }
}

/// Whatever is in the flash, what is kept now comes back.
fn keep(flash: &mut Flash, partition: Partition, number: u8) {
    match partition {
        Partition::Parameters => {
            let mut set = *FACTORY;
            set.estimator.gate -= f32::from(number) / 256.0;
            let saved = block_on(parameters::save(flash, range(), &FACTORY, &set));
            assert_eq!(saved, Ok(()));
            assert_eq!(block_on(parameters::load(flash, range(), &FACTORY)), (set, Source::Stored));
        }
        Partition::Pairing if number == 0 => {
            assert_eq!(block_on(pairing::forget(flash, range())), Ok(()));
            assert_eq!(block_on(pairing::load(flash, range())), Err(pairing::Unpaired::Nobody));
        }
        Partition::Pairing => {
            let pairing =
                Pairing { console: [number; 6], primary: [number; 16], local: [number; 16], key: Key([number; 32]) };
            assert_eq!(block_on(pairing::save(flash, range(), &pairing)), Ok(()));
            assert_eq!(block_on(pairing::load(flash, range())), Ok(pairing));
        }
        Partition::Gait => {
            let gait = gait_of(number);
            assert_eq!(block_on(gait::save(flash, range(), &gait)), Ok(()));
            assert_eq!(block_on(gait::load(flash, range())), Some(gait));
        }
    }
}

/// A gait that is like no other's number.
fn gait_of(number: u8) -> Gait {
    let steps = [number & 1; 9];
    Gait::new(Name::new("any").expect("a name"), &[44.0, f32::from(number)], &[[-1.0, 1.0]], &steps, 40, true)
        .expect("sound")
}

/// A record that the library finds in order, in the lower half or the upper.
fn put(flash: &mut Flash, partition: Partition, bytes: &mut Bytes) {
    let (layout, built_in, body) = match partition {
        Partition::Parameters => {
            let mut buffer = [0; 2 * size_of::<Parameters>()];
            let factory = postcard::to_slice(&*FACTORY, &mut buffer).expect("short");
            let layout = Layout::for_path::<Parameters>("parameters, 1");
            (layout, CRC.checksum(factory), damaged(&*FACTORY, bytes))
        }
        Partition::Pairing => (Layout::for_path::<Pairing>("pairing, 1"), 0, bytes.some().to_vec()),
        Partition::Gait => (Layout::for_path::<Gait>("gait, 1"), 0, damaged(&gait_of(bytes.u8()), bytes)),
    };
    let sequence = u32::from(bytes.u8());
    let half = PAGES * PAGE / 2 * usize::from(sequence & 1 != 0);
    let half = u32::try_from(half).expect("small")..u32::try_from(half + PAGES * PAGE / 2).expect("small");
    let mut record = [&layout.to_bytes()[..], &built_in.to_le_bytes(), &sequence.to_le_bytes(), &body].concat();
    record.extend(CRC.checksum(&record).to_le_bytes());
    let mut map = MapStorage::new(flash, MapConfig::new(half), Cache::new_uncached());
    // It may be too damaged for that already.
    let _ = block_on(map.store_item(&mut [0; PAGE], &(), &record.as_slice()));
}

fn damage(flash: &mut Flash, command: u8, bytes: &mut Bytes) {
    let cells = &mut flash.0;
    let at = bytes.below(cells.len());
    match command % 8 {
        2 => cells[at] ^= bytes.u8(),
        3 => cells[at..].iter_mut().zip(bytes.some()).for_each(|(cell, byte)| *cell = *byte),
        4 => {
            let end = (at + usize::from(bytes.u16())).min(cells.len());
            cells[at..end].fill(bytes.u8());
        }
        // An erase that was interrupted.
        5 => {
            let page = at / PAGE * PAGE;
            cells[page..at].fill(0xFF);
        }
        6 => {
            let (from, to) = (at / PAGE * PAGE, bytes.below(cells.len()) / PAGE * PAGE);
            cells.copy_within(from..from + PAGE, to);
        }
        // Anything, from a seed (xorshift, Marsaglia 2003).
        _ => {
            let mut state = bytes.u32() | 1;
            let page = at / PAGE * PAGE;
            for cell in &mut cells[page..page + PAGE] {
                state ^= state << 13;
                state ^= state >> 17;
                state ^= state << 5;
                *cell = state.to_le_bytes()[0];
            }
        }
    }
}
