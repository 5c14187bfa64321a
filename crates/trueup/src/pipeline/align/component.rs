//! What the geometry stages need of one group of overlapping photographs.

use std::path::Path;

use trueup_align::cameras::CameraPrior;
use trueup_align::far_horizon::ShownPhotograph;
use trueup_align::mesh::{self, MeshOptions};
use trueup_core::lines::{EdgeCurve, LineSegment};
use trueup_core::matches::PairMatches;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;
use trueup_core::source::{FocalSource, RecordedGravity, SourceImage, WorkingFrame};

use crate::pipeline::measured::Measured;

/// One group of overlapping photographs with everything the geometry stages need; indices are local, 0..N.
#[derive(Debug)]
pub(crate) struct Component<'a> {
    /// Positions of the members among all photographs, ascending.
    pub members: Vec<usize>,
    pub images: Vec<&'a SourceImage>,
    pub frames: Vec<WorkingFrame>,
    pub lines: Vec<Vec<LineSegment>>,
    /// Edges of each photograph that may be straight lines of the scene.
    pub curves: Vec<&'a [EdgeCurve]>,
    /// A small copy of each photograph, in color, with its frame.
    pub thumbnails: Vec<(&'a Raster<u8>, &'a WorkingFrame)>,
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
            curves: members.iter().filter_map(known).map(|one| one.curves.as_slice()).collect(),
            thumbnails: members.iter().filter_map(known).map(|one| (&one.thumbnail, &one.thumbnail_frame)).collect(),
            grays: members.iter().filter_map(known).map(|one| one.gray.as_ref()).collect(),
            pairs,
            reference: local(reference).unwrap_or(0),
            reference_rotation,
        }
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.images.iter().map(|image| image.name.clone()).collect()
    }

    /// The largest side of a cell of its grids, working pixels.
    pub(super) fn cell_px(&self, options: &MeshOptions) -> f64 {
        mesh::cell_px(self.frames.iter().map(|frame| [frame.width, frame.height]), options)
    }

    /// Even grids over the working photographs, of cells about `cell_px` wide.
    pub(super) fn grids(&self, cell_px: f64) -> Vec<GridMesh> {
        self.frames.iter().map(|frame| GridMesh::regular(frame.width, frame.height, cell_px)).collect()
    }

    /// A number for each photograph that depends neither on its folder nor on the order of the inputs.
    pub(super) fn seeds(&self) -> Vec<u64> {
        self.images.iter().map(|image| name_seed(&image.path)).collect()
    }

    /// Which way each photograph's camera recorded as down, if it did.
    pub(super) fn gravity(&self) -> Vec<Option<RecordedGravity>> {
        self.images.iter().map(|image| image.gravity).collect()
    }

    /// What the far horizon is sought in.
    pub(super) fn shown(&self) -> Vec<ShownPhotograph<'_>> {
        let photographs = self.frames.iter().zip(&self.curves).zip(&self.thumbnails);
        let shown = |((frame, &curves), &(thumbnail, thumbnail_frame))| ShownPhotograph {
            frame,
            curves,
            thumbnail,
            thumbnail_frame,
        };
        photographs.map(shown).collect()
    }

    /// Which photographs one camera took: [`camera_groups`].
    pub(crate) fn camera_groups(&self) -> Vec<usize> {
        camera_groups(&self.images)
    }

    /// Which photographs one lens took at one focal length: [`lens_groups`].
    pub(super) fn lens_groups(&self) -> Vec<usize> {
        lens_groups(&self.images)
    }

    /// What metadata and the user say of the cameras, in working pixels.
    pub(super) fn camera_priors(&self) -> Vec<CameraPrior> {
        let groups = self.camera_groups().into_iter().zip(self.lens_groups());
        let photographs = self.images.iter().zip(&self.frames).zip(groups);
        photographs
            .map(|((image, frame), (camera_group, lens_group))| CameraPrior {
                camera_group,
                lens_group,
                ..camera_prior(image, *frame)
            })
            .collect()
    }
}

/// What metadata and the user say of the camera of one photograph by itself, in pixels of its working `frame`.
pub(crate) fn camera_prior(image: &SourceImage, frame: WorkingFrame) -> CameraPrior {
    CameraPrior {
        focal_px: image.focal_prior.map(|prior| prior.focal_px * frame.working_from_full),
        focal_told: image.focal_prior.is_some_and(|prior| prior.source == FocalSource::Project),
        lens: image.lens.map(|lens| lens.scaled(frame.working_from_full)),
        ..CameraPrior::unknown(frame, 0)
    }
}

/// Which photographs one camera took, as far as models of camera and lens and sizes tell: a number for each.
pub(crate) fn camera_groups(images: &[&SourceImage]) -> Vec<usize> {
    let key = |image: &&SourceImage| {
        let (short, long) = (image.width.min(image.height), image.width.max(image.height));
        (image.camera_model.clone(), image.lens_model.clone(), short, long)
    };
    numbered(images.iter().map(key).collect())
}

/// Which of these were taken at one focal length: what a zoom bends differs from one to the next.
pub(crate) fn lens_groups(images: &[&SourceImage]) -> Vec<usize> {
    let cameras = camera_groups(images);
    // By what the file states, to the micrometer: positive numbers, which their bits order.
    let setting = |image: &SourceImage| image.focal_mm.map(|focal_mm| (1e3 * focal_mm).round().to_bits());
    let keys: Vec<_> = images.iter().zip(cameras).map(|(image, camera)| (camera, setting(image))).collect();
    numbered(keys)
}

/// A number for each key, the same for the same keys.
fn numbered<K: Ord>(keys: Vec<K>) -> Vec<usize> {
    let mut order: Vec<&K> = keys.iter().collect();
    order.sort();
    order.dedup();
    keys.iter().map(|key| order.binary_search(&key).unwrap_or(0)).collect()
}

/// A number for a file name, the same whatever folder it lies in and wherever it stands among the inputs.
pub(super) fn name_seed(path: &Path) -> u64 {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.bytes().fold(0, |hash: u64, byte| hash.wrapping_mul(31).wrapping_add(u64::from(byte)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(lens_model: Option<&str>, focal_mm: Option<f64>) -> SourceImage {
        SourceImage {
            camera_model: Some("Camera".to_owned()),
            lens_model: lens_model.map(str::to_owned),
            focal_mm,
            ..SourceImage::unknown("a.jpg", "a.jpg", [600, 400])
        }
    }

    #[test]
    fn another_lens_is_another_camera_and_another_focal_length_another_lens() {
        let images = [
            image(Some("A"), Some(24.0)),
            image(Some("B"), Some(24.0)),
            image(Some("A"), Some(35.0)),
            image(Some("A"), Some(24.0)),
            image(None, None),
        ];
        let images: Vec<&SourceImage> = images.iter().collect();
        let cameras = camera_groups(&images);
        assert_eq!([cameras[0], cameras[0]], [cameras[2], cameras[3]]);
        assert!(cameras[0] != cameras[1] && cameras[0] != cameras[4]);
        let lenses = lens_groups(&images);
        assert_eq!(lenses[0], lenses[3]);
        let mut distinct = vec![lenses[0], lenses[1], lenses[2], lenses[4]];
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), 4);
    }
}
