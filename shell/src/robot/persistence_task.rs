//! The task that owns the flash.

use control::Parameters;
use embedded_storage_async::nor_flash::NorFlash;

use super::Shared;
use super::shared::Work;
use crate::store::{Partitions, gait, pairing, parameters};

/// Does what the control loop and [`pair`](super::pair) hand over, one thing at a time, and says whether the flash kept it.
///
/// The chip stands still while a page is erased. Work is taken only with the motor off, and until it is done nothing new is
/// obeyed; stopping is nothing new.
pub async fn persistence_task<F: NorFlash>(
    mut flash: F,
    partitions: &Partitions,
    factory: &Parameters,
    shared: &Shared,
) -> ! {
    let flash = &mut flash;
    loop {
        let (kept, answer) = match shared.work.receive().await {
            Work::Save => {
                // It is there: it was taken before this was handed over.
                let set = shared.set().unwrap_or(*factory);
                (parameters::save(flash, partitions.parameters.clone(), factory, &set).await, &shared.saved)
            }
            Work::Factory => (parameters::reset(flash, partitions.parameters.clone()).await, &shared.saved),
            Work::KeepGait(kept) => (gait::save(flash, partitions.gait.clone(), &kept).await, &shared.saved),
            Work::Pair(Some(pairing)) => {
                (pairing::save(flash, partitions.pairing.clone(), &pairing).await, &shared.paired)
            }
            Work::Pair(None) => (pairing::forget(flash, partitions.pairing.clone()).await, &shared.paired),
        };
        shared.finish();
        answer.signal(kept.is_ok());
    }
}
