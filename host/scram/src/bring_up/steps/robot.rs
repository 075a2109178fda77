//! Faults of the robot itself, with the motor.

use std::time::Duration;

use control::Command;

use super::BARE;
use crate::bring_up::operator::Act;
use crate::bring_up::rig::{Halt, Rig};
use crate::bring_up::step::{Step, Wiring};
use link::Event;

/// A person finds the mass within this time.
const HANDS: Duration = Duration::from_secs(30);
/// The shaft turns by then.
const SETTLE: Duration = Duration::from_secs(2);
/// A speed in the middle of the range, rad/s, and all that the bridge has: a shaft that stands then is blocked.
const CRUISE: Command = Command::Speed { omega: 30.0 };
const HARD: Command = Command::Duty { duty: 1.0 };

const MOTOR: Step = Step { wiring: Wiring::Motor, ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 70,
        title: "A blocked shaft is found",
        needs: "a gloved hand, or a clamp",
        about: "The motor turns at duty 1, and the mass is held.",
        run: blocked,
        ..MOTOR
    },
    Step {
        number: 71,
        title: "An open wiper is found",
        needs: "the wiper's lead in hand",
        about: "The motor turns, and the wiper's lead is pulled.",
        run: |rig| breaks(rig, Act::WiperLead(false), Act::WiperLead(true)),
        ..MOTOR
    },
    Step {
        number: 72,
        title: "An empty cell is found",
        needs: "a laboratory supply in place of the cell",
        about: "The motor turns, and the supply is lowered to 2.9 V.",
        run: |rig| breaks(rig, Act::Cell(Some(2.9)), Act::Cell(None)),
        ..MOTOR
    },
];

fn turn(rig: &mut Rig, command: Command) -> Result<(), Halt> {
    rig.drive(command)?;
    rig.listen(SETTLE, |_| true)?;
    if let Some(fault) = rig.fault() {
        rig.check("the drive before it", format!("{fault:?}"), "no fault", false);
        return Err(Halt::Noted);
    }
    Ok(())
}

/// The fault's beginning is in the telemetry: the codes stand still.
fn blocked(rig: &mut Rig) -> Result<(), Halt> {
    let bound_s = rig.bound("controller.supervisor.stall_bound_s")?;
    turn(rig, HARD)?;
    rig.act_now(Act::HoldShaft(true))?;
    let (mut moved_at, mut code, mut off_at) = (None, None::<u16>, None);
    rig.listen(HANDS, |event| {
        if let Event::Telemetry(batch) = event {
            for (tick, row) in (batch.first_tick..).zip(&batch.rows) {
                // More than the converter's noise.
                if code.is_none_or(|code| row.code.abs_diff(code) > STILL_LSB) {
                    (moved_at, code) = (Some(tick), Some(row.code));
                }
                if row.duty.is_none() {
                    off_at = Some(tick);
                    break;
                }
            }
        }
        off_at.is_none()
    })?;
    let fault = rig.fault();
    let expected = format!("a fault, bridge off, within {bound_s:.2} s");
    match (moved_at, off_at) {
        (Some(moved), Some(off)) => {
            let after_s = f64::from(off.wrapping_sub(moved)) * 1e-3;
            let found = format!("{fault:?} {after_s:.2} s after the last motion");
            rig.check("a held mass", found, &expected, after_s <= bound_s && fault.is_some());
        }
        _ => rig.check("a held mass", format!("the robot drives on for {} s", HANDS.as_secs()), &expected, false),
    }
    rig.act(Act::HoldShaft(false))
}

/// Beyond the converter's noise, below a tick's way at the slowest speed that counts as turning.
const STILL_LSB: u16 = 40;

fn breaks(rig: &mut Rig, act: Act, mend: Act) -> Result<(), Halt> {
    turn(rig, CRUISE)?;
    rig.act_now(act)?;
    match rig.await_fault(HANDS)? {
        Some((fault, _)) => rig.check(&act.words(), format!("{fault:?}"), "a fault, bridge off", true),
        None => rig.check(&act.words(), "the robot drives on".into(), "a fault, bridge off", false),
    }
    rig.act(mend)
}
