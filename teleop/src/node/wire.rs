//! What goes between a camera node and the station, as messages: detections one way, [`motions`] the other.
//!
//! What comes in is checked here: after that, numbers are finite, and cameras, shells and sizes are the rig's.

mod motions;

use locoman_protocol::messages::missed_tag;
use locoman_protocol::messages::{self, Detections, TagDetection};
use locoman_vision::detect::expected::Refusal;
use locoman_vision::detect::{CornerCovariance, Detection, Rect};
use locoman_vision::rig::Rig;
use locoman_vision::track::{CameraUpdate, MissedTag, TagOwners};
use nalgebra::{Point2, SMatrix};

pub use motions::{motions, motions_message};

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
        missed: update.missed.iter().map(missed_message).collect(),
        ..Detections::default()
    }
}

fn tag_message(detection: &Detection) -> TagDetection {
    TagDetection {
        id: detection.id,
        hamming: detection.hamming,
        margin: detection.margin,
        corners_px: numbers(&detection.corners_px),
        covariance_px2: detection.covariance_px2.as_ref().map(lower_triangle).unwrap_or_default(),
        decimate: detection.decimate,
    }
}

fn missed_message(missed: &MissedTag) -> messages::MissedTag {
    messages::MissedTag {
        id: missed.id,
        corners_px: numbers(&missed.corners_px),
        refusal: sent(missed.refusal).into(),
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
    let missed = message.missed.iter().map(|tag| missed(id, owners, tag));
    let rect = |region: &messages::Region| Rect {
        x: region.x.min(want.0),
        y: region.y.min(want.1),
        width: region.width.min(want.0),
        height: region.height.min(want.1),
    };
    let capture_ns = message.header.as_ref().map_or(0, |header| header.capture_ns);
    Ok(CameraUpdate {
        tags: owners.assign(found),
        missed: missed.filter_map(Result::transpose).collect::<Result<_, _>>()?,
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
    let numbers = tag.covariance_px2.iter().chain([&tag.margin]);
    if !numbers.into_iter().all(|number| number.is_finite()) || !tag.decimate.is_finite() {
        return Err(wrong(NOT_FINITE));
    }
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
        corners_px: corners(&tag.corners_px).map_err(wrong)?,
        decimate: tag.decimate,
        covariance_px2,
    })
}

/// A tag that a node expected and did not read; `None` if it is on no shell, or for a reason that is not known here: it is
/// for the eye alone.
fn missed(
    camera: &str,
    owners: &TagOwners,
    tag: &messages::MissedTag,
) -> Result<Option<MissedTag>, WireError> {
    let wrong = |what| WireError::Tag { camera: camera.to_owned(), tag: tag.id, what };
    let corners_px = corners(&tag.corners_px).map_err(wrong)?;
    Ok(owners.shell_of(tag.id).zip(received(tag.refusal())).map(|(shell, refusal)| MissedTag {
        id: tag.id,
        shell,
        corners_px,
        refusal,
    }))
}

const NOT_FINITE: &str = "a number that is not finite";

const fn sent(refusal: Refusal) -> missed_tag::Refusal {
    match refusal {
        Refusal::Unknown => missed_tag::Refusal::Unknown,
        Refusal::Outside => missed_tag::Refusal::Outside,
        Refusal::Small => missed_tag::Refusal::Small,
        Refusal::Cells => missed_tag::Refusal::Cells,
        Refusal::Contrast => missed_tag::Refusal::Contrast,
        Refusal::Misfit => missed_tag::Refusal::Misfit,
    }
}

const fn received(refusal: missed_tag::Refusal) -> Option<Refusal> {
    match refusal {
        missed_tag::Refusal::Unspecified => None,
        missed_tag::Refusal::Unknown => Some(Refusal::Unknown),
        missed_tag::Refusal::Outside => Some(Refusal::Outside),
        missed_tag::Refusal::Small => Some(Refusal::Small),
        missed_tag::Refusal::Cells => Some(Refusal::Cells),
        missed_tag::Refusal::Contrast => Some(Refusal::Contrast),
        missed_tag::Refusal::Misfit => Some(Refusal::Misfit),
    }
}

fn numbers(corners_px: &[Point2<f64>; 4]) -> Vec<f64> {
    corners_px.iter().flat_map(|corner| [corner.x, corner.y]).collect()
}

fn corners(numbers: &[f64]) -> Result<[Point2<f64>; 4], &'static str> {
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err(NOT_FINITE);
    }
    let numbers: &[f64; 8] = numbers.try_into().map_err(|_| "other than 8 corner coordinates")?;
    Ok(std::array::from_fn(|k| Point2::new(numbers[2 * k], numbers[2 * k + 1])))
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
    use locoman_vision::shells::ShellSet;
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
        let missed = MissedTag {
            id: shells.shells[1].tags[2].id,
            shell: 1,
            corners_px: found.corners_px,
            refusal: Refusal::Cells,
        };
        CameraUpdate {
            tags: owners.assign(vec![found]),
            missed: vec![missed],
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
        assert!(complaint(|m| m.missed[0].corners_px.truncate(6)).contains("8 corner"));
        assert!(complaint(|m| m.tags[0].covariance_px2.truncate(35)).contains("36"));
        assert!(complaint(|m| m.tags[0].covariance_px2[0] = -1.0).contains("not positive"));
    }
}
