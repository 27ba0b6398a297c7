//! Frames that come late, twice, or from clocks that jump.

use super::*;

fn followed(sut: &mut Fusion, steps: std::ops::Range<u64>, noise: &mut Noise) -> Vec<Verdict> {
    steps
        .map(|step| {
            let cameras = frames(sut, step, &[1], noise);
            sut.update(cameras).shells[1].verdict
        })
        .collect()
}

#[test]
fn a_late_frame_is_taken_in_at_its_own_time_and_readers_do_not_go_back() {
    let mut sut = sut();
    let mut noise = Noise(3);
    followed(&mut sut, 0..30, &mut noise);
    let late = frame(&sut, 0, 30, &[1], &mut noise);
    let newer = frame(&sut, 3, 31, &[1], &mut noise);
    let before = sut.update(vec![newer]);
    let after = sut.update(vec![late]);
    assert_eq!(after.time_ns, before.time_ns);
    assert_eq!(after.shells[1].verdict, Verdict::Tracked);
    // Another view helps: the doubt about now became smaller.
    let doubt = |update: &TrackUpdate| update.shells[1].covariance.fixed_view::<3, 3>(0, 0).trace();
    assert!(doubt(&after) < doubt(&before), "{} {}", doubt(&after), doubt(&before));
    let (position_m, _) = error(&after, 1);
    assert!(position_m < 1e-3, "{position_m}");
    assert_eq!(sut.dropped(), Dropped::default());
}

#[test]
fn frames_that_come_camera_by_camera_give_nearly_what_they_give_together() {
    let (mut together, mut single) = (sut(), sut());
    let mut noise = Noise(3);
    let mut last = None;
    for step in 0..30 {
        let cameras = frames(&together, step, &[1], &mut noise);
        cameras.iter().for_each(|frame| {
            last = Some(single.update(vec![frame.clone()]));
        });
        together.update(cameras);
    }
    let now_ns = last.expect("frames").time_ns;
    let pose = |sut: &Fusion| sut.predict(now_ns)[1].world_from_shell.expect("tracked");
    let apart = pose(&together).inverse() * pose(&single);
    assert!(apart.translation.vector.norm() < 2e-4, "{apart}");
    assert!(apart.rotation.angle() < 5e-3, "{apart}");
}

#[test]
fn duplicates_are_dropped_and_named() {
    let mut sut = sut();
    let mut noise = Noise(3);
    followed(&mut sut, 0..5, &mut noise);
    let again = frames(&sut, 4, &[1], &mut noise);
    let update = sut.update(again);
    assert_eq!(sut.dropped(), Dropped { duplicates: 4, ..Dropped::default() });
    assert!(update.cameras.iter().all(|frame| frame.problem.as_deref() == Some("this frame came twice")));
    assert_eq!(update.shells[1].verdict, Verdict::Predicted);
}

#[test]
fn one_camera_whose_clock_jumps_by_hours_does_no_harm() {
    let mut sut = sut();
    let mut noise = Noise(3);
    followed(&mut sut, 0..10, &mut noise);
    for step in 10..40 {
        let mut cameras = frames(&sut, step, &[1], &mut noise);
        cameras[2].capture_ns += 3_600_000 * MS;
        let update = sut.update(cameras);
        assert_eq!(update.shells[1].verdict, Verdict::Tracked);
        let (position_m, _) = error(&update, 1);
        assert!(position_m < 1e-3, "{position_m}");
    }
    assert_eq!(sut.dropped().clock_jumps, 30);
}

#[test]
fn when_all_clocks_jump_the_tracker_begins_anew_at_once() {
    let mut sut = sut();
    let mut noise = Noise(3);
    followed(&mut sut, 0..10, &mut noise);
    let verdicts = followed(&mut sut, 100_000..100_003, &mut noise);
    assert_eq!(verdicts, [Verdict::Tracked; 3]);
    assert_eq!(sut.dropped().clock_jumps, 2);
}
