//! The pairing in flash.

use embassy_futures::block_on;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use shell::store::pairing::{Unpaired, forget, load, save};
use shell::store::{StoreError, parameters};

use crate::{Chip, PAIRING_PAGES, another, another_pairing, factory};

fn chip() -> (Chip, std::ops::Range<u32>) {
    let flash = Chip::blank(PAIRING_PAGES);
    let range = flash.range();
    (flash, range)
}

#[test]
fn a_pairing_is_kept_until_another_or_none_takes_its_place() {
    let ((mut flash, range), mut random) = (chip(), Pcg64Mcg::seed_from_u64(20));
    assert_eq!(block_on(load(&mut flash, range.clone())), Err(Unpaired::Nobody));
    for _ in 0..200 {
        let pairing = another_pairing(&mut random);
        assert_eq!(block_on(save(&mut flash, range.clone(), &pairing)), Ok(()));
        assert_eq!(block_on(load(&mut flash, range.clone())), Ok(pairing));
        if random.random_bool(0.3) {
            assert_eq!(block_on(forget(&mut flash, range.clone())), Ok(()));
            assert_eq!(block_on(load(&mut flash, range.clone())), Err(Unpaired::Nobody));
        }
    }
}

#[test]
fn rubbish_and_what_is_no_pairing_pair_nobody() {
    let ((mut flash, range), mut random) = (chip(), Pcg64Mcg::seed_from_u64(21));
    let pairing = another_pairing(&mut random);
    for _ in 0..500 {
        random.fill_bytes(&mut flash.bytes);
        assert_eq!(block_on(load(&mut flash, range.clone())), Err(Unpaired::Damaged));
        assert_eq!(block_on(save(&mut flash, range.clone(), &pairing)), Ok(()));
        assert_eq!(block_on(load(&mut flash, range.clone())), Ok(pairing.clone()));
    }
    // Parameters in the wrong partition are an intact record of another layout.
    let (mut flash, range) = chip();
    let factory = factory();
    let set = another(&factory, &mut random);
    assert_eq!(block_on(parameters::save(&mut flash, range.clone(), &factory, &set)), Ok(()));
    assert_eq!(block_on(load(&mut flash, range)), Err(Unpaired::OtherVersion));
}

#[test]
fn a_partition_that_is_missing_pairs_nobody_and_keeps_nothing() {
    let ((mut flash, _), mut random) = (chip(), Pcg64Mcg::seed_from_u64(22));
    assert_eq!(block_on(load(&mut flash, 0..0)), Err(Unpaired::Damaged));
    assert_eq!(block_on(save(&mut flash, 0..0, &another_pairing(&mut random))), Err(StoreError::Range));
}

#[test]
fn a_failing_or_worn_flash_is_told() {
    let ((mut flash, range), mut random) = (chip(), Pcg64Mcg::seed_from_u64(23));
    let old = another_pairing(&mut random);
    assert_eq!(block_on(save(&mut flash, range.clone(), &old)), Ok(()));
    flash.worn = true;
    let new = another_pairing(&mut random);
    assert_eq!(block_on(save(&mut flash, range.clone(), &new)), Err(StoreError::NotKept));
    assert_eq!(block_on(load(&mut flash, range.clone())), Ok(old));
    flash.failing = true;
    assert!(matches!(block_on(save(&mut flash, range.clone(), &new)), Err(StoreError::Flash(_))));
    assert_eq!(block_on(load(&mut flash, range)), Err(Unpaired::Damaged));
}

#[test]
fn keys_are_not_printed() {
    let mut random = Pcg64Mcg::seed_from_u64(24);
    let pairing = another_pairing(&mut random);
    let printed = format!("{pairing:?} {:?}", Ok::<_, Unpaired>(&pairing));
    for key in [&pairing.primary[..], &pairing.local, &pairing.key.0] {
        for pair in key.windows(2) {
            let [a, b] = pair else { continue };
            for text in [format!("{a:02x}{b:02x}"), format!("{a:02x}, {b:02x}"), format!("{a}, {b}")] {
                assert!(!printed.contains(&text), "{printed}");
            }
        }
    }
}
