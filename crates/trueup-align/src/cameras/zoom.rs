//! Whether a lens was zoomed between photographs, as their own focal lengths tell.

use super::bundle::{BundleAdjustment, COARSE_HUBER_PX, Parameters};
use super::intrinsics::{FOCAL, IntrinsicsModel, ZOOM_SPREAD};
use super::pair_cost::pair_cost;
use super::prior::CameraPrior;

/// Share of the squared errors under a common focal length that those with focal lengths of their own may leave where
/// few photographs differ. Parallax bends focal lengths, too, but leaves more. Measured over all overlaps, of which
/// these are a part: in eight cut sets, where two to six of eight photographs are zoomed, 0.003 at most is left, in one
/// 0.16; in photographed sets where one or two differ unzoomed 0.7 or more. Of 61 of these one is believed, four
/// photographs by a long lens, and meets no worse.
const MAX_SHARE_LEFT: f64 = 0.2;

/// A zoom that was found.
pub(super) struct Zoomed {
    /// Which focal lengths are free: one for each setting, where few differ of these alone, and one for the rest of a
    /// group.
    pub model: IntrinsicsModel,
    /// From where to refine them.
    pub start: Parameters,
}

/// Whether focal lengths of their own suit the photographs better than those that groups of `model` share: `own` and
/// `shared` are the cameras refined with either.
///
/// Where about half of a group or more differs from the rest, that tells. One photograph among many may as well have
/// run away where it overlaps little; so few are believed where their overlaps fit far better. The others keep sharing
/// theirs, as parallax bends what each tells of its own.
pub(super) fn found(
    problem: &BundleAdjustment<'_>,
    model: &IntrinsicsModel,
    shared: &Parameters,
    own: &Parameters,
) -> Option<Zoomed> {
    let mut start = own.clone();
    let mut labels = settings(own, problem.priors);
    if focal_ratios(model, shared, own).iter().all(|of_group| middle_half(of_group) <= ZOOM_SPREAD) {
        if !fits_far_better(problem, model, shared, own) {
            return None;
        }
        for (photograph, differs) in differing(model, shared, own).into_iter().enumerate() {
            let group = model.parameters_of[photograph][FOCAL].filter(|_| !differs);
            if group.is_some() {
                start.focal_px[photograph] = shared.focal_px[photograph];
            }
            labels[photograph] = group.unwrap_or(model.parameters + labels[photograph]);
        }
    }
    let start = start.with_common_focal(&problem.start_focal_px, &labels);
    Some(Zoomed { model: IntrinsicsModel::common(&labels), start })
}

/// The settings of zoomed lenses: photographs by one lens whose focal lengths are alike, as a number for each.
pub(super) fn settings(parameters: &Parameters, priors: &[CameraPrior]) -> Vec<usize> {
    let group_of = CameraPrior::lens_groups(priors);
    let mut order: Vec<usize> = (0..group_of.len()).collect();
    let focal_px = &parameters.focal_px;
    order.sort_by(|&one, &two| group_of[one].cmp(&group_of[two]).then(focal_px[one].total_cmp(&focal_px[two])));
    let mut settings = vec![0; group_of.len()];
    let (mut setting, mut first) = (0, order.first().copied());
    for pair in order.windows(2) {
        let (before, next) = (pair[0], pair[1]);
        let apart = |from: usize| (focal_px[next] / focal_px[from]).ln();
        // Neither a step nor a slow drift is one setting.
        let alike = apart(before) < ZOOM_SPREAD && first.is_some_and(|first| apart(first) < 2.0 * ZOOM_SPREAD);
        if group_of[before] != group_of[next] || !alike {
            setting += 1;
            first = Some(next);
        }
        settings[next] = setting;
    }
    settings
}

/// Whether overlaps of photographs whose `own` focal lengths differ from the rest of their group fit far better by
/// these than by the `shared` ones.
pub(super) fn fits_far_better(
    problem: &BundleAdjustment<'_>,
    model: &IntrinsicsModel,
    shared: &Parameters,
    own: &Parameters,
) -> bool {
    let differs = differing(model, shared, own);
    let cost_of_differing = |parameters: &Parameters| -> f64 {
        let cameras = parameters.cameras(problem.priors);
        let pairs = problem.observations.pairs.iter().filter(|pair| differs[pair.a] || differs[pair.b]);
        pairs.map(|pair| pair_cost(&cameras, pair, COARSE_HUBER_PX)).sum()
    };
    differs.contains(&true) && cost_of_differing(own) < MAX_SHARE_LEFT * cost_of_differing(shared)
}

/// Which photographs' `own` focal lengths differ from the rest of their group.
pub(super) fn differing(model: &IntrinsicsModel, shared: &Parameters, own: &Parameters) -> Vec<bool> {
    let mut differs = vec![false; own.focal_px.len()];
    for of_group in focal_ratios(model, shared, own) {
        let middle = middle(&of_group);
        for (ratio, photograph) in of_group {
            differs[photograph] = (ratio - middle).abs() > ZOOM_SPREAD;
        }
    }
    differs
}

/// Logarithms of the own focal lengths by the shared ones, ascending, each with its photograph, of every group of
/// `model`.
fn focal_ratios(model: &IntrinsicsModel, shared: &Parameters, own: &Parameters) -> Vec<Vec<(f64, usize)>> {
    let of_group = |group: usize| {
        let members = (0..own.focal_px.len()).filter(|&k| model.parameters_of[k][FOCAL] == Some(group));
        let mut ratios: Vec<(f64, usize)> = members.map(|k| ((own.focal_px[k] / shared.focal_px[k]).ln(), k)).collect();
        ratios.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        ratios
    };
    (0..model.parameters).map(of_group).collect()
}

/// Half the range between about the quartiles of ascending numbers, which one of them cannot move; 0 of fewer than two.
fn middle_half(ascending: &[(f64, usize)]) -> f64 {
    let quarter = ascending.len() / 4;
    match ascending {
        [] | [_] => 0.0,
        _ => 0.5 * (ascending[ascending.len() - 1 - quarter].0 - ascending[quarter].0),
    }
}

/// The median of ascending numbers, of an even number the mean of the two in the middle; 0 of none.
fn middle(ascending: &[(f64, usize)]) -> f64 {
    match ascending {
        [] => 0.0,
        _ => 0.5 * (ascending[(ascending.len() - 1) / 2].0 + ascending[ascending.len() / 2].0),
    }
}
