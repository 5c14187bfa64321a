//! The scene's dominant directions: the frame that most photographs' vanishing directions agree on.

use nalgebra::{Matrix3, Vector3};
use rand::Rng;
use rand::RngExt;
use trueup_core::geometry::{exp_rotation, nearest_rotation};

use super::signed_permutation::{match_triad, triad_residual};

/// Largest |cosine| of two directions of different photographs that count as orthogonal: sin 10 degrees.
const ORTHOGONAL: f64 = 0.173_648_177_666_930_33;
/// Two directions of one photograph whose cross product is shorter than this are no pair.
const MIN_CROSS: f64 = 0.5;
/// Hypotheses, by cost, that are refined.
const REFINED: usize = 20;
/// Iterations after which the refinement of a hypothesis stops in any case.
const MAX_ITERATIONS: usize = 20;
/// Hypotheses that join directions of two photographs, beside three per photograph.
const MAX_CROSS_PAIRS: usize = 2000;
/// Step in radians below which the refinement has converged.
const CONVERGED: f64 = 1e-9;

/// The dominant frame and how well each photograph fits.
#[derive(Debug, Clone)]
pub(super) struct Dominant {
    /// Columns are the dominant directions in the common frame; a rotation.
    pub frame: Matrix3<f64>,
    /// Per photograph the sum of squared distances of its matched directions; `None` without a triad.
    pub residuals: Vec<Option<f64>>,
}

/// The frame of least truncated cost sum_i min(r_i, `cut`); `None` without any triad.
///
/// `triads`: per photograph the directions as columns in one common frame. At most
/// [`MAX_CROSS_PAIRS`] hypotheses that join directions of two photographs are tried beside three per photograph.
///
/// # Source
/// The paper's eq. 3 and 4.
///
/// # Departures
/// The cost is truncated at the rejection threshold: the plain sum is moved by outliers, by 2 to 6 degrees with 10 to
/// 60 per cent of them. Order and sign of the directions are free ([`match_triad`]).
pub(super) fn dominant_frame(triads: &[Option<Matrix3<f64>>], cut: f64, generator: &mut impl Rng) -> Option<Dominant> {
    let present: Vec<Matrix3<f64>> = triads.iter().flatten().copied().collect();
    let mut ranked: Vec<(f64, Matrix3<f64>)> = Vec::new();
    for frame in hypotheses(&present, generator) {
        ranked.push((cost(&frame, &present, cut), frame));
    }
    // A stable sort keeps the order of the hypotheses among equals.
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(f64, Matrix3<f64>)> = None;
    for (_, start) in ranked.iter().take(REFINED) {
        let frame = refine_frame(start, &present, cut);
        let refined_cost = cost(&frame, &present, cut);
        if best.as_ref().is_none_or(|best| refined_cost < best.0) {
            best = Some((refined_cost, frame));
        }
    }
    best.map(|(_, frame)| {
        let residuals = triads.iter().map(|triad| triad.map(|triad| triad_residual(&frame, &triad))).collect();
        Dominant { frame, residuals }
    })
}

fn hypotheses(present: &[Matrix3<f64>], generator: &mut impl Rng) -> Vec<Matrix3<f64>> {
    let direction = |index: usize| -> Vector3<f64> { present[index / 3].column(index % 3).into_owned() };
    let mut pairs: Vec<(usize, usize)> = Vec::with_capacity(3 * present.len() + MAX_CROSS_PAIRS);
    for photograph in 0..present.len() {
        pairs.extend([(0, 1), (1, 2), (2, 0)].map(|(a, b)| (3 * photograph + a, 3 * photograph + b)));
    }
    let mut across = Vec::new();
    for a in 0..3 * present.len() {
        for b in 3 * (a / 3 + 1)..3 * present.len() {
            if direction(a).dot(&direction(b)).abs() < ORTHOGONAL {
                across.push((a, b));
            }
        }
    }
    // A partial Fisher-Yates shuffle draws without replacement.
    let kept = across.len().min(MAX_CROSS_PAIRS);
    if kept < across.len() {
        for place in 0..kept {
            let other = generator.random_range(place..across.len());
            across.swap(place, other);
        }
    }
    pairs.extend_from_slice(&across[..kept]);
    pairs.into_iter().filter_map(|(a, b)| frame_of_pair(&direction(a), &direction(b))).collect()
}

/// The right-handed frame (a, c x a, c), c along a x b.
fn frame_of_pair(a: &Vector3<f64>, b: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let cross = a.cross(b);
    let norm = cross.norm();
    if norm < MIN_CROSS || !norm.is_finite() {
        return None;
    }
    let third = cross / norm;
    let second = third.cross(a);
    Some(nearest_rotation(&Matrix3::from_columns(&[*a, second, third])))
}

fn cost(frame: &Matrix3<f64>, present: &[Matrix3<f64>], cut: f64) -> f64 {
    present.iter().map(|triad| triad_residual(frame, triad).min(cut)).sum()
}

/// Least squares over the photographs whose residual is at most `cut`, re-assigned in every step.
///
/// # Source
/// The Gauss-Newton step of eq. 4 for a right perturbation D exp([d]x): d = 1/(2n) sum_i sum_k e_k x (D^T b_k).
pub(super) fn refine_frame(start: &Matrix3<f64>, present: &[Matrix3<f64>], cut: f64) -> Matrix3<f64> {
    let mut frame = *start;
    for _ in 0..MAX_ITERATIONS {
        let mut gradient = Vector3::zeros();
        let mut count = 0_usize;
        for triad in present {
            let (matched, residual) = match_triad(&frame, triad);
            if residual <= cut {
                let in_frame = frame.tr_mul(&matched);
                for k in 0..3 {
                    gradient += Vector3::ith(k, 1.0).cross(&in_frame.column(k));
                }
                count += 1;
            }
        }
        if count == 0 {
            break;
        }
        let step = gradient / (2 * count) as f64;
        frame = nearest_rotation(&(frame * exp_rotation(&step)));
        if step.norm() < CONVERGED {
            break;
        }
    }
    frame
}
