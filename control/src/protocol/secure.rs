//! Who may drive: frames on the air that only a robot and the console it is paired with can make.
//!
//! ```text
//! version u32 | kind u8 | body | tag 16 bytes            little endian, at most 250 bytes
//!               Hello     console nonce                   under the pairing key
//!               Welcome   console nonce, robot nonce      under the pairing key
//!               Downlink     counter u32, console nonce,     under the session key
//!                         postcard
//!               ToAll     as an Downlink                     under the session key of the robot that is meant
//!               Uplink   counter u32, postcard           under the session key
//!               Notice    (nothing, and no tag)
//! ```
//!
//! A tag is HMAC-SHA-256 (RFC 2104, FIPS 180-4) of everything before it, cut to its first 16 bytes. The session key is
//! HMAC-SHA-256 of both nonces under the pairing key: a frame of another session, of another robot, or of the other
//! direction has a wrong tag. Within a session the counter only grows, so that a frame counts once. A robot changes to a new
//! session with the first downlink under it and not with the `Hello`, which somebody may have recorded: a replayed `Hello`
//! ends nothing.
//!
//! A replayed `Hello` begins nothing either, and keeps nobody from beginning: what a robot remembers between a `Hello` and
//! the first downlink is its own nonce alone, the same in its answer to whoever calls, until a session begins with it. The
//! console's nonce comes back with the downlink, as the cookie of DTLS does (RFC 9147, 5.1).
//!
//! A downlink to all is heard by the other robots of the console, too. To them its tag is wrong, and its nonce is not their
//! session's: they take it as meant for another one and not as forged.
//!
//! The layout up to `kind` stays for ever. It is how ends of different versions find that out; the notice says so to a
//! console, and nobody believes it more than that.

use hmac::{Hmac, KeyInit, Mac};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use sha2::Sha256;

use super::VERSION;
use super::radio::LONGEST;

/// Part of the version: raise it with every change of what a frame is made of, which no schema tells.
pub const LAYOUT: u32 = 2;
/// Bytes of a tag.
pub const TAG: usize = 16;
/// Bytes before a body: version and kind.
pub const HEAD: usize = 5;
/// Longest postcard message in an uplink, bytes; in a downlink it is 8 bytes shorter.
pub const LONGEST_BODY: usize = LONGEST - HEAD - COUNTER - TAG;

const COUNTER: usize = 4;
const NONCE: usize = 8;
/// Another length than those of a `Hello` and a `Welcome` without their tags: what makes a session key is never a frame.
const SESSION: &[u8; 24] = b"scram session key, v1   ";

/// 256 secret bits. Nothing prints them.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Key(pub [u8; 32]);

impl core::fmt::Debug for Key {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(secret)")
    }
}

/// A number that was never used before. From a random generator that nobody can guess.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nonce(pub [u8; NONCE]);

/// The robot's nonce in its answer to a call: no two answers of a robot have the same.
#[must_use]
pub fn robot_nonce(welcome: &[u8]) -> Option<Nonce> {
    let (_, nonces) = welcome.split_first_chunk::<HEAD>()?;
    let (_, rest) = nonces.split_first_chunk::<NONCE>()?;
    rest.first_chunk().copied().map(Nonce)
}

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From a console: let us begin.
    Hello,
    /// From a robot: begun.
    Welcome,
    /// Downlink of a console to one robot.
    Downlink,
    /// From a console to one robot, sent to everybody: it takes less time, but is not repeated by the radio.
    ToAll,
    /// Uplink of a robot to its console.
    Uplink,
    /// From a robot to a console of another version. The only frame without a tag.
    Notice,
}

impl Kind {
    const ALL: [Self; 6] = [Self::Hello, Self::Welcome, Self::Downlink, Self::Uplink, Self::Notice, Self::ToAll];

    fn code(self) -> u8 {
        match self {
            Self::Hello => 1,
            Self::Welcome => 2,
            Self::Downlink => 3,
            Self::Uplink => 4,
            Self::Notice => 5,
            Self::ToAll => 6,
        }
    }
}

/// Why a frame does nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejected {
    /// Of another version of the protocol.
    OtherVersion(u32),
    /// No frame of ours, or one that goes the other way, or a downlink to all that is meant for another robot.
    Misdirected,
    /// The tag is wrong: forged, damaged, another robot's, of a session that is over or that never was.
    Forged,
    /// The tag is right, and a frame at least as new was there before: late, repeated by the radio, or replayed.
    Outdated,
    /// The tag is right, and yet it holds no message. Ends of one version do not do that.
    Unreadable,
}

/// Why a frame is not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsealed {
    /// The message is longer than [`LONGEST_BODY`].
    TooLong,
    /// The counter has come to its end, after a year: begin a new session.
    Exhausted,
}

/// The version and the kind of a frame, whoever it is from.
///
/// # Errors
/// Of another version, or none.
pub fn kind(frame: &[u8]) -> Result<Kind, Rejected> {
    let (version, rest) = frame.split_first_chunk::<4>().ok_or(Rejected::Misdirected)?;
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return Err(Rejected::OtherVersion(version));
    }
    let code = rest.first().ok_or(Rejected::Misdirected)?;
    Kind::ALL.into_iter().find(|kind| kind.code() == *code).ok_or(Rejected::Misdirected)
}

/// The frame that says which version this end speaks.
#[must_use]
pub fn notice() -> [u8; HEAD] {
    head(Kind::Notice)
}

fn head(kind: Kind) -> [u8; HEAD] {
    let [a, b, c, d] = VERSION.to_le_bytes();
    [a, b, c, d, kind.code()]
}

/// HMAC-SHA-256. Its key has the length of a block's half: it is never refused.
fn mac(key: &Key, parts: &[&[u8]]) -> Hmac<Sha256> {
    let mut block = sha2::digest::Key::<Hmac<Sha256>>::default();
    // RFC 2104: a key shorter than a block is filled up with zeros.
    for (slot, byte) in block.iter_mut().zip(key.0) {
        *slot = byte;
    }
    let mut mac = Hmac::<Sha256>::new(&block);
    parts.iter().for_each(|part| mac.update(part));
    mac
}

fn tag(key: &Key, signed: &[u8]) -> [u8; TAG] {
    let mut tag = [0; TAG];
    for (slot, byte) in tag.iter_mut().zip(mac(key, &[signed]).finalize().into_bytes()) {
        *slot = byte;
    }
    tag
}

/// What is before the tag, if the tag is right. Takes equally long for every wrong one.
fn verified<'f>(key: &Key, frame: &'f [u8]) -> Result<&'f [u8], Rejected> {
    let (signed, tag) = frame.split_last_chunk::<TAG>().ok_or(Rejected::Forged)?;
    mac(key, &[signed]).verify_truncated_left(tag).map_err(|_| Rejected::Forged)?;
    Ok(signed)
}

fn session_key(pairing: &Key, console: Nonce, robot: Nonce) -> Key {
    Key(mac(pairing, &[SESSION, &console.0, &robot.0]).finalize().into_bytes().into())
}

/// Makes the frames of one end in a session.
#[derive(Debug)]
pub struct Sealer {
    key: Key,
    /// A console's nonce, which its downlinks carry; a robot's uplinks carry none.
    call: Option<Nonce>,
    next: u32,
}

impl Sealer {
    /// A robot's, from its session's key.
    #[must_use]
    pub fn robot(key: Key) -> Self {
        Self { key, call: None, next: 0 }
    }

    pub(super) fn console(key: Key, call: Nonce) -> Self {
        Self { key, call: Some(call), next: 0 }
    }

    /// The frame of a message, in `buffer`, and its counter.
    ///
    /// # Errors
    /// See [`Unsealed`].
    pub fn seal<'b, B: Serialize>(
        &mut self,
        body: &B,
        buffer: &'b mut [u8; LONGEST],
    ) -> Result<(&'b [u8], u32), Unsealed> {
        let kind = if self.call.is_some() { Kind::Downlink } else { Kind::Uplink };
        self.seal_as(kind, body, buffer)
    }

    /// The same for a downlink that is sent to everybody; only the robot of this session obeys it. A robot's is what
    /// [`Sealer::seal`] makes: it tells nothing to all.
    ///
    /// # Errors
    /// See [`Unsealed`].
    pub fn seal_to_all<'b, B: Serialize>(
        &mut self,
        body: &B,
        buffer: &'b mut [u8; LONGEST],
    ) -> Result<(&'b [u8], u32), Unsealed> {
        let kind = if self.call.is_some() { Kind::ToAll } else { Kind::Uplink };
        self.seal_as(kind, body, buffer)
    }

    fn seal_as<'b, B: Serialize>(
        &mut self,
        kind: Kind,
        body: &B,
        buffer: &'b mut [u8; LONGEST],
    ) -> Result<(&'b [u8], u32), Unsealed> {
        let counter = self.next;
        let next = counter.checked_add(1).ok_or(Unsealed::Exhausted)?;
        let call = if self.call.is_some() { NONCE } else { 0 };
        let before = call.saturating_add(HEAD + COUNTER);
        let (start, rest) = buffer.split_at_mut_checked(before).ok_or(Unsealed::TooLong)?;
        let counted = head(kind).into_iter().chain(counter.to_le_bytes());
        let named = counted.chain(self.call.into_iter().flat_map(|call| call.0));
        start.iter_mut().zip(named).for_each(|(slot, byte)| *slot = byte);
        let room = rest.get_mut(..LONGEST_BODY.saturating_sub(call)).ok_or(Unsealed::TooLong)?;
        let body = postcard::to_slice(body, room).map_err(|_| Unsealed::TooLong)?.len();
        let end = body.saturating_add(before);
        let (signed, rest) = buffer.split_at_mut_checked(end).ok_or(Unsealed::TooLong)?;
        *rest.first_chunk_mut::<TAG>().ok_or(Unsealed::TooLong)? = tag(&self.key, signed);
        self.next = next;
        Ok((buffer.get(..end.saturating_add(TAG)).ok_or(Unsealed::TooLong)?, counter))
    }
}

/// A message that came through, and how many are missing before it.
#[derive(Clone, Debug, PartialEq)]
pub struct Opened<B> {
    /// Decoded message.
    pub body: B,
    /// Counter of the frame within its session.
    pub counter: u32,
    /// Frames of this session between the last one that came and this.
    pub missing: u32,
}

/// Reads the frames of the other end in a session.
#[derive(Debug)]
pub struct Opener {
    key: Key,
    /// It reads a console's downlinks; otherwise a robot's uplinks.
    downlinks: bool,
    /// The counter that is new enough.
    expected: u32,
}

impl Opener {
    fn new(key: Key, downlinks: bool) -> Self {
        Self { key, downlinks, expected: 0 }
    }

    /// The message of a frame.
    ///
    /// # Errors
    /// See [`Rejected`]; nothing has changed then.
    pub fn open<B: DeserializeOwned>(&mut self, frame: &[u8]) -> Result<Opened<B>, Rejected> {
        let is_downlink = match kind(frame)? {
            Kind::Downlink | Kind::ToAll => true,
            Kind::Uplink => false,
            Kind::Hello | Kind::Welcome | Kind::Notice => return Err(Rejected::Misdirected),
        };
        if is_downlink != self.downlinks {
            return Err(Rejected::Misdirected);
        }
        let signed = verified(&self.key, frame)?;
        let body = signed.get(HEAD..).ok_or(Rejected::Forged)?;
        let (counter, body) = body.split_first_chunk::<COUNTER>().ok_or(Rejected::Unreadable)?;
        // The nonce in a downlink is this session's: its key is made of it.
        let body = body.get(if is_downlink { NONCE } else { 0 }..).ok_or(Rejected::Unreadable)?;
        let counter = u32::from_le_bytes(*counter);
        let missing = counter.checked_sub(self.expected).ok_or(Rejected::Outdated)?;
        // Once more than the last: a sealer never gets there.
        self.expected = counter.saturating_add(1);
        match postcard::take_from_bytes(body) {
            Ok((body, [])) => Ok(Opened { body, counter, missing }),
            _ => Err(Rejected::Unreadable),
        }
    }
}

/// A console's call to one robot, until it is answered.
#[derive(Clone, Debug)]
pub struct Caller {
    key: Key,
    nonce: Nonce,
}

/// Length of a `Hello`, bytes.
pub const HELLO: usize = HEAD + NONCE + TAG;
/// Length of a `Welcome`, bytes.
pub const WELCOME: usize = HEAD + 2 * NONCE + TAG;

impl Caller {
    /// `nonce` is new for every session.
    #[must_use]
    pub fn new(key: Key, nonce: Nonce) -> Self {
        Self { key, nonce }
    }

    /// The frame that begins a session. The same again until it is answered.
    #[must_use]
    pub fn hello(&self) -> [u8; HELLO] {
        signed(&self.key, Kind::Hello, &self.nonce.0)
    }

    /// The session, if the frame is the answer to this call.
    ///
    /// # Errors
    /// See [`Rejected`].
    pub fn welcomed(&self, frame: &[u8]) -> Result<(Sealer, Opener), Rejected> {
        if kind(frame)? != Kind::Welcome {
            return Err(Rejected::Misdirected);
        }
        let (_, nonces) = verified(&self.key, frame)?.split_first_chunk::<HEAD>().ok_or(Rejected::Forged)?;
        let (console, robot) = nonces.split_first_chunk::<NONCE>().ok_or(Rejected::Unreadable)?;
        let robot = Nonce(robot.try_into().map_err(|_| Rejected::Unreadable)?);
        if *console != self.nonce.0 {
            return Err(Rejected::Outdated);
        }
        let key = session_key(&self.key, self.nonce, robot);
        Ok((Sealer::console(key.clone(), self.nonce), Opener::new(key, false)))
    }
}

/// A frame of nonces.
fn signed<const LENGTH: usize>(key: &Key, kind: Kind, nonces: &[u8]) -> [u8; LENGTH] {
    let mut frame = [0; LENGTH];
    if let Some((start, end)) = frame.split_last_chunk_mut::<TAG>() {
        start
            .iter_mut()
            .zip(head(kind).into_iter().chain(nonces.iter().copied()))
            .for_each(|(slot, byte)| *slot = byte);
        *end = tag(key, start);
    }
    frame
}

/// Frame that a robot has accepted.
#[derive(Clone, Debug, PartialEq)]
pub enum Accepted<B> {
    /// The paired console calls: this is the answer.
    Hello([u8; WELCOME]),
    /// A downlink. `began` is the key of a session that begins with it, for [`Sealer::robot`].
    Downlink {
        /// The message with its counter.
        downlink: Opened<B>,
        /// A new session's key.
        began: Option<Key>,
    },
}

/// Robot's end of the session with its one console: verifies frames and rejects replays.
#[derive(Debug)]
pub struct SessionReceiver {
    key: Key,
    /// The call that began it, and its frames.
    session: Option<(Nonce, Opener)>,
    /// The robot's part of the next session, whoever's call begins it. Calls leave no other trace: replayed ones displace
    /// nothing.
    offered: Option<Nonce>,
}

impl SessionReceiver {
    /// For the pairing key.
    #[must_use]
    pub fn new(key: Key) -> Self {
        Self { key, session: None, offered: None }
    }

    /// Takes a frame in. `fresh` makes a nonce where a new session is to be offered.
    ///
    /// # Errors
    /// See [`Rejected`]; nothing has changed then, but that a frame of the present session which is
    /// [`Rejected::Unreadable`] is not taken again.
    pub fn accept<B: DeserializeOwned>(
        &mut self,
        frame: &[u8],
        fresh: impl FnOnce() -> Nonce,
    ) -> Result<Accepted<B>, Rejected> {
        match kind(frame)? {
            Kind::Hello => self.offer(frame, fresh).map(Accepted::Hello),
            Kind::Downlink | Kind::ToAll => self.downlink(frame),
            Kind::Welcome | Kind::Uplink | Kind::Notice => Err(Rejected::Misdirected),
        }
    }

    /// Answers a call. Every one gets the same nonce of the robot until a session begins with it, so that a call may be
    /// repeated until an answer arrives, and others may come in between.
    fn offer(&mut self, frame: &[u8], fresh: impl FnOnce() -> Nonce) -> Result<[u8; WELCOME], Rejected> {
        let (_, nonce) = verified(&self.key, frame)?.split_first_chunk::<HEAD>().ok_or(Rejected::Forged)?;
        let console = Nonce(nonce.try_into().map_err(|_| Rejected::Unreadable)?);
        let robot = *self.offered.get_or_insert_with(fresh);
        let mut nonces = [0; 2 * NONCE];
        nonces.iter_mut().zip(console.0.into_iter().chain(robot.0)).for_each(|(slot, byte)| *slot = byte);
        Ok(signed(&self.key, Kind::Welcome, &nonces))
    }

    fn downlink<B: DeserializeOwned>(&mut self, frame: &[u8]) -> Result<Accepted<B>, Rejected> {
        let call = called(frame).ok_or(Rejected::Forged)?;
        let mut wrong = if kind(frame)? == Kind::ToAll { Rejected::Misdirected } else { Rejected::Forged };
        if let Some((of, session)) = &mut self.session
            && *of == call
        {
            match session.open(frame) {
                // The same call may begin another session, with another nonce of the robot.
                Err(Rejected::Forged) => wrong = Rejected::Forged,
                done => return done.map(|downlink| Accepted::Downlink { downlink, began: None }),
            }
        }
        let robot = self.offered.ok_or(wrong)?;
        let key = session_key(&self.key, call, robot);
        let mut opener = Opener::new(key.clone(), true);
        let downlink = opener.open(frame).map_err(|why| if why == Rejected::Forged { wrong } else { why })?;
        self.session = Some((call, opener));
        self.offered = None;
        Ok(Accepted::Downlink { downlink, began: Some(key) })
    }
}

/// The console's nonce in a downlink, whoever made it.
fn called(frame: &[u8]) -> Option<Nonce> {
    let nonce = frame.get(HEAD + COUNTER..)?.first_chunk::<NONCE>()?;
    Some(Nonce(*nonce))
}

#[cfg(test)]
mod tests;
