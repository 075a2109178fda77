//! ESP-NOW behind the traits of [`shell::board`]: unicast at a fixed rate on a fixed channel, encrypted (CCMP) to and from
//! everybody who was met.
//!
//! Broadcasts are never encrypted. The driver receives them from anybody without being told, and its list of peers has the
//! broadcast address from the start, so that they can be sent. Who may say what, `control::protocol::secure` decides.

use core::slice;

use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_radio::esp_now::{
    Error, EspNowError, EspNowManager, EspNowSender, EspNowWifiInterface, PeerInfo, PhyMode, RateConfig, WifiPhyRate,
};
use esp_radio::wifi::{ControllerConfig, WifiController, WifiError};
use heapless::Vec;
use shell::board::{self, Address, Gauge, RadioKey, Readings, Received, Sent};
use shell::inbox::Inbox;

use crate::board::driver::{esp_now_recv_info_t, esp_now_register_recv_cb};
use crate::memory;

/// Channel of the robot and of the dongle: the lowest, allowed everywhere.
pub const CHANNEL: u8 = 1;
/// 6 Mb/s (OFDM): a telemetry message is in the air for 0.3 ms, not for the 1.5 ms of the default 1 Mb/s.
const RATE: RateConfig = RateConfig { phy_mode: PhyMode::_11g, rate: WifiPhyRate::Rate6m, ersu: false, dcm: false };
/// Whom a radio can meet: the keys that the hardware holds, all of them for ESP-NOW. The driver's own choice is 7.
pub const MOST_MET: usize = 17;

/// What has come in.
static INBOX: Inbox = Inbox::new();

/// Why there is no radio.
#[derive(Debug, thiserror::Error)]
pub enum RadioError {
    /// The driver did not start.
    #[error("the radio does not start: {0:?}")]
    Wifi(WifiError),
    /// The driver refuses the channel.
    #[error("the radio refuses channel {CHANNEL}: {0:?}")]
    Channel(EspNowError),
    /// The driver refuses our callback.
    #[error("the radio's driver refuses to hand over what it receives: {0}")]
    Callback(i32),
}

/// The board's own address.
#[must_use]
pub fn address() -> Address {
    let mac = interface_mac_address(InterfaceMacAddress::Station);
    let mut address = Address::default();
    address.copy_from_slice(mac.as_bytes());
    address
}

/// Starts the radio. Its tasks run on the core that calls this; esp-rtos must run.
///
/// # Errors
/// The driver's reason.
pub fn start(wifi: WIFI<'static>) -> Result<(Receiver, Sender), RadioError> {
    // The driver lives on in the parts below. It does not save power by sleeping (its default), which would cost latency. Frames of
    // ESP-NOW are never aggregated.
    let config = ControllerConfig::default()
        .with_espnow_max_encrypt_num(MOST_MET as u8)
        .with_static_rx_buf_num(memory::STATIC_RX)
        .with_dynamic_rx_buf_num(memory::DYNAMIC_RX)
        .with_dynamic_tx_buf_num(memory::DYNAMIC_TX)
        .with_ampdu_rx_enable(false)
        .with_ampdu_tx_enable(false)
        .with_rx_ba_win(0);
    let controller = WifiController::new(wifi, config).map_err(RadioError::Wifi)?;
    let (manager, sender, receiver) = controller.esp_now().split();
    // esp-radio's own callback takes memory for a frame of any length, and resets the chip where there is none.
    // SAFETY: the driver runs, and calls a function that lives for ever.
    match unsafe { esp_now_register_recv_cb(Some(take)) } {
        0 => {}
        error => return Err(RadioError::Callback(error)),
    }
    // What came in before that is let go of.
    while receiver.receive().is_some() {}
    manager.set_channel(CHANNEL).map_err(RadioError::Channel)?;
    Ok((Receiver(()), Sender { sender, manager, keyed: false, slow: Vec::new() }))
}

/// The driver calls it from its task with a frame that has come in.
// SAFETY: nobody else calls it. The driver's three pointers, and those in the first, are valid until it returns.
unsafe extern "C" fn take(info: *const esp_now_recv_info_t, frame: *const u8, length: i32) {
    // SAFETY: as above; null is nothing.
    let (Some(info), Ok(length)) = (unsafe { info.as_ref() }, usize::try_from(length)) else { return };
    if info.src_addr.is_null() || info.rx_ctrl.is_null() || frame.is_null() {
        return;
    }
    // SAFETY: an address has six bytes.
    let from = unsafe { info.src_addr.cast::<Address>().read() };
    // SAFETY: on both chips the signal's strength is the first of the control information's bit fields, eight bits, signed.
    let rssi = unsafe { info.rx_ctrl.cast::<i8>().read() };
    // SAFETY: the driver says how long its copy of the frame is.
    INBOX.offer(from, rssi, unsafe { slice::from_raw_parts(frame, length) });
}

/// The receiving half.
pub struct Receiver(());

impl board::Receiver for Receiver {
    async fn receive(&mut self) -> Received {
        INBOX.receive().await
    }
}

/// The driver, asked how it is.
pub struct Driver;

impl Gauge for Driver {
    fn read(&self) -> Readings {
        Readings { too_long: INBOX.too_long(), overrun: INBOX.overrun(), heap_least_free: memory::least_free() }
    }
}

/// The sending half. It sends to everybody (broadcast) and to whom it has met, and to nobody else.
pub struct Sender {
    sender: EspNowSender,
    manager: EspNowManager,
    /// The driver took the primary key.
    keyed: bool,
    /// Who was met, and is still spoken to at the driver's own 1 Mb/s.
    slow: Vec<Address, MOST_MET>,
}

impl board::Sender for Sender {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> Sent {
        if self.slow.contains(to) {
            self.hasten(to);
        }
        match self.sender.send_async(to, payload).await {
            Ok(()) => Sent::Acknowledged,
            // To somebody who was not met, or longer than a message can be: no fault of the radio.
            Err(
                EspNowError::SendFailed
                | EspNowError::Error(Error::NotFound | Error::InvalidArgument | Error::InterfaceMismatch),
            ) => Sent::Unheard,
            Err(_) => Sent::Refused,
        }
    }
}

impl board::Encryption for Sender {
    fn primary(&mut self, key: &RadioKey) {
        // Broadcast stays in the list: it is not fetched. As often as the list is long, should the driver not let one go.
        for _ in 0..MOST_MET {
            let Ok(peer) = self.manager.fetch_peer(true) else { break };
            // Whom the driver does not let go keeps an old key, with which nothing is understood.
            let _ = self.manager.remove_peer(&peer.peer_address);
        }
        self.slow.clear();
        self.keyed = self.manager.set_pmk(key).is_ok();
    }

    fn meet(&mut self, address: &Address, local: &RadioKey) -> bool {
        let peer = PeerInfo {
            interface: EspNowWifiInterface::Station,
            peer_address: *address,
            lmk: Some(*local),
            channel: None,
            encrypt: true,
        };
        let known = self.manager.peer_exists(address);
        let met = if known { self.manager.modify_peer(peer) } else { self.manager.add_peer(peer) };
        // Without the primary key the others mean nothing.
        if !self.keyed || met.is_err() {
            return false;
        }
        self.hasten(address);
        true
    }
}

impl Sender {
    /// Speaks to a peer at the fixed rate from now on, or tries again before the next message.
    fn hasten(&mut self, address: &Address) {
        self.slow.retain(|slow| slow != address);
        if self.manager.set_peer_rate(address, RATE).is_err() {
            // There is room: nobody is in it twice.
            let _ = self.slow.push(*address);
        }
    }
}
