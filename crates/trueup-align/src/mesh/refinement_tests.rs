//! Refinements on synthetic pairs whose true misalignment is known.

use nalgebra::{Matrix3, Vector2};
use trueup_core::StageContext;
use trueup_core::camera::Camera;
use trueup_core::lines::{LineSegment, PairLines};
use trueup_core::matches::{PairMatches, PointMatch};
use trueup_core::mesh::GridMesh;
use trueup_core::raster::Raster;

use super::*;
use crate::match_points::OverlapWarp;
use crate::similarity::synthetic::joined;

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
/// The second photograph starts this far to the right of the first.
const SHIFT: f64 = 100.0;

/// Where the second photograph shows what the first has at a pixel: shifted, and pushed aside smoothly by up to 3 px.
fn second_from_first(point: Vector2<f64>) -> Vector2<f64> {
    let bump = (-((point - Vector2::new(210.0, 120.0)).norm() / 60.0).powi(2)).exp();
    point - Vector2::new(SHIFT, 0.0) + Vector2::new(3.0, -2.0) * bump
}

/// A smooth scene with detail at several scales.
fn scene(point: Vector2<f64>) -> f64 {
    let waves = [(0.11, 0.05, 0.0), (-0.06, 0.13, 1.0), (0.23, -0.19, 2.0), (0.31, 0.27, 0.5), (0.03, 0.02, 4.0)];
    waves.iter().map(|&(x, y, phase)| 22.0 * (x * point.x + y * point.y + phase).sin()).sum::<f64>() + 125.0
}

/// The first photograph, and the second by solving its map at every pixel, darker and with less contrast.
fn photographs() -> [Raster<u8>; 2] {
    let mut pair = [Raster::new(WIDTH, HEIGHT, 1), Raster::new(WIDTH, HEIGHT, 1)];
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let pixel = Vector2::new(x as f64 + 0.5, y as f64 + 0.5);
            let mut first = pixel + Vector2::new(SHIFT, 0.0);
            for _ in 0..20 {
                first += pixel - second_from_first(first);
            }
            pair[0].pixel_mut(x, y)[0] = scene(pixel) as u8;
            pair[1].pixel_mut(x, y)[0] = (0.7 * scene(first) - 10.0) as u8;
        }
    }
    pair
}

/// Two grids and match points that know the shift and nothing of the bump.
fn shifted() -> (Vec<GridMesh>, Vec<OverlapWarp>) {
    let grids = vec![GridMesh::regular(WIDTH as f64, HEIGHT as f64, 40.0); 2];
    let warps = [(0, 1, -SHIFT), (1, 0, SHIFT)]
        .map(|(from, to, shift)| OverlapWarp {
            from,
            to,
            vertices: (0..grids[0].len())
                .map(|vertex| grids[0].source(vertex) + Vector2::new(shift, 0.0))
                .map(|place| (0.0..=WIDTH as f64).contains(&place.x).then_some(place.into()))
                .collect(),
        })
        .to_vec();
    (grids, warps)
}

fn bases() -> [BaseMap; 2] {
    [BaseMap::similarity(1.0, 0.0), BaseMap::similarity(1.0, 0.0)]
}

fn refined(refinements: &Refinements) -> WarpedMesh {
    let (grids, warps) = shifted();
    solved(&input(&grids, &warps, &bases()), refinements).expect("solvable")
}

fn input<'a>(grids: &'a [GridMesh], warps: &'a [OverlapWarp], bases: &'a [BaseMap]) -> MeshInput<'a> {
    MeshInput { grids, warps, bases, reference: 0, closure: None, structure: None }
}

fn solved(input: &MeshInput, refinements: &Refinements) -> Result<WarpedMesh> {
    let context = StageContext::default();
    run(input, &MeshOptions::default(), &context)?.refined(refinements, &context)
}

/// Root mean square distance in the panorama of what both photographs truly show, away from the overlap's border.
fn true_distance(meshes: &[GridMesh]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 0..400 {
        let point = Vector2::new(120.0 + f64::from(k % 20) * 9.0, 20.0 + f64::from(k / 20) * 10.0);
        let there = second_from_first(point);
        sum += (meshes[0].warp(point) - meshes[1].warp(there)).norm_squared();
        count += 1.0;
    }
    (sum / count).sqrt()
}

fn pyramids() -> Vec<GrayPyramid> {
    photographs().iter().map(GrayPyramid::new).collect()
}

#[test]
fn pixels_bring_a_pair_together_in_spite_of_gain_and_bias() {
    let pyramids = pyramids();
    // The match points hold on to the wrong place: pixels must outweigh them.
    let options = PhotometricOptions { weight: 0.1 };
    let photometric = Some(PhotometricInput { pyramids: &pyramids, options: &options });
    let before = true_distance(&refined(&Refinements::default()).meshes);
    let warped = refined(&Refinements { photometric, outline_weight: 1.0, ..Refinements::default() });
    let after = true_distance(&warped.meshes);
    assert!(before > 1.0, "the bump is {before} px");
    assert!(after < 0.35 * before, "{before} px became {after} px");
    assert_eq!(warped.folds, 0);
}

#[test]
fn pixels_align_alike_on_any_number_of_threads() {
    let pyramids = pyramids();
    let options = PhotometricOptions::default();
    let input = Refinements {
        photometric: Some(PhotometricInput { pyramids: &pyramids, options: &options }),
        outline_weight: 1.0,
        ..Refinements::default()
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| refined(&input))
    };
    assert_eq!(on(1), on(4));
}

/// The bump lies in a sixth of the overlap, and 3.6 px are more than is believed fully. A floor that recedes is apart
/// by up to 1.4 px, and a thing that moved by 6, in a seventh of the overlap, while all else is where it was.
#[test]
fn parallax_is_told_from_noise_by_what_neighbors_share_and_from_things_that_moved() {
    let (grids, warps) = shifted();
    let share = |seen: &dyn Fn(Vector2<f64>) -> Vector2<f64>| {
        let inliers = (0..400_usize)
            .map(|k| Vector2::new(120.0 + (k % 20) as f64 * 9.0, 20.0 + (k / 20) as f64 * 10.0))
            .enumerate()
            .map(|(k, place)| {
                // Half a pixel this way and that, by a pattern that neighbors do not have in common.
                let noise = Vector2::new((k * 7919 % 13) as f64 - 6.0, (k * 104_729 % 11) as f64 - 5.0) / 12.0;
                PointMatch { in_a: place.into(), in_b: (seen(place) + noise).into() }
            })
            .collect();
        let points = [joined(0, 1, inliers)];
        let (bases, options) = (bases(), MeshOptions::default());
        let mesh = run(&input(&grids, &warps, &bases), &options, &StageContext::default()).expect("solvable");
        mesh.misaligned_share(&points)
    };
    let still = share(&|place| place - Vector2::new(SHIFT, 0.0));
    let floor = share(&|place| place - Vector2::new(SHIFT + (place.y - 115.0) / 70.0, 0.0));
    let is_thing = |place: Vector2<f64>| (place - Vector2::new(210.0, 120.0)).norm() < 40.0;
    let moved = share(&|place| place - Vector2::new(if is_thing(place) { SHIFT - 6.0 } else { SHIFT }, 0.0));
    let bump = share(&second_from_first);
    assert!(still < 0.05, "{still}");
    assert!((0.15..0.9).contains(&bump), "{bump}");
    assert!((0.15..0.9).contains(&floor), "{floor}");
    assert!(moved < 0.05, "{moved}");
}

#[test]
fn without_refinements_the_plain_mesh_is_left_as_it_is() {
    let plain = refined(&Refinements::default());
    assert_eq!(refined(&Refinements { outline_weight: 7.0, ..Refinements::default() }), plain);
}

/// The cameras draw the shift and nothing of the bump. Match points, which are 5 px off in both directions, have no
/// weight.
#[test]
fn what_the_cameras_draw_comes_together_between_its_outlines() {
    let (grids, mut warps) = shifted();
    for place in warps.iter_mut().flat_map(|warp| warp.vertices.iter_mut()).flatten() {
        place[1] += 5.0;
    }
    let drawn = [40.0, 40.0 + SHIFT].map(|left| divided(&grids[0], 2).moved_by(Vector2::new(left, 30.0)));
    let bases = bases_on_drawing(&drawn, Vector2::from(drawn[0].target[0]));
    let (options, context) = (MeshOptions { alignment_weight: 0.0, ..MeshOptions::default() }, StageContext::default());
    let plain = PlainMesh::of_drawing(input(&grids, &warps, &bases), &options, &context);
    let farthest = |meshes: &[GridMesh], counts: &dyn Fn(usize, usize) -> bool| {
        let mut farthest = 0.0_f64;
        for (mesh, drawn) in meshes.iter().zip(&drawn) {
            for vertex in (0..mesh.len()).filter(|&vertex| counts(vertex / mesh.columns, vertex % mesh.columns)) {
                let moved = Vector2::from(drawn.target[vertex]) - Vector2::from(mesh.target[vertex]);
                farthest = farthest.max((moved - Vector2::new(40.0, 30.0)).norm());
            }
        }
        farthest
    };
    assert!(farthest(&plain.warped().meshes, &|_, _| true) < 1e-9);
    let before = true_distance(&plain.warped().meshes);
    let (pyramids, pixels) = (pyramids(), PhotometricOptions { weight: 0.1 });
    let photometric = Some(PhotometricInput { pyramids: &pyramids, options: &pixels });
    let refinements = Refinements { photometric, outline_weight: 10.0, ..Refinements::default() };
    let refined = plain.refined(&refinements, &context).expect("solvable");
    let after = true_distance(&refined.meshes);
    assert!(before > 1.0 && after < 0.5 * before, "{before} px became {after} px");
    let outline = farthest(&refined.meshes, &|row, column| row == 0 || column == 0);
    assert!(outline < 0.5, "{outline} px");
}

fn segment(start: [f64; 2], end: [f64; 2]) -> LineSegment {
    LineSegment { start, end, width_px: 1.0, significance: 1.0 }
}

/// An edge that runs 3 px beside its match, which the match points do not know of.
#[test]
fn matched_lines_are_drawn_onto_each_other() {
    let options = LineAlignmentOptions::default();
    let (in_a, in_b) = (segment([200.0, 30.0], [200.0, 210.0]), segment([103.0, 30.0], [103.0, 210.0]));
    let matched = [PairLines { a: 0, b: 1, lines: vec![[in_a, in_b]] }];
    let input = LineAlignmentInput { matched: &matched, points: &[], options: &options };
    let apart = |meshes: &[GridMesh]| {
        (meshes[0].warp(Vector2::new(200.0, 120.0)) - meshes[1].warp(Vector2::new(103.0, 120.0))).x.abs()
    };
    let before = apart(&refined(&Refinements::default()).meshes);
    let after = apart(&refined(&Refinements { lines: Some(input), ..Refinements::default() }).meshes);
    assert!((before - 3.0).abs() < 0.2 && after < 0.6, "{before} px became {after} px");
}

/// A thing before the scene, 80 px wide, lies 12 px beside it; most matches meet where the match points have them.
#[test]
fn what_lies_elsewhere_in_depth_meets_where_it_lies() {
    let options = LineAlignmentOptions::default();
    let lattice = |k: usize| Vector2::new(110.0 + (k % 20) as f64 * 10.0, 10.0 + (k / 20) as f64 * 11.0);
    let is_near = |place: &Vector2<f64>| (160.0..=240.0).contains(&place.x) && (80.0..=160.0).contains(&place.y);
    let at = |place: Vector2<f64>, aside: f64| PointMatch {
        in_a: place.into(),
        in_b: (place + Vector2::new(aside - SHIFT, 0.0)).into(),
    };
    let (near, far): (Vec<_>, Vec<_>) = (0..400).map(lattice).partition(is_near);
    let inliers = far.iter().map(|&place| at(place, 0.0)).collect();
    let alone = [joined(0, 1, inliers)];
    let elsewhere = near.iter().map(|&place| at(place, 12.0)).collect();
    let with = [PairMatches { elsewhere, ..alone[0].clone() }];
    let apart = |points: &[PairMatches]| {
        let lines = Some(LineAlignmentInput { matched: &[], points, options: &options });
        let warped = refined(&Refinements { lines, outline_weight: 7.0, ..Refinements::default() });
        let squares = |places: &[Vector2<f64>], aside: f64| {
            let gap = |&place: &Vector2<f64>| {
                let there = place + Vector2::new(aside - SHIFT, 0.0);
                (warped.meshes[0].warp(place) - warped.meshes[1].warp(there)).norm_squared()
            };
            (places.iter().map(gap).sum::<f64>() / places.len() as f64).sqrt()
        };
        assert_eq!(warped.folds, 0);
        [squares(&near, 12.0), squares(&far, 0.0)]
    };
    let ([before, still], [after, moved]) = (apart(&alone), apart(&with));
    assert!((before - 12.0).abs() < 0.5 && still < 0.1, "{before} and {still} px");
    // Around it cells of 40 px go over from one to the other: a third of the 12 px at most, over all that is behind.
    assert!(after < 1.0 && moved < 4.0, "{after} and {moved} px");
}

/// Match points with a bump bend a line that crosses it; straightness and structure each pull it straight again.
#[test]
fn a_bent_line_is_pulled_straight() {
    let (grids, mut warps) = shifted();
    for warp in &mut warps {
        let sign = if warp.from == 0 { 1.0 } else { -1.0 };
        for (vertex, place) in warp.vertices.iter_mut().enumerate() {
            let y = grids[0].source(vertex).y;
            if let Some(place) = place {
                place[0] += sign * 6.0 * (-((y - 120.0) / 40.0).powi(2)).exp();
            }
        }
    }
    let lines = vec![vec![segment([200.0, 10.0], [200.0, 230.0])], Vec::new()];
    let pinhole = Camera::new(300.0, 320.0, 240.0, &Matrix3::identity());
    let bend = |structure: Option<StructureInput>, refinements: &Refinements| {
        let bases = bases();
        let warped = solved(&MeshInput { structure, ..input(&grids, &warps, &bases) }, refinements);
        let mesh = &warped.expect("solvable").meshes[0];
        crate::metrics::Straightness::of(&lines[0][0], &pinhole, mesh, 3.0).expect("a line").rms_px
    };
    let plain = bend(None, &Refinements::default());
    let structure = StructureOptions { weight: 100.0 };
    let structure = Some(StructureInput { chains: &lines, options: &structure });
    let strict = LineAlignmentOptions { straightness: 100.0, ..LineAlignmentOptions::default() };
    let straight = Some(StraightInput { lines: &lines, options: &strict });
    let no_matches: &[PairMatches] = &[];
    let strict = Some(LineAlignmentInput { matched: &[], points: no_matches, options: &strict });
    assert!(plain > 0.3, "{plain}");
    let kept = bend(structure, &Refinements::default());
    let straightened = bend(None, &Refinements { lines: strict, straight, ..Refinements::default() });
    assert!(kept < 0.25 * plain, "structure: {plain} px became {kept} px");
    assert!(straightened < 0.25 * plain, "straightness: {plain} px became {straightened} px");
}

#[test]
fn lists_must_have_an_entry_per_photograph() {
    let (grids, warps) = shifted();
    let (pyramids, options) = (pyramids(), PhotometricOptions::default());
    let photometric = Some(PhotometricInput { pyramids: &pyramids[..1], options: &options });
    let refinements = Refinements { photometric, ..Refinements::default() };
    let bases = bases();
    let whole = input(&grids, &warps, &bases);
    let (chains, structure) = (vec![Vec::new(); 3], StructureOptions::default());
    let structure = Some(StructureInput { chains: &chains, options: &structure });
    let errors = [
        (solved(&whole, &refinements), "1 are given for 2 photographs"),
        (solved(&MeshInput { structure, ..whole }, &Refinements::default()), "3 are given for 2 photographs"),
    ];
    for (error, expected) in errors {
        assert!(error.expect_err("of another number").to_string().contains(expected));
    }
}

/// The gradient of the matched-line term against differences of its energy, written down anew: a line of the first
/// photograph and one of the second, which is turned and shifted, normals and feet kept as they are.
#[test]
fn the_matched_lines_equations_are_the_gradient_of_their_energy() {
    const ANGLE: f64 = 0.1;
    const STEP: f64 = 1e-3;
    let options = LineAlignmentOptions { weight: 7.0, ..LineAlignmentOptions::default() };
    let (in_a, in_b) = (segment([200.0, 40.0], [196.0, 170.0]), segment([103.0, 10.0], [103.0, 230.0]));
    let along = Vector2::new(-ANGLE.sin(), ANGLE.cos());
    let (normal, shift) = (Vector2::new(along.y, -along.x), Vector2::new(99.0, -8.0));
    let turned = |p: Vector2<f64>| Vector2::new(along.y * p.x + along.x * p.y, -along.x * p.x + along.y * p.y) + shift;
    let grids = vec![GridMesh::regular(WIDTH as f64, HEIGHT as f64, 40.0); 2];
    let mut meshes = grids.clone();
    meshes[1].target = (0..grids[1].len()).map(|vertex| turned(grids[1].source(vertex)).into()).collect();

    // 130 px in steps of 20 px, rounded down: samples at 0, 1/6 ... 1.
    let samples: Vec<[Vector2<f64>; 2]> = (0..=6)
        .map(|k| f64::from(k) / 6.0)
        .map(|share| {
            let p = Vector2::new(200.0 - 4.0 * share, 40.0 + 130.0 * share);
            let start = turned(Vector2::new(103.0, 0.0));
            [p, Vector2::new(103.0, along.dot(&(p - start)))]
        })
        .collect();
    let distance =
        |meshes: &[GridMesh], [p, q]: [Vector2<f64>; 2]| normal.dot(&(meshes[0].warp(p) - meshes[1].warp(q)));
    let weights: Vec<f64> =
        samples.iter().map(|&sample| 7.0 / (1.0 + (distance(&meshes, sample) / 2.0).powi(2))).collect();
    let energy = |meshes: &[GridMesh]| -> f64 {
        samples.iter().zip(&weights).map(|(&sample, weight)| weight * distance(meshes, sample).powi(2)).sum()
    };

    let matched = [PairLines { a: 0, b: 1, lines: vec![[in_a, in_b]] }];
    let input = LineAlignmentInput { matched: &matched, points: &[], options: &options };
    let places: Vec<Vec<Vector2<f64>>> = bases().iter().zip(&grids).map(|(base, grid)| base.places(grid)).collect();
    let current = current_grids::CurrentGrids { solved: &meshes, fine: &meshes, places: &places };
    let mut equations = normal_equations::NormalEquations::new(&grids);
    // Every vertex needs a block of its own; the energy below has the same part.
    for photograph in 0..2 {
        for vertex in 0..grids[0].len() {
            equations.add_inside(photograph, &[(vertex, Vector2::new(1.0, 0.0))], Vector2::zeros());
        }
    }
    let cells = input.cells(&current, &input.whole_shares(), 2.0);
    cells.iter().for_each(|cells| equations.add_cell_pairs(cells));
    let x: Vec<f64> = meshes.iter().flat_map(|mesh| mesh.target.iter().flatten().copied()).collect();
    let mut gradient: Vec<f64> = equations.right.iter().zip(&x).map(|(right, x)| -2.0 * (right + x)).collect();
    for (row, column, block) in equations.blocks() {
        for (k, value) in block.into_iter().enumerate() {
            let [row_unknown, column_unknown] = [2 * row as usize + k / 2, 2 * column as usize + k % 2];
            gradient[row_unknown] += 2.0 * value * x[column_unknown];
            if row != column {
                gradient[column_unknown] += 2.0 * value * x[row_unknown];
            }
        }
    }
    let mut largest: f64 = 0.0;
    for (unknown, gradient) in gradient.iter().enumerate() {
        let (photograph, vertex) = (unknown / (2 * grids[0].len()), unknown / 2 % grids[0].len());
        let moved = |by: f64| {
            let mut moved = meshes.clone();
            moved[photograph].target[vertex][unknown % 2] += by;
            energy(&moved)
        };
        let expected = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        assert!((gradient - expected).abs() < 1e-5, "unknown {unknown}: {gradient} instead of {expected}");
        largest = largest.max(expected.abs());
    }
    assert!(largest > 1.0, "the energy hardly depends on the vertices: {largest}");
}

/// Two photographs that already meet stay as they are, however noisy their pixels.
#[test]
fn noise_moves_nothing_where_photographs_already_meet() {
    let (grids, warps) = shifted();
    let noisy = |first_x: f64, salt: usize| {
        let mut gray = Raster::new(WIDTH, HEIGHT, 1);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let place = Vector2::new(x as f64 + 0.5 + first_x, y as f64 + 0.5);
                let mixed = ((x * 7919 + y * 104_729 + salt) as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                let noise = ((mixed ^ (mixed >> 32)) % 61) as f64 - 30.0;
                gray.pixel_mut(x, y)[0] = (scene(place) + noise).clamp(0.0, 255.0) as u8;
            }
        }
        gray
    };
    let pyramids: Vec<GrayPyramid> = [noisy(0.0, 0), noisy(SHIFT, 77_777)].iter().map(GrayPyramid::new).collect();
    let options = PhotometricOptions::default();
    let photometric = PhotometricInput { pyramids: &pyramids, options: &options };
    let apart = |meshes: &[GridMesh]| {
        let points = (0..100).map(|k| Vector2::new(120.0 + f64::from(k % 10) * 18.0, 20.0 + f64::from(k / 10) * 20.0));
        let square: f64 =
            points.map(|p| (meshes[0].warp(p) - meshes[1].warp(p - Vector2::new(SHIFT, 0.0))).norm_squared()).sum();
        (square / 100.0).sqrt()
    };
    let tested =
        refined(&Refinements { photometric: Some(photometric), outline_weight: 1.0, ..Refinements::default() });
    let (tested, believed) = (apart(&tested.meshes), apart(&aligned_believing_all(&grids, &warps, &photometric)));
    assert!(tested < 0.1 && tested < 0.3 * believed, "{tested} px, {believed} px if all of it is believed");
}

/// The plain mesh, its outlines held with weight 1, aligned by pixels of which all that they say is believed.
fn aligned_believing_all(grids: &[GridMesh], warps: &[OverlapWarp], input: &PhotometricInput) -> Vec<GridMesh> {
    let bases = bases();
    let places: Vec<Vec<Vector2<f64>>> = bases.iter().zip(grids).map(|(base, grid)| base.places(grid)).collect();
    let alignment = AlignmentEnergy::new(grids, warps, &bases, &places);
    let (options, context) = (MeshOptions::default(), StageContext::default());
    let mesh_input = self::input(grids, warps, &bases);
    let layout = Layout::new(&mesh_input, places, alignment, &[], &options);
    let problem = layout.problem(&mesh_input, &options, &context);
    let (mut solver, mut equations) = (solver::MeshSolver::default(), problem.equations());
    let plain = problem.solve(&mut solver, equations.clone()).expect("solvable");
    problem.hold_outlines(&mut equations, &plain.meshes, 1.0);
    let whole = rounds::PixelAlignment { input, shares: &[1.0], straight: None };
    let aligned = problem.align_pixels(&mut solver, &equations, &whole, plain).expect("solvable");
    problem.delivered(&aligned.meshes)
}
