//! A serial line between a chip and a host, and what can happen to its cable.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::io;
use std::rc::Rc;
use std::task::{Poll, Waker};

use embedded_io_async::{ErrorKind, ErrorType, Read, Write};

use crate::time::{now_us, until};

/// What the cable is like to the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cable {
    /// Plugged in, and a program reads.
    Reading,
    /// Plugged in, but no program reads.
    Idle,
    /// Unplugged: the chip's driver tells.
    Broken,
    /// Unplugged: the driver waits for ever, and what is in its buffer is lost.
    Gone,
}

/// Bytes in the chip's buffer: USB's packet.
const BUFFER: usize = 64;
/// How long one takes, µs: about what full-speed USB manages.
const PACKET_US: u64 = 64;
/// Bytes that the host's driver holds for a program that is slow, and for a chip that is.
const HOST_BUFFER: usize = 4096;

struct Wire {
    cable: Cable,
    /// Bytes after which the cable changes.
    change: Option<(usize, Cable)>,
    buffer: VecDeque<u8>,
    /// For the host's program.
    to_host: VecDeque<u8>,
    host_room: usize,
    to_chip: VecDeque<u8>,
    chip_read_fails: bool,
    host_read_fails: bool,
    wakers: Vec<Waker>,
}

/// Both ends of a line. Clones are the same one.
#[derive(Clone)]
pub struct Serial(Rc<RefCell<Wire>>);

impl Default for Serial {
    fn default() -> Self {
        Self::with_room(HOST_BUFFER)
    }
}

impl Serial {
    /// Plugged in. The host's driver holds so many bytes for a program that does not read.
    #[must_use]
    pub fn with_room(host_room: usize) -> Self {
        Self(Rc::new(RefCell::new(Wire {
            cable: Cable::Reading,
            change: None,
            buffer: VecDeque::new(),
            to_host: VecDeque::new(),
            host_room,
            to_chip: VecDeque::new(),
            chip_read_fails: false,
            host_read_fails: false,
            wakers: Vec::new(),
        })))
    }

    /// Changes the cable.
    pub fn plug(&self, cable: Cable) {
        self.change(|wire| wire.set(cable));
    }

    /// Changes the cable when the chip has written so many more bytes.
    pub fn plug_after(&self, bytes: usize, cable: Cable) {
        self.change(|wire| wire.change = Some((bytes, cable)));
    }

    /// The chip's next read fails.
    pub fn fail_chip_read(&self) {
        self.change(|wire| wire.chip_read_fails = true);
    }

    /// The host's reads fail from now on; its writes do not.
    pub fn fail_host_reads(&self) {
        self.change(|wire| wire.host_read_fails = true);
    }

    /// The chip starts anew: what was on its way to it is lost.
    pub(crate) fn reset(&self) {
        self.change(|wire| {
            wire.to_chip.clear();
            wire.buffer.clear();
        });
    }

    /// The host writes; how many bytes there was room for.
    ///
    /// # Errors
    /// The cable is unplugged.
    pub fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        self.change(|wire| {
            wire.plugged()?;
            let room = bytes.len().min(HOST_BUFFER.saturating_sub(wire.to_chip.len()));
            wire.to_chip.extend(&bytes[..room]);
            Ok(room)
        })
    }

    /// The host reads what there is.
    ///
    /// # Errors
    /// The cable is unplugged, or reading is broken.
    pub fn read(&self, bytes: &mut [u8]) -> io::Result<usize> {
        self.change(|wire| {
            if wire.host_read_fails {
                return Err(io::Error::from(io::ErrorKind::BrokenPipe));
            }
            // What came before the cable was pulled is still there.
            if wire.to_host.is_empty() {
                wire.plugged()?;
            }
            let length = wire.to_host.len().min(bytes.len());
            bytes.iter_mut().zip(wire.to_host.drain(..length)).for_each(|(to, from)| *to = from);
            Ok(length)
        })
    }

    /// Everything that came for the host so far; it stays.
    #[must_use]
    pub fn seen(&self) -> Vec<u8> {
        self.0.borrow().to_host.iter().copied().collect()
    }

    /// Takes everything that came for the host.
    #[must_use]
    pub fn take(&self) -> Vec<u8> {
        self.change(|wire| wire.to_host.drain(..).collect())
    }

    fn change<R>(&self, change: impl FnOnce(&mut Wire) -> R) -> R {
        let mut wire = self.0.borrow_mut();
        let result = change(&mut wire);
        wire.wakers.drain(..).for_each(Waker::wake);
        result
    }
}

impl Wire {
    fn set(&mut self, cable: Cable) {
        self.cable = cable;
        match cable {
            Cable::Reading => self.to_host.extend(self.buffer.drain(..)),
            Cable::Gone => self.buffer.clear(),
            Cable::Idle | Cable::Broken => {}
        }
    }

    fn plugged(&self) -> io::Result<()> {
        match self.cable {
            Cable::Reading | Cable::Idle => Ok(()),
            Cable::Broken | Cable::Gone => Err(io::Error::from(io::ErrorKind::BrokenPipe)),
        }
    }

    /// Takes what there is room for; `None` to wait.
    fn take(&mut self, bytes: &[u8]) -> Option<Result<usize, ErrorKind>> {
        let room = match self.cable {
            Cable::Reading => BUFFER.min(self.host_room.saturating_sub(self.to_host.len())),
            Cable::Idle => BUFFER - self.buffer.len(),
            Cable::Broken => return Some(Err(ErrorKind::NotConnected)),
            Cable::Gone => 0,
        };
        let room = self.change.map_or(room, |(left, _)| room.min(left)).min(bytes.len());
        let into = if self.cable == Cable::Reading { &mut self.to_host } else { &mut self.buffer };
        into.extend(&bytes[..room]);
        if let Some((left, cable)) = &mut self.change {
            *left -= room;
            if *left == 0 {
                let cable = *cable;
                self.change = None;
                self.set(cable);
            }
        }
        (room > 0).then_some(Ok(room))
    }
}

impl ErrorType for Serial {
    type Error = ErrorKind;
}

/// The chip's end.
impl Read for Serial {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        poll_fn(|context| {
            let mut wire = self.0.borrow_mut();
            if std::mem::take(&mut wire.chip_read_fails) {
                return Poll::Ready(Err(ErrorKind::Other));
            }
            if wire.to_chip.is_empty() {
                wire.wakers.push(context.waker().clone());
                return Poll::Pending;
            }
            let length = wire.to_chip.len().min(bytes.len());
            bytes.iter_mut().zip(wire.to_chip.drain(..length)).for_each(|(to, from)| *to = from);
            Poll::Ready(Ok(length))
        })
        .await
    }
}

impl Write for Serial {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        until(now_us() + PACKET_US).await;
        poll_fn(|context| {
            let mut wire = self.0.borrow_mut();
            let taken = wire.take(bytes);
            if taken.is_none() {
                wire.wakers.push(context.waker().clone());
            }
            taken.map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        if self.0.borrow().cable == Cable::Broken { Err(ErrorKind::NotConnected) } else { Ok(()) }
    }
}
