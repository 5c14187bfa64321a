//! Photographs by the names that people call them.

use std::path::Path;

use trueup_core::called::{Called, any_of};
use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

/// The photograph that a user calls `name`: by name, by path, or by the end of its path, its own or that of another
/// exposure of its stack; `role` ends the message if there is none, as in "so it cannot be the reference".
///
/// # Errors
/// [`Error::Input`] if there is none, or if it may be any of several.
pub(crate) fn photograph_named(images: &[SourceImage], name: &str, role: &str) -> Result<usize> {
    match Called::by(Path::new(name), images.iter().enumerate().flat_map(files)) {
        Called::Nothing => Err(Error::input(
            name,
            format!("no photograph of this name was given, {role}"),
            "Write the name of one of the photographs, with its extension.",
        )),
        Called::One(found) => Ok(found),
        Called::AnyOf(several) => Err(Error::input(
            name,
            format!("it {}", any_of(several.iter().map(|&at| images[at].path.as_path()))),
            "Write the folder before the name, as far as tells the photographs apart.",
        )),
    }
}

/// What photograph number `at` may be called by: the names and paths of its own file and of those of its stack.
fn files((at, image): (usize, &SourceImage)) -> impl Iterator<Item = (usize, &Path)> {
    let exposures = image.stack.iter().map(|member| &member.source);
    let files = std::iter::once(image).chain(exposures);
    files.flat_map(|file| [Path::new(&file.name), file.path.as_path()]).map(move |name| (at, name))
}

/// The photograph the user calls `name` for the reference: by name, by path, or by the end of its path.
///
/// # Errors
/// As [`photograph_named`].
pub(crate) fn reference_named(images: &[SourceImage], name: &str) -> Result<usize> {
    photograph_named(images, name, "so it cannot be the reference")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_several_photographs_is_none_of_one() {
        let image = |path: &str| SourceImage::unknown(path, path, [8, 6]);
        let images = ["to/d1/a.jpg", "to/d2/a.jpg", "to/d2/b.jpg"].map(image);
        let named = |name: &str| photograph_named(&images, name, "so it is not");
        assert_eq!(named("d2/a.jpg").expect("one"), 1);
        assert_eq!(named("to/d1/a.jpg").expect("one"), 0);
        assert_eq!(named("b.jpg").expect("one"), 2);
        let message = named("a.jpg").expect_err("of two").to_string();
        assert!(message.contains("a.jpg: it may be any of to/d1/a.jpg, to/d2/a.jpg. Write the folder"), "{message}");
        assert!(named("c.jpg").is_err());
    }
}
