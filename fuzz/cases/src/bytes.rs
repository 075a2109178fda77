//! Bytes as numbers and commands.

use serde::de::DeserializeOwned;

/// What is left of an input. At its end numbers are 0.
pub struct Bytes<'d>(&'d [u8]);

impl<'d> Bytes<'d> {
    pub fn new(data: &'d [u8]) -> Self {
        Self(data)
    }

    /// The next byte; `None` at the end.
    pub fn next(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    pub fn u8(&mut self) -> u8 {
        self.next().unwrap_or(0)
    }

    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    pub fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.array())
    }

    /// Any bits: NaN and infinities, too.
    pub fn f32(&mut self) -> f32 {
        f32::from_bits(self.u32())
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.u8())
    }

    /// Below `end`, which is not 0.
    pub fn below(&mut self, end: usize) -> usize {
        usize::from(self.u16()) % end
    }

    /// A length byte and so many bytes, or what there is.
    pub fn some(&mut self) -> &'d [u8] {
        let length = usize::from(self.u8()).min(self.0.len());
        let (some, rest) = self.0.split_at(length);
        self.0 = rest;
        some
    }

    /// A `postcard` message, if one is next; its bytes are used up.
    pub fn message<T: DeserializeOwned>(&mut self) -> Option<T> {
        let (message, rest) = postcard::take_from_bytes(self.0).ok()?;
        self.0 = rest;
        Some(message)
    }

    pub fn rest(self) -> &'d [u8] {
        self.0
    }
}
