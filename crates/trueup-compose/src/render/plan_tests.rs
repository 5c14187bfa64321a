//! How memory is divided for each way of composing.

use trueup_core::Result;
use trueup_core::memory::needed_in_words;
use trueup_core::mesh::GridMesh;

use super::*;
use crate::layout::Placed;
use crate::test_photographs::{Memory, RamDisk};

fn layout(count: usize) -> CanvasLayout {
    let placed = (0..count)
        .map(|photograph| {
            let mut mesh = GridMesh::regular(4000.0, 3000.0, 400.0);
            mesh.target.iter_mut().for_each(|vertex| vertex[0] += 2000.0 * photograph as f64);
            Placed { photograph, mesh }
        })
        .collect();
    let width = 2000 * (count + 1);
    CanvasLayout { width, height: 3000, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
}

fn plan(memory: usize, ceiling: usize, blend: Blend) -> Result<MemoryPlan> {
    let disk = RamDisk::default();
    let resources = Resources { memory, ceiling, scratch: &disk, helpers: None };
    let options = RenderOptions { blend, ..RenderOptions::default() };
    MemoryPlan::new(&memory_needs(&layout(20), &Memory(Vec::new()), &options)?, &resources.allowed())
}

#[test]
fn with_enough_memory_nothing_goes_to_disk_and_with_little_most_does() {
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather] {
        let all = plan(usize::MAX, usize::MAX, blend).expect("everything fits");
        assert!(!all.on_disk() && all.coarse_levels.is_none() && all.at_a_time == rayon::current_num_threads());
        assert!(all.sum_rows(42_000, 16) >= 3000);
        let little = plan(1, usize::MAX, blend).expect("the least is taken");
        assert!(little.on_disk() && little.at_a_time == 1, "{blend:?}");
        // Four of 48 MB.
        assert_eq!(little.photographs, 4 * 4000 * 3000 * 4);
    }
}

#[test]
fn the_number_in_a_refusal_is_enough() {
    for blend in [Blend::MultiBand, Blend::None, Blend::Feather, Blend::Average] {
        let refused = plan(1000, 1000, blend).expect_err("a thousand bytes").to_string();
        assert!(refused.contains("composing 42000 x 3000 px: at least "), "{refused}");
        let options = RenderOptions { blend, ..RenderOptions::default() };
        // Of photographs that were not decoded yet, of 48 MB each.
        let needs = memory_needs(&layout(20), &Memory(Vec::new()), &options);
        let least = needs.expect("few photographs").least();
        assert!(refused.contains(&needed_in_words(least as u64)), "{refused}");
        assert!(plan(least, least, blend).is_ok() && plan(least, least - 1, blend).is_err());
    }
}

/// Photographs are held as a whole wherever that is allowed, and in parts only where it is not: with as much as four of
/// them and one that is decoded take beside the rest, they are, with a byte less they are not.
#[test]
fn photographs_are_in_parts_where_whole_ones_have_no_room() {
    for blend in [Blend::MultiBand, Blend::None] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let needs = || memory_needs(&layout(20), &Memory(Vec::new()), &options).expect("few photographs");
        let free = plan(usize::MAX, usize::MAX, blend).expect("everything fits");
        assert!(!free.in_parts && free.kept == free.photographs);
        let whole = needs().least_whole();
        let least = needs().least();
        // Of six photographs of 48 MB that are counted, two stay, to decode one; rows of those that meet come.
        assert!(least + 3 * 48_000_000 < whole, "{blend:?}: {least} of {whole}");
        assert!(!plan(whole, whole, blend).expect("whole ones fit").in_parts);
        for memory in [least, whole - 1] {
            let parts = plan(memory, memory, blend).expect("parts fit");
            assert!(parts.in_parts && parts.kept == 0 && parts.photographs < whole);
        }
    }
    for blend in [Blend::Feather, Blend::Average] {
        let options = RenderOptions { blend, ..RenderOptions::default() };
        let needs = memory_needs(&layout(20), &Memory(Vec::new()), &options).expect("few photographs");
        assert_eq!(needs.least(), needs.least_whole(), "{blend:?}: no strip is finished before the others");
    }
}
