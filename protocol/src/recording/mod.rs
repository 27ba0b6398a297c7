//! Recordings: MCAP files with protobuf messages, whose schemas they carry, so that Foxglove, Rerun and
//! PlotJuggler open them.
//!
//! | topic | message |
//! |---|---|
//! | `/camera/<id>/image` | [`CompressedImage`], time = exposure |
//! | `/camera/<id>/calibration` | [`CameraCalibration`] |
//! | `/truth/shells` | [`Tracking`], only from the renderer |
//! | `/command`, `/state`, `/truth`, `/tracking`, `/event` | what went over the link, by [`Topic::recording_name`] |
//!
//! Times are nanoseconds of the recording machine's monotonic clock. Configuration texts (rig, shells) are
//! attachments.
//!
//! **Crashes.** The file is written under its final name, a chunk at a time, and a chunk is closed after a
//! second at the latest. If the process dies, the file has no summary and perhaps half a chunk at its end;
//! [`Reader`] gives every message before that, then one error that says where it stopped.
//!
//! [`CompressedImage`]: crate::messages::foxglove::CompressedImage
//! [`CameraCalibration`]: crate::messages::foxglove::CameraCalibration
//! [`Tracking`]: crate::messages::Tracking
//! [`Topic::recording_name`]: crate::Topic::recording_name

mod error;
mod fields;
mod frames;
mod images;
mod overview;
mod reader;
mod schema;
mod writer;

pub use error::RecordingError;
pub use images::{calibration_topic, camera_of_image_topic, image, image_topic, nanoseconds, timestamp};
pub use overview::{Attachment, Overview};
pub use reader::{Channel, Reader, Recorded};
pub use writer::Writer;
