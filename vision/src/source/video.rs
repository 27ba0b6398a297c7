//! Video files, V4L2 devices and network streams, by OpenCV; halves of side-by-side images (ZED over UVC).
//!
//! Cameras of a rig whose `source` names the same file or device share it: one image is read, each takes
//! its half. Capture time: the container's for files, the monotonic clock on arrival for devices.

use std::path::PathBuf;

use locoman_protocol::clock;
use opencv::core::{Mat, MatTraitConst, Rect, Vector};
use opencv::imgproc;
use opencv::videoio::{self, VideoCapture, VideoCaptureTrait, VideoCaptureTraitConst};

use super::{FrameSource, SourceError};
use crate::image::{Frame, GrayImage, Pixels};
use crate::rig::{CameraSource, Half, Rig};

/// Reads the sources that a rig file names.
pub struct VideoSource {
    inputs: Vec<Input>,
    skipped: u64,
}

/// One file or device and the cameras that it shows.
struct Input {
    name: PathBuf,
    capture: VideoCapture,
    live: bool,
    /// Camera index and its half.
    views: Vec<(usize, Option<Half>)>,
    /// Frames of the image that was read last, the last first.
    ready: Vec<Frame>,
    ended: bool,
}

impl VideoSource {
    /// Opens what the rig file names for each camera.
    pub fn open(rig: &Rig) -> Result<Self, SourceError> {
        Self::open_some(rig, |_| true)
    }

    /// Opens what the rig file names for some cameras, by their index.
    pub fn open_some(rig: &Rig, wanted: impl Fn(usize) -> bool) -> Result<Self, SourceError> {
        let mut inputs: Vec<Input> = Vec::new();
        for (index, (camera, source)) in rig.cameras.iter().zip(&rig.sources).enumerate() {
            if !wanted(index) {
                continue;
            }
            let (name, live) = place(source).ok_or_else(|| SourceError::MissingCamera {
                path: "rig file".into(),
                camera: camera.id.clone(),
                remedy: "give it source = { device = \"/dev/video0\" }, { file = … } or { url = … }"
                    .to_owned(),
            })?;
            match inputs.iter_mut().find(|input| input.name == name) {
                Some(input) => input.views.push((index, source.half)),
                None => inputs.push(Input::open(name, live, (index, source.half))?),
            }
        }
        Ok(Self { inputs, skipped: 0 })
    }
}

impl FrameSource for VideoSource {
    fn next_frame(&mut self) -> Result<Option<Frame>, SourceError> {
        for input in &mut self.inputs {
            while input.ready.is_empty() && !input.ended {
                self.skipped += input.read();
            }
        }
        // The earliest of all inputs; of equals the first.
        let next = self
            .inputs
            .iter_mut()
            .filter_map(|input| Some((input.ready.last()?.capture_ns, input)))
            .min_by_key(|(time, _)| *time);
        Ok(next.and_then(|(_, input)| input.ready.pop()))
    }

    fn skipped(&self) -> u64 {
        self.skipped
    }
}

impl Input {
    fn open(name: PathBuf, live: bool, view: (usize, Option<Half>)) -> Result<Self, SourceError> {
        let text = name.to_string_lossy();
        let backend = if live { videoio::CAP_V4L2 } else { videoio::CAP_ANY };
        let unreadable = |problem: String| SourceError::Unreadable {
            path: name.clone(),
            problem,
            remedy: if live {
                "is it plugged in, free, and are you in the group `video`?".to_owned()
            } else {
                "does the file exist, and is it a video?".to_owned()
            },
        };
        let capture = VideoCapture::from_file_with_params(&*text, backend, &Vector::new())
            .map_err(|error| unreadable(error.message))?;
        if !capture.is_opened().unwrap_or(false) {
            return Err(unreadable("cannot be opened".to_owned()));
        }
        Ok(Self { name, capture, live, views: vec![view], ready: Vec::new(), ended: false })
    }

    /// Reads one image into `ready`; how many frames could not be made of it.
    fn read(&mut self) -> u64 {
        let mut image = Mat::default();
        let read = self.capture.read(&mut image).unwrap_or(false);
        if !read || image.empty() {
            self.ended = true;
            return 0;
        }
        let capture_ns = if self.live {
            clock::monotonic_ns()
        } else {
            let position_ms = self.capture.get(videoio::CAP_PROP_POS_MSEC).unwrap_or(0.0);
            (position_ms.max(0.0) * 1e6) as u64
        };
        let mut skipped = 0;
        for &(camera, half) in self.views.iter().rev() {
            match gray_half(&image, half) {
                Ok(gray) => {
                    self.ready.push(Frame { camera, capture_ns, pixels: Pixels::Gray(gray) });
                }
                Err(error) => {
                    tracing::warn!(source = %self.name.display(), %error, "skipped a frame");
                    skipped += 1;
                }
            }
        }
        skipped
    }
}

/// The file, device or address of a source, and whether it is live.
fn place(source: &CameraSource) -> Option<(PathBuf, bool)> {
    if let Some(device) = &source.device {
        return Some((device.clone(), true));
    }
    source.file.clone().or_else(|| source.url.as_ref().map(PathBuf::from)).map(|path| (path, false))
}

fn gray_half(image: &Mat, half: Option<Half>) -> opencv::Result<GrayImage> {
    let width = image.cols() / 2;
    let x = match half {
        None => 0,
        Some(Half::Left) => 0,
        Some(Half::Right) => width,
    };
    let view = Rect::new(x, 0, if half.is_some() { width } else { image.cols() }, image.rows());
    let part = Mat::roi(image, view)?.try_clone()?;
    if part.channels() == 1 {
        return GrayImage::from_mat(&part);
    }
    let mut gray = Mat::default();
    imgproc::cvt_color_def(&part, &mut gray, imgproc::COLOR_BGR2GRAY)?;
    GrayImage::from_mat(&gray)
}
