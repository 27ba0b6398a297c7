//! Cameras that are not where the rig file says.

use nalgebra::Translation3;

use super::*;

const BUMPED: usize = 2;

/// All shells are seen by all cameras at a step, one of which was bumped by 2 cm.
fn frames_of_bumped(sut: &Fusion, step: u64, noise: &mut Noise) -> Vec<CameraUpdate> {
    let mut bumped = sut.rig().cameras.clone();
    let shift = Translation3::new(0.012, -0.016, 0.0);
    bumped[BUMPED].world_from_camera = shift * bumped[BUMPED].world_from_camera;
    let frame = |camera: usize| {
        let capture_ns = capture_ns(camera, step);
        let mut update = CameraUpdate::nothing(camera, capture_ns);
        for (shell, described) in sut.shells().shells.iter().enumerate() {
            let pose_at = |t_s: f64| pose_at(shell, t_s);
            update.tags.extend(seen(&bumped, camera, described, capture_ns, &pose_at, noise));
        }
        update
    };
    (0..bumped.len()).map(frame).collect()
}

fn all_frames(sut: &Fusion, step: u64, noise: &mut Noise) -> Vec<CameraUpdate> {
    frames(sut, step, &[0, 1, 2, 3, 4], noise)
}

#[test]
fn a_bumped_camera_is_named_within_two_seconds_and_moves_no_shell() {
    const BUMP: u64 = 30;
    let mut sut = sut();
    let mut noise = Noise(21);
    let mut named = None;
    for step in 0..150 {
        let cameras = if step < BUMP {
            all_frames(&sut, step, &mut noise)
        } else {
            frames_of_bumped(&sut, step, &mut noise)
        };
        let update = sut.update(cameras);
        let moved: Vec<usize> =
            update.cameras.iter().filter(|seen| seen.moved_px.is_some()).map(|seen| seen.camera).collect();
        assert!(moved.iter().all(|camera| *camera == BUMPED), "{moved:?} at step {step}");
        if moved.is_empty() {
            assert!(named.is_none(), "it is still there at step {step}");
        } else {
            assert!(step > BUMP + 10, "hasty at step {step}");
            named.get_or_insert(step);
        }
        if step > 10 {
            for shell in 0..5 {
                let (position_m, _) = error(&update, shell);
                assert!(
                    position_m < 2e-3,
                    "{} is {position_m} m off at step {step}",
                    sut.shells().shells[shell].name
                );
            }
        }
    }
    assert!(named.is_some_and(|step| step < BUMP + 60), "{named:?}");
}

#[test]
fn a_camera_that_is_put_back_is_believed_again() {
    let mut sut = sut();
    let mut noise = Noise(22);
    let mut moved = [false; 160];
    for (step, moved) in (0..).zip(&mut moved) {
        let cameras = if (30..90).contains(&step) {
            frames_of_bumped(&sut, step, &mut noise)
        } else {
            all_frames(&sut, step, &mut noise)
        };
        *moved = sut.update(cameras).cameras.iter().any(|seen| seen.moved_px.is_some());
    }
    assert!(moved[89] && !moved[159]);
}
