//! Photographs by what people call them.

use std::path::Path;

/// What a name means among photographs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Called {
    /// None of them.
    Nothing,
    /// This one, by its index.
    One(usize),
    /// Any of these, by their indices: the name tells too little.
    AnyOf(Vec<usize>),
}

impl Called {
    /// Which of the photographs people call `name`, of the files `files`, each with the index of its photograph, which
    /// may have several: the first whose file is called just that, or else the one whose file's path ends with it, by
    /// whole folders.
    pub fn by<'a>(name: &Path, files: impl Iterator<Item = (usize, &'a Path)>) -> Self {
        let mut meant = Vec::new();
        for (photograph, file) in files {
            // One may be at the very path that ends others'.
            if file == name {
                return Self::One(photograph);
            }
            if file.ends_with(name) && meant.last() != Some(&photograph) {
                meant.push(photograph);
            }
        }
        match meant[..] {
            [] => Self::Nothing,
            [one] => Self::One(one),
            _ => Self::AnyOf(meant),
        }
    }
}

/// What is said of a name that may be any of the photographs at `paths`: the end of a sentence.
pub fn any_of<'a>(paths: impl Iterator<Item = &'a Path>) -> String {
    let paths: Vec<String> = paths.map(|path| path.display().to_string()).collect();
    format!("may be any of {}", paths.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_whole_one_or_the_end_of_one() {
        let files =
            [(0, "1.jpg"), (1, "b/1.jpg"), (1, "b/1-dark.jpg"), (2, "c/2.jpg"), (2, "d/2.jpg"), (3, "d/1-dark.jpg")];
        let called = |name: &str| Called::by(Path::new(name), files.iter().map(|&(k, file)| (k, Path::new(file))));
        assert_eq!(called("1.jpg"), Called::One(0), "it is called just that");
        assert_eq!(called("b/1.jpg"), Called::One(1));
        assert_eq!(called("2.jpg"), Called::One(2), "both are files of one photograph");
        assert_eq!(called("1-dark.jpg"), Called::AnyOf(vec![1, 3]));
        assert_eq!(called("dark.jpg"), Called::Nothing, "no part of a file's name");
    }
}
