//! The controller's parameters, where a person has changed them.
//!
//! The origin of a record is the CRC-32 of the set that was built in when it was stored: a stored set corrects that one,
//! and beside another robot's, or the same one's after a calibration, it would be wrong.

use core::ops::Range;

pub use control::Parameters;
use control::protocol::radio::Source;
use embedded_storage_async::nor_flash::NorFlash;

use super::ab_slots::{Found, find, store};
use super::record::{Buffer, CRC, Contents, Record};
use super::{Kept, StoreError};

impl Kept for Parameters {
    const MEANING: &'static str = "parameters, 1";

    fn is_sound(&self) -> bool {
        self.check().is_ok()
    }
}

/// The stored parameters, or else the factory's, and why. The store is usable afterwards, whatever is in the flash.
pub async fn load<F: NorFlash>(flash: &mut F, range: Range<u32>, factory: &Parameters) -> (Parameters, Source) {
    let source = match find(flash, range).await {
        Found::Record(Record { origin, contents, .. }) => match contents {
            Contents::Stored(_) | Contents::Refused if origin != checksum(factory) => Source::FactoryOtherVersion,
            Contents::Stored(parameters) => return (parameters, Source::Stored),
            Contents::Nothing => Source::Factory,
            Contents::OtherVersion => Source::FactoryOtherVersion,
            Contents::Refused => Source::FactoryDamaged,
        },
        Found::Blank => Source::Factory,
        Found::Damaged => Source::FactoryDamaged,
    };
    (*factory, source)
}

/// Stores a set in place of the factory's. Interrupted at any point, [`load`] gives the old set or this one.
///
/// # Errors
/// See [`StoreError`].
pub async fn save<F: NorFlash>(
    flash: &mut F,
    range: Range<u32>,
    factory: &Parameters,
    parameters: &Parameters,
) -> Result<(), StoreError> {
    parameters.check().map_err(StoreError::Refused)?;
    store(flash, &range, checksum(factory), Contents::Stored(*parameters)).await
}

/// Lets the factory's parameters count again.
///
/// # Errors
/// See [`StoreError`].
pub async fn reset<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<(), StoreError> {
    // Whichever set that is.
    store::<Parameters, F>(flash, &range, 0, Contents::Nothing).await
}

/// CRC-32 of a set.
fn checksum(parameters: &Parameters) -> u32 {
    let mut buffer = Buffer::default();
    // There is room: see `Buffer`.
    postcard::to_slice(parameters, &mut buffer.0).map_or(0, |bytes| CRC.checksum(bytes))
}
