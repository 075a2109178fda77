//! A small HTTP server: the page, and the page's WebSocket. A thread a connection; nothing else is served.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message as Frame, WebSocket};

use super::access::{Access, Denied};
use super::driver::PageId;
use super::hub::{FromPage, Hub, Message};

/// Of a request: its length, its lines, and how long it may take to come.
const LONGEST_HEAD: usize = 8192;
const MOST_HEADERS: usize = 64;
const PATIENCE: Duration = Duration::from_secs(5);
/// Connections at once; more are closed unheard.
const MOST_CONNECTIONS: usize = 48;
/// How long a look at a WebSocket waits for bytes.
const LOOK: Duration = Duration::from_millis(10);
/// What a page may say at once, bytes.
const LONGEST_MESSAGE: usize = 4096;

/// Serves until it is dropped.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    query: String,
    ended: Arc<AtomicBool>,
}

/// What every connection needs.
struct Site {
    access: Access,
    page: String,
    hub: Arc<Hub>,
    ended: Arc<AtomicBool>,
    connections: AtomicUsize,
}

impl Server {
    /// Serves a page and its messages at an address; port 0 takes a free one.
    ///
    /// # Errors
    /// The address is taken or not this computer's, or the system has no randomness for the token.
    pub fn start(address: SocketAddr, drive: bool, page: String, hub: Arc<Hub>) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let access = Access::new(address, drive).map_err(io::Error::other)?;
        let query = access.query();
        let ended = Arc::new(AtomicBool::new(false));
        let site = Site { access, page, hub, ended: Arc::clone(&ended), connections: AtomicUsize::new(0) };
        std::thread::Builder::new().name("pages".to_owned()).spawn(move || accept(&listener, &Arc::new(site)))?;
        Ok(Self { address, query, ended })
    }

    /// What a person opens. Where the server listens everywhere, the number is this computer's own.
    #[must_use]
    pub fn url(&self) -> String {
        let mut address = self.address;
        if address.ip().is_unspecified() {
            address.set_ip(if address.is_ipv6() { [0_u16, 0, 0, 0, 0, 0, 0, 1].into() } else { [127, 0, 0, 1].into() });
        }
        format!("http://{address}/{}", self.query)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        // The thread that accepts looks up.
        let _ = self.url().strip_prefix("http://").and_then(|url| TcpStream::connect(url.split('/').next()?).ok());
    }
}

fn accept(listener: &TcpListener, site: &Arc<Site>) {
    for stream in listener.incoming() {
        if site.ended.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else { continue };
        if site.connections.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
            site.connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        let shared = Arc::clone(site);
        let thread = std::thread::Builder::new().name("page".to_owned()).spawn(move || {
            // A connection that breaks is the browser's business.
            let _ = serve(stream, &shared);
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        });
        if thread.is_err() {
            site.connections.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// Of a request, what is looked at.
#[derive(Debug, Default, PartialEq)]
struct Request {
    path: String,
    query: String,
    host: String,
    origin: String,
    /// The key of a WebSocket's handshake.
    key: Option<String>,
}

fn serve(mut stream: TcpStream, site: &Site) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let request = match read(&mut stream)? {
        Ok(request) => request,
        Err(status) => return answer(&mut stream, status, "this server shows one page"),
    };
    let denied = |stream: &mut TcpStream, why: Denied| answer(stream, "403 Forbidden", why.words());
    match (request.path.as_str(), &request.key) {
        ("/", None) => match site.access.page(&request.host, &request.query) {
            Ok(()) => send_page(&mut stream, &site.page),
            Err(why) => denied(&mut stream, why),
        },
        ("/live", Some(key)) => match site.access.socket(&request.host, &request.origin, &request.query) {
            Ok(()) => upgrade(stream, key, site),
            Err(why) => denied(&mut stream, why),
        },
        _ => answer(&mut stream, "404 Not Found", "there is only the page at /"),
    }
}

/// Reads the head of a request; a body is not waited for.
fn read(stream: &mut TcpStream) -> io::Result<Result<Request, &'static str>> {
    let until = Instant::now() + PATIENCE;
    let mut head = Vec::new();
    let mut bytes = [0; 1024];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() || head.len() > LONGEST_HEAD {
            return Ok(Err("400 Bad Request"));
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut bytes) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => head.extend_from_slice(&bytes[..count]),
            Err(error) => return Err(error),
        }
        if head.windows(4).any(|end| end == b"\r\n\r\n") {
            return Ok(parse(&head));
        }
    }
}

fn parse(head: &[u8]) -> Result<Request, &'static str> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    if !parsed.parse(head).is_ok_and(|status| status.is_complete()) {
        return Err("400 Bad Request");
    }
    if parsed.method != Some("GET") {
        return Err("405 Method Not Allowed");
    }
    let (path, query) =
        parsed.path.unwrap_or_default().split_once('?').unwrap_or((parsed.path.unwrap_or_default(), ""));
    let all = |name: &str| {
        let named = parsed.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
        named.map(|header| String::from_utf8_lossy(header.value).into_owned()).collect::<Vec<_>>()
    };
    // Said twice, one of them would be checked and the other believed.
    let only = |name: &str| match all(name).as_slice() {
        [] => Ok(String::new()),
        [value] => Ok(value.clone()),
        _ => Err("400 Bad Request"),
    };
    let is_socket = only("upgrade")?.eq_ignore_ascii_case("websocket") && only("sec-websocket-version")? == "13";
    let key = only("sec-websocket-key")?;
    Ok(Request {
        path: path.to_owned(),
        query: query.to_owned(),
        host: only("host")?,
        origin: only("origin")?,
        key: (is_socket && !key.is_empty()).then_some(key),
    })
}

/// Nothing is kept, guessed, framed or told on.
const HEADERS: &str = "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
    Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
    Content-Security-Policy: frame-ancestors 'none'\r\nConnection: close\r\n";

fn send_page(stream: &mut TcpStream, page: &str) -> io::Result<()> {
    let length = page.len();
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: {length}\r\n{HEADERS}\r\n"
    )?;
    stream.write_all(page.as_bytes())
}

fn answer(stream: &mut TcpStream, status: &str, words: &str) -> io::Result<()> {
    let length = words.len() + 1;
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {length}\r\n{HEADERS}\r\n{words}\n"
    )
}

fn upgrade(mut stream: TcpStream, key: &str, site: &Site) -> io::Result<()> {
    let Some((page, messages)) = site.hub.join() else {
        return answer(&mut stream, "503 Service Unavailable", "too many pages look at these robots");
    };
    let accepted = derive_accept_key(key.as_bytes());
    let said = write!(
        stream,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accepted}\r\n\r\n"
    );
    let ended = said.and_then(|()| stream.set_read_timeout(Some(LOOK))).and_then(|()| {
        let limits = WebSocketConfig::default()
            .read_buffer_size(LONGEST_MESSAGE)
            .max_message_size(Some(LONGEST_MESSAGE))
            .max_frame_size(Some(LONGEST_MESSAGE));
        let socket = WebSocket::from_raw_socket(stream, Role::Server, Some(limits));
        talk(socket, page, &messages, site).or_else(|error| match error {
            Error::Io(error) => Err(error),
            // Closed, or what came was no message.
            _ => Ok(()),
        })
    });
    // However it ended: the page may have driven.
    site.hub.leave(page);
    ended
}

/// Both ways until either end goes away.
fn talk(
    mut socket: WebSocket<TcpStream>,
    page: PageId,
    messages: &Receiver<Message>,
    site: &Site,
) -> Result<(), Error> {
    while !site.ended.load(Ordering::Relaxed) {
        loop {
            match messages.try_recv() {
                Ok(message) => socket.write(Frame::text(&*message))?,
                Err(TryRecvError::Empty) => break,
                // Too slow.
                Err(TryRecvError::Disconnected) => return socket.close(None),
            }
        }
        socket.flush()?;
        match socket.read() {
            Ok(Frame::Text(text)) => {
                if let Ok(said) = serde_json::from_str::<FromPage>(&text) {
                    site.hub.say(page, said);
                }
            }
            Ok(Frame::Close(_)) => return Ok(()),
            Ok(_) => {}
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
    }
    socket.close(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "GET /live?token=7 HTTP/1.1\r\nHost: 127.0.0.1:80\r\nOrigin: http://127.0.0.1:80\r\nUpgrade: websocket\r\n\
        Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

    #[test]
    fn a_request_is_read_and_what_is_ambiguous_is_refused() {
        let request = parse(HEAD.as_bytes()).unwrap();
        assert_eq!((request.path.as_str(), request.query.as_str()), ("/live", "token=7"));
        assert_eq!((request.host.as_str(), request.origin.as_str()), ("127.0.0.1:80", "http://127.0.0.1:80"));
        assert_eq!(request.key.as_deref(), Some("dGhlIHNhbXBsZSBub25jZQ=="));
        for (from, to, status) in [
            ("GET", "POST", "405 Method Not Allowed"),
            ("Host: 127.0.0.1:80\r\n", "Host: 127.0.0.1:80\r\nHost: evil.example\r\n", "400 Bad Request"),
            ("HTTP/1.1", "FTP", "400 Bad Request"),
        ] {
            assert_eq!(parse(HEAD.replace(from, to).as_bytes()), Err(status), "{to}");
        }
        let other = parse(HEAD.replace("Version: 13", "Version: 8").as_bytes()).unwrap();
        assert_eq!(other.key, None);
    }

    /// What a server says to a request.
    fn said(server: &Server, head: &str) -> String {
        let mut stream = TcpStream::connect(server.address).unwrap();
        stream.write_all(head.as_bytes()).unwrap();
        let mut said = String::new();
        let _ = stream.read_to_string(&mut said);
        said
    }

    #[test]
    fn the_page_is_given_to_whom_it_is_for() {
        let hub = Arc::new(Hub::default());
        let server = Server::start("127.0.0.1:0".parse().unwrap(), true, "the page".to_owned(), hub).unwrap();
        let url = server.url();
        let (host, path) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
        let get = |host: &str, path: &str| said(&server, &format!("GET /{path} HTTP/1.1\r\nHost: {host}\r\n\r\n"));
        let page = get(host, path);
        assert!(page.starts_with("HTTP/1.1 200 OK\r\n") && page.ends_with("\r\n\r\nthe page"), "{page}");
        assert!(page.contains("X-Frame-Options: DENY") && page.contains("Referrer-Policy: no-referrer"), "{page}");
        for (host, path, status) in [
            (host, "", "403"),
            ("evil.example", path, "403"),
            (host, "other", "404"),
            (host, "../../etc/passwd", "404"),
        ] {
            let said = get(host, path);
            assert!(said.starts_with(&format!("HTTP/1.1 {status} ")), "{host} {path}: {said}");
        }
    }
}
