//! Where the shells are to be expected, from the station to its nodes.

use locoman_protocol::geometry;
use locoman_protocol::messages;
use locoman_vision::shells::{Shell, ShellSet};
use locoman_vision::track::{Hinge, Matrix18, Motion, Motions};
use nalgebra::{Matrix6, Vector3};

use super::{lower_triangle, symmetric};

/// Where the shells are, how they move, and how thumbs hang on their palms.
pub fn motions_message(motions: &Motions, shells: &ShellSet) -> messages::Motions {
    let vector = |v: &Vector3<f64>| Some(messages::Vector3 { x: v.x, y: v.y, z: v.z });
    let shell = |(shell, motion): (&Shell, &Option<Motion>)| {
        let motion = motion.as_ref()?;
        Some(messages::ShellMotion {
            shell: shell.name.clone(),
            time_ns: motion.time_ns,
            pose: Some(geometry::pose(&motion.world_from_shell)),
            velocity_m_s: vector(&motion.velocity_m_s),
            rate_rad_s: vector(&motion.rate_rad_s),
            acceleration_m_s2: vector(&motion.acceleration_m_s2),
            angular_rad_s2: vector(&motion.angular_rad_s2),
            acceleration_variance: motion.variance.to_vec(),
            covariance: lower_triangle(&motion.covariance),
        })
    };
    let hinge = |(shell, hinge): (&Shell, &Option<(usize, Hinge)>)| {
        let (_, hinge) = hinge.as_ref()?;
        Some(messages::Hinge {
            thumb: shell.name.clone(),
            pose: Some(geometry::pose(&hinge.palm_from_thumb)),
            covariance: lower_triangle(&hinge.covariance),
            seen: hinge.seen,
        })
    };
    messages::Motions {
        shells: shells.shells.iter().zip(motions.latest()).filter_map(shell).collect(),
        hinges: shells.shells.iter().zip(motions.hinges()).filter_map(hinge).collect(),
        horizon_ns: motions.horizon_ns(),
        ..messages::Motions::default()
    }
}

/// What the station said; a shell of which it says nothing usable is lost.
pub fn motions(message: &messages::Motions, shells: &ShellSet) -> Motions {
    let motion = |shell: &Shell| restored(message.shells.iter().find(|sent| sent.shell == shell.name)?);
    let hinge = |(index, shell): (usize, &Shell)| {
        let palm = shells.palm_of(index)?;
        Some((palm, restored_hinge(message.hinges.iter().find(|sent| sent.thumb == shell.name)?)?))
    };
    Motions::new(
        shells.shells.iter().map(motion).collect(),
        shells.shells.iter().enumerate().map(hinge).collect(),
        message.horizon_ns,
    )
}

fn restored_hinge(message: &messages::Hinge) -> Option<Hinge> {
    let covariance: Matrix6<f64> = symmetric(&message.covariance)?;
    let palm_from_thumb = geometry::isometry(message.pose.as_ref()?).ok()?;
    let finite = covariance.iter().all(|number| number.is_finite());
    finite.then_some(Hinge { palm_from_thumb, covariance, seen: message.seen })
}

fn restored(message: &messages::ShellMotion) -> Option<Motion> {
    let vector = |v: Option<&messages::Vector3>| {
        let v = Vector3::new(v?.x, v?.y, v?.z);
        v.iter().all(|number| number.is_finite()).then_some(v)
    };
    let covariance: Matrix18 = symmetric(&message.covariance)?;
    let variance: [f64; 2] = message.acceleration_variance.as_slice().try_into().ok()?;
    let finite = covariance.iter().chain(&variance).all(|number| number.is_finite());
    let motion = Motion {
        time_ns: message.time_ns,
        world_from_shell: geometry::isometry(message.pose.as_ref()?).ok()?,
        velocity_m_s: vector(message.velocity_m_s.as_ref())?,
        rate_rad_s: vector(message.rate_rad_s.as_ref())?,
        acceleration_m_s2: vector(message.acceleration_m_s2.as_ref())?,
        angular_rad_s2: vector(message.angular_rad_s2.as_ref())?,
        variance,
        covariance,
    };
    finite.then_some(motion)
}

#[cfg(test)]
mod tests {
    use super::*;
    use locoman_vision::pose::State;
    use locoman_vision::track::FilterSettings;
    use nalgebra::Isometry3;
    use std::path::Path;

    #[test]
    fn motions_survive_the_way_and_what_is_damaged_is_lost() {
        let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
        let shells = ShellSet::load(&configs.join("shells/standard.toml")).unwrap();
        let settings = FilterSettings::default();
        let state = State {
            world_from_shell: Isometry3::translation(0.1, 0.2, 1.3),
            velocity_m_s: Vector3::new(0.1, 0.2, 0.3),
            rate_rad_s: Vector3::new(1.0, 0.5, 0.0),
            ..State::still(Isometry3::identity())
        };
        let motion = Motion::begin(5, &state, &(Matrix18::identity() * 1e-6)).predicted(9_000_000, &settings);
        let hinge = Hinge {
            palm_from_thumb: Isometry3::translation(0.03, 0.02, 0.0),
            covariance: Matrix6::identity() * 1e-4,
            seen: 40,
        };
        let hinges = (0..5).map(|shell| Some((shells.palm_of(shell)?, hinge.clone()))).collect();
        let sent = Motions::new(vec![Some(motion), None, None, None, None], hinges, 250);
        assert_eq!(sent.hinges().iter().flatten().count(), 2);
        let mut message = motions_message(&sent, &shells);
        assert_eq!(motions(&message, &shells), sent);
        message.shells[0].covariance[7] = f64::INFINITY;
        assert!(motions(&message, &shells).nothing_known_at(9_000_000));
    }
}
