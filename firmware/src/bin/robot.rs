//! The robot: starts the tasks of [`shell::robot`] on the board.

#![no_std]
#![no_main]

use core::ops::Range;

use control::protocol::radio::Reset;
use control::protocol::secure::SessionReceiver;
use control::{Controller, ParameterError};
use embassy_executor::{SpawnError, Spawner, task};
use esp_hal::clock::CpuClock;
use esp_hal::peripherals::{TIMG1, WIFI};
use esp_hal::rng::TrngError;
use esp_hal::time::Duration;
use esp_hal::timer::timg::TimerGroup;
use esp_hal::{Config, main};
use esp_println::println;
use esp_rtos::embassy::InterruptExecutor;
use firmware::adc::Inputs;
use firmware::board::{self, Analog, BridgePins, Robot, SerialReceiver, SerialSender};
use firmware::bridge::PwmBridge;
use firmware::flash::{Flash, GAIT, PAIRING, PARAMETERS};
#[cfg(feature = "inject")]
use firmware::inject::ImageFaultInjector;
use firmware::led::StatusLed;
use firmware::memory::HEAP_BYTES;
use firmware::radio::{self, Driver, RadioError, Receiver, Sender};
use firmware::random::Random;
use firmware::reset::SoftwareReset;
use firmware::watchdog::{self, Watchdog};
use firmware::{reset, tick};
use shell::board::{Address, Encryption};
use shell::image::Image;
use shell::robot::{About, Booted, Identity, Parts, Shared, period_us};
use shell::store::Partitions;
use shell::store::pairing::Pairing;
use static_cell::StaticCell;

esp_bootloader_esp_idf::esp_app_desc!();

/// What `build.rs` took from the robot file.
static BUILT_IN: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/robot.postcard"));

static SHARED: Shared = if cfg!(feature = "inject") { Shared::injectable() } else { Shared::new() };
static CONTROLLER: StaticCell<Controller> = StaticCell::new();
static IMAGE: StaticCell<Image> = StaticCell::new();
static ABOUT: StaticCell<About> = StaticCell::new();
static IDENTITY: StaticCell<Identity> = StaticCell::new();
static PARTITIONS: StaticCell<Partitions> = StaticCell::new();
static LOOP: StaticCell<InterruptExecutor<2>> = StaticCell::new();

#[main]
async fn main(spawner: Spawner) {
    board::cut_bridge();
    let reset = reset::reason();
    let board = Robot::new(esp_hal::init(Config::default().with_cpu_clock(CpuClock::max())));
    esp_alloc::heap_allocator!(size: HEAP_BYTES);
    if let Err(error) = start(spawner, board, reset).await {
        // The bridge is open, the LED says that nothing has started, and soon the watchdog tries again.
        println!("not started: {error}");
    }
}

/// Starts every task, the control loop first of those that need one another's work. The bridge is open until the control
/// loop closes it.
async fn start(spawner: Spawner, board: Robot, reset: Reset) -> Result<(), BootError> {
    esp_rtos::start(TimerGroup::new(board.scheduler.timer).timer0, board.scheduler.interrupt);
    let watchdog = watchdog::arm(board.watchdog);
    #[cfg(feature = "inject")]
    ImageFaultInjector::take_led(&board.led);
    spawner.spawn(led(StatusLed::new(board.led))?);

    let image = IMAGE.init(Image::read(BUILT_IN).map_err(BootError::Image)?);
    let mut flash = Flash::new(board.flash);
    let partitions = PARTITIONS.init(Partitions {
        parameters: partition(&mut flash, PARAMETERS),
        pairing: partition(&mut flash, PAIRING),
        gait: partition(&mut flash, GAIT),
    });
    let Booted { about, controller, pairing } =
        shell::robot::boot(&mut flash, partitions, &image.settings, reset).await;
    #[cfg(feature = "inject")]
    println!("{}", firmware::inject::NOTICE);
    println!("{} on {}, reset: {:?}, parameters: {:?}", about.name, board::NAME, about.reset, about.parameters);
    let controller = CONTROLLER.init(controller.map_err(BootError::Parameters)?);
    let console = pairing.as_ref().ok().map(|pairing| pairing.console);
    let identity = IDENTITY.init(Identity { address: radio::address(), name: about.name.clone(), console });

    // The radio is started before the control loop, which keeps everything below it waiting.
    let talking = match pairing {
        Ok(pairing) => talk(board.radio, &pairing)?,
        Err(why) => {
            println!("obeys nobody: {why}. The radio stays off. To pair it:  scram pair --port PORT --dongle PORT");
            None
        }
    };
    let above = LOOP.init(InterruptExecutor::new(board.loop_interrupt)).start(tick::PRIORITY);
    above.spawn(control_loop(board.analog, board.bridge, board.loop_timer, watchdog, controller, image)?);
    spawner.spawn(persistence_task(flash, partitions, image)?);
    spawner.spawn(pair(board.serial_receiver, board.serial_sender, identity)?);
    if let Some(Talking { receiver, sender, ear, random, console }) = talking {
        spawner.spawn(receive(receiver, ear, console, random)?);
        spawner.spawn(send(sender, console, ABOUT.init(about))?);
    }
    Ok(())
}

/// Where a partition is; nowhere, if the flash has none, and then nothing is found or kept there.
fn partition(flash: &mut Flash, label: &str) -> Range<u32> {
    flash.partition(label).unwrap_or_else(|| {
        println!("no partition `{label}`, nothing is kept there: flash with this project's partitions.csv");
        0..0
    })
}

/// What it takes to talk with the console.
struct Talking {
    receiver: Receiver,
    sender: Sender,
    ear: SessionReceiver,
    random: Random,
    console: Address,
}

/// Starts the radio for the one console. Without one where the radio refuses its address or its keys: the robot can still be
/// paired anew.
fn talk(wifi: WIFI<'static>, pairing: &Pairing) -> Result<Option<Talking>, BootError> {
    let (receiver, mut sender) = radio::start(wifi)?;
    sender.primary(&pairing.primary);
    if !sender.meet(&pairing.console, &pairing.local) {
        println!("the radio refuses the pairing with {:02x?}: pair again", pairing.console);
        return Ok(None);
    }
    let random = Random::new().map_err(BootError::Random)?;
    let console = pairing.console;
    println!("radio address {:02x?}, channel {}, obeys {console:02x?}", radio::address(), radio::CHANNEL);
    Ok(Some(Talking { receiver, sender, ear: SessionReceiver::new(pairing.key.clone()), random, console }))
}

/// Why the robot does not start.
#[derive(Debug, thiserror::Error)]
enum BootError {
    #[error("the robot that was built in cannot be read ({0}): build again with `cargo clean` before it")]
    Image(postcard::Error),
    #[error("the controller refuses its parameters: {0}")]
    Parameters(ParameterError),
    #[error("{0}")]
    Radio(#[from] RadioError),
    #[error("the radio runs, and yet the chip has no true randomness: {0:?}")]
    Random(TrngError),
    #[error("a task was started twice")]
    Task(#[from] SpawnError),
}

#[task]
async fn control_loop(
    analog: Analog,
    pins: BridgePins,
    timer: TIMG1<'static>,
    watchdog: Watchdog,
    controller: &'static mut Controller,
    image: &'static Image,
) {
    // Not before: the parts cannot be handed from one executor to another.
    let bridge = match PwmBridge::new(pins, &image.pwm) {
        Ok(bridge) => bridge,
        Err(error) => return println!("not started: {error}"),
    };
    let period = Duration::from_micros(period_us(controller.parameters()).into());
    let converter = Inputs::new(analog, image.curve, image.settings.parameters.second.is_some());
    #[cfg(feature = "inject")]
    let converter = shell::inject::Converter::new(converter, ImageFaultInjector, &SHARED);
    let parts = Parts { converter, bridge, watchdog };
    let work = shell::robot::control_loop(parts, controller, &image.settings, &SHARED);
    tick::above_the_radio(timer, period, work).await
}

#[task]
async fn receive(receiver: Receiver, ear: SessionReceiver, console: Address, random: Random) {
    shell::robot::receive(receiver, ear, console, random, &SHARED).await
}

#[task]
async fn send(sender: Sender, console: Address, about: &'static About) {
    #[cfg(feature = "inject")]
    let sender = shell::inject::Sender::new(sender, ImageFaultInjector, &SHARED);
    shell::robot::send(sender, Driver, SoftwareReset, console, about, &SHARED).await
}

#[task]
async fn persistence_task(flash: Flash, partitions: &'static Partitions, image: &'static Image) {
    shell::robot::persistence_task(flash, partitions, &image.settings.parameters, &SHARED).await
}

#[task]
async fn pair(from_host: SerialReceiver, to_host: SerialSender, identity: &'static Identity) {
    shell::robot::pair(from_host, to_host, SoftwareReset, identity, &SHARED).await
}

#[task]
async fn led(led: StatusLed) {
    shell::robot::led(led, &SHARED).await
}
