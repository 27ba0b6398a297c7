//! Each event of a scene shows in the pictures, and only while it lasts.

#![expect(clippy::expect_used, reason = "helpers of tests: a panic there is the report")]

use std::path::Path;
use std::sync::LazyLock;

use locoman_sim::operator::Inputs;
use locoman_sim::operator::event::{
    Bump, Cover, Exposing, Look, Pass, Poster, Tear, TearLook, Visitor, VisitorTags,
};
use locoman_sim::operator::motion::{Body, Home};
use locoman_sim::operator::scene::{Phase, Scene};
use locoman_sim::operator::sight::Sighting;
use locoman_sim::operator::studio::{Picture, Studio};
use locoman_vision::detect::{Detection, Detector, Search};
use locoman_vision::image::GrayImage;
use nalgebra::Point3;

/// The operator stands still, so that pictures differ by nothing but events.
static BASE: LazyLock<Studio> = LazyLock::new(|| {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let inputs = Inputs {
        rig: configs.join("rigs/two_zed_pairs_rolling_720p.toml"),
        scene: configs.join("scenes/static.toml"),
        ..Inputs::standard(&configs)
    };
    inputs.studio(1).expect("the committed files are good")
});

const CAMERA: usize = 0;
const CAMERA_ID: &str = "right_zed_left";
/// All events of this file last from 1 to 3 s.
const DURING_S: [f64; 2] = [1.0, 3.0];
const BEFORE_S: f64 = 0.5;
const WITHIN_S: f64 = 2.0;
/// All tags of tag36h11: what else is printed shows too.
const FAMILY: u32 = 587;
const PALMS: [Body; 2] = [Body::RightPalm, Body::LeftPalm];

fn with(change: impl FnOnce(&mut Scene)) -> Studio {
    let mut scene = BASE.scene().clone();
    change(&mut scene);
    BASE.with_scene(scene).expect("a good scene")
}

fn picture(sut: &Studio, t_s: f64) -> Picture {
    sut.picture(CAMERA, t_s, 0)
}

fn mean(picture: &Picture) -> f64 {
    picture.grey.iter().map(|grey| f64::from(*grey)).sum::<f64>() / picture.grey.len() as f64
}

fn detect(picture: Picture) -> Vec<Detection> {
    let ids: Vec<u32> = (0..FAMILY).collect();
    let mut detector = Detector::new(&ids).expect("ids of the family");
    let image = GrayImage::new(picture.width, picture.height, picture.grey).expect("size");
    detector.detect(&image, Search::Full { decimate: 1.0 })
}

/// Only what differs from the picture without the event, on grey.
fn difference(sut: &Studio) -> Picture {
    const GREY: u8 = 128;
    let (mut with, without) = (picture(sut, WITHIN_S), picture(&BASE, WITHIN_S));
    for (pixel, old) in with.grey.iter_mut().zip(&without.grey) {
        if pixel == old {
            *pixel = GREY;
        }
    }
    with
}

fn readable(sut: &Studio, t_s: f64) -> Vec<Sighting> {
    sut.sightings(CAMERA, t_s).into_iter().filter(Sighting::is_readable).collect()
}

/// A readable tag with large sides.
fn victim() -> Sighting {
    readable(&BASE, WITHIN_S)
        .into_iter()
        .max_by(|a, b| a.side_px.total_cmp(&b.side_px))
        .expect("the operator stands before the camera")
}

fn home(xyz: [f64; 3], rpy_deg: [f64; 3]) -> Home {
    Home { xyz, rpy_deg }
}

fn before_and_after_are_as_ever(sut: &Studio) {
    for t_s in [BEFORE_S, DURING_S[1]] {
        assert!(picture(sut, t_s) == picture(&BASE, t_s), "at {t_s} s");
        assert_eq!(sut.sightings(CAMERA, t_s), BASE.sightings(CAMERA, t_s), "at {t_s} s");
    }
}

#[test]
fn a_covered_lens_sees_black_or_skin_and_no_tag() {
    for (look, least, most) in [(Look::Black, 4.0, 8.0), (Look::Hand, 30.0, 100.0)] {
        let during_s = DURING_S.into();
        let sut = with(|scene| {
            scene.events.cover.push(Cover { during_s, cameras: vec![CAMERA_ID.into()], look });
        });
        let covered = picture(&sut, WITHIN_S);
        let grey = mean(&covered);
        assert!((least..most).contains(&grey), "{look:?}: {grey}");
        assert!(detect(covered).is_empty() && readable(&sut, WITHIN_S).is_empty());
        assert!(sut.picture(1, WITHIN_S, 0) == BASE.picture(1, WITHIN_S, 0), "the other camera is free");
        before_and_after_are_as_ever(&sut);
    }
}

#[test]
fn all_cameras_are_covered_if_none_is_named() {
    let sut = with(|scene| {
        scene.events.cover.push(Cover { during_s: DURING_S.into(), cameras: vec![], look: Look::Black });
    });
    for camera in 0..sut.cameras().len() {
        assert!(mean(&sut.picture(camera, WITHIN_S, 0)) < 8.0);
    }
}

#[test]
fn a_passing_hand_hides_tags_on_its_way() {
    let sut = with(|scene| {
        let (during_s, camera) = (DURING_S.into(), CAMERA_ID.to_owned());
        scene.events.pass.push(Pass { during_s, camera, distance_m: 0.3 });
    });
    let free = readable(&BASE, WITHIN_S).len();
    let least = (0..20).map(|i| readable(&sut, 1.0 + 0.1 * f64::from(i)).len()).min().expect("times");
    assert!(free >= 8 && least + 3 <= free, "{least} of {free} stay");
    let hidden: Vec<u32> = sut
        .sightings(CAMERA, WITHIN_S)
        .iter()
        .filter(|tag| !tag.clear)
        .map(|tag| tag.id)
        .filter(|id| readable(&BASE, WITHIN_S).iter().any(|tag| tag.id == *id))
        .collect();
    let found = detect(picture(&sut, WITHIN_S));
    assert!(hidden.iter().filter(|id| found.iter().any(|tag| tag.id == **id)).count() * 4 <= hidden.len());
    before_and_after_are_as_ever(&sut);
}

#[test]
fn a_visitor_wears_tags_of_his_own_or_the_operators() {
    for tags in [VisitorTags::Other, VisitorTags::Same] {
        let sut = with(|scene| {
            scene.events.visitor.push(Visitor {
                during_s: DURING_S.into(),
                tags,
                world_from_operator: home([-0.25, 0.45, 0.05], [0.0, 0.0, 0.0]),
                delay_s: 0.0,
            });
        });
        let worn =
            |id: u32| sut.solids().iter().flat_map(|s| &s.facets).flat_map(|f| &f.tags).any(|t| t.id == id);
        let found = detect(difference(&sut));
        println!("{tags:?}: {} tags of the visitor", found.len());
        assert!(found.len() >= 4, "{tags:?}: {}", found.len());
        assert!(found.iter().all(|tag| worn(tag.id) == (tags == VisitorTags::Same)), "{tags:?}");
        before_and_after_are_as_ever(&sut);
    }
}

#[test]
fn a_torn_tag_is_gone_or_hangs_away() {
    const HANGS_BY_PX: f64 = 5.0;
    let id = victim().id;
    for look in [TearLook::Gone, TearLook::Hanging] {
        let sut = with(|scene| scene.events.tear.push(Tear { during_s: DURING_S.into(), id, look }));
        let found = detect(picture(&sut, WITHIN_S));
        let found = found.iter().find(|tag| tag.id == id);
        match (look, found) {
            (TearLook::Gone, found) => assert!(found.is_none()),
            (TearLook::Hanging, Some(tag)) => {
                let moved =
                    (0..4).map(|k| (tag.corners_px[k] - victim().corners_px[k]).norm()).fold(0.0, f64::max);
                assert!(moved > HANGS_BY_PX, "{moved} px");
            }
            // Seen too flatly to be read, or in the shade of its facet: not where it belongs at any rate.
            (TearLook::Hanging, None) => {}
        }
        assert!(sut.sightings(CAMERA, WITHIN_S).iter().all(|tag| tag.id != id), "it is off its shell");
        assert!(readable(&sut, WITHIN_S).len() + 3 >= readable(&BASE, WITHIN_S).len(), "the others stay");
        before_and_after_are_as_ever(&sut);
    }
}

#[test]
fn a_poster_shows_its_tags_where_it_hangs() {
    /// The paper is lit unevenly, and the tags are large.
    const MOST_OFF_PX: f64 = 0.3;
    let (place, size_m) = (home([0.0, -0.45, 1.25], [90.0, 0.0, 90.0]), 0.06);
    let sut = with(|scene| {
        scene.events.poster.push(Poster {
            during_s: DURING_S.into(),
            ids: vec![500, 501],
            size_m,
            world_from_poster: place.clone(),
        });
    });
    let found = detect(difference(&sut));
    let camera = sut.true_camera(CAMERA, WITHIN_S);
    let camera_from_poster = camera.world_from_camera.inv_mul(&place.isometry());
    let mut seen = 0;
    for (id, x) in [(500, -0.75 * size_m), (501, 0.75 * size_m)] {
        let Some(tag) = found.iter().find(|tag| tag.id == id) else { continue };
        let corner = Point3::new(x - size_m / 2.0, -size_m / 2.0, 0.0);
        let expected = camera.project(&(camera_from_poster * corner)).expect("before the camera");
        let off_px = (tag.corners_px[0] - expected).norm();
        assert!(off_px < MOST_OFF_PX, "{id}: {off_px} px");
        seen += 1;
    }
    assert!(seen > 0, "no tag of the poster is seen");
    before_and_after_are_as_ever(&sut);
}

#[test]
fn a_wrong_exposure_scales_the_grey_levels() {
    for brightness in [0.5, 2.0] {
        let exposing = Exposing {
            during_s: DURING_S.into(),
            cameras: vec![CAMERA_ID.into()],
            brightness,
            exposure_s: None,
        };
        let sut = with(|scene| scene.events.exposure.push(exposing));
        let dark = |grey: u8| f64::from(grey) - BASE.scene().sensor.black_level;
        let (changed, plain) = (picture(&sut, WITHIN_S), picture(&BASE, WITHIN_S));
        // Pixels that stay below white when they are doubled.
        let pairs = changed.grey.iter().zip(&plain.grey).filter(|(_, old)| (40..110).contains(*old));
        let (new, old) = pairs.fold((0.0, 0.0), |sum, (new, old)| (sum.0 + dark(*new), sum.1 + dark(*old)));
        assert!((new / old / brightness - 1.0).abs() < 0.02, "{brightness}: {}", new / old);
        before_and_after_are_as_ever(&sut);
    }
}

#[test]
fn a_bumped_camera_sees_the_room_from_its_new_place() {
    const MOST_RMS_PX: f64 = 0.1;
    const LEAST_SHIFT_PX: f64 = 10.0;
    let sut = with(|scene| {
        scene.events.bump.push(Bump {
            during_s: DURING_S.into(),
            camera: CAMERA_ID.into(),
            camera_from_bumped: home([0.02, 0.0, 0.0], [0.0, 0.0, 0.0]),
        });
    });
    let found = detect(picture(&sut, WITHIN_S));
    let (truth, as_before) = (sut.sightings(CAMERA, WITHIN_S), BASE.sightings(CAMERA, WITHIN_S));
    let (mut squares, mut count) = (0.0, 0);
    for seen in truth.iter().filter(|seen| seen.is_readable() && seen.side_px > 30.0) {
        let Some(tag) = found.iter().find(|tag| tag.id == seen.id) else { continue };
        squares += (0..4).map(|k| (tag.corners_px[k] - seen.corners_px[k]).norm_squared()).sum::<f64>();
        count += 8;
        if let Some(old) = as_before.iter().find(|old| old.id == seen.id) {
            assert!((old.corners_px[0] - seen.corners_px[0]).norm() > LEAST_SHIFT_PX);
        }
    }
    let rms_px = (squares / f64::from(count)).sqrt();
    assert!(count > 40 && rms_px < MOST_RMS_PX, "{count} coordinates, {rms_px} px");
    let rig = sut.cameras().next().expect("a camera");
    assert_eq!(rig, BASE.cameras().next().expect("a camera"), "the rig knows nothing of it");
    before_and_after_are_as_ever(&sut);
}

#[test]
fn an_exposure_time_of_an_event_blurs_what_moves() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let fast = Scene::read(&configs.join("scenes/fast.toml")).expect("the committed scene is good");
    let blurred = || {
        let mut scene = fast.clone();
        let (during_s, exposure_s) = (DURING_S.into(), Some(0.008));
        scene.events.exposure.push(Exposing { during_s, cameras: vec![], brightness: 1.0, exposure_s });
        BASE.with_scene(scene).expect("a good scene")
    };
    let sharp = BASE.with_scene(fast.clone()).expect("a good scene");
    // Steps from pixel to pixel within the tags of the palms.
    let edges = |sut: &Studio| -> f64 {
        let Picture { width, grey, .. } = picture(sut, WITHIN_S);
        let palms = readable(sut, WITHIN_S).into_iter().filter(|tag| PALMS.contains(&tag.body));
        let squares = palms.map(|tag| {
            let span = |axis: usize| {
                let places = tag.corners_px.map(|corner| corner[axis] as usize);
                places.iter().copied().min().unwrap_or(0)..places.iter().copied().max().unwrap_or(0)
            };
            let at = |row: usize, column: usize| f64::from(grey[row * width as usize + column]);
            let places = span(1).flat_map(|row| span(0).map(move |column| (row, column)));
            places
                .map(|(y, x)| (at(y, x + 1) - at(y, x)).powi(2) + (at(y + 1, x) - at(y, x)).powi(2))
                .sum::<f64>()
        });
        squares.sum()
    };
    let (sharp, blurred) = (edges(&sharp), edges(&blurred()));
    // What lies along the motion goes soft, what lies across it stays sharp.
    println!("squared steps {blurred} of {sharp}");
    assert!(sharp > 0.0 && blurred < 0.6 * sharp, "{blurred} of {sharp}");
}

#[test]
fn a_scene_that_does_not_fit_the_rig_is_refused_by_name() {
    let refusal = |change: &dyn Fn(&mut Scene)| -> String {
        let mut scene = BASE.scene().clone();
        change(&mut scene);
        BASE.with_scene(scene).expect_err("a bad scene").to_string()
    };
    let phase = |id: &str, phase_s: f64| Phase { id: id.to_owned(), phase_s };
    let unknown = refusal(&|scene| scene.cameras.push(phase("attic", 0.001)));
    assert!(unknown.contains("attic") && unknown.contains(CAMERA_ID), "{unknown}");
    let torn = refusal(&|scene| {
        scene.cameras = vec![phase("left_zed_left", 0.001), phase("left_zed_right", 0.002)];
    });
    assert!(torn.contains("left_zed_right"), "{torn}");
}

#[test]
fn an_event_that_ends_before_it_begins_is_refused() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let good = std::fs::read_to_string(configs.join("scenes/static.toml")).expect("the committed scene");
    let path = std::env::temp_dir().join(format!("locoman-events-{}.toml", std::process::id()));
    let event = "\n[[event.tear]]\nduring_s = [5.0, 4.0]\nid = 1\nlook = \"gone\"\n";
    std::fs::write(&path, good + event).expect("write");
    let said = Scene::read(&path).expect_err("a span that falls").to_string();
    std::fs::remove_file(&path).expect("clean up");
    assert!(said.contains("tear") && said.contains("[5, 4]"), "{said}");
}
