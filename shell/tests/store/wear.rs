//! How long the flash lasts.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::nor_flash::Operation;
use crate::{Chip, OfPairing, OfParameters, PAGES, PAIRING_PAGES, Subject, another, factory, save};

/// SPI NOR flash, erasures a sector (Winbond W25Q32JV, "Endurance").
const ENDURANCE: u32 = 100_000;

#[test]
fn the_partition_lasts_for_millions_of_saves() {
    let (factory, mut flash, mut random) = (factory(), Chip::blank(PAGES), Pcg64Mcg::seed_from_u64(7));
    const SAVES: u32 = 5000;
    for _ in 0..SAVES {
        assert_eq!(save(&mut flash, &factory, Some(&another(&factory, &mut random))), Ok(()));
        flash.take_log();
    }
    let most = *flash.erasures.iter().max().expect("pages");
    let lasts = u64::from(SAVES) * u64::from(ENDURANCE) / u64::from(most);
    println!("{SAVES} saves erased the pages {:?} times: {PAGES} pages last {lasts} saves", flash.erasures);
    assert!(flash.erasures.iter().all(|times| times.abs_diff(most) <= 1), "worn unevenly");
    assert!(lasts > 3_000_000);
}

#[test]
fn the_stored_set_is_not_written_again() {
    let (factory, mut flash) = (factory(), Chip::blank(PAGES));
    assert_eq!(save(&mut flash, &factory, Some(&factory)), Ok(()));
    flash.take_log();
    assert_eq!(save(&mut flash, &factory, Some(&factory)), Ok(()));
    assert!(flash.log.is_empty());
}

/// Bytes that are written when a page is begun already: a record.
fn record(subject: &impl Subject, pages: usize) -> usize {
    let (mut flash, mut random) = (Chip::blank(pages), Pcg64Mcg::seed_from_u64(9));
    for _ in 0..4 {
        flash.take_log();
        assert_eq!(subject.save(&mut flash, Some(&subject.another(&mut random))), Ok(()));
    }
    let written = flash.take_log().into_iter();
    written.map(|done| if let Operation::Write { bytes, .. } = done { bytes.len() } else { 0 }).sum()
}

#[test]
fn several_records_fit_a_page() {
    let records = [record(&OfParameters(factory()), PAGES), record(&OfPairing, PAIRING_PAGES)];
    println!("bytes in flash: {} for parameters, {} for a pairing", records[0], records[1]);
    assert!(records[0] <= 640 && records[1] <= 120, "{records:?}: shell/src/store.rs tells how long the flash lasts");
}
