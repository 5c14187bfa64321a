//! Photographs by the names that people call them.

use trueup_core::source::SourceImage;
use trueup_core::{Error, Result};

/// The photograph that a user calls `name`: by name, by path, or by the end of its path, its own or that of another exposure of its
/// stack; `role` ends the message if there is none, as in "so it cannot be the reference".
pub(crate) fn photograph_named(images: &[SourceImage], name: &str, role: &str) -> Result<usize> {
    let position = |called: &dyn Fn(&SourceImage) -> bool| {
        let is_called = |image: &SourceImage| called(image) || image.stack.iter().any(|member| called(&member.source));
        images.iter().position(is_called)
    };
    let exactly = position(&|image| image.name == name || image.path.as_os_str() == name);
    exactly.or_else(|| position(&|image| image.path.ends_with(name))).ok_or_else(|| {
        Error::input(
            name,
            format!("no photograph of this name was given, {role}"),
            "Write the name of one of the photographs, with its extension.",
        )
    })
}

/// The photograph the user calls `name` for the reference: by name, by path, or by the end of its path.
///
/// # Errors
/// As [`photograph_named`].
pub(crate) fn reference_named(images: &[SourceImage], name: &str) -> Result<usize> {
    photograph_named(images, name, "so it cannot be the reference")
}
