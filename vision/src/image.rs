//! Grey images, and what a camera delivers.

use std::fmt;

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Vector};
use opencv::imgcodecs;
use opencv::prelude::VectorToVec;

/// An 8-bit grey image without padding between its rows.
#[derive(Clone, PartialEq, Eq)]
pub struct GrayImage {
    width: u32,
    height: u32,
    data: Vec<u8>,
}

/// Why bytes are not an image that the rig can use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// Sizes do not multiply to the number of bytes.
    #[error("{bytes} bytes are not a grey image of {width}x{height} pixels")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Bytes that were given.
        bytes: usize,
    },
    /// Neither JPEG nor PNG, or damaged.
    #[error("{bytes} bytes cannot be decoded as an image ({reason})")]
    Undecodable {
        /// Bytes that were given.
        bytes: usize,
        /// What the decoder said.
        reason: String,
    },
    /// The encoder failed.
    #[error("the image cannot be encoded ({reason})")]
    Unencodable {
        /// What the encoder said.
        reason: String,
    },
}

impl GrayImage {
    /// Takes pixels row by row.
    pub fn new(width: u32, height: u32, data: Vec<u8>) -> Result<Self, ImageError> {
        let bytes = data.len();
        if width as usize * height as usize == bytes {
            Ok(Self { width, height, data })
        } else {
            Err(ImageError::Size { width, height, bytes })
        }
    }

    /// Decodes JPEG, PNG and whatever else OpenCV can read; colour becomes grey.
    pub fn decode(bytes: &[u8]) -> Result<Self, ImageError> {
        Self::decode_as(bytes, imgcodecs::IMREAD_GRAYSCALE)
    }

    fn decode_as(bytes: &[u8], how: i32) -> Result<Self, ImageError> {
        let undecodable = |reason: &dyn fmt::Display| ImageError::Undecodable {
            bytes: bytes.len(),
            reason: reason.to_string(),
        };
        let mat =
            imgcodecs::imdecode(&Vector::from_slice(bytes), how).map_err(|error| undecodable(&error))?;
        if mat.empty() {
            return Err(undecodable(&"unknown or damaged format"));
        }
        Self::from_mat(&mat).map_err(|error| undecodable(&error))
    }

    /// [`GrayImage::decode`] at half the size, which costs a JPEG a third.
    pub fn decode_half(bytes: &[u8]) -> Result<Self, ImageError> {
        Self::decode_as(bytes, imgcodecs::IMREAD_REDUCED_GRAYSCALE_2)
    }

    /// The mean of each two by two pixels.
    pub fn half(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut data = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            let (above, below) = (self.row(2 * y), self.row(2 * y + 1));
            let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
            data.extend(pairs.map(|(a, b)| {
                let sum: u16 = a.iter().chain(b).map(|&pixel| u16::from(pixel)).sum();
                u8::try_from((sum + 2) / 4).unwrap_or(u8::MAX)
            }));
        }
        Self { width, height, data }
    }

    /// Encodes as JPEG; `quality` 0 to 100.
    pub fn to_jpeg(&self, quality: i32) -> Result<Vec<u8>, ImageError> {
        let failed = |error: opencv::Error| ImageError::Unencodable { reason: error.message };
        let mat = Mat::new_rows_cols_with_data(
            i32::try_from(self.height).unwrap_or(i32::MAX),
            i32::try_from(self.width).unwrap_or(i32::MAX),
            &self.data,
        )
        .map_err(failed)?;
        let mut bytes = Vector::<u8>::new();
        let parameters = Vector::from_slice(&[imgcodecs::IMWRITE_JPEG_QUALITY, quality]);
        imgcodecs::imencode(".jpg", &mat, &mut bytes, &parameters).map_err(failed)?;
        Ok(bytes.to_vec())
    }

    /// Copies a matrix of one byte a pixel.
    pub(crate) fn from_mat(mat: &Mat) -> Result<Self, opencv::Error> {
        let (width, height) = (mat.cols().unsigned_abs(), mat.rows().unsigned_abs());
        let data = if mat.is_continuous() {
            mat.data_typed::<u8>()?.to_vec()
        } else {
            mat.try_clone()?.data_typed::<u8>()?.to_vec()
        };
        Ok(Self { width, height, data })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The pixels, row by row.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// One row of pixels.
    pub fn row(&self, y: u32) -> &[u8] {
        let width = self.width as usize;
        &self.data[y as usize * width..][..width]
    }
}

impl fmt::Debug for GrayImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "GrayImage({}x{})", self.width, self.height)
    }
}

/// What one camera saw at one instant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Index into the rig's cameras.
    pub camera: usize,
    /// When it was exposed: nanoseconds of the station's monotonic clock.
    pub capture_ns: u64,
    /// The image, maybe still encoded: decoding is left to whoever needs the pixels.
    pub pixels: Pixels,
}

/// The image of a [`Frame`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pixels {
    /// Ready to use.
    Gray(GrayImage),
    /// JPEG or PNG.
    Encoded(Vec<u8>),
}

impl Pixels {
    /// The grey image; decodes if need be.
    pub fn to_gray(&self) -> Result<std::borrow::Cow<'_, GrayImage>, ImageError> {
        match self {
            Self::Gray(image) => Ok(std::borrow::Cow::Borrowed(image)),
            Self::Encoded(bytes) => GrayImage::decode(bytes).map(std::borrow::Cow::Owned),
        }
    }

    /// The grey image at half its size, for previews.
    pub fn to_gray_half(&self) -> Result<GrayImage, ImageError> {
        match self {
            Self::Gray(image) => Ok(image.half()),
            Self::Encoded(bytes) => GrayImage::decode_half(bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_no_image_are_an_error() {
        assert!(matches!(GrayImage::decode(b""), Err(ImageError::Undecodable { .. })));
        assert!(matches!(GrayImage::decode(b"no image"), Err(ImageError::Undecodable { .. })));
        assert!(matches!(GrayImage::new(3, 2, vec![0; 5]), Err(ImageError::Size { .. })));
    }

    #[test]
    fn half_an_image_is_the_mean_of_its_pixels_and_jpeg_keeps_it() {
        let sut = GrayImage::new(32, 16, (0..512u32).map(|i| (i % 32 * 4) as u8).collect()).expect("size");
        let half = sut.half();
        assert_eq!((half.width(), half.height(), &half.row(7)[..3]), (16, 8, &[2u8, 10, 18][..]));
        let decoded = Pixels::Encoded(sut.to_jpeg(95).expect("encode")).to_gray_half().expect("decode");
        assert_eq!((decoded.width(), decoded.height()), (16, 8));
        let worst = half.data().iter().zip(decoded.data()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(4), "{worst:?}");
    }

    #[test]
    fn a_png_comes_back_as_it_was_written() {
        let sut = GrayImage::new(3, 2, vec![0, 50, 100, 150, 200, 255]).expect("size");
        let mat = Mat::new_rows_cols_with_data(2, 3, sut.data()).expect("mat");
        let mut bytes = Vector::<u8>::new();
        imgcodecs::imencode(".png", &mat, &mut bytes, &Vector::new()).expect("encode");
        let pixels = Pixels::Encoded(bytes.iter().collect());
        assert_eq!(*pixels.to_gray().expect("decode"), sut);
        assert_eq!(sut.row(1), [150, 200, 255]);
    }
}
