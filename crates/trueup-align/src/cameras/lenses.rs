//! Which lenses matches and straight edges tell: terms are added as long as the evidence asks for them.

use trueup_core::{Result, StageContext};

use super::bundle::{BundleAdjustment, COARSE_HUBER_PX, FINE_HUBER_PX, Parameters};
use super::intrinsics::{CENTER, FOCAL, FreeTerms, IntrinsicsModel, RADIAL, TANGENTIAL, only_focal, set_free};
use super::lens_evidence::{LensEvidence, Witness};
use super::options::LensKind;
use super::prior::CameraPrior;

/// Squared distance from 0, in standard deviations and by dimension, at which matches are believed: 4 standard
/// deviations, since the deviations rest on a dozen pairs.
const SIGNIFICANT_BY_MATCHES: f64 = 16.0;
/// The same of edges: 5 standard deviations, since what is round in the scene may be so in all photographs alike.
const SIGNIFICANT_BY_EDGES: f64 = 25.0;
/// Shift of a photograph's corners, working pixels, below which k1 is not worth a lens: the error of a match.
const LEAST_SHIFT_PX: f64 = 0.5;
/// How much more matches, or edges, may cost with lenses than with pinholes: what is told by the ones and denied by the
/// others is no lens.
const DENIED: f64 = 1.02;
/// The terms in the order in which they are asked for; what hides beside a principal point off center once more.
const BLOCKS: [&[usize]; 6] =
    [&[RADIAL], &[RADIAL + 1], &[CENTER, CENTER + 1], &[RADIAL + 1], &[TANGENTIAL, TANGENTIAL + 1], &[RADIAL + 2]];

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

/// Cameras with lenses.
pub(super) struct FoundLenses {
    pub parameters: Parameters,
    /// The terms that were believed.
    pub model: IntrinsicsModel,
}

impl Witness {
    fn significant(self) -> f64 {
        match self {
            Self::Matches => SIGNIFICANT_BY_MATCHES,
            Self::Edges => SIGNIFICANT_BY_EDGES,
        }
    }
}

impl LensSearch<'_> {
    /// The cameras refined with lenses, one for every group of photographs with evidence of one; `None` if there is no
    /// such group, or the lenses lead nowhere. A group shares one focal length.
    pub(super) fn find(&self, start: &Parameters, group_of: &[usize]) -> Result<Option<FoundLenses>> {
        let groups = group_of.iter().max().map_or(0, |last| last + 1);
        let mut free: Vec<FreeTerms> = vec![only_focal(); groups];
        let mut bent = vec![self.kind != LensKind::Pinhole; groups];
        for (prior, &group) in self.problem.priors.iter().zip(group_of) {
            bent[group] &= prior.lens.is_none();
        }
        let mut parameters = start.clone();
        let mut free_before = free.clone();
        for (block, &terms) in BLOCKS.iter().enumerate() {
            self.context.check_cancelled()?;
            let is_free = |group: usize| terms.iter().all(|&term| free[group][term]);
            let is_repeated = BLOCKS[..block].contains(&terms);
            if is_repeated && (free == free_before || (0..groups).all(|group| !bent[group] || is_free(group))) {
                continue;
            }
            free_before.clone_from(&free);
            let mut problem = self.problem;
            if block + 1 == BLOCKS.len() {
                problem = self.precise;
                let model = IntrinsicsModel::grouped(group_of, &free);
                parameters = problem.minimize(parameters, &model, FINE_HUBER_PX, self.context)?;
            }
            if block == 0 {
                let asked = bent;
                bent = self.bent(&mut parameters, group_of, &mut free, &asked)?;
                if !bent.contains(&true) {
                    bent = if self.is_explained_together(&asked, &mut parameters, group_of, &mut free)? {
                        asked.clone()
                    } else {
                        self.off_center(&mut parameters, group_of, &mut free, &asked)?
                    };
                    if !bent.contains(&true) {
                        return Ok(None);
                    }
                }
                if self.add_settings(group_of, &asked, &bent, &mut free) {
                    let model = IntrinsicsModel::grouped(group_of, &free);
                    parameters = problem.minimize(parameters, &model, FINE_HUBER_PX, self.context)?;
                }
                continue;
            }
            let ask = Ask { terms, of: &bent, huber_px: FINE_HUBER_PX };
            let believed = self.told(problem, &parameters, group_of, &free, &ask).by_either();
            if !believed.contains(&true) {
                self.is_explained_by(terms, &bent, &mut parameters, group_of, &mut free)?;
                continue;
            }
            set_free(&mut free, terms, &believed);
            let model = IntrinsicsModel::grouped(group_of, &free);
            parameters = problem.minimize(parameters, &model, FINE_HUBER_PX, self.context)?;
        }
        let model = IntrinsicsModel::grouped(group_of, &free);
        Ok(self.problem.is_sound(&parameters).then_some(FoundLenses { parameters, model }))
    }

    /// Frees k1 of groups among those `asked` that one lens with a `bent` one took, at another of its settings; whether
    /// there are any. A lens that bends at one focal length bends at all of them, by another amount: that is estimated,
    /// and needs no evidence of its own.
    fn add_settings(&self, group_of: &[usize], asked: &[bool], bent: &[bool], free: &mut [FreeTerms]) -> bool {
        let lens_of = CameraPrior::lens_groups(self.problem.priors);
        let bending: Vec<usize> =
            lens_of.iter().zip(group_of).filter(|(_, group)| bent[**group]).map(|(&lens, _)| lens).collect();
        let mut added = false;
        for (lens, &group) in lens_of.iter().zip(group_of) {
            if asked[group] && !bent[group] && bending.contains(lens) {
                free[group][RADIAL] = true;
                added = true;
            }
        }
        added
    }

    /// Which of the groups in `asked` have a lens that bends: those with evidence of k1, which is still there when k1
    /// is found. `parameters` are refined with it, `free` has it.
    fn bent(
        &self,
        parameters: &mut Parameters,
        group_of: &[usize],
        free: &mut [FreeTerms],
        asked: &[bool],
    ) -> Result<Vec<bool>> {
        let (problem, terms) = (self.problem, BLOCKS[0]);
        let by_pinholes = problem.fine_costs(parameters);
        let at = |parameters: &Parameters, free: &[FreeTerms], of: &[bool], huber_px: f64| {
            self.told(problem, parameters, group_of, free, &Ask { terms, of, huber_px })
        };
        let first = at(parameters, free, asked, FINE_HUBER_PX);
        let mut bent = first.by_either();
        if !bent.contains(&true) {
            // Edges that a strong lens bends have lost their influence where errors are to be small.
            bent = at(parameters, free, asked, COARSE_HUBER_PX).by_edges;
        }
        let only_edges = !first.by_matches.contains(&true);
        let mut wished = free.to_vec();
        while bent.contains(&true) {
            wished.clone_from_slice(free);
            set_free(&mut wished, terms, &bent);
            let fine = self.problem.coarse_to_fine(
                parameters.clone(),
                &IntrinsicsModel::grouped(group_of, &wished),
                self.context,
            )?;
            let again = at(&fine, &wished, &bent, FINE_HUBER_PX).by_either();
            let denied =
                problem.fine_costs(&fine).iter().zip(by_pinholes).any(|(after, before)| *after > DENIED * before);
            let is_still = |group: usize| {
                self.is_visible(&fine, group_of, group)
                    && (first.by_matches[group] || (again[group] && !(only_edges && denied)))
            };
            let still: Vec<bool> = (0..bent.len()).map(|group| bent[group] && is_still(group)).collect();
            if still == bent {
                free.clone_from_slice(&wished);
                *parameters = fine;
                break;
            }
            bent = still;
        }
        Ok(bent)
    }

    /// Which of the groups in `asked` have a lens that is off center, whatever it bends beside: those of which matches
    /// tell so. `parameters` are refined with it, `free` has it.
    fn off_center(
        &self,
        parameters: &mut Parameters,
        group_of: &[usize],
        free: &mut [FreeTerms],
        asked: &[bool],
    ) -> Result<Vec<bool>> {
        // How far it bends is open.
        let mut open = free.to_vec();
        set_free(&mut open, &[RADIAL], asked);
        let ask = Ask { terms: &[CENTER, CENTER + 1], of: asked, huber_px: FINE_HUBER_PX };
        let mut told = self.told(self.problem, parameters, group_of, &open, &ask).by_matches;
        if !told.contains(&true) {
            return Ok(told);
        }
        let mut wished = free.to_vec();
        set_free(&mut wished, &[RADIAL, CENTER, CENTER + 1], &told);
        let fine = self.problem.coarse_to_fine(
            parameters.clone(),
            &IntrinsicsModel::grouped(group_of, &wished),
            self.context,
        )?;
        if (0..told.len()).all(|group| !told[group] || self.is_visible(&fine, group_of, group)) {
            free.clone_from_slice(&wished);
            *parameters = fine;
        } else {
            told.fill(false);
        }
        Ok(told)
    }

    /// Whether k1 and the principal point, as they are in `parameters`, are worth a lens: of a pinhole the first look
    /// may show a bend that is gone when the cameras have settled.
    pub(super) fn is_visible(&self, parameters: &Parameters, group_of: &[usize], group: usize) -> bool {
        group_of.iter().position(|&of| of == group).is_some_and(|member| {
            let lens = &parameters.lenses[member];
            let by_center = self.off_center_shift(parameters, member, lens.center_px);
            self.corner_shift(parameters, member, lens.term(RADIAL)).max(by_center) > LEAST_SHIFT_PX
        })
    }

    /// For every group who tells of the terms beside those that are free.
    fn told(
        &self,
        problem: &BundleAdjustment<'_>,
        parameters: &Parameters,
        group_of: &[usize],
        free: &[FreeTerms],
        ask: &Ask<'_>,
    ) -> Told {
        let by = |witness: Witness| {
            let wished = free.iter().zip(ask.of).map(|(free, asked)| -> FreeTerms {
                std::array::from_fn(|term| match (witness, term) {
                    (Witness::Edges, FOCAL) => false,
                    _ => free[term] || (*asked && ask.terms.contains(&term)),
                })
            });
            let model = IntrinsicsModel::grouped(group_of, &wished.collect::<Vec<_>>());
            let evidence = LensEvidence::at(witness, problem, parameters, &model, ask.huber_px);
            let is_told = |group: usize| {
                let (Some(evidence), Some(member)) = (&evidence, group_of.iter().position(|&of| of == group)) else {
                    return false;
                };
                let terms = ask.terms.iter().map(|&term| model.parameters_of[member][term]);
                let Some(columns) = terms.collect::<Option<Vec<usize>>>().filter(|_| ask.of[group]) else {
                    return false;
                };
                let visible = ask.terms != [RADIAL]
                    || self.corner_shift(parameters, member, evidence.estimate(columns[0])) > LEAST_SHIFT_PX;
                visible && evidence.significance(&columns) > witness.significant()
            };
            (0..free.len()).map(is_told).collect()
        };
        let (by_matches, by_edges) = rayon::join(|| by(Witness::Matches), || by(Witness::Edges));
        Told { by_matches, by_edges }
    }

    /// How far lenses may move the corners of photographs that are taken for those of pinholes, working pixels, one
    /// standard deviation: that of the group of which least is told. Infinite where nothing tells; `None` where no lens
    /// is looked for.
    pub(super) fn doubt_px(&self, pinholes: &Parameters, group_of: &[usize]) -> Option<f64> {
        if self.kind == LensKind::Pinhole {
            return None;
        }
        let groups = group_of.iter().max().map_or(0, |last| last + 1);
        let deviations = |witness: Witness| -> Vec<Option<f64>> {
            let free = std::array::from_fn(|term| term == RADIAL || (term == FOCAL && witness == Witness::Matches));
            let model = IntrinsicsModel::grouped(group_of, &vec![free; groups]);
            let evidence = LensEvidence::at(witness, self.problem, pinholes, &model, FINE_HUBER_PX);
            let of_group = |group: usize| {
                let member = group_of.iter().position(|&of| of == group)?;
                let deviation = evidence.as_ref()?.deviation(model.parameters_of[member][RADIAL]?)?;
                Some(self.corner_shift(pinholes, member, deviation))
            };
            (0..groups).map(of_group).collect()
        };
        let (by_matches, by_edges) = rayon::join(|| deviations(Witness::Matches), || deviations(Witness::Edges));
        let is_asked = |group: &usize| {
            let mut members = self.problem.priors.iter().zip(group_of).filter(|(_, of)| *of == group);
            members.all(|(prior, _)| prior.lens.is_none())
        };
        let of_group = |group: usize| {
            let told = by_matches[group].into_iter().chain(by_edges[group]);
            told.fold(f64::INFINITY, f64::min)
        };
        (0..groups).filter(is_asked).map(of_group).max_by(f64::total_cmp)
    }

    /// By how many working pixels a principal point off the middle moves the corners of a photograph beyond what a turn
    /// does.
    fn off_center_shift(&self, parameters: &Parameters, photograph: usize, [x, y]: [f64; 2]) -> f64 {
        let radius_px = 0.5 * self.problem.priors[photograph].frame.diagonal();
        x.hypot(y) * (radius_px / parameters.focal_px[photograph]).powi(2)
    }

    /// By how many working pixels k1 moves the corners of a photograph.
    fn corner_shift(&self, parameters: &Parameters, photograph: usize, k1: f64) -> f64 {
        let radius_px = 0.5 * self.problem.priors[photograph].frame.diagonal();
        k1.abs() * radius_px * (radius_px / parameters.focal_px[photograph]).powi(2)
    }
}

/// Who tells, of every group.
struct Told {
    by_matches: Vec<bool>,
    by_edges: Vec<bool>,
}

impl Told {
    fn by_either(&self) -> Vec<bool> {
        self.by_matches.iter().zip(&self.by_edges).map(|(&matches, &edges)| matches || edges).collect()
    }
}

/// What is asked of the evidence.
struct Ask<'a> {
    terms: &'a [usize],
    /// Of which groups.
    of: &'a [bool],
    /// Limit of the loss.
    huber_px: f64,
}
