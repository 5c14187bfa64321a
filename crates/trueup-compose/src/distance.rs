//! Distances to the border of what is covered.

/// Distance of every pixel of a picture `width` pixels wide to the nearest one that is not `covered`, or to the
/// picture's border, in thirds of a pixel: straight steps of 3 and diagonal ones of 4; 0 where nothing is covered.
///
/// # Source
/// Borgefors, "Distance transformations in digital images", CVGIP 34, 1986.
pub(crate) fn border_distances(covered: &[bool], width: usize) -> Vec<u32> {
    let mut distance = vec![0_u32; covered.len()];
    if width == 0 {
        return distance;
    }
    // A row that is done, with what lies beyond both its ends.
    let mut done = vec![0_u32; width + 2];
    for (covered, row) in covered.chunks_exact(width).zip(distance.chunks_exact_mut(width)) {
        let mut beside = 0;
        for (x, (&covered, own)) in covered.iter().zip(row.iter_mut()).enumerate() {
            let near = (beside + 3).min(done[x + 1] + 3).min(done[x] + 4).min(done[x + 2] + 4);
            beside = if covered { near } else { 0 };
            *own = beside;
        }
        done[1..=width].copy_from_slice(row);
    }
    done.fill(0);
    for row in distance.chunks_exact_mut(width).rev() {
        let mut beside = 0;
        for (x, own) in row.iter_mut().enumerate().rev() {
            let near = (beside + 3).min(done[x + 1] + 3).min(done[x] + 4).min(done[x + 2] + 4);
            // What is not covered has 0 already.
            beside = near.min(*own);
            *own = beside;
        }
        done[1..=width].copy_from_slice(row);
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
