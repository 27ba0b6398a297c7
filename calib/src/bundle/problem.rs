//! What is adjusted: cameras, the object's parts, its motion; what was seen; what is free to move.
//!
//! How sure something is beforehand is its [`Loose`]: 0 is fixed, infinity is free, anything between the standard
//! deviation of a prior about the start.

use locoman_vision::camera::Camera;
use locoman_vision::pose::Observation;
use locoman_vision::shells::Shell;
use nalgebra::{Isometry3, Point2, Point3, SMatrix};

use super::lens::INTRINSICS;
use super::motion::Motion;

/// Standard deviation of the prior of a parameter: 0 is fixed, infinity free.
pub type Loose = f64;
/// Free.
pub const FREE: Loose = f64::INFINITY;
/// Fixed.
pub const FIXED: Loose = 0.0;
/// Most points of a part: those of a tag.
pub const POINTS: usize = 4;

/// A camera and its clock.
#[derive(Debug, Clone, PartialEq)]
pub struct Eye {
    /// The camera; its line time is adjusted with it.
    pub camera: Camera,
    /// What is added to its capture times to bring them to the first camera's clock.
    pub offset_s: f64,
    /// What is adjusted.
    pub loose: EyeLoose,
}

/// What is free in a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EyeLoose {
    /// Its position, m.
    pub position: Loose,
    /// Its orientation, rad.
    pub orientation: Loose,
    /// Its intrinsics, in the order of [`super::lens`].
    pub intrinsics: [Loose; INTRINSICS],
    /// Its clock, s.
    pub offset: Loose,
    /// The time between its rows, s.
    pub line_time: Loose,
}

impl EyeLoose {
    /// Nothing.
    pub const FIXED: Self = Self {
        position: FIXED,
        orientation: FIXED,
        intrinsics: [FIXED; INTRINSICS],
        offset: FIXED,
        line_time: FIXED,
    };
}

/// A rigid part of the object: a tag, or a few points.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its points in its own frame, [`POINTS`] at most.
    pub points: Vec<Point3<f64>>,
    /// Where it is on the object.
    pub object_from_part: Isometry3<f64>,
    /// Its points stand at this many times their coordinates.
    pub scale: f64,
    /// How free its position (m), its orientation (rad) and its scale (relative) are.
    pub loose: [Loose; 3],
}

/// A part in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// Index into the eyes.
    pub camera: usize,
    /// Index into the parts.
    pub part: usize,
    /// Index into the instants, where the motion has such.
    pub instant: usize,
    /// Capture time by the camera's own clock, seconds after some beginning.
    pub capture_s: f64,
    /// Where its points are in the image; as many as the part has points.
    pub points_px: [Point2<f64>; POINTS],
    /// L⁻¹ of the covariance L Lᵀ of the points; zero beyond them.
    pub whitening: SMatrix<f64, 8, 8>,
    /// Set aside: it fits nothing.
    pub outlier: bool,
}

/// All of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The cameras.
    pub eyes: Vec<Eye>,
    /// The object.
    pub parts: Vec<Part>,
    /// Its motion.
    pub motion: Motion,
    /// What was seen.
    pub sightings: Vec<Sighting>,
}

impl Part {
    /// The tags of a shell or a board, fixed.
    pub fn tags_of(shell: &Shell) -> Vec<Self> {
        let part = |tag: &locoman_vision::shells::ShellTag| {
            let h = tag.size_m / 2.0;
            Self {
                points: [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| Point3::new(x, y, 0.0)).to_vec(),
                object_from_part: tag.shell_from_tag,
                scale: 1.0,
                loose: [FIXED; 3],
            }
        };
        shell.tags.iter().map(part).collect()
    }
}

impl Sighting {
    /// A tag that was seen, in an instant; `None` if its covariance is none.
    ///
    /// `begin_ns`: what times count from.
    pub fn of_tag(observation: &Observation, instant: usize, begin_ns: u64) -> Option<Self> {
        let factor = observation.covariance_px2.cholesky()?;
        let whitening = factor.l().try_inverse()?;
        Some(Self {
            camera: observation.camera,
            part: observation.tag,
            instant,
            capture_s: (i128::from(observation.capture_ns) - i128::from(begin_ns)) as f64 * 1e-9,
            points_px: observation.corners_px,
            whitening,
            outlier: false,
        })
    }

    /// One point, whose deviation is the same in all directions.
    pub fn of_point(
        camera: usize,
        part: usize,
        instant: usize,
        point_px: Point2<f64>,
        sigma_px: f64,
    ) -> Self {
        let mut points_px = [Point2::origin(); POINTS];
        points_px[0] = point_px;
        let mut whitening = SMatrix::zeros();
        whitening[(0, 0)] = 1.0 / sigma_px;
        whitening[(1, 1)] = 1.0 / sigma_px;
        Self { camera, part, instant, capture_s: 0.0, points_px, whitening, outlier: false }
    }
}

impl Problem {
    /// Points of a sighting.
    pub(super) fn points(&self, sighting: &Sighting) -> &[Point3<f64>] {
        self.parts.get(sighting.part).map_or(&[], |part| &part.points)
    }
}
