use std::fs::File;

use super::super::key::KeyMaker;
use super::*;

const KIND: Kind = PAIR;

fn key(number: u8) -> Key {
    KeyMaker::new().bytes(&[number]).finish()
}

fn open(folder: &Path, max_bytes: f64) -> PhotographCache {
    PhotographCache::open(folder, max_bytes).expect("a folder that takes files")
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).expect("readable");
    let mut paths: Vec<PathBuf> =
        files.map(|file| file.expect("readable").path()).filter(|path| is_entry(path)).collect();
    paths.sort();
    paths
}

#[test]
fn what_was_kept_is_found_by_its_key_alone() {
    let desk = tempfile::tempdir().expect("a folder");
    let folder = desk.path().join("made/here");
    let numbers = vec![f64::NAN, -0.0, 1e300];
    open(&folder, 1e9).store(KIND, &key(1), &numbers);
    let cache = open(&folder, 1e9);
    let found: Vec<f64> = cache.load(KIND, &key(1)).expect("kept");
    assert!(found.iter().zip(&numbers).all(|(found, number)| found.to_bits() == number.to_bits()));
    assert_eq!(cache.load::<Vec<f64>>(KIND, &key(2)), None);
    assert_eq!(cache.load::<Vec<f64>>(MEASURED, &key(1)), None);
    assert_eq!(cache.uses()[KIND.0], CacheUse { found: 1, made: 1 });
    assert!(folder.join("CACHEDIR.TAG").is_file());
}

#[test]
fn damaged_entries_are_told_of_once_and_made_again() {
    let desk = tempfile::tempdir().expect("a folder");
    let cache = open(desk.path(), 1e9);
    for number in 0..3 {
        cache.store(KIND, &key(number), &"content");
    }
    for path in entries(desk.path()) {
        let mut bytes = fs::read(&path).expect("readable");
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        fs::write(path, bytes).expect("written");
    }
    for number in 0..3 {
        assert_eq!(cache.load::<String>(KIND, &key(number)), None);
    }
    let context = StageContext::default();
    cache.report(&context);
    let codes: Vec<String> = context.findings().into_iter().map(|one| one.code).collect();
    assert_eq!(codes, ["cache-entry-damaged"]);
    cache.store(KIND, &key(0), &"content");
    assert_eq!(cache.load::<String>(KIND, &key(0)).as_deref(), Some("content"));
    // Whole, but of another form.
    assert_eq!(cache.load::<Vec<f64>>(KIND, &key(0)), None);
}

#[test]
fn the_entries_not_used_for_the_longest_time_go_first_and_nothing_else_goes() {
    let desk = tempfile::tempdir().expect("a folder");
    let cache = open(desk.path(), 1e9);
    let age = |number: u8, seconds: u64| {
        let path = cache.path(KIND, &key(number));
        let used = SystemTime::now() - Duration::from_secs(seconds);
        File::open(path).and_then(|file| file.set_modified(used)).expect("own file");
    };
    for number in 0..4 {
        cache.store(KIND, &key(number), &vec![number; 100]);
        age(number, 1000 - u64::from(number));
    }
    // The oldest is used again.
    assert!(cache.load::<Vec<u8>>(KIND, &key(0)).is_some());
    let length = fs::metadata(cache.path(KIND, &key(0))).expect("there").len();
    let foreign = ["photograph.jpg", "notes.trueup", "pair-of-shoes.trueup", ".trueup-new.part"];
    foreign.iter().for_each(|name| fs::write(desk.path().join(name), "kept").expect("written"));
    let dead = desk.path().join(".trueup-dead.part");
    fs::write(&dead, "half").expect("written");
    let long_ago = SystemTime::now() - 2 * ABANDONED;
    File::open(&dead).and_then(|file| file.set_modified(long_ago)).expect("own file");
    drop(cache);
    drop(open(desk.path(), 2.5 * length as f64));
    let cache = open(desk.path(), 1e9);
    let left: Vec<u8> = (0..4).filter(|&number| cache.path(KIND, &key(number)).exists()).collect();
    assert_eq!(left, [0, 3]);
    assert!(foreign.iter().all(|name| desk.path().join(name).exists()) && !dead.exists());
}

#[test]
fn folders_that_take_no_files_are_refused() {
    let desk = tempfile::tempdir().expect("a folder");
    fs::write(desk.path().join("file"), "").expect("written");
    let refused = |path: &Path| PhotographCache::open(path, 1e9).expect_err("must fail").to_string();
    assert!(refused(&desk.path().join("file")).contains("file"));
    assert!(refused(&desk.path().join("file/inside")).contains("making the folder"));
}
