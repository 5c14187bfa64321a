//! The coded bytes of a JPEG, watched while they are decoded: decoders say nothing of data that are left over or that
//! ended too soon.

use std::cell::Cell;

use zune_core::bytestream::{ZByteIoError, ZByteReaderTrait, ZSeekFrom};

/// Most bytes that a decoder holds ahead of what it decodes, with as many to spare: zune-jpeg holds up to 64 bits.
const AHEAD_BYTES: usize = 16;

/// Bytes that may be passed over before a marker without a meaning: decoders look for markers byte by byte, and read as
/// much of some headers.
const PASSED_BYTES: usize = 32;

/// What was seen of the reading.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// Place behind the last byte that was read to be decoded.
    decoded_to: Cell<usize>,
    /// Bytes passed over since then that mean something elsewhere.
    passed: Cell<usize>,
    /// Most of these at a time.
    most_passed: Cell<usize>,
}

impl Watch {
    /// Whether data were passed over, as happens where others before them were lost or replaced.
    pub(super) fn has_passed_data(&self) -> bool {
        self.most_passed.get() > PASSED_BYTES
    }

    /// Whether more was decoded than `coded_bytes`, behind which others followed.
    pub(super) fn has_decoded_beyond(&self, coded_bytes: usize) -> bool {
        self.decoded_to.get() > coded_bytes + AHEAD_BYTES
    }

    /// Notes that so many bytes before `position` were read to be decoded, or as part of a header.
    fn decode(&self, position: usize) {
        self.decoded_to.set(position);
        self.passed.set(0);
    }

    /// Notes that a byte was looked at for a marker.
    fn pass(&self, byte: u8) {
        // Zeros and ones alone are what files are filled up with.
        if !matches!(byte, 0x00 | 0xff) {
            self.passed.set(self.passed.get() + 1);
            self.most_passed.set(self.most_passed.get().max(self.passed.get()));
        }
    }

    /// Forgets what was seen of the headers.
    pub(super) fn restart(&self) {
        self.passed.set(0);
        self.most_passed.set(0);
    }
}

/// Bytes with others behind them, as one stream.
pub(super) struct WatchedBytes<'a> {
    bytes: &'a [u8],
    /// What follows; nothing of it counts as passed over.
    behind: &'a [u8],
    position: usize,
    watch: &'a Watch,
}

impl<'a> WatchedBytes<'a> {
    pub(super) fn new(bytes: &'a [u8], behind: &'a [u8], watch: &'a Watch) -> Self {
        Self { bytes, behind, position: 0, watch }
    }

    fn length(&self) -> usize {
        self.bytes.len() + self.behind.len()
    }

    /// The bytes from the position on, as far as they lie together.
    fn rest(&self, position: usize) -> &'a [u8] {
        match self.bytes.get(position..) {
            Some(rest) if !rest.is_empty() => rest,
            _ => self.behind.get(position.saturating_sub(self.bytes.len())..).unwrap_or_default(),
        }
    }
}

impl ZByteReaderTrait for WatchedBytes<'_> {
    #[inline(always)]
    fn read_byte_no_error(&mut self) -> u8 {
        let byte = self.rest(self.position).first().copied().unwrap_or_default();
        self.position += 1;
        self.watch.decode(self.position);
        byte
    }

    /// zune-jpeg reads single bytes so where it looks for a marker, and several where it decodes.
    #[inline(always)]
    fn read_exact_bytes(&mut self, buffer: &mut [u8]) -> Result<(), ZByteIoError> {
        let wanted = buffer.len();
        match self.bytes.get(self.position..self.position.saturating_add(wanted)) {
            Some(bytes) => buffer.copy_from_slice(bytes),
            None => self.peek_exact_bytes(buffer)?,
        }
        let is_within = self.position < self.bytes.len();
        self.position += wanted;
        match buffer {
            [byte] if is_within => self.watch.pass(*byte),
            [_] => {}
            _ => self.watch.decode(self.position),
        }
        Ok(())
    }

    fn read_bytes(&mut self, buffer: &mut [u8]) -> Result<usize, ZByteIoError> {
        let count = self.peek_bytes(buffer)?;
        self.position += count;
        self.watch.decode(self.position);
        Ok(count)
    }

    fn peek_bytes(&mut self, buffer: &mut [u8]) -> Result<usize, ZByteIoError> {
        let mut count = 0;
        while count < buffer.len() {
            let rest = self.rest(self.position + count);
            let next = rest.len().min(buffer.len() - count);
            if next == 0 {
                break;
            }
            buffer[count..count + next].copy_from_slice(&rest[..next]);
            count += next;
        }
        Ok(count)
    }

    fn peek_exact_bytes(&mut self, buffer: &mut [u8]) -> Result<(), ZByteIoError> {
        match self.peek_bytes(buffer)? {
            count if count == buffer.len() => Ok(()),
            count => Err(ZByteIoError::NotEnoughBytes(count, buffer.len())),
        }
    }

    fn z_seek(&mut self, from: ZSeekFrom) -> Result<u64, ZByteIoError> {
        let (base, offset) = match from {
            ZSeekFrom::Start(place) => (0, i64::try_from(place).unwrap_or(i64::MAX)),
            ZSeekFrom::End(offset) => (self.length(), offset),
            ZSeekFrom::Current(offset) => (self.position, offset),
        };
        let place = isize::try_from(offset).ok().and_then(|offset| base.checked_add_signed(offset));
        self.position = place.ok_or(ZByteIoError::SeekError("a place before the start"))?;
        Ok(self.position as u64)
    }

    #[inline(always)]
    fn is_eof(&mut self) -> Result<bool, ZByteIoError> {
        Ok(self.position >= self.length())
    }

    fn z_position(&mut self) -> Result<u64, ZByteIoError> {
        Ok(self.position as u64)
    }

    fn read_remaining(&mut self, sink: &mut Vec<u8>) -> Result<usize, ZByteIoError> {
        let mut count = 0;
        loop {
            let rest = self.rest(self.position);
            if rest.is_empty() {
                return Ok(count);
            }
            sink.extend_from_slice(rest);
            self.position += rest.len();
            count += rest.len();
        }
    }
}
