//! The metadata of a panorama, from its record.

use std::path::Path;

use trueup_core::geometry::matrix_from_rows;
use trueup_io::color::PhotographColors;
use trueup_io::encode::{Metadata, OutputOptions, OutputProfile};
use trueup_io::provenance::{self, PanoramaDescription};

use super::record::{ImageRecord, Project};

/// What the files of the photographs tell, as far as the options let it pass, and the profile of `colors`.
pub(crate) fn metadata(project: &Project, colors: Option<&PhotographColors>, options: &OutputOptions) -> Metadata {
    let used: Vec<&ImageRecord> = project.used_images().collect();
    let paths: Vec<&Path> = used.iter().map(|image| Path::new(&image.path)).collect();
    let yaws: Vec<Option<f64>> = used.iter().map(|image| yaw(image)).collect();
    let subject = PanoramaDescription {
        photographs: &paths,
        reference: used.iter().position(|image| image.path == project.reference).unwrap_or(0),
        yaws: &yaws,
        width: project.canvas.width,
        height: project.canvas.height,
        is_srgb: options.profile == OutputProfile::Srgb || colors.is_none_or(PhotographColors::is_srgb),
        spherical: project.projection.and_then(|projection| projection.sphere),
        pose_deg: project.projection.map_or([0.0; 2], |projection| [projection.pitch_deg, projection.roll_deg]),
    };
    let icc = colors.and_then(PhotographColors::icc).map(<[u8]>::to_vec);
    Metadata { icc, ..provenance::describe(&subject, options.metadata) }
}

/// Where a photograph looks in the levelled world, radians to the right of its z axis.
fn yaw(image: &ImageRecord) -> Option<f64> {
    let forward = matrix_from_rows(image.level_rotation()?).row(2).transpose();
    Some(forward.x.atan2(forward.z))
}
