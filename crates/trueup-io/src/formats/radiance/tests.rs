//! Pixels and files of Radiance's form.

use proptest::prelude::*;

use super::pixel::{append_row, light, pixel, read_row};

/// By the formula: (m + 0.5) / 256 * 2^(e - 128).
#[test]
fn pixels_mean_what_the_paper_says() {
    assert_eq!(light([128, 64, 0, 129]), [128.5 / 128.0, 64.5 / 128.0, 0.5 / 128.0]);
    assert_eq!(light([200, 100, 50, 0]), [0.0; 3]);
    assert_eq!(pixel([1.0, 0.5, 0.0]), [128, 64, 0, 129]);
    assert_eq!(pixel([0.999, 0.0, 0.0])[3], 128);
    assert_eq!(pixel([-1.0, f32::NAN, 0.0]), [0; 4]);
    assert_eq!(pixel([1e-40, 0.0, 0.0]), [0; 4]);
    assert_eq!(pixel([f32::INFINITY, 0.0, 0.0]), [255, 0, 0, 255]);
}

proptest! {
    /// A mantissa has 8 bits, at least 7 of them used by the largest of a pixel.
    #[test]
    fn light_is_kept_to_a_part_in_256_of_the_brightest(red in 1e-20_f32..1e20, green in 0_f32..1.0, blue in 0_f32..1.0) {
        let wanted = [red, red * green, red * blue];
        for (value, wanted) in light(pixel(wanted)).into_iter().zip(wanted) {
            prop_assert!((value - wanted).abs() <= red / 255.0, "{value} {wanted}");
        }
    }

    #[test]
    fn rows_come_back_as_they_were(
        runs in proptest::collection::vec((any::<[u8; 4]>(), 1_usize..200), 1..40)
    ) {
        // Without what only old rows have.
        let row: Vec<[u8; 4]> = runs
            .into_iter()
            .flat_map(|(pixel, count)| std::iter::repeat_n(pixel, count))
            .map(|[red, green, blue, exponent]| [red | 4, green, blue, exponent])
            .collect();
        let (mut bytes, mut again) = (Vec::new(), Vec::new());
        append_row(&row, &mut bytes);
        read_row(&mut &bytes[..], row.len(), &mut again).expect("a row");
        prop_assert_eq!(&again, &row);
        for cut in (0..bytes.len()).step_by(bytes.len() / 16 + 1) {
            prop_assert!(read_row(&mut &bytes[..cut], row.len(), &mut again).is_err());
        }
    }

    #[test]
    fn whatever_is_read_as_a_row_has_the_width(bytes in proptest::collection::vec(any::<u8>(), 0..300), width in 1_usize..64) {
        let mut row = Vec::new();
        if read_row(&mut &bytes[..], width, &mut row).is_ok() {
            prop_assert_eq!(row.len(), width);
        }
    }
}

#[test]
fn rows_of_old_files_repeat_pixels() {
    let mut row = Vec::new();
    let bytes = [9, 8, 7, 6, 1, 1, 1, 2, 1, 1, 1, 1, 5, 5, 5, 5];
    read_row(&mut &bytes[..], 3 + 256 + 1, &mut row).expect("a row");
    assert!(row[..259].iter().all(|&pixel| pixel == [9, 8, 7, 6]));
    assert_eq!(row[259], [5; 4]);
    assert!(read_row(&mut &bytes[..], 100, &mut row).is_err(), "longer than the picture");
}
