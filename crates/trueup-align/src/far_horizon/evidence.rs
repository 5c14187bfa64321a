//! What speaks for a circle being the horizon, all along it.

use super::circle::{HorizonCircle, STEPS, cover};
use super::edges::SkyEdge;
use super::view::{Color, View};

/// Least azimuth over which an edge must lie on the horizon, degrees. Reasoned: roofs and walls seldom take as much of
/// what is seen.
const MIN_FOUND: usize = 40;
/// Least azimuth between the outermost of these edges, degrees. Reasoned: a straight edge of the scene takes as much
/// only if it is 1.5 times as long as it is far; and over less the eye's height over the sea is taken for a pitch.
const MIN_EXTENT: usize = 75;
/// Least share of what photographs show of the circle on which an edge must lie; foreground may hide the rest.
/// Measured: cut scenes of which rocks hide 70 % have 0.2; a roof of a full turn has 0.16.
const MIN_FOUND_SHARE: f64 = 0.2;
/// Fewest photographs that must show it: in one, a line that a lens bends and a tilted straight one are alike.
const MIN_PHOTOGRAPHS: usize = 2;
/// Azimuth that a photograph must show to be counted, degrees.
const MIN_IN_PHOTOGRAPH: usize = 4;
/// Largest share, by what was found, over which sky may go on below the circle: beyond the end of a roof it does.
const MAX_OPEN_SHARE: f64 = 0.1;
/// Least share of what was found that has sky far up, or quiet ground below. Measured: scenes with a horizon have 0.75
/// and more of both; most edges of rooms, facades and trees fail one of them.
const MIN_LOOKS_SHARE: f64 = 0.6;
/// Largest step between neighbors far up in the sky, by the difference across the horizon: clouds.
const MAX_SKY_STEP: f64 = 0.6;
/// The same of the ground next to the horizon, which is far and fine: waves, fields.
const MAX_GROUND_STEP: f64 = 0.4;
/// Largest difference from a photograph's sky of what is sky, by the difference across the horizon.
const MAX_SKY_DIFFERENCE: f64 = 0.3;
/// Largest standard deviation of the vertical about the axis that the horizon tells least of, radians (half a degree).
const MAX_DEVIATION: f64 = 0.0087;

/// What was seen along a circle. Azimuth is in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HorizonEvidence {
    /// Photographs in which an edge lies on it.
    pub(super) photographs: usize,
    /// Azimuth over which photographs show the circle.
    shown: usize,
    /// Azimuth over which an edge under sky lies on it.
    found: usize,
    /// Azimuth between the outermost of these edges.
    extent: usize,
    /// Azimuth over which sky goes on below it.
    open: usize,
    /// Share of the looks at these edges that saw sky far up.
    sky: f64,
    /// Share that saw quiet ground.
    ground: f64,
    /// Standard deviation of the vertical about the axis it tells least of, radians.
    deviation: f64,
}

impl HorizonEvidence {
    /// Looks at each degree of the circle in all photographs.
    pub(super) fn along(circle: &HorizonCircle, edges: &[SkyEdge], views: &[View<'_>]) -> Self {
        let mut found = [false; STEPS];
        let mut in_photograph = vec![[false; STEPS]; views.len()];
        let mut jumps = Vec::new();
        for edge in circle.edges(edges) {
            cover(edge, &circle.down, &mut found);
            cover(edge, &circle.down, &mut in_photograph[edge.photograph]);
            jumps.push(edge.jump);
        }
        let jump = trueup_core::statistics::median(&mut jumps).unwrap_or(0.0);
        let skies = skies(circle, edges, views);
        let (mut shown, mut open) = (0, 0);
        let (mut looks, mut with_sky, mut with_ground) = (0_usize, 0_usize, 0_usize);
        for (step, direction) in circle.directions().enumerate() {
            let (mut is_shown, mut is_open) = (found[step], false);
            for (view, sky) in views.iter().zip(&skies) {
                let Some(sides) = view.sides(&direction, &circle.down) else { continue };
                is_shown = true;
                if found[step] {
                    looks += 1;
                    let step_up = view.largest_step_up(&direction, &circle.down, &sides);
                    with_sky += usize::from(step_up <= MAX_SKY_STEP * jump);
                    with_ground += usize::from(sides.step_below() <= MAX_GROUND_STEP * jump);
                } else {
                    is_open |= sky.is_some_and(|sky| sides.are_all_like(&sky, MAX_SKY_DIFFERENCE * jump));
                }
            }
            shown += usize::from(is_shown);
            open += usize::from(is_open);
        }
        let share = |count: usize| count as f64 / looks.max(1) as f64;
        Self {
            photographs: in_photograph.iter().filter(|steps| count(steps) >= MIN_IN_PHOTOGRAPH).count(),
            shown,
            found: count(&found),
            extent: extent(&found),
            open,
            sky: share(with_sky),
            ground: share(with_ground),
            deviation: circle.deviation(),
        }
    }

    /// Whether it is the far horizon. Comparisons with NaN fail.
    pub(super) fn is_beyond_doubt(&self) -> bool {
        let found = self.found as f64;
        self.found >= MIN_FOUND
            && self.extent >= MIN_EXTENT
            && found >= MIN_FOUND_SHARE * self.shown as f64
            && self.photographs >= MIN_PHOTOGRAPHS
            && self.open as f64 <= MAX_OPEN_SHARE * found
            && self.sky >= MIN_LOOKS_SHARE
            && self.ground >= MIN_LOOKS_SHARE
            && self.deviation <= MAX_DEVIATION
    }
}

/// The mean color of the sky next to the edges on a circle, in each photograph; of all of them where one has none.
fn skies(circle: &HorizonCircle, edges: &[SkyEdge], views: &[View<'_>]) -> Vec<Option<Color>> {
    let mut sums = vec![(Color::zeros(), 0.0); views.len()];
    for edge in circle.edges(edges) {
        let sum = &mut sums[edge.photograph];
        sum.0 += edge.sky;
        sum.1 += 1.0;
    }
    let all = sums.iter().fold((Color::zeros(), 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    let mean = |sum: &(Color, f64)| (sum.1 > 0.0).then(|| sum.0 / sum.1);
    sums.iter().map(|sum| mean(sum).or_else(|| mean(&all))).collect()
}

fn count(steps: &[bool; STEPS]) -> usize {
    steps.iter().filter(|&&step| step).count()
}

/// Azimuth between the outermost steps: a turn less the widest gap.
fn extent(steps: &[bool; STEPS]) -> usize {
    let (mut gap, mut widest) = (0, 0);
    for step in 0..2 * STEPS {
        gap = if steps[step % STEPS] { 0 } else { gap + 1 };
        widest = widest.max(gap);
    }
    STEPS - widest.min(STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_is_a_turn_less_its_widest_gap() {
        let mut steps = [false; STEPS];
        assert_eq!((extent(&steps), extent(&[true; STEPS])), (0, STEPS));
        // Across the end of the turn: 350 to 359 and 0 to 19, with a gap of 5 within.
        for step in (350..360).chain(0..10).chain(15..20) {
            steps[step] = true;
        }
        assert_eq!((extent(&steps), count(&steps)), (30, 25));
    }
}
