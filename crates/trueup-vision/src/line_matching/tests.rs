//! A wall of planks of random brightness seen twice, the second time shifted, brighter and with less contrast.

use rand::RngExt;
use trueup_core::StageContext;

use super::*;

const WIDTH: usize = 400;
const HEIGHT: usize = 200;

/// Vertical planks from 5 to 14 px wide: their gray values and the edges between them. Every edge is a step, so that
/// most look alike but for the planks' brightness.
fn planks(shift: f64, gain: f64, bias: f64) -> (Raster<u8>, Vec<LineSegment>) {
    let mut generator = StageContext::default().generator("planks", 7);
    let mut edges = vec![(-100.0, 120.0)];
    while edges[edges.len() - 1].0 < 600.0 {
        let next = edges[edges.len() - 1].0 + generator.random_range(5.0..14.0);
        edges.push((next, generator.random_range(30.0..220.0)));
    }
    let mut gray = Raster::new(WIDTH, HEIGHT, 1);
    for y in 0..HEIGHT {
        for (x, value) in gray.row_mut(y).iter_mut().enumerate() {
            let at = x as f64 + 0.5 + shift;
            let plank = edges.iter().rfind(|(start, _)| *start <= at).expect("covered");
            *value = (gain * plank.1 + bias) as u8;
        }
    }
    let bottom = HEIGHT as f64 - 10.0;
    let lines = edges
        .windows(2)
        .map(|pair| (pair[1].0 - shift, pair[1].1 > pair[0].1))
        .filter(|&(x, _)| x > 0.0 && x < WIDTH as f64)
        .map(|(x, brighter_right)| {
            let (start, end) = ([x, 10.0], [x, bottom]);
            let (start, end) = if brighter_right { (end, start) } else { (start, end) };
            LineSegment { start, end, width_px: 1.0, significance: 1.0 }
        })
        .collect();
    (gray, lines)
}

/// Edges of the second photograph lie 60 px to the left of those of the first; the transfer is wrong by 4 px, which
/// brings many wrong edges as near as the right one.
#[test]
fn nearly_every_edge_finds_itself_and_hardly_any_another() {
    let (gray_a, lines_a) = planks(0.0, 1.0, 0.0);
    let (gray_b, lines_b) = planks(60.0, 0.7, 30.0);
    let carry = |point: Vector2<f64>| (point.x > 56.0).then(|| Vector2::new(point.x - 56.0, point.y));
    let a = PhotographWithLines { gray: &gray_a, lines: &lines_a };
    let b = PhotographWithLines { gray: &gray_b, lines: &lines_b };
    let matches = find(a, b, carry);
    let right = |one: &&LineMatch| (lines_a[one.in_a].start[0] - 60.0 - lines_b[one.in_b].start[0]).abs() < 1e-9;
    let correct = matches.iter().filter(right).count();
    let visible = lines_a.iter().filter(|line| line.start[0] > 75.0 && line.start[0] < 385.0).count();
    assert!(visible > 20, "{visible} edges to find");
    assert!(correct * 10 >= visible * 6, "{correct} of {visible} edges were found");
    assert!((matches.len() - correct) * 50 <= matches.len(), "{} wrong of {}", matches.len() - correct, matches.len());
}

#[test]
fn the_opposite_edge_is_no_match() {
    let (gray, lines) = planks(0.0, 1.0, 0.0);
    let turned: Vec<LineSegment> =
        lines.iter().map(|line| LineSegment { start: line.end, end: line.start, ..*line }).collect();
    let a = PhotographWithLines { gray: &gray, lines: &lines };
    let b = PhotographWithLines { gray: &gray, lines: &turned };
    assert!(find(a, b, Some).is_empty());
    assert!(!find(a, a, Some).is_empty());
}

#[test]
fn nothing_matches_without_an_overlap_or_contrast() {
    let (gray, lines) = planks(0.0, 1.0, 0.0);
    let a = PhotographWithLines { gray: &gray, lines: &lines };
    assert!(find(a, a, |_| None).is_empty());
    let flat = Raster::from_data(WIDTH, HEIGHT, 1, vec![99_u8; WIDTH * HEIGHT]).expect("fits");
    let b = PhotographWithLines { gray: &flat, lines: &lines };
    assert!(lines.len() > 20 && !find(a, a, Some).is_empty());
    assert!(find(a, b, Some).is_empty());
}
