//! All options of all phases in one place.

mod method;
mod retired;
mod text;

use serde::{Deserialize, Serialize};
use trueup_align::cameras::CameraOptions;
use trueup_align::match_points::MatchPointOptions;
use trueup_align::mesh::{LineAlignmentOptions, MeshOptions, PhotometricOptions, StructureOptions};
use trueup_align::metrics::PixelMeasureOptions;
use trueup_align::projection::{Projection, ProjectionOptions};
use trueup_align::similarity::SimilarityOptions;
use trueup_align::vanishing::VanishingOptions;
use trueup_align::warps::WarpOptions;
use trueup_compose::exposure::ExposureOptions;
use trueup_compose::layout::CanvasOptions;
use trueup_compose::render::RenderOptions;
use trueup_compose::seam::SeamOptions;
use trueup_core::memory::MemoryBudget;
use trueup_core::options::{InvalidOption, OptionDescription, OptionValue, StageOptions};
use trueup_core::{Error, Result};
use trueup_io::encode::OutputOptions;
use trueup_io::source::SourceOptions;
use trueup_vision::features::FeatureOptions;
use trueup_vision::lines::LineOptions;
use trueup_vision::matching::MatchingOptions;
use trueup_vision::pairing::PairingOptions;
use trueup_vision::stacks::StackOptions;

pub use text::ChangedOption;

pub(crate) use method::MethodForm;
pub use method::{Evidence, Method, Structure};

trueup_core::options! {
    /// What photographs are measured on.
    pub struct WorkingOptions("working") {
        /// Photographs are measured on a copy reduced to at most this many pixels; the panorama itself is made from the
        /// full photographs. Raise it for very fine detail or small overlaps; time grows in proportion.
        pixels: f64 = 480000.0, between(10000.0, 100000000.0), "px";
    }
}

trueup_core::options! {
    /// Where random choices come from.
    pub struct RandomOptions("random") {
        /// Every random choice, from the verification of pairs on, derives from this number. Change it to see how much
        /// of a result is chance.
        seed: u64 = 0, between(0.0, 9007199254740992.0), "";
    }
}

trueup_core::options! {
    /// How the panorama's shape is found.
    pub struct ShapeOptions("stitch") {
        /// How the panorama's shape is found. Choose another one to compare, or for photographs that it serves better.
        method: Method = Method::Vpg, Allowed::Any, "", basic;
        /// What draws overlapping photographs together. Where things stand twice or lines break at seams, take more
        /// than auto does: it is slower and shows fewer ghosts.
        align: Evidence = Evidence::Auto, Allowed::Any, "", basic;
        /// What of the photographs' structure is kept, beyond the neighborhoods of grid vertices. Choose lines where
        /// long edges bend.
        structure: Structure = Structure::None, Allowed::Any, "";
    }
}

trueup_core::options! {
    /// What the work may take of the machine. Nothing of it changes the panorama.
    pub struct ResourceOptions("resources") {
        /// Memory that the work may take; auto is a quarter of the machine's, or more where less is too little. With
        /// less, the canvas goes to a scratch file and photographs are decoded again. Set it where other programs need
        /// theirs.
        memory: MemoryBudget = MemoryBudget::Auto, Allowed::Any, "", basic;
        /// Folder for the scratch file; empty for the folder of the panorama. Set it where that disk is slow or full.
        scratch: String = String::new(), Allowed::Any, "";
        /// Size of the photograph cache up to which results are kept, where a folder for it is given; those not used
        /// for the longest time go first.
        cache_bytes: f64 = 4e9, between(0.0, 1e15), "bytes";
    }
}

/// A part of the work, in its order. What it makes depends on its own options and on those of the phases before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// From pixels to features and lines.
    Measure,
    /// From features to pairs and their graph.
    Match,
    /// From pairs to geometry: cameras and deformed grids.
    Align,
    /// From geometry to a view, a canvas and what of it is kept.
    Arrange,
    /// From canvas and pixels to light, seams and the panorama.
    Compose,
}

macro_rules! phases {
    ($(
        $(#[doc = $phase_doc:literal])*
        $phase_field:ident : $phase_type:ident ($phase:expr) {
            $($(#[doc = $doc:literal])* $field:ident : $type:ty,)*
        }
    )*) => {
        $(
            $(#[doc = $phase_doc])*
            #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
            pub struct $phase_type {
                $($(#[doc = $doc])* pub $field: $type,)*
            }
        )*

        /// The options of every phase. Serialized as tables side by side; unknown tables and fields are denied.
        ///
        /// ```
        /// use trueup::{Method, StitchOptions};
        /// let mut options = StitchOptions::default();
        /// options.set("stitch.method=apap")?;
        /// options.merge_toml("[output]\njpeg_quality = 80", "mine.toml")?;
        /// assert_eq!((options.align.stitch.method, options.compose.output.jpeg_quality), (Method::Apap, 80));
        /// let refused = options.set("stitch.seed=3").unwrap_err().to_string();
        /// assert!(refused.contains("is now \"random.seed\""), "{refused}");
        /// # Ok::<(), trueup::Error>(())
        /// ```
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        #[serde(from = "Tables", into = "Tables")]
        pub struct StitchOptions {
            $($(#[doc = $phase_doc])* pub $phase_field: $phase_type,)*
        }

        /// [`StitchOptions`] as people write them: the tables of all phases side by side.
        #[derive(Default, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        struct Tables {
            $($($field: $type,)*)*
        }

        impl From<Tables> for StitchOptions {
            fn from(tables: Tables) -> Self {
                Self { $($phase_field: $phase_type { $($field: tables.$field,)* },)* }
            }
        }

        impl From<StitchOptions> for Tables {
            fn from(options: StitchOptions) -> Self {
                Self { $($($field: options.$phase_field.$field,)*)* }
            }
        }

        impl StitchOptions {
            /// Every option outside its allowed range; empty when all is well.
            fn out_of_range(&self) -> Vec<InvalidOption> {
                let mut invalid = Vec::new();
                $($(invalid.extend(self.$phase_field.$field.invalid());)*)*
                invalid
            }

            /// A row per option, with defaults, ranges and units, in the order of the phases.
            pub fn describe() -> Vec<OptionDescription> {
                let mut rows = Vec::new();
                $($(rows.extend(<$type>::describe());)*)*
                rows
            }

            /// The tables' names, as in `table.option`, each with the phase that its options belong to; `None` for
            /// those that decide how the work is done and told, but not what comes of it.
            pub fn tables() -> Vec<(&'static str, Option<Phase>)> {
                vec![$($((<$type>::STAGE, $phase),)*)*]
            }
        }
    };
}

phases! {
    /// How photographs are measured.
    measure: MeasureOptions (Some(Phase::Measure)) {
        /// Which files are accepted.
        source: SourceOptions,
        /// What photographs are measured on.
        working: WorkingOptions,
        /// What becomes of photographs of one view at several exposures.
        stacks: StackOptions,
        /// How features are found.
        features: FeatureOptions,
        /// How line segments are found.
        lines: LineOptions,
    }
    /// How photographs are matched.
    matching: MatchOptions (Some(Phase::Match)) {
        /// Where random choices come from.
        random: RandomOptions,
        /// Which pairs are tried.
        pairing: PairingOptions,
        /// How pairs are matched and verified.
        matching: MatchingOptions,
    }
    /// How the panorama's geometry is found.
    align: AlignOptions (Some(Phase::Align)) {
        /// How the panorama's shape is found.
        stitch: ShapeOptions,
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
    }
    /// How the panorama is laid out.
    arrange: ArrangeOptions (Some(Phase::Arrange)) {
        /// What the panorama is drawn on, and where the viewer looks.
        projection: ProjectionOptions,
        /// How large the panorama is.
        canvas: CanvasOptions,
    }
    /// How the panorama is composed and encoded.
    compose: ComposeOptions (Some(Phase::Compose)) {
        /// How exposures are evened out.
        exposure: ExposureOptions,
        /// Where one photograph ends and the next begins.
        seam: SeamOptions,
        /// How photographs are resampled and blended.
        render: RenderOptions,
        /// How the panorama is encoded.
        output: OutputOptions,
    }
    /// What decides how the work is done, but not what comes of it.
    run: RunOptions (None) {
        /// What the work may take of the machine.
        resources: ResourceOptions,
        /// How the panorama is measured.
        measures: PixelMeasureOptions,
    }
}

impl StitchOptions {
    /// The tables that composing a recorded panorama takes options from, in words.
    pub fn composing_tables() -> String {
        let composing = Self::tables().into_iter().filter(|(table, phase)| !is_geometry(table, *phase));
        composing.map(|(table, _)| table).collect::<Vec<_>>().join(", ")
    }

    /// Every option outside its allowed range, and every one that does not go with another; empty when all is well.
    pub fn invalid(&self) -> Vec<InvalidOption> {
        let mut invalid = self.out_of_range();
        invalid.extend(self.align.cameras.beyond_the_lens());
        invalid.extend(self.arrange.projection.beyond_the_projection());
        invalid.extend(self.contradicting_the_method());
        invalid
    }

    /// The options with those that the method fixes at their values: what the geometry is found with, and what is
    /// recorded.
    ///
    /// ```
    /// let mut options = trueup::StitchOptions::default();
    /// options.set("stitch.method=vpg-published")?;
    /// assert_eq!(options.fixed_by_method().align.mesh.subdivision, 1);
    /// options.set("mesh.subdivision=3")?;
    /// let refused = options.validate().unwrap_err().to_string();
    /// let said = "mesh.subdivision = 3 (allowed: 1, which the method vpg-published fixes)";
    /// assert!(refused.contains(said), "{refused}");
    /// # Ok::<(), trueup::Error>(())
    /// ```
    #[must_use]
    pub fn fixed_by_method(&self) -> Self {
        let mut fixed = self.clone();
        let method = fixed.align.stitch.method;
        method.fix(&mut fixed.align);
        if fixed.arrange.projection.kind == Projection::Auto && !method.chooses_view() {
            fixed.arrange.projection.kind = Projection::Mesh;
        }
        fixed
    }

    /// Options that were changed to another value than the method fixes them at. Those at their defaults pass: they
    /// were not asked for.
    fn contradicting_the_method(&self) -> Vec<InvalidOption> {
        let fixed = self.fixed_by_method();
        if fixed == *self {
            return Vec::new();
        }
        let tables = [self.to_table(), fixed.to_table(), Self::default().to_table()];
        let [Ok(own), Ok(fixed), Ok(default)] = tables else { return Vec::new() };
        let mut contradicting = Vec::new();
        for row in Self::describe() {
            let Some((table, option)) = row.name.split_once('.') else { continue };
            // As text: a value that is no number is not equal to itself.
            let value = |of: &toml::Table| of.get(table).and_then(|table| table.get(option)).map(as_written);
            let (Some(own), Some(fixed), Some(default)) = (value(&own), value(&fixed), value(&default)) else {
                continue;
            };
            if own != fixed && own != default {
                let method = self.align.stitch.method.display();
                let allowed = format!("{fixed}, which the method {method} fixes");
                contradicting.push(InvalidOption { name: row.name, value: own, allowed });
            }
        }
        contradicting
    }

    /// Checks every option.
    ///
    /// # Errors
    /// [`Error::Options`] with the complete list of options outside their range.
    pub fn validate(&self) -> Result<()> {
        let invalid = self.invalid();
        if invalid.is_empty() { Ok(()) } else { Err(Error::Options(invalid)) }
    }

    /// Whether photographs are found, measured and matched by these options as by `other`, so that what was matched by
    /// the one can be aligned by the other.
    pub fn matches_alike(&self, other: &Self) -> bool {
        let told = |options: &Self| (options.align.cameras.lens, options.align.cameras.fov);
        self.measure == other.measure && self.matching == other.matching && told(self) == told(other)
    }

    /// Refuses to compose what was aligned by `recorded` options if the geometry would be another by these.
    ///
    /// # Errors
    /// [`Error::Unsupported`] that names the options.
    pub(crate) fn refuse_other_geometry(&self, recorded: &Self) -> Result<()> {
        // Records have what the method fixes.
        let differing = self.fixed_by_method().differing_geometry(&recorded.fixed_by_method())?;
        if differing.is_empty() {
            return Ok(());
        }
        Err(Error::Unsupported {
            what: format!("composing a recorded panorama with another {}", differing.join(", ")),
            hint: format!(
                "Its geometry was found with the recorded value: stitch the photographs again. Composing heeds {}.",
                Self::composing_tables()
            ),
        })
    }

    /// The options, `table.option`, of the phases up to the geometry in which these options differ from `recorded`
    /// ones: a project records the geometry once and for all.
    ///
    /// # Errors
    /// [`Error::Input`] if options cannot be written (never).
    pub fn differing_geometry(&self, recorded: &Self) -> Result<Vec<String>> {
        let (own, recorded) = (self.to_table()?, recorded.to_table()?);
        let mut differing = Vec::new();
        for (stage, _) in Self::tables().into_iter().filter(|(table, phase)| is_geometry(table, *phase)) {
            let table =
                |table: &toml::Table| table.get(stage).and_then(toml::Value::as_table).cloned().unwrap_or_default();
            let recorded = table(&recorded);
            let changed = table(&own).into_iter().filter(|(option, value)| recorded.get(option) != Some(value));
            differing.extend(changed.map(|(option, _)| format!("{stage}.{option}")));
        }
        Ok(differing)
    }
}

/// A value as one writes it after an option's name.
fn as_written(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Whether the options of a table of this phase take part in the geometry. Files are found and judged anew whenever a
/// panorama is composed.
fn is_geometry(table: &str, phase: Option<Phase>) -> bool {
    table != SourceOptions::STAGE && phase.is_some_and(|phase| phase <= Phase::Align)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record has the options as the method fixed them, whoever composes it has them as they were asked for.
    #[test]
    fn what_a_method_fixes_is_no_other_geometry() {
        let mut asked = StitchOptions::default();
        asked.set("stitch.method=vpg-published").expect("an option");
        let recorded = asked.fixed_by_method();
        assert!(recorded != asked);
        asked.set("projection.kind=cylindrical").expect("an option");
        asked.refuse_other_geometry(&recorded).expect("the same geometry");
        asked.set("similarity.rejection=0.1").expect("an option");
        let refused = asked.refuse_other_geometry(&recorded).expect_err("another").to_string();
        assert!(refused.contains("similarity.rejection"), "{refused}");
    }

    /// What a published method fixes is no default of ours under another name: whoever changes a default sees here what
    /// the publication has.
    #[test]
    fn published_methods_fix_the_published_values() {
        let of = |method: &str| {
            let mut options = StitchOptions::default();
            options.set(&format!("stitch.method={method}")).expect("a method");
            options.validate().expect("a method goes with the defaults");
            let fixed = options.fixed_by_method();
            fixed.validate().expect("what a method fixes is valid");
            assert_eq!(fixed.fixed_by_method(), fixed, "{method}");
            fixed.differing_geometry(&options).expect("tables")
        };
        let mesh = [
            "line_alignment.straightness",
            "match_points.model",
            "mesh.base",
            "mesh.outline_weight",
            "mesh.subdivision",
            "stitch.align",
        ];
        let guidance = [
            "similarity.camera_correction",
            "similarity.fallback",
            "similarity.far_horizon",
            "similarity.gate",
            "similarity.gravity",
            "similarity.guided_redetection",
            "similarity.joint_refinement",
            "similarity.pitch_prior",
            "similarity.pooled_search",
            "similarity.turned_photographs",
            "similarity.vertical_only",
            "vanishing.intrinsics",
        ];
        let printed = ["similarity.as_printed", "similarity.beta_mode"];
        let sorted = |parts: &[&[&'static str]]| {
            let mut all = parts.concat();
            all.sort_unstable();
            all
        };
        for (method, expected) in [
            ("vpg", sorted(&[])),
            ("gsp-3d", sorted(&[])),
            ("apap", sorted(&[])),
            ("gsp-2d-published", sorted(&[&mesh])),
            ("gsp-3d-published", sorted(&[&mesh])),
            ("aanap-published", sorted(&[&mesh])),
            ("vpg-published", sorted(&[&mesh, &guidance])),
            ("vpg-literal", sorted(&[&mesh, &guidance, &printed])),
        ] {
            let mut differing = of(method);
            differing.sort_unstable();
            assert_eq!(differing, expected, "{method}");
        }
    }

    #[test]
    fn all_bad_values_are_listed() {
        let mut options = StitchOptions::default();
        options.align.mesh.cell_px = -1.0;
        options.measure.working.pixels = f64::INFINITY;
        let message = options.validate().expect_err("two bad values").to_string();
        assert!(message.contains("mesh.cell_px = -1") && message.contains("working.pixels = inf"), "{message}");
    }
}
