//! What is kept of each stage, and what decides it.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trueup_core::diagnostics::Diagnostic;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::raster::Raster;
use trueup_core::source::{PhotographSource, WorkingFrame};
use trueup_core::{Result, StageContext};
use trueup_io::decode::FilePhotographs;
use trueup_vision::features::{DESCRIPTOR_LENGTH, FeaturePoint, Features};

use super::key::KeyMaker;
use super::{Cache, Key};
use crate::align::{Component, Geometry};
use crate::measure::Measured;
use crate::options::StitchOptions;

const MEASURED: &str = "measured";
const PAIR: &str = "pair";
const LOOKS: &str = "looks";
const GEOMETRY: &str = "geometry";
/// The kinds of entries.
pub(super) const KINDS: [&str; 4] = [MEASURED, PAIR, LOOKS, GEOMETRY];

/// The keys of photographs, by what decides their measurements: their bytes, how they are turned and masked, the color
/// space that they are brought to, options.
/// `None` for files that cannot be read.
///
/// # Errors
/// [`trueup_core::Error::Cancelled`].
pub(crate) fn photograph_keys(
    photographs: &FilePhotographs,
    options: &StitchOptions,
    context: &StageContext,
) -> Result<Vec<Option<Key>>> {
    let options = KeyMaker::new(MEASURED)
        .part(&options.features)?
        .part(&options.lines)?
        .part(&(options.stitch.working_pixels, options.stitch.thumbnail_pixels))?
        .part(&photographs.colors().map(|colors| (colors.name(), colors.icc())))?
        .finish();
    let key = |index: usize| -> Result<Option<Key>> {
        context.check_cancelled()?;
        let image = &photographs.images()[index];
        let mut maker = KeyMaker::new(MEASURED).key(&options).part(&(image.width, image.height, image.orientation))?;
        if let Some(ignored) = photographs.masks(index).ignored {
            maker = maker.part(&ignored.words())?;
        }
        let content = std::fs::File::open(&image.path).and_then(|file| maker.file(file));
        Ok(content.ok().map(KeyMaker::finish))
    };
    (0..photographs.images().len()).into_par_iter().map(key).collect()
}

/// A set of photographs with what is kept of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<'a> {
    pub cache: &'a Cache,
    /// Of the photographs, see [`photograph_keys`].
    pub keys: &'a [Option<Key>],
}

impl Known<'_> {
    pub fn measured(&self, photograph: usize) -> Option<Measured> {
        self.cache.load::<StoredMeasured>(MEASURED, &self.keys[photograph]?)?.restored()
    }

    pub fn keep_measured(&self, photograph: usize, measured: &Measured) {
        if let Some(key) = &self.keys[photograph] {
            self.cache.store(MEASURED, key, &StoredMeasured::new(measured));
        }
    }

    pub fn pair(&self, (a, b): (usize, usize), forced: bool, options: &StitchOptions) -> Option<PairMatches> {
        let key = self.pair_key((a, b), forced, options)?;
        self.cache.load::<PairMatches>(PAIR, &key).map(|pair| PairMatches { a, b, ..pair })
    }

    pub fn keep_pair(&self, pair: &PairMatches, forced: bool, options: &StitchOptions) {
        if let Some(key) = self.pair_key((pair.a, pair.b), forced, options) {
            // Numbers of photographs belong to this run.
            self.cache.store(PAIR, &key, &PairMatches { a: 0, b: 1, ..pair.clone() });
        }
    }

    fn pair_key(&self, (a, b): (usize, usize), forced: bool, options: &StitchOptions) -> Option<Key> {
        let maker = KeyMaker::new(PAIR).key(&self.keys[a]?).key(&self.keys[b]?);
        Some(maker.part(&(forced, options.stitch.seed)).ok()?.part(&options.matching).ok()?.finish())
    }

    /// What earlier runs found at a quick look at photograph `b` and each one before it.
    pub fn looks(&self, b: usize, options: &StitchOptions) -> Vec<Option<usize>> {
        let known = || {
            let key = self.looks_key(b, options)?;
            Some(self.cache.load::<Vec<(Key, usize)>>(LOOKS, &key)?.into_iter().collect::<BTreeMap<_, _>>())
        };
        let known = known().unwrap_or_default();
        self.keys[..b].iter().map(|key| known.get(key.as_ref()?).copied()).collect()
    }

    pub fn keep_looks(&self, b: usize, looks: &[usize], options: &StitchOptions) {
        if let Some(key) = self.looks_key(b, options) {
            let looks: Vec<(Key, usize)> =
                self.keys.iter().zip(looks).filter_map(|(key, &look)| Some(((*key)?, look))).collect();
            self.cache.store(LOOKS, &key, &looks);
        }
    }

    fn looks_key(&self, b: usize, _options: &StitchOptions) -> Option<Key> {
        Some(KeyMaker::new(LOOKS).key(&self.keys[b]?).finish())
    }

    /// The geometry of a component and what was reported on the way.
    pub fn geometry(&self, key: &Key) -> Option<(Geometry, Vec<Diagnostic>)> {
        self.cache.load(GEOMETRY, key)
    }

    pub fn keep_geometry(&self, key: &Key, geometry: &Geometry, findings: &[Diagnostic]) {
        self.cache.store(GEOMETRY, key, &(geometry, findings));
    }

    /// Everything that decides the geometry of a component.
    pub fn geometry_key(&self, component: &Component, options: &StitchOptions) -> Option<Key> {
        let StitchOptions { cameras, vanishing, similarity, match_points, mesh, warps, lines, .. } = options;
        let StitchOptions { line_alignment, structure, photometric, .. } = options;
        let working = &options.stitch;
        let images: Vec<_> =
            component.images.iter().map(|image| (&image.name, image.path.file_name(), image.focal_prior)).collect();
        let images: Vec<_> = images
            .into_iter()
            .map(|(name, file, focal)| (name, file.map(|file| file.to_string_lossy()), focal))
            .collect();
        let mut maker = KeyMaker::new(GEOMETRY)
            .part(&(working.method, working.align, working.structure, working.seed))
            .ok()?
            .part(&(cameras, vanishing, similarity, match_points, mesh, warps, lines))
            .ok()?
            .part(&(line_alignment, structure, photometric))
            .ok()?
            .part(&(images, component.camera_groups(), &component.pairs))
            .ok()?
            .part(&(component.reference, component.reference_rotation))
            .ok()?;
        for &member in &component.members {
            maker = maker.key(&self.keys[member]?);
        }
        Some(maker.finish())
    }
}

/// A raster as it is kept.
#[derive(Debug, Serialize, Deserialize)]
struct StoredRaster {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<u8>,
}

impl StoredRaster {
    fn new(raster: &Raster<u8>) -> Self {
        let (width, height, channels) = (raster.width(), raster.height(), raster.channels());
        Self { width, height, channels, data: raster.data().to_vec() }
    }

    fn restored(self) -> Option<Raster<u8>> {
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
    lines: Vec<LineSegment>,
    gray: Option<StoredRaster>,
    thumbnail: StoredRaster,
    thumbnail_frame: WorkingFrame,
}

impl StoredMeasured {
    fn new(measured: &Measured) -> Self {
        let Features { points, descriptors, descriptor_points } = &measured.features;
        Self {
            frame: measured.frame,
            points: points.clone(),
            descriptors: descriptors.concat(),
            descriptor_points: descriptor_points.clone(),
            lines: measured.lines.clone(),
            gray: measured.gray.as_ref().map(StoredRaster::new),
            thumbnail: StoredRaster::new(&measured.thumbnail),
            thumbnail_frame: measured.thumbnail_frame,
        }
    }

    fn restored(self) -> Option<Measured> {
        let (descriptors, rest) = self.descriptors.as_chunks::<DESCRIPTOR_LENGTH>();
        if !rest.is_empty() {
            return None;
        }
        Some(Measured {
            frame: self.frame,
            features: Features {
                points: self.points,
                descriptors: descriptors.to_vec(),
                descriptor_points: self.descriptor_points,
            },
            lines: self.lines,
            gray: match self.gray {
                Some(gray) => Some(gray.restored()?),
                None => None,
            },
            thumbnail: self.thumbnail.restored()?,
            thumbnail_frame: self.thumbnail_frame,
        })
    }
}
