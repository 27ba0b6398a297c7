//! Rows that are exposed one after another, and cameras that are not in step: pictures and recordings against the
//! truth.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

mod corners;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use corners::Comparison;
use locoman_protocol::messages::Tracking;
use locoman_protocol::recording::{Reader, camera_of_image_topic};
use locoman_sim::operator::motion::Body;
use locoman_sim::operator::output::Output;
use locoman_sim::operator::studio::Studio;
use locoman_sim::operator::{FIRST_CAPTURE_NS, Formats, Inputs, Schedule, create_recording, render_to};
use nalgebra::{Isometry3, Point2, Point3};

const ROLLING: &str = "two_zed_pairs_rolling_720p.toml";

fn inputs(rig: &str, scene: &str) -> Inputs {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    Inputs {
        rig: configs.join("rigs").join(rig),
        scene: configs.join("scenes").join(scene),
        ..Inputs::standard(&configs)
    }
}

fn studio(rig: &str, scene: &str) -> Studio {
    inputs(rig, scene).studio(1).expect("the committed files are good")
}

#[test]
fn a_fast_shell_shows_its_corners_where_its_own_rows_see_them() {
    /// The detector has 0.02 px at rest; 1.4 px of motion blur add little.
    const MOST_RMS_PX: f64 = 0.1;
    /// Tags that move by more than this from where they are at the capture time show that rows matter.
    const LEAST_SHIFT_PX: f64 = 3.0;
    let sut = studio(ROLLING, "fast.toml");
    let (mut comparison, mut most_shift_px) = (Comparison::new(&sut), 0.0f64);
    for t_s in [4.1, 4.4, 7.3] {
        for camera in 0..sut.cameras().len() {
            for truth in comparison.look(&sut, camera, t_s, 0, |tag| tag.body != Body::Torso) {
                let at_capture = global_sighting(&sut, camera, t_s, truth.id);
                most_shift_px = most_shift_px.max((at_capture - truth.corners_px[0]).norm());
            }
        }
    }
    let Comparison { coordinates: corners, missed, .. } = comparison;
    let rms_px = comparison.rms_px();
    println!(
        "{corners} corner coordinates, RMS {rms_px:.4} px, {missed} missed, rows shift by {most_shift_px:.1} px"
    );
    assert!(corners > 250, "only {corners} corner coordinates seen");
    assert!(rms_px < MOST_RMS_PX, "{rms_px} px");
    assert!(missed * 20 < corners / 8, "{missed} of {} tags missed", corners / 8);
    assert!(most_shift_px > LEAST_SHIFT_PX, "{most_shift_px} px");
}

/// Where the first corner of a tag would be if all rows were exposed at the capture time.
fn global_sighting(sut: &Studio, camera: usize, t_s: f64, id: u32) -> Point2<f64> {
    let camera = sut.true_camera(camera, t_s);
    let mut tags = sut.solids().iter().flat_map(|solid| {
        solid.facets.iter().flat_map(move |facet| facet.tags.iter().map(move |tag| (solid.body, facet, tag)))
    });
    let (body, facet, tag) = tags.find(|(_, _, tag)| tag.id == id).expect("a tag of the shells");
    let (c, s) = (tag.x_axis[0], tag.x_axis[1]);
    let h = tag.size_m / 2.0;
    let corner = Point3::new(tag.center.x + h * (s - c), tag.center.y - h * (s + c), 0.0);
    let world_from_facet: Isometry3<f64> = sut.true_pose(body, t_s) * facet.shell_from_facet;
    camera
        .project(&(camera.world_from_camera.inv_mul(&world_from_facet) * corner))
        .expect("before the camera")
}

#[test]
fn what_stands_still_looks_alike_through_both_shutters() {
    let (rolling, global) = (studio(ROLLING, "static.toml"), studio("two_zed_pairs.toml", "static.toml"));
    assert!(rolling.picture(0, 1.0, 0) == global.picture(0, 1.0, 0));
    let seen = |sut: &Studio| -> Vec<(u32, [Point2<f64>; 4], bool)> {
        sut.sightings(0, 1.0).into_iter().map(|tag| (tag.id, tag.corners_px, tag.clear)).collect()
    };
    assert_eq!(seen(&rolling), seen(&global));
}

#[test]
fn cameras_out_of_step_carry_their_own_capture_times_and_truths() {
    let folder = std::env::temp_dir().join(format!("locoman-phases-{}", std::process::id()));
    let path: PathBuf = folder.join("a.mcap");
    let inputs = inputs(ROLLING, "fast.toml");
    let sut = inputs.studio(1).expect("the committed files are good");
    let recording = create_recording(&path, &inputs, &sut).expect("recording");
    let mut outputs: Vec<Box<dyn Output>> = vec![Box::new(recording)];
    let schedule = Schedule::new(0.1, 30.0).expect("3 instants");
    render_to(&sut, schedule, Formats { jpeg: true, png: false }, &mut outputs).expect("rendering");
    outputs.into_iter().for_each(|output| output.finish().expect("finish"));

    let mut images: HashMap<String, Vec<u64>> = HashMap::new();
    let mut truths = Vec::new();
    let mut last_ns = 0;
    for message in Reader::open(&path).expect("open") {
        let message = message.expect("whole");
        assert!(message.time_ns >= last_ns, "{} is out of order", message.topic());
        last_ns = message.time_ns;
        if let Some(camera) = camera_of_image_topic(message.topic()) {
            images.entry(camera.to_owned()).or_default().push(message.time_ns);
        } else if message.is::<Tracking>() {
            truths.push(message.decode::<Tracking>().expect("truth"));
        }
    }
    std::fs::remove_dir_all(&folder).expect("clean up");

    const PHASE_NS: u64 = 7_300_000;
    let right: Vec<u64> = [0, 33_333_333, 66_666_667].map(|t_ns| FIRST_CAPTURE_NS + t_ns).to_vec();
    let left: Vec<u64> = right.iter().map(|t_ns| t_ns + PHASE_NS).collect();
    for camera in ["right_zed_left", "right_zed_right"] {
        assert_eq!(images[camera], right, "{camera}");
    }
    for camera in ["left_zed_left", "left_zed_right"] {
        assert_eq!(images[camera], left, "{camera}");
    }
    let mut all: Vec<u64> = right.into_iter().chain(left).collect();
    all.sort_unstable();
    for (i, (truth, t_ns)) in truths.iter().zip(&all).enumerate() {
        let header = truth.header.as_ref().expect("a header");
        assert_eq!((header.sequence, header.capture_ns), (i as u64, *t_ns));
        let t_s = (t_ns - FIRST_CAPTURE_NS) as f64 * 1e-9;
        let palm = truth.shells.iter().find(|shell| shell.shell == "right_palm").expect("a palm");
        let said = Isometry3::try_from(palm.pose.as_ref().expect("a pose")).expect("a whole pose");
        let expected = sut.true_pose(Body::RightPalm, t_s);
        // Times are rounded to nanoseconds.
        assert!((said.translation.vector - expected.translation.vector).norm() < 1e-8);
    }
    assert_eq!(truths.len(), all.len());
}

#[test]
fn a_phase_of_more_than_a_period_counts_by_its_rest() {
    let sut = studio(ROLLING, "fast.toml");
    let schedule = Schedule::new(0.015, 200.0).expect("3 instants at 5 ms");
    let times: Vec<u64> =
        schedule.moments(&sut).iter().map(|moment| moment.capture_ns - FIRST_CAPTURE_NS).collect();
    assert_eq!(times, [0, 2_300_000, 5_000_000, 7_300_000, 10_000_000, 12_300_000]);
}
