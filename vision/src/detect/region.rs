//! Parts of an image: where to search, cut out and maybe enlarged.

use crate::image::GrayImage;

/// A rectangle of whole pixels, inside an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Rect {
    /// The pixels within the bounds (in pixel coordinates) that lie inside an image; `None` if none do.
    pub fn clipped(min: [f64; 2], max: [f64; 2], width: u32, height: u32) -> Option<Self> {
        let clip = |value: f64, size: u32| value.clamp(0.0, f64::from(size)) as u32;
        let (x, y) = (clip(min[0].floor(), width), clip(min[1].floor(), height));
        let (right, bottom) = (clip(max[0].ceil() + 1.0, width), clip(max[1].ceil() + 1.0, height));
        (right > x && bottom > y).then(|| Self { x, y, width: right - x, height: bottom - y })
    }

    /// The smallest rectangle that holds both.
    pub fn union(&self, other: &Self) -> Self {
        let x = self.x.min(other.x);
        let y = self.y.min(other.y);
        let right = (self.x + self.width).max(other.x + other.width);
        let bottom = (self.y + self.height).max(other.y + other.height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// Number of pixels.
    pub fn area(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// A rectangle to search, and how finely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Where.
    pub rect: Rect,
    /// 2: every other pixel; 1: every pixel; 0.5: enlarged twice, for tags whose cells are below 2.5 pixels.
    pub decimate: f32,
}

/// How coordinates in a cut-out relate to the image: `image = cut / enlarged + (x, y)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub x: u32,
    pub y: u32,
    pub enlarged: f64,
}

impl Region {
    /// Cuts the region out into `scratch`; its size and place, or `None` if it is not inside the image.
    pub(super) fn extract(&self, image: &GrayImage, scratch: &mut Vec<u8>) -> Option<((u32, u32), Window)> {
        let Rect { x, y, width, height } = self.rect;
        let inside = x.checked_add(width)? <= image.width() && y.checked_add(height)? <= image.height();
        if !inside || width == 0 || height == 0 {
            return None;
        }
        scratch.clear();
        let rows = (y..y + height).map(|row| &image.row(row)[x as usize..(x + width) as usize]);
        if self.decimate < 1.0 {
            enlarge_twice(&rows.collect::<Vec<_>>(), scratch);
            return Some(((2 * width, 2 * height), Window { x, y, enlarged: 2.0 }));
        }
        rows.for_each(|row| scratch.extend_from_slice(row));
        Some(((width, height), Window { x, y, enlarged: 1.0 }))
    }
}

/// Bilinear interpolation: each new pixel's centre lies a quarter pixel from the nearest old one.
fn enlarge_twice(rows: &[&[u8]], out: &mut Vec<u8>) {
    let width = rows.first().map_or(0, |row| row.len());
    let mut line: Vec<u16> = vec![0; width];
    for (y, near) in rows.iter().enumerate() {
        let above = rows[y.saturating_sub(1)];
        let below = rows[(y + 1).min(rows.len() - 1)];
        for far in [above, below] {
            for ((mixed, near), far) in line.iter_mut().zip(*near).zip(far) {
                *mixed = 3 * u16::from(*near) + u16::from(*far);
            }
            for (x, near) in line.iter().enumerate() {
                let left = line[x.saturating_sub(1)];
                let right = line[(x + 1).min(width - 1)];
                // Weights add up to 16; 8 rounds.
                out.push(((3 * near + left + 8) >> 4) as u8);
                out.push(((3 * near + right + 8) >> 4) as u8);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_clipped_to_the_image() {
        let sut = Rect::clipped([-5.0, 2.4], [3.2, 1e9], 10, 8);
        assert_eq!(sut, Some(Rect { x: 0, y: 2, width: 5, height: 6 }));
        assert_eq!(Rect::clipped([20.0, 0.0], [30.0, 5.0], 10, 8), None);
        assert_eq!(Rect::clipped([f64::NAN; 2], [f64::NAN; 2], 10, 8).map(|r| r.area()), None);
    }

    #[test]
    fn enlarging_keeps_a_ramp_a_ramp() {
        let image = GrayImage::new(20, 20, (0..400).map(|k| (k % 20) as u8 * 10).collect());
        let rect = Rect { x: 2, y: 2, width: 10, height: 10 };
        let mut scratch = Vec::new();
        let (size, _) =
            Region { rect, decimate: 0.5 }.extract(&image.expect("size"), &mut scratch).expect("inside");
        assert_eq!(size, (20, 20));
        // Pixel 2k of the cut lies at 2 + k - 0.25 of the image: 10 * that is 10k + 17.5.
        assert_eq!(scratch[20 * 5 + 6], 48);
        assert_eq!(scratch[20 * 5 + 7], 53);
    }
}
