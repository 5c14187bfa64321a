//! Photographs as Python has them: names of files, or arrays.

use numpy::{Element, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use trueup::{Error, InMemory, Photograph, Raster, Result};

use crate::errors::exception;

/// Values of floating point pictures from which on they cannot be meant as 0 to 1, with some overshoot of resampling.
const TOO_BRIGHT: f32 = 2.0;

/// One input.
#[derive(Debug, FromPyObject)]
pub(crate) enum GivenPhotograph<'py> {
    /// A file, folder or pattern.
    #[pyo3(transparent)]
    Named(String),
    /// A name, and pixels: a C-contiguous array of height x width x 1, 3 or 4.
    Array(String, Bound<'py, PyAny>),
}

/// The names of the inputs in their order, and the pixels of those that are no files.
pub(crate) fn collected(given: Vec<GivenPhotograph<'_>>) -> PyResult<(Vec<String>, InMemory)> {
    let mut names = Vec::with_capacity(given.len());
    let mut in_memory = InMemory::default();
    for one in given {
        match one {
            GivenPhotograph::Named(name) => names.push(name),
            GivenPhotograph::Array(name, array) => {
                in_memory.insert(&name, photograph(&name, &array)?);
                names.push(name);
            }
        }
    }
    Ok((names, in_memory))
}

/// A copy of an array's pixels.
fn photograph(name: &str, array: &Bound<'_, PyAny>) -> PyResult<Photograph> {
    let read = if let Ok(array) = array.extract::<PyReadonlyArrayDyn<'_, u8>>() {
        raster(name, &array, <[u8]>::to_vec).map(Photograph::Eight)
    } else if let Ok(array) = array.extract::<PyReadonlyArrayDyn<'_, u16>>() {
        raster(name, &array, <[u16]>::to_vec).map(Photograph::Sixteen)
    } else if let Ok(array) = array.extract::<PyReadonlyArrayDyn<'_, f32>>() {
        sixteen_bits(name, &array).map(Photograph::Sixteen)
    } else {
        Err(Error::input(name, "it is no array of uint8, uint16 or float32", "Convert it with astype."))
    };
    read.map_err(|error| exception(array.py(), error))
}

/// The samples that `convert` makes of an array, as a picture.
fn raster<T: Element, S: Copy + Default>(
    name: &str,
    array: &PyReadonlyArrayDyn<'_, T>,
    convert: impl Fn(&[T]) -> Vec<S>,
) -> Result<Raster<S>> {
    let &[height, width, channels @ (1 | 3 | 4)] = array.shape() else {
        let shape: Vec<String> = array.shape().iter().map(usize::to_string).collect();
        let reason = format!("its shape is {}", shape.join(" x "));
        return Err(Error::input(name, reason, "Give height x width x 3 (RGB), x 4 (RGBA), or height x width (gray)."));
    };
    let samples =
        array.as_slice().map_err(|_| Error::input(name, "its rows do not follow each other in memory", ""))?;
    Raster::from_data(width, height, channels, convert(samples))
}

/// Floating point values of encoded light, 0 to 1, as 16 bits; what is outside is cut off, and what is no number is
/// black.
fn sixteen_bits(name: &str, array: &PyReadonlyArrayDyn<'_, f32>) -> Result<Raster<u16>> {
    let full = f32::from(u16::MAX);
    if array.as_slice().is_ok_and(|samples| samples.iter().any(|&sample| sample >= TOO_BRIGHT)) {
        let reason = format!("it has values of {TOO_BRIGHT} and more; floating point pictures are 0 to 1");
        return Err(Error::input(name, reason, "Divide it by its largest possible value, or convert it to uint8."));
    }
    // The cast takes what is no number to 0, and cuts off.
    raster(name, array, |samples| samples.iter().map(|&sample| (sample * full + 0.5) as u16).collect())
}
