//! Flash that holds something else than a set, or nothing, or fails.

use control::Parameters;
use control::protocol::radio::Source;
use crc::{CRC_32_ISO_HDLC, Crc};
use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlashErrorKind;
use postcard_schema::key::Key;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};
use shell::store::{self, StoreError};

use crate::{Chip, PAGES, another, factory, load, save, stored};

/// The store works: what is saved now comes back.
fn usable(flash: &mut Chip, factory: &Parameters, random: &mut impl Rng) {
    for _ in 0..3 {
        let set = another(factory, random);
        assert_eq!(save(flash, factory, Some(&set)), Ok(()));
        assert_eq!(load(flash, factory), (set, Source::Stored));
    }
}

#[test]
fn a_blank_flash_gives_the_factory_set() {
    let (factory, mut flash) = (factory(), Chip::blank(PAGES));
    assert_eq!(load(&mut flash, &factory), (factory, Source::Factory));
    assert!(flash.log.is_empty());
    usable(&mut flash, &factory, &mut Pcg64Mcg::seed_from_u64(0));
}

#[test]
fn a_reset_brings_the_factory_set_back() {
    let (factory, mut flash, mut random) = (factory(), Chip::blank(PAGES), Pcg64Mcg::seed_from_u64(1));
    for _ in 0..100 {
        usable(&mut flash, &factory, &mut random);
        assert_eq!(save(&mut flash, &factory, None), Ok(()));
        assert_eq!(load(&mut flash, &factory), (factory, Source::Factory));
    }
}

#[test]
fn rubbish_gives_the_factory_set_and_the_store_is_usable() {
    let factory = factory();
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for kind in 0..2000 {
        let mut flash = Chip::blank(PAGES);
        match kind {
            0 => flash.bytes.fill(0),
            1 => flash.bytes.fill(0x55),
            // Page marks as the library writes them, and anything between.
            _ if kind % 2 == 0 => {
                random.fill_bytes(&mut flash.bytes);
                for page in flash.bytes.chunks_mut(4096) {
                    let marks = random.random_range(0..4);
                    page[..4].fill(if marks & 1 == 0 { 0 } else { 0xFF });
                    page[4092..].fill(if marks & 2 == 0 { 0 } else { 0xFF });
                }
            }
            _ => random.fill_bytes(&mut flash.bytes),
        }
        assert_eq!(load(&mut flash, &factory), (factory, Source::FactoryDamaged), "kind {kind}");
        usable(&mut flash, &factory, &mut random);
    }
}

#[test]
fn damage_anywhere_gives_a_set_that_was_saved_or_the_factory_set() {
    let factory = factory();
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let (mut flash, mut saved) = (Chip::blank(PAGES), Vec::new());
    for _ in 0..2000 {
        for _ in 0..random.random_range(1..4) {
            saved.push(another(&factory, &mut random));
            assert_eq!(save(&mut flash, &factory, saved.last()), Ok(()));
        }
        let mut damaged = flash.clone();
        for _ in 0..random.random_range(1..5) {
            let start = random.random_range(0..damaged.bytes.len());
            let end = (start + random.random_range(1..3000)).min(damaged.bytes.len());
            random.fill_bytes(&mut damaged.bytes[start..end]);
        }
        if let Some(found) = stored(&mut damaged, &factory) {
            assert!(saved.contains(&found));
        }
        usable(&mut damaged, &factory, &mut random);
    }
}

/// Puts a record into the flash that the library finds in order.
fn put(flash: &mut Chip, layout: u64, factory: u32, body: &[u8], wrong_crc: u32) {
    let mut record = [&layout.to_le_bytes()[..], &factory.to_le_bytes(), &7u32.to_le_bytes(), body].concat();
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&record) ^ wrong_crc;
    record.extend(crc.to_le_bytes());
    let half = 0..flash.range().end / 2;
    let mut map = MapStorage::new(flash, MapConfig::new(half), Cache::new_uncached());
    block_on(map.store_item(&mut [0; 4096], &(), &record.as_slice())).expect("a good flash");
}

#[test]
fn records_that_are_no_set_are_told_apart() {
    let factory = factory();
    let own = u64::from_le_bytes(Key::for_path::<Parameters>("parameters, 1").to_bytes());
    let mut bytes = [0; 2048];
    let good = postcard::to_slice(&factory, &mut bytes).expect("short").to_vec();
    let built_in = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&good);
    let nan = Parameters { tick: f32::NAN, ..factory };
    let refused = postcard::to_slice(&nan, &mut bytes).expect("short").to_vec();
    let long = [&good[..], &[0]].concat();
    let cases: [(u64, u32, &[u8], u32, Source); 11] = [
        (own, built_in, &good, 0, Source::Stored),
        (own ^ 1, built_in, &good, 0, Source::FactoryOtherVersion),
        (own ^ 1, built_in, &good[1..], 0, Source::FactoryOtherVersion),
        (own, built_in ^ 1, &good, 0, Source::FactoryOtherVersion),
        (own, built_in ^ 1, &refused, 0, Source::FactoryOtherVersion),
        (own, built_in, &good, 1, Source::FactoryDamaged),
        (own, built_in, &refused, 0, Source::FactoryDamaged),
        (own, built_in, &good[..good.len() - 1], 0, Source::FactoryDamaged),
        (own, built_in, &long, 0, Source::FactoryDamaged),
        (own, built_in, &[], 0, Source::Factory),
        (own, built_in ^ 1, &[], 0, Source::Factory),
    ];
    for (index, (layout, built_in, body, wrong_crc, source)) in cases.into_iter().enumerate() {
        let mut flash = Chip::blank(PAGES);
        put(&mut flash, layout, built_in, body, wrong_crc);
        assert_eq!(load(&mut flash, &factory), (factory, source), "case {index}");
        usable(&mut flash, &factory, &mut Pcg64Mcg::seed_from_u64(4));
    }
}

#[test]
fn a_set_does_not_outlive_the_firmware_that_stored_it() {
    let (old, mut flash, mut random) = (factory(), Chip::blank(PAGES), Pcg64Mcg::seed_from_u64(8));
    let stored = another(&old, &mut random);
    assert_eq!(save(&mut flash, &old, Some(&stored)), Ok(()));
    // Calibrated, built and flashed anew: the partition of the parameters stays as it is.
    let mut new = old;
    new.sensor.harmonics[0].cos += 0.01;
    assert_eq!(load(&mut flash, &new), (new, Source::FactoryOtherVersion));
    // The same set again is another record now, and the old firmware's no longer.
    assert_eq!(save(&mut flash, &new, Some(&stored)), Ok(()));
    assert_eq!(load(&mut flash, &new), (stored, Source::Stored));
    assert_eq!(load(&mut flash, &old), (old, Source::FactoryOtherVersion));
}

#[test]
fn what_no_controller_can_run_on_is_not_saved() {
    let (factory, mut flash) = (factory(), Chip::blank(PAGES));
    let good = another(&factory, &mut Pcg64Mcg::seed_from_u64(5));
    assert_eq!(save(&mut flash, &factory, Some(&good)), Ok(()));
    let bad = Parameters { tick: -1.0, ..factory };
    assert!(matches!(save(&mut flash, &factory, Some(&bad)), Err(StoreError::Refused(_))));
    assert_eq!(load(&mut flash, &factory), (good, Source::Stored));
}

#[test]
fn a_failing_or_worn_flash_is_told() {
    let (factory, mut flash) = (factory(), Chip::blank(PAGES));
    let mut random = Pcg64Mcg::seed_from_u64(6);
    let old = another(&factory, &mut random);
    assert_eq!(save(&mut flash, &factory, Some(&old)), Ok(()));
    flash.worn = true;
    assert_eq!(save(&mut flash, &factory, Some(&another(&factory, &mut random))), Err(StoreError::NotKept));
    assert_eq!(load(&mut flash, &factory), (old, Source::Stored));
    flash.failing = true;
    assert_eq!(save(&mut flash, &factory, Some(&factory)), Err(StoreError::Flash(NorFlashErrorKind::Other)));
    assert_eq!(load(&mut flash, &factory), (factory, Source::FactoryDamaged));
}

#[test]
fn a_range_that_is_not_whole_pages_is_refused() {
    let (factory, mut flash) = (factory(), Chip::blank(PAGES));
    let backwards = std::ops::Range { start: 8192, end: 4096 };
    for range in [0..0, 0..4096, 0..3 * 4096, 0..4 * 4096 + 4, 4..4 * 4096 + 4, backwards] {
        assert_eq!(
            block_on(store::parameters::save(&mut flash, range.clone(), &factory, &factory)),
            Err(StoreError::Range),
            "{range:?}"
        );
        assert_eq!(block_on(store::parameters::load(&mut flash, range, &factory)), (factory, Source::FactoryDamaged));
    }
    assert!(flash.log.is_empty());
    for range in [0..4 * 4096, 4096..6 * 4096] {
        assert_eq!(block_on(store::parameters::save(&mut flash, range, &factory, &factory)), Ok(()));
    }
}
