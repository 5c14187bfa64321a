//! Padding that several pictures have in common.

use trueup_core::outline::Outline;
use trueup_core::side::Side;

use super::edge::{Edge, simplify};
use super::{FEW_RAYS, LEAST_DEPTH, MARGIN_PX, MOST, Padding, RAYS, Ray, SAME_PX, believable};

/// Rays between a place and those beside it that it is in line with along a smooth curve.
const SMOOTH_RAYS: usize = 4;

/// Padding that pictures of one size have in common: what taking the bend of one lens out of photographs leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonPadding {
    depths: Vec<u16>,
    /// The outline of the photograph, in the pictures' pixels.
    pub outline: Outline,
}

impl CommonPadding {
    /// Looks at all pictures of `size` pixels of a set; `None` where there is none that half of them show, two at
    /// least, where it does not end along a smooth curve, or not at opposite sides.
    pub fn of(pictures: &[&Padding], size: [usize; 2]) -> Option<Self> {
        let depths: Vec<u16> = (0..RAYS)
            .map(|ray| {
                let mut depths: Vec<u16> = pictures.iter().map(|picture| picture.depth(ray)).collect();
                depths.sort_unstable();
                // What is as dark, or as bright, as padding beside it makes it seem deeper.
                depths.get(depths.len() / 4).copied().unwrap_or(0)
            })
            .collect();
        let common = Self { outline: outlined(&depths, size)?, depths };
        let sharing = pictures.iter().filter(|picture| common.is_told_by(picture)).count();
        let believed =
            sharing >= 2 && 2 * sharing >= pictures.len() && common.is_smooth(size) && common.is_opposite(size);
        believed.then_some(common)
    }

    /// Whether a picture may have this padding: nothing else is to be seen where it is.
    pub fn suits(&self, picture: &Padding) -> bool {
        let even = |ray: &usize| picture.depth(*ray).saturating_add(SAME_PX) >= self.depths[*ray];
        self.share_of_rays(even) >= MOST
    }

    fn is_told_by(&self, picture: &Padding) -> bool {
        let same = |ray: &usize| {
            picture
                .rays
                .get(*ray)
                .is_some_and(|told| told.is_sharp && told.depth.abs_diff(self.depths[*ray]) <= SAME_PX)
        };
        self.share_of_rays(same) >= MOST
    }

    /// Whether there is padding at the start of a ray.
    fn is_padded(&self, ray: usize) -> bool {
        self.depths[ray] >= LEAST_DEPTH
    }

    /// The share of the rays with padding for which something holds; 0 without any.
    fn share_of_rays(&self, holds: impl Fn(&usize) -> bool) -> f64 {
        let padded = || (0..RAYS).filter(|&ray| self.is_padded(ray));
        padded().filter(holds).count() as f64 / padded().count().max(1) as f64
    }

    fn is_smooth(&self, size: [usize; 2]) -> bool {
        let place = |ray: usize| Ray::new(ray, size).at(f64::from(self.depths[ray]));
        let middle = size.map(|length| 0.5 * length as f64);
        let threes = (0..RAYS).map(|ray| [(ray + RAYS - SMOOTH_RAYS) % RAYS, ray, (ray + SMOOTH_RAYS) % RAYS]);
        let (all, smooth) = threes.filter(|rays| rays.iter().all(|&ray| self.is_padded(ray))).fold(
            (0_usize, 0_usize),
            |(all, smooth), [before, ray, after]| {
                let chord = Edge::through(place(before), place(after), middle);
                (all + 1, smooth + usize::from(chord.is_some_and(|chord| chord.holds(place(ray)))))
            },
        );
        all >= 4 * FEW_RAYS && smooth as f64 >= MOST * all as f64
    }

    /// Whether padding lies at two opposite sides, and the photograph reaches the picture's border at two.
    fn is_opposite(&self, size: [usize; 2]) -> bool {
        let few = |side: Side, is: &dyn Fn(usize) -> bool| {
            (0..RAYS).filter(|&ray| Ray::new(ray, size).side == side && is(ray)).take(FEW_RAYS / 2).count()
                == FEW_RAYS / 2
        };
        let at_opposite =
            |is: &dyn Fn(usize) -> bool| Side::ALL.iter().any(|&side| few(side, is) && few(side.opposite(), is));
        at_opposite(&|ray| self.is_padded(ray)) && at_opposite(&|ray| !self.is_padded(ray))
    }
}

/// The outline inside padding of these depths.
fn outlined(depths: &[u16], size: [usize; 2]) -> Option<Outline> {
    let corner = |number: usize| {
        let deepest = [RAYS - 1, 0, 1].iter().map(|beside| depths[(number + beside) % RAYS]).max().unwrap_or(0);
        let margin = if deepest > 0 { MARGIN_PX } else { 0.0 };
        Ray::new(number, size).at(f64::from(deepest) + margin)
    };
    let corners: Vec<[f64; 2]> = (0..RAYS).map(corner).collect();
    let half = RAYS / 2;
    let mut simpler = vec![corners[0]];
    simplify(&corners[..=half], &mut simpler);
    let other: Vec<[f64; 2]> = corners[half..].iter().chain(&corners[..1]).copied().collect();
    simplify(&other, &mut simpler);
    simpler.pop();
    believable(simpler, size)
}
