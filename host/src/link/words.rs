//! What the robot says, in words for a person at a bench.

use control::Fault;
use control::protocol::dongle::Address;
use control::protocol::radio::{Reset, Source};

use super::Station;

/// `7c:df:a1:00:11:22`
#[must_use]
pub fn address(address: &Address) -> String {
    address.map(|byte| format!("{byte:02x}")).join(":")
}

/// Reads an address: six bytes in hexadecimal, with `:` or `-` between.
///
/// # Errors
/// What was expected.
pub fn parse_address(text: &str) -> Result<Address, String> {
    let byte = |part: &str| {
        let plain = part.len() == 2 && part.bytes().all(|digit| digit.is_ascii_hexdigit());
        if plain { u8::from_str_radix(part, 16).ok() } else { None }
    };
    let bytes: Option<Vec<u8>> = text.split([':', '-']).map(byte).collect();
    bytes
        .and_then(|bytes| Address::try_from(bytes).ok())
        .ok_or_else(|| format!("`{text}` is no address; expected are six bytes, e.g. 7c:df:a1:00:11:22"))
}

/// What a fault means, and what to look at.
#[must_use]
pub fn fault(fault: Fault) -> (&'static str, &'static str) {
    match fault {
        Fault::Stall => (
            "driven hard, and the shaft does not turn",
            "with the battery out, does the shaft turn freely by hand? Then check the motor's two wires and the bridge's supply",
        ),
        Fault::Runaway => (
            "the shaft is faster than allowed, or turns against the drive",
            "the motor's two wires or the outer two of the potentiometer are swapped",
        ),
        Fault::SensorOpen => {
            ("no reading fits the motion", "check the wire of the potentiometer's wiper and that nothing touches it")
        }
        Fault::SensorShorted => (
            "the wiper reads one end all the time",
            "check the potentiometer's three wires for a short, and that its supply is there",
        ),
        Fault::SensorFrozen => (
            "the reading does not change although the shaft should turn",
            "does the shaft turn? Then the potentiometer does not turn with it; else check the motor's two wires",
        ),
        Fault::SupplyLow => ("the battery is below its limit", "charge the battery, and check its plug and divider"),
        Fault::CommandTooOld => (
            "no command reached it for too long",
            "bring the dongle nearer, away from Wi-Fi routers, and plug it into the computer itself",
        ),
        Fault::ClockFault => ("its clock leaped", "switch the robot off and on; report it if it comes again"),
        Fault::Restarted => (
            "it has restarted",
            "it drives again once the fault is cleared; if it restarts when the motor starts, its supply breaks down",
        ),
    }
}

/// Why it started.
#[must_use]
pub fn reset(reset: Reset) -> &'static str {
    match reset {
        Reset::PowerOn => "power-on or reset button",
        Reset::External => "reset by a computer on its USB",
        Reset::Software => "restart by its firmware",
        Reset::Panic => "panic in its firmware",
        Reset::Watchdog => "watchdog (its control loop hung)",
        Reset::BrownOut => "brown-out (its supply broke down)",
        Reset::Other => "a start for another reason",
    }
}

/// Where its parameters come from.
#[must_use]
pub fn source(source: Source) -> &'static str {
    match source {
        Source::Factory => "built in",
        Source::Stored => "stored in its flash",
        Source::FactoryOtherVersion => "built in (those in flash are of another firmware or robot file)",
        Source::FactoryDamaged => "built in (those in flash are damaged)",
    }
}

/// A robot in two lines: who and where, and how it started.
#[must_use]
pub fn station(at: &Address, station: &Station) -> [String; 2] {
    let name = station.status.as_ref().map_or("a robot", |status| status.name.as_str());
    let mut who = format!("{name} at {}, {} dBm", address(at), station.rssi);
    if let Some(batch) = &station.telemetry
        && batch.battery_mv > 0
    {
        who += &format!(", battery {:.2} V", f64::from(batch.battery_mv) / 1e3);
    }
    let how = station.status.as_ref().map_or_else(
        || "it has not told its status yet".to_owned(),
        |status| {
            let (up, why, from) = (status.uptime_ms / 1000, reset(status.reset), source(status.parameters));
            format!("up {up} s since {why}; parameters {from}")
        },
    );
    [who, how]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_as_they_are_written() {
        let one = [0x7c, 0xdf, 0xa1, 0x00, 0x11, 0xff];
        assert_eq!(address(&one), "7c:df:a1:00:11:ff");
        assert_eq!(parse_address("7c:df:a1:00:11:ff"), Ok(one));
        assert_eq!(parse_address("7C-DF-A1-00-11-FF"), Ok(one));
        for wrong in ["", "7c:df:a1:00:11", "7c:df:a1:00:11:ff:00", "7c:df:a1:00:11:+f", "7c:df:a1:00:11:fff", "é:1"] {
            assert!(parse_address(wrong).is_err(), "{wrong}");
        }
    }
}
