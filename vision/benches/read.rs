//! Time to read all expected tags of five shells in one image, beside the plain library's search of it.
//!
//! `cargo xtask bench`, or `cargo bench --profile dev -p locoman-vision --bench read`. Processor time of one thread. Each
//! pixel is the mean of some points in it, smoothed like by a lens, with noise: how many steps a fit takes depends on that.
//! Accuracy is measured by `cargo xtask eval vision`. What counts is the ratio within one run.

#![expect(clippy::expect_used, reason = "in a benchmark a panic is the report")]

use locoman_protocol::clock::thread_cpu_ns;
use locoman_vision::camera::{Camera, Distortion};
use locoman_vision::detect::expected::{Expectation, Reader};
use locoman_vision::detect::{Detector, Search, tag_bitmap};
use locoman_vision::image::GrayImage;
use nalgebra::{Isometry3, Matrix3, Point2, Rotation3, UnitQuaternion, Vector2, Vector3};

/// Tags that the five shells show to one camera: side in the image at 1080p, pixels, and how many.
const TAGS: [(f64, usize); 3] = [(64.0, 6), (44.0, 16), (25.0, 8)];
const ROUNDS: usize = 40;

fn main() {
    let clock = thread_cpu_ns;
    let camera = Camera {
        id: "bench".to_owned(),
        width: 1920,
        height: 1080,
        focal_px: Vector2::new(1503.0, 1502.0),
        center_px: Vector2::new(962.0, 544.0),
        distortion: Distortion::RadTan([-0.041, 0.011, 2e-4, -3e-4, -0.002, 0.0, 0.0, 0.0]),
        world_from_camera: Isometry3::identity(),
        line_time_s: 0.0,
    };
    let expected = places(&camera);
    let image = draw(&camera, &expected);
    let ids: Vec<u32> = expected.iter().map(|expectation| expectation.id).collect();
    let mut reader = Reader::new(&camera, &ids);
    let mut detector = Detector::new(&ids).expect("known ids");

    let (mut read_ns, mut read) = (Vec::new(), 0);
    let (mut search_ns, mut found) = (Vec::new(), 0);
    for _ in 0..ROUNDS {
        let begun = clock();
        read = expected.iter().filter(|tag| reader.read(&image, tag).is_ok()).count();
        read_ns.push(clock() - begun);
    }
    for _ in 0..ROUNDS / 4 {
        let begun = clock();
        found = detector.detect(&image, Search::Full { decimate: 2.0 }).len();
        search_ns.push(clock() - begun);
    }
    let (read_ms, search_ms) = (median_ms(&mut read_ns), median_ms(&mut search_ns));
    println!("1920x1080, {} tags, processor time of one thread, median", expected.len());
    println!("expected tags read       {read_ms:7.3} ms   {read} tags");
    println!("library, decimate 2      {search_ms:7.3} ms   {found} tags");
    println!("ratio                    {:7.1}", search_ms / read_ms);
}

fn median_ms(times_ns: &mut [u64]) -> f64 {
    times_ns.sort_unstable();
    times_ns[times_ns.len() / 2] as f64 * 1e-6
}

/// Tags side by side, turned and tilted a little, a pixel off where they are drawn.
fn places(camera: &Camera) -> Vec<Expectation> {
    let mut places = Vec::new();
    let mut id = 0;
    for (line, (side_px, count)) in TAGS.into_iter().enumerate() {
        for k in 0..count {
            let pixel = Point2::new(90.0 + 110.0 * k as f64, 160.0 + 330.0 * line as f64);
            let size_m = 0.025;
            let ray = camera.unproject(&pixel) * (camera.focal_px.x * size_m / side_px);
            let angle = 0.35 * (k as f64).sin();
            let facing = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + angle);
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.3 * (k as f64).cos());
            let pose =
                Isometry3::from_parts(ray.into(), UnitQuaternion::from_rotation_matrix(&(turn * facing)));
            places.push(Expectation::from_pose(id, &pose, size_m, 2.0));
            id += 1;
        }
    }
    places
}

/// The tags on grey, each shifted by a pixel, smoothed once, with noise of two grey levels on them. The grey has none: it
/// would cost the library most of its time.
fn draw(camera: &Camera, expected: &[Expectation]) -> GrayImage {
    /// Points along a pixel's side.
    const FINE: usize = 4;
    const BACKGROUND: f32 = 120.0;
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut pixels = vec![BACKGROUND; width * height];
    for tag in expected {
        let cells_from_ideal: Matrix3<f64> = tag.ideal_from_cells.try_inverse().expect("regular");
        let bitmap = tag_bitmap(tag.id).expect("known id");
        let middle = tag.ideal_from_cells * Vector3::new(5.0, 5.0, 1.0);
        let center = camera.pixel_of_ideal(Vector2::new(middle.x / middle.z, middle.y / middle.z));
        for y in (center.y as usize).saturating_sub(70)..(center.y as usize + 70).min(height) {
            for x in (center.x as usize).saturating_sub(70)..(center.x as usize + 70).min(width) {
                let points = (0..FINE * FINE).map(|k| {
                    let place = |k: usize| (k as f64 + 0.5) / FINE as f64 - 0.5;
                    let (x, y) = (x as f64 + place(k % FINE), y as f64 + place(k / FINE));
                    let cell = cells_from_ideal * camera.unproject(&Point2::new(x - 1.0, y + 0.6));
                    let (u, v) = ((cell.x / cell.z).floor(), (cell.y / cell.z).floor());
                    let inside = (0.0..10.0).contains(&u) && (0.0..10.0).contains(&v);
                    let level = |white: bool| if white { 200.0 } else { 40.0 };
                    if inside { level(bitmap.row(v as u32)[u as usize] != 0) } else { BACKGROUND }
                });
                pixels[y * width + x] = points.sum::<f32>() / (FINE * FINE) as f32;
            }
        }
    }
    let at = |x: usize, y: usize| pixels[y.min(height - 1) * width + x.min(width - 1)];
    let smooth = |k: usize| {
        let (x, y) = (k % width, k / width);
        let (left, above) = (x.saturating_sub(1), y.saturating_sub(1));
        let line = |y: usize| at(left, y) + 2.0 * at(x, y) + at(x + 1, y);
        (line(above) + 2.0 * line(y) + line(y + 1)) / 16.0
    };
    let mut seed = 1_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // A uniform number has a variance of a twelfth: two grey levels.
        ((seed >> 40) as f32 / (1_u64 << 24) as f32 - 0.5) * 2.0 * 12_f32.sqrt()
    };
    let smooth = |k: usize| {
        let level = smooth(k);
        (if level == BACKGROUND { level } else { level + noise() }).round() as u8
    };
    GrayImage::new(camera.width, camera.height, (0..width * height).map(smooth).collect()).expect("size")
}
