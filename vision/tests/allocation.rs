//! Once it runs, the way of a frame takes no memory but what it hands over: reading, solving and fusing.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

use locoman_vision::{
    camera::{Camera, Distortion},
    detect::{CornerCovariance, Detection, tag_bitmap},
    image::GrayImage,
    rig::Rig,
    shells::{ShellSet, design},
    track::{CameraUpdate, Eye, Fusion, SeenTag, TrackerSettings, Verdict},
};
use nalgebra::{Isometry3, Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, counting what each thread asks for.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's promises are those of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const STEP_NS: u64 = 16_666_667;
const WARM_UP: u64 = 40;
const FRAMES: u64 = 60;

fn counted<T>(run: impl FnOnce() -> T) -> (T, usize) {
    let before = ALLOCATIONS.get();
    let result = run();
    (result, ALLOCATIONS.get() - before)
}

/// Two cameras before a palm at rest.
fn rig() -> Rig {
    let camera = |id: &str, y: f64| Camera {
        id: id.to_owned(),
        width: 1280,
        height: 720,
        focal_px: Vector2::new(880.0, 882.0),
        center_px: Vector2::new(641.5, 357.0),
        distortion: Distortion::RadTan([-0.09, 0.03, 3e-4, -2e-4, 0.0, 0.0, 0.0, 0.0]),
        world_from_camera: looking(Point3::new(1.15, y, 1.4), Point3::new(0.4, -0.2, 1.12)),
        line_time_s: 0.0,
    };
    Rig::new(vec![camera("a", -0.56), camera("b", -0.3)])
}

fn looking(eye: Point3<f64>, target: Point3<f64>) -> Isometry3<f64> {
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(eye.coords.into(), rotation)
}

fn pose() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.45, -0.22, 1.08), Vector3::new(0.1, -0.2, 0.1))
}

/// The tags of the palm that face a camera, the shell's index and the tag's.
fn facing(camera: &Camera, shells: &ShellSet) -> Vec<(usize, usize)> {
    let camera_from_shell = camera.world_from_camera.inverse() * pose();
    let faces = |tag: usize| {
        let tag = &shells.shells[PALM].tags[tag];
        let sight = -(camera_from_shell * tag.center()).coords.normalize();
        (camera_from_shell * tag.normal()).dot(&sight) > 0.4
    };
    (0..shells.shells[PALM].tags.len()).filter(|tag| faces(*tag)).map(|tag| (PALM, tag)).collect()
}

const PALM: usize = 0;

/// What a camera would report.
fn seen(index: usize, camera: &Camera, shells: &ShellSet, capture_ns: u64) -> CameraUpdate {
    let camera_from_shell = camera.world_from_camera.inverse() * pose();
    let mut update = CameraUpdate::nothing(index, capture_ns);
    for (shell, index) in facing(camera, shells) {
        let tag = &shells.shells[shell].tags[index];
        let corners_px = tag.corners().map(|corner| camera.project(&(camera_from_shell * corner)).unwrap());
        let detection = Detection {
            id: tag.id,
            hamming: 0,
            margin: 80.0,
            corners_px,
            decimate: 1.0,
            covariance_px2: Some(CornerCovariance::from_diagonal_element(0.03_f64.powi(2))),
        };
        update.tags.push(SeenTag::new(detection, shell, index));
    }
    update
}

/// The palm's tags on grey, four points a pixel.
fn image(camera: &Camera, shells: &ShellSet) -> GrayImage {
    /// No tag reaches farther from its middle.
    const REACH_PX: usize = 60;
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut pixels = vec![120_u8; width * height];
    for (shell, index) in facing(camera, shells) {
        let tag = &shells.shells[shell].tags[index];
        let bitmap = tag_bitmap(tag.id).unwrap();
        let tag_from_camera = (camera.world_from_camera.inverse() * pose() * tag.shell_from_tag).inverse();
        let eye = tag_from_camera * Point3::origin();
        let cell_m = tag.size_m / 8.0;
        let center = camera.project(&(tag_from_camera.inverse() * Point3::origin())).unwrap();
        let (left, top) = (center.x as usize - REACH_PX, center.y as usize - REACH_PX);
        for y in top..(top + 2 * REACH_PX).min(height) {
            for x in left..(left + 2 * REACH_PX).min(width) {
                let (mut sum, mut hits) = (0.0, 0.0);
                for (dx, dy) in [(-0.25, -0.25), (0.25, -0.25), (0.25, 0.25), (-0.25, 0.25)] {
                    let pixel = Point2::new(x as f64 + dx, y as f64 + dy);
                    let ray = tag_from_camera.rotation * camera.unproject(&pixel);
                    let hit = eye - ray * (eye.z / ray.z);
                    let (u, v) = ((hit.x / cell_m + 5.0).floor(), (5.0 - hit.y / cell_m).floor());
                    if (0.0..10.0).contains(&u) && (0.0..10.0).contains(&v) {
                        sum += if bitmap.row(v as u32)[u as usize] != 0 { 200.0 } else { 40.0 };
                        hits += 1.0;
                    }
                }
                let pixel = &mut pixels[y * width + x];
                *pixel = ((sum + (4.0 - hits) * f64::from(*pixel)) / 4.0) as u8;
            }
        }
    }
    GrayImage::new(camera.width, camera.height, pixels).unwrap()
}

#[test]
fn the_way_of_a_frame_takes_only_the_memory_that_it_hands_over() {
    /// The tags of a camera.
    const OF_AN_EYE: usize = 1;
    /// The shells of an update.
    const OF_FUSION: usize = 1;
    let (rig, mut shells, settings) = (rig(), design::standard(), TrackerSettings::default());
    // Nothing is lost then, and nothing searched: the library takes memory for that.
    shells.shells = vec![shells.shells.swap_remove(1)];
    let images: Vec<GrayImage> = rig.cameras.iter().map(|camera| image(camera, &shells)).collect();
    let mut eyes: Vec<Eye> =
        (0..rig.cameras.len()).map(|index| Eye::new(&rig, index, &shells, &settings)).collect();
    let mut fusion = Fusion::new(rig.clone(), shells.clone(), settings);
    let first = rig.cameras.iter().enumerate().map(|(k, camera)| seen(k, camera, &shells, STEP_NS)).collect();
    fusion.update(first);
    let mut read = 0;
    for frame in 2..WARM_UP + FRAMES {
        let capture_ns = frame * STEP_NS;
        let motions = fusion.motions();
        let mut updates = Vec::with_capacity(eyes.len());
        for (eye, image) in eyes.iter_mut().zip(&images) {
            let (update, taken) = counted(|| eye.look(image, capture_ns, &motions));
            read += update.tags.len();
            // A tag that is missed is handed over too.
            let handed_over = OF_AN_EYE + usize::from(!update.missed.is_empty());
            assert!(frame < WARM_UP || taken <= handed_over, "frame {frame}: an eye took {taken}");
            updates.push(update);
        }
        let (update, taken) = counted(|| fusion.update(updates));
        assert_eq!(update.shells[PALM].verdict, Verdict::Tracked, "frame {frame}");
        assert!(frame < WARM_UP || taken <= OF_FUSION, "frame {frame}: fusion took {taken}");
    }
    assert!(read as u64 > 4 * FRAMES, "{read} tags were read");
}
