//! The AprilTag C library: with [`crate::vector`] all unsafe code of this crate.
//!
//! Each [`Engine`] owns one detector and one family; nothing of either is shared, so an engine may move
//! between threads but is used by one at a time (`&mut self`).

#![expect(unsafe_code, reason = "calls into the AprilTag C library; kept to this file")]

use std::marker::PhantomData;
use std::ptr::NonNull;

use apriltag_sys as sys;

use super::DetectorError;
use crate::image::GrayImage;

/// Smallest image that the library's thresholding (tiles of four pixels) can work on.
const LEAST_SIDE: u32 = 16;

/// What the library reports about one tag: its own corner convention (pixel centres at +0.5).
#[derive(Debug)]
pub(super) struct Raw {
    pub id: u32,
    pub hamming: u32,
    pub margin: f32,
    pub corners: [[f64; 2]; 4],
}

/// A grey image whose size was checked against its bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    width: i32,
    height: i32,
    pixels: PhantomData<&'a [u8]>,
    data: *const u8,
}

impl<'a> View<'a> {
    /// `None` if the image is too small to hold a tag, or larger than its bytes.
    pub fn new(width: u32, height: u32, data: &'a [u8]) -> Option<Self> {
        let fits = data.len() >= width as usize * height as usize;
        if !fits || width < LEAST_SIDE || height < LEAST_SIDE {
            return None;
        }
        let (width, height) = (i32::try_from(width).ok()?, i32::try_from(height).ok()?);
        Some(Self { width, height, pixels: PhantomData, data: data.as_ptr() })
    }
}

/// A detector and its family.
#[derive(Debug)]
pub(super) struct Engine {
    detector: NonNull<sys::apriltag_detector_t>,
    family: NonNull<sys::apriltag_family_t>,
    /// The id of each code that the family holds.
    ids: Vec<u32>,
    /// What the family's `codes` points to: the library's own table is shared by all families.
    codes: Vec<u64>,
}

// SAFETY: the detector and its family are owned by the engine alone and hold no thread-local state.
unsafe impl Send for Engine {}

impl Engine {
    pub fn new(ids: &[u32]) -> Result<Self, DetectorError> {
        let mut ids = ids.to_vec();
        ids.sort_unstable();
        ids.dedup();
        // SAFETY: returns a family that we own, or null.
        let family = NonNull::new(unsafe { sys::tag36h11_create() }).ok_or(DetectorError::OutOfMemory)?;
        // SAFETY: returns a detector that we own, or null.
        let Some(detector) = NonNull::new(unsafe { sys::apriltag_detector_create() }) else {
            // SAFETY: the family is ours and nobody else holds it.
            unsafe { sys::tag36h11_destroy(family.as_ptr()) };
            return Err(DetectorError::OutOfMemory);
        };
        let mut engine = Self { detector, family, ids, codes: Vec::new() };
        // SAFETY: the library's `codes` holds `ncodes` numbers, which are copied. Ours outlive the family,
        // and the vector is not changed any more. The family is handed over after that.
        unsafe {
            let family = &mut *engine.family.as_ptr();
            for &id in &engine.ids {
                if id >= family.ncodes {
                    return Err(DetectorError::UnknownId(id));
                }
                engine.codes.push(*family.codes.add(id as usize));
            }
            family.codes = engine.codes.as_mut_ptr();
            family.ncodes = u32::try_from(engine.codes.len()).unwrap_or(0);
            let detector = &mut *engine.detector.as_ptr();
            detector.nthreads = 1;
            detector.refine_edges = true;
            sys::apriltag_detector_add_family_bits(detector, family, 1);
        }
        Ok(engine)
    }

    /// Searches a view; `decimate` of 1 or more.
    pub fn detect(&mut self, view: View<'_>, decimate: f32) -> Vec<Raw> {
        // The library only reads the image, although its type is mutable.
        let mut image = sys::image_u8_t {
            width: view.width,
            height: view.height,
            stride: view.width,
            buf: view.data.cast_mut(),
        };
        // SAFETY: the detector is ours and set up; the image lives through the call and its size was
        // checked; the list and its elements are ours until they are destroyed below, and are copied out.
        unsafe {
            (*self.detector.as_ptr()).quad_decimate = decimate;
            let list = sys::apriltag_detector_detect(self.detector.as_ptr(), &raw mut image);
            if list.is_null() {
                return Vec::new();
            }
            let count = usize::try_from((*list).size).unwrap_or(0);
            let elements = (*list).data.cast::<*const sys::apriltag_detection_t>();
            let found = (0..count)
                .filter_map(|k| {
                    let found = &**elements.add(k);
                    let id = *self.ids.get(usize::try_from(found.id).ok()?)?;
                    let hamming = u32::try_from(found.hamming).ok()?;
                    Some(Raw { id, hamming, margin: found.decision_margin, corners: found.p })
                })
                .collect();
            sys::apriltag_detections_destroy(list);
            found
        }
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        // SAFETY: both are ours; the detector goes first because it refers to the family.
        unsafe {
            sys::apriltag_detector_destroy(self.detector.as_ptr());
            sys::tag36h11_destroy(self.family.as_ptr());
        }
    }
}

/// The picture of a tag, one pixel a cell.
pub(super) fn tag_bitmap(id: u32) -> Option<GrayImage> {
    // SAFETY: the family and the image are ours between creation and destruction; the id is checked; rows
    // are `stride` bytes apart and hold `width` pixels.
    unsafe {
        let family = NonNull::new(sys::tag36h11_create())?;
        let image = if id < family.as_ref().ncodes {
            NonNull::new(sys::apriltag_to_image(family.as_ptr(), id))
        } else {
            None
        };
        let copy = image.and_then(|image| {
            let sys::image_u8_t { width, height, stride, buf } = *image.as_ptr();
            let (width, height) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
            let stride = usize::try_from(stride).ok()?;
            let rows =
                (0..height as usize).map(|y| std::slice::from_raw_parts(buf.add(y * stride), width as usize));
            let data: Vec<u8> = rows.flatten().copied().collect();
            sys::image_u8_destroy(image.as_ptr());
            GrayImage::new(width, height, data).ok()
        });
        sys::tag36h11_destroy(family.as_ptr());
        copy
    }
}
