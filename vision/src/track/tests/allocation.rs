//! Once it runs, the way of a frame takes no memory but what it hands over: reading, solving and fusing.

#[path = "../../../../tests/shared/counting_allocator.rs"]
mod counting_allocator;

use counting_allocator::counted;

use super::*;

const WARM_UP: u64 = 40;
const FRAMES: u64 = 20;

#[test]
fn the_way_of_a_frame_takes_only_the_memory_that_it_hands_over() {
    /// The tags of a camera, and those that it missed.
    const OF_AN_EYE: usize = 2;
    /// The shells of an update.
    const OF_FUSION: usize = 1;
    let (rig, shells, settings) = (testing::rig(), testing::shells(), TrackerSettings::default());
    let set = frames(0, &testing::worn());
    let images: Vec<GrayImage> =
        set.frames.iter().map(|frame| frame.pixels.to_gray().expect("grey").into_owned()).collect();
    let cameras = 0..rig.cameras.len();
    let mut eyes: Vec<Eye> = cameras.clone().map(|index| Eye::new(&rig, index, &shells, &settings)).collect();
    let mut sut = Fusion::new(rig.clone(), shells.clone(), settings.clone());
    let search = |camera: usize| {
        let mut scout = Scout::new(&rig, camera, &shells, &settings).expect("scout");
        scout.search(&images[camera], STEP_NS, None)
    };
    sut.update(cameras.map(search).collect());
    for frame in 2..WARM_UP + FRAMES {
        let motions = sut.motions();
        let mut updates = Vec::with_capacity(eyes.len());
        for (eye, image) in eyes.iter_mut().zip(&images) {
            let (update, taken) = counted(|| eye.look(image, frame * STEP_NS, &motions));
            assert!(frame < WARM_UP || taken <= OF_AN_EYE, "frame {frame}: an eye took {taken}");
            updates.push(update);
        }
        let (update, taken) = counted(|| sut.update(updates));
        assert!(frame < WARM_UP || taken <= OF_FUSION, "frame {frame}: fusion took {taken}");
        if frame >= WARM_UP {
            assert!(update.shells.iter().all(|shell| shell.verdict == Verdict::Tracked), "frame {frame}");
        }
    }
}
