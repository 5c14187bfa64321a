//! Pictures with padding, and others.

use proptest::prelude::*;

use super::*;

const SIZE: [usize; 2] = [400, 300];

/// A scene that is nowhere even, where `is_photograph`, and `level` with a little noise elsewhere.
fn picture(level: f32, is_photograph: impl Fn(f64, f64) -> bool) -> Raster<f32> {
    let [width, height] = SIZE;
    let sample = |index: usize| {
        let (x, y) = (index % width, index / width);
        match is_photograph(x as f64 + 0.5, y as f64 + 0.5) {
            true => 60.0 + ((x * 7 + y * 13) % 97) as f32,
            false => level + ((x * 31 + y * 17) % 5) as f32,
        }
    };
    Raster::from_data(width, height, 1, (0..width * height).map(sample).collect()).expect("as many samples")
}

/// Whether (x, y) lies in a rectangle around the middle, turned clockwise by an angle in degrees.
fn in_turned(degrees: f64, [half_width, half_height]: [f64; 2]) -> impl Fn(f64, f64) -> bool {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    move |x, y| {
        let (x, y) = (x - 200.0, y - 150.0);
        (x * cosine + y * sine).abs() <= half_width && (y * cosine - x * sine).abs() <= half_height
    }
}

/// Samples that the outline takes wrongly for the photograph, and that it takes from it.
fn wrong(outline: &Outline, is_photograph: impl Fn(f64, f64) -> bool) -> [usize; 2] {
    let beside = outline.beside(SIZE);
    let mut wrong = [0; 2];
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        match (is_photograph(x as f64 + 0.5, y as f64 + 0.5), beside.is_marked(x, y)) {
            (false, false) => wrong[0] += 1,
            (true, true) => wrong[1] += 1,
            _ => {}
        }
    }
    wrong
}

proptest! {
    /// Turned in a picture of its own size, as an editor turns it, or on paper, as it was laid on the scanner: nothing
    /// of what is beside it is kept but slivers, and of the photograph no more than the margin is lost, of some 1400 px
    /// of sides.
    #[test]
    fn what_was_turned_is_found(degrees in 1.5..9.0_f64, clockwise: bool, on_paper: bool, white: bool) {
        let degrees = if clockwise { degrees } else { -degrees };
        let half = if on_paper { [170.0, 120.0] } else { [200.0, 150.0] };
        let is_photograph = in_turned(degrees, half);
        let padding = padding(&picture(if white { 250.0 } else { 0.0 }, &is_photograph));
        let outline = padding.quadrilateral(SIZE);
        prop_assert!(outline.as_ref().is_some_and(|found| found.is_askew));
        let [kept, lost] = wrong(&outline.expect("checked").outline, &is_photograph);
        prop_assert!(kept <= 40 && lost <= 4 * 1400, "{kept} {lost}");
    }
}

#[test]
fn what_lies_straight_is_not_askew() {
    let found = padding(&picture(250.0, in_turned(0.0, [170.0, 120.0]))).quadrilateral(SIZE);
    assert!(found.is_some_and(|found| !found.is_askew));
}

/// A photograph whose lens bent it, made straight: its sides bow inward, and its corners reach the picture's.
fn straightened(x: f64, y: f64) -> bool {
    let (x, y) = ((x - 200.0) / 200.0, (y - 150.0) / 150.0);
    x.abs() <= 0.9 + 0.1 * y * y && y.abs() <= 0.88 + 0.12 * x * x
}

#[test]
fn what_a_lens_leaves_is_common_to_all_pictures() {
    let whole = padding(&picture(0.0, straightened));
    // In one, night comes down beside the padding; in another it is told anyway by all others.
    let night = padding(&picture(0.0, |x, y| straightened(x, y) && (x > 150.0 || y > 90.0)));
    let common = CommonPadding::of(&[&whole, &night, &whole, &whole], SIZE).expect("four of one lens");
    let [kept, lost] = wrong(&common.outline, straightened);
    assert!(kept <= 40 && lost <= 4 * 1400, "{kept} {lost}");
    assert!(common.outline.corners().len() < 120, "{}", common.outline.corners().len());
    assert!(common.suits(&night) && !common.suits(&Padding::default()));
    assert_eq!(whole.quadrilateral(SIZE), None, "not straight");
    assert_eq!(CommonPadding::of(&[&whole], SIZE), None, "one alone");
    let none = Padding::default();
    assert_eq!(CommonPadding::of(&[&whole, &whole, &none, &none, &none], SIZE), None, "of few");
}

#[test]
fn what_belongs_to_the_scene_is_no_padding() {
    assert_eq!(padding(&Raster::new(0, 0, 1)), Padding::default());
    assert_eq!(padding(&Raster::new(1, 1, 1)), Padding::default());
    let black = padding(&picture(0.0, |_, _| false));
    assert_eq!((black.quadrilateral(SIZE), CommonPadding::of(&[&black, &black], SIZE)), (None, None), "a black night");
    let same = |what: &str, is_photograph: &dyn Fn(f64, f64) -> bool, level: f32| {
        let padding = padding(&picture(level, is_photograph));
        assert_eq!(padding.quadrilateral(SIZE), None, "{what}");
        assert_eq!(CommonPadding::of(&[&padding, &padding], SIZE), None, "{what}, twice");
    };
    same("a photograph alone", &|_, _| true, 0.0);
    same("a level sea under a blown sky", &|x, y| y > 90.0 + 0.02 * x, 250.0);
    same("towers before a blown sky", &|x, y| y > 140.0 || (x % 60.0 < 20.0 && y > 60.0), 250.0);
    same("the moon", &|x, y| (x - 200.0).hypot(y - 150.0) < 130.0, 0.0);
    // Two straight sides are not enough.
    let street = padding(&picture(2.0, |x, y| y > 60.0 + x / 20.0 && y < 230.0 - x / 24.0));
    assert_eq!(street.quadrilateral(SIZE), None, "a lit street in a night");
}
