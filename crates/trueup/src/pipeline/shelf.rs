//! Where photographs' features are from when they are measured until they are matched: in memory as far as there is
//! room, else in a scratch file. They are most of what is known of a photograph, and only two of them are looked at at
//! a time.

use std::borrow::Cow;
use std::sync::{Arc, Mutex, PoisonError};

use trueup_core::Result;
use trueup_core::raster::Raster;
use trueup_core::scratch::{ScratchFile, ScratchSpace};
use trueup_vision::features::{DESCRIPTOR_LENGTH, FeaturePoint, FeatureSource, Features, no_photograph};

/// What a point takes in the file: position, scale and response.
type StoredPoint = [f64; 4];

/// Room for the features of some photographs, in memory and on the disk.
pub(crate) struct Shelf<'a> {
    scratch: &'a dyn ScratchSpace,
    /// Photographs that will be put there.
    photographs: usize,
    taken: Mutex<Taken>,
}

/// What of a shelf is taken.
struct Taken {
    /// Bytes of memory left.
    memory: usize,
    /// The file, where one was wanted and could be made.
    file: Option<Arc<dyn ScratchFile>>,
    /// Where it ends.
    end: u64,
    /// Whether the disk refused: features stay in memory then, however little there is, since without them nothing goes
    /// on.
    is_refused: bool,
}

impl<'a> Shelf<'a> {
    /// A shelf for so many photographs, of which `memory` bytes are in memory and the rest in `scratch`.
    pub(crate) fn new(scratch: &'a dyn ScratchSpace, photographs: usize, memory: usize) -> Self {
        Self { scratch, photographs, taken: Mutex::new(Taken { memory, file: None, end: 0, is_refused: false }) }
    }

    /// Puts a photograph's features there. Where each comes to lie does not matter to who takes them.
    pub(crate) fn put(&self, features: Features) -> ShelvedFeatures {
        let bytes = bytes_of(&features);
        let Some((file, offset)) = self.place(bytes) else { return ShelvedFeatures::Held(features) };
        let place = Place::new(offset, &features);
        match place.write(&features, file.as_ref()) {
            Ok(()) => ShelvedFeatures::OnDisk { file, place },
            Err(_) => {
                self.taken.lock().unwrap_or_else(PoisonError::into_inner).is_refused = true;
                ShelvedFeatures::Held(features)
            }
        }
    }

    /// A place in the file for so many bytes; `None` where they are to stay in memory.
    fn place(&self, bytes: usize) -> Option<(Arc<dyn ScratchFile>, u64)> {
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        if bytes <= taken.memory {
            taken.memory -= bytes;
            return None;
        }
        if taken.is_refused {
            return None;
        }
        if taken.file.is_none() {
            // As if all were like this one.
            match self.scratch.create((bytes as u64).saturating_mul(self.photographs as u64)) {
                Ok(file) => taken.file = Some(Arc::from(file)),
                Err(_) => taken.is_refused = true,
            }
        }
        let file = taken.file.clone()?;
        let offset = taken.end;
        taken.end += bytes as u64;
        Some((file, offset))
    }
}

/// The features of a photograph, wherever they are. What is in a file goes with the last that is in it.
#[derive(Debug)]
pub(crate) enum ShelvedFeatures {
    Held(Features),
    OnDisk { file: Arc<dyn ScratchFile>, place: Place },
}

impl Default for ShelvedFeatures {
    fn default() -> Self {
        Self::Held(Features::default())
    }
}

impl ShelvedFeatures {
    /// The features themselves.
    ///
    /// # Errors
    /// [`trueup_core::Error::Io`] if they cannot be read.
    pub(crate) fn get(&self) -> Result<Cow<'_, Features>> {
        match self {
            Self::Held(features) => Ok(Cow::Borrowed(features)),
            Self::OnDisk { file, place } => place.read(file.as_ref()).map(Cow::Owned),
        }
    }

    /// Whether there are descriptors.
    pub(crate) fn has_descriptors(&self) -> bool {
        match self {
            Self::Held(features) => !features.descriptors.is_empty(),
            Self::OnDisk { place, .. } => place.descriptors > 0,
        }
    }

    /// The same in another place.
    pub(crate) fn put_on(self, shelf: &Shelf) -> Self {
        match self {
            Self::Held(features) => shelf.put(features),
            on_disk => on_disk,
        }
    }
}

/// The features of photographs, wherever they are; none of those that could not be decoded, which are `None`.
#[derive(Debug)]
pub(crate) struct FeaturesOnShelf<'a>(pub Vec<Option<&'a ShelvedFeatures>>);

impl FeatureSource for FeaturesOnShelf<'_> {
    fn photographs(&self) -> usize {
        self.0.len()
    }

    fn features(&self, photograph: usize) -> Result<Cow<'_, Features>> {
        match self.0.get(photograph) {
            Some(Some(features)) => features.get(),
            Some(None) => Ok(Cow::Owned(Features::default())),
            None => Err(no_photograph(photograph)),
        }
    }

    fn has_features(&self, photograph: usize) -> bool {
        self.0.get(photograph).copied().flatten().is_some_and(ShelvedFeatures::has_descriptors)
    }
}

/// Where in a file features lie: points, then descriptors, then the points of these, then what surrounds them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    offset: u64,
    points: usize,
    descriptors: usize,
    /// Width, height and channels of what surrounds them.
    surroundings: [usize; 3],
}

impl Place {
    /// Where so many bytes of features begin.
    fn new(offset: u64, features: &Features) -> Self {
        let Features { points, descriptors, surroundings, .. } = features;
        let surroundings = [surroundings.width(), surroundings.height(), surroundings.channels()];
        Self { offset, points: points.len(), descriptors: descriptors.len(), surroundings }
    }

    /// Where descriptors, their points and what surrounds them begin.
    fn offsets(&self) -> [u64; 3] {
        let descriptors = self.offset + (self.points * size_of::<StoredPoint>()) as u64;
        let owners = descriptors + (self.descriptors * DESCRIPTOR_LENGTH) as u64;
        [descriptors, owners, owners + (self.descriptors * size_of::<u32>()) as u64]
    }

    fn write(&self, features: &Features, file: &dyn ScratchFile) -> Result<()> {
        let stored = |point: &FeaturePoint| -> StoredPoint {
            [point.position[0], point.position[1], point.scale_px, point.response]
        };
        let points: Vec<StoredPoint> = features.points.iter().map(stored).collect();
        let [descriptors, owners, surroundings] = self.offsets();
        file.write_at(bytemuck::cast_slice(&points), self.offset)?;
        file.write_at(features.descriptors.as_flattened(), descriptors)?;
        file.write_at(bytemuck::cast_slice(&features.descriptor_points), owners)?;
        file.write_at(features.surroundings.data(), surroundings)
    }

    fn read(&self, file: &dyn ScratchFile) -> Result<Features> {
        let mut points: Vec<StoredPoint> = vec![[0.0; 4]; self.points];
        let mut descriptors = vec![[0; DESCRIPTOR_LENGTH]; self.descriptors];
        let mut descriptor_points = vec![0_u32; self.descriptors];
        let [width, height, channels] = self.surroundings;
        let mut surroundings = Raster::new(width, height, channels);
        let offsets = self.offsets();
        file.read_at(bytemuck::cast_slice_mut(&mut points), self.offset)?;
        file.read_at(descriptors.as_flattened_mut(), offsets[0])?;
        file.read_at(bytemuck::cast_slice_mut(&mut descriptor_points), offsets[1])?;
        file.read_at(surroundings.data_mut(), offsets[2])?;
        let restored =
            |&[x, y, scale_px, response]: &StoredPoint| FeaturePoint { position: [x, y], scale_px, response };
        Ok(Features { points: points.iter().map(restored).collect(), descriptors, descriptor_points, surroundings })
    }
}

/// What features take, in memory as in a file.
fn bytes_of(features: &Features) -> usize {
    let Features { points, descriptors, descriptor_points, surroundings } = features;
    size_of_val(points.as_slice())
        + size_of_val(descriptors.as_slice())
        + size_of_val(descriptor_points.as_slice())
        + surroundings.data().len()
}

#[cfg(test)]
mod tests {
    use trueup_core::scratch::NoScratch;
    use trueup_io::scratch::ScratchFolder;

    use super::*;

    fn features(count: usize) -> Features {
        let point = |k: usize| FeaturePoint {
            position: [k as f64 + 0.1, 2.0 * k as f64],
            scale_px: 1.6 + k as f64,
            response: 9.0 / (k + 1) as f64,
        };
        Features {
            points: (0..count).map(point).collect(),
            // Two of every point.
            descriptors: (0..2 * count).map(|k| std::array::from_fn(|entry| (7 * k + entry) as u8)).collect(),
            descriptor_points: (0..2 * count as u32).map(|k| k / 2).collect(),
            surroundings: Raster::from_data(count, 4, 1, (0..4 * count).map(|k| k as u8).collect()).expect("as many"),
        }
    }

    fn is_same(one: &Features, other: &Features) -> bool {
        one.points == other.points
            && one.descriptors == other.descriptors
            && one.descriptor_points == other.descriptor_points
            && one.surroundings == other.surroundings
    }

    /// Of ten points: 10 of 32 bytes, 20 times 128 and 4 bytes, and 40 pixels: 3000 in all.
    #[test]
    fn what_has_no_room_in_memory_comes_back_from_the_disk() {
        let desk = tempfile::tempdir().expect("a folder");
        let scratch = ScratchFolder::new(desk.path());
        assert_eq!(bytes_of(&features(10)), 3000);
        let shelf = Shelf::new(&scratch, 3, 3000);
        let shelved = [10, 11, 0, 4].map(|count| shelf.put(features(count)));
        let on_disk = shelved.each_ref().map(|one| matches!(one, ShelvedFeatures::OnDisk { .. }));
        assert_eq!(on_disk, [false, true, false, true]);
        for (one, count) in shelved.iter().zip([10, 11, 0, 4]) {
            assert!(is_same(&one.get().expect("there"), &features(count)));
            assert_eq!(one.has_descriptors(), count > 0);
        }
        drop(shelf);
        assert!(is_same(&shelved[3].get().expect("still there"), &features(4)));
        drop(shelved);
        assert_eq!(desk.path().read_dir().expect("our own folder").count(), 0);
    }

    /// A disk that takes nothing costs memory, not photographs.
    #[test]
    fn without_a_disk_everything_stays_in_memory() {
        let shelf = Shelf::new(&NoScratch, 2, 0);
        let shelved = [5, 6].map(|count| shelf.put(features(count)));
        assert!(shelved.iter().all(|one| matches!(one, ShelvedFeatures::Held(_))));
        assert!(is_same(&shelved[1].get().expect("there"), &features(6)));
    }
}
