//! The gait in flash.

use control::Gait;
use embassy_futures::block_on;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use shell::store::gait::{load, save};
use shell::store::{StoreError, pairing, parameters};

use crate::{Chip, GAIT_PAGES, another, another_gait, another_pairing, factory};

fn chip() -> (Chip, std::ops::Range<u32>) {
    let flash = Chip::blank(GAIT_PAGES);
    let range = flash.range();
    (flash, range)
}

#[test]
fn a_gait_is_kept_until_another_takes_its_place() {
    let ((mut flash, range), mut random) = (chip(), Pcg64Mcg::seed_from_u64(30));
    assert_eq!(block_on(load(&mut flash, range.clone())), None);
    for _ in 0..200 {
        let gait = another_gait(&mut random);
        assert_eq!(block_on(save(&mut flash, range.clone(), &gait)), Ok(()));
        assert_eq!(block_on(load(&mut flash, range.clone())), Some(gait));
        flash.take_log();
        assert_eq!(block_on(save(&mut flash, range.clone(), &gait)), Ok(()));
        assert!(flash.take_log().is_empty(), "the same one again is not written");
    }
}

#[test]
fn rubbish_other_records_and_what_cannot_be_played_are_no_gait() {
    let ((mut flash, range), mut random) = (chip(), Pcg64Mcg::seed_from_u64(31));
    let gait = another_gait(&mut random);
    for _ in 0..300 {
        random.fill_bytes(&mut flash.bytes);
        assert_eq!(block_on(load(&mut flash, range.clone())), None);
        assert_eq!(block_on(save(&mut flash, range.clone(), &gait)), Ok(()));
        assert_eq!(block_on(load(&mut flash, range.clone())), Some(gait));
    }
    // Intact records of other layouts.
    let (factory, pairing) = (factory(), another_pairing(&mut random));
    let set = another(&factory, &mut random);
    assert_eq!(block_on(parameters::save(&mut flash, range.clone(), &factory, &set)), Ok(()));
    assert_eq!(block_on(load(&mut flash, range.clone())), None);
    assert_eq!(block_on(pairing::save(&mut flash, range.clone(), &pairing)), Ok(()));
    assert_eq!(block_on(load(&mut flash, range.clone())), None);
    // An intact record of a gait whose only step is beyond its table, as no `Gait::new` makes it.
    let mut bytes = postcard::to_slice(&gait, &mut [0; 300]).expect("it fits").to_vec();
    let last_step = bytes.len() - 2;
    let speed_count = 12 + 4 * 16;
    (bytes[speed_count], bytes[last_step]) = (1, 0xFF);
    let beyond: Gait = postcard::from_bytes(&bytes).expect("a message");
    if beyond.check_form().is_err() {
        assert_eq!(block_on(save(&mut flash, range.clone(), &beyond)), Err(StoreError::NotKept));
        assert_eq!(block_on(load(&mut flash, range)), None);
    } else {
        panic!("{beyond:?} can be played");
    }
}

#[test]
fn a_partition_that_is_missing_or_fails_keeps_nothing() {
    let ((mut flash, range), mut random) = (chip(), Pcg64Mcg::seed_from_u64(32));
    let (old, new) = (another_gait(&mut random), another_gait(&mut random));
    assert_eq!(block_on(load(&mut flash, 0..0)), None);
    assert_eq!(block_on(save(&mut flash, 0..0, &old)), Err(StoreError::Range));
    assert_eq!(block_on(save(&mut flash, range.clone(), &old)), Ok(()));
    flash.worn = true;
    assert_eq!(block_on(save(&mut flash, range.clone(), &new)), Err(StoreError::NotKept));
    assert_eq!(block_on(load(&mut flash, range.clone())), Some(old));
    flash.failing = true;
    assert!(matches!(block_on(save(&mut flash, range.clone(), &new)), Err(StoreError::Flash(_))));
    assert_eq!(block_on(load(&mut flash, range)), None);
}
