//! Whom the robot obeys.
//!
//! A pairing that was replaced or forgotten counts no more, but its keys stay in the flash until their page is erased some
//! saves later. Whoever can read the flash holds the robot in their hands, and can pair it anew as well.

use core::ops::Range;

pub use control::protocol::pairing::Pairing;
use embedded_storage_async::nor_flash::NorFlash;

use super::ab_slots::{Found, find, store};
use super::record::{Contents, Record};
use super::{Kept, StoreError};

impl Kept for Pairing {
    const MEANING: &'static str = "pairing, 1";

    fn is_sound(&self) -> bool {
        true
    }
}

/// Why a robot obeys nobody.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unpaired {
    /// It never was paired, or has forgotten its console.
    Nobody,
    /// A firmware with other pairings kept it.
    OtherVersion,
    /// The flash has no such partition, failed, or holds something else.
    Damaged,
}

impl core::fmt::Display for Unpaired {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Nobody => "paired with nobody",
            Self::OtherVersion => "the pairing was kept by another version of the firmware",
            Self::Damaged => "the pairing cannot be read",
        })
    }
}

impl core::error::Error for Unpaired {}

/// The stored pairing. The store is usable afterwards, whatever is in the flash.
///
/// # Errors
/// There is none: see [`Unpaired`].
pub async fn load<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<Pairing, Unpaired> {
    match find(flash, range).await {
        Found::Record(Record { contents: Contents::Stored(pairing), .. }) => Ok(pairing),
        Found::Record(Record { contents: Contents::Nothing, .. }) | Found::Blank => Err(Unpaired::Nobody),
        Found::Record(Record { contents: Contents::OtherVersion, .. }) => Err(Unpaired::OtherVersion),
        Found::Record(Record { contents: Contents::Refused, .. }) | Found::Damaged => Err(Unpaired::Damaged),
    }
}

/// Stores a pairing in place of the one before. Interrupted at any point, [`load`] gives the old one or this.
///
/// # Errors
/// See [`StoreError`].
pub async fn save<F: NorFlash>(flash: &mut F, range: Range<u32>, pairing: &Pairing) -> Result<(), StoreError> {
    // A pairing is right beside whatever firmware.
    store(flash, &range, 0, Contents::Stored(pairing.clone())).await
}

/// Lets the robot obey nobody.
///
/// # Errors
/// See [`StoreError`].
pub async fn forget<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<(), StoreError> {
    store::<Pairing, F>(flash, &range, 0, Contents::Nothing).await
}
