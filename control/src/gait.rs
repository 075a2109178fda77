//! A learned gait: a sequence of shaft speeds and oscillations, each held for one interval, that the controller plays by itself.
//!
//! It is small enough for one radio frame: the motions that occur are in a table of at most [`MOST_NUMBERS`] numbers, one a speed and
//! two an oscillation, and a step is an index into them, two steps a byte. The controller holds each step's speed as that of
//! [`Command::Speed`], and swings as for [`Command::Oscillate`]. Time is counted in
//! control periods, so that no step is longer or shorter than another.

use core::num::NonZeroU32;

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::command::{Command, Field, Refusal, Stroke, within};
use crate::parameters::Limits;

/// Most steps of a gait. With them, the largest table and the longest name it still fits one frame (tested in `radio`).
pub const MOST_STEPS: usize = 2 * ROWS * ROW_BYTES;
/// Most numbers in a gait's table, one for each speed and two for each oscillation: no more than an index of four bits tells apart.
pub const MOST_NUMBERS: usize = 16;
/// Longest name of a gait, bytes.
pub const LONGEST_NAME: usize = 12;
/// Shortest interval, ms: no shaft follows a shorter one.
pub const SHORTEST_INTERVAL_MS: u16 = 10;
/// Longest interval, ms.
pub const LONGEST_INTERVAL_MS: u16 = 2000;

/// Arrays of more than 32 bytes are not serialised: the packed steps lie in rows.
const ROWS: usize = 5;
const ROW_BYTES: usize = 25;
/// Part of a control period by which an interval may miss a whole number of them: what single precision leaves.
const UNEVEN: f32 = 1e-3;

const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Name of a gait: 1 to [`LONGEST_NAME`] of `a-z`, `A-Z`, `0-9`, `-`, `_` and `.`.
#[derive(Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Name([u8; LONGEST_NAME]);

impl Name {
    /// The name, where it is one.
    #[must_use]
    pub fn new(text: &str) -> Option<Self> {
        let mut bytes = [0; LONGEST_NAME];
        bytes.get_mut(..text.len())?.copy_from_slice(text.as_bytes());
        Some(Self(bytes)).filter(|name| name.is_sound() && name.as_str().len() == text.len())
    }

    /// The text; empty where what was received is no name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let bytes = self.0.split(|byte| *byte == 0).next().unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }

    fn is_sound(&self) -> bool {
        let text = self.as_str();
        let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        // Nothing may follow the end: equal names are equal bytes.
        let rest = self.0.iter().skip(text.len());
        !text.is_empty() && text.bytes().all(is_allowed) && rest.copied().all(|byte| byte == 0)
    }
}

impl core::fmt::Debug for Name {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.as_str().fmt(f)
    }
}

impl core::fmt::Display for Name {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.as_str())
    }
}

/// Which gait a robot has stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct GaitLabel {
    /// Its name, for people.
    pub name: Name,
    /// [`Gait::id`].
    pub id: u32,
}

/// What the shaft does for a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// It turns at this speed, rad/s, counter-clockwise positive.
    Speed(f32),
    /// It swings between two angles, rad, counter-clockwise positive.
    Oscillation {
        /// Lower turning point, rad.
        from: f32,
        /// Upper turning point, rad.
        to: f32,
    },
}

impl Motion {
    /// The command that orders the same.
    #[must_use]
    pub fn command(self) -> Command {
        match self {
            Self::Speed(omega) => Command::Speed { omega },
            Self::Oscillation { from, to } => Command::Oscillate { from, to, style: Stroke::BangBang },
        }
    }
}

/// A sequence of motions of the shaft. What comes from outside may hold anything: [`Gait::check`] tells whether it can be played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Gait {
    name: Name,
    /// The speeds, rad/s, counter-clockwise positive; behind them the turning points of each oscillation, rad; zeros behind the last.
    table: [f32; MOST_NUMBERS],
    speed_count: u8,
    interval_ms: u16,
    repeats: bool,
    step_count: u8,
    /// Indices of motions, speeds before oscillations, the first of two steps in a byte's lower half; zeros behind the last.
    steps: [[u8; ROW_BYTES]; ROWS],
    oscillation_count: u8,
}

impl Gait {
    /// A gait with these speeds (rad/s, counter-clockwise positive) and oscillations (between two angles, rad), each step an index into
    /// the two, speeds first, held for `interval_ms`.
    ///
    /// # Errors
    /// What is wrong with it whatever the robot: see [`Gait::check`] for the rest.
    pub fn new(
        name: Name,
        speeds: &[f32],
        oscillations: &[[f32; 2]],
        steps: &[u8],
        interval_ms: u16,
        repeats: bool,
    ) -> Result<Self, Refusal> {
        let step_count = count(Field::GaitSteps, steps.len(), MOST_STEPS)?;
        count(Field::GaitTable, numbers(speeds.len(), oscillations.len()), MOST_NUMBERS)?;
        let mut gait = Self {
            name,
            step_count,
            speed_count: u8::try_from(speeds.len()).unwrap_or(u8::MAX),
            oscillation_count: u8::try_from(oscillations.len()).unwrap_or(u8::MAX),
            interval_ms,
            repeats,
            table: [0.0; MOST_NUMBERS],
            steps: [[0; ROW_BYTES]; ROWS],
        };
        let numbers = speeds.iter().chain(oscillations.as_flattened());
        gait.table.iter_mut().zip(numbers).for_each(|(place, number)| *place = *number);
        // One of more than four bits would spill into its neighbour's half.
        steps.iter().try_for_each(|index| gait.check_index(*index))?;
        for (place, pair) in gait.steps.as_flattened_mut().iter_mut().zip(steps.chunks(2)) {
            let (first, second) = (pair.first().copied().unwrap_or(0), pair.get(1).copied().unwrap_or(0));
            *place = first | second << 4;
        }
        gait.check_form().map(|()| gait)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> Name {
        self.name
    }

    /// The motions that occur, speeds before oscillations.
    pub fn motions(&self) -> impl Iterator<Item = Motion> + '_ {
        let (speeds, rest) = self.table.split_at_checked(self.speed_count.into()).unwrap_or((&self.table, &[]));
        let (pairs, _) = rest.as_chunks();
        let oscillations = pairs.iter().take(self.oscillation_count.into());
        let oscillations = oscillations.map(|&[from, to]| Motion::Oscillation { from, to });
        speeds.iter().copied().map(Motion::Speed).chain(oscillations)
    }

    /// Motion of each step in turn, as an index into [`Gait::motions`].
    pub fn steps(&self) -> impl ExactSizeIterator<Item = u8> + '_ {
        (0..self.step_count).map(|step| self.index(step))
    }

    /// How long each step is held, ms.
    #[must_use]
    pub fn interval_ms(&self) -> u16 {
        self.interval_ms
    }

    /// It begins again after its last step, until something else is commanded.
    #[must_use]
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// CRC-32 of everything in it: says whether two are the same one.
    #[must_use]
    pub fn id(&self) -> u32 {
        let mut digest = CRC.digest();
        digest.update(&self.name.0);
        self.table.iter().for_each(|number| digest.update(&number.to_le_bytes()));
        digest.update(&self.interval_ms.to_le_bytes());
        digest.update(&[self.speed_count, self.oscillation_count, u8::from(self.repeats), self.step_count]);
        digest.update(self.steps.as_flattened());
        digest.finalize()
    }

    /// Name and id.
    #[must_use]
    pub fn label(&self) -> GaitLabel {
        GaitLabel { name: self.name, id: self.id() }
    }

    fn index(&self, step: u8) -> u8 {
        let pair = self.steps.as_flattened().get(usize::from(step / 2)).copied().unwrap_or(0);
        if step.is_multiple_of(2) { pair & 0x0F } else { pair >> 4 }
    }

    fn check_index(&self, index: u8) -> Result<(), Refusal> {
        let motions = f32::from(self.speed_count) + f32::from(self.oscillation_count);
        within(Field::GaitStep, index.into(), 0.0, motions - 1.0)
    }

    /// Refuses what no robot can play: no name, no step, too many, an index beyond the table, an interval out of range, and a speed
    /// or an angle that is no number.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check_form(&self) -> Result<(), Refusal> {
        if !self.name.is_sound() {
            return Err(Refusal::GaitName);
        }
        count(Field::GaitTable, numbers(self.speed_count.into(), self.oscillation_count.into()), MOST_NUMBERS)?;
        count(Field::GaitSteps, self.step_count.into(), MOST_STEPS)?;
        let (shortest, longest) = (seconds(SHORTEST_INTERVAL_MS), seconds(LONGEST_INTERVAL_MS));
        within(Field::GaitInterval, seconds(self.interval_ms), shortest, longest)?;
        if self.table.iter().any(|number| !number.is_finite()) {
            return Err(Refusal::NonFinite { name: Field::GaitTable });
        }
        self.steps().try_for_each(|index| self.check_index(index))
    }

    /// Refuses what a robot cannot play: beside [`Gait::check_form`] motions beyond its limits, and an interval that is no whole
    /// number of its control periods of `tick` s. Otherwise the control periods of a step.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, limits: &Limits, tick: f32) -> Result<NonZeroU32, Refusal> {
        self.check_form()?;
        self.motions().try_for_each(|motion| match motion {
            Motion::Speed(speed) => within(Field::GaitSpeed, speed.abs(), limits.least_speed, limits.speed),
            Motion::Oscillation { .. } => motion.command().check(limits),
        })?;
        let interval = seconds(self.interval_ms);
        let uneven = Refusal::UnevenInterval { interval, tick };
        let periods = interval / tick;
        // At most 2 s over the shortest period that parameters allow.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let whole = (periods + 0.5) as u16;
        if (periods - f32::from(whole)).abs() > UNEVEN {
            return Err(uneven);
        }
        NonZeroU32::new(whole.into()).ok_or(uneven)
    }
}

fn seconds(ms: u16) -> f32 {
    f32::from(ms) / 1000.0
}

/// Of a table with so many speeds and oscillations.
fn numbers(speeds: usize, oscillations: usize) -> usize {
    speeds.saturating_add(oscillations.saturating_mul(2))
}

/// A count from 1 to `most`, which fits a byte.
fn count(name: Field, given: usize, most: usize) -> Result<u8, Refusal> {
    let shown = |count: usize| f32::from(u16::try_from(count).unwrap_or(u16::MAX));
    let refusal = Refusal::OutOfRange { name, value: shown(given), low: 1.0, high: shown(most) };
    u8::try_from(given).ok().filter(|_| (1..=most).contains(&given)).ok_or(refusal)
}

/// Where a gait is that is being played.
#[derive(Clone, Copy, Debug)]
pub struct Sequencer {
    /// Control periods of a step.
    per_step: NonZeroU32,
    /// Control periods since the first step began; `None` before that.
    at: Option<u32>,
}

impl Sequencer {
    /// At the beginning, with so many control periods to a step.
    #[must_use]
    pub fn new(per_step: NonZeroU32) -> Self {
        Self { per_step, at: None }
    }

    /// Goes on by so many control periods, to the first step at first: the motion to go on with, or `None` at the end.
    pub fn advance(&mut self, gait: &Gait, periods: u16) -> Option<Motion> {
        let whole = self.per_step.checked_mul(NonZeroU32::new(gait.step_count.into())?)?;
        let at = self.at.map_or(0, |at| at.saturating_add(periods.into()));
        let at = if gait.repeats { at % whole } else { at };
        self.at = Some(at);
        let step = u8::try_from(at / self.per_step).ok().filter(|step| *step < gait.step_count)?;
        gait.motions().nth(gait.index(step).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const LIMITS: Limits = Limits { speed: 75.0, least_speed: 6.0, least_stroke: 0.3 };
    const TICK: f32 = 1e-3;

    fn name() -> Name {
        Name::new("turn-left").expect("a name")
    }

    fn gait(speeds: &[f32], steps: &[u8], repeats: bool) -> Gait {
        Gait::new(name(), speeds, &[], steps, 40, repeats).expect("sound")
    }

    fn played(gait: &Gait, ticks: usize) -> Vec<Option<Motion>> {
        let mut sequencer = Sequencer::new(gait.check(&LIMITS, TICK).expect("it can be played"));
        (0..ticks).map(|_| sequencer.advance(gait, 1)).collect()
    }

    #[test]
    fn every_step_lasts_exactly_its_interval() {
        let steps: Vec<u8> = (0..MOST_STEPS).map(|step| (step * 7 % 10) as u8).collect();
        let speeds: Vec<f32> = (0..10_u8).map(|index| 40.0 + f32::from(index)).collect();
        let gait = gait(&speeds, &steps, false);
        let expected = steps.iter().flat_map(|index| [Some(Motion::Speed(speeds[usize::from(*index)])); 40]);
        let expected: Vec<Option<Motion>> = expected.chain([None; 100]).collect();
        assert_eq!(played(&gait, MOST_STEPS * 40 + 100), expected);
    }

    #[test]
    fn one_that_repeats_does_so_without_a_gap_for_an_hour() {
        let gait = gait(&[44.0, -44.0], &[0, 0, 1], true);
        let heard = played(&gait, 3_600_000);
        for (tick, motion) in heard.into_iter().enumerate() {
            let expected = if tick / 40 % 3 == 2 { -44.0 } else { 44.0 };
            assert_eq!(motion, Some(Motion::Speed(expected)), "tick {tick}");
        }
    }

    #[test]
    fn missed_ticks_are_counted() {
        let gait = gait(&[44.0, -44.0], &[0, 1, 0], false);
        let mut sequencer = Sequencer::new(gait.check(&LIMITS, TICK).expect("it can be played"));
        // What passed before the first tick is not the gait's.
        assert_eq!(sequencer.advance(&gait, 20), Some(Motion::Speed(44.0)));
        let heard = [20, 19, 1, 0, 20, 20].map(|periods| sequencer.advance(&gait, periods));
        assert_eq!(heard, [44.0, 44.0, -44.0, -44.0, -44.0, 44.0].map(|speed| Some(Motion::Speed(speed))));
        assert_eq!(sequencer.advance(&gait, 40), None);
    }

    #[test]
    fn oscillations_come_behind_the_speeds() {
        let oscillations = [[-1.0, 0.5], [0.25, 2.0]];
        let gait = Gait::new(name(), &[44.0], &oscillations, &[1, 0, 2], 40, false).expect("sound");
        let heard: Vec<Option<Motion>> = played(&gait, 121).into_iter().step_by(40).collect();
        let swings = oscillations.map(|[from, to]| Some(Motion::Oscillation { from, to }));
        assert_eq!(heard, [swings[0], Some(Motion::Speed(44.0)), swings[1], None]);
        let alone = Gait::new(name(), &[], &oscillations, &[0, 1], 40, true).expect("sound");
        assert_eq!(alone.motions().map(Some).collect::<Vec<_>>(), swings);
    }

    #[test]
    fn an_odd_number_of_steps_and_the_least_gait_come_back() {
        for steps in [&[0][..], &[0, 1, 2], &[2; MOST_STEPS - 1], &[1; MOST_STEPS]] {
            let gait = gait(&[10.0, 20.0, 30.0], steps, true);
            assert!(gait.steps().eq(steps.iter().copied()));
            assert!(gait.motions().eq([10.0, 20.0, 30.0].map(Motion::Speed)));
        }
    }

    #[test]
    fn what_differs_has_another_id() {
        let one = gait(&[10.0, 20.0], &[0, 1], false);
        let others = [
            gait(&[10.0, 20.5], &[0, 1], false),
            gait(&[10.0, 20.0], &[1, 0], false),
            gait(&[10.0, 20.0], &[0, 1, 0], false),
            gait(&[10.0, 20.0, 0.0], &[0, 1], false),
            gait(&[10.0, 20.0], &[0, 1], true),
            Gait::new(name(), &[10.0, 20.0], &[], &[0, 1], 41, false).expect("sound"),
            Gait::new(Name::new("other").expect("a name"), &[10.0, 20.0], &[], &[0, 1], 40, false).expect("sound"),
            Gait::new(name(), &[10.0, 20.0], &[[0.0, 0.0]], &[0, 1], 40, false).expect("sound"),
            Gait { speed_count: 0, oscillation_count: 1, ..one },
        ];
        for other in others {
            assert_ne!(other.id(), one.id(), "{other:?}");
        }
        assert_eq!(gait(&[10.0, 20.0], &[0, 1], false).id(), one.id());
    }

    /// Everything that can be wrong, one at a time: each is refused, whether it was built or received.
    #[test]
    fn what_cannot_be_played_is_refused_with_its_reason() {
        let good = gait(&[44.0, -44.0], &[0, 1, 0], false);
        let swinging = |from, to| Gait::new(name(), &[], &[[from, to]], &[0], 40, true).expect("sound");
        let range = |name, value, low, high| Refusal::OutOfRange { name, value, low, high };
        let wrong: [(Gait, Refusal); 17] = [
            (Gait { name: Name::default(), ..good }, Refusal::GaitName),
            (Gait { name: Name(*b"with a space"), ..good }, Refusal::GaitName),
            (Gait { name: Name(*b"left\0over\0\0\0"), ..good }, Refusal::GaitName),
            (Gait { step_count: 0, ..good }, range(Field::GaitSteps, 0.0, 1.0, 250.0)),
            (Gait { step_count: 251, ..good }, range(Field::GaitSteps, 251.0, 1.0, 250.0)),
            (Gait { speed_count: 0, ..good }, range(Field::GaitTable, 0.0, 1.0, 16.0)),
            (Gait { speed_count: 17, ..good }, range(Field::GaitTable, 17.0, 1.0, 16.0)),
            (Gait { oscillation_count: 8, ..good }, range(Field::GaitTable, 18.0, 1.0, 16.0)),
            (swinging(-1.0, 7.0), range(Field::To, 7.0, -core::f32::consts::TAU, core::f32::consts::TAU)),
            (swinging(1.0, 0.5), range(Field::Span, -0.5, 0.3, 2.0 * core::f32::consts::TAU)),
            (swinging(0.5, 0.75), range(Field::Span, 0.25, 0.3, 2.0 * core::f32::consts::TAU)),
            (Gait { speed_count: 1, ..good }, range(Field::GaitStep, 1.0, 0.0, 0.0)),
            (Gait { interval_ms: 9, ..good }, range(Field::GaitInterval, 9e-3, 10e-3, 2.0)),
            (Gait { interval_ms: 2001, ..good }, range(Field::GaitInterval, 2.001, 10e-3, 2.0)),
            (Gait { table: [f32::NAN; MOST_NUMBERS], ..good }, Refusal::NonFinite { name: Field::GaitTable }),
            (gait(&[44.0, -75.1], &[0], false), range(Field::GaitSpeed, 75.1, 6.0, 75.0)),
            (gait(&[44.0, -5.9], &[0], false), range(Field::GaitSpeed, 5.9, 6.0, 75.0)),
        ];
        for (gait, refusal) in wrong {
            assert_eq!(gait.check(&LIMITS, TICK), Err(refusal), "{gait:?}");
        }
        assert_eq!(good.check(&LIMITS, 1e-3).map(NonZeroU32::get), Ok(40));
        assert_eq!(good.check(&LIMITS, 2.5e-3).map(NonZeroU32::get), Ok(16));
        let uneven = Refusal::UnevenInterval { interval: 40e-3, tick: 3e-3 };
        assert_eq!(good.check(&LIMITS, 3e-3), Err(uneven));
        let beyond = Gait::new(name(), &[44.0], &[], &[0, 0, 1], 40, false);
        assert_eq!(beyond, Err(range(Field::GaitStep, 1.0, 0.0, 0.0)));
        // An index that would spill into its neighbour's half.
        assert_eq!(Gait::new(name(), &[44.0], &[], &[16], 40, false), Err(range(Field::GaitStep, 16.0, 0.0, 0.0)));
        assert_eq!(Gait::new(name(), &[], &[], &[0], 40, false), Err(range(Field::GaitTable, 0.0, 1.0, 16.0)));
        let long = Gait::new(name(), &[44.0], &[], &[0; 251], 40, false);
        assert_eq!(long, Err(range(Field::GaitSteps, 251.0, 1.0, 250.0)));
        let many = Gait::new(name(), &[44.0; 15], &[[0.0, 1.0]], &[0], 40, false);
        assert_eq!(many, Err(range(Field::GaitTable, 17.0, 1.0, 16.0)));
    }

    #[test]
    fn names_are_short_and_plain() {
        for good in ["a", "turn-left", "Turn_2.5-abc"] {
            assert_eq!(Name::new(good).expect(good).as_str(), good);
        }
        for wrong in ["", "thirteen-long", "two words", "naïf", "a/b", "a;b", "nul\0"] {
            assert_eq!(Name::new(wrong), None, "{wrong}");
        }
    }
}
