//! Camera images in recordings: their topics, and times as Foxglove writes them.

use crate::messages::foxglove::CompressedImage;
use prost_types::Timestamp;

const NS_PER_S: u64 = 1_000_000_000;

/// The topic of a camera's images.
pub fn image_topic(camera: &str) -> String {
    format!("/camera/{camera}/image")
}

/// The topic of a camera's intrinsics.
pub fn calibration_topic(camera: &str) -> String {
    format!("/camera/{camera}/calibration")
}

/// Which camera's images a topic carries, if it carries images.
pub fn camera_of_image_topic(topic: &str) -> Option<&str> {
    topic
        .strip_prefix("/camera/")?
        .strip_suffix("/image")
        .filter(|camera| !camera.is_empty() && !camera.contains('/'))
}

/// An encoded image; `format` is "jpeg" or "png".
pub fn image(camera: &str, capture_ns: u64, format: &str, data: Vec<u8>) -> CompressedImage {
    CompressedImage {
        timestamp: Some(timestamp(capture_ns)),
        frame_id: camera.to_owned(),
        data,
        format: format.to_owned(),
    }
}

/// Nanoseconds as seconds and rest.
pub fn timestamp(ns: u64) -> Timestamp {
    // 2^64 ns are 1.8e10 s, and the rest is below 1e9: both fit.
    Timestamp { seconds: (ns / NS_PER_S) as i64, nanos: (ns % NS_PER_S) as i32 }
}

/// Nanoseconds of a timestamp; `None` if it is negative, beyond 2^64 ns, or its rest is no part of a second.
pub fn nanoseconds(timestamp: &Timestamp) -> Option<u64> {
    let rest = u64::try_from(timestamp.nanos).ok().filter(|&rest| rest < NS_PER_S)?;
    u64::try_from(timestamp.seconds).ok()?.checked_mul(NS_PER_S)?.checked_add(rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_cameras_topic_tells_the_camera() {
        assert_eq!(camera_of_image_topic(&image_topic("zed0_left")), Some("zed0_left"));
        for other in ["/camera//image", "/camera/a/b/image", "/camera/a/calibration", "/state", ""] {
            assert_eq!(camera_of_image_topic(other), None, "{other}");
        }
    }

    proptest! {
        #[test]
        fn times_survive_the_round_trip(ns in any::<u64>()) {
            prop_assert_eq!(nanoseconds(&timestamp(ns)), Some(ns));
        }

        #[test]
        fn any_timestamp_gives_a_time_or_none(seconds in any::<i64>(), nanos in any::<i32>()) {
            if let Some(ns) = nanoseconds(&Timestamp { seconds, nanos }) {
                prop_assert_eq!(timestamp(ns), Timestamp { seconds, nanos });
            }
        }
    }
}
