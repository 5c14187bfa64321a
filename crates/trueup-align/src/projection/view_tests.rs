//! Views chosen for rows, turns, facades, columns and ceilings.

use nalgebra::Vector3;

use trueup_core::camera::Camera;
use trueup_core::geometry::rotation_about_y;
use trueup_core::mesh::GridMesh;

use super::coverage::tests::photograph;
use super::fitted::Fit;
use super::flat::{Flat, FlatKind};
use super::options::{Projection, ProjectionOptions};
use super::photograph::PosedPhotograph;
use super::view::ProjectionView;

fn row(count: u32, pitch_deg: f64) -> Vec<PosedPhotograph> {
    (0..count).map(|k| photograph(30.0 * (f64::from(k) - 0.5 * f64::from(count - 1)), pitch_deg)).collect()
}

fn view(photographs: &[PosedPhotograph]) -> ProjectionView {
    ProjectionView::choose(photographs, None, &ProjectionOptions::default())
}

#[test]
fn the_angle_of_view_chooses() {
    let flat = |photographs: &[PosedPhotograph]| view(photographs).flat;
    assert_eq!(flat(&row(2, 0.0)).kind, FlatKind::Perspective);
    let wide = flat(&row(4, 0.0));
    assert!(wide.kind == FlatKind::Panini && (0.2..0.9).contains(&wide.panini_distance), "{wide:?}");
    let wider = flat(&row(6, 0.0));
    assert!(wider.kind == FlatKind::Fitted && wider.fit.round > 1.0 && wider.fit.upright == 1.0, "{wider:?}");
    assert_eq!(flat(&row(12, 0.0)).kind, FlatKind::Equirectangular);
    let high = flat(&[row(4, 0.0), row(4, 35.0)].concat()).fit;
    assert!(high.upright < 1.0 && !high.turned, "{high:?}");
}

/// The member of the family that a fitted projection is, or the plane's and Panini's.
fn member(flat: &Flat) -> Fit {
    match flat.kind {
        FlatKind::Panini => Fit { round: flat.panini_distance, ..Fit::default() },
        _ => flat.fit,
    }
}

/// The projection changes as the angle of view does, by no more than a sixth of the family for ten degrees, from
/// perspective to all but the full turn, and never back.
#[test]
fn one_more_photograph_does_not_flip_the_view() {
    let fit = |span: u32| {
        let last = f64::from(span);
        let yaws = (0..=5).map(|k| last * (f64::from(k) / 5.0 - 0.5));
        let flat = view(&yaws.map(|yaw| photograph(yaw, 0.0)).collect::<Vec<_>>()).flat;
        assert!(!flat.kind.turns(), "{span}: {flat:?}");
        member(&flat)
    };
    let mut before = fit(10);
    assert_eq!(before.round, 0.0);
    for span in (20..=290).step_by(10) {
        let now = fit(span);
        let step = now.round - before.round;
        assert!((-0.02..0.33).contains(&step), "at {span} degrees from {before:?} to {now:?}");
        assert!((now.upright - before.upright).abs() < 0.25, "at {span} degrees from {before:?} to {now:?}");
        before = now;
    }
    assert!(before.round > 1.8 && before.upright < 0.2, "{before:?}");
}

/// Up a tower, held upright: the highest of four photographs is turned aside by 6 degrees, and its corners alone are
/// the ends of what is covered.
#[test]
fn a_column_is_looked_at_where_its_photographs_look() {
    let held_upright = |(yaw, pitch)| PosedPhotograph {
        camera: Camera::new(700.0, 600.0, 800.0, &photograph(yaw, pitch).camera.rotation()),
        mesh: GridMesh::regular(600.0, 800.0, 20.0),
    };
    let column: Vec<PosedPhotograph> = [(0.0, 0.0), (0.0, 20.0), (0.0, 40.0), (6.0, 58.0)].map(held_upright).to_vec();
    let view = view(&column);
    // The cosines of the pitches weigh the photographs' directions.
    assert!(view.flat.fit.turned && (view.yaw.to_degrees() - 0.982).abs() < 0.01, "{view:?}");
}

/// A strip from straight ahead to the ceiling is one more photograph of a column: horizontals are straight in it.
#[test]
fn a_column_is_a_row_on_its_side() {
    let column: Vec<PosedPhotograph> = (0..5).map(|k| photograph(0.0, 30.0 * f64::from(k) - 30.0)).collect();
    let column = view(&column);
    assert!(column.flat.fit.turned && (column.pitch.to_degrees() - 30.0).abs() < 3.0, "{column:?}");
    let row = member(&view(&row(5, 0.0)).flat);
    assert!((column.flat.fit.round - row.round).abs() < 0.3, "{column:?} {row:?}");
}

/// Within the field of view that is asked for, the view is that of photographs that show no more.
#[test]
fn a_field_of_view_is_fitted_to() {
    let options = ProjectionOptions { fov: 60.0, ..ProjectionOptions::default() };
    let narrow = ProjectionView::choose(&row(12, 0.0), None, &options);
    assert_eq!(narrow.flat.kind, FlatKind::Perspective);
    let [low, high] = narrow.window(0.0);
    assert!((high.x - 30_f64.to_radians().tan()).abs() < 1e-9 && low.x == -high.x, "{low} {high}");
}

/// Facades at 20 and 110 degrees: a narrow panorama faces the nearer one, a wide plane keeps to its middle, since
/// its far side would be cut.
#[test]
fn the_viewer_faces_the_nearest_facade() {
    let dominant = rotation_about_y(20_f64.to_radians());
    let faced = |photographs: &[PosedPhotograph], kind: Projection| {
        let options = ProjectionOptions { kind, ..ProjectionOptions::default() };
        ProjectionView::choose(photographs, Some(&dominant), &options).yaw.to_degrees()
    };
    assert!((faced(&row(1, 0.0), Projection::Perspective) - 20.0).abs() < 1e-6);
    assert!((faced(&row(1, 0.0), Projection::Auto) - 20.0).abs() < 0.5);
    assert!(faced(&row(3, 0.0), Projection::Auto).abs() < 0.5);
    assert!(faced(&row(3, 0.0), Projection::Perspective).abs() < 0.5);
    assert!(faced(&row(3, 0.0), Projection::Cylindrical).abs() < 0.5);
    assert!((faced(&row(12, 0.0), Projection::Equirectangular) - 20.0).abs() < 1e-6);
    assert!(ProjectionView::choose(&row(1, 0.0), None, &ProjectionOptions::default()).yaw.abs() < 0.01);
}

/// Yaw turns right, pitch up, roll clockwise: the direction to the right, above, and at the viewer's right hand.
#[test]
fn the_viewer_turns_as_asked() {
    let options = |yaw: f64, pitch: f64, roll: f64| ProjectionOptions {
        kind: Projection::Perspective,
        yaw,
        pitch,
        roll,
        ..ProjectionOptions::default()
    };
    let seen = |options: ProjectionOptions, direction: Vector3<f64>| {
        ProjectionView::choose(&row(1, 0.0), None, &options).view_from_level() * direction
    };
    let right = Vector3::new(0.5, 0.0, 0.75_f64.sqrt());
    assert!((seen(options(30.0, 0.0, 0.0), right) - Vector3::z()).norm() < 1e-2);
    let above = Vector3::new(0.0, -0.5, 0.75_f64.sqrt());
    assert!((seen(options(0.0, 30.0, 0.0), above) - Vector3::z()).norm() < 1e-2);
    // Rolled clockwise by a quarter, the viewer's right hand points down.
    assert!((seen(options(0.0, 0.0, 90.0), Vector3::y()) - Vector3::x()).norm() < 1e-2);
}

#[test]
fn photographs_of_a_ceiling_are_looked_up_at() {
    let options = ProjectionOptions { kind: Projection::Perspective, ..ProjectionOptions::default() };
    let view = ProjectionView::choose(&[photograph(0.0, 80.0), photograph(10.0, 80.0)], None, &options);
    assert!((view.pitch.to_degrees() - 80.0).abs() < 0.5, "{view:?}");
    assert!(ProjectionView::choose(&row(2, 30.0), None, &options).pitch == 0.0);
}

/// Looked at, a wide row that looks up is a fan: it is drawn level as a whole turn of it is. Near the zenith nothing
/// can be.
#[test]
fn a_wide_row_that_looks_up_is_drawn_level() {
    let pitch = |count: u32, pitch_deg: f64| view(&row(count, pitch_deg)).pitch.to_degrees();
    // Two and three photographs show a ceiling, or a tower's top.
    assert!(pitch(2, 45.0) > 30.0 && pitch(3, 45.0) > 25.0, "{} {}", pitch(2, 45.0), pitch(3, 45.0));
    assert!(pitch(6, 45.0) == 0.0 && pitch(6, -45.0) == 0.0 && pitch(10, 45.0) == 0.0);
    assert!(pitch(6, 65.0) > 60.0, "{}", pitch(6, 65.0));
    // Not at once: one more photograph changes it by less than half.
    let between = [3, 4, 5, 6].map(|count| pitch(count, 45.0));
    assert!(between.is_sorted_by(|wider, narrower| wider >= narrower), "{between:?}");
}

/// A facade 6 degrees aside is faced by photographs that are drawn level, and less and less the more they are looked
/// at.
#[test]
fn the_viewer_turns_aside_as_the_pitch_does() {
    let dominant = rotation_about_y(6_f64.to_radians());
    let looking = |pitch_deg: f64| {
        let options = ProjectionOptions::default();
        let view = ProjectionView::choose(&[photograph(0.0, pitch_deg)], Some(&dominant), &options);
        [view.yaw.to_degrees(), view.pitch.to_degrees()]
    };
    let steps: Vec<[f64; 2]> = (30..=55).map(|pitch| looking(f64::from(pitch))).collect();
    let apart = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).abs();
    let farthest = steps.windows(2).map(apart).fold(0.0, f64::max);
    assert!(steps[0][0] > 2.0 && steps[25][0].abs() < 0.5 && farthest < 1.5, "{steps:?}");
}

/// Rings at 20, 50 and 75 degrees down, and straight down, as drones take them: a sphere. Without the first, what is
/// below.
#[test]
fn a_drone_looks_round_and_down() {
    let ring = |count: u32, pitch_deg: f64| (0..count).map(move |k| photograph(f64::from(360 * k / count), pitch_deg));
    let steep: Vec<PosedPhotograph> = ring(8, -50.0).chain(ring(5, -75.0)).chain(ring(1, -90.0)).collect();
    let all: Vec<PosedPhotograph> = ring(8, -20.0).chain(steep.iter().cloned()).collect();
    let around = view(&all);
    assert!(around.flat.kind == FlatKind::Equirectangular && around.closed && around.pitch == 0.0, "{around:?}");
    let below = view(&steep);
    assert!(!below.closed && below.pitch.to_degrees() < -80.0, "{below:?}");
}
