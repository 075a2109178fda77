//! The learned gait that the robot plays.
//!
//! A gait is right beside whatever firmware and parameters: the controller says whether its robot can play it.

use core::ops::Range;

pub use control::Gait;
use embedded_storage_async::nor_flash::NorFlash;

use super::ab_slots::{Found, find, store};
use super::record::{Contents, Record};
use super::{Kept, StoreError};

impl Kept for Gait {
    const MEANING: &'static str = "gait, 1";

    fn is_sound(&self) -> bool {
        self.check_form().is_ok()
    }
}

/// The stored gait; `None` where none was ever stored, where another version of the firmware stored it, and where nothing can be
/// read. The store is usable afterwards, whatever is in the flash.
pub async fn load<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Option<Gait> {
    match find(flash, range).await {
        Found::Record(Record { contents: Contents::Stored(gait), .. }) => Some(gait),
        Found::Record(_) | Found::Blank | Found::Damaged => None,
    }
}

/// Stores a gait in place of the one before. Interrupted at any point, [`load`] gives the old one or this.
///
/// # Errors
/// See [`StoreError`].
pub async fn save<F: NorFlash>(flash: &mut F, range: Range<u32>, gait: &Gait) -> Result<(), StoreError> {
    store(flash, &range, 0, Contents::Stored(*gait)).await
}
