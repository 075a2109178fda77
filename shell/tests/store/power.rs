//! The power fails.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::nor_flash::{Flash, Operation};
use crate::{GAIT_PAGES, OfGait, OfPairing, OfParameters, PAGES, PAIRING_PAGES, Subject, factory};

#[derive(Debug, Default)]
struct Counts {
    in_write: u64,
    in_erase: u64,
    in_recovery: u64,
    old: u64,
    new: u64,
    saved_after: u64,
}

/// One history of saves and cuts, and then a save that is cut at every byte and every erase.
struct Sequence<'a, S: Subject, const PAGE: usize> {
    subject: &'a S,
    flash: Flash<PAGE>,
    /// What must be in the flash.
    current: Option<S::Kept>,
    random: Pcg64Mcg,
    counts: Counts,
}

/// Cuts that are tried in one erase, each with other remains.
const ERASE_CUTS: usize = 24;

impl<S: Subject, const PAGE: usize> Sequence<'_, S, PAGE> {
    /// The flash as a cut leaves it: `before` is as of the start of the operation.
    fn cut(&mut self, before: &Flash<PAGE>, operation: &Operation, whole: usize) -> Flash<PAGE> {
        let mut flash = before.clone();
        match operation {
            Operation::Write { offset, bytes } => flash.cut_write(*offset, bytes, whole, &mut self.random),
            Operation::Erase { offset } => flash.cut_erase(*offset, &mut self.random),
        }
        flash
    }

    /// The flash after a cut somewhere in what was done to `before`.
    fn cut_somewhere(&mut self, mut before: Flash<PAGE>, log: &[Operation]) -> Flash<PAGE> {
        let Some(at) = (0..log.len()).max_by_key(|_| self.random.next_u32()) else { return before };
        log[..at].iter().for_each(|operation| before.apply(operation));
        let whole = match &log[at] {
            Operation::Write { bytes, .. } => self.random.random_range(0..bytes.len()),
            Operation::Erase { .. } => 0,
        };
        self.cut(&before, &log[at], whole)
    }

    /// Loads, now and then with cuts in what loading repairs, and after that without.
    fn load(&mut self, flash: &mut Flash<PAGE>) -> Option<S::Kept> {
        for _ in 0..2 {
            let before = flash.clone();
            flash.take_log();
            let found = self.subject.stored(flash);
            let log = flash.take_log();
            if log.is_empty() || self.random.random() {
                assert_eq!(self.subject.stored(flash), found, "a second look");
                return found;
            }
            self.counts.in_recovery += 1;
            *flash = self.cut_somewhere(before, &log);
        }
        self.subject.stored(flash)
    }

    /// A save that is cut, or not.
    fn event(&mut self) {
        let next =
            self.random.random_bool(if S::FORGETS { 0.9 } else { 1.0 }).then(|| self.subject.another(&mut self.random));
        let before = self.flash.clone();
        self.flash.take_log();
        assert_eq!(self.subject.save(&mut self.flash, next.as_ref()), Ok(()));
        let log = self.flash.take_log();
        if self.random.random_bool(0.3) {
            let mut flash = self.cut_somewhere(before, &log);
            let found = self.load(&mut flash);
            assert!(found == self.current || found == next, "neither old nor new");
            self.flash = flash;
            self.current = found;
        } else {
            assert_eq!(self.subject.stored(&mut self.flash), next);
            self.current = next;
        }
    }

    fn run(&mut self) {
        for _ in 0..self.random.random_range(0..40) {
            self.event();
        }
        let next = Some(self.subject.another(&mut self.random));
        let mut flash = self.flash.clone();
        flash.take_log();
        assert_eq!(self.subject.save(&mut flash, next.as_ref()), Ok(()));
        let log = flash.take_log();

        let mut before = self.flash.clone();
        for operation in &log {
            let cuts = match operation {
                Operation::Write { bytes, .. } => bytes.len(),
                Operation::Erase { .. } => ERASE_CUTS,
            };
            for whole in 0..cuts {
                let flash = self.cut(&before, operation, whole);
                match operation {
                    Operation::Write { .. } => self.counts.in_write += 1,
                    Operation::Erase { .. } => self.counts.in_erase += 1,
                }
                self.recover(flash, &next);
            }
            before.apply(operation);
        }
    }

    /// After a cut. Now and then with another cut in the repair, and a save.
    fn recover(&mut self, mut flash: Flash<PAGE>, next: &Option<S::Kept>) {
        let thorough = self.random.random_bool(0.1);
        let found = if thorough { self.load(&mut flash) } else { self.subject.stored(&mut flash) };
        assert!(found == self.current || found == *next, "neither old nor new: {:?}", self.counts);
        if found == *next {
            self.counts.new += 1;
        } else {
            self.counts.old += 1;
        }
        if thorough {
            self.counts.saved_after += 1;
            let third = self.subject.another(&mut self.random);
            assert_eq!(self.subject.save(&mut flash, Some(&third)), Ok(()));
            assert_eq!(self.subject.stored(&mut flash), Some(third));
        }
    }
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.in_write += other.in_write;
        self.in_erase += other.in_erase;
        self.in_recovery += other.in_recovery;
        self.old += other.old;
        self.new += other.new;
        self.saved_after += other.saved_after;
    }
}

/// One sequence a seed, in as many threads as the machine has.
fn campaign<const PAGE: usize>(subject: &impl Subject, pages: usize, seeds: Range<u64>) -> Counts {
    let (next, total) = (AtomicU64::new(seeds.start), Mutex::new(Counts::default()));
    let work = || {
        while let seed = next.fetch_add(1, Ordering::Relaxed)
            && seed < seeds.end
        {
            let mut sequence = Sequence::<_, PAGE> {
                subject,
                flash: Flash::blank(pages),
                current: None,
                random: Pcg64Mcg::seed_from_u64(seed),
                counts: Counts::default(),
            };
            sequence.run();
            *total.lock().expect("no thread failed") += sequence.counts;
        }
    };
    std::thread::scope(|scope| {
        (0..std::thread::available_parallelism().map_or(1, usize::from)).for_each(|_| drop(scope.spawn(work)));
    });
    total.into_inner().expect("no thread failed")
}

fn tell(what: &str, counts: &Counts) {
    let Counts { in_write, in_erase, in_recovery, old, new, saved_after } = counts;
    println!(
        "1000 sequences, power cut in {in_write} places of writes, {in_erase} of erases, {in_recovery} of repairs: \
         old {what} {old} times, new {what} {new} times, never lost, never half-new; next save tried {saved_after} times"
    );
    assert_eq!(in_write + in_erase, old + new);
    assert!(*old > 0 && *new > 0);
}

/// Most sequences run on pages that hold a single record, so that almost every save erases one.
#[test]
fn a_power_cut_at_every_byte_of_a_write_leaves_the_old_set_or_the_new_one() {
    let subject = OfParameters(factory());
    let mut counts = campaign::<4096>(&subject, PAGES, 0..100);
    counts += campaign::<1024>(&subject, PAGES, 100..900);
    counts += campaign::<1024>(&subject, 4, 900..1000);
    tell("set", &counts);
    assert!(counts.in_write > 500_000 && counts.in_erase > 10_000 && counts.in_recovery > 20);
}

/// Pages of 256 bytes hold two pairings.
#[test]
fn a_power_cut_at_every_byte_of_a_write_leaves_the_old_pairing_or_the_new_one() {
    let mut counts = campaign::<4096>(&OfPairing, PAIRING_PAGES, 0..100);
    counts += campaign::<256>(&OfPairing, PAIRING_PAGES, 100..1000);
    tell("pairing", &counts);
    assert!(counts.in_write > 100_000 && counts.in_erase > 10_000 && counts.in_recovery > 20);
}

/// Pages of 512 bytes hold one gait.
#[test]
fn a_power_cut_at_every_byte_of_a_write_leaves_the_old_gait_or_the_new_one() {
    let mut counts = campaign::<4096>(&OfGait, GAIT_PAGES, 0..100);
    counts += campaign::<512>(&OfGait, GAIT_PAGES, 100..1000);
    tell("gait", &counts);
    assert!(counts.in_write > 100_000 && counts.in_erase > 10_000 && counts.in_recovery > 20);
}
