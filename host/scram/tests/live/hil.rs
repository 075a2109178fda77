//! A chip in the loop: the same decisions over a line that loses, flips, doubles and invents bytes; and what is said
//! where there is no chip.

use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;

use assert_cmd::Command;
use control::protocol::VERSION;
use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::lockstep::{Answer, AnswerFrame, Cost, Hello, Meter, Question, QuestionFrame, Server, Target};
use control::{Controller, Parameters};
use hal_sim::{Settings, SimulatedRobot};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use robot_file::Robot;
use scram::hil::{Client, HilError, Remote, Transport};
use simulation::{Drive, Plan, Scheduled, Trace, closed_loop, closed_loop_with};

struct OnHost;

impl Meter for OnHost {
    const TARGET: Target = Target::Host;

    fn measure<R>(&mut self, tick: impl FnOnce() -> R) -> (R, Cost) {
        (tick(), Cost { time: 7, stack: 11 })
    }
}

/// Shares of bytes, in 1/10000.
#[derive(Clone, Copy, Default)]
struct Noise {
    lost: u32,
    flipped: u32,
    doubled: u32,
    invented: u32,
}

/// A chip in this process, and the line to it.
struct Chip {
    server: Server<OnHost>,
    deframer: Deframer,
    noise: Noise,
    random: Pcg64,
    to_host: VecDeque<u8>,
    /// Bytes of all kinds that the noise touched.
    touched: u32,
    /// What it says instead of its version.
    version: u32,
    /// It is reset before this request.
    reset_before: Option<u32>,
}

impl Chip {
    fn new(noise: Noise, seed: u64) -> Self {
        Self {
            server: Server::new(OnHost),
            deframer: Deframer::default(),
            noise,
            random: Pcg64::seed_from_u64(seed),
            to_host: VecDeque::new(),
            touched: 0,
            version: VERSION,
            reset_before: None,
        }
    }

    /// What comes out of the line's other end.
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let Noise { lost, flipped, doubled, invented } = self.noise;
        let mut out = Vec::new();
        for byte in bytes {
            let mut drawn = |share: u32| share > 0 && self.random.random_range(0..10_000) < share;
            let (lost, flipped, doubled, invented) = (drawn(lost), drawn(flipped), drawn(doubled), drawn(invented));
            self.touched += [lost, flipped, doubled, invented].into_iter().map(u32::from).sum::<u32>();
            if invented {
                out.push(self.random.random());
            }
            if lost {
                continue;
            }
            let byte = if flipped { byte ^ (1 << self.random.random_range(0..8)) } else { *byte };
            out.extend(std::iter::repeat_n(byte, 1 + usize::from(doubled)));
        }
        out
    }
}

impl Transport for &mut Chip {
    fn send(&mut self, bytes: &[u8]) -> Result<(), HilError> {
        for byte in self.carry(bytes) {
            let Some(Ok(request)) = self.deframer.push::<QuestionFrame>(byte) else { continue };
            if self.reset_before == Some(request.number) {
                self.server = Server::new(OnHost);
            }
            let mut reply = self.server.serve(&request, self.deframer.bad());
            if let Answer::Hello(hello) = reply.answer {
                reply.answer = Answer::Hello(Hello { version: self.version, ..hello });
            }
            let mut frame = [0; LONGEST + 1];
            let frame = encode(&reply, &mut frame).expect("a reply is short");
            let carried = self.carry(frame);
            self.to_host.extend(carried);
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, HilError> {
        let count = buffer.len().min(self.to_host.len());
        for (slot, byte) in buffer.iter_mut().zip(self.to_host.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

fn robot() -> Robot {
    Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml")).expect("the project's robot")
}

fn parameters(robot: &Robot) -> Parameters {
    robot_file::design::design(robot).expect("a design").parameters
}

fn plan() -> Plan {
    let script = "freq 7\n0.6 oscillate -100..100\n1.2 freq 99\n1.3 freq -6\nwait 1\n";
    let drive = Drive::parse_script(script, Path::new("script")).expect("a script");
    Plan { drive, seconds: 2.0, faults: Scheduled::parse_list("sensor-open@1.8").expect("a fault") }
}

fn simulated(robot: &Robot) -> SimulatedRobot {
    SimulatedRobot::with(robot, 1, &Settings::default())
}

fn plain(robot: &Robot) -> Trace {
    closed_loop(simulated(robot), Controller::new(&parameters(robot)).expect("a controller"), &plan())
}

#[test]
fn a_chip_decides_like_the_host_over_any_line() {
    let robot = robot();
    let plain = plain(&robot);
    assert!(plain.commands.iter().any(|given| given.refusal.is_some()), "the script holds a refusal");
    let noises = [
        Noise::default(),
        Noise { lost: 10, ..Noise::default() },
        Noise { flipped: 10, ..Noise::default() },
        Noise { doubled: 10, ..Noise::default() },
        Noise { invented: 10, ..Noise::default() },
        Noise { lost: 8, flipped: 8, doubled: 8, invented: 8 },
    ];
    for (seed, noise) in noises.into_iter().enumerate() {
        let mut chip = Chip::new(noise, seed as u64);
        let mut remote = Client::connect(&mut chip)
            .and_then(|client| Remote::start(client, &parameters(&robot)))
            .expect("a chip at the other end");
        let trace = closed_loop_with(simulated(&robot), &mut remote, &plan()).expect("a run");
        assert_eq!(trace.ticks, plain.ticks);
        assert_eq!(trace.commands, plain.commands);
        let (counts, ticks) = (remote.counts(), remote.ticks().clone());
        assert_eq!((ticks.costs.len(), ticks.median_and_worst(), ticks.stack), (2000, Some((7, 7)), 11));
        let told = counts.resent + counts.bad_here + counts.bad_there;
        assert_eq!(told > 0, chip.touched > 0, "{} bytes touched, {counts:?}", chip.touched);
        if chip.touched > 0 {
            // Damage to what was not needed any more, e.g. between two frames, is neither seen nor of any harm.
            assert!(chip.touched > 50 && told > 50 && counts.resynchronised > 10, "{} {counts:?}", chip.touched);
            assert!(counts.resent <= counts.bad_here + counts.bad_there + chip.touched, "{counts:?}");
        }
    }
}

#[test]
fn a_line_that_is_cut_ends_the_run_with_what_came() {
    let mut chip = Chip::new(Noise { lost: 10_000, ..Noise::default() }, 1);
    match Client::connect(&mut chip).map(|_| ()) {
        Err(HilError::NoAnswer { tries, counts, .. }) => assert!(tries > 20 && counts.bytes == 0),
        other => panic!("{other:?}"),
    }
    let mut chip = Chip::new(Noise { flipped: 5000, ..Noise::default() }, 1);
    match Client::connect(&mut chip).map(|_| ()) {
        Err(error @ HilError::NoAnswer { .. }) => assert!(error.to_string().starts_with("nobody answers"), "{error}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn another_version_is_refused() {
    let mut chip = Chip::new(Noise::default(), 1);
    chip.version = VERSION + 1;
    match Client::connect(&mut chip).map(|_| ()) {
        Err(HilError::Version { theirs }) => assert_eq!(theirs, VERSION + 1),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_chip_that_is_reset_in_the_run_is_noticed() {
    let robot = robot();
    let mut chip = Chip::new(Noise::default(), 1);
    chip.reset_before = Some(500);
    let client = Client::connect(&mut chip).expect("a chip");
    let mut remote = Remote::start(client, &parameters(&robot)).expect("a controller");
    match closed_loop_with(simulated(&robot), &mut remote, &plan()).map(|_| ()) {
        Err(HilError::Forgot) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn parameters_that_no_controller_takes_are_refused() {
    let mut chip = Chip::new(Noise::default(), 1);
    let wrong = Parameters { tick: f32::NAN, ..parameters(&robot()) };
    let client = Client::connect(&mut chip).expect("a chip");
    assert!(matches!(Remote::start(client, &wrong).map(|_| ()), Err(HilError::Parameters)));
}

#[test]
fn a_request_is_served_once_and_answered_as_often_as_it_is_asked() {
    let robot = robot();
    let mut server = Server::new(OnHost);
    let mut ask = |number, question| server.serve(&QuestionFrame { number, question }, 0);
    let tick = Question::Tick(control::Sample::default());
    assert!(matches!(ask(5, tick).answer, Answer::OutOfOrder));
    assert!(matches!(ask(5, Question::Hello).answer, Answer::Hello(_)));
    assert!(matches!(ask(6, tick).answer, Answer::OutOfOrder), "no controller was started");
    assert!(matches!(ask(7, Question::Start(parameters(&robot))).answer, Answer::Started(true)));
    let first = ask(8, tick);
    assert_eq!(first, ask(8, tick));
    let AnswerFrame { answer: Answer::Ticked(ticked), .. } = first else { panic!("{first:?}") };
    assert_eq!(ticked.count, 1);
    assert!(matches!(ask(10, tick).answer, Answer::OutOfOrder), "9 is missing");
    assert!(matches!(ask(9, tick).answer, Answer::Ticked(ticked) if ticked.count == 2));
}

fn scram(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("scram").expect("the binary");
    command.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).arg("hil").args(arguments);
    command
}

fn refused(mut command: Command, code: i32) -> String {
    let output = command.assert().code(code).get_output().clone();
    String::from_utf8(output.stderr).expect("text")
}

#[test]
fn what_is_missing_is_said() {
    let said = refused(scram(&["--port", "/dev/no-such-port"]), 1);
    assert!(said.contains("there is no serial port /dev/no-such-port"), "{said}");
    let mut without = scram(&["--qemu"]);
    without.env("PATH", "/nowhere");
    let said = refused(without, 1);
    assert!(said.contains("qemu-system-riscv32") && said.contains("qemu-system-misc"), "{said}");
    for wrong in [&[][..], &["--port", "x", "--qemu"], &["--port", "x", "--elf", "y"]] {
        let said = refused(scram(wrong), 2);
        assert!(said.contains("--qemu"), "{said}");
    }
}

#[cfg(unix)]
mod port {
    use std::io::{Read, Write};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread::JoinHandle;

    use serialport::{SerialPort, TTYPort};

    use super::*;

    /// A board at the other end of a pseudo-terminal.
    struct Board {
        done: Arc<AtomicBool>,
        thread: Option<JoinHandle<()>>,
    }

    impl Board {
        fn start(mut terminal: TTYPort, mut chip: Chip) -> Self {
            terminal.set_timeout(Duration::from_millis(20)).expect("a timeout");
            let done = Arc::new(AtomicBool::new(false));
            let seen = Arc::clone(&done);
            let thread = std::thread::spawn(move || {
                let mut buffer = [0; 256];
                let mut talked = false;
                while !seen.load(Ordering::Relaxed) {
                    let Ok(count) = terminal.read(&mut buffer) else {
                        // Nothing came, or nobody has the port open yet.
                        std::thread::sleep(Duration::from_millis(1));
                        continue;
                    };
                    if !talked {
                        // A board's loader talks before its program.
                        let _ = terminal.write_all(b"ESP-ROM:esp32c3\r\nboot:0xc\r\n");
                        talked = true;
                    }
                    let _ = Transport::send(&mut &mut chip, &buffer[..count]);
                    let answer: Vec<u8> = chip.to_host.drain(..).collect();
                    let _ = terminal.write_all(&answer);
                }
            });
            Self { done, thread: Some(thread) }
        }
    }

    impl Drop for Board {
        fn drop(&mut self) {
            self.done.store(true, Ordering::Relaxed);
            let _ = self.thread.take().map(JoinHandle::join);
        }
    }

    fn files(out: &Path) -> Vec<(String, Vec<u8>)> {
        let read = |name: &str| (name.to_owned(), std::fs::read(out.join(name)).expect(name));
        ["run.mcap", "run.csv", "run.toml"].map(read).into()
    }

    #[test]
    fn a_board_on_a_port_makes_the_table_and_files_of_sim() {
        let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("a name");
        drop(slave);
        let _board = Board::start(master, Chip::new(Noise { lost: 1, flipped: 1, ..Noise::default() }, 1));
        let out = tempfile::tempdir().expect("a folder");
        let (ours, theirs) = (out.path().join("sim"), out.path().join("hil"));
        let run = |mut command: Command, out: &Path| {
            command.args(["--drive", "freq:-7", "--seconds", "0.5", "--json", "--out"]).arg(out);
            let output = command.assert().success().get_output().clone();
            serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
        };
        let hil = run(scram(&["--port", &name]), &theirs);
        let mut sim = Command::cargo_bin("scram").expect("the binary");
        sim.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")).arg("sim");
        let sim = run(sim, &ours);
        assert_eq!(hil["mean_frequency_hz"], sim["mean_frequency_hz"]);
        assert_eq!(hil["chip"]["cost_median"], 7);
        assert!(sim["chip"].is_null());
        assert_eq!(files(&theirs), files(&ours));
    }

    #[test]
    fn a_port_where_nobody_answers_says_what_to_do() {
        let (_master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let name = slave.name().expect("a name");
        drop(slave);
        let said = refused(scram(&["--port", &name]), 1);
        assert!(said.contains("nobody answers") && said.contains("flash-hil"), "{said}");
    }
}
