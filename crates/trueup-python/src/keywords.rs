//! Keyword arguments: what the command's flags are called, in Python.

use std::path::PathBuf;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyMapping, PyString};
use trueup::{Error, MaskFile, MaskKind, Photograph, Reference, StitchOptions};
use trueup_cli::{OPTION_FLAGS, OptionFlag};

use crate::errors::exception;
use crate::photographs::collected;

/// The reference that leaves the choice to the program.
const AUTO: &str = "auto";

/// What keyword arguments wish: options, and what is none.
#[derive(Debug)]
pub(crate) struct Wishes {
    pub options: StitchOptions,
    pub reference: Reference,
    pub graph: Option<PathBuf>,
    pub lens_from: Option<PathBuf>,
    pub require_all: bool,
    pub masks: Vec<MaskFile>,
    /// The pixels of masks that are no files, by the names that [`Self::masks`] has for them.
    pub mask_pictures: Vec<(String, Photograph)>,
    pub cache: Option<PathBuf>,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
}

impl Wishes {
    /// What `keywords` wish of the subcommand `command`, beginning with `options`; the configuration file is overruled
    /// by `set`, and this by the keywords of their own.
    pub(crate) fn of(keywords: &Bound<'_, PyDict>, command: &str, options: StitchOptions) -> PyResult<Self> {
        let py = keywords.py();
        let mut wishes = Self {
            options,
            reference: Reference::Auto,
            graph: None,
            lens_from: None,
            require_all: false,
            masks: Vec::new(),
            mask_pictures: Vec::new(),
            cache: None,
            threads: 0,
        };
        let refuse = |error| exception(py, error);
        if let Some(path) = given(keywords, "config")? {
            read_config(&mut wishes.options, &path.extract::<PathBuf>()?).map_err(refuse)?;
        }
        if let Some(assignments) = given(keywords, "set")? {
            for (name, value) in pairs(&assignments)? {
                let assignment = format!("{}={}", name.extract::<String>()?, text(&value)?);
                wishes.options.set(&assignment).map_err(refuse)?;
            }
        }
        for (name, value) in keywords.iter() {
            let name: String = name.extract()?;
            if !value.is_none() {
                wishes.heed(command, &name, &value)?;
            }
        }
        wishes.options.validate().map_err(refuse)?;
        refuse_view_of_the_mesh(keywords, &wishes.options)?;
        Ok(wishes)
    }

    fn heed(&mut self, command: &str, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let is_stitch = command == "stitch";
        match name {
            "config" | "set" => {}
            "threads" => self.threads = value.extract::<u16>()?.into(),
            "masks" if is_stitch => self.add_masks(value, MaskKind::Use)?,
            "keep" if is_stitch => self.add_masks(value, MaskKind::Keep)?,
            "reference" if is_stitch => match value.extract::<String>()? {
                name if name == AUTO => {}
                name => self.reference = Reference::Named(name),
            },
            "graph" if is_stitch => self.graph = Some(value.extract()?),
            "lens_from" if is_stitch => self.lens_from = Some(value.extract()?),
            "require_all" if is_stitch => self.require_all = value.extract()?,
            "cache" if is_stitch => self.cache = Some(value.extract()?),
            _ => {
                let flag = flag_of(command, name).ok_or_else(|| unexpected(command, name))?;
                let assignment = format!("{}={}", flag.option, text(value)?);
                self.options.set(&assignment).map_err(|error| exception(value.py(), error))?;
            }
        }
        Ok(())
    }
}

impl Wishes {
    /// Adds masks by the names of photographs: files, or names with pixels.
    fn add_masks(&mut self, given: &Bound<'_, PyAny>, kind: MaskKind) -> PyResult<()> {
        for (photograph, mask) in pairs(given)? {
            let (names, in_memory) = collected(vec![mask.extract()?])?;
            let photograph: String = photograph.extract()?;
            for name in names {
                self.mask_pictures.extend(in_memory.get(&name).map(|picture| (name.clone(), picture.as_ref().clone())));
                self.masks.push(MaskFile { photograph: photograph.clone(), file: name.into(), kind });
            }
        }
        Ok(())
    }
}

/// What a flag is called in Python.
pub(crate) fn keyword_of(flag: &OptionFlag) -> String {
    flag.flag.replace('-', "_")
}

fn flag_of(command: &str, keyword: &str) -> Option<&'static OptionFlag> {
    OPTION_FLAGS.iter().find(|flag| flag.subcommands.contains(&command) && keyword_of(flag) == keyword)
}

fn unexpected(command: &str, keyword: &str) -> PyErr {
    let known: Vec<String> =
        OPTION_FLAGS.iter().filter(|flag| flag.subcommands.contains(&command)).map(keyword_of).collect();
    PyTypeError::new_err(format!(
        "unexpected keyword argument '{keyword}'; options with a keyword of their own are {}, any other is set by \
         set={{\"table.option\": value}}",
        known.join(", ")
    ))
}

/// A keyword's value, if it was given and is not `None`.
fn given<'py>(keywords: &Bound<'py, PyDict>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(keywords.get_item(name)?.filter(|value| !value.is_none()))
}

type Pair<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);

fn pairs<'py>(mapping: &Bound<'py, PyAny>) -> PyResult<Vec<Pair<'py>>> {
    mapping.cast::<PyMapping>()?.items()?.iter().map(|pair| pair.extract()).collect()
}

/// A value as one writes it after an option's name.
fn text(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(truth) = value.cast::<PyBool>() {
        return Ok(truth.is_true().to_string());
    }
    if let Ok(text) = value.cast::<PyString>() {
        return text.extract();
    }
    match value.extract::<PathBuf>() {
        Ok(path) => Ok(path.display().to_string()),
        // Numbers, as Python writes them; those of NumPy are written alike.
        Err(_) => Ok(value.str()?.to_string()),
    }
}

fn read_config(options: &mut StitchOptions, path: &std::path::Path) -> trueup::Result<()> {
    let text = trueup::text::read_to_string(path).map_err(|error| Error::io("reading", path, error))?;
    options.merge_toml(&text, &path.display().to_string())
}

/// Refuses keywords that turn or bound a view where there is none.
fn refuse_view_of_the_mesh(keywords: &Bound<'_, PyDict>, options: &StitchOptions) -> PyResult<()> {
    for flag in OPTION_FLAGS {
        let keyword = keyword_of(flag);
        let Some(value) = given(keywords, &keyword)? else { continue };
        if flag.lacks_a_view(&text(&value)?, options) {
            let reason = "the panorama is drawn on the mesh, which has no view";
            return Err(exception(keywords.py(), Error::input(keyword, reason, "Take another projection.")));
        }
    }
    Ok(())
}
