//! The chip's random generator.

use control::protocol::secure::Nonce;
use esp_hal::rng::{Trng, TrngError};
use shell::board::Entropy;

/// True randomness: while the radio runs, noise of its receiver goes into the generator (both chips' technical reference
/// manuals, "Random Number Generator").
pub struct Random(Trng);

impl Random {
    /// The generator, once the radio runs.
    ///
    /// # Errors
    /// The radio does not run: what the generator gives could be guessed.
    pub fn new() -> Result<Self, TrngError> {
        Trng::try_new().map(Self)
    }
}

impl Entropy for Random {
    fn nonce(&mut self) -> Nonce {
        let mut nonce = Nonce(Default::default());
        self.0.read(&mut nonce.0);
        nonce
    }
}
