//! What a result was made from, as one number.

use std::fmt;

use serde::{Deserialize, Serialize};
use trueup_core::raster::Photograph;

/// Name and version of the program, and the number of its stages: results of other stages are never found.
pub(crate) const PROGRAM: &str = concat!("trueup ", env!("CARGO_PKG_VERSION"), " ", env!("TRUEUP_STAGES"));

/// The hash of everything that decides a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Key([u8; blake3::OUT_LEN]);

impl Key {
    /// Whether `text` is a key as it is written.
    pub(crate) fn is_written(text: &str) -> bool {
        blake3::Hash::from_hex(text).is_ok()
    }
}

impl fmt::Display for Key {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        blake3::Hash::from_bytes(self.0).fmt(formatter)
    }
}

/// Collects what decides a result.
#[derive(Debug, Clone)]
pub(crate) struct KeyMaker(blake3::Hasher);

impl KeyMaker {
    /// Of a result of this program.
    pub(crate) fn new() -> Self {
        Self(blake3::Hasher::new()).bytes(PROGRAM.as_bytes())
    }

    /// Bytes, told apart from those before and after.
    pub(crate) fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Another key.
    pub(crate) fn key(self, key: &Key) -> Self {
        self.bytes(&key.0)
    }

    /// Anything that can be written down: options, and what stages hand on.
    pub(crate) fn part<T: Serialize + ?Sized>(self, part: &T) -> Self {
        match rmp_serde::to_vec_named(part) {
            Ok(written) => self.bytes(&written),
            // Nothing that is written here can fail; were it so, the key would be nobody else's.
            Err(error) => self.bytes(error.to_string().as_bytes()).bytes(&std::process::id().to_le_bytes()),
        }
    }

    /// The pixels of a photograph in memory.
    pub(crate) fn photograph(mut self, photograph: &Photograph) -> Self {
        self = self.part(&(photograph.width(), photograph.height(), photograph.channels(), photograph.sample_bits()));
        match photograph {
            Photograph::Eight(raster) => self.0.update(raster.data()),
            Photograph::Sixteen(raster) => self.0.update(bytemuck::cast_slice(raster.data())),
        };
        self
    }

    /// The content of a file.
    pub(crate) fn file(mut self, file: std::fs::File) -> std::io::Result<Self> {
        self.0.update_reader(file)?;
        Ok(self)
    }

    pub(crate) fn finish(self) -> Key {
        Key(*self.0.finalize().as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_tell_apart_what_runs_together() {
        let key = |a: &str, b: &str| KeyMaker::new().bytes(a.as_bytes()).bytes(b.as_bytes()).finish();
        assert_ne!(key("ab", "c"), key("a", "bc"));
        assert_eq!(key("ab", "c"), key("ab", "c"));
        assert!(Key::is_written(&key("a", "b").to_string()));
        assert!(!Key::is_written("photograph"));
    }
}
