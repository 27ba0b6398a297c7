use super::*;

fn configs() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

#[test]
fn the_reach_of_foot_and_gripper_is_that_of_an_independent_computation() {
    let config = RobotConfig::load(&configs()).unwrap();
    let cloud =
        |effector| Cloud::sample(&config.model, &config.control.poses, effector, &Torso::Fixed, 100_000, 1);
    let extent = |cloud: &Cloud, axis: usize| {
        let along = || cloud.points.iter().map(|p| p[axis]);
        (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max))
    };
    // With other shapes and another program (numpy, the URDF's primitives).
    let foot = cloud(Effector::Foot);
    let gripper = cloud(Effector::Gripper);
    for (cloud, axis, (low, high)) in [
        (&foot, 0, (-0.197, 0.536)),
        (&foot, 2, (-0.392, 0.392)),
        (&gripper, 0, (-0.297, 0.640)),
        (&gripper, 2, (-0.499, 0.496)),
    ] {
        let (least, greatest) = extent(cloud, axis);
        assert!((least - low).abs() < 0.02 && (greatest - high).abs() < 0.02, "{axis}: {least} {greatest}");
    }
    let volume = |cloud: &Cloud| Hull::of(&cloud.points).volume();
    let (foot, gripper) = (volume(&foot), volume(&gripper));
    // A hull of fewer samples is smaller, of the gripper's by a few percent.
    assert!((foot / 0.202 - 1.0).abs() < 0.02, "{foot}");
    assert!((gripper / 0.400 - 1.0).abs() < 0.04, "{gripper}");
}

#[test]
fn the_same_seed_gives_the_same_figures() {
    let config = RobotConfig::load(&configs()).unwrap();
    let cloud = |seed| {
        let torso = Torso::Moving(config.limits.gripper_torso);
        Cloud::sample(&config.model, &config.control.poses, Effector::Gripper, &torso, 2000, seed)
    };
    assert_eq!(cloud(1).points, cloud(1).points);
    assert_ne!(cloud(1).points, cloud(2).points);
}

#[test]
fn the_upright_torso_is_above_the_hind_feet() {
    let config = RobotConfig::load(&configs()).unwrap();
    let pose = definition::upright(&config.model, &config.control.poses);
    // Nose up.
    assert!((pose.rotation * nalgebra::Vector3::x()).z > 0.999);
    assert!(pose.translation.z > 0.0 && pose.translation.z < 0.3, "{pose}");
}
