//! All options of all stages in one place.

mod text;

use serde::{Deserialize, Serialize};
use trueup_align::cameras::CameraOptions;
use trueup_align::match_points::MatchPointOptions;
use trueup_align::mesh::{LineAlignmentOptions, MeshOptions, PhotometricOptions, StructureOptions};
use trueup_align::metrics::MeasureOptions;
use trueup_align::projection::ProjectionOptions;
use trueup_align::similarity::SimilarityOptions;
use trueup_align::vanishing::VanishingOptions;
use trueup_align::warps::WarpOptions;
use trueup_compose::exposure::ExposureOptions;
use trueup_compose::layout::CanvasOptions;
use trueup_compose::render::RenderOptions;
use trueup_compose::seam::SeamOptions;
use trueup_core::memory::MemoryBudget;
use trueup_core::options::{InvalidOption, OptionDescription, StageOptions};
use trueup_core::{Error, Result};
use trueup_io::encode::OutputOptions;
use trueup_io::source::SourceOptions;
use trueup_vision::features::FeatureOptions;
use trueup_vision::lines::LineOptions;
use trueup_vision::matching::MatchingOptions;
use trueup_vision::pairing::PairingOptions;

use crate::cache::CacheOptions;
use crate::compare::CompareOptions;
use crate::method::{Alignment, Method, Structure};

trueup_core::options! {
    /// What holds for the whole run.
    pub struct WorkingOptions("stitch") {
        /// How the panorama's shape is found.
        method: Method = Method::Vpg, Allowed::Any, "";
        /// What draws overlapping photographs together: more is slower and shows fewer ghosts.
        align: Alignment = Alignment::Points, Allowed::Any, "";
        /// What of the photographs' structure is kept, beyond the neighborhoods of grid vertices.
        structure: Structure = Structure::None, Allowed::Any, "";
        /// Photographs are measured on a copy reduced to at most this many pixels; the panorama itself is made from
        /// the full photographs.
        working_pixels: f64 = 480000.0, between(10000.0, 100000000.0), "px";
        /// Size of the small pictures that exposure is compared on.
        thumbnail_pixels: f64 = 30000.0, between(100.0, 1000000.0), "px";
        /// Memory that the work may take; auto is a quarter of the machine's, or more where less is too little. The panorama
        /// is the same with any amount: with less, its canvas goes to a scratch file and photographs are decoded again.
        memory: MemoryBudget = MemoryBudget::Auto, Allowed::Any, "";
        /// Folder for the scratch file; empty for the folder of the panorama.
        scratch: String = String::new(), Allowed::Any, "";
        /// Every random choice derives from this number.
        seed: u64 = 0, between(0.0, 9007199254740992.0), "";
    }
}

macro_rules! stage_options {
    ($($(#[doc = $doc:literal])* $field:ident : $type:ty),* $(,)?) => {
        /// The options of every stage. Serialized as one table per stage; unknown tables and fields are denied.
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct StitchOptions {
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        impl StitchOptions {
            /// Every option outside its allowed range; empty when all is well.
            pub fn invalid(&self) -> Vec<InvalidOption> {
                let mut invalid = Vec::new();
                $(invalid.extend(self.$field.invalid());)*
                invalid
            }

            /// A row per option of every stage, with defaults, ranges and units.
            pub fn describe() -> Vec<OptionDescription> {
                let mut rows = Vec::new();
                $(rows.extend(<$type>::describe());)*
                rows
            }

            /// The stages' names, as in `stage.option`.
            pub fn stages() -> Vec<&'static str> {
                vec![$(<$type>::STAGE),*]
            }
        }
    };
}

stage_options! {
    /// What holds for the whole run.
    stitch: WorkingOptions,
    /// Which files are accepted.
    source: SourceOptions,
    /// How features are found.
    features: FeatureOptions,
    /// How line segments are found.
    lines: LineOptions,
    /// Which pairs are tried.
    pairing: PairingOptions,
    /// How pairs are matched and verified.
    matching: MatchingOptions,
    /// How cameras are estimated.
    cameras: CameraOptions,
    /// How vanishing points are found.
    vanishing: VanishingOptions,
    /// How rotations and scales are wanted.
    similarity: SimilarityOptions,
    /// How overlaps are sampled.
    match_points: MatchPointOptions,
    /// How the grids are deformed.
    mesh: MeshOptions,
    /// How matched lines align the grids.
    line_alignment: LineAlignmentOptions,
    /// How long lines keep their shape.
    structure: StructureOptions,
    /// How pixels align the grids.
    photometric: PhotometricOptions,
    /// How the methods that are warp models place the photographs.
    warps: WarpOptions,
    /// What the panorama is drawn on, and where the viewer looks.
    projection: ProjectionOptions,
    /// How large the panorama is.
    canvas: CanvasOptions,
    /// How exposures are evened out.
    exposure: ExposureOptions,
    /// Where one photograph ends and the next begins.
    seam: SeamOptions,
    /// How photographs are resampled and blended.
    render: RenderOptions,
    /// How the panorama is encoded.
    output: OutputOptions,
    /// How the panorama is measured.
    measures: MeasureOptions,
    /// How methods are compared side by side.
    compare: CompareOptions,
    /// How much is kept between runs.
    cache: CacheOptions,
}

/// The stages whose options a project's panorama may be composed with anew; those of the others are recorded with the
/// geometry.
const COMPOSING: [&str; 10] = [
    SourceOptions::STAGE,
    ProjectionOptions::STAGE,
    CanvasOptions::STAGE,
    ExposureOptions::STAGE,
    SeamOptions::STAGE,
    RenderOptions::STAGE,
    OutputOptions::STAGE,
    MeasureOptions::STAGE,
    CompareOptions::STAGE,
    CacheOptions::STAGE,
];

/// Options of other stages that change no result.
const SPEED_ONLY: [&str; 2] = ["stitch.memory", "stitch.scratch"];

impl StitchOptions {
    /// The stages that composing a recorded panorama takes options for, in words.
    pub fn composing_stages() -> String {
        COMPOSING.join(", ")
    }

    /// Every option outside its allowed range, and every one that does not go with another; empty when all is well.
    pub fn all_invalid(&self) -> Vec<InvalidOption> {
        let mut invalid = self.invalid();
        invalid.extend(self.projection.beyond_the_projection());
        invalid
    }

    /// Checks every option.
    ///
    /// # Errors
    /// [`Error::Options`] with the complete list of options outside their range.
    pub fn validate(&self) -> Result<()> {
        let invalid = self.all_invalid();
        if invalid.is_empty() { Ok(()) } else { Err(Error::Options(invalid)) }
    }

    /// Whether photographs are found, measured and matched by these options as by `other`, so that what was matched by the
    /// one can be aligned by the other.
    pub fn matches_alike(&self, other: &Self) -> bool {
        let working = |options: &Self| {
            let WorkingOptions { working_pixels, thumbnail_pixels, seed, .. } = options.stitch;
            (working_pixels, thumbnail_pixels, seed)
        };
        working(self) == working(other)
            && self.source == other.source
            && self.features == other.features
            && self.lines == other.lines
            && self.pairing == other.pairing
            && self.matching == other.matching
    }

    /// The options, `stage.option`, of what was finished before a panorama is composed, in which these options differ from
    /// `recorded` ones: those of the geometry, which a project records once and for all.
    pub fn differing_geometry(&self, recorded: &Self) -> Result<Vec<String>> {
        let (own, recorded) = (self.to_table()?, recorded.to_table()?);
        let mut differing = Vec::new();
        for stage in Self::stages().into_iter().filter(|stage| !COMPOSING.contains(stage)) {
            let table =
                |table: &toml::Table| table.get(stage).and_then(toml::Value::as_table).cloned().unwrap_or_default();
            let recorded = table(&recorded);
            for (option, value) in table(&own) {
                let name = format!("{stage}.{option}");
                if recorded.get(&option) != Some(&value) && !SPEED_ONLY.contains(&name.as_str()) {
                    differing.push(name);
                }
            }
        }
        Ok(differing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_bad_values_are_listed() {
        let mut options = StitchOptions::default();
        options.mesh.cell_px = -1.0;
        options.stitch.working_pixels = f64::INFINITY;
        let message = options.validate().expect_err("two bad values").to_string();
        assert!(message.contains("mesh.cell_px = -1") && message.contains("stitch.working_pixels = inf"), "{message}");
    }
}
