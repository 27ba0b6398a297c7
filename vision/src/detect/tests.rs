//! On rendered tags: what is found where, in which order, and how exactly.

use super::*;

/// Grey levels of paper, ink and background.
const WHITE: f64 = 200.0;
const BLACK: f64 = 40.0;
const BACKGROUND: f64 = 110.0;

/// A tag under an affine map, anti-aliased by 8x8 samples a pixel. `origin` is where the tag's top left
/// outer corner of the black square lies (pixel centres at integers), `right` and `down` are its sides.
fn render(id: u32, origin: [f64; 2], right: [f64; 2], down: [f64; 2], size: (u32, u32)) -> GrayImage {
    const SAMPLES: i32 = 8;
    let bitmap = tag_bitmap(id).expect("a known id");
    let determinant = right[0] * down[1] - right[1] * down[0];
    let mut data = Vec::new();
    for y in 0..size.1 {
        for x in 0..size.0 {
            let mut sum = 0.0;
            for k in 0..SAMPLES * SAMPLES {
                let offset = |i: i32| (f64::from(i) + 0.5) / f64::from(SAMPLES) - 0.5;
                let dx = f64::from(x) + offset(k % SAMPLES) - origin[0];
                let dy = f64::from(y) + offset(k / SAMPLES) - origin[1];
                let u = (dx * down[1] - dy * down[0]) / determinant;
                let v = (dy * right[0] - dx * right[1]) / determinant;
                // The bitmap has a white margin of one cell round the eight of the black square.
                let (column, row) = ((u * 8.0 + 1.0).floor(), (v * 8.0 + 1.0).floor());
                let on_paper = (0.0..10.0).contains(&column) && (0.0..10.0).contains(&row);
                sum += match on_paper.then(|| bitmap.row(row as u32)[column as usize]) {
                    None => BACKGROUND,
                    Some(0) => BLACK,
                    Some(_) => WHITE,
                };
            }
            data.push((sum / f64::from(SAMPLES * SAMPLES)).round() as u8);
        }
    }
    GrayImage::new(size.0, size.1, data).expect("size")
}

/// What [`render`] drew: corners in our order.
fn corners(origin: [f64; 2], right: [f64; 2], down: [f64; 2]) -> [Point2<f64>; 4] {
    [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(u, v)| {
        Point2::new(origin[0] + u * right[0] + v * down[0], origin[1] + u * right[1] + v * down[1])
    })
}

fn worst_error_px(found: &Detection, expected: &[Point2<f64>; 4]) -> f64 {
    let errors = found.corners_px.iter().zip(expected).map(|(a, b)| (a - b).norm());
    errors.fold(0.0, f64::max)
}

const ORIGIN: [f64; 2] = [60.3, 50.8];
const RIGHT: [f64; 2] = [50.0, 4.0];
const DOWN: [f64; 2] = [-3.0, 48.0];

#[test]
fn corners_of_an_upright_tag_come_in_our_order_and_convention() {
    /// Debian's library 3.3 is off by 0.04 RMS, the bundled 3.4.5 by 0.013; half a pixel would be 0.7.
    const TOLERANCE_PX: f64 = 0.06;
    let image = render(7, ORIGIN, RIGHT, DOWN, (180, 160));
    let mut sut = Detector::new(&[3, 7]).expect("detector");
    for decimate in [1.0, 2.0] {
        let found = sut.detect(&image, Search::Full { decimate });
        assert_eq!(found.len(), 1, "decimate {decimate}");
        assert_eq!((found[0].id, found[0].hamming), (7, 0));
        let error = worst_error_px(&found[0], &corners(ORIGIN, RIGHT, DOWN));
        assert!(error < TOLERANCE_PX, "decimate {decimate}: {error} px");
    }
}

#[test]
fn a_region_gives_the_corners_in_the_whole_image() {
    const TOLERANCE_PX: f64 = 0.08;
    let image = render(7, ORIGIN, RIGHT, DOWN, (180, 160));
    let mut sut = Detector::new(&[7]).expect("detector");
    let rect = Rect { x: 41, y: 33, width: 91, height: 87 };
    for decimate in [0.5, 1.0, 2.0] {
        let found = sut.detect(&image, Search::Regions(&[Region { rect, decimate }]));
        assert_eq!(found.len(), 1, "decimate {decimate}");
        let error = worst_error_px(&found[0], &corners(ORIGIN, RIGHT, DOWN));
        assert!(error < TOLERANCE_PX, "decimate {decimate}: {error} px");
    }
}

#[test]
fn the_linked_library_is_the_bundled_one() {
    /// RMS per axis over tags at many offsets: 3.3.0 gives 0.040 px, 3.4.5 gives 0.013.
    const RMS_PX: f64 = 0.025;
    let mut sut = Detector::new(&[11]).expect("detector");
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 0..40 {
        let shift = f64::from(k) * 0.37;
        let angle = f64::from(k) * 0.61;
        let (sin, cos) = angle.sin_cos();
        let origin = [70.0 + shift.fract() - 20.0 * (cos - sin), 70.0 - 20.0 * (cos + sin)];
        let (right, down) = ([40.0 * cos, 40.0 * sin], [-40.0 * sin, 40.0 * cos]);
        let image = render(11, origin, right, down, (140, 140));
        let found = sut.detect(&image, Search::Full { decimate: 1.0 });
        assert_eq!(found.len(), 1);
        for (a, b) in found[0].corners_px.iter().zip(corners(origin, right, down)) {
            sum += (a - b).norm_squared() / 2.0;
            count += 1.0;
        }
    }
    let rms = f64::sqrt(sum / count);
    assert!(rms < RMS_PX, "{rms} px: is APRILTAG_SYS_METHOD set?");
}

#[test]
fn a_small_tag_is_read_when_enlarged() {
    /// Thumb tags: cells of 1.5 pixels.
    const SIDE_PX: f64 = 12.0;
    let origin = [20.4, 21.7];
    let (right, down) = ([SIDE_PX, 1.0], [-1.0, SIDE_PX]);
    let image = render(9, origin, right, down, (56, 56));
    let mut sut = Detector::new(&[9]).expect("detector");
    let rect = Rect { x: 2, y: 2, width: 52, height: 52 };
    let found = sut.detect(&image, Search::Regions(&[Region { rect, decimate: 0.5 }]));
    assert_eq!(found.len(), 1);
    let error = worst_error_px(&found[0], &corners(origin, right, down));
    assert!(error < 0.25, "{error} px");
}

#[test]
fn tags_of_others_are_not_seen() {
    let image = render(7, ORIGIN, RIGHT, DOWN, (180, 160));
    let mut sut = Detector::new(&[0, 1, 2, 3, 8, 100]).expect("detector");
    assert_eq!(sut.detect(&image, Search::Full { decimate: 1.0 }), []);
}

#[test]
fn unknown_ids_are_refused() {
    assert!(Detector::new(&[586]).is_ok());
    assert!(matches!(Detector::new(&[587]), Err(DetectorError::UnknownId(587))));
    assert!(tag_bitmap(587).is_none());
}

#[test]
fn regions_outside_or_too_small_are_passed_over() {
    let image = render(7, ORIGIN, RIGHT, DOWN, (180, 160));
    let mut sut = Detector::new(&[7]).expect("detector");
    let regions = [(170, 0, 20, 20), (0, 0, 0, 5), (3, 3, 6, 6), (u32::MAX, 0, 5, 5)]
        .map(|(x, y, width, height)| Region { rect: Rect { x, y, width, height }, decimate: 1.0 });
    assert!(sut.detect(&image, Search::Regions(&regions)).is_empty());
}
