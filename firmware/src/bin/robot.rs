//! The robot: starts the tasks of [`shell::robot`] on the board.

#![no_std]
#![no_main]

use control::protocol::radio::Reset;
use control::{Controller, ParameterError};
use embassy_executor::{SpawnError, Spawner, task};
use esp_hal::clock::CpuClock;
use esp_hal::peripherals::TIMG1;
use esp_hal::time::Duration;
use esp_hal::timer::timg::TimerGroup;
use esp_hal::{Config, main};
use esp_println::println;
use esp_rtos::embassy::InterruptExecutor;
use firmware::adc::Inputs;
use firmware::board::{self, Analog, BridgePins, Robot};
use firmware::bridge::PwmBridge;
use firmware::flash::Flash;
use firmware::led::StatusLed;
use firmware::radio::{self, HEAP_BYTES, RadioError, Receiver, Sender};
use firmware::watchdog::{self, Watchdog};
use firmware::{reset, tick};
use shell::image::Image;
use shell::robot::{About, Parts, Shared, period_us};
use static_cell::StaticCell;

esp_bootloader_esp_idf::esp_app_desc!();

/// What `build.rs` took from the robot file.
static BUILT_IN: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/robot.postcard"));

static SHARED: Shared = Shared::new();
static CONTROLLER: StaticCell<Controller> = StaticCell::new();
static IMAGE: StaticCell<Image> = StaticCell::new();
static ABOUT: StaticCell<About> = StaticCell::new();
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
    spawner.spawn(led(StatusLed::new(board.led))?);

    let image = IMAGE.init(Image::read(BUILT_IN).map_err(BootError::Image)?);
    let mut flash = Flash::new(board.flash);
    let partition = flash.parameters().unwrap_or_else(|| {
        println!("no partition for parameters, the factory's are used: flash with this project's partitions.csv");
        0..0
    });
    let (about, controller) = shell::robot::boot(&mut flash, partition, &image.settings, reset).await;
    println!("{} on {}, reset: {:?}, parameters: {:?}", about.name, board::NAME, about.reset, about.parameters);
    let controller = CONTROLLER.init(controller.map_err(BootError::Parameters)?);
    let about = ABOUT.init(about);

    let (receiver, sender) = radio::start(board.radio)?;
    println!("radio address {:02x?}, channel {}", radio::address(), radio::CHANNEL);
    let above = LOOP.init(InterruptExecutor::new(board.loop_interrupt)).start(tick::PRIORITY);
    above.spawn(control_loop(board.analog, board.bridge, board.loop_timer, watchdog, controller, image)?);
    spawner.spawn(receive(receiver)?);
    spawner.spawn(send(sender, about)?);
    Ok(())
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
    let converter = Inputs::new(analog, image.curve);
    let parts = Parts { converter, bridge, watchdog };
    let work = shell::robot::control_loop(parts, controller, &image.settings, &SHARED);
    tick::above_the_radio(timer, period, work).await
}

#[task]
async fn receive(receiver: Receiver) {
    shell::robot::receive(receiver, &SHARED).await
}

#[task]
async fn send(sender: Sender, about: &'static About) {
    shell::robot::send(sender, about, &SHARED).await
}

#[task]
async fn led(led: StatusLed) {
    shell::robot::led(led, &SHARED).await
}
