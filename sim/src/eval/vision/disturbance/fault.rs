//! What goes wrong between a camera and the tracker, not before the lens.

use locoman_vision::image::Pixels;
use locoman_vision::source::FrameSet;

use crate::operator::sensor::mix;

/// A fault of transport or clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Every two moments change places.
    OutOfOrder,
    /// Every frame comes twice.
    Doubled,
    /// One camera's clock is an hour fast,
    Hour,
    /// or 20 ms: nothing tells but the picture.
    TwentyMs,
    /// A third of the JPEGs are cut or have bytes overwritten.
    Damaged,
}

/// The camera with the wrong clock.
const CAMERA: usize = 0;

/// What arrives of a moment's frames; `held` is what waits for its turn.
pub fn pass(
    fault: Option<Fault>,
    frames: FrameSet,
    held: &mut Option<FrameSet>,
    random: &mut u64,
) -> Vec<FrameSet> {
    match fault {
        Some(Fault::OutOfOrder) => match held.take() {
            Some(earlier) => vec![frames, earlier],
            None => {
                *held = Some(frames);
                Vec::new()
            }
        },
        Some(Fault::Doubled) => vec![frames.clone(), frames],
        Some(Fault::Hour) => apart(frames, 3_600_000_000_000),
        Some(Fault::TwentyMs) => apart(frames, 20_000_000),
        Some(Fault::Damaged) => vec![damaged(frames, random)],
        None => held.take().into_iter().chain([frames]).collect(),
    }
}

/// Frames that seem to be of another time are no longer of one set with the rest.
fn apart(mut frames: FrameSet, fast_ns: u64) -> Vec<FrameSet> {
    let mut fast = FrameSet::default();
    while let Some(at) = frames.frames.iter().position(|frame| frame.camera == CAMERA) {
        let mut frame = frames.frames.swap_remove(at);
        frame.capture_ns += fast_ns;
        fast.frames.push(frame);
    }
    [frames, fast].into_iter().filter(|set| !set.frames.is_empty()).collect()
}

fn damaged(mut frames: FrameSet, random: &mut u64) -> FrameSet {
    /// Where the picture's data begin, and how much is overwritten.
    const HEADER: usize = 700;
    const OVERWRITTEN: usize = 64;
    for frame in &mut frames.frames {
        *random = mix(*random);
        let Pixels::Encoded(bytes) = &mut frame.pixels else { continue };
        if !random.is_multiple_of(3) || bytes.len() < 2 * HEADER {
            continue;
        }
        let at = HEADER + (mix(*random ^ 1) as usize) % (bytes.len() - HEADER);
        if random.is_multiple_of(2) {
            bytes.truncate(at);
        } else {
            for (k, byte) in bytes[at..].iter_mut().take(OVERWRITTEN).enumerate() {
                *byte = mix(*random ^ k as u64) as u8;
            }
        }
    }
    frames
}
