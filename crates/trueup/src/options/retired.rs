//! Options of earlier versions: what became of each, so that nobody's setting is passed over in silence.

/// What became of an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Retired {
    /// It has another name.
    Renamed(&'static str),
    /// Nobody had a reason to change it: value and unit that hold now.
    Fixed(&'static str),
    /// Nothing has taken its place: the value that held unless it was set.
    Gone(&'static str),
    /// It is a command and its flag; no panorama depends on it.
    Flag(&'static str),
}

impl Retired {
    /// What became of the option `name`, `table.option`; `None` if it never was one.
    pub(super) fn of(name: &str) -> Option<Self> {
        RETIRED.binary_search_by(|(old, _)| (*old).cmp(name)).ok().map(|found| RETIRED[found].1)
    }

    /// What to tell who sets the option `name`.
    pub(super) fn reason(self, name: &str) -> String {
        match self {
            Self::Renamed(new) => format!("\"{name}\" is now \"{new}\""),
            Self::Gone(_) => format!("\"{name}\" is no option any more"),
            Self::Fixed(value) => format!("\"{name}\" is now fixed at {value}"),
            Self::Flag(flag) => format!("\"{name}\" is now `{flag}`"),
        }
    }

    /// Whether `value`, as a file of an earlier version has it, is what holds now, or what nobody chose.
    pub(super) fn is_now(self, value: &toml::Value) -> bool {
        let (Self::Fixed(now) | Self::Gone(now)) = self else { return false };
        let now = now.split_whitespace().next().unwrap_or_default();
        match value {
            toml::Value::Float(value) => now.parse() == Ok(*value),
            toml::Value::Integer(value) => now.parse() == Ok(*value as f64),
            toml::Value::Boolean(value) => now.parse() == Ok(*value),
            toml::Value::String(value) => now == value,
            _ => false,
        }
    }
}

use Retired::{Fixed, Flag, Gone, Renamed};

/// Options of version 0.1, sorted by name.
const RETIRED: [(&str, Retired); 182] = [
    ("cache.max_bytes", Renamed("resources.cache_bytes")),
    ("cameras.coarse_huber_px", Fixed("20 working px")),
    ("cameras.estimated_focal_sd", Fixed("0.3")),
    ("cameras.fine_huber_px", Fixed("2 working px")),
    ("cameras.matches_in_all", Fixed("16000 matches")),
    ("cameras.matches_per_pair", Fixed("200 matches")),
    ("cameras.max_focal", Fixed("10 longer sides")),
    ("cameras.max_iterations", Fixed("100 iterations")),
    ("cameras.min_focal", Fixed("0.3 longer sides")),
    ("cameras.zoom_spread", Fixed("0.03")),
    ("compare.drawn_grid_lines", Fixed("13 lines")),
    ("compare.drawn_lines", Fixed("150 segments")),
    ("compare.format", Flag("trueup compare --format")),
    ("compare.max_pixels", Fixed("24000000 px")),
    ("compare.page_pixels", Fixed("6000000 px")),
    ("compare.scale", Flag("trueup compare --scale")),
    ("exposure.brightest", Fixed("251 level")),
    ("exposure.cast_deviation", Fixed("0.2")),
    ("exposure.darkest", Fixed("4 level")),
    ("exposure.gain_deviation", Fixed("2")),
    ("exposure.min_shared", Fixed("20 samples")),
    ("exposure.pair_deviation", Fixed("0.02")),
    ("exposure.response_deviation", Fixed("0.5")),
    ("exposure.samples", Fixed("10000")),
    ("exposure.vignetting_deviation", Fixed("0.6")),
    ("features.base_sigma", Fixed("1.6 samples")),
    ("features.double_image", Fixed("false (doubled where fewer than 1000 points are found)")),
    ("features.edge_threshold", Fixed("10")),
    ("features.levels_per_octave", Fixed("3 levels")),
    ("features.max_orientations", Fixed("4 orientations")),
    ("features.nominal_blur_px", Fixed("0.5 px")),
    ("features.root_sift", Fixed("false")),
    ("features.sparse_points", Fixed("1000 points")),
    ("line_alignment.full_px", Fixed("0.7 panorama units per axis")),
    ("line_alignment.max_points", Fixed("1000")),
    ("line_alignment.narrowing", Fixed("0.7")),
    ("line_alignment.point_weight", Fixed("16 per working px squared")),
    ("line_alignment.robust_px", Fixed("3 panorama units")),
    ("line_alignment.rounds", Fixed("4")),
    ("line_alignment.spacing_px", Fixed("20 working px")),
    ("line_alignment.straight_length_px", Fixed("50 working px")),
    ("line_matching.max_angle_deg", Fixed("5 deg")),
    ("line_matching.max_distance_px", Fixed("5 working px")),
    ("line_matching.max_ratio", Fixed("0.8")),
    ("line_matching.min_length_px", Fixed("25 working px")),
    ("line_matching.min_likeness", Fixed("0.7")),
    ("line_matching.min_overlap", Fixed("0.5")),
    ("lines.angle_tolerance_deg", Fixed("22.5 deg")),
    ("lines.border_distance_px", Fixed("5 px")),
    ("lines.border_share", Fixed("0.8")),
    ("lines.magnitude_bins", Fixed("1024")),
    ("lines.max_segments", Fixed("100000")),
    ("lines.merge", Fixed("false")),
    ("lines.merge_angle_deg", Fixed("2 deg")),
    ("lines.merge_distance_px", Fixed("2 px")),
    ("lines.merge_gap_px", Fixed("20 px")),
    ("lines.min_density", Fixed("0.7")),
    ("lines.min_significance", Fixed("0")),
    ("lines.quantisation", Fixed("2 gray levels of 0 to 255")),
    ("lines.refine", Fixed("true")),
    ("lines.refine_min_length_px", Fixed("12 px")),
    ("lines.scale", Fixed("0.8")),
    ("lines.sigma_scale", Fixed("0.6 reduced px")),
    ("match_points.decay_px", Fixed("72.25 working px")),
    ("match_points.max_deviation", Fixed("0.1 diagonals")),
    ("match_points.shrinkage", Fixed("0.5 matches")),
    ("match_points.weight_floor", Fixed("0.0015")),
    ("matching.brown_lowe_alpha", Fixed("8 matches")),
    ("matching.brown_lowe_beta", Fixed("0.3")),
    ("matching.compared_features", Gone("4000")),
    ("matching.confidence", Fixed("0.995")),
    ("matching.distance_deviations", Fixed("4.25 standard deviations")),
    ("matching.guided", Gone("true")),
    ("matching.guided_distance_ratio", Gone("0.9")),
    ("matching.guided_radius_px", Gone("12")),
    ("matching.max_area_ratio", Fixed("20")),
    ("matching.max_plane_displacement", Fixed("0.25 diagonals")),
    ("matching.max_plane_samples", Fixed("3308 samples")),
    ("matching.max_samples", Fixed("6000 samples")),
    ("matching.min_inliers_by_graph", Fixed("8 matches")),
    ("matching.min_plane_inliers", Fixed("40 matches")),
    ("matching.mutual", Fixed("true")),
    ("matching.plane_inlier_px", Fixed("3 px")),
    ("matching.second_separation_px", Fixed("3 px")),
    ("measures.bent_share", Fixed("0.003")),
    ("measures.line_step_px", Fixed("3 working px")),
    ("measures.long_line_diagonal", Fixed("0.1 diagonals")),
    ("measures.max_standard_error_deg", Fixed("0.25 degrees")),
    ("measures.min_vertical_lines", Fixed("6 segments")),
    ("measures.strips", Fixed("12")),
    ("measures.vertical_limit_deg", Fixed("20 degrees")),
    ("measures.vertical_prior_deg", Fixed("10 degrees")),
    ("measures.vertical_scale_deg", Fixed("0.5 degrees")),
    ("measures.vertical_search_deg", Fixed("8 degrees")),
    ("measures.vertical_tolerance_deg", Fixed("1.5 degrees")),
    ("mesh.prior_slope", Fixed("20 per photograph diagonal")),
    ("pairing.neighbours", Renamed("pairing.neighbors")),
    ("pairing.subset", Fixed("1000 features")),
    ("photometric.colour_ridge", Fixed("10 samples")),
    ("photometric.full_px", Fixed("0.5 panorama units per axis")),
    ("photometric.least_noise", Fixed("3 gray levels")),
    ("photometric.levels", Fixed("3")),
    ("photometric.max_departure_px", Fixed("1 panorama units")),
    ("photometric.max_gain", Fixed("4")),
    ("photometric.min_gradient", Fixed("2 gray levels per working px")),
    ("photometric.min_samples", Fixed("50")),
    ("photometric.noise_level", Fixed("10 gray levels")),
    ("photometric.rounds", Fixed("4")),
    ("photometric.settled", Fixed("0.01")),
    ("photometric.spacing_px", Fixed("4 working px")),
    ("projection.facing", Fixed("true")),
    ("render.feather_exponent", Fixed("3")),
    ("render.minification_threshold", Fixed("1.25")),
    ("seam.band_px", Fixed("3 px")),
    ("seam.clipped_cost", Fixed("1.5 level")),
    ("seam.coarse_pixels", Fixed("120000 px")),
    ("seam.fine_pixels", Fixed("1500000 px")),
    ("seam.gradient_weight", Fixed("1")),
    ("seam.length", Fixed("2 level")),
    ("seam.moving_high", Fixed("32 level")),
    ("seam.moving_low", Fixed("14 level")),
    ("seam.rounds", Fixed("2")),
    ("seam.shading_reach", Fixed("4 px")),
    ("similarity.joint_scale_px", Fixed("0.5 working px")),
    ("similarity.joint_start_scale_px", Fixed("4 working px")),
    ("similarity.joint_tolerance_deg", Fixed("3 degrees")),
    ("similarity.line_error_px", Fixed("0.5 working px")),
    ("similarity.max_cross_pairs", Fixed("2000")),
    ("similarity.max_median_roll_deg", Fixed("45 degrees")),
    ("similarity.max_path_edges", Fixed("3 edges")),
    ("similarity.max_paths", Fixed("2000")),
    ("similarity.max_pooled_deviation_deg", Fixed("1 degrees")),
    ("similarity.max_pooled_lines", Fixed("1200 segments")),
    ("similarity.max_straightening_angle_deg", Fixed("20 degrees")),
    ("similarity.max_vertical_deviation_deg", Gone("1.5")),
    ("similarity.max_vertical_rivalry", Fixed("0.5")),
    ("similarity.min_inlier_share", Fixed("0.4")),
    ("similarity.min_inlier_share_few", Fixed("0.6")),
    ("similarity.min_overlap_error_px", Fixed("0.1 working px")),
    ("similarity.min_pooled_lines", Fixed("10 segments")),
    ("similarity.min_significance", Fixed("5 standard deviations")),
    ("similarity.min_vertical_pictures", Fixed("0.6")),
    ("similarity.min_vertical_share", Fixed("0.15")),
    ("similarity.ordinary_misorientation_deg", Fixed("1 degrees")),
    ("similarity.path_tolerance_deg", Fixed("5 degrees")),
    ("similarity.pooled_significance", Fixed("7 standard deviations")),
    ("similarity.pooled_step_deg", Fixed("2 degrees")),
    ("similarity.pooled_tolerance_deg", Fixed("1.5 degrees")),
    ("similarity.prior", Fixed("vpg (a method has its prior: stitch.method)")),
    ("similarity.vertical_search_deg", Fixed("25 degrees")),
    ("similarity.vertical_tolerance_deg", Fixed("2 degrees")),
    ("source.min_side_px", Fixed("16 px")),
    ("stitch.memory", Renamed("resources.memory")),
    ("stitch.scratch", Renamed("resources.scratch")),
    ("stitch.seed", Renamed("random.seed")),
    ("stitch.thumbnail_pixels", Fixed("30000 px")),
    ("stitch.working_pixels", Renamed("working.pixels")),
    ("structure.min_diagonal", Fixed("0.1 diagonals")),
    ("structure.spacing_px", Fixed("20 working px")),
    ("vanishing.border_margin_px", Fixed("5 working px")),
    ("vanishing.cluster_deg", Fixed("6 degrees")),
    ("vanishing.max_lines", Fixed("400 segments")),
    ("vanishing.max_rotation_sd_deg", Fixed("5 degrees")),
    ("vanishing.min_cluster_lines", Fixed("3 segments")),
    ("vanishing.min_length_diagonal", Fixed("0.025 diagonals")),
    ("vanishing.min_length_px", Fixed("20 working px")),
    ("vanishing.outlier_share", Fixed("0")),
    ("vanishing.refine_scale_deg", Fixed("1.5 degrees")),
    ("vanishing.refined", Fixed("5")),
    ("vanishing.search_lines", Fixed("200 segments")),
    ("vanishing.step_deg", Fixed("2 degrees")),
    ("vanishing.weight_cap_px", Fixed("120 working px")),
    ("warps.aanap_decay_px", Fixed("156.25 working px")),
    ("warps.aanap_freedom", Fixed("5")),
    ("warps.aanap_plane_matches", Fixed("50 matches")),
    ("warps.aanap_plane_tolerance", Fixed("0.01")),
    ("warps.apap_weight_floor", Fixed("0.0015")),
    ("warps.max_area_ratio", Fixed("25 reference areas")),
    ("warps.max_folded_share", Fixed("0.02")),
    ("warps.max_reach", Fixed("20 reference diagonals")),
    ("warps.min_depth", Fixed("0.02")),
    ("warps.projection", Renamed("warps.surface")),
];

#[cfg(test)]
mod tests {
    use super::super::StitchOptions;
    use super::*;

    #[test]
    fn the_table_is_sorted_and_leads_to_options_that_are() {
        assert!(RETIRED.is_sorted_by(|one, two| one.0 < two.0));
        let known: Vec<String> = StitchOptions::describe().into_iter().map(|row| row.name).collect();
        for (old, became) in RETIRED {
            assert!(!known.iter().any(|name| name == old), "{old} is an option");
            if let Renamed(new) = became {
                assert!(known.iter().any(|name| name == new), "{old} leads to {new}, which is none");
            }
        }
    }

    #[test]
    fn a_fixed_value_is_recognized() {
        let fixed = Fixed("30000 px");
        assert!(fixed.is_now(&toml::Value::Float(30000.0)) && fixed.is_now(&toml::Value::Integer(30000)));
        assert!(!fixed.is_now(&toml::Value::Float(20000.0)) && !Renamed("x.y").is_now(&toml::Value::Float(0.0)));
        assert!(Fixed("true").is_now(&toml::Value::Boolean(true)));
        assert!(Fixed("scharr").is_now(&toml::Value::String("scharr".to_owned())));
    }
}
