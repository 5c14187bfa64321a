//! What is known of a photograph after its pixels were looked at, and how that is kept between runs.

use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use trueup_core::lines::{EdgeCurve, LineSegment};
use trueup_core::mask::Mask;
use trueup_core::raster::Raster;
use trueup_core::source::WorkingFrame;
use trueup_vision::border::EvenBorder;
use trueup_vision::features::{DESCRIPTOR_LENGTH, FeaturePoint, Features};
use trueup_vision::padding::Padding;

use super::outside::{blacken, curves_outside, features_outside, lines_outside};
use super::shelf::ShelvedFeatures;

/// What is known of a photograph after its pixels were looked at.
#[derive(Debug)]
pub(crate) struct Measured {
    pub frame: WorkingFrame,
    pub features: ShelvedFeatures,
    /// In working pixels.
    pub lines: Vec<LineSegment>,
    /// Edges that may be straight lines of the scene, in working pixels.
    pub curves: Vec<EdgeCurve>,
    /// Gray values at the working size, kept if the mesh is to be refined by pixels.
    pub gray: Option<Raster<u8>>,
    pub thumbnail: Raster<u8>,
    pub thumbnail_frame: WorkingFrame,
    /// What is even at the picture's sides, in working pixels.
    pub border: EvenBorder,
    /// What is even between the picture's sides and a photograph askew in it, in working pixels.
    pub padding: Padding,
}

impl Measured {
    /// Forgets what is in the parts that `ignored` marks in the photograph's pixels. Features are in memory then,
    /// wherever they were.
    ///
    /// # Errors
    /// [`trueup_core::Error::Io`] if features cannot be read.
    pub(crate) fn forget(&mut self, ignored: &Mask) -> trueup_core::Result<()> {
        let frame = &self.frame;
        self.features = ShelvedFeatures::Held(features_outside(self.features.get()?.as_ref(), ignored, frame));
        self.lines = lines_outside(std::mem::take(&mut self.lines), ignored, frame);
        self.curves = curves_outside(std::mem::take(&mut self.curves), ignored, frame);
        blacken(&mut self.thumbnail, ignored, &self.thumbnail_frame);
        Ok(())
    }
}

impl Serialize for Measured {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        StoredMeasured::new(self).map_err(S::Error::custom)?.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Measured {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = StoredMeasured::deserialize(deserializer)?;
        stored.restored().ok_or_else(|| D::Error::custom("sizes that do not fit"))
    }
}

/// A raster as it is kept.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct StoredRaster {
    width: usize,
    height: usize,
    channels: usize,
    #[serde(with = "serde_bytes")]
    data: Vec<u8>,
}

impl StoredRaster {
    pub(crate) fn new(raster: &Raster<u8>) -> Self {
        let (width, height, channels) = (raster.width(), raster.height(), raster.channels());
        Self { width, height, channels, data: raster.data().to_vec() }
    }

    pub(crate) fn restored(self) -> Option<Raster<u8>> {
        Raster::from_data(self.width, self.height, self.channels, self.data).ok()
    }
}

/// A [`Measured`] photograph as it is kept.
#[derive(Debug, Serialize, Deserialize)]
struct StoredMeasured {
    frame: WorkingFrame,
    points: Vec<FeaturePoint>,
    descriptors: Vec<u8>,
    descriptor_points: Vec<u32>,
    surroundings: StoredRaster,
    lines: Vec<LineSegment>,
    curves: Vec<EdgeCurve>,
    gray: Option<StoredRaster>,
    thumbnail: StoredRaster,
    thumbnail_frame: WorkingFrame,
    border: EvenBorder,
    padding: Padding,
}

impl StoredMeasured {
    fn new(measured: &Measured) -> trueup_core::Result<Self> {
        let Features { points, descriptors, descriptor_points, surroundings } = measured.features.get()?.into_owned();
        Ok(Self {
            frame: measured.frame,
            points,
            descriptors: descriptors.into_flattened(),
            descriptor_points,
            surroundings: StoredRaster::new(&surroundings),
            lines: measured.lines.clone(),
            curves: measured.curves.clone(),
            gray: measured.gray.as_ref().map(StoredRaster::new),
            thumbnail: StoredRaster::new(&measured.thumbnail),
            thumbnail_frame: measured.thumbnail_frame,
            border: measured.border,
            padding: measured.padding.clone(),
        })
    }

    fn restored(self) -> Option<Measured> {
        let (descriptors, rest) = self.descriptors.as_chunks::<DESCRIPTOR_LENGTH>();
        if !rest.is_empty() {
            return None;
        }
        Some(Measured {
            frame: self.frame,
            features: ShelvedFeatures::Held(Features {
                points: self.points,
                descriptors: descriptors.to_vec(),
                descriptor_points: self.descriptor_points,
                surroundings: self.surroundings.restored()?,
            }),
            lines: self.lines,
            curves: self.curves,
            gray: match self.gray {
                Some(gray) => Some(gray.restored()?),
                None => None,
            },
            thumbnail: self.thumbnail.restored()?,
            thumbnail_frame: self.thumbnail_frame,
            border: self.border,
            padding: self.padding,
        })
    }
}
