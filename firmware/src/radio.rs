//! ESP-NOW behind the traits of [`shell::board`]: unicast at a fixed rate on a fixed channel, not encrypted.

use control::protocol::radio::LONGEST;
use esp_hal::efuse::{InterfaceMacAddress, interface_mac_address};
use esp_hal::peripherals::WIFI;
use esp_radio::esp_now::{
    BROADCAST_ADDRESS, EspNowError, EspNowManager, EspNowReceiver, EspNowSender, EspNowWifiInterface, PeerInfo,
    PhyMode, RateConfig, WifiPhyRate,
};
use esp_radio::wifi::{ControllerConfig, WifiController, WifiError};
use heapless::Vec;
use shell::board::{self, Address, Received};

/// Channel of the robot and of the dongle: the lowest, allowed everywhere.
pub const CHANNEL: u8 = 1;
/// 6 Mb/s (OFDM): a telemetry message is in the air for 0.3 ms, not for the 1.5 ms of the default 1 Mb/s.
const RATE: RateConfig = RateConfig { phy_mode: PhyMode::_11g, rate: WifiPhyRate::Rate6m, ersu: false, dcm: false };
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
    let controller = WifiController::new(wifi, ControllerConfig::default()).map_err(RadioError::Wifi)?;
    let (manager, sender, receiver) = controller.esp_now().split();
    manager.set_channel(CHANNEL).map_err(RadioError::Channel)?;
    Ok((Receiver(receiver), Sender { sender, manager }))
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

/// The sending half.
pub struct Sender {
    sender: EspNowSender,
    manager: EspNowManager,
}

impl board::Sender for Sender {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> bool {
        if !self.manager.peer_exists(to) && self.meet(to).is_err() {
            return false;
        }
        self.sender.send_async(to, payload).await.is_ok()
    }
}

impl Sender {
    /// Makes an address one that can be sent to. Where the driver's list (20) is full, the first in it goes.
    fn meet(&self, address: &Address) -> Result<(), EspNowError> {
        let peer = PeerInfo {
            interface: EspNowWifiInterface::Station,
            peer_address: *address,
            lmk: None,
            channel: None,
            encrypt: false,
        };
        if self.manager.add_peer(peer).is_err() {
            let first = self.manager.fetch_peer(true)?;
            self.manager.remove_peer(&first.peer_address)?;
            self.manager.add_peer(peer)?;
        }
        // Everybody is spoken to at the driver's own 1 Mb/s, fixed as well.
        if *address != BROADCAST_ADDRESS {
            self.manager.set_peer_rate(address, RATE)?;
        }
        Ok(())
    }
}
