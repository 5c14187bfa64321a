use proptest::prelude::*;
use rand::Rng;
use trueup_core::StageContext;

use super::keys::ROWS_PER_TASK;
use super::*;
use crate::features::DESCRIPTOR_LENGTH;

fn random_descriptors(seed: u64, count: usize) -> Vec<Descriptor> {
    let mut generator = StageContext::default().generator("test", seed);
    (0..count)
        .map(|_| {
            let mut descriptor = [0; DESCRIPTOR_LENGTH];
            generator.fill_bytes(&mut descriptor);
            descriptor
        })
        .collect()
}

/// Few distinct values, so that ties abound; extremes included.
fn coarse_descriptors(seed: u64, count: usize) -> Vec<Descriptor> {
    let mut descriptors = random_descriptors(seed, count);
    for (index, descriptor) in descriptors.iter_mut().enumerate() {
        let bits = descriptor[0] & 3;
        *descriptor = [if bits & 1 == 0 { 0 } else { 255 }; DESCRIPTOR_LENGTH];
        descriptor[index % 2] = if bits & 2 == 0 { 255 } else { 0 };
    }
    descriptors
}

fn naive(query: &Descriptor, candidates: &[Descriptor]) -> Neighbor {
    let neighbors = candidates.iter().enumerate().map(|(descriptor, candidate)| {
        let squared = |(&a, &b): (&u8, &u8)| (i32::from(a) - i32::from(b)).pow(2) as u32;
        Neighbor { squared_distance: query.iter().zip(candidate).map(squared).sum(), descriptor }
    });
    neighbors.min().expect("there are candidates")
}

fn check_against_naive(kernel: SearchKernel, rows: &[Descriptor], columns: &[Descriptor]) {
    let nearest = Nearest::search_with(kernel, rows, columns).expect("not empty");
    for (row, descriptor) in rows.iter().enumerate() {
        let best = naive(descriptor, columns);
        assert_eq!(nearest.nearest_column(row), best, "{kernel:?} row {row}");
        // Every third column is excluded, and the nearest one.
        let excluded = |column: usize| column == best.descriptor || column.is_multiple_of(3);
        let allowed = (0..columns.len()).filter(|&column| !excluded(column));
        let second = allowed.map(|column| squared_distance(descriptor, &columns[column])).min();
        assert_eq!(nearest.nearest_allowed(row, 0, excluded), second, "{kernel:?} row {row}");
    }
    for (column, descriptor) in columns.iter().enumerate() {
        assert_eq!(nearest.nearest_row(column), naive(descriptor, rows), "{kernel:?} column {column}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_kernel_agrees_with_the_definition(seed in 0_u64..1000, rows in 1_usize..70, columns in 1_usize..90) {
        for kernel in SearchKernel::available() {
            check_against_naive(kernel, &random_descriptors(seed, rows), &random_descriptors(seed + 1, columns));
            check_against_naive(kernel, &coarse_descriptors(seed, rows), &coarse_descriptors(seed + 1, columns));
        }
    }
}

#[test]
fn searches_of_more_than_one_pass_and_task_are_seamless() {
    let rows = random_descriptors(1, ROWS_PER_TASK + 5);
    let mut columns = random_descriptors(2, COLUMNS_PER_PASS + 3);
    columns[COLUMNS_PER_PASS + 1] = rows[ROWS_PER_TASK + 2];
    columns[COLUMNS_PER_PASS + 2] = rows[ROWS_PER_TASK + 2];
    for kernel in SearchKernel::available() {
        let nearest = Nearest::search_with(kernel, &rows, &columns).expect("not empty");
        let expected = Neighbor { squared_distance: 0, descriptor: COLUMNS_PER_PASS + 1 };
        assert_eq!(nearest.nearest_column(ROWS_PER_TASK + 2), expected);
        let back = Neighbor { squared_distance: 0, descriptor: ROWS_PER_TASK + 2 };
        assert_eq!(nearest.nearest_row(COLUMNS_PER_PASS + 2), back);
        assert_eq!(nearest.nearest_column(3), naive(&rows[3], &columns));
    }
}

#[test]
fn the_farthest_descriptors_do_not_overflow_a_key() {
    let (black, white) = ([[0; DESCRIPTOR_LENGTH]], [[255; DESCRIPTOR_LENGTH]]);
    for kernel in SearchKernel::available() {
        let nearest = Nearest::search_with(kernel, &black, &white).expect("not empty");
        assert_eq!(nearest.nearest_column(0).squared_distance, 128 * 255 * 255);
        assert_eq!(nearest.nearest_allowed(0, 0, |_| true), None);
    }
}

#[test]
fn nothing_is_nearest_to_nothing() {
    assert!(Nearest::search(&[], &random_descriptors(0, 3)).is_none());
    assert!(Nearest::search(&random_descriptors(0, 3), &[]).is_none());
}

/// Whatever instructions the processor has: 128 entries that differ by 255, by 3, and by nothing.
#[test]
fn distances_of_a_list_are_those_of_each_in_its_order() {
    let (black, white, dark) = ([0; DESCRIPTOR_LENGTH], [255; DESCRIPTOR_LENGTH], [3; DESCRIPTOR_LENGTH]);
    let mut found = vec![7; 9];
    squared_distances(&black, &[&black, &white, &dark], &[2, 0, 1, 2], &mut found);
    assert_eq!(found, [128 * 9, 0, 128 * 255 * 255, 128 * 9]);
    squared_distances(&black, &[], &[], &mut found);
    assert!(found.is_empty());
}
