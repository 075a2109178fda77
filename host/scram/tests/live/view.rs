//! `scram view --live --port`: robots behind a serial port, as a page in a browser has them.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use control::State;
use recording::{ReadOptions, load_with};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket, client};

use crate::common::tty::OnTty;

/// The program while it serves its page.
struct Served {
    program: Child,
    url: String,
}

impl Served {
    fn start(robots: &OnTty, arguments: &[&str]) -> Self {
        let mut program = robots
            .command("view --live --json --listen 127.0.0.1:0", arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("scram runs");
        let mut line = String::new();
        BufReader::new(program.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
        let told: Value = serde_json::from_str(&line).expect("JSON");
        Self { program, url: told["url"].as_str().expect("an address").to_owned() }
    }

    /// A page's connection, as a browser makes it.
    fn connect(&self) -> Page {
        let (site, query) = self.url.strip_prefix("http://").and_then(|url| url.split_once('/')).expect("an address");
        let mut request = format!("ws://{site}/live{query}").into_client_request().expect("a request");
        request.headers_mut().insert("Origin", format!("http://{site}").parse().expect("a header"));
        let stream = TcpStream::connect(site).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a time");
        Page(client(request, stream).expect("a handshake").0)
    }

    /// Ends it as Ctrl-C does, and gives its exit code.
    fn interrupt(mut self) -> Option<i32> {
        let sent = Command::new("kill").args(["-INT", &self.program.id().to_string()]).status().expect("kill runs");
        assert!(sent.success());
        self.program.wait().expect("it ends").code()
    }
}

struct Page(WebSocket<TcpStream>);

impl Page {
    fn say(&mut self, message: &Value) {
        self.0.send(Message::text(message.to_string())).expect("it listens");
    }

    /// The first message for which something holds; the page says meanwhile that it can be seen.
    fn wait_for(&mut self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(20) {
            self.say(&json!({ "kind": "beat" }));
            let told: Value =
                serde_json::from_str(self.0.read().expect("a message").to_text().expect("text")).expect("JSON");
            if holds(&told) {
                return told;
            }
        }
        panic!("not within 20 s: {what}");
    }
}

#[test]
fn a_robot_behind_a_port_is_driven_from_the_page_and_stops_when_the_page_goes() {
    let robots = OnTty::new(1);
    let served = Served::start(&robots, &["--drive"]);
    assert!(served.url.contains("?token="), "who drives has a token: {}", served.url);
    let mut page = served.connect();
    page.wait_for("a robot", |told| told["robots"][0]["present"] == true);
    page.say(&json!({ "kind": "command", "text": "clear; freq 7" }));
    page.wait_for("its speed", |told| {
        let newest = told["points"]["frequency_hz"].as_array().and_then(|points| points.last());
        newest.and_then(|point| point[1].as_f64()).is_some_and(|frequency| (frequency - 7.0).abs() < 0.4)
    });
    assert_eq!(robots.states()[0].0, State::Speed);
    drop(page);
    robots.wait_until("it stops", |robots| robots.states()[0].0 == State::Idle);
    assert_eq!(served.interrupt(), Some(0));
    let recorded = load_with(&robots.recording(), &ReadOptions::default()).expect("it is read").recording;
    assert!(recorded.t_s.len() > 50, "{} readings", recorded.t_s.len());
}

#[test]
fn a_page_that_looks_on_drives_no_robot_behind_a_port() {
    let robots = OnTty::new(1);
    let served = Served::start(&robots, &["--command", "clear; freq 7"]);
    let mut page = served.connect();
    page.wait_for("its speed", |told| told["robots"][0]["state"] == "speed");
    page.say(&json!({ "kind": "command", "text": "stop" }));
    let refused = page.wait_for("an answer", |told| told["kind"] == "refused");
    assert!(refused["text"].as_str().expect("text").contains("only looks on"), "{refused}");
    assert_eq!(robots.states()[0].0, State::Speed);
    assert_eq!(served.interrupt(), Some(0));
    robots.wait_until("it stops", |robots| robots.states()[0].0 != State::Speed);
}
