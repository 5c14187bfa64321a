//! What lies beside a photograph's outline, as masks of a Hugin project.

use std::fmt::Write;

use trueup_core::side::Side;

use super::super::record::ImageRecord;

/// Pixels within which an outline's corner lies at the picture's border.
const AT_BORDER_PX: f64 = 0.5;
/// Least area of a mask, in pixels: what is smaller is rounding.
const LEAST_AREA_PX: f64 = 1.0;

/// The lines of the masks that exclude what lies beside the outline of photograph `number` of the project; none without
/// an outline.
///
/// # Source
/// Hugin's project files: `k`, the photograph (`i`), the type (`t0` excludes), and the corners of a polygon (`p`) in
/// pixels of the stored picture from its left upper corner.
pub(super) fn lines(number: usize, image: &ImageRecord) -> String {
    let Some(outline) = &image.outline else { return String::new() };
    let upright = image.inset.outer([image.width, image.height]).map(|length| length as f64);
    let [left, top] = [image.inset.left, image.inset.top].map(|length| length as f64);
    let stored = |[x, y]: &[f64; 2]| stored_place([x + left, y + top], upright, image.orientation);
    let corners: Vec<[f64; 2]> = outline.corners().iter().map(stored).collect();
    let size = if matches!(image.orientation, 6 | 8) { [upright[1], upright[0]] } else { upright };
    let mut lines = String::new();
    for mask in beside(corners, size) {
        let places: Vec<String> = mask.iter().map(|[x, y]| format!("{x:.2} {y:.2}")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "k i{number} t0 p\"{}\"", places.join(" "));
    }
    lines
}

/// Where a place of the upright picture, of `size` pixels, lies in the stored one, whose EXIF orientation mirrors
/// nothing.
fn stored_place([x, y]: [f64; 2], [width, height]: [f64; 2], orientation: u8) -> [f64; 2] {
    match orientation {
        6 => [y, width - x],
        3 => [width - x, height - y],
        8 => [height - y, x],
        _ => [x, y],
    }
}

/// How many pixels beyond a side of a picture a place lies; negative inside.
fn beyond(side: Side, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> f64 {
    match side {
        Side::Left => -x,
        Side::Top => -y,
        Side::Right => x - width,
        Side::Bottom => y - height,
    }
}

/// Whether a place lies at the border at a side, or beyond.
fn is_reached(side: Side, place: [f64; 2], size: [f64; 2]) -> bool {
    beyond(side, place, size) >= -AT_BORDER_PX
}

/// A place moved straight to the border at a side; one that lies beyond stays.
fn onto(side: Side, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> [f64; 2] {
    match side {
        Side::Left => [x.min(0.0), y],
        Side::Top => [x, y.min(0.0)],
        Side::Right => [x.max(width), y],
        Side::Bottom => [x, y.max(height)],
    }
}

/// Simple polygons that together are what of a picture of `size` pixels lies beside a simple polygon, one for each
/// corner of the picture where there is any: they are parted by the ways straight to the border from the polygon's
/// outermost corners at the four sides, which cross nothing.
fn beside(mut corners: Vec<[f64; 2]>, size: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
    let count = corners.len();
    if count == 0 {
        return Vec::new();
    }
    // Clockwise as it is shown, y down.
    if doubled_area(&corners) < 0.0 {
        corners.reverse();
    }
    let outermost = |side: Side| {
        let distance = |corner: usize| beyond(side, corners[corner], size);
        (0..count).max_by(|&one, &other| distance(one).total_cmp(&distance(other))).unwrap_or(0)
    };
    let between = |(side, next): (Side, Side)| {
        let (first, last) = (outermost(side), outermost(next));
        let steps = (last + count - first) % count;
        let chain: Vec<[f64; 2]> = (first..=first + steps).map(|corner| corners[corner % count]).collect();
        // Where the polygon follows the border, nothing lies between the two.
        let along = chain.iter().skip(1).take_while(|&&place| is_reached(side, place, size)).count();
        let along_next = chain.iter().rev().skip(1).take_while(|&&place| is_reached(next, place, size)).count();
        let mut mask = chain[along..(chain.len() - along_next).max(along + 1)].to_vec();
        let [start, end] = [mask[0], mask[mask.len() - 1]];
        let [from, to] = [onto(side, start, size), onto(next, end, size)];
        // The picture's corner, or one outside of a polygon that reaches beyond it.
        let corner = match side {
            Side::Left | Side::Right => [from[0], to[1]],
            Side::Top | Side::Bottom => [to[0], from[1]],
        };
        mask.extend([to, corner, from]);
        mask.dedup();
        mask.pop_if(|last| *last == start);
        mask
    };
    let sides = Side::ALL.into_iter().zip(Side::ALL.into_iter().cycle().skip(1));
    sides.map(between).filter(|mask| doubled_area(mask).abs() >= 2.0 * LEAST_AREA_PX).collect()
}

/// Twice the area of a polygon; negative of one whose corners go around it anticlockwise, y down.
fn doubled_area(corners: &[[f64; 2]]) -> f64 {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    edges.map(|([x, y], [next_x, next_y])| x * next_y - next_x * y).sum()
}

#[cfg(test)]
mod tests {
    use trueup_core::inset::Inset;
    use trueup_core::outline::Outline;

    use super::*;

    fn outlined(orientation: u8, inset: Inset, corners: &[[f64; 2]]) -> ImageRecord {
        ImageRecord {
            width: 100,
            height: 80,
            orientation,
            inset,
            outline: Outline::new(corners.to_vec()),
            ..ImageRecord::left_out("a.jpg".to_owned(), String::new(), String::new())
        }
    }

    /// A print that was turned clockwise: a triangle at each corner of the picture, and what lies between it and the
    /// border.
    #[test]
    fn a_turned_photograph_has_a_mask_at_each_corner() {
        let turned = [[20.0, 5.0], [95.0, 15.0], [80.0, 75.0], [10.0, 60.0]];
        let expected = "k i2 t0 p\"10.00 60.00 20.00 5.00 20.00 0.00 0.00 0.00 0.00 60.00\"\n\
            k i2 t0 p\"20.00 5.00 95.00 15.00 100.00 15.00 100.00 0.00 20.00 0.00\"\n\
            k i2 t0 p\"95.00 15.00 80.00 75.00 80.00 80.00 100.00 80.00 100.00 15.00\"\n\
            k i2 t0 p\"80.00 75.00 10.00 60.00 0.00 60.00 0.00 80.00 80.00 80.00\"\n";
        assert_eq!(lines(2, &outlined(1, Inset::default(), &turned)), expected);
        let reversed: Vec<[f64; 2]> = turned.iter().rev().copied().collect();
        assert_eq!(lines(2, &outlined(1, Inset::default(), &reversed)), expected);
        assert_eq!(lines(2, &ImageRecord { outline: None, ..outlined(1, Inset::default(), &turned) }), "");
    }

    /// Of a photograph that reaches the picture's border at the left and right, with bent sides at the top and bottom,
    /// a mask ends where it meets the border; of one that is its whole picture, nothing is masked.
    #[test]
    fn where_a_photograph_reaches_the_border_nothing_is_masked() {
        let bent = [[0.0, 0.0], [50.0, 10.0], [100.0, 0.0], [100.0, 80.0], [50.0, 70.0], [0.0, 80.0]];
        let expected =
            "k i0 t0 p\"0.00 0.00 50.00 10.00 100.00 0.00\"\nk i0 t0 p\"100.00 80.00 50.00 70.00 0.00 80.00\"\n";
        assert_eq!(lines(0, &outlined(1, Inset::default(), &bent)), expected);
        let whole = [[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [0.0, 80.0]];
        assert_eq!(lines(0, &outlined(1, Inset::default(), &whole)), "");
    }

    /// Every pixel of the stored picture lies in a mask, or inside the outline, and none in two: those of outlines with
    /// a dent, beyond the picture, inside a frame, and in pictures that are turned.
    #[test]
    fn each_pixel_is_masked_once_or_shown() {
        let inset = Inset { left: 3, top: 5, right: 7, bottom: 9 };
        let dented = [[30.3, 2.2], [60.1, 30.7], [97.4, 10.3], [85.2, 77.9], [50.4, 40.2], [5.1, 70.6], [22.6, 35.3]];
        let beyond = [[-20.2, 40.1], [50.3, -5.3], [90.6, 20.9], [120.7, 85.2], [10.9, 70.3]];
        for corners in [&dented[..], &beyond] {
            for (orientation, inset) in [(1, Inset::default()), (1, inset), (3, inset), (6, inset), (8, inset)] {
                let image = outlined(orientation, inset, corners);
                let upright = inset.outer([100, 80]);
                let shown = image.outline.as_ref().expect("a polygon").beside([100, 80]);
                let masks: Vec<_> = lines(0, &image).lines().map(read).collect();
                for (x, y) in (0..upright[0]).flat_map(|x| (0..upright[1]).map(move |y| (x, y))) {
                    let middle = [x as f64 + 0.5, y as f64 + 0.5];
                    let place = stored_place(middle, upright.map(|length| length as f64), orientation);
                    let size = if orientation > 4 { [upright[1], upright[0]] } else { upright };
                    assert!((0..2).all(|axis| place[axis] > 0.0 && place[axis] < size[axis] as f64));
                    let count = masks.iter().filter(|mask| contains(mask, place)).count();
                    let is_framed = x < inset.left || y < inset.top || x >= inset.left + 100 || y >= inset.top + 80;
                    let is_shown = !is_framed && !shown.is_marked(x - inset.left, y - inset.top);
                    assert!(is_framed || count == usize::from(!is_shown), "{orientation} {x} {y}: {count}");
                }
            }
        }
    }

    /// The corners that a line names.
    fn read(line: &str) -> Vec<[f64; 2]> {
        let numbers = line.split('"').nth(1).expect("corners").split(' ');
        let numbers: Vec<f64> = numbers.map(|number| number.parse().expect("a number")).collect();
        numbers.as_chunks::<2>().0.to_vec()
    }

    /// Whether a ray to the right crosses the polygon an odd number of times.
    fn contains(mask: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
        let edges = mask.iter().zip(mask.iter().cycle().skip(1));
        let crossed = edges.filter(|(one, other)| {
            (one[1] <= y) != (other[1] <= y) && one[0] + (y - one[1]) / (other[1] - one[1]) * (other[0] - one[0]) > x
        });
        crossed.count() % 2 == 1
    }
}
