//! A panorama: its pixels as arrays, and as files.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{Element, IntoPyArray, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::prelude::*;
use trueup::{Depth, Error, Outputs, Rendered, Result, RowSource, SideOutput, StitchOptions, Stitcher};

use crate::errors::exception;
use crate::keywords::Wishes;
use crate::work::{Surroundings, run};

/// A panorama, kept as it was composed: in linear light.
#[pyclass(frozen, module = "trueup._trueup")]
#[derive(Debug)]
pub(crate) struct Panorama {
    pub(crate) alignment: trueup::Alignment,
    pub(crate) rendered: Rendered,
    pub(crate) options: StitchOptions,
    /// That of its arrays.
    pub(crate) depth: Depth,
    pub(crate) threads: usize,
}

impl Panorama {
    /// The depth of the arrays: the one asked for, or that of the photographs.
    ///
    /// # Errors
    /// If a photograph's file can no longer be read.
    pub(crate) fn depth_of(options: &StitchOptions, alignment: &trueup::Alignment) -> Result<Depth> {
        match options.compose.output.depth {
            Depth::Auto if alignment.photograph_bits()? > 8 => Ok(Depth::Sixteen),
            Depth::Auto => Ok(Depth::Eight),
            depth => Ok(depth),
        }
    }

    /// Colors and opacity, of rows that `row` fills in as RGBA.
    fn arrays<'py, T: Element + Copy + Default + Sync>(
        &self,
        py: Python<'py>,
        row: impl Fn(usize, &mut [T]) -> Result<()> + Sync,
        opacity: impl Fn(T) -> u8 + Sync,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let panorama = &self.rendered.panorama;
        let (width, height) = (panorama.width(), panorama.height());
        let surroundings = Surroundings { progress: None, threads: self.threads };
        let (colors, mask) = run(py, surroundings, |context| {
            let mut colors = vec![T::default(); width * height * 3];
            let mut mask = vec![0; width * height];
            let rows = colors.par_chunks_exact_mut(width * 3).zip(mask.par_chunks_exact_mut(width)).enumerate();
            rows.try_for_each_init(
                || vec![T::default(); width * 4],
                |rgba, (y, (colors, mask))| {
                    context.check_cancelled()?;
                    row(y, rgba)?;
                    for ((pixel, color), mask) in rgba.chunks_exact(4).zip(colors.chunks_exact_mut(3)).zip(mask) {
                        *mask = opacity(pixel[3]);
                        // What is all but transparent has colors at some depths, and none at others.
                        if *mask > 0 {
                            color.copy_from_slice(&pixel[..3]);
                        }
                    }
                    Ok(())
                },
            )?;
            Ok((colors, mask))
        })?;
        let colors = colors.into_pyarray(py).reshape([height, width, 3])?;
        let mask = mask.into_pyarray(py).reshape([height, width])?;
        Ok((colors.into_any(), mask.into_any()))
    }
}

#[pymethods]
impl Panorama {
    /// Colors, height x width x 3, and opacity, height x width. Colors are encoded in 8 or 16 bits, or floating point
    /// numbers of linear light; 0 where no photograph is.
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let panorama = &self.rendered.panorama;
        match self.depth {
            Depth::Sixteen => self.arrays(
                py,
                |y, row| panorama.rgba16_row(y, row),
                |opacity: u16| ((u32::from(opacity) * 255 + 32767) / 65535) as u8,
            ),
            Depth::Float => {
                self.arrays(py, |y, row| panorama.linear_row(y, row), |opacity: f32| (opacity * 255.0 + 0.5) as u8)
            }
            Depth::Auto | Depth::Eight => self.arrays(py, |y, row| panorama.rgba8_row(y, row), |opacity: u8| opacity),
        }
    }

    /// Writes the panorama to `path`, in the format that its extension names, and beside it what `beside` asks for by
    /// the command's flags; returns the bytes of the panorama's file.
    fn save<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        beside: BTreeMap<String, PathBuf>,
        keywords: &Bound<'py, PyDict>,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<u64> {
        let options = self.output_options(keywords)?;
        let mut outputs = Outputs::new(path);
        for (flag, path) in beside {
            let kind = SideOutput::ALL.iter().find(|kind| kind.flag() == flag);
            let unknown = || Error::input(&flag, "no such file can be beside a panorama", "");
            outputs = outputs.with(*kind.ok_or_else(|| exception(py, unknown()))?, path);
        }
        let surroundings = Surroundings { progress, threads: self.threads };
        run(py, surroundings, |context| {
            outputs.check(&options)?;
            let stitcher = Stitcher::new(&options, context);
            Ok(outputs.write_composed(&stitcher, self.alignment.clone(), &self.rendered)?.bytes)
        })
    }

    /// The record, as JSON.
    fn project_json(&self, py: Python<'_>) -> PyResult<String> {
        self.alignment.project.to_json().map_err(|error| exception(py, error))
    }

    /// What messages call the photographs, in the order of the record.
    fn photograph_names(&self) -> Vec<String> {
        self.alignment.project.photograph_names()
    }

    /// What was made of which photographs, in words.
    fn summary(&self, verbose: bool) -> String {
        trueup_cli::summary_text(&self.alignment.project, verbose)
    }
}

impl Panorama {
    /// The options of the panorama with others of its file.
    fn output_options(&self, keywords: &Bound<'_, PyDict>) -> PyResult<StitchOptions> {
        let wishes = Wishes::of(keywords, "compose", self.options.clone())?;
        let mut unchanged = wishes.options.clone();
        unchanged.compose.output = self.options.compose.output.clone();
        if unchanged != self.options {
            let error = Error::input(
                "save",
                "of a panorama that is composed, only options of its file can be changed",
                "Give quality, depth, background, or options of the table output; give others to stitch or compose.",
            );
            return Err(exception(keywords.py(), error));
        }
        Ok(wishes.options)
    }
}

/// A picture of 8-bit RGB, height x width x 3, as PNG.
#[pyfunction]
pub(crate) fn png<'py>(py: Python<'py>, picture: PyReadonlyArray3<'py, u8>) -> PyResult<Bound<'py, PyBytes>> {
    let failed = |reason: String| exception(py, Error::input("picture", reason, ""));
    let &[height, width, 3] = picture.shape() else { return Err(failed("it is not height x width x 3".to_owned())) };
    let samples = picture.as_slice().map_err(|error| failed(error.to_string()))?;
    let size = |side: usize| u32::try_from(side).map_err(|error| failed(error.to_string()));
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, size(width)?, size(height)?);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_compression(::png::Compression::Fast);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(samples));
    written.map_err(|error| failed(error.to_string()))?;
    Ok(PyBytes::new(py, &bytes))
}
