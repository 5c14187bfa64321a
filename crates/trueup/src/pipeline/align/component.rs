//! What the geometry stages need of one group of overlapping photographs.

use std::path::Path;

use trueup_align::cameras::CameraPrior;
use trueup_core::lines::LineSegment;
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::{SourceImage, WorkingFrame};

use crate::pipeline::measured::Measured;

/// One group of overlapping photographs with everything the geometry stages need; indices are local, 0..N.
#[derive(Debug)]
pub(crate) struct Component<'a> {
    /// Positions of the members among all photographs, ascending.
    pub members: Vec<usize>,
    pub images: Vec<&'a SourceImage>,
    pub frames: Vec<WorkingFrame>,
    pub lines: Vec<Vec<LineSegment>>,
    /// Gray values at the working size, for those that were kept.
    pub grays: Vec<Option<&'a Raster<u8>>>,
    pub pairs: Vec<PairMatches>,
    pub reference: usize,
    /// Rotation that the user's graph wants of the reference photograph, radians clockwise.
    pub reference_rotation: f64,
}

impl<'a> Component<'a> {
    /// Cuts a component out of the measured photographs; pairs are renumbered to local indices.
    pub(crate) fn new(
        members: &[usize],
        reference: usize,
        reference_rotation: f64,
        images: &'a [SourceImage],
        measured: &'a [Option<Measured>],
        pairs: &[PairMatches],
    ) -> Self {
        let local = |photograph: usize| members.binary_search(&photograph).ok();
        let known = |photograph: &usize| measured[*photograph].as_ref();
        let pairs = pairs
            .iter()
            .filter(|pair| pair.verdict.is_joined())
            .filter_map(|pair| Some(PairMatches { a: local(pair.a)?, b: local(pair.b)?, ..pair.clone() }))
            .collect();
        Self {
            members: members.to_vec(),
            images: members.iter().map(|&photograph| &images[photograph]).collect(),
            frames: members.iter().filter_map(known).map(|one| one.frame).collect(),
            lines: members.iter().filter_map(known).map(|one| one.lines.clone()).collect(),
            grays: members.iter().filter_map(known).map(|one| one.gray.as_ref()).collect(),
            pairs,
            reference: local(reference).unwrap_or(0),
            reference_rotation,
        }
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.images.iter().map(|image| image.name.clone()).collect()
    }

    /// Even grids over the working photographs, of cells about `cell_px` wide.
    pub(super) fn grids(&self, cell_px: f64) -> Vec<GridMesh> {
        self.frames.iter().map(|frame| GridMesh::regular(frame.width, frame.height, cell_px)).collect()
    }

    /// A number for each photograph that depends neither on its folder nor on the order of the inputs.
    pub(super) fn seeds(&self) -> Vec<u64> {
        self.images.iter().map(|image| name_seed(&image.path)).collect()
    }

    /// Which photographs one camera took: [`camera_groups`].
    pub(crate) fn camera_groups(&self) -> Vec<usize> {
        camera_groups(&self.images)
    }

    /// What metadata say of the cameras, in working pixels.
    pub(super) fn camera_priors(&self) -> Vec<CameraPrior> {
        self.images
            .iter()
            .zip(&self.frames)
            .zip(self.camera_groups())
            .map(|((image, frame), camera_group)| CameraPrior {
                frame: *frame,
                focal_px: image.focal_prior.map(|prior| prior.focal_px * frame.working_from_full),
                camera_group,
            })
            .collect()
    }
}

/// Which photographs one camera took, as far as models and sizes tell: a number for each.
pub(crate) fn camera_groups(images: &[&SourceImage]) -> Vec<usize> {
    let key = |image: &SourceImage| {
        let (short, long) = (image.width.min(image.height), image.width.max(image.height));
        (image.camera_model.clone(), short, long)
    };
    let mut keys: Vec<_> = images.iter().map(|image| key(image)).collect();
    keys.sort();
    keys.dedup();
    images.iter().map(|image| keys.binary_search(&key(image)).unwrap_or(0)).collect()
}

/// A number for a file name, the same whatever folder it lies in and wherever it stands among the inputs.
pub(super) fn name_seed(path: &Path) -> u64 {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.bytes().fold(0, |hash: u64, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)))
}
