//! The rendered operator against the detector and against his own truth.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

mod corners;

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use corners::Comparison;
use locoman_protocol::messages::Tracking;
use locoman_protocol::recording::{Reader, camera_of_image_topic};
use locoman_sim::operator::motion::{Body, Motion};
use locoman_sim::operator::output::Output;
use locoman_sim::operator::scene::Scene;
use locoman_sim::operator::studio::Studio;
use locoman_sim::operator::{Formats, Inputs, Schedule, create_recording, render_to};

fn inputs() -> Inputs {
    Inputs::standard(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs"))
}

fn studio() -> Studio {
    inputs().studio(1).expect("the committed files are good")
}

fn motion() -> Motion {
    Scene::read(&inputs().scene).expect("the committed scene is good").motion
}

#[test]
fn the_detector_finds_corners_where_the_truth_projects_them() {
    /// Half-pixel mistakes give 0.5 px and mirrored tags none at all; the detector itself has 0.02 px.
    const MOST_RMS_PX: f64 = 0.1;
    let sut = studio();
    let mut comparison = Comparison::new(&sut);
    for (frame, t_s) in (0..).zip([0.0, 6.0, 13.0]) {
        for camera in 0..sut.cameras().len() {
            comparison.look(&sut, camera, t_s, frame, |_| true);
        }
    }
    let Comparison { coordinates: corners, missed, .. } = comparison;
    let rms_px = comparison.rms_px();
    println!("{corners} corner coordinates, RMS {rms_px:.4} px, {missed} tags missed");
    assert!(corners > 400, "only {corners} corner coordinates seen");
    assert!(rms_px < MOST_RMS_PX, "{rms_px} px");
    assert!(missed * 50 < corners / 8, "{missed} of {} tags missed", corners / 8);
}

#[test]
fn every_shell_is_readable_by_two_cameras_all_along_the_script() {
    let sut = studio();
    let period_s = sut.scene().motion.period_s;
    let instants = 110;
    for body in Body::ALL {
        let mut short = Vec::new();
        for i in 0..instants {
            let t_s = period_s * f64::from(i) / f64::from(instants);
            let cameras = (0..sut.cameras().len())
                .filter(|&camera| {
                    sut.sightings(camera, t_s).iter().any(|tag| tag.body == body && tag.is_readable())
                })
                .count();
            if cameras < 2 {
                short.push(t_s);
            }
        }
        println!("{}: {} of {instants} instants short", body.name(), short.len());
        assert!(short.is_empty(), "{} is seen by fewer than two cameras at {short:?} s", body.name());
    }
}

#[test]
fn the_motion_stays_within_what_the_robot_can_follow() {
    let sut = motion();
    let home = sut.posture(0.0);
    for (body, most_m, most_rad, most_m_s) in [
        (Body::RightPalm, 0.13, 0.55, 0.30),
        (Body::LeftPalm, 0.06, 0.25, 0.15),
        (Body::Torso, 0.05, 0.22, 0.10),
    ] {
        let (mut far_m, mut turned_rad, mut fast_m_s) = (0.0f64, 0.0f64, 0.0f64);
        for i in 0..2200 {
            let t_s = 0.01 * f64::from(i);
            let offset = home.of(body).inv_mul(sut.posture(t_s).of(body));
            far_m = far_m.max(offset.translation.vector.norm());
            turned_rad = turned_rad.max(offset.rotation.angle());
            fast_m_s = fast_m_s.max(sut.velocity(body, t_s).0.norm());
        }
        println!("{}: {far_m:.3} m, {:.1} deg, {fast_m_s:.3} m/s", body.name(), turned_rad * 180.0 / PI);
        assert!(far_m < most_m && turned_rad < most_rad && fast_m_s < most_m_s, "{}", body.name());
    }
}

#[test]
fn the_operator_rests_at_begin_and_end() {
    let sut = motion();
    for body in Body::ALL {
        for t_s in [0.0, 1.0, 1.9, sut.period_s - 0.9, sut.period_s - 0.1] {
            assert!(sut.velocity(body, t_s).0.norm() < 1e-12, "{} at {t_s} s", body.name());
        }
    }
}

#[test]
fn a_recording_holds_all_images_and_the_truth_and_is_the_same_each_time() {
    let folder = std::env::temp_dir().join(format!("locoman-operator-{}", std::process::id()));
    let sut = studio();
    let cameras = sut.cameras().len();
    let schedule = Schedule::new(0.1, 30.0).expect("3 instants");
    let formats = Formats { jpeg: true, png: false };
    let write = |name: &str| -> PathBuf {
        let path = folder.join(name);
        let recording = create_recording(&path, &inputs(), &sut).expect("recording");
        let mut outputs: Vec<Box<dyn Output>> = vec![Box::new(recording)];
        render_to(&sut, schedule, formats, &mut outputs).expect("rendering");
        assert!(!path.exists(), "unfinished, it has no name yet");
        outputs.into_iter().for_each(|output| output.finish().expect("finish"));
        path
    };
    let first = write("a.mcap");
    let (mut images, mut truths, mut calibrations) = (0, 0, 0);
    for message in Reader::open(&first).expect("open") {
        let message = message.expect("whole");
        if camera_of_image_topic(message.topic()).is_some() {
            images += 1;
        } else if message.is::<Tracking>() {
            let truth: Tracking = message.decode().expect("truth");
            assert_eq!(truth.shells.len(), 5);
            truths += 1;
        } else {
            assert!(message.topic().ends_with("/calibration"), "{}", message.topic());
            calibrations += 1;
        }
    }
    assert_eq!((images, truths, calibrations), (3 * cameras, 3, cameras));
    let second = write("b.mcap");
    assert!(std::fs::read(&first).expect("a") == std::fs::read(&second).expect("b"));
    std::fs::remove_dir_all(&folder).expect("clean up");
}

#[test]
fn a_scene_with_a_typo_is_refused_by_file_line_and_key() {
    let good = std::fs::read_to_string(inputs().scene).expect("the committed scene");
    let path = std::env::temp_dir().join(format!("locoman-scene-{}.toml", std::process::id()));
    std::fs::write(&path, good.replacen("exposure_s", "exposure_ms", 1)).expect("write");
    let error = Scene::read(&path).expect_err("an unknown key");
    let said = format!("{:#}", anyhow::Error::from(error));
    let line = 1 + good.lines().position(|line| line.starts_with("exposure_s")).expect("the key");
    assert!(said.contains("exposure_ms") && said.contains(&format!("line {line}")), "{said}");
    assert!(said.contains(&path.display().to_string()), "{said}");
    std::fs::remove_file(&path).expect("clean up");
}
