//! Hidden tags, false corners, swapped ids, jumps: no flip, no jump, and lost only when nothing is seen.

use nalgebra::Vector2;
use proptest::prelude::*;

use super::*;

/// Does to a frame what the issue names: half of the tags hidden, a tenth with grossly false corners, a
/// twentieth with another's id.
fn harm(frame: &mut CameraUpdate, noise: &mut Noise) {
    frame.tags.retain(|_| noise.uniform() > 0.5);
    for seen in &mut frame.tags {
        if noise.uniform() < 0.1 {
            let push = Vector2::new(noise.normal(), noise.normal()) * 20.0;
            let corner = (4.0 * noise.uniform()) as usize % 4;
            seen.detection.corners_px[corner] += push;
        }
    }
    for k in 1..frame.tags.len() {
        let (a, b) = (&frame.tags[k - 1], &frame.tags[k]);
        if a.shell == b.shell && noise.uniform() < 0.05 {
            let (first, second) = (a.tag, b.tag);
            frame.tags[k - 1].tag = second;
            frame.tags[k].tag = first;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn nothing_jumps_or_flips_under_half_hidden_tags_false_corners_and_swapped_ids(seed in 1_u64..1_000_000) {
        /// What the issue allows, for one tag alone more if its covariance says so; and a rotation that no flip is
        /// as small as.
        const JUMP_M: f64 = 2e-3;
        const SIGMAS: f64 = 4.0;
        const FLIP_RAD: f64 = 0.15;
        let mut sut = sut();
        let mut noise = Noise(seed);
        let shells = [0, 1, 2];
        let mut tracked = 0;
        for step in 0..90 {
            let mut cameras = frames(&sut, step, &shells, &mut noise);
            cameras.iter_mut().for_each(|frame| harm(frame, &mut noise));
            let visible = shells.map(|shell| {
                cameras.iter().flat_map(|frame| &frame.tags).filter(|seen| seen.shell == shell).count()
            });
            let update = sut.update(cameras);
            if step < 10 {
                continue;
            }
            for shell in shells {
                let verdict = update.shells[shell].verdict;
                prop_assert!(verdict != Verdict::Lost || visible[shell] == 0, "{shell} lost at {step}");
                if verdict == Verdict::Tracked {
                    let (position_m, rotation_rad) = error(&update, shell);
                    let doubt_m = update.shells[shell].covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
                    let allowed_m = if update.shells[shell].tags > 1 { JUMP_M } else { JUMP_M.max(SIGMAS * doubt_m) };
                    prop_assert!(position_m < allowed_m, "{shell} at {step}: {position_m} m, sigma {doubt_m} m");
                    prop_assert!(rotation_rad < FLIP_RAD, "{shell} at {step}: {rotation_rad} rad");
                    tracked += 1;
                }
            }
        }
        prop_assert!(tracked > 220, "{tracked} of 240 tracked");
    }
}

#[test]
fn a_single_tag_in_one_view_keeps_a_shell_tracked_without_a_flip() {
    let mut sut = sut();
    let mut noise = Noise(3);
    for step in 0..30 {
        let cameras = frames(&sut, step, &[1], &mut noise);
        sut.update(cameras);
    }
    let mut tracked = 0;
    for step in 30..90 {
        let mut frame = frame(&sut, 0, step, &[1], &mut noise);
        frame.tags.truncate(1);
        let update = sut.update(vec![frame]);
        if update.shells[1].verdict == Verdict::Tracked {
            tracked += 1;
            let (_, rotation_rad) = error(&update, 1);
            assert!(rotation_rad < 0.3, "{step}: {rotation_rad}");
        }
    }
    assert!(tracked > 45, "{tracked} of 60");
}

#[test]
fn a_jump_is_believed_only_after_it_was_confirmed() {
    let mut sut = sut();
    let mut noise = Noise(5);
    for step in 0..30 {
        let cameras = frames(&sut, step, &[1], &mut noise);
        sut.update(cameras);
    }
    // Somebody else's palm with the same tags, where the left palm is, is all that is seen from now on.
    let palm = sut.shells().shells[1].clone();
    let verdicts: Vec<Verdict> = (30..34)
        .map(|step| {
            let other = |camera: usize| {
                let capture_ns = capture_ns(camera, step);
                let mut frame = CameraUpdate::nothing(camera, capture_ns);
                let there = |t_s: f64| pose_at(2, t_s);
                frame.tags = seen(&rig().cameras, camera, &palm, capture_ns, &there, &mut noise);
                frame
            };
            let cameras = (0..4).map(other).collect();
            sut.update(cameras).shells[1].verdict
        })
        .collect();
    assert_eq!(verdicts, [Verdict::Predicted, Verdict::Predicted, Verdict::Tracked, Verdict::Tracked]);
}

#[test]
fn outliers_are_marked_as_not_used() {
    let mut sut = sut();
    let mut noise = Noise(5);
    for step in 0..10 {
        let cameras = frames(&sut, step, &[1], &mut noise);
        sut.update(cameras);
    }
    let mut cameras = frames(&sut, 10, &[1], &mut noise);
    cameras[0].tags[0].detection.corners_px[2] += Vector2::new(6.0, -4.0);
    let update = sut.update(cameras);
    assert_eq!(update.cameras[0].tags[0].fate, Fate::Outlier);
    let used = update.cameras.iter().flat_map(|frame| &frame.tags).filter(|seen| seen.is_used()).count();
    let all: usize = update.cameras.iter().map(|frame| frame.tags.len()).sum();
    assert_eq!(used, all - 1);
    assert!(update.cameras[0].tags[1].reprojected_px.is_some());
}

#[test]
fn a_lost_thumb_is_expected_where_its_palm_says() {
    let mut sut = sut();
    let mut noise = Noise(13);
    for step in 0..30 {
        let cameras = frames(&sut, step, &[1, 3], &mut noise);
        sut.update(cameras);
    }
    for step in 30..45 {
        let cameras = frames(&sut, step, &[1], &mut noise);
        let update = sut.update(cameras);
        if step > 39 {
            assert_eq!(update.shells[3].verdict, Verdict::Lost);
        }
    }
    let now_ns = capture_ns(3, 44);
    let settings = settings();
    assert!(sut.motions().at(now_ns, &settings)[3].is_none());
    let expected = sut.motions().expected_at(now_ns, &settings)[3].clone().expect("from its palm");
    let truth = pose_at(3, now_ns as f64 * 1e-9);
    let error = truth.inverse() * expected.world_from_shell;
    assert!(error.translation.vector.norm() < 0.06, "{error}");
    assert!(expected.pose_covariance()[(0, 0)].sqrt() > 0.005);
}
