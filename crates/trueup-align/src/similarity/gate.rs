//! Whether the scene's dominant directions are believed.

use super::options::{GateMode, SimilarityOptions};
use crate::vanishing::frame_search::GUIDING_SIGNIFICANCE;

/// What the gate judges.
#[derive(Debug, Clone, Copy)]
pub(super) struct GateEvidence {
    /// Number of photographs, those without a triad included.
    pub photographs: usize,
    /// Photographs whose triad fits the dominant frame.
    pub inliers: usize,
    /// The divergence epsilon.
    pub divergence: f64,
    /// Angle in radians between the dominant vertical and the cameras' own, and the same in deviations of the latter;
    /// `None` where the cameras do not fix one.
    pub from_cameras: Option<CameraAngle>,
    /// How far the best frame of the pooled search stands out, standard deviations; `None` without that search.
    pub significance: Option<f64>,
    /// Median over the inliers of |alpha_i|, of two the lesser, radians.
    pub median_roll: f64,
    /// Root mean square in radians of the rolls that the photographs would have, of those that were held alike; `None`
    /// where recorded gravity tells, so that nothing is expected of them.
    pub rolls: Option<f64>,
    /// Where hardly any photograph shows upright lines, how far the dominant vertical lies from what is known without
    /// lines, in its standard deviations.
    pub by_level_lines: Option<f64>,
}

/// How far a vertical lies from the one that the cameras tell.
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraAngle {
    /// Radians.
    pub angle: f64,
    /// In standard deviations of the cameras' own vertical, as their rolls, and gravity that they recorded, leave it.
    pub deviations: f64,
    /// Root mean square of the photographs' rolls by it in radians, of those that were held alike, where nothing but
    /// the expectation that they look level tells how far up or down they look; `None` elsewhere.
    pub rolls: Option<f64>,
    /// Whether cameras recorded gravity: then they know how they were held.
    pub is_recorded: bool,
}

impl CameraAngle {
    /// Whether it is farther than the cameras allow: where their rolls contradict each other, as with one photograph on
    /// its corner, they know little; so do two that may look up or down alike, if lines agree closely; and however
    /// many, which may all be held rolled alike, where more agree closely than do by chance.
    pub(super) fn is_too_wide(self, agreement: Agreement) -> bool {
        // Not-a-number is too wide.
        let is_near = self.angle.to_degrees() <= MAX_CAMERA_ANGLE_DEG || self.deviations <= MAX_CAMERA_DEVIATIONS;
        let held_level = self.rolls.is_some_and(|rolls| rolls.to_degrees() <= MAX_CAMERA_ANGLE_DEG);
        let is_within = self.angle.to_degrees() <= MAX_STEEP_DEG;
        let is_explained = match agreement {
            Agreement::Loose => false,
            Agreement::Close => held_level,
            Agreement::CloseOfMany => !self.is_recorded,
        };
        !(is_near || is_within && is_explained)
    }
}

/// How the directions of photographs agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Agreement {
    /// No closer than a divergence that the gate allows anywhere.
    Loose,
    /// As closely as directions far from the cameras' level must.
    Close,
    /// As closely, and of more than [`VERY_FEW_PHOTOGRAPHS`].
    CloseOfMany,
}

impl Agreement {
    /// Of `inliers` photographs with this divergence.
    pub(super) fn of(inliers: usize, divergence: f64, options: &SimilarityOptions) -> Self {
        let is_close = divergence <= STEEP_DIVERGENCE_SHARE * options.max_divergence_few;
        match (is_close, inliers > VERY_FEW_PHOTOGRAPHS) {
            (false, _) => Self::Loose,
            (true, false) => Self::Close,
            (true, true) => Self::CloseOfMany,
        }
    }
}

/// Largest number of photographs among which unrelated directions can agree by chance.
const VERY_FEW_PHOTOGRAPHS: usize = 3;
/// Largest number of photographs that counts as few.
const FEW_PHOTOGRAPHS: usize = 6;
/// Least share of agreeing photographs with few of them ...
const MIN_INLIER_SHARE_FEW: f64 = 0.6;
/// ... and with more.
const MIN_INLIER_SHARE: f64 = 0.4;
/// How far the best frame must stand out in the pooled search to confirm the photographs' own directions, standard
/// deviations. Measured: chosen on the 130 sets of the gate's experiment and on real sets.
const CONFIRMING_SIGNIFICANCE: f64 = 5.0;
/// By how much the logarithm of the chance falls for each standard deviation by which lines of a scene without dominant
/// directions stand out. Measured: of 157 pairs and triples of such, rendered and cut, 57 stand out by 5, 15 by 5.5, 7
/// by 6 and 4 by 6.5.
const SIGNIFICANCE_LOG_ODDS: f64 = 2.0;
/// Power of the divergence by which the chance falls that unrelated triads meet within it: with the cube of their
/// angle.
const DIVERGENCE_POWER: f64 = 1.5;
/// How far lines must stand out for very few photographs to agree less closely, standard deviations. Measured: below
/// it, pairs that agree less closely than [`SimilarityOptions::max_divergence_few`] are wrong as often as not.
const WIDENING_SIGNIFICANCE: f64 = 6.0;
/// Roll that photographers leave, with the tail of those that mean it, degrees. Measured: of 63 pairs and triples whose
/// lines are right, 56 are rolled by less than 3.5; of 15 whose lines are wrong, 2.
const EXPECTED_ROLL_DEG: f64 = 2.5;
/// Largest angle between the dominant vertical and the one that the cameras tell, degrees ...
const MAX_CAMERA_ANGLE_DEG: f64 = 20.0;
/// ... unless it is this few of the cameras' own deviations.
const MAX_CAMERA_DEVIATIONS: f64 = 2.0;
/// Largest angle of the same where photographs that all look up or down explain it, as two of a tower do, or that were
/// all held rolled, degrees. Beyond, what lies level before the camera may be taken for the vertical: with pitches that
/// scatter by 20 degrees (reasoned), that they look the other way, onto a floor, is more than an eighth as probable.
const MAX_STEEP_DEG: f64 = 36.0;
/// Share of [`SimilarityOptions::max_divergence_few`] that is believed there: 2.3 times as many directions lie within
/// 36 degrees of pitch and 20 of roll as within 20 of the vertical, and the chance that unrelated triads meet falls
/// with the divergence's power of 3/2.
const STEEP_DIVERGENCE_SHARE: f64 = 0.58;
/// Largest median roll of the agreeing photographs, degrees.
const MAX_MEDIAN_ROLL_DEG: f64 = 45.0;

/// The largest divergence that is believed with this many photographs, whose lines stand out by `significance`.
///
/// # Departures
/// The paper has one threshold. Two or three unrelated triads meet within it once in ten times; the chance falls with
/// the cube of the angle they must meet within, so that very few photographs have to agree more closely. Where their
/// lines stand out by more than chance does ([`WIDENING_SIGNIFICANCE`]), they may agree less closely by what that is
/// rarer.
pub(super) fn allowed_divergence(photographs: usize, significance: Option<f64>, options: &SimilarityOptions) -> f64 {
    let few = options.max_divergence.min(options.max_divergence_few);
    match options.gate {
        GateMode::Full if photographs <= VERY_FEW_PHOTOGRAPHS => {
            let beyond = (significance.unwrap_or(0.0) - WIDENING_SIGNIFICANCE).max(0.0);
            let widened = few * (SIGNIFICANCE_LOG_ODDS * beyond / DIVERGENCE_POWER).exp();
            widened.min(options.max_divergence)
        }
        _ => options.max_divergence,
    }
}

/// How far the lines must stand out to confirm directions by which very few photographs would be rolled so: as many
/// standard deviations more as make up for how rarely photographers roll by it, up to what stands out by itself. So
/// must those of few that do not `agree_as_very_few_must`.
fn needed_significance(photographs: usize, agree_as_very_few_must: bool, rolls: Option<f64>) -> f64 {
    let could_be_chance =
        photographs <= VERY_FEW_PHOTOGRAPHS || photographs <= FEW_PHOTOGRAPHS && !agree_as_very_few_must;
    let rolls = rolls.filter(|_| could_be_chance).unwrap_or(0.0);
    let unexpected = 0.5 * (rolls.to_degrees() / EXPECTED_ROLL_DEG).powi(2);
    (CONFIRMING_SIGNIFICANCE + unexpected / SIGNIFICANCE_LOG_ODDS).min(GUIDING_SIGNIFICANCE)
}

/// How many deviations a vertical that hardly any photograph shows may lie from what is known without lines, where all
/// lines together stand out by `beyond` standard deviations more than they must: as many as that makes up for how
/// improbable it is. Skylines and slopes of nature make frames of level lines by chance; of some 600 cut sets four had
/// such frames, at 0.5 deviations (2 degrees off, and standing out by 8.2), 4.5 (88 degrees, 7.1), 7.3 (17 degrees,
/// 5.8) and 7.7 (12 degrees, 7.04).
pub(super) fn allowed_of_level_lines(beyond: f64) -> f64 {
    (2.0 * SIGNIFICANCE_LOG_ODDS * beyond.max(0.0)).sqrt()
}

/// The divergence of the vanishing directions: the mean residual of the inliers over their share of the photographs.
///
/// Infinite without inliers.
///
/// # Source
/// The paper's eq. 15.
///
/// # Departures
/// The paper does not say what its sum is divided by; the mean per photograph alone puts its threshold 0.10 between
/// scenes with and without dominant directions. `as_printed` leaves the sum as it is, which grows with the photographs.
pub(super) fn divergence(inlier_residuals: &[f64], photographs: usize, as_printed: bool) -> f64 {
    if inlier_residuals.is_empty() {
        return f64::INFINITY;
    }
    let count = inlier_residuals.len() as f64;
    let share = count / photographs as f64;
    let sum = inlier_residuals.iter().sum::<f64>();
    if as_printed { sum / share } else { sum / count / share }
}

/// The first clause that fails, in words; `None` if the guidance is accepted.
///
/// # Departures
/// The paper has clause (a) alone, which cannot tell with few photographs: one photograph always fits its own triad.
/// [`GateMode::Paper`] keeps to it.
pub(super) fn failed_clause(evidence: &GateEvidence, options: &SimilarityOptions) -> Option<String> {
    let GateEvidence {
        photographs,
        inliers,
        divergence,
        from_cameras,
        significance,
        median_roll,
        rolls,
        by_level_lines,
    } = *evidence;
    // Not-a-number fails.
    let allowed = allowed_divergence(photographs, significance, options);
    if divergence.is_nan() || divergence > allowed {
        let (divergence, allowed) = told_apart(divergence, allowed, 3);
        return Some(format!("the vanishing directions diverge by {divergence} ({allowed} allowed)"));
    }
    if options.gate == GateMode::Paper {
        return None;
    }
    let share = if photographs <= FEW_PHOTOGRAPHS { MIN_INLIER_SHARE_FEW } else { MIN_INLIER_SHARE };
    let needed = ((share * photographs as f64).ceil() as usize).max(2);
    if inliers < needed {
        return Some(format!(
            "{inliers} of {photographs} photographs agree on the dominant directions ({needed} needed)"
        ));
    }
    let agree_as_very_few_must = divergence <= options.max_divergence_few;
    let needed = needed_significance(photographs, agree_as_very_few_must, rolls);
    if let Some(significance) = significance.filter(|&significance| significance < needed) {
        let (significance, needed) = told_apart(significance, needed, 1);
        return Some(format!(
            "the lines of all photographs together prefer no direction clearly ({significance} standard deviations, {needed} needed)"
        ));
    }
    if let Some((deviations, significance)) = by_level_lines.zip(significance) {
        let allowed = allowed_of_level_lines(significance - CONFIRMING_SIGNIFICANCE);
        if deviations > allowed {
            let (deviations, allowed) = told_apart(deviations, allowed, 1);
            return Some(format!(
                "hardly any line is upright, and by level ones down is {deviations} deviations from where the cameras say ({allowed} allowed)"
            ));
        }
    }
    let agreement = Agreement::of(inliers, divergence, options);
    if let Some(wide) = from_cameras.filter(|found| found.is_too_wide(agreement)) {
        let (angle, allowed) = told_apart(wide.angle.to_degrees(), MAX_CAMERA_ANGLE_DEG, 1);
        return Some(format!(
            "the dominant vertical is {angle} degrees from the vertical of the cameras ({allowed} allowed)"
        ));
    }
    let (roll, allowed) = (median_roll.to_degrees(), MAX_MEDIAN_ROLL_DEG);
    (roll.is_nan() || roll > allowed).then(|| {
        let (roll, allowed) = told_apart(roll, allowed, 1);
        format!("more than half of the photographs would be rolled by {roll} degrees or more ({allowed} allowed)")
    })
}

/// A value and the limit that refused it in words, with `decimals` or as many more as tell them apart: not "20.0 (20.0
/// allowed)".
fn told_apart(value: f64, limit: f64, decimals: usize) -> (String, String) {
    /// Beyond, two numbers are the same to a reader.
    const MOST_MORE: usize = 4;
    let words = |decimals: usize| (format!("{value:.decimals$}"), format!("{limit:.decimals$}"));
    let apart = (decimals..=decimals + MOST_MORE).map(words).find(|(value, limit)| value != limit);
    apart.unwrap_or_else(|| words(decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photographs_that_look_up_alike_may_be_far_from_level() {
        let refused_where =
            |is_recorded, photographs: usize, divergence: f64, angle_deg: f64, rolls_deg: Option<f64>| {
                let (angle, rolls) = (angle_deg.to_radians(), rolls_deg.map(f64::to_radians));
                let from_cameras = Some(CameraAngle { angle, deviations: 6.0, rolls, is_recorded });
                let evidence = GateEvidence {
                    photographs,
                    inliers: photographs,
                    divergence,
                    from_cameras,
                    significance: Some(6.0),
                    median_roll: 0.05,
                    rolls: None,
                    by_level_lines: None,
                };
                failed_clause(&evidence, &SimilarityOptions::default()).is_some()
            };
        let refused_of = |photographs, divergence, angle_deg, rolls_deg| {
            refused_where(false, photographs, divergence, angle_deg, rolls_deg)
        };
        let refused = |divergence, angle_deg, rolls_deg| refused_of(2, divergence, angle_deg, rolls_deg);
        assert!(!refused(0.0115, 30.0, Some(4.0)));
        assert!(refused(0.0117, 30.0, Some(4.0)), "more directions lie there, and have to agree more closely");
        assert!(refused(0.001, 37.0, Some(4.0)), "what lies level in front is as near");
        assert!(refused(0.001, 30.0, Some(21.0)), "the photographs would be rolled");
        assert!(refused(0.001, 30.0, None), "the cameras tell");
        assert!(!refused(0.019, 19.0, None));
        assert!(refused_of(3, 0.0115, 30.0, None), "three meet by chance");
        assert!(!refused_of(4, 0.0115, 30.0, None), "four were all held rolled");
        assert!(refused_of(4, 0.0117, 30.0, None) && refused_of(4, 0.001, 37.0, None));
        assert!(refused_where(true, 4, 0.001, 30.0, None), "they know how they were held");
    }

    /// 5 + (5 / 2.5)^2 / 2 / 2 = 6 standard deviations for rolls of 5 degrees, and never more than 7; 0.02 exp(2 (6.6 -
    /// 6) / 1.5) = 0.0445.
    #[test]
    fn what_lines_stand_out_by_makes_up_for_rolls_and_divergence() {
        let refused = |divergence: f64, significance: f64, rolls_deg: f64, photographs: usize| {
            let evidence = GateEvidence {
                photographs,
                inliers: photographs,
                divergence,
                from_cameras: None,
                significance: Some(significance),
                median_roll: 0.05,
                rolls: Some(rolls_deg.to_radians()),
                by_level_lines: None,
            };
            failed_clause(&evidence, &SimilarityOptions::default()).is_some()
        };
        assert!(!refused(0.001, 5.1, 1.0, 2));
        assert!(refused(0.001, 5.9, 5.0, 2) && !refused(0.001, 6.1, 5.0, 2));
        assert!(refused(0.001, 6.9, 20.0, 3) && !refused(0.001, 7.0, 20.0, 3));
        assert!(!refused(0.001, 5.1, 20.0, 4), "four contradict each other where they are rolled");
        // 5 + (6 / 2.5)^2 / 2 / 2 = 6.44 of five that agree less closely than two must; seven are many.
        assert!(refused(0.062, 6.4, 6.0, 5) && !refused(0.062, 6.5, 6.0, 5));
        assert!(!refused(0.019, 5.1, 6.0, 5) && !refused(0.062, 5.1, 6.0, 7));
        assert!(refused(0.021, 5.9, 1.0, 2));
        assert!(refused(0.0446, 6.6, 1.0, 2) && !refused(0.0444, 6.6, 1.0, 2));
        assert!(refused(0.11, 12.0, 1.0, 2), "no more than with many photographs");
    }

    /// sqrt(2 x 2 x (7 - 5)) = 2.83 deviations from the cameras' vertical are allowed to lines that stand out by 7,
    /// however many photographs agree.
    #[test]
    fn level_lines_alone_stand_out_by_more_the_farther_they_lie_from_the_cameras() {
        let refused = |significance: f64, by_level_lines: Option<f64>| {
            let evidence = GateEvidence {
                photographs: 9,
                inliers: 7,
                divergence: 0.035,
                from_cameras: None,
                significance: Some(significance),
                median_roll: 0.05,
                rolls: Some(0.1),
                by_level_lines,
            };
            failed_clause(&evidence, &SimilarityOptions::default()).is_some()
        };
        assert!(!refused(5.1, None));
        assert!(refused(6.9, Some(2.8)) && !refused(7.0, Some(2.8)));
        assert!(refused(5.8, Some(7.3)));
    }

    #[test]
    fn a_refused_value_is_not_told_as_its_limit() {
        let words = |value, limit, decimals| {
            let (value, limit) = told_apart(value, limit, decimals);
            format!("{value} ({limit} allowed)")
        };
        assert_eq!(words(22.71, 20.0, 1), "22.7 (20.0 allowed)");
        assert_eq!(words(20.034, 20.0, 1), "20.03 (20.00 allowed)");
        assert_eq!(words(0.100_02, 0.1, 3), "0.10002 (0.10000 allowed)");
        assert_eq!(words(1.0, 1.0, 1), "1.0 (1.0 allowed)");
        assert_eq!(words(f64::NAN, 1.0, 1), "NaN (1.0 allowed)");
    }
}
