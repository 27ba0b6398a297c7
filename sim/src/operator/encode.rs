//! Pictures as files: JPEG for recordings, PNG for folders.

use opencv::core::{Mat, Vector};
use opencv::imgcodecs;

use super::studio::Picture;

/// Fast: noise does not compress anyway.
const PNG_LEVEL: i32 = 1;

/// As a gray JPEG file, of the scene's quality.
pub fn jpeg(picture: &Picture) -> opencv::Result<Vec<u8>> {
    encode(picture, ".jpg", &[imgcodecs::IMWRITE_JPEG_QUALITY, picture.jpeg_quality])
}

/// As a gray PNG file.
pub fn png(picture: &Picture) -> opencv::Result<Vec<u8>> {
    encode(picture, ".png", &[imgcodecs::IMWRITE_PNG_COMPRESSION, PNG_LEVEL])
}

fn encode(picture: &Picture, extension: &str, parameters: &[i32]) -> opencv::Result<Vec<u8>> {
    let image = Mat::new_rows_cols_with_data(picture.height as i32, picture.width as i32, &picture.grey)?;
    let mut bytes = Vector::new();
    imgcodecs::imencode(extension, &image, &mut bytes, &Vector::from_slice(parameters))?;
    Ok(bytes.into())
}
