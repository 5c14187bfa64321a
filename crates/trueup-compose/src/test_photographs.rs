//! What the tests of composing share: photographs in memory, scratch files in memory, layouts.

use std::sync::Arc;

use nalgebra::Vector2;
use trueup_core::mesh::GridMesh;
use trueup_core::raster::{Photograph, Raster};
use trueup_core::scratch::{ScratchFile, ScratchSpace};
use trueup_core::source::PhotographSource;
use trueup_core::{Error, Result};

use crate::layout::{CanvasLayout, Placed};

/// Photographs in memory.
pub(crate) struct Memory(pub(crate) Vec<Photograph>);

impl PhotographSource for Memory {
    fn photograph(&self, index: usize) -> Result<Photograph> {
        self.0.get(index).cloned().ok_or_else(|| Error::input(index, "no such photograph", ""))
    }
}

/// A scratch file in memory that takes at most so many bytes.
#[derive(Debug)]
pub(crate) struct RamDisk {
    room: u64,
    bytes: Arc<std::sync::Mutex<Vec<u8>>>,
}

impl Default for RamDisk {
    fn default() -> Self {
        Self { room: u64::MAX, bytes: Default::default() }
    }
}

impl RamDisk {
    /// An empty one with so much room.
    pub(crate) fn of_room(room: u64) -> Self {
        Self { room, ..Self::default() }
    }

    /// The most that was written.
    pub(crate) fn length(&self) -> usize {
        self.bytes.lock().expect("no writer failed").len()
    }
}

impl ScratchSpace for RamDisk {
    fn create(&self, _: u64) -> Result<Box<dyn ScratchFile>> {
        Ok(Box::new(Self { room: self.room, bytes: self.bytes.clone() }))
    }
}

impl ScratchFile for RamDisk {
    fn write_at(&self, bytes: &[u8], offset: u64) -> Result<()> {
        let end = offset as usize + bytes.len();
        if end as u64 > self.room {
            return Err(Error::io("writing", std::path::Path::new("disk"), std::io::ErrorKind::StorageFull.into()));
        }
        let mut all = self.bytes.lock().expect("no writer failed");
        let length = all.len().max(end);
        all.resize(length, 0);
        all[offset as usize..end].copy_from_slice(bytes);
        Ok(())
    }

    fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<()> {
        let all = self.bytes.lock().expect("no writer failed");
        bytes.copy_from_slice(&all[offset as usize..][..bytes.len()]);
        Ok(())
    }
}

pub(crate) fn noise(width: usize, height: usize, channels: usize) -> Raster<u8> {
    let data = (0..width * height * channels).map(|i| ((i * 2_654_435_761) >> 13) as u8).collect();
    Raster::from_data(width, height, channels, data).expect("as many samples")
}

pub(crate) fn gradient(width: usize, height: usize, level: impl Fn(f64, f64) -> f64) -> Photograph {
    let data = (0..width * height)
        .flat_map(|i| [level((i % width) as f64 + 0.5, (i / width) as f64 + 0.5).round() as u8; 3])
        .collect();
    Photograph::Eight(Raster::from_data(width, height, 3, data).expect("as many samples"))
}

pub(crate) fn moved(photograph: usize, width: f64, height: f64, move_to: impl Fn(Vector2<f64>) -> [f64; 2]) -> Placed {
    let mut mesh = GridMesh::regular(width, height, 20.0);
    for vertex in &mut mesh.target {
        *vertex = move_to(Vector2::from(*vertex));
    }
    Placed { photograph, mesh }
}

pub(crate) fn canvas(width: usize, height: usize, placed: Vec<Placed>) -> CanvasLayout {
    CanvasLayout { width, height, canvas_from_target: 1.0, origin: [0.0; 2], placed, period: None }
}
