//! Turns and lenses against exactly known ones.

use trueup_core::StageContext;
use trueup_core::geometry::{rotation_about_x, rotation_about_y, rotation_about_z};
use trueup_core::lens::{LensProjection, LensTerms, PlacedLens};

use super::*;

const NOTHING: ToldLens = ToldLens { lens: None, projection: None, focal_px: None };

/// Matches of two photographs of a lens, `right` of them right within half a pixel, the others anywhere.
fn matches(camera: &Camera, turn: &Matrix3<f64>, right: usize, wrong: usize) -> MatchedPoints {
    let mut generator = StageContext::default().generator("turned test", 0);
    let mut b = *camera;
    b.set_rotation(turn);
    let mut points = MatchedPoints::default();
    while points.in_a.len() < right + wrong {
        let mut anywhere = || Vector2::new(800.0 * generator.random::<f64>(), 600.0 * generator.random::<f64>());
        let (source, other) = (anywhere(), anywhere());
        let seen =
            camera.transfer(&b, source).filter(|at| (0.0..800.0).contains(&at.x) && (0.0..600.0).contains(&at.y));
        if points.in_a.len() % (right + wrong) < wrong {
            points.in_a.push(source);
            points.in_b.push(other);
        } else if let Some(seen) = seen {
            points.in_a.push(source);
            points.in_b.push(seen + (other - Vector2::new(400.0, 300.0)) / 1000.0);
        }
    }
    points
}

fn camera(projection: LensProjection, focal_px: f64, k1: f64) -> Camera {
    let lens = Lens::new(LensTerms { projection, radial: [k1, 0.0, 0.0, 0.0], tangential: [0.0; 2] });
    Camera { lens, ..Camera::new(focal_px, 800.0, 600.0, &Matrix3::identity()) }
}

#[test]
fn turns_are_found_under_every_lens_among_wrong_matches() {
    let turn = rotation_about_z(0.1) * rotation_about_y(-0.6) * rotation_about_x(0.05);
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let lenses = [
        (LensProjection::Rectilinear, 620.0, 0.0),
        (LensProjection::Rectilinear, 380.0, -0.2),
        (LensProjection::Equidistant, 300.0, -0.02),
    ];
    for (projection, focal_px, k1) in lenses {
        let truth = camera(projection, focal_px, k1);
        let points = matches(&truth, &turn, 150, 150);
        let mut generator = StageContext::default().generator("turned test", 1);
        let found = find_turned_lens(&points, [&frame; 2], [&NOTHING; 2], 5.0, 100, &mut generator).expect("found");
        // Wrong matches come first; a few of them agree by chance.
        let right = found.inliers.iter().filter(|&&k| k >= 150).count();
        assert!(right >= 147, "{right} of 150 under {truth:?}");
        assert!(found.inliers.len() - right < 8, "{}", found.inliers.len() - right);
        let error = found.turned.b.rotation() * turn.transpose();
        assert!(error.trace() > 1.0 + 2.0 * 0.5_f64.to_radians().cos(), "{error}");
    }
}

/// Through a lens of 380 px at 800 x 600 px, of which the second photograph has a copy of five eighths, cut to 500 x
/// 350 px.
#[test]
fn photographs_of_different_sizes_have_a_common_lens() {
    let turn = rotation_about_z(0.1) * rotation_about_y(-0.6);
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let reduced = WorkingFrame { width: 500.0, height: 350.0, working_from_full: 1.0 };
    let mut points = matches(&camera(LensProjection::Rectilinear, 380.0, -0.2), &turn, 200, 100);
    for place in &mut points.in_b {
        *place = (*place - Vector2::new(400.0, 300.0)) * 0.625 + Vector2::new(250.0, 175.0);
    }
    let kept: Vec<usize> = (0..300).filter(|&k| (0.0..350.0).contains(&points.in_b[k].y)).collect();
    let right = kept.iter().filter(|&&k| k >= 100).count();
    let points = points.select(&kept);
    let mut generator = StageContext::default().generator("turned test", 1);
    let found = find_turned_lens(&points, [&frame, &reduced], [&NOTHING; 2], 5.0, 100, &mut generator).expect("found");
    assert!(right > 150 && found.inliers.len() + 4 > right, "{} of {right}", found.inliers.len());
    let TurnedLens { a, b } = found.turned;
    assert!((b.focal_px / a.focal_px - 0.625).abs() < 1e-9, "{} {}", a.focal_px, b.focal_px);
    assert!((b.rotation() * turn.transpose()).trace() > 1.0 + 2.0 * 0.5_f64.to_radians().cos());
}

#[test]
fn no_matches_have_no_lens() {
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let mut generator = StageContext::default().generator("turned test", 1);
    assert!(find_turned_lens(&MatchedPoints::default(), [&frame; 2], [&NOTHING; 2], 5.0, 0, &mut generator).is_none());
}

/// What agrees with a turn only by chance is not refined, however little is wanted of it beside.
#[test]
fn matches_without_a_common_turn_have_no_lens() {
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let truth = camera(LensProjection::Rectilinear, 600.0, 0.0);
    let turn = rotation_about_y(0.3);
    let found = |right: usize, wrong: usize, wanted: usize| {
        let mut generator = StageContext::default().generator("turned test", 1);
        find_turned_lens(&matches(&truth, &turn, right, wrong), [&frame; 2], [&NOTHING; 2], 5.0, wanted, &mut generator)
    };
    assert!(found(0, 120, 30).is_none());
    // As many as are wanted, no more.
    assert!(found(40, 80, 40).is_some_and(|turn| (40..48).contains(&turn.inliers.len())));
    assert!(found(40, 80, 60).is_none());
}

/// Among nine wrong matches to one right one, which are too few for a list of lenses.
#[test]
fn a_told_lens_is_kept_and_needs_fewer_matches() {
    let terms = LensTerms { radial: [-0.2, 0.05, 0.0, 0.0], tangential: [1e-3, -2e-3], ..LensTerms::default() };
    let told = ToldLens {
        lens: Some(PlacedLens { terms, center_px: [9.0, -5.0] }),
        focal_px: Some(380.0 * 1.01),
        ..ToldLens::default()
    };
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let truth = Camera {
        lens: Lens::new(terms),
        principal_point: [409.0, 295.0],
        ..Camera::new(380.0, 800.0, 600.0, &Matrix3::identity())
    };
    let turn = rotation_about_z(0.1) * rotation_about_y(-0.6);
    let points = matches(&truth, &turn, 40, 360);
    let found = |told: &ToldLens| {
        let mut generator = StageContext::default().generator("turned test", 1);
        find_turned_lens(&points, [&frame; 2], [told; 2], 5.0, 40, &mut generator)
    };
    let turned = found(&told).expect("found").turned;
    assert_eq!((turned.a.lens.terms(), turned.b.principal_point), (terms, [409.0, 295.0]));
    assert!((turned.a.focal_px / 380.0 - 1.0).abs() < 0.01 && turned.a.focal_px == turned.b.focal_px);
    assert!((turned.b.rotation() * turn.transpose()).trace() > 1.0 + 2.0 * 0.3_f64.to_radians().cos());
}

/// The second photograph is through a lens of 380 px of which nothing is told, the first through a pinhole of 620.
#[test]
fn a_told_lens_beside_another_stays_as_it_is() {
    let frame = WorkingFrame { width: 800.0, height: 600.0, working_from_full: 1.0 };
    let told = ToldLens { lens: Some(PlacedLens::default()), focal_px: Some(620.0), ..ToldLens::default() };
    let (turn, mut points) = (rotation_about_y(-0.4), MatchedPoints::default());
    let (a, mut b) =
        (camera(LensProjection::Rectilinear, 620.0, 0.0), camera(LensProjection::Rectilinear, 380.0, -0.2));
    b.set_rotation(&turn);
    for k in 0..400 {
        let place = Vector2::new(f64::from(k % 20) * 40.0 + 20.0, f64::from(k / 20) * 30.0 + 15.0);
        if let Some(seen) =
            a.transfer(&b, place).filter(|at| (0.0..800.0).contains(&at.x) && (0.0..600.0).contains(&at.y))
        {
            points.in_a.push(place);
            points.in_b.push(seen);
        }
    }
    let mut generator = StageContext::default().generator("turned test", 1);
    let found = find_turned_lens(&points, [&frame; 2], [&told, &NOTHING], 5.0, 100, &mut generator).expect("found");
    let TurnedLens { a: first, b: second } = found.turned;
    assert_eq!((first.focal_px, first.lens.is_pinhole()), (620.0, true));
    assert!((second.focal_px / 380.0 - 1.0).abs() < 0.02, "{}", second.focal_px);
    assert!((second.lens.terms().radial[0] + 0.2).abs() < 0.03, "{:?}", second.lens.terms());
    assert_eq!(found.inliers.len(), points.in_a.len());
}
