//! Pictures coded by AV1.

use re_rav1d::dav1d::pixel::YUVRange;
use re_rav1d::{Decoder, Error, Picture, PixelLayout, PlanarImageComponent, Settings};

use super::color::Sampling;

/// How often a decoder may ask for what it was given already; it takes a picture's pieces one at a time.
const MOST_ROUNDS: usize = 4096;

/// What is said of a picture that is not all there.
const ENDED: &str = "it ends before its picture does";

/// A picture as it is coded.
pub(super) struct Frame(Picture);

/// The first picture that is shown of `data`, if it is of this size.
///
/// # Errors
/// What the decoder says, or what the picture has that was not stated.
pub(super) fn decode(data: Vec<u8>, [width, height]: [usize; 2], operating_point: u8) -> Result<Frame, String> {
    // Of which the decoder would print that it is none.
    if data.is_empty() {
        return Err(ENDED.to_owned());
    }
    let mut settings = Settings::new();
    // Photographs are decoded side by side; the decoder's own threads would add to them.
    settings.set_n_threads(1);
    settings.set_max_frame_delay(1);
    settings.set_all_layers(false);
    settings.set_operating_point(operating_point.into());
    settings.set_frame_size_limit(u32::try_from(width.saturating_mul(height)).unwrap_or(u32::MAX));
    let mut decoder = Decoder::with_settings(&settings).map_err(words)?;
    let mut sent = decoder.send_data(data, None, None, None);
    for _ in 0..MOST_ROUNDS {
        match decoder.get_picture() {
            Ok(picture) => {
                let found = [picture.width() as usize, picture.height() as usize];
                if found != [width, height] {
                    return Err(format!("{width} x {height} pixels are stated, {} x {} coded", found[0], found[1]));
                }
                return Ok(Frame(picture));
            }
            Err(Error::Again) => {}
            Err(error) => return Err(words(error)),
        }
        match sent {
            Ok(()) => break,
            Err(Error::Again) => sent = decoder.send_pending_data(),
            Err(error) => return Err(words(error)),
        }
    }
    Err(ENDED.to_owned())
}

/// What an error says, in words that mean something to people who do not know the library.
fn words(error: Error) -> String {
    match error {
        Error::NotEnoughMemory => "there is not enough memory".to_owned(),
        Error::UnsupportedBitstream => "its AV1 is of a kind that the decoder does not know".to_owned(),
        _ => "its AV1 is damaged, or larger than is stated".to_owned(),
    }
}

impl Frame {
    /// Bits of a sample.
    pub(super) fn bits(&self) -> usize {
        self.0.bit_depth()
    }

    /// How color differences are stored; `None` of gray.
    pub(super) fn sampling(&self) -> Option<Sampling> {
        match self.0.pixel_layout() {
            PixelLayout::I400 => None,
            PixelLayout::I420 => Some(Sampling { x: 2, y: 2 }),
            PixelLayout::I422 => Some(Sampling { x: 2, y: 1 }),
            PixelLayout::I444 => Some(Sampling { x: 1, y: 1 }),
        }
    }

    /// Whether samples use all of their numbers.
    pub(super) fn is_full_range(&self) -> bool {
        self.0.color_range() == YUVRange::Full
    }

    /// The code point of the matrix (ITU-T H.273, table 4).
    pub(super) fn matrix(&self) -> u16 {
        self.0.matrix_coefficients() as u16
    }

    /// Hands every row of a plane with its number to `take`: plane 0 is luma, 1 and 2 are color differences.
    pub(super) fn rows(&self, plane: usize, mut take: impl FnMut(usize, &mut dyn Iterator<Item = u16>)) {
        let component = [PlanarImageComponent::Y, PlanarImageComponent::U, PlanarImageComponent::V][plane.min(2)];
        let (stride, rows) = self.0.plane_data_geometry(component);
        let (stride, rows) = (stride as usize, rows as usize);
        let samples = self.0.plane(component);
        let bytes = samples.as_ref();
        for (y, row) in bytes.chunks_exact(stride.max(1)).take(rows).enumerate() {
            if self.bits() > 8 {
                take(y, &mut row.as_chunks::<2>().0.iter().map(|&sample| u16::from_ne_bytes(sample)));
            } else {
                take(y, &mut row.iter().map(|&sample| sample.into()));
            }
        }
    }
}
