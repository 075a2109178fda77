//! What is safe: a run of the campaign against what must come of its fault, and against the same run without it.

use std::collections::BTreeMap;

use control::parameters::Parameters;
use control::supervisor::TRIGGERS;
use control::{Actuation, Fault as Cause, State};
use testbed::parts::WATCHDOG_US;

use super::fault::{Case, Must};
use super::mode::Mode;
use super::run::Trace;

/// A tick, µs: the bridge is told once in it.
const TICK_US: u64 = 1000;
/// Time after which a request does not count any more, µs.
const DEADLINE_US: u64 = 500_000;
/// Share by which a speed that is held may be off.
const SPEED_SHARE: f64 = 0.05;

/// Assessment of a run of the link campaign.
#[derive(Clone, Debug, Default)]
pub struct LinkAssessment {
    /// The bridge went off before the console's end, by this name.
    pub stopped: Option<Option<Cause>>,
    /// From the fault, the last frame that counted, or the reset to the bridge off, s: whichever the bound is for.
    pub off_s: Option<f64>,
    /// From the last frame that counted to the bridge off after the console's end, s.
    pub gone_s: Option<f64>,
    /// What differs from the run without the fault.
    pub changed: Changed,
    /// What is not safe.
    pub unsafe_: Vec<String>,
}

/// What differs from the run without the fault.
#[derive(Clone, Copy, Debug, Default)]
pub struct Changed {
    /// What the bridge was told.
    pub bridge: bool,
    /// The readings of the wiper or the cell.
    pub readings: bool,
    /// The robot's counters.
    pub counters: bool,
    /// What the air counted.
    pub air: bool,
    /// What the console's session counted, or that it broke.
    pub session: bool,
}

impl Changed {
    /// Whether anything differs.
    #[must_use]
    pub fn any(self) -> bool {
        self.bridge || self.readings || self.counters || self.air || self.session
    }
}

/// The bound of a name, s.
#[must_use]
pub fn bound(p: &Parameters, cause: Cause) -> Option<f64> {
    let trigger = TRIGGERS.iter().find(|trigger| trigger.fault == cause)?;
    Some(f64::from((trigger.limit)(&p.supervisor).bound))
}

/// The longest of the bounds that a case may come under, s; `None` where it must not stop, or may.
#[must_use]
pub fn bound_of_case(p: &Parameters, case: &Case) -> Option<f64> {
    match case.must {
        Must::Found(causes) => causes.iter().filter_map(|cause| bound(p, *cause)).reduce(f64::max),
        Must::LinkLost | Must::HeldBack => bound(p, Cause::CommandTooOld),
        Must::AtOnce => Some(0.0),
        Must::Bitten => Some((WATCHDOG_US + TICK_US) as f64 * 1e-6),
        Must::Bounded(bound_s) => Some(bound_s),
        Must::GoOn | Must::Either => None,
    }
}

/// Of the last ticks before a link is taken for lost: the duty has faded.
const FADED: f32 = 0.05;

/// Judges a run.
#[must_use]
pub fn assess(p: &Parameters, case: &Case, mode: Mode, trace: &Trace, healthy: &Trace) -> LinkAssessment {
    let mut verdict = LinkAssessment { changed: changed(trace, healthy), ..LinkAssessment::default() };
    let mut found = Vec::new();
    if mode == Mode::Idle {
        if !trace.driven.is_empty() {
            found.push(format!("driven in idle: {:?}", trace.driven));
        }
        if case.must == Must::GoOn && trace.at_end.0 != Some(State::Idle) {
            found.push(format!("no longer idle: {:?}", trace.at_end.0));
        }
    } else {
        again(trace, &mut found);
        off(p, case, mode, trace, &mut verdict, &mut found);
    }
    if trace.on_in_fault > 0 {
        found.push(format!("the bridge was on in Fault at {} looks", trace.on_in_fault));
    }
    if trace.not_ordered > 0 {
        found.push(format!("it did what nobody ordered at {} looks", trace.not_ordered));
    }
    if trace.beyond > 0 {
        found.push(format!("{} orders counted that the console did not send", trace.beyond));
    }
    if before(trace) != before_of(healthy, trace.fault_us) {
        found.push("the run differs before its fault".into());
    }
    verdict.unsafe_ = found;
    verdict
}

/// The bridge comes on again only by a command, and never after a fault.
fn again(trace: &Trace, found: &mut Vec<String>) {
    for pair in trace.driven.windows(2) {
        let (Some(off_us), on_us) = (pair[0].1, pair[1].0) else { continue };
        if trace.faulted_us.is_some_and(|faulted_us| faulted_us <= on_us) {
            found.push(format!("on again at {on_us} us after a fault that nobody cleared"));
        } else if !trace.orders_us.iter().any(|order_us| (off_us..=on_us).contains(order_us)) {
            found.push(format!("on again at {on_us} us by itself"));
        }
    }
}

fn off(p: &Parameters, case: &Case, mode: Mode, trace: &Trace, verdict: &mut LinkAssessment, found: &mut Vec<String>) {
    let Some(&(_, last)) = trace.driven.last() else {
        found.push("never driven".into());
        return;
    };
    let Some(off_us) = last else {
        found.push("on at the end of the run".into());
        return;
    };
    let last_valid_us = trace.valid_us.iter().copied().filter(|at_us| *at_us <= off_us).max().unwrap_or_default();
    let since_valid_s = seconds(last_valid_us, off_us);
    let by_link = trace.cause == Some(Cause::CommandTooOld) && !matches!(case.must, Must::Either | Must::Found(_));
    let last_told = trace.told.iter().rev().find(|(at_us, told)| *at_us < off_us && told.enable);
    if let Some((_, told)) = last_told.filter(|(_, told)| by_link && told.duty.abs() > FADED) {
        found.push(format!("it did not slow down before it was cut off: duty {:.2}", told.duty));
    }
    let gone = bound(p, Cause::CommandTooOld).unwrap_or_default();
    if off_us > trace.end_us {
        verdict.gone_s = Some(since_valid_s);
        if since_valid_s > gone {
            found.push(format!("off {since_valid_s:.3} s after the console's last frame"));
        }
    } else {
        verdict.stopped = Some(trace.cause);
    }
    let goes_on = off_us > trace.end_us
        && trace.driven.len() == 1
        && trace.at_end.1
        && trace.at_end.0.is_some_and(|state| mode.leads_to(state));
    let (since_s, bound_s) = match case.must {
        Must::Either => {
            verdict.off_s = verdict.stopped.map(|_| seconds(trace.fault_us, off_us));
            return;
        }
        Must::GoOn => {
            let speed_held = mode.speed().is_none_or(|speed| (trace.speed / speed - 1.0).abs() < SPEED_SHARE);
            if !goes_on {
                found.push(format!("it did not go on: off at {off_us} us, {:?}", trace.cause));
            } else if !speed_held {
                found.push(format!("it does not hold its speed: {:.1} rad/s", trace.speed));
            }
            return;
        }
        Must::Found(causes) => {
            let named = trace.cause.filter(|cause| causes.contains(cause)).and_then(|cause| bound(p, cause));
            // The bound of what it is called or of what it is. Half a tick of rounding.
            let is = causes.first().and_then(|cause| bound(p, *cause)).unwrap_or_default();
            (driven(p, trace, off_us), named.map(|bound| bound.max(is) + 5e-4))
        }
        Must::HeldBack => {
            let ordered_us = trace.orders_us.iter().filter(|order_us| **order_us <= off_us).max();
            let last_us = ordered_us.map_or(0, |order_us| order_us + DEADLINE_US).max(trace.fault_us);
            (seconds(last_us, off_us), Some(gone))
        }
        Must::LinkLost => (since_valid_s, Some(gone)),
        Must::AtOnce | Must::Bitten if trace.cause != Some(Cause::Restarted) => {
            found.push(format!("nobody must clear it: {:?}", trace.cause));
            return;
        }
        Must::AtOnce | Must::Bitten | Must::Bounded(_) => (seconds(trace.fault_us, off_us), bound_of_case(p, case)),
    };
    verdict.off_s = Some(since_s);
    // Whoever gives commands repeatedly, and in time, goes on driving.
    let may_go_on = case.must == Must::HeldBack && bound_s.is_some_and(|bound| since_s <= bound);
    if verdict.stopped.is_none() && !may_go_on {
        found.push(format!("not off before the console's end, but {since_s:.4} s after, as {:?}", trace.cause));
    } else if bound_s.is_none_or(|bound| since_s > bound) {
        found.push(format!("off after {since_s:.4} s as {:?}, bound {bound_s:?}", trace.cause));
    }
}

/// From the fault to the bridge off, s, without the time in which the bridge could drive no current worth mentioning through a motor
/// at rest: a shaft that is blocked where it was sent to needs none.
fn driven(p: &Parameters, trace: &Trace, off_us: u64) -> f64 {
    let has_current = |told: &Actuation| {
        let left_v = p.bridge.rail * told.duty.abs() - p.bridge.drop;
        told.enable && left_v > p.supervisor.driven_current * p.motor.resistance
    };
    let ends = trace.told.iter().skip(1).map(|(at_us, _)| *at_us).chain([off_us]);
    let spans = trace.told.iter().zip(ends).filter(|((_, told), _)| has_current(told));
    spans.map(|((from_us, _), to_us)| seconds((*from_us).max(trace.fault_us), to_us.min(off_us)).max(0.0)).sum()
}

fn seconds(from_us: u64, to_us: u64) -> f64 {
    (to_us as f64 - from_us as f64) * 1e-6
}

type TimedActuation = (u64, Actuation);

fn before(trace: &Trace) -> Vec<TimedActuation> {
    before_of(trace, trace.fault_us)
}

fn before_of(trace: &Trace, until_us: u64) -> Vec<TimedActuation> {
    trace.told.iter().copied().filter(|(at_us, _)| *at_us < until_us).collect()
}

fn changed(trace: &Trace, healthy: &Trace) -> Changed {
    let until_us = trace.end_us.min(healthy.end_us);
    let differs = |ours: &BTreeMap<u32, u16>, theirs: &BTreeMap<u32, u16>| {
        ours.iter().any(|(tick, value)| theirs.get(tick).is_some_and(|other| other != value))
    };
    Changed {
        bridge: before_of(trace, until_us) != before_of(healthy, until_us),
        readings: differs(&trace.codes, &healthy.codes) || differs(&trace.battery_mv, &healthy.battery_mv),
        counters: trace.counters != healthy.counters,
        air: trace.air != healthy.air,
        session: trace.session != healthy.session,
    }
}
