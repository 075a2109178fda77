//! ESP-NOW behind the traits of [`shell::board`]: unicast at a fixed rate on a fixed channel, encrypted (CCMP) to and from
//! everybody who was met.
//!
//! Broadcasts are never encrypted. The driver receives them from anybody without being told, and its list of peers has the
//! broadcast address from the start, so that they can be sent. Who may say what, `control::protocol::secure` decides.

use control::protocol::radio::LONGEST;
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_radio::esp_now::{
    EspNowError, EspNowManager, EspNowReceiver, EspNowSender, EspNowWifiInterface, PeerInfo, PhyMode, RateConfig,
    WifiPhyRate,
};
use esp_radio::wifi::{ControllerConfig, WifiController, WifiError};
use heapless::Vec;
use shell::board::{self, Address, RadioKey, Received};

/// Channel of the robot and of the dongle: the lowest, allowed everywhere.
pub const CHANNEL: u8 = 1;
/// 6 Mb/s (OFDM): a telemetry message is in the air for 0.3 ms, not for the 1.5 ms of the default 1 Mb/s.
const RATE: RateConfig = RateConfig { phy_mode: PhyMode::_11g, rate: WifiPhyRate::Rate6m, ersu: false, dcm: false };
/// Whom a radio can meet: the keys that the hardware holds, all of them for ESP-NOW. The driver's own choice is 7.
pub const MOST_MET: usize = 17;
/// Room for the radio's buffers, queues and task stacks, bytes.
pub const HEAP_BYTES: usize = 72 * 1024;

/// Why there is no radio.
#[derive(Debug, thiserror::Error)]
pub enum RadioError {
    /// The driver did not start.
    #[error("the radio does not start: {0:?}")]
    Wifi(WifiError),
    /// The driver refuses the channel.
    #[error("the radio refuses channel {CHANNEL}: {0:?}")]
    Channel(EspNowError),
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
    // The driver lives on in the parts below. It does not save power by sleeping (its default), which would cost latency.
    let config = ControllerConfig::default().with_espnow_max_encrypt_num(MOST_MET as u8);
    let controller = WifiController::new(wifi, config).map_err(RadioError::Wifi)?;
    let (manager, sender, receiver) = controller.esp_now().split();
    manager.set_channel(CHANNEL).map_err(RadioError::Channel)?;
    Ok((Receiver(receiver), Sender { sender, manager, keyed: false, slow: Vec::new() }))
}

/// The receiving half.
pub struct Receiver(EspNowReceiver);

impl board::Receiver for Receiver {
    async fn receive(&mut self) -> Received {
        loop {
            let message = self.0.receive_async().await;
            // Longer ones exist only in ESP-NOW's second version, which nobody of ours sends.
            if message.data().len() > LONGEST {
                continue;
            }
            let Ok(payload) = Vec::from_slice(message.data()) else { continue };
            let rssi = message.info.rx_control.rssi.clamp(i8::MIN.into(), i8::MAX.into()) as i8;
            return Received { from: message.info.src_address, rssi, payload };
        }
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
    async fn send(&mut self, to: &Address, payload: &[u8]) -> bool {
        if self.slow.contains(to) {
            self.hasten(to);
        }
        self.sender.send_async(to, payload).await.is_ok()
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
