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

#[cfg(test)]
mod tests {
    use locoman_vision::image::Frame;

    use super::*;

    fn moment(capture_ns: u64) -> FrameSet {
        let frame = |camera| Frame { camera, capture_ns, pixels: Pixels::Encoded(vec![0xff; 5000]) };
        FrameSet { frames: vec![frame(0), frame(1)] }
    }

    fn times(sets: &[FrameSet]) -> Vec<u64> {
        sets.iter().map(FrameSet::time_ns).collect()
    }

    #[test]
    fn moments_out_of_order_change_places_and_none_is_lost() {
        let (mut held, mut random) = (None, 1);
        let mut arrived = Vec::new();
        for (time_ns, fault) in [(1, true), (2, true), (3, true), (4, false)] {
            let fault = fault.then_some(Fault::OutOfOrder);
            arrived.extend(pass(fault, moment(time_ns), &mut held, &mut random));
        }
        assert_eq!(times(&arrived), [2, 1, 3, 4]);
    }

    #[test]
    fn a_clock_that_is_fast_takes_its_frames_out_of_the_set() {
        let arrived = pass(Some(Fault::TwentyMs), moment(1), &mut None, &mut 1);
        assert_eq!(times(&arrived), [1, 20_000_001]);
        assert!(arrived.iter().all(|set| set.frames.len() == 1));
    }

    #[test]
    fn some_pictures_are_damaged_and_others_are_not() {
        let mut random = 1;
        let arrived: Vec<FrameSet> =
            (0..20).flat_map(|n| pass(Some(Fault::Damaged), moment(n), &mut None, &mut random)).collect();
        let whole = moment(0).frames.remove(0).pixels;
        let damaged =
            arrived.iter().flat_map(|set| &set.frames).filter(|frame| frame.pixels != whole).count();
        assert!((5..25).contains(&damaged), "{damaged} of 40");
    }
}
