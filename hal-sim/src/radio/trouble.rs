//! What a test changes about the air.

/// Overrides of `[radio]`; `None` is the robot file's. Shares are 0 … 1, times µs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trouble {
    /// Nothing passes: jamming.
    pub silence: bool,
    /// Share of tries that are lost in the long run. The shares in and out of a burst give way where they contradict it.
    pub loss_share: Option<f64>,
    /// Share of tries that are lost out of a burst.
    pub quiet_loss_share: Option<f64>,
    /// Share of tries that are lost in a burst.
    pub burst_loss_share: Option<f64>,
    /// Mean length of a burst; 0 for independent losses.
    pub burst_us: Option<u64>,
    /// Share of frames that arrive twice.
    pub duplicate_share: Option<f64>,
    /// Share of frames that are held back.
    pub reorder_share: Option<f64>,
    /// How long they are held back.
    pub reorder_hold_us: Option<u64>,
    /// Share of frames that arrive with wrong bits.
    pub corruption_share: Option<f64>,
    /// Every frame comes this much later than it would.
    pub extra_delay_us: u64,
    /// Share of frames in the tail.
    pub tail_share: Option<f64>,
    /// Longest delay in the tail; the shortest gives way where it is longer.
    pub tail_most_us: Option<u64>,
    /// Share of late callbacks.
    pub late_callback_share: Option<f64>,
    /// Frames that wait for the receiver's program.
    pub receive_queue: Option<usize>,
}

impl Trouble {
    /// The robot file's air.
    pub const NONE: Self = Self {
        silence: false,
        loss_share: None,
        quiet_loss_share: None,
        burst_loss_share: None,
        burst_us: None,
        duplicate_share: None,
        reorder_share: None,
        reorder_hold_us: None,
        corruption_share: None,
        extra_delay_us: 0,
        tail_share: None,
        tail_most_us: None,
        late_callback_share: None,
        receive_queue: None,
    };
}
