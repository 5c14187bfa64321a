//! What is added to what lies elsewhere, so that nothing ends in a step where two offsets meet, nor at the border.

use super::labelling::{Energy, Shown};
use super::part::beside;

/// Most of a difference of pictures that is corrected, root of light, as the light of a sky differs from place to
/// place: of what differs by more, something ends there.
const MOST: f32 = 0.1;

/// Rounds of successive overrelaxation, and how far beyond the mean of its neighbors each sample is moved: what is left
/// of a difference after these is a hundredth over some thirty samples.
const ROUNDS: usize = 60;
const OVERRELAXATION: f32 = 1.8;

/// For each sample of a gap what is added to what is shown there, roots of light: steps at seams and borders turned
/// into slopes that are as even as can be.
///
/// # Source
/// Pérez, Gangnet, Blake, "Poisson image editing", SIGGRAPH 2003, equation 7, for what is added instead of for the sum;
/// between two samples of different sources the gradient is the mean of both.
pub(super) fn of(energy: &Energy<'_>, shown: &[Shown]) -> Vec<[f32; 3]> {
    let part = energy.part;
    let width = part.width();
    let mut place = vec![None; part.colors.len()];
    part.gap.iter().enumerate().for_each(|(index, &at)| place[at] = Some(index));
    let is_border = part.is_border();
    let less = |one: Option<[f32; 3]>, other: Option<[f32; 3]>, most: f32| {
        let pair = one.zip(other);
        pair.map_or([0.0; 3], |(one, other)| [0, 1, 2].map(|k| (one[k] - other[k]).clamp(-most, most)))
    };
    // Of each neighbor of a sample, its own place in the gap, and what it is lower by.
    let steps = |(index, &at): (usize, &usize)| -> Vec<(Option<usize>, [f32; 3])> {
        let own = shown[index];
        let step = |other: usize| match place[other] {
            Some(beside) => {
                let label = shown[beside];
                // Nothing ends where the smooth surface begins.
                let most = if own == 0 || label == 0 { f32::INFINITY } else { MOST };
                let [here, there] = [at, other].map(|at| less(energy.color(at, label), energy.color(at, own), most));
                Some((Some(beside), [0, 1, 2].map(|k| 0.5 * (here[k] + there[k]))))
            }
            None => is_border[other].then(|| (None, less(part.colors[other], energy.color(other, own), MOST))),
        };
        beside(at, width, part.rows.len()).filter_map(step).collect()
    };
    let steps: Vec<Vec<(Option<usize>, [f32; 3])>> = part.gap.iter().enumerate().map(steps).collect();
    let mut added = vec![[0.0_f32; 3]; part.gap.len()];
    for _ in 0..ROUNDS {
        for (index, steps) in steps.iter().enumerate().filter(|(_, steps)| !steps.is_empty()) {
            let count = steps.len() as f32;
            let mut sum = [0.0_f32; 3];
            for &(beside, step) in steps {
                let there = beside.map_or([0.0; 3], |beside| added[beside]);
                (0..3).for_each(|k| sum[k] += there[k] + step[k]);
            }
            (0..3).for_each(|k| added[index][k] += OVERRELAXATION * (sum[k] / count - added[index][k]));
        }
    }
    added
}

#[cfg(test)]
mod tests {
    use super::super::labelling;
    use super::super::part::Part;
    use super::*;

    /// One row of twelve samples: a gap of four between two of its border, and what lies six samples farther, all of
    /// one gray.
    fn row(border: [f32; 2], elsewhere: f32) -> Part {
        let gray = |level: f32| Some([level; 3]);
        let colors = (0..12).map(|at| match at {
            0 => gray(border[0]),
            5 => gray(border[1]),
            6.. => gray(elsewhere),
            _ => None,
        });
        Part {
            columns: 0..12,
            rows: 0..1,
            gap: vec![1, 2, 3, 4],
            border: vec![[0, 1], [5, 4]],
            usable: (0..12).map(|at| at >= 6).collect(),
            colors: colors.collect(),
            reach_down: 0,
            rough: vec![0.2; 4],
        }
    }

    #[test]
    fn a_rough_border_asks_for_what_lies_elsewhere_and_an_even_one_for_the_surface() {
        let smooth = vec![Some([0.3; 3]); 12];
        let shown = |rough: f32| {
            let part = Part { rough: vec![rough; 4], ..row([0.35, 0.25], 0.3) };
            labelling::of(&Energy::of(&part, &[[6, 0]], &smooth))
        };
        assert_eq!([shown(0.0), shown(0.2)], [vec![0; 4], vec![1; 4]]);
    }

    /// What lies elsewhere is by 0.05 darker than one end of the border and by as much brighter than the other: what is
    /// added falls evenly.
    #[test]
    fn a_step_at_the_border_becomes_a_slope() {
        let part = row([0.35, 0.25], 0.3);
        let smooth = vec![None; 12];
        let added = of(&Energy::of(&part, &[[6, 0]], &smooth), &[1; 4]);
        for (added, expected) in added.iter().zip([0.03, 0.01, -0.01, -0.03]) {
            assert!((added[0] - expected).abs() < 1e-3, "{added:?} instead of {expected}");
        }
    }

    /// Of a step of 0.3, a tenth is all that is made a slope.
    #[test]
    fn what_ends_at_the_border_stays_a_step() {
        let part = row([0.6, 0.6], 0.3);
        let added = of(&Energy::of(&part, &[[6, 0]], &[None; 12]), &[1; 4]);
        assert!(added.iter().all(|added| (added[0] - 0.1).abs() < 1e-3), "{added:?}");
    }
}
