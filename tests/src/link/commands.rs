//! Commands through an air that loses a fifth of its frames in bursts and delays others by up to 50 ms: each is answered or
//! refused within a second.

use std::collections::BTreeMap;
use std::time::Duration;

use control::Command;
use control::parameters::table::TABLE;
use control::protocol::radio::Request;
use hal_sim::radio::Trouble;
use link::{Event, Outcome, RobotId};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::json;
use testbed::event_log::Detail;
use testbed::injected_event::InjectedEvent;

use super::Options;
use super::mode::{MODES, Mode};
use super::rig::{Rig, Template};
use crate::figures::run::{DesignedRobot, for_seeds, median, worst};
use crate::row::FigureRow;

/// Commands in a session.
const IN_A_SESSION: u64 = 40;
/// The bursts' mean lengths, µs: the robot file's, and two and a half times that.
const BURSTS_US: [u64; 2] = [20_000, 50_000];
/// Share of frames in the tail, the upper end of the robot file's range twice.
const TAIL_SHARE: f64 = 0.1;
/// Until when a person has an answer, s.
const WITHIN_S: f64 = 1.0;

/// How a command ended, and after how long, s.
struct Ended {
    name: &'static str,
    after_s: f64,
}

/// The rows: one a burst length.
#[must_use]
pub fn rows(bench: &DesignedRobot, options: &Options) -> Vec<FigureRow> {
    let template = Template::new(&bench.robot, 1, Detail::Nothing);
    let sessions = (options.runs / 5).div_ceil(IN_A_SESSION).max(1);
    BURSTS_US.iter().map(|burst_us| row(&template, *burst_us, sessions)).collect()
}

fn row(template: &Template, burst_us: u64, sessions: u64) -> FigureRow {
    let ended: Vec<Ended> =
        for_seeds(sessions, |seed| session(template, burst_us, seed)).into_iter().flatten().collect();
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    ended.iter().for_each(|ended| *names.entry(ended.name).or_default() += 1);
    let answered: Vec<f64> =
        ended.iter().filter(|ended| ended.name != "unanswered").map(|ended| ended.after_s).collect();
    let neither = ended.len() - answered.iter().filter(|after_s| **after_s <= WITHIN_S).count();
    let (median_s, worst_s) = (median(answered.iter().copied()), worst(ended.iter().map(|ended| ended.after_s)));
    let named: Vec<String> = names.iter().map(|(name, count)| format!("{count} {name}")).collect();
    FigureRow::new(
        &format!("orders through 20 % loss in bursts of {} ms, tails of 50 ms", burst_us / 1000),
        "each answered or refused within 1 s",
        format!(
            "{} orders: {}; median {median_s:.3} s, worst {worst_s:.3} s; neither {neither}",
            ended.len(),
            named.join(", ")
        ),
        !ended.is_empty() && neither == 0,
        json!({ "orders": ended.len(), "ended": names, "median_s": median_s, "worst_s": worst_s, "neither": neither }),
    )
}

fn session(template: &Template, burst_us: u64, seed: u64) -> Vec<Ended> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut rig = Rig::new(template.seeded(seed));
    rig.meet();
    rig.order(0, Mode::Forward.command(0));
    rig.end.bench().apply(InjectedEvent::Air(Trouble {
        loss_share: Some(0.2),
        burst_us: Some(burst_us),
        tail_share: Some(TAIL_SHARE),
        tail_most_us: Some(50_000),
        ..Trouble::NONE
    }));
    (0..IN_A_SESSION)
        .map(|_| {
            rig.run(Duration::from_micros(random.random_range(0..60_000)));
            // A person who was told that the robot has gone waits until it is back.
            rig.meet();
            give(&mut rig, request(&mut random))
        })
        .collect()
}

/// What people order.
fn request(random: &mut Pcg64) -> Request {
    match random.random_range(0..4) {
        0 => Request::Get(random.random_range(0..TABLE.len() as u16)),
        1 => Request::Command(Command::Idle),
        // Refused while it drives.
        2 => Request::Save,
        _ => Request::Command(MODES[random.random_range(0..MODES.len())].command(0)),
    }
}

fn give(rig: &mut Rig, request: Request) -> Ended {
    let start = rig.session.now();
    let ordered = rig.session.request(RobotId(0), request);
    loop {
        let heard = rig.poll().expect("a healthy line");
        if let Some(Event::Answered { number, outcome, .. }) = heard.map(|heard| heard.event)
            && number == ordered
        {
            let name = match outcome {
                Outcome::Done(_) => "done",
                Outcome::Refused(_) => "refused",
                Outcome::TooLate => "too late",
                Outcome::Unanswered => "unanswered",
                Outcome::Absent => "absent",
                Outcome::Overtaken => "overtaken by a stop",
            };
            return Ended { name, after_s: (rig.session.now() - start).as_secs_f64() };
        }
    }
}
