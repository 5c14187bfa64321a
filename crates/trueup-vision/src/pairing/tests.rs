use rand::Rng;

use trueup_core::Error;

use super::*;
use crate::features::{DESCRIPTOR_LENGTH, FeaturePoint};

/// Photographs along a row: each shares half of its descriptors with the next.
fn row(count: usize, shared: usize) -> Vec<Features> {
    let mut generator = StageContext::default().generator("test", 0);
    let mut descriptors = vec![[0; DESCRIPTOR_LENGTH]; (count + 1) * shared];
    descriptors.iter_mut().for_each(|descriptor| generator.fill_bytes(descriptor));
    let photograph = |index: usize| {
        let descriptors = descriptors[index * shared..(index + 2) * shared].to_vec();
        let point = |k: usize| FeaturePoint {
            position: [(k * 37 % 800) as f64, (k * 91 % 600) as f64],
            scale_px: 2.0,
            response: 10.0,
        };
        let points = (0..descriptors.len()).map(point).collect();
        let descriptor_points = (0..descriptors.len() as u32).collect();
        Features { points, descriptors, descriptor_points }
    };
    (0..count).map(photograph).collect()
}

#[test]
fn few_photographs_are_paired_with_all() {
    let proposed = propose(&row(4, 5), &PairingOptions::default(), &StageContext::default()).expect("valid");
    assert_eq!(proposed.pairs, [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]);
    assert!(proposed.exhaustive);
    for count in [0, 1] {
        let proposed = propose(&row(count, 5), &PairingOptions::default(), &StageContext::default()).expect("valid");
        assert!(proposed.pairs.is_empty() && proposed.exhaustive);
    }
}

#[test]
fn many_photographs_are_paired_with_those_that_look_alike() {
    let options = PairingOptions { exhaustive_up_to: 5, neighbors: 2, consecutive: false };
    let (features, context) = (row(12, 10), StageContext::default());
    let proposed = propose(&features, &options, &context).expect("valid");
    for photograph in 1..12 {
        assert!(proposed.pairs.contains(&(photograph - 1, photograph)), "{photograph}");
    }
    assert!(!proposed.exhaustive);
    assert!(proposed.pairs.is_sorted() && proposed.pairs.len() <= 24);
    // Of the strongest 16 of 20 features, the first 6 are among the previous photograph's last.
    let looks = looks_at_strongest(16, &features, &|_, _| None, &context).expect("valid");
    assert!((1..12).all(|photograph| looks[photograph][photograph - 1] == 6), "{looks:?}");
    assert_eq!(propose_by(&looks, &options), proposed);
}

#[test]
fn photographs_without_features_are_paired_with_their_neighbors_in_order_only() {
    let options = PairingOptions { exhaustive_up_to: 0, ..PairingOptions::default() };
    let empty = vec![Features::default(); 4];
    let proposed = propose(&empty, &options, &StageContext::default()).expect("valid");
    assert_eq!(proposed.pairs, [(0, 1), (1, 2), (2, 3)]);
    let options = PairingOptions { consecutive: false, ..options };
    let proposed = propose(&empty, &options, &StageContext::default()).expect("valid");
    assert!(proposed.pairs.is_empty() && !proposed.exhaustive);
}

#[test]
fn bad_options_and_cancelling_are_errors() {
    let options = PairingOptions { neighbors: 0, ..PairingOptions::default() };
    let outcome = propose(&[], &options, &StageContext::default());
    assert!(matches!(outcome, Err(Error::Options(invalid)) if invalid.len() == 1));
    let token = trueup_core::context::CancelToken::default();
    token.cancel();
    let context = StageContext::new(&trueup_core::context::Silent, &token, 0);
    let options = PairingOptions { exhaustive_up_to: 1, ..PairingOptions::default() };
    assert!(matches!(propose(&row(3, 5), &options, &context), Err(Error::Cancelled)));
}
