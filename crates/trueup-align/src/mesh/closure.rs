//! What closes a full turn: overlaps whose photographs, laid flat, lie a whole turn apart.

use nalgebra::Vector2;
use trueup_core::statistics::median_of;

use crate::match_points::OverlapWarp;

/// Overlaps across the cut of a full turn.
///
/// Their match points are to lie one period apart in x, and at one height. The period, the length of a turn in the
/// panorama, is one more unknown beside the vertices, so that it takes up what focal lengths are off.
#[derive(Debug, Clone, Copy)]
pub struct Closure<'a> {
    /// Match points, two directions a pair.
    pub warps: &'a [OverlapWarp],
    /// For each of them the turns by which its `from` lies to the right of its `to`: 1 or -1.
    pub turns: &'a [f64],
    /// The period by the cameras, in panorama units.
    pub expected: f64,
}

impl Closure<'_> {
    /// Why the ends of a panorama that was laid out without the closure cannot be the same place; `None` if they can.
    ///
    /// `apart` holds, for every match point, the way from where the left end has it to where the right end has it. What
    /// the ends are off is spread over the whole turn when it is closed; more than that takes up comes of wrong matches
    /// or cameras.
    pub(super) fn contradiction(&self, apart: &[Vector2<f64>]) -> Option<String> {
        /// Largest difference in height of the ends, and largest spread of what the match points say, as shares of the
        /// period: a slope of 1.7 degrees.
        const MOST_OFF: f64 = 0.03;
        /// Largest difference of the period from that by the cameras, as its share. Focal lengths may be off by a tenth
        /// and more although all matches agree on the period.
        const MOST_STRETCH: f64 = 0.25;
        let Some(x) = median_of(apart.iter().map(|one| one.x)) else {
            return Some("no point of their overlap was carried across".to_owned());
        };
        let middle = Vector2::new(x, median_of(apart.iter().map(|one| one.y))?);
        let spread = median_of(apart.iter().map(|one| (one - middle).norm()))?;
        let share = |length: f64| length / self.expected;
        let percent = |length: f64| 100.0 * share(length);
        // Written so that a number that is none is refused, too.
        let within = |length: f64, most: f64| share(length).abs() <= most;
        if !within(middle.x - self.expected, MOST_STRETCH) {
            return Some(format!("by their matches they are {:.0} % of a turn apart", percent(middle.x)));
        }
        if !within(middle.y, MOST_OFF) {
            return Some(format!("they differ in height by {:.1} % of a turn", percent(middle.y).abs()));
        }
        (!within(spread, MOST_OFF)).then(|| format!("their matches contradict each other by {:.1} %", percent(spread)))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use trueup_core::StageContext;
    use trueup_core::camera::Camera;
    use trueup_core::diagnostics::Severity;
    use trueup_core::geometry::rotation_about_y;
    use trueup_core::mesh::GridMesh;

    use super::super::*;
    use super::*;

    const PHOTOGRAPHS: usize = 10;
    const FOCAL_PX: f64 = 400.0;

    /// A ring of level photographs 36 degrees apart, with all match points; those across the cut, between the last and
    /// the first, apart, with their turns.
    struct Ring {
        cameras: Vec<Camera>,
        grids: Vec<GridMesh>,
        within: Vec<OverlapWarp>,
        across: Vec<OverlapWarp>,
        turns: Vec<f64>,
    }

    impl Ring {
        fn new() -> Self {
            let step = TAU / PHOTOGRAPHS as f64;
            let camera =
                |k: usize| Camera::new(FOCAL_PX, 400.0, 300.0, &rotation_about_y((k as f64 - 4.5) * step).transpose());
            let cameras: Vec<Camera> = (0..PHOTOGRAPHS).map(camera).collect();
            let grids = vec![GridMesh::regular(400.0, 300.0, 50.0); PHOTOGRAPHS];
            let carried = |from: usize, to: usize| OverlapWarp {
                from,
                to,
                vertices: (0..grids[from].len())
                    .map(|vertex| {
                        let place = cameras[from].transfer(&cameras[to], grids[from].source(vertex))?;
                        ((0.0..=400.0).contains(&place.x) && (0.0..=300.0).contains(&place.y)).then_some(place.into())
                    })
                    .collect(),
            };
            let neighbors = |k: usize| [carried(k, k + 1), carried(k + 1, k)];
            let within = (0..PHOTOGRAPHS - 1).flat_map(neighbors).collect();
            let across = vec![carried(PHOTOGRAPHS - 1, 0), carried(0, PHOTOGRAPHS - 1)];
            Self { cameras, grids, within, across, turns: vec![1.0, -1.0] }
        }

        /// The sphere of cameras whose focal length is `share` of the true one.
        fn bases(&self, share: f64, options: &MeshOptions) -> Vec<BaseMap> {
            let on_sphere = |(camera, grid): (&Camera, &GridMesh)| {
                let wrong = Camera { focal_px: share * camera.focal_px, ..*camera };
                BaseMap::on_level_sphere(&wrong, grid, FOCAL_PX * share, options)
            };
            self.cameras.iter().zip(&self.grids).map(on_sphere).collect()
        }

        /// The mesh on the sphere of cameras whose focal length is `share` of the true one.
        fn deformed(&self, share: f64, expected: f64, context: &StageContext) -> WarpedMesh {
            let options = MeshOptions::default();
            let bases = self.bases(share, &options);
            let closure = Closure { warps: &self.across, turns: &self.turns, expected };
            run(&self.input(&bases, Some(closure)), &options, context).expect("solvable").into_warped()
        }

        fn input<'a>(&'a self, bases: &'a [BaseMap], closure: Option<Closure<'a>>) -> MeshInput<'a> {
            MeshInput { grids: &self.grids, warps: &self.within, bases, reference: 0, closure, structure: None }
        }
    }

    #[test]
    fn a_ring_of_exact_matches_closes_exactly() {
        let context = StageContext::default();
        let warped = Ring::new().deformed(1.0, TAU * FOCAL_PX, &context);
        let period = warped.period.expect("a full turn");
        assert!((period - TAU * FOCAL_PX).abs() < 1e-6, "{period}");
        assert!(warped.alignment_rms < 1e-6 && warped.relative_gradient < 1e-9, "{warped:?}");
        assert!(context.findings().is_empty());
    }

    /// The matches lie a ring's circumference apart whatever the focal length: the period follows them, not the base.
    #[test]
    fn the_period_takes_up_a_wrong_focal_length() {
        let ring = Ring::new();
        for share in [0.97, 1.04] {
            let warped = ring.deformed(share, TAU * FOCAL_PX * share, &StageContext::default());
            let period = warped.period.expect("a full turn");
            let apart = |warp: &OverlapWarp| -> Vec<f64> {
                let ends = warp.vertices.iter().enumerate().filter_map(|(vertex, place)| {
                    let place = Vector2::from((*place)?);
                    let from = warped.meshes[warp.from].warp(ring.grids[0].source(vertex));
                    let way = from - warped.meshes[warp.to].warp(place) - Vector2::new(period, 0.0);
                    Some(way.norm())
                });
                ends.collect()
            };
            let across = apart(&ring.across[0]);
            let mean = across.iter().sum::<f64>() / across.len() as f64;
            assert!(across.len() > 4 && mean < 1.5 * warped.alignment_rms + 0.1, "{mean} {}", warped.alignment_rms);
            // All photographs alike: none bears more of the misfit than the others.
            let width = |mesh: &GridMesh| mesh.bounds().1.x - mesh.bounds().0.x;
            let widths: Vec<f64> = warped.meshes.iter().map(width).collect();
            let (low, high) = widths.iter().fold((f64::MAX, 0.0_f64), |(low, high), &w| (low.min(w), high.max(w)));
            assert!(high - low < 0.01 * high, "{widths:?}");
        }
    }

    /// Photographs of one ring that only shift lie side by side, so that the ends tell the turn without a mesh.
    #[test]
    fn photographs_that_shift_show_how_far_the_ends_are_apart() {
        let ring = Ring::new();
        let options = MeshOptions::default();
        let bases = ring.bases(1.0, &options);
        let places: Vec<Vec<Vector2<f64>>> =
            bases.iter().zip(&ring.grids).map(|(base, grid)| base.places(grid)).collect();
        let mut alignment = AlignmentEnergy::new(&ring.grids, &ring.within, &bases, &places);
        let closure = Closure { warps: &ring.across, turns: &ring.turns, expected: TAU * FOCAL_PX };
        alignment.join(&closure, &ring.grids, &bases, &places);
        let shifted = alignment.shifted(&placed(&ring.grids, &places), 3).expect("all photographs are joined");
        let stayed = shifted[3].warp(Vector2::zeros()) - places[3][0];
        assert!(stayed.norm() < 1e-9, "{stayed}");
        for way in alignment.apart(&shifted) {
            assert!((way - Vector2::new(TAU * FOCAL_PX, 0.0)).norm() < 1e-6, "{way}");
        }
        assert!(AlignmentEnergy::new(&ring.grids, &ring.within[2..], &bases, &places).shifted(&shifted, 3).is_none());
    }

    /// Ends that meet to the left of each other instead of to the right: the length of the turn comes out negative.
    #[test]
    fn a_turn_without_a_length_is_left_open_and_said_so() {
        let context = StageContext::default();
        let ring = Ring::new();
        let options = MeshOptions::default();
        let bases = ring.bases(1.0, &options);
        let closure = Closure { warps: &ring.across, turns: &[-1.0, 1.0], expected: -TAU * FOCAL_PX };
        let left_open = run(&ring.input(&bases, Some(closure)), &options, &context).expect("solvable").into_warped();
        let found = context.findings();
        assert_eq!((found.len(), found[0].code.as_str()), (1, "full-turn-open"));
        assert!(found[0].message.contains("no shape"), "{}", found[0].message);
        let plain = run(&ring.input(&bases, None), &options, &context).expect("solvable");
        assert_eq!(left_open, plain.into_warped());
    }

    #[test]
    fn ends_that_contradict_leave_the_turn_open_and_say_so() {
        let context = StageContext::default();
        let ring = Ring::new();
        let open = ring.deformed(1.0, 1.5 * TAU * FOCAL_PX, &context);
        assert_eq!(open.period, None);
        let found = context.findings();
        assert_eq!((found[0].code.as_str(), found[0].severity), ("full-turn-open", Severity::Warning));
        assert!(found[0].message.contains("67 %"), "{}", found[0].message);
        // As without any closure.
        let options = MeshOptions::default();
        let bases = ring.bases(1.0, &options);
        let plain = run(&ring.input(&bases, None), &options, &context).expect("solvable");
        assert_eq!(open, plain.into_warped());
        let closure = Closure { warps: &[], turns: &[], expected: 100.0 };
        let lifted = vec![Vector2::new(100.0, 5.0); 9];
        assert!(closure.contradiction(&lifted).expect("too high").contains("5.0 %"));
        assert!(closure.contradiction(&[]).is_some());
        assert!(closure.contradiction(&[Vector2::new(f64::NAN, 0.0)]).is_some());
    }
}
