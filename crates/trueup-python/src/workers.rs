//! One panorama that is divided among programs: a callable hands tasks out, and this is what does them.

use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyIterator};
use trueup::{Error, Result, TakeResult, Workers};

use crate::work::{Surroundings, run};

/// A callable that has tasks done, and the exception that it or its iterator raised.
pub(crate) struct Handing {
    callable: Py<PyAny>,
    raised: Mutex<Option<PyErr>>,
}

impl Handing {
    pub(crate) fn new(callable: Option<Bound<'_, PyAny>>) -> Option<Self> {
        Some(Self { callable: callable?.unbind(), raised: Mutex::default() })
    }

    /// As the stitcher takes it.
    pub(crate) fn workers(this: Option<&Self>) -> Option<&dyn Workers> {
        this.map(|this| this as &dyn Workers)
    }

    /// What work came to; the exception first that ended it.
    pub(crate) fn outcome<T>(this: Option<Self>, outcome: PyResult<T>) -> PyResult<T> {
        let raised = this.and_then(|this| this.raised.into_inner().unwrap_or_else(PoisonError::into_inner));
        match (outcome, raised) {
            (Err(_), Some(raised)) => Err(raised),
            (outcome, _) => outcome,
        }
    }

    /// Hands the tasks out; the results are to be had from the iterator.
    fn hand_out(&self, common: &[u8], tasks: &[Vec<u8>]) -> PyResult<Py<PyIterator>> {
        Python::attach(|py| {
            let tasks: Vec<_> = tasks.iter().map(|task| PyBytes::new(py, task)).collect();
            let results = self.callable.bind(py).call1((PyBytes::new(py, common), tasks))?;
            Ok(results.try_iter()?.unbind())
        })
    }

    /// The next result.
    fn next(results: &Py<PyIterator>) -> PyResult<Option<(usize, Vec<u8>)>> {
        Python::attach(|py| {
            let Some(result) = results.bind(py).clone().next().transpose()? else { return Ok(None) };
            let wrong = |_| PyRuntimeError::new_err("workers yield a task's number and its bytes");
            let (number, bytes): (usize, Bound<'_, PyBytes>) = result.extract().map_err(wrong)?;
            Ok(Some((number, bytes.as_bytes().to_vec())))
        })
    }

    /// Keeps what was raised, and ends the work.
    fn raised(&self, raised: PyErr) -> Error {
        *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(raised);
        Error::Cancelled
    }
}

impl Workers for Handing {
    fn run(&self, common: &[u8], tasks: Vec<Vec<u8>>, take: TakeResult<'_>) -> Result<()> {
        let results = self.hand_out(common, &tasks).map_err(|raised| self.raised(raised))?;
        drop(tasks);
        // The interpreter is let go while a result is taken.
        while let Some((number, bytes)) = Self::next(&results).map_err(|raised| self.raised(raised))? {
            take(number, bytes)?;
        }
        Ok(())
    }
}

/// Does the tasks of a panorama that another program stitches.
#[pyclass(frozen, module = "trueup._trueup")]
#[derive(Debug)]
pub(crate) struct Worker {
    worker: trueup::Worker,
    threads: usize,
}

#[pymethods]
impl Worker {
    /// Gets ready for tasks that have `common` in common, on so many threads (0: one per core).
    #[new]
    fn new(py: Python<'_>, common: Vec<u8>, threads: usize) -> PyResult<Self> {
        let surroundings = Surroundings { progress: None, threads };
        let worker = run(py, surroundings, |context| trueup::Worker::new(&common, context))?;
        Ok(Self { worker, threads })
    }

    /// What a task comes to.
    fn run<'py>(&self, py: Python<'py>, task: Vec<u8>) -> PyResult<Bound<'py, PyBytes>> {
        let surroundings = Surroundings { progress: None, threads: self.threads };
        let result = run(py, surroundings, |context| self.worker.run(&task, context))?;
        Ok(PyBytes::new(py, &result))
    }
}
