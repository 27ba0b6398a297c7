//! The files in `configs/robot` against what they stand for.

#![expect(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::{Path, PathBuf};

use locoman_robot::{
    model::{GRAVITY, Model, ModelError},
    wbc::{SettingsError, WbcSettings},
};

fn configs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/robot")
}

/// A copy of the URDF with a piece of its text replaced.
fn changed(name: &str, from: &str, to: &str) -> PathBuf {
    let text = std::fs::read_to_string(configs().join("locoman.urdf")).unwrap();
    assert!(text.contains(from), "{from} is not in the file");
    let path = std::env::temp_dir().join(format!("locoman-{}-{name}.urdf", std::process::id()));
    std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    path
}

#[track_caller]
fn refused(name: &str, from: &str, to: &str, expected: &str) {
    let path = changed(name, from, to);
    let error = Model::from_urdf(&path).unwrap_err().to_string();
    std::fs::remove_file(path).unwrap();
    assert!(error.contains(expected), "{error}");
}

#[test]
fn the_documented_settings_are_the_compiled_ones() {
    assert_eq!(WbcSettings::load(&configs().join("wbc.toml")).unwrap(), WbcSettings::default());
}

#[test]
fn an_unknown_key_is_refused_with_its_line() {
    let text = std::fs::read_to_string(configs().join("wbc.toml")).unwrap();
    let path = std::env::temp_dir().join(format!("locoman-{}-wbc.toml", std::process::id()));
    std::fs::write(&path, text.replace("friction =", "frction =")).unwrap();
    let error = WbcSettings::load(&path).unwrap_err();
    std::fs::remove_file(path).unwrap();
    assert!(matches!(error, SettingsError::Parse { .. }));
    assert!(error.to_string().contains("frction"), "{error}");
}

#[test]
fn a_setting_that_makes_no_sense_is_refused_by_its_key() {
    let text = std::fs::read_to_string(configs().join("wbc.toml")).unwrap();
    let path = std::env::temp_dir().join(format!("locoman-{}-friction.toml", std::process::id()));
    for (from, to, key) in [
        ("friction = 0.6", "friction = -0.6", "contact.friction"),
        ("max_vertical = 1.5", "max_vertical = 0.0", "contact.max_vertical"),
        ("max_error = 0.05", "max_error = 0.0", "objectives.torso_position"),
    ] {
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = WbcSettings::load(&path).unwrap_err().to_string();
        assert!(error.contains(key), "{error}");
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn our_model_differs_from_the_published_one_only_in_the_stated_corrections() {
    let ours = Model::load(&configs()).unwrap();
    let published = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/model.urdf");
    let theirs = Model::from_urdf(&published).unwrap();

    // Rounded to nine digits in our file.
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-8 * a.abs().max(b.abs()).max(1e-3);
    for joint in 0..18 {
        let (a, b) = (&ours.joints[joint], &theirs.joints[joint]);
        assert_eq!((a.axis, a.parent_from_joint), (b.axis, b.parent_from_joint));
        assert_eq!((ours.lower[joint], ours.upper[joint]), (theirs.lower[joint], theirs.upper[joint]));
        let is_arm = joint >= 12;
        // A calf also carries the arm's mount.
        let is_front_calf = joint == 2 || joint == 5;
        if !is_arm {
            assert_eq!(ours.max_torque[joint], theirs.max_torque[joint]);
            assert_eq!(ours.max_velocity[joint], theirs.max_velocity[joint]);
        }
        if is_arm {
            let ratio = a.body.mass / b.body.mass;
            assert!((a.body.inertia - b.body.inertia * ratio).amax() <= 1e-8 * a.body.inertia.amax());
            assert!((a.body.com - b.body.com).amax() < 1e-9);
        } else if !is_front_calf {
            assert!(same(a.body.mass, b.body.mass));
            assert!((a.body.com - b.body.com).amax() < 1e-9);
            assert!((a.body.inertia - b.body.inertia).amax() < 1e-10);
        }
    }
    assert!((ours.torso.mass - theirs.torso.mass).abs() < 1e-9);
    // 147 g an arm in place of 89.25 and 89.23 g.
    let corrected = 2.0 * 0.147 - (0.089_251_97 + 0.089_228_41);
    assert!((ours.mass() - theirs.mass() - corrected).abs() < 1e-6);
    assert!(ours.armature.min() > 0.0 && theirs.armature.max() == 0.0);
}

#[test]
fn the_model_weighs_what_its_links_weigh() {
    let ours = Model::load(&configs()).unwrap();
    assert!((ours.mass() - 13.393_448).abs() < 1e-6, "{} kg, {} N", ours.mass(), ours.mass() * GRAVITY);
}

#[test]
fn a_missing_file_is_named_with_a_remedy() {
    let error = Model::load(Path::new("/nowhere")).unwrap_err();
    assert!(matches!(error, ModelError::Read { .. }));
    let text = error.to_string();
    assert!(text.contains("/nowhere/locoman.urdf") && text.contains("--configs"), "{text}");
}

#[test]
fn a_file_that_is_no_urdf_is_refused() {
    let path = changed("broken", "</robot>", "");
    let error = Model::from_urdf(&path).unwrap_err();
    std::fs::remove_file(path).unwrap();
    assert!(matches!(error, ModelError::Urdf { .. }), "{error}");
}

#[test]
fn a_missing_joint_is_named() {
    refused(
        "missing",
        "\"3_RR_calf_joint\" type=\"revolute\"",
        "\"3_RR_knee\" type=\"fixed\"",
        "3_RR_calf_joint",
    );
}

#[test]
fn a_negative_mass_is_refused_with_its_link() {
    refused(
        "negative",
        "<mass value=\"5.204\"/>",
        "<mass value=\"-5.204\"/>",
        "`trunk`: has a negative mass",
    );
}

#[test]
fn an_inertia_that_is_none_is_refused_with_its_link() {
    refused("inertia", "izz=\"0.0716547275\"", "izz=\"0.9\"", "`trunk`: has a principal moment");
}

#[test]
fn an_inertia_that_is_not_positive_definite_is_refused_with_its_link() {
    let expected = "`trunk`: has a principal moment of inertia that is not positive";
    refused("flat", "iyy=\"0.063009565\"", "iyy=\"-0.063009565\"", expected);
    refused("oblique", "iyz=\"-4.18731e-05\"", "iyz=\"0.08\"", expected);
}

#[test]
fn numbers_that_are_none_are_refused_with_their_joint() {
    let (from, to) = ("xyz=\"0.1881 -0.04675 0\"", "xyz=\"NaN -0.04675 0\"");
    refused("nan", from, to, "`1_FR_hip_joint`: has a number that is not finite");
}

#[test]
fn an_element_that_is_there_twice_is_refused() {
    refused("twice", "\"3_RR_calf_joint\"", "\"3_RR_thigh_joint\"", "`3_RR_thigh_joint`: is there twice");
    refused("link", "<link name=\"3_RR_hip\">", "<link name=\"3_RR_calf\">", "`3_RR_calf`: is there twice");
}

#[test]
fn a_link_that_hangs_nowhere_is_refused() {
    refused("nowhere", "<child link=\"3_RR_calf\"/>", "<child link=\"3_RR_calve\"/>", "3_RR_calf");
}

#[test]
fn a_joint_without_a_range_is_refused() {
    let (from, to) = ("lower=\"-0.863\" upper=\"0.863\"", "lower=\"0.863\" upper=\"-0.863\"");
    refused("range", from, to, "1_FR_hip_joint");
}

#[test]
fn an_additional_moving_joint_is_refused() {
    let (from, to) = ("\"1_FR_foot_fixed\" type=\"fixed\"", "\"1_FR_foot_fixed\" type=\"revolute\"");
    refused("additional", from, to, "1_FR_foot_fixed");
}
