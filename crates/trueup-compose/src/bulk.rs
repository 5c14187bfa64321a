//! Many pixels as a string of bytes, little-endian, for what is handed to other programs.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serializer};

use crate::store::{Pixel, RootPixel, SumPixel, to_bytes};

/// What there may be many of.
pub(crate) trait Bulk: Copy {
    /// Bytes of one.
    const BYTES: usize;
    /// All of them, one after the other.
    fn bytes(many: &[Self]) -> Vec<u8>;
    /// One of so many bytes.
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! bulk_of_pixels {
    ($($pixel:ty),*) => {$(
        impl Bulk for $pixel {
            const BYTES: usize = <$pixel as Pixel>::BYTES;

            fn bytes(many: &[Self]) -> Vec<u8> {
                to_bytes(many)
            }

            fn read(bytes: &[u8]) -> Self {
                <$pixel as Pixel>::read(bytes)
            }
        }
    )*};
}
bulk_of_pixels!(RootPixel, SumPixel);

impl Bulk for [u8; 4] {
    const BYTES: usize = 4;

    fn bytes(many: &[Self]) -> Vec<u8> {
        many.as_flattened().to_vec()
    }

    fn read(bytes: &[u8]) -> Self {
        std::array::from_fn(|at| bytes.get(at).copied().unwrap_or_default())
    }
}

/// For `serde(with)`.
pub(crate) fn serialize<T: Bulk, S: Serializer>(many: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(&T::bytes(many))
}

/// For `serde(with)`.
pub(crate) fn deserialize<'de, T: Bulk, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    let bytes = serde_bytes::ByteBuf::deserialize(deserializer)?;
    match bytes.len() % T::BYTES {
        0 => Ok(bytes.chunks_exact(T::BYTES).map(T::read).collect()),
        _ => Err(D::Error::custom("pixels that end in the middle of one")),
    }
}
