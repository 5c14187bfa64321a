//! PNG.

use std::io::{BufRead, BufWriter, Read, Result as IoResult, Seek, SeekFrom, Write};

use png::text_metadata::ITXtChunk;
use png::{
    BitDepth, CodingIndependentCodePoints, ColorType, Compression, Decoder, DecodingError, Encoder, EncodingError,
    Info, Limits, SrgbRenderingIntent, Transformations,
};
use trueup_core::raster::{Photograph, RowSource};
use trueup_core::source::SourceImage;
use trueup_core::{Result, StageContext};

use super::decoded::{HEADER_BYTES, check_unchanged, damaged, decoding_limit, eight, sample_count, sixteen};
use crate::color::{NamedSpace, space_of_code_points};
use crate::encode::failure::WriteFailure;
use crate::encode::metadata::Metadata;
use crate::encode::options::{Depth, OutputOptions, PngCompression};
use crate::encode::samples::{OutputSample, RGBA, flattened};
use crate::encode::strips::{BUFFER_BYTES, STRIP_ROWS, channels_of, for_each_strip};
use crate::format::{
    Format, HeaderError, Input, LOSSLESS_BYTES, Output, PLAIN_PIXEL_BYTES, Reading, SideLimit, StoredPixels,
    Transparency, Writer, Writing,
};
use crate::metadata::embedded;
use crate::metadata::exif_fields::ExifFields;

/// The declaration.
///
/// # Source
/// Signature: W3C PNG 5.2. Sides: 31 bits, 11.2.1.
pub(crate) static PNG: Format = Format {
    name: "PNG",
    extensions: &["png"],
    rare_extensions: &[],
    reading: Some(Reading {
        kinds: "1 to 16 bits, gray, color, palettes, with or without alpha",
        has_signature: |start| start.starts_with(b"\x89PNG\r\n\x1a\n"),
        stored,
        icc,
        exif,
        whole_fields: embedded::read_fields,
        pixels,
        reduced: None,
        pixel_bytes: |_| PLAIN_PIXEL_BYTES,
    }),
    writing: Some(Writing {
        depths: &[Depth::Eight, Depth::Sixteen],
        transparency: Transparency::Always,
        sides: SIDES,
        has_profile: true,
        memory: "64 rows",
        bytes_per_pixel: |options| LOSSLESS_BYTES * f64::from(options.depth.sample_bytes()),
        writer: Writer::File(write),
    }),
};

/// The longest side of a PNG.
pub(crate) const SIDES: SideLimit = SideLimit { largest: (1 << 31) - 1, advice: "Write a smaller panorama." };

/// Keyword of the text chunk that holds XMP (XMP specification part 3, section 1.1.5).
const XMP_KEYWORD: &str = "XML:com.adobe.xmp";

/// The chunk that ends a PNG: no data, its name, and its sum (W3C PNG 11.2.5).
const END: &[u8] = b"\0\0\0\0IEND\xae\x42\x60\x82";

/// Bytes of the signature (W3C PNG 5.2), and of a chunk beside its data: length, name and sum (5.3).
const SIGNATURE_BYTES: u64 = 8;
const CHUNK_BYTES: u64 = 12;

/// A file with the chunk behind it that ends a PNG, or what it lacks of it. One that was cut right behind its last
/// pixels, or within that chunk, has all of them; of one that was cut within them the chunk makes nothing whole, and of
/// a whole file it is never read.
struct Ended<'a> {
    input: &'a mut Input,
    /// What the file may lack of the chunk.
    missing: &'static [u8],
    /// What is left of that.
    rest: &'static [u8],
}

impl<'a> Ended<'a> {
    /// The file from its start on.
    ///
    /// # Errors
    /// Those of reading.
    fn new(input: &'a mut Input) -> IoResult<Self> {
        let missing = &END[begun_end(input)?..];
        input.rewind()?;
        Ok(Self { input, missing, rest: missing })
    }
}

/// How many bytes a file has of the chunk that ends a PNG, where it was cut within it; 0 otherwise. Chunks are
/// followed, since the sum of the one before may end as this one begins.
fn begun_end(input: &mut Input) -> IoResult<usize> {
    let length = input.seek(SeekFrom::End(0))?;
    let tail_start = length.saturating_sub(END.len() as u64);
    let mut tail = Vec::with_capacity(END.len());
    input.seek(SeekFrom::Start(tail_start))?;
    input.read_to_end(&mut tail)?;
    // Of most files: whole, or cut elsewhere.
    if tail == END || !(1..END.len()).any(|begun| tail.ends_with(&END[..begun])) {
        return Ok(0);
    }
    let mut start = SIGNATURE_BYTES;
    while length.saturating_sub(start) >= CHUNK_BYTES {
        input.seek(SeekFrom::Start(start))?;
        let mut data_bytes = [0; 4];
        input.read_exact(&mut data_bytes)?;
        start += CHUNK_BYTES + u64::from(u32::from_be_bytes(data_bytes));
    }
    // Fewer bytes than any chunk has.
    let begun = tail.get(start.saturating_sub(tail_start) as usize..).unwrap_or_default();
    Ok(if start <= length && END.starts_with(begun) { begun.len() } else { 0 })
}

impl Read for Ended<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> IoResult<usize> {
        let count = self.fill_buf()?.read(bytes)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Ended<'_> {
    fn fill_buf(&mut self) -> IoResult<&[u8]> {
        if self.input.fill_buf()?.is_empty() { Ok(self.rest) } else { self.input.fill_buf() }
    }

    fn consume(&mut self, count: usize) {
        if self.input.buffer().is_empty() {
            self.rest = self.rest.get(count..).unwrap_or_default();
        } else {
            self.input.consume(count);
        }
    }
}

impl Seek for Ended<'_> {
    fn seek(&mut self, place: SeekFrom) -> IoResult<u64> {
        self.rest = self.missing;
        self.input.seek(place)
    }
}

/// A decoder that takes at most so many bytes beside the pixels and hands them out with 8 or 16 bits a sample, palettes
/// as RGB. A profile, which may be a few bytes that stand for as many as there are, is read where it is wanted.
fn decoder<R: BufRead + Seek>(
    input: R,
    bytes: usize,
    with_profile: bool,
) -> std::result::Result<png::Reader<R>, DecodingError> {
    let mut decoder = Decoder::new_with_limits(input, Limits { bytes });
    decoder.set_ignore_text_chunk(false);
    decoder.set_ignore_iccp_chunk(!with_profile);
    decoder.set_transformations(Transformations::EXPAND);
    decoder.read_info()
}

/// What stands before the pixels, without a profile. Sizes are judged by the caller, whose limit is an option.
fn header(input: &mut Input) -> std::result::Result<png::Reader<&mut Input>, DecodingError> {
    decoder(input, usize::MAX, false)
}

fn stored(input: &mut Input) -> std::result::Result<StoredPixels, HeaderError> {
    let reader = header(input).map_err(|error| HeaderError::damaged(words(&error)))?;
    let bits = if reader.output_color_type().1 == BitDepth::Sixteen { 16 } else { 8 };
    let (width, height) = reader.info().size();
    Ok(StoredPixels { width: width as usize, height: height as usize, bits, is_float: false })
}

/// What is wrong with a file, in words of people where the decoder's are of its own parts.
fn words(error: &DecodingError) -> String {
    match error {
        DecodingError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the file ends within it".to_owned()
        }
        DecodingError::LimitsExceeded => "it claims more than memory can hold".to_owned(),
        other => match other.to_string() {
            said if said.starts_with("CRC error") => "a checksum in it is wrong: bytes of it have changed".to_owned(),
            said => said,
        },
    }
}

/// What the code points of the chunk cICP say.
fn named_space(info: &Info<'_>) -> NamedSpace {
    let space = |points: CodingIndependentCodePoints| {
        space_of_code_points(points.color_primaries.into(), points.transfer_function.into())
    };
    info.coding_independent_code_points.map_or(NamedSpace::Unknown, space)
}

/// The profile; code points that say something count before one that is embedded.
///
/// # Source
/// W3C PNG (third edition), 4.3.
fn icc(input: &mut Input) -> Option<Vec<u8>> {
    let reader = decoder(input, HEADER_BYTES, true).ok()?;
    match named_space(reader.info()) {
        NamedSpace::Srgb => None,
        NamedSpace::Other(icc) => Some(icc),
        NamedSpace::Unknown => reader.info().icc_profile.as_ref().map(|icc| icc.to_vec()),
    }
}

/// EXIF is not asked for colors where the picture says itself that they are sRGB's.
fn exif(input: &mut Input) -> Option<ExifFields> {
    let fields = embedded::read_exif(input)?;
    input.rewind().ok()?;
    let is_srgb = |info: &Info<'_>| info.srgb.is_some() || named_space(info) == NamedSpace::Srgb;
    let says_srgb = header(input).is_ok_and(|reader| is_srgb(reader.info()));
    Some(if says_srgb { fields.without_color_space() } else { fields })
}

fn pixels(source: &SourceImage, mut input: Input) -> Result<Photograph> {
    let failed = |error: DecodingError| damaged(source, words(&error));
    let limit = usize::try_from(decoding_limit(source)).unwrap_or(usize::MAX);
    let input = Ended::new(&mut input).map_err(|error| failed(error.into()))?;
    let mut reader = decoder(input, limit, false).map_err(failed)?;
    let (width, height) = reader.info().size();
    let (width, height) = (width as usize, height as usize);
    check_unchanged(source, width, height)?;
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    let count = sample_count(source, width, height, channels)?;
    if depth != BitDepth::Sixteen {
        let mut samples = vec![0; count];
        reader.next_frame(&mut samples).map_err(failed)?;
        return eight(width, height, channels, samples);
    }
    let mut samples = vec![0_u16; count];
    reader.next_frame(bytemuck::cast_slice_mut(&mut samples)).map_err(failed)?;
    samples.iter_mut().for_each(|sample| *sample = u16::from_be(*sample));
    sixteen(width, height, channels, samples)
}

/// Writes a PNG of 8 or 16 bits.
pub(super) fn write(
    file: &mut dyn Output,
    picture: &dyn RowSource,
    metadata: &Metadata,
    options: &OutputOptions,
    context: &StageContext<'_>,
) -> std::result::Result<(), WriteFailure> {
    let mut output = BufWriter::with_capacity(BUFFER_BYTES, file);
    let channels = channels_of(picture, options);
    let info = info(metadata, picture.width() as u32, picture.height() as u32);
    let mut encoder = Encoder::with_info(&mut output as &mut dyn Write, info).map_err(failure)?;
    encoder.set_color(if channels == RGBA { ColorType::Rgba } else { ColorType::Rgb });
    let sixteen = options.depth == Depth::Sixteen;
    encoder.set_depth(if sixteen { BitDepth::Sixteen } else { BitDepth::Eight });
    if metadata.icc.is_none() {
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    }
    encoder.set_compression(compression(options));
    let mut writer = encoder.write_header().map_err(failure)?;
    let mut stream = writer.stream_writer_with_size(BUFFER_BYTES).map_err(failure)?;
    if sixteen {
        let mut samples = Vec::new();
        for_each_strip::<u16>(picture, STRIP_ROWS, context, &mut |strip| {
            flattened(strip, channels, u16::of(options.background), &mut samples);
            let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_be_bytes()).collect();
            Ok(stream.write_all(&bytes)?)
        })?;
    } else {
        let mut samples = Vec::new();
        for_each_strip::<u8>(picture, STRIP_ROWS, context, &mut |strip| {
            flattened(strip, channels, u8::of(options.background), &mut samples);
            Ok(stream.write_all(&samples)?)
        })?;
    }
    stream.finish().map_err(failure)?;
    writer.finish().map_err(failure)?;
    output.flush()?;
    Ok(())
}

/// The headers; without a profile, the caller marks the picture as sRGB.
fn info(metadata: &Metadata, width: u32, height: u32) -> Info<'_> {
    let mut info = Info::with_size(width, height);
    info.icc_profile = metadata.icc.as_ref().map(|icc| icc.into());
    info.exif_metadata = metadata.exif.as_ref().map(|exif| exif.into());
    if let Some(xmp) = &metadata.xmp {
        info.utf8_text.push(ITXtChunk::new(XMP_KEYWORD, xmp.as_str()));
    }
    info
}

/// How hard a PNG is compressed.
pub(crate) fn compression(options: &OutputOptions) -> Compression {
    match options.png_compression {
        PngCompression::Fast => Compression::Fast,
        PngCompression::Balanced => Compression::Balanced,
        PngCompression::High => Compression::High,
    }
}

/// Why a PNG could not be written.
pub(crate) fn failure(error: EncodingError) -> WriteFailure {
    match error {
        EncodingError::IoError(error) => WriteFailure::Io(error),
        other => WriteFailure::Io(std::io::Error::other(other)),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, Seek};

    use super::*;
    use crate::formats::specimens::Specimen;

    #[test]
    fn what_is_wrong_with_a_file_is_told_in_words() {
        let whole = Specimen::eight(24, 18, |x, y| [x as u8, y as u8, 9]).png(None);
        let said = |bytes: &[u8]| {
            let mut file = tempfile::tempfile().expect("a file");
            file.write_all(bytes).expect("written");
            let mut input = BufReader::new(file);
            input.rewind().expect("its start");
            match stored(&mut input) {
                Err(HeaderError::Damaged(words)) => words,
                other => panic!("{other:?}"),
            }
        };
        // The width is in the first chunk, behind the signature and the chunk's length and name.
        let mut changed = whole.clone();
        changed[19] ^= 1;
        assert_eq!(said(&changed), "a checksum in it is wrong: bytes of it have changed");
        assert_eq!(said(&whole[..20]), "the file ends within it");
    }

    /// A few bytes may stand for a profile as long as memory.
    #[test]
    fn headers_are_read_without_profiles() {
        let bytes = Specimen::eight(24, 18, |_, _| [9; 3]).png(Some(vec![0; HEADER_BYTES + 1]));
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(&bytes).expect("written");
        let mut input = BufReader::new(file);
        input.rewind().expect("its start");
        assert_eq!(header(&mut input).expect("a header").info().icc_profile, None);
        input.rewind().expect("its start");
        assert_eq!(icc(&mut input), None);
    }
}
