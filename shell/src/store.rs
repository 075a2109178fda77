//! What the robot keeps in flash: its [`parameters`], its [`pairing`] and its [`gait`], each in a partition of its own. Whatever
//! happens to the supply, the robot finds what was there before or what was written last, whole.
//!
//! A partition has two A/B slots, each a wear-levelled map of [`sequential_storage`], and records are written in
//! turn: the half that holds the newest one is neither written to nor erased. So nothing in the other half matters until
//! its record is complete, not even an interrupted erase that leaves a page with old or random contents, which a single
//! map takes for data (it brings back a record from long ago). The intact record with the highest sequence number counts.
//!
//! A record is `layout 8 bytes, origin u32, sequence u32, postcard of what is kept, CRC-32 of all before`, little endian.
//! Without a content it says that there is nothing any more. `layout` is a hash of the type's schema, so that another
//! firmware does not read nonsense. `origin` says beside what the content is right: see [`parameters`].
//!
//! # Wear
//! A record of parameters takes 624 bytes, a page of 4096 bytes 6 of them, and every page is erased once in `6 × pages`
//! saves. SPI flash lasts 100 000 erasures a sector (e.g. Winbond W25Q32JV, "Endurance"): a partition of 24 KiB, 6 pages,
//! takes 3.6 million saves, one every ten minutes for 68 years. A pairing takes 100 bytes, a gait 225. What is
//! equal to the stored is not written again.
//!
//! # When
//! Only with the bridge off: the chip runs from the same flash, and stands still while a page is erased (W25Q32JV: 45 ms,
//! at most 400 ms). The watchdog's period must be longer.

use core::ops::Range;

use control::ParameterError;
use embedded_storage_async::nor_flash::NorFlashErrorKind;
use postcard_schema::Schema;
use serde::Serialize;
use serde::de::DeserializeOwned;

mod ab_slots;
pub mod gait;
pub mod pairing;
pub mod parameters;
mod record;

/// Where in the flash what is kept, bytes: each four or more whole pages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Partitions {
    /// Partition of the parameters, bytes.
    pub parameters: Range<u32>,
    /// Partition of the pairing, bytes.
    pub pairing: Range<u32>,
    /// Partition of the gait, bytes.
    pub gait: Range<u32>,
}

/// Why something was not stored. What was there before still counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StoreError {
    /// No controller can run on it.
    Refused(ParameterError),
    /// The range is not two times two or more whole pages of the flash.
    Range,
    /// What the flash said.
    Flash(NorFlashErrorKind),
    /// What was written does not come back: the flash is worn out.
    NotKept,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Refused(why) => write!(f, "parameters refused: {why}"),
            Self::Range => f.write_str("the partition must be four or more whole pages of the flash"),
            Self::Flash(kind) => write!(f, "the flash failed: {kind}"),
            Self::NotKept => f.write_str("the flash does not keep what is written: it is worn out, replace the board"),
        }
    }
}

impl core::error::Error for StoreError {}

/// What a partition can keep: one type each.
trait Kept: Clone + PartialEq + Schema + Serialize + DeserializeOwned {
    /// Hashed with the schema: another where the meaning of a field changes, a unit say, but neither its name nor its type.
    const MEANING: &'static str;

    /// Whether the robot can run on it.
    fn is_sound(&self) -> bool;
}
