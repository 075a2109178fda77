//! How long the flash lasts.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::{Chip, PAGES, another, factory, save};

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
