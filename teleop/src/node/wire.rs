//! What goes between a camera node and the station, as messages: detections one way, motions the other.
//!
//! What comes in is checked here: after that, numbers are finite, and cameras, shells and sizes are the rig's.

use locoman_protocol::geometry;
use locoman_protocol::messages::{self, Detections, TagDetection};
use locoman_vision::detect::{CornerCovariance, Detection, Rect};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use locoman_vision::track::{CameraUpdate, Matrix18, Motion, Motions, TagOwners};
use nalgebra::{Point2, SMatrix, Vector3};

/// Why a message is of no use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// Not a camera of the rig.
    #[error("camera `{0}` is not in the station's rig file; start station and node with the same one")]
    UnknownCamera(String),
    /// A camera that the station reads itself.
    #[error("camera `{0}` is read by the station itself; write source = {{ remote = true }} in its rig file")]
    NotRemote(String),
    /// Not the rig's size.
    #[error(
        "camera `{camera}` sends corners in an image of {got:?} pixels, the station's rig file says {want:?}"
    )]
    Size {
        /// Its id.
        camera: String,
        /// Of the node.
        got: (u32, u32),
        /// Of the rig.
        want: (u32, u32),
    },
    /// A count or a number that cannot be.
    #[error("camera `{camera}` sends tag {tag} with {what}")]
    Tag {
        /// Its id.
        camera: String,
        /// Number of the tag.
        tag: u32,
        /// What is wrong.
        what: &'static str,
    },
}

/// What a node says of one frame; counts and clock are the caller's.
pub fn detections(rig: &Rig, update: &CameraUpdate) -> Detections {
    let camera = rig.cameras.get(update.camera);
    let region =
        |rect: &Rect| messages::Region { x: rect.x, y: rect.y, width: rect.width, height: rect.height };
    Detections {
        camera: camera.map_or_else(String::new, |camera| camera.id.clone()),
        tags: update.tags.iter().map(|seen| tag_message(&seen.detection)).collect(),
        width: camera.map_or(0, |camera| camera.width),
        height: camera.map_or(0, |camera| camera.height),
        searched: update.searched.iter().map(region).collect(),
        searched_whole: update.searched_whole,
        decode_ns: update.decode_ns,
        detect_ns: update.detect_ns,
        problem: update.problem.clone().unwrap_or_default(),
        ..Detections::default()
    }
}

fn tag_message(detection: &Detection) -> TagDetection {
    TagDetection {
        id: detection.id,
        hamming: detection.hamming,
        margin: detection.margin,
        corners_px: detection.corners_px.iter().flat_map(|corner| [corner.x, corner.y]).collect(),
        covariance_px2: detection.covariance_px2.as_ref().map(lower_triangle).unwrap_or_default(),
        decimate: detection.decimate,
    }
}

/// What a node said of one frame.
pub fn camera_update(rig: &Rig, owners: &TagOwners, message: &Detections) -> Result<CameraUpdate, WireError> {
    let id = &message.camera;
    let camera = rig.camera_index(id).ok_or_else(|| WireError::UnknownCamera(id.clone()))?;
    if !rig.sources[camera].remote {
        return Err(WireError::NotRemote(id.clone()));
    }
    let want = (rig.cameras[camera].width, rig.cameras[camera].height);
    let got = (message.width, message.height);
    if got != want {
        return Err(WireError::Size { camera: id.clone(), got, want });
    }
    let found = message.tags.iter().map(|tag| detection(id, tag)).collect::<Result<Vec<_>, _>>()?;
    let rect = |region: &messages::Region| Rect {
        x: region.x.min(want.0),
        y: region.y.min(want.1),
        width: region.width.min(want.0),
        height: region.height.min(want.1),
    };
    let capture_ns = message.header.as_ref().map_or(0, |header| header.capture_ns);
    Ok(CameraUpdate {
        tags: owners.assign(found),
        searched: message.searched.iter().map(rect).collect(),
        searched_whole: message.searched_whole,
        decode_ns: message.decode_ns,
        detect_ns: message.detect_ns,
        problem: (!message.problem.is_empty()).then(|| message.problem.clone()),
        ..CameraUpdate::nothing(camera, capture_ns)
    })
}

fn detection(camera: &str, tag: &TagDetection) -> Result<Detection, WireError> {
    let wrong = |what| WireError::Tag { camera: camera.to_owned(), tag: tag.id, what };
    let numbers = tag.corners_px.iter().chain(&tag.covariance_px2).chain([&tag.margin]);
    if !numbers.into_iter().all(|number| number.is_finite()) || !tag.decimate.is_finite() {
        return Err(wrong("a number that is not finite"));
    }
    let corners: &[f64; 8] =
        tag.corners_px.as_slice().try_into().map_err(|_| wrong("other than 8 corner coordinates"))?;
    let covariance_px2: Option<CornerCovariance> = match tag.covariance_px2.as_slice() {
        [] => None,
        triangle => {
            let covariance: CornerCovariance =
                symmetric(triangle).ok_or_else(|| wrong("other than 36 covariances"))?;
            if covariance.diagonal().min() <= 0.0 {
                return Err(wrong("a variance that is not positive"));
            }
            Some(covariance)
        }
    };
    Ok(Detection {
        id: tag.id,
        hamming: tag.hamming,
        margin: tag.margin,
        corners_px: std::array::from_fn(|k| Point2::new(corners[2 * k], corners[2 * k + 1])),
        decimate: tag.decimate,
        covariance_px2,
    })
}

/// Where the shells are and how they move.
pub fn motions_message(motions: &Motions, shells: &ShellSet) -> messages::Motions {
    let vector = |v: &Vector3<f64>| Some(messages::Vector3 { x: v.x, y: v.y, z: v.z });
    let shell = |(shell, motion): (&locoman_vision::shells::Shell, &Option<Motion>)| {
        let motion = motion.as_ref()?;
        Some(messages::ShellMotion {
            shell: shell.name.clone(),
            time_ns: motion.time_ns,
            pose: Some(geometry::pose(&motion.world_from_shell)),
            velocity_m_s: vector(&motion.velocity_m_s),
            rate_rad_s: vector(&motion.rate_rad_s),
            acceleration_m_s2: vector(&motion.acceleration_m_s2),
            angular_rad_s2: vector(&motion.angular_rad_s2),
            acceleration_variance: motion.variance.to_vec(),
            covariance: lower_triangle(&motion.covariance),
        })
    };
    messages::Motions {
        shells: shells.shells.iter().zip(motions.latest()).filter_map(shell).collect(),
        horizon_ns: motions.horizon_ns(),
        ..messages::Motions::default()
    }
}

/// What the station said; a shell of which it says nothing usable is lost.
pub fn motions(message: &messages::Motions, shells: &ShellSet) -> Motions {
    let motion = |name: &str| restored(message.shells.iter().find(|shell| shell.shell == name)?);
    Motions::new(shells.shells.iter().map(|shell| motion(&shell.name)).collect(), message.horizon_ns)
}

fn restored(message: &messages::ShellMotion) -> Option<Motion> {
    let vector = |v: Option<&messages::Vector3>| {
        let v = Vector3::new(v?.x, v?.y, v?.z);
        v.iter().all(|number| number.is_finite()).then_some(v)
    };
    let covariance: Matrix18 = symmetric(&message.covariance)?;
    let variance: [f64; 2] = message.acceleration_variance.as_slice().try_into().ok()?;
    let finite = covariance.iter().chain(&variance).all(|number| number.is_finite());
    let motion = Motion {
        time_ns: message.time_ns,
        world_from_shell: geometry::isometry(message.pose.as_ref()?).ok()?,
        velocity_m_s: vector(message.velocity_m_s.as_ref())?,
        rate_rad_s: vector(message.rate_rad_s.as_ref())?,
        acceleration_m_s2: vector(message.acceleration_m_s2.as_ref())?,
        angular_rad_s2: vector(message.angular_rad_s2.as_ref())?,
        variance,
        covariance,
    };
    finite.then_some(motion)
}

/// Row by row.
fn lower_triangle<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Vec<f64> {
    (0..N).flat_map(|row| (0..=row).map(move |column| matrix[(row, column)])).collect()
}

/// `None` if there are not as many numbers as a triangle has.
fn symmetric<const N: usize>(triangle: &[f64]) -> Option<SMatrix<f64, N, N>> {
    let mut matrix = SMatrix::zeros();
    let mut numbers = triangle.iter();
    for row in 0..N {
        for column in 0..=row {
            matrix[(row, column)] = *numbers.next()?;
            matrix[(column, row)] = matrix[(row, column)];
        }
    }
    numbers.next().is_none().then_some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;
    use locoman_vision::pose::{Matrix18, State};
    use locoman_vision::track::FilterSettings;
    use nalgebra::Isometry3;
    use std::path::Path;

    fn set_up() -> (Rig, ShellSet, TagOwners) {
        let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
        let mut rig = Rig::load(&configs.join("rigs/two_zed_pairs.toml")).unwrap();
        rig.sources[2].remote = true;
        let shells = ShellSet::load(&configs.join("shells/standard.toml")).unwrap();
        let owners = TagOwners::new(&shells);
        (rig, shells, owners)
    }

    fn seen(shells: &ShellSet, owners: &TagOwners) -> CameraUpdate {
        let mut covariance = CornerCovariance::identity() * 0.01;
        (covariance[(2, 1)], covariance[(1, 2)]) = (0.001, 0.001);
        let found = Detection {
            id: shells.shells[0].tags[0].id,
            hamming: 1,
            margin: 55.5,
            corners_px: std::array::from_fn(|k| Point2::new(10.25 + k as f64, 20.5)),
            decimate: 0.5,
            covariance_px2: Some(covariance),
        };
        CameraUpdate {
            tags: owners.assign(vec![found]),
            searched: vec![Rect { x: 1, y: 2, width: 30, height: 40 }],
            ..CameraUpdate::nothing(2, 77)
        }
    }

    #[test]
    fn what_a_camera_saw_survives_the_way() {
        let (rig, shells, owners) = set_up();
        let sent = seen(&shells, &owners);
        let mut message = detections(&rig, &sent);
        message.header = Some(messages::Header { capture_ns: 77, ..messages::Header::default() });
        assert_eq!(camera_update(&rig, &owners, &message), Ok(sent));
    }

    #[test]
    fn what_cannot_be_is_refused_with_the_reason() {
        let (rig, shells, owners) = set_up();
        let good = detections(&rig, &seen(&shells, &owners));
        let complaint = |change: fn(&mut Detections)| {
            let mut message = good.clone();
            change(&mut message);
            camera_update(&rig, &owners, &message).unwrap_err().to_string()
        };
        assert!(complaint(|m| m.camera = "x".into()).contains("`x` is not in"));
        assert!(complaint(|m| m.camera = "right_zed_left".into()).contains("remote = true"));
        assert!(complaint(|m| m.width = 640).contains("(640, 720)"));
        assert!(complaint(|m| m.tags[0].corners_px[3] = f64::NAN).contains("not finite"));
        assert!(complaint(|m| m.tags[0].corners_px.truncate(7)).contains("8 corner"));
        assert!(complaint(|m| m.tags[0].covariance_px2.truncate(35)).contains("36"));
        assert!(complaint(|m| m.tags[0].covariance_px2[0] = -1.0).contains("not positive"));
    }

    #[test]
    fn motions_survive_the_way_and_what_is_damaged_is_lost() {
        let (_, shells, _) = set_up();
        let settings = FilterSettings::default();
        let state = State {
            world_from_shell: Isometry3::translation(0.1, 0.2, 1.3),
            velocity_m_s: Vector3::new(0.1, 0.2, 0.3),
            rate_rad_s: Vector3::new(1.0, 0.5, 0.0),
            ..State::still(Isometry3::identity())
        };
        let motion = Motion::begin(5, &state, &(Matrix18::identity() * 1e-6)).predicted(9_000_000, &settings);
        let sent = Motions::new(vec![Some(motion), None, None, None, None], 250);
        let mut message = motions_message(&sent, &shells);
        assert_eq!(motions(&message, &shells), sent);
        message.shells[0].covariance[7] = f64::INFINITY;
        assert!(motions(&message, &shells).nothing_known_at(9_000_000));
    }
}
