//! Distances to the border of what is covered.

/// Distance of every pixel of a picture `width` pixels wide to the nearest one that is not `covered`, or to the picture's
/// border, in thirds of a pixel: straight steps of 3 and diagonal ones of 4; 0 where nothing is covered.
///
/// # Source
/// Borgefors, "Distance transformations in digital images", CVGIP 34, 1986.
pub(crate) fn border_distances(covered: &[bool], width: usize) -> Vec<u32> {
    let mut distance = vec![0_u32; covered.len()];
    let height = covered.len() / width.max(1);
    let at = |distance: &[u32], x: isize, y: isize| {
        let inside = x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height;
        if inside { distance[y as usize * width + x as usize] } else { 0 }
    };
    for forward in [true, false] {
        let sign = if forward { -1 } else { 1 };
        for step in 0..width * height {
            let index = if forward { step } else { width * height - 1 - step };
            if !covered[index] {
                continue;
            }
            let (x, y) = ((index % width) as isize, (index / width) as isize);
            let near = (at(&distance, x + sign, y) + 3)
                .min(at(&distance, x, y + sign) + 3)
                .min(at(&distance, x + sign, y + sign) + 4)
                .min(at(&distance, x - sign, y + sign) + 4);
            distance[index] = if forward { near } else { near.min(distance[index]) };
        }
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_grow_inwards() {
        assert_eq!(border_distances(&[true; 9], 3), [3, 3, 3, 3, 6, 3, 3, 3, 3]);
        let mut covered = [true; 25];
        covered[12] = false;
        let found = border_distances(&covered, 5);
        assert_eq!((found[12], found[6], found[7], found[0]), (0, 4, 3, 3));
        assert!(border_distances(&[], 0).is_empty());
    }
}
