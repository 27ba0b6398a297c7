//! Frames in every order that cameras and networks think of.

use super::*;

const MS: u64 = 1_000_000;
const START: u64 = 5_000 * MS;
const HOUR: u64 = 3_600_000 * MS;

fn frame(camera: usize, capture_ns: u64) -> CameraUpdate {
    CameraUpdate::nothing(camera, capture_ns)
}

#[test]
fn frames_in_order_and_a_little_late_are_taken_in() {
    let mut sut = Admission::new(2);
    for (camera, ms) in [(0, 0), (1, 10), (0, 33), (1, 30), (0, 66), (1, 20)] {
        assert_eq!(sut.judge(&frame(camera, START + ms * MS)), Admitted::Yes, "{camera} {ms}");
    }
    assert_eq!(sut.dropped(), Dropped::default());
}

#[test]
fn duplicates_late_frames_and_unknown_cameras_are_left() {
    let mut sut = Admission::new(2);
    assert_eq!(sut.judge(&frame(0, START)), Admitted::Yes);
    assert_eq!(sut.judge(&frame(0, START)), Admitted::No);
    assert_eq!(sut.judge(&frame(1, START)), Admitted::Yes);
    assert_eq!(sut.judge(&frame(1, START - 51 * MS)), Admitted::No);
    assert_eq!(sut.judge(&frame(2, START)), Admitted::No);
    assert_eq!(sut.dropped(), Dropped { duplicates: 1, late: 1, clock_jumps: 0 });
}

#[test]
fn one_camera_whose_clock_jumps_is_left_aside_while_another_goes_on() {
    for jumped in [START + HOUR, 0] {
        let mut sut = Admission::new(2);
        sut.judge(&frame(1, START));
        for k in 1..20 {
            assert_eq!(sut.judge(&frame(0, jumped + k * 33 * MS)), Admitted::No);
            assert_eq!(sut.judge(&frame(1, START + k * 33 * MS)), Admitted::Yes);
        }
        assert_eq!(sut.dropped().clock_jumps, 19);
    }
}

#[test]
fn if_time_itself_jumped_it_is_believed_soon() {
    for jumped in [START + HOUR, 0] {
        let mut sut = Admission::new(2);
        sut.judge(&frame(0, START));
        let judged = [(0, 0), (1, 0), (0, 33), (1, 33)].map(|(c, ms)| sut.judge(&frame(c, jumped + ms * MS)));
        assert_eq!(judged, [Admitted::No, Admitted::No, Admitted::Anew, Admitted::Yes]);
        assert_eq!(sut.dropped().clock_jumps, 2);
    }
}
