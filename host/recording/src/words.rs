//! Faults in words.

use control::Fault;

/// What a fault means, and what to look at.
#[must_use]
pub fn fault(fault: Fault) -> (&'static str, &'static str) {
    match fault {
        Fault::Stall => (
            "driven, and the shaft does not turn",
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
        Fault::Overheated => (
            "the motor's winding is too hot",
            "wait some seconds before `clear`; if it comes again, drive more gently and see whether the shaft turns freely",
        ),
        Fault::LoopStarved => (
            "its control loop missed too many periods",
            "switch the robot off and on; report it if it comes again, with the recording",
        ),
    }
}
