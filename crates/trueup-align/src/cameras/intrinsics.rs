//! What bundle adjustment may change of a camera beside its rotation, and who shares it.

use trueup_core::camera::{Camera, INTRINSICS};
use trueup_core::lens::{LensTerms, PlacedLens};
use trueup_core::source::WorkingFrame;

use super::prior::CameraPrior;

/// Place of the focal length's logarithm among the intrinsic unknowns.
pub(super) const FOCAL: usize = 0;
/// First of the principal point's two.
pub(super) const CENTER: usize = 1;
/// First of the four radial terms.
pub(super) const RADIAL: usize = 3;
/// First of the two tangential terms.
pub(super) const TANGENTIAL: usize = 7;

/// Relative spread of separately estimated focal lengths above which `cameras.focal_sharing=auto` lets every photograph
/// have its own; and how far one differs from the others that may have been zoomed.
pub(super) const ZOOM_SPREAD: f64 = 0.03;

/// Standard deviation of a radial term before anything is seen: an action camera's reaches 0.3.
const RADIAL_SD: f64 = 0.3;
/// Standard deviation of a tangential term.
const TANGENTIAL_SD: f64 = 2e-3;
/// Standard deviation of the principal point from the middle, in diagonals, along each axis.
const CENTER_SD: f64 = 0.01;

/// Where refinement starts from.
pub(super) struct InitialIntrinsics {
    pub focal_px: Vec<f64>,
    /// One of every photograph: as told; else pinholes, unless they explain the matches badly and another lens much
    /// better.
    pub lenses: Vec<LensState>,
}

/// How far an intrinsic unknown but the focal length is expected from 0, one standard deviation.
pub(super) fn standard_deviation(intrinsic: usize, frame: &WorkingFrame) -> f64 {
    match intrinsic {
        CENTER..RADIAL => CENTER_SD * frame.diagonal(),
        TANGENTIAL.. => TANGENTIAL_SD,
        _ => RADIAL_SD,
    }
}

/// A photograph's lens on the way.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct LensState {
    pub terms: LensTerms,
    /// The principal point from the photograph's middle, working pixels.
    pub center_px: [f64; 2],
}

impl From<PlacedLens> for LensState {
    fn from(PlacedLens { terms, center_px }: PlacedLens) -> Self {
        Self { terms, center_px }
    }
}

impl LensState {
    /// Whether nothing is bent, and nothing off center.
    pub(super) fn is_pinhole(&self) -> bool {
        *self == Self::default()
    }

    /// A pinhole camera with this lens put on.
    pub(super) fn on(&self, pinhole: Camera) -> Camera {
        pinhole.through(&PlacedLens { terms: self.terms, center_px: self.center_px })
    }

    /// An intrinsic unknown's value.
    pub(super) fn term(&self, intrinsic: usize) -> f64 {
        match intrinsic {
            CENTER..RADIAL => self.center_px[intrinsic - CENTER],
            RADIAL..TANGENTIAL => self.terms.radial[intrinsic - RADIAL],
            TANGENTIAL..INTRINSICS => self.terms.tangential[intrinsic - TANGENTIAL],
            _ => 0.0,
        }
    }

    /// Adds to an intrinsic unknown.
    pub(super) fn add(&mut self, intrinsic: usize, amount: f64) {
        match intrinsic {
            CENTER..RADIAL => self.center_px[intrinsic - CENTER] += amount,
            RADIAL..TANGENTIAL => self.terms.radial[intrinsic - RADIAL] += amount,
            TANGENTIAL..INTRINSICS => self.terms.tangential[intrinsic - TANGENTIAL] += amount,
            _ => {}
        }
    }
}

/// Which intrinsic unknowns are free.
pub(super) type FreeTerms = [bool; INTRINSICS];

/// Which unknown moves which intrinsic of which photograph; `None` holds it fixed.
#[derive(Debug, Clone)]
pub(super) struct IntrinsicsModel {
    pub parameters_of: Vec<[Option<usize>; INTRINSICS]>,
    pub parameters: usize,
}

impl IntrinsicsModel {
    /// One focal length per camera group.
    pub(super) fn shared(priors: &[CameraPrior]) -> Self {
        Self::common(&priors.iter().map(|prior| prior.camera_group).collect::<Vec<_>>())
    }

    /// One focal length for the photographs of each label, whatever the labels are.
    pub(super) fn common(labels: &[usize]) -> Self {
        let mut groups = labels.to_vec();
        groups.sort_unstable();
        groups.dedup();
        let group_of: Vec<usize> = labels.iter().map(|label| groups.binary_search(label).unwrap_or(0)).collect();
        Self::grouped(&group_of, &vec![only_focal(); groups.len()])
    }

    /// One focal length per photograph.
    pub(super) fn per_photograph(photographs: usize) -> Self {
        Self::grouped(&(0..photographs).collect::<Vec<_>>(), &vec![only_focal(); photographs])
    }

    /// No unknowns: everything stays as it is.
    pub(super) fn fixed(photographs: usize) -> Self {
        Self { parameters_of: vec![[None; INTRINSICS]; photographs], parameters: 0 }
    }

    /// The unknowns that are `free` for each group, common to the photographs that `group_of` puts into it.
    pub(super) fn grouped(group_of: &[usize], free: &[FreeTerms]) -> Self {
        let mut parameters = 0;
        let columns: Vec<[Option<usize>; INTRINSICS]> = free
            .iter()
            .map(|free| {
                std::array::from_fn(|intrinsic| {
                    let next = free[intrinsic].then_some(parameters);
                    parameters += usize::from(free[intrinsic]);
                    next
                })
            })
            .collect();
        Self { parameters_of: group_of.iter().map(|&group| columns[group]).collect(), parameters }
    }

    /// The same with a focal length for each photograph whose own is free.
    pub(super) fn with_own_focal(&self) -> Self {
        let mut held = self.with_focal_held();
        for (of, shared) in held.parameters_of.iter_mut().zip(&self.parameters_of) {
            of[FOCAL] = shared[FOCAL].map(|_| held.parameters);
            held.parameters += usize::from(of[FOCAL].is_some());
        }
        held
    }

    /// The same with `terms` free, too, of the photographs that are `asked`, common to those of a label.
    pub(super) fn with_terms(&self, terms: &[usize], asked: &[bool], labels: &[usize]) -> Self {
        let mut wider = self.clone();
        for &term in terms {
            let mut column_of: Vec<(usize, usize)> = Vec::new();
            for ((of, &label), _) in wider.parameters_of.iter_mut().zip(labels).zip(asked).filter(|(_, asked)| **asked)
            {
                if of[term].is_some() {
                    continue;
                }
                let known = column_of.iter().find(|(known, _)| *known == label).map(|&(_, column)| column);
                let column = known.unwrap_or(wider.parameters);
                if known.is_none() {
                    column_of.push((label, column));
                    wider.parameters += 1;
                }
                of[term] = Some(column);
            }
        }
        wider
    }

    /// The same with all focal lengths held fixed.
    pub(super) fn with_focal_held(&self) -> Self {
        let is_focal = |parameter: usize| self.parameters_of.iter().any(|of| of[FOCAL] == Some(parameter));
        let kept: Vec<usize> = (0..self.parameters).filter(|&parameter| !is_focal(parameter)).collect();
        let renumbered = |of: &[Option<usize>; INTRINSICS]| of.map(|column| kept.binary_search(&column?).ok());
        Self { parameters_of: self.parameters_of.iter().map(renumbered).collect(), parameters: kept.len() }
    }

    /// Whether photographs share a focal length.
    pub(super) fn shares_focal(&self) -> bool {
        let mut of: Vec<usize> = self.parameters_of.iter().filter_map(|of| of[FOCAL]).collect();
        of.sort_unstable();
        of.windows(2).any(|pair| pair[0] == pair[1])
    }

    /// Whether anything but focal lengths is free.
    pub(super) fn has_lens(&self) -> bool {
        self.parameters_of.iter().any(|of| of[FOCAL + 1..].iter().any(Option::is_some))
    }
}

/// The focal length alone.
pub(super) fn only_focal() -> FreeTerms {
    std::array::from_fn(|intrinsic| intrinsic == FOCAL)
}

/// Frees `terms` of the groups for which it is `told`.
pub(super) fn set_free(free: &mut [FreeTerms], terms: &[usize], told: &[bool]) {
    for (free, _) in free.iter_mut().zip(told).filter(|(_, told)| **told) {
        terms.iter().for_each(|&term| free[term] = true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two groups, the first with a focal length and k1, the second with a focal length, k1 and k2: what is left is
    /// counted 0, 1, 2.
    #[test]
    fn focal_lengths_are_held_and_the_others_counted_anew() {
        let of = |terms: &[usize]| -> FreeTerms { std::array::from_fn(|term| terms.contains(&term)) };
        let free = [of(&[FOCAL, RADIAL]), of(&[FOCAL, RADIAL, RADIAL + 1])];
        let held = IntrinsicsModel::grouped(&[0, 1, 0], &free).with_focal_held();
        assert_eq!(held.parameters, 3);
        let column = |photograph: usize, term: usize| held.parameters_of[photograph][term];
        assert!((0..3).all(|photograph| column(photograph, FOCAL).is_none()));
        let first = (Some(0), None);
        assert_eq!([0, 1, 2].map(|k| (column(k, RADIAL), column(k, RADIAL + 1))), [first, (Some(1), Some(2)), first]);
        let own = IntrinsicsModel::grouped(&[0, 1, 0], &free).with_own_focal();
        assert_eq!((own.parameters, [0, 1, 2].map(|k| own.parameters_of[k][FOCAL])), (6, [Some(3), Some(4), Some(5)]));
        assert_eq!([0, 1, 2].map(|k| own.parameters_of[k][RADIAL]), [Some(0), Some(1), Some(0)]);
        // k2 of the first group and the last, each for itself; what is free already is not asked for, nor of whom
        // nothing is.
        let wider = own.with_terms(&[RADIAL, RADIAL + 1], &[true, true, false], &[7, 3, 7]);
        let k2_of = |k: usize| wider.parameters_of[k][RADIAL + 1];
        assert_eq!((wider.parameters, [0, 1, 2].map(k2_of)), (7, [Some(6), Some(2), None]));
        let shared = own.with_terms(&[RADIAL + 1], &[true; 3], &[7, 3, 7]);
        assert_eq!((shared.parameters, shared.parameters_of[2][RADIAL + 1]), (7, Some(6)));
        // What is held stays so.
        assert_eq!(held.with_own_focal().parameters, 3);
    }
}
