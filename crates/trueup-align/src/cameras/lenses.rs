//! Which lenses the matches tell: terms are added as long as the evidence asks for them.

use trueup_core::{Result, StageContext};

use super::bundle::{BundleAdjustment, COARSE_HUBER_PX, FINE_HUBER_PX, Parameters};
use super::intrinsics::{CENTER, FreeTerms, IntrinsicsModel, RADIAL, TANGENTIAL, ZOOM_SPREAD, only_focal};
use super::lens_evidence::LensEvidence;
use super::options::LensKind;

/// Squared distance from 0, in standard deviations and by dimension, at which a term is believed: 4 standard deviations, since
/// the deviations rest on a dozen pairs.
const SIGNIFICANT: f64 = 16.0;
/// Shift of a photograph's corners, working pixels, below which k1 is not worth a lens: the error of a match.
const LEAST_SHIFT_PX: f64 = 0.5;
/// The terms in the order in which they are asked for.
const BLOCKS: [&[usize]; 5] =
    [&[RADIAL], &[RADIAL + 1], &[CENTER, CENTER + 1], &[TANGENTIAL, TANGENTIAL + 1], &[RADIAL + 2]];

/// The search for lenses.
pub(super) struct LensSearch<'a> {
    /// With matches enough to see which terms there are.
    pub problem: &'a BundleAdjustment<'a>,
    /// With those that tell how large they are, and whether there is the last.
    pub precise: &'a BundleAdjustment<'a>,
    /// What the user says of the lenses.
    pub kind: LensKind,
    pub context: &'a StageContext<'a>,
}

impl LensSearch<'_> {
    /// The cameras refined with lenses, one for every group of photographs with evidence of one; `None` if there is no such
    /// group, or the lenses lead nowhere. A group shares one focal length.
    pub(super) fn find(&self, start: &Parameters, group_of: &[usize]) -> Result<Option<Parameters>> {
        let groups = group_of.iter().max().map_or(0, |last| last + 1);
        let mut free: Vec<FreeTerms> = vec![only_focal(); groups];
        let mut bent = vec![self.kind != LensKind::Pinhole; groups];
        for (prior, &group) in self.problem.priors.iter().zip(group_of) {
            bent[group] &= prior.lens.is_none();
        }
        let mut parameters = start.clone();
        for (block, &terms) in BLOCKS.iter().enumerate() {
            self.context.check_cancelled()?;
            let mut problem = self.problem;
            if block + 1 == BLOCKS.len() {
                problem = self.precise;
                let model = IntrinsicsModel::grouped(group_of, &free);
                parameters = problem.minimize(parameters, &model, FINE_HUBER_PX, self.context)?;
            }
            let believed = self.believed(problem, &parameters, group_of, &free, terms, &bent);
            if block == 0 {
                bent.clone_from(&believed);
            }
            if !believed.contains(&true) {
                if block == 0 {
                    return Ok(None);
                }
                continue;
            }
            for (free, _) in free.iter_mut().zip(&believed).filter(|(_, believed)| **believed) {
                terms.iter().for_each(|&term| free[term] = true);
            }
            let model = IntrinsicsModel::grouped(group_of, &free);
            if block == 0 {
                parameters = problem.minimize(parameters, &model, COARSE_HUBER_PX, self.context)?;
            }
            parameters = problem.minimize(parameters, &model, FINE_HUBER_PX, self.context)?;
        }
        Ok(self.problem.is_sound(&parameters).then_some(parameters))
    }

    /// For every group whether the `terms` are wanted of it beside those that are free.
    fn believed(
        &self,
        problem: &BundleAdjustment<'_>,
        parameters: &Parameters,
        group_of: &[usize],
        free: &[FreeTerms],
        terms: &[usize],
        asked: &[bool],
    ) -> Vec<bool> {
        let wished: Vec<FreeTerms> = free
            .iter()
            .zip(asked)
            .map(|(free, asked)| std::array::from_fn(|term| free[term] || (*asked && terms.contains(&term))))
            .collect();
        let model = IntrinsicsModel::grouped(group_of, &wished);
        let nothing = vec![false; free.len()];
        let Some(evidence) = LensEvidence::at(problem, parameters, &model, FINE_HUBER_PX) else { return nothing };
        (0..free.len())
            .map(|group| {
                let Some(member) = group_of.iter().position(|&of| of == group) else { return false };
                let columns: Option<Vec<usize>> = terms.iter().map(|&term| model.parameters_of[member][term]).collect();
                let Some(columns) = columns.filter(|_| asked[group]) else { return false };
                let visible = terms != [RADIAL]
                    || self.corner_shift(parameters, member, evidence.estimate(columns[0])) > LEAST_SHIFT_PX;
                visible && evidence.significance(&columns) > SIGNIFICANT
            })
            .collect()
    }

    /// By how many working pixels k1 moves the corners of a photograph.
    fn corner_shift(&self, parameters: &Parameters, photograph: usize, k1: f64) -> f64 {
        let radius_px = 0.5 * self.problem.priors[photograph].frame.diagonal();
        k1.abs() * radius_px * (radius_px / parameters.focal_px[photograph]).powi(2)
    }
}

/// The settings of zoomed lenses: photographs of a group whose focal lengths are alike, as a number for each.
pub(super) fn settings(parameters: &Parameters, group_of: &[usize]) -> Vec<usize> {
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
