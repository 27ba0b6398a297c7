//! Which column of the normal equations' border belongs to which parameter of cameras and parts.

use nalgebra::Vector3;

use super::lens::{self, INTRINSICS};
use super::motion::moved;
use super::problem::{Loose, Problem};

/// Parameters of a camera: position, orientation, intrinsics, clock, line time.
pub(super) const EYE: usize = 6 + INTRINSICS + 2;
/// Where the clock stands among them.
pub(super) const OFFSET: usize = 6 + INTRINSICS;
/// Where the line time stands among them.
pub(super) const LINE_TIME: usize = OFFSET + 1;
/// Parameters of a part: position, orientation, scale.
pub(super) const PART: usize = 7;

/// The border's columns.
#[derive(Debug, Clone)]
pub(super) struct Columns {
    pub eyes: Vec<[Option<usize>; EYE]>,
    pub parts: Vec<[Option<usize>; PART]>,
    /// Of each column, 1/σ² of its prior.
    pub information: Vec<f64>,
}

impl Columns {
    pub fn new(problem: &Problem) -> Self {
        let mut information = Vec::new();
        let mut column = |loose: Loose| {
            (loose > 0.0).then(|| {
                information.push(loose.powi(-2));
                information.len() - 1
            })
        };
        let eyes = problem.eyes.iter().map(|eye| {
            let loose = &eye.loose;
            let valid = lens::names(&eye.camera.distortion).len();
            std::array::from_fn(|k| match k {
                0..3 => column(loose.position),
                3..6 => column(loose.orientation),
                OFFSET => column(loose.offset),
                LINE_TIME => column(loose.line_time),
                _ if k - 6 < valid => column(loose.intrinsics[k - 6]),
                _ => None,
            })
        });
        let eyes = eyes.collect();
        let parts =
            problem.parts.iter().map(|part| std::array::from_fn(|k| column(part.loose[k / 3]))).collect();
        Self { eyes, parts, information }
    }

    pub fn len(&self) -> usize {
        self.information.len()
    }

    /// Moves cameras and parts along a step of the border.
    pub fn apply(&self, problem: &mut Problem, step: &[f64]) {
        let at = |column: Option<usize>| column.and_then(|k| step.get(k)).copied().unwrap_or(0.0);
        let three = |columns: &[Option<usize>]| Vector3::new(at(columns[0]), at(columns[1]), at(columns[2]));
        for (eye, columns) in problem.eyes.iter_mut().zip(&self.eyes) {
            let camera = &mut eye.camera;
            camera.world_from_camera =
                moved(&camera.world_from_camera, &three(&columns[..3]), &three(&columns[3..6]));
            for (index, column) in columns[6..OFFSET].iter().enumerate() {
                lens::add(camera, index, at(*column));
            }
            eye.offset_s += at(columns[OFFSET]);
            camera.line_time_s += at(columns[LINE_TIME]);
        }
        for (part, columns) in problem.parts.iter_mut().zip(&self.parts) {
            part.object_from_part =
                moved(&part.object_from_part, &three(&columns[..3]), &three(&columns[3..6]));
            part.scale *= at(columns[6]).exp();
        }
    }
}
