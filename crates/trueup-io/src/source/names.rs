//! Short names for messages.

use std::path::Path;

/// For each path its file name, or as many trailing parts of the path as tell it from the others. Paths that are the
/// same throughout keep the same, whole name.
pub fn unique_names(paths: &[&Path]) -> Vec<String> {
    let longest = paths.iter().map(|path| path.components().count()).max().unwrap_or(0);
    let mut parts = vec![1; paths.len()];
    // Each round lengthens the names that still collide; a name can grow by at most the longest path's parts.
    for _ in 1..longest {
        let names: Vec<String> = paths.iter().zip(&parts).map(|(path, &parts)| tail(path, parts)).collect();
        let mut order: Vec<usize> = (0..names.len()).collect();
        order.sort_by(|&a, &b| names[a].cmp(&names[b]));
        let mut collided = false;
        for group in order.chunk_by(|&a, &b| names[a] == names[b]) {
            let same_path = group.iter().all(|&index| paths[index] == paths[group[0]]);
            if !same_path {
                group.iter().for_each(|&index| parts[index] += 1);
                collided = true;
            }
        }
        if !collided {
            break;
        }
    }
    paths.iter().zip(&parts).map(|(path, &parts)| tail(path, parts)).collect()
}

/// The last `parts` components of a path, joined by "/".
fn tail(path: &Path, parts: usize) -> String {
    let components: Vec<_> = path.components().collect();
    let start = components.len().saturating_sub(parts);
    let tail: std::path::PathBuf = components[start..].iter().collect();
    let name = tail.to_string_lossy().into_owned();
    if name.is_empty() { path.to_string_lossy().into_owned() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_grow_only_where_they_collide() {
        let paths = ["day 1/a/1.jpg", "day 2/a/1.jpg", "day 2/b/1.jpg", "day 2/Zürich.jpg", "day 2/Zürich.jpg"];
        let names = unique_names(&paths.map(Path::new));
        assert_eq!(names, ["day 1/a/1.jpg", "day 2/a/1.jpg", "b/1.jpg", "Zürich.jpg", "Zürich.jpg"]);
    }

    #[test]
    fn odd_paths_keep_a_name() {
        assert_eq!(unique_names(&[Path::new(""), Path::new("/"), Path::new("..")]), ["", "/", ".."]);
        assert!(unique_names(&[]).is_empty());
    }
}
