//! From a TIFF's samples to gray and RGB.

/// Samples of `bits` bits, the first in the highest bits; every row begins with a byte of its own.
pub(super) fn unpacked(packed: &[u8], width: usize, bits: u8) -> impl Iterator<Item = u8> + '_ {
    let per_byte = usize::from(8 / bits);
    let mask = u8::MAX >> (8 - bits);
    packed.chunks_exact(width.div_ceil(per_byte)).flat_map(move |row| {
        (0..width).map(move |x| row[x / per_byte] >> (8 - bits as usize * (x % per_byte + 1)) & mask)
    })
}

/// Full-range YCbCr of 8 bits as RGB; the coefficients of luma are those of the file or Rec. 601's.
pub(super) fn rgb_of_ycbcr(samples: &[u8], coefficients: Option<&[f32]>) -> Vec<u8> {
    let [red, green, blue] = match coefficients {
        Some(&[red, green, blue]) if green > 0.0 => [red, green, blue],
        _ => trueup_core::raster::LUMA,
    };
    let rgb = |&[y, cb, cr]: &[u8; 3]| {
        let (y, cb, cr) = (f32::from(y), f32::from(cb) - 128.0, f32::from(cr) - 128.0);
        let r = y + cr * (2.0 - 2.0 * red);
        let b = y + cb * (2.0 - 2.0 * blue);
        let g = (y - blue * b - red * r) / green;
        // The addition rounds; the conversion truncates and saturates.
        [r, g, b].map(|value| (value + 0.5) as u8)
    };
    samples.as_chunks::<3>().0.iter().flat_map(rgb).collect()
}

/// CMYK without a profile as RGB, `full` being the most that a sample can be; fractions are cut off.
pub(super) fn rgb_of_cmyk<T: Copy + Into<f32>, U>(samples: &[T], full: f32, level: fn(f32) -> U) -> Vec<U> {
    let rgb = |&[c, m, y, k]: &[T; 4]| {
        let light = 1.0 - k.into() / full;
        [c, m, y].map(|ink| level((full - ink.into()) * light))
    };
    samples.as_chunks::<4>().0.iter().flat_map(rgb).collect()
}
