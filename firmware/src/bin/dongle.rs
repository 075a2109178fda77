//! The dongle: starts the tasks of [`shell::dongle`] on a board at the host's USB port. It prints nothing but panics: the
//! line belongs to the frames.

#![no_std]
#![no_main]

use embassy_executor::{Spawner, task};
use esp_hal::clock::CpuClock;
use esp_hal::timer::timg::TimerGroup;
use esp_hal::{Config, main};
use firmware::board::{Dongle, SerialReceiver, SerialSender};
use firmware::memory::HEAP_BYTES;
use firmware::radio::{self, CHANNEL, Driver, Receiver, Sender};
use firmware::reset::SoftwareReset;
use firmware::watchdog::{self, Watchdog};
use shell::dongle::{Identity, Parts, Shared};

esp_bootloader_esp_idf::esp_app_desc!();

static SHARED: Shared = Shared::new();

#[main]
async fn main(spawner: Spawner) {
    let board = Dongle::new(esp_hal::init(Config::default().with_cpu_clock(CpuClock::max())));
    esp_alloc::heap_allocator!(size: HEAP_BYTES);
    esp_rtos::start(TimerGroup::new(board.scheduler.timer).timer0, board.scheduler.interrupt);
    let watchdog = watchdog::arm(board.watchdog);
    // Without a radio there is nothing to do but tell why, reset, and try again.
    let (receiver, sender) = radio::start(board.radio).unwrap_or_else(|error| panic!("{error}"));
    let task = run(board.serial_receiver, board.serial_sender, receiver, sender, watchdog);
    spawner.spawn(task.unwrap_or_else(|error| panic!("the only task: {error}")));
}

#[task]
async fn run(from_host: SerialReceiver, to_host: SerialSender, receiver: Receiver, sender: Sender, watchdog: Watchdog) {
    let identity = Identity { address: radio::address(), channel: CHANNEL };
    let parts = Parts { from_host, to_host, receiver, sender, gauge: Driver, watchdog, restart: SoftwareReset };
    shell::dongle::run(parts, identity, &SHARED).await
}
