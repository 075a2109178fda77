//! What can be wrong with a simulated board: for tests that must find it.

/// Something that is wrong with a board, or with what its firmware does for its safety.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Broken {
    /// The watchdog never bites.
    Watchdog,
    /// A crash leaves the bridge on until the chip has reset.
    PanicCut,
    /// The pull-down of the bridge's enable is missing, and the pin floats high while no program holds it.
    PullDown,
    /// Every conversion of the wiper gives [`Broken::CODE`].
    Converter,
    /// The radio acknowledges nothing that the robot sends.
    Acknowledgement,
    /// Every boot says that it is a power-up.
    ResetCause,
    /// The flash forgets the parameters when the supply goes.
    Flash,
}

impl Broken {
    /// Of [`Broken::Converter`].
    pub const CODE: u16 = 1234;
}
