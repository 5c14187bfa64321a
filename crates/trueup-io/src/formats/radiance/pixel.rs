//! A pixel of three mantissas and one exponent, and rows of them.
//!
//! # Source
//! G. Ward, Real Pixels (Graphics Gems II, 1991): a mantissa m with exponent e stands for (m + 0.5) / 256 * 2^(e -
//! 128), an exponent of 0 for black. Rows: "Radiance File Formats", adaptive run-length encoding.

use std::io::{self, Read};

/// Bytes of a pixel: red, green, blue, exponent.
pub(super) const BYTES: usize = 4;

/// What is taken from exponents: that of 256 mantissas and the offset.
const EXPONENT_OFFSET: i32 = 128 + 8;

/// Widths that may be compressed.
pub(super) const COMPRESSED_WIDTHS: std::ops::RangeInclusive<usize> = 8..=0x7fff;

/// Longest run, and from which count on a byte counts a run.
const MOST_RUN: usize = 127;
const RUN: usize = 128;

/// Shortest run worth a pair of bytes.
const LEAST_RUN: usize = 4;

/// The light of a pixel.
pub(super) fn light([red, green, blue, exponent]: [u8; BYTES]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let unit = 2_f64.powi(i32::from(exponent) - EXPONENT_OFFSET);
    [red, green, blue].map(|mantissa| ((f64::from(mantissa) + 0.5) * unit) as f32)
}

/// The pixel of a light; what is negative or no number is black.
pub(super) fn pixel(light: [f32; 3]) -> [u8; BYTES] {
    let light = light.map(|value| f64::from(value.max(0.0)));
    let most = light.iter().fold(0.0, |most: f64, &value| most.max(value)).min(f64::from(f32::MAX));
    if most < 1e-32 {
        return [0; BYTES];
    }
    // The least power of two above the largest.
    let exponent = most.log2().floor() as i32 + 1;
    let unit = 2_f64.powi(8 - exponent);
    // The conversion cuts off and saturates.
    let [red, green, blue] = light.map(|value| (value * unit) as u8);
    [red, green, blue, (exponent + EXPONENT_OFFSET - 8).clamp(1, 255) as u8]
}

/// Appends a row of pixels, compressed where that can be.
pub(super) fn append_row(row: &[[u8; BYTES]], bytes: &mut Vec<u8>) {
    if !COMPRESSED_WIDTHS.contains(&row.len()) {
        bytes.extend_from_slice(row.as_flattened());
        return;
    }
    bytes.extend([2, 2, (row.len() >> 8) as u8, row.len() as u8]);
    for channel in 0..BYTES {
        let samples: Vec<u8> = row.iter().map(|pixel| pixel[channel]).collect();
        append_channel(&samples, bytes);
    }
}

fn append_channel(samples: &[u8], bytes: &mut Vec<u8>) {
    let run_at = |place: usize| {
        let first = samples[place];
        samples[place..].iter().take(MOST_RUN).take_while(|&&sample| sample == first).count()
    };
    let mut place = 0;
    while place < samples.len() {
        let run = run_at(place);
        if run >= LEAST_RUN {
            bytes.extend([(RUN + run) as u8, samples[place]]);
            place += run;
            continue;
        }
        let start = place;
        while place < samples.len() && place - start < RUN && run_at(place) < LEAST_RUN {
            place += 1;
        }
        bytes.push((place - start) as u8);
        bytes.extend_from_slice(&samples[start..place]);
    }
}

/// Reads a row of pixels, in any of the three ways they are stored. Replaces `row`.
pub(super) fn read_row(input: &mut impl Read, width: usize, row: &mut Vec<[u8; BYTES]>) -> io::Result<()> {
    row.clear();
    let mut first = [0; BYTES];
    input.read_exact(&mut first)?;
    let [two, also_two, high, low] = first;
    if (two, also_two) != (2, 2) || high > 0x7f || !COMPRESSED_WIDTHS.contains(&width) {
        return read_old_row(input, width, first, row);
    }
    if usize::from(u16::from_be_bytes([high, low])) != width {
        return Err(damaged("a row has another width than the picture"));
    }
    row.resize(width, [0; BYTES]);
    for channel in 0..BYTES {
        let mut place = 0;
        while place < width {
            place += read_piece(input, &mut row[place..], channel)?;
        }
    }
    Ok(())
}

/// Reads a run, or samples that differ, into a channel of the pixels that are left; how many.
fn read_piece(input: &mut impl Read, left: &mut [[u8; BYTES]], channel: usize) -> io::Result<usize> {
    let count = usize::from(read_byte(input)?);
    let (count, is_run) = if count > RUN { (count - RUN, true) } else { (count, false) };
    let pixels =
        left.get_mut(..count).filter(|_| count > 0).ok_or_else(|| damaged("a row is longer than the picture"))?;
    let repeated = if is_run { Some(read_byte(input)?) } else { None };
    for pixel in pixels {
        pixel[channel] = match repeated {
            Some(sample) => sample,
            None => read_byte(input)?,
        };
    }
    Ok(count)
}

/// Reads a row whose pixels follow each other; one of mantissas of 1 repeats the pixel before it as often as its
/// exponent says, and more of them in a row by ever higher bytes.
fn read_old_row(input: &mut impl Read, width: usize, first: [u8; BYTES], row: &mut Vec<[u8; BYTES]>) -> io::Result<()> {
    let mut next = first;
    let mut shift = 0;
    loop {
        match (next, row.last().copied()) {
            ([1, 1, 1, count], Some(last)) if shift < usize::BITS - 8 => {
                let count = usize::from(count) << shift;
                if count > width - row.len() {
                    return Err(damaged("a row is longer than the picture"));
                }
                row.extend(std::iter::repeat_n(last, count));
                shift += 8;
            }
            _ => {
                row.push(next);
                shift = 0;
            }
        }
        if row.len() >= width {
            return Ok(());
        }
        input.read_exact(&mut next)?;
    }
}

fn read_byte(input: &mut impl Read) -> io::Result<u8> {
    let mut byte = [0];
    input.read_exact(&mut byte)?;
    Ok(byte[0])
}

fn damaged(words: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, words)
}
