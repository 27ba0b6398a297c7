//! From shells in the room to displacements of the robot's bodies: pure, no clock, no I/O.
//!
//! At engagement the mapper remembers where each body is and which way the operator faces. From then on,
//! with `h` the heading frame (z up, x along the torso shell's x axis at engagement, or along the rig's
//! world if the torso is not seen), `p0`, `R0` the body's pose at engagement and `s` the scales,
//!
//! ```text
//! translation = s_t * R_h^T (p - p0)
//! rotation    = exp(s_r * log(R_h^T R R0^T R_h))
//! ```
//!
//! so that an engagement starts at the identity whatever the poses and scales are. A body that is not seen
//! is absent. One that returns near where it was last seen goes on; one that returns further away than it
//! can have moved ends the engagement in place of moving the robot.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::config::{Config, Opening, Scale, Tracking};
use crate::motion::{Body, Motion};
use crate::observe::{Observation, Shell};

/// A body was seen too far from where it had been.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Which one.
    pub body: Body,
    /// How far.
    pub distance_m: f64,
    /// How much it turned.
    pub angle_rad: f64,
}

impl std::fmt::Display for Jump {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (body, mm, deg) = (self.body.name(), self.distance_m * 1e3, self.angle_rad.to_degrees());
        write!(f, "{body} jumped by {mm:.0} mm and {deg:.0} deg")
    }
}

/// Where a body was at engagement, and where it was last seen.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    origin: Isometry3<f64>,
    last: Isometry3<f64>,
    last_ns: u64,
}

impl Anchor {
    fn new(pose: &Isometry3<f64>, now_ns: u64) -> Self {
        Self { origin: *pose, last: *pose, last_ns: now_ns }
    }

    /// The jump, if the body cannot have come this far since it was last seen.
    fn jump(&self, body: Body, now: &Isometry3<f64>, now_ns: u64, limits: &Tracking) -> Option<Jump> {
        let gap_ns = now_ns.saturating_sub(self.last_ns).min(limits.jump_gap_ms * 1_000_000);
        let gap_s = gap_ns as f64 * 1e-9;
        let distance_m = (now.translation.vector - self.last.translation.vector).norm();
        let angle_rad = self.last.rotation.angle_to(&now.rotation);
        let too_far = distance_m > limits.jump_m + limits.speed_m_s * gap_s;
        let too_much = angle_rad > limits.jump_rad + limits.speed_rad_s * gap_s;
        (too_far || too_much).then_some(Jump { body, distance_m, angle_rad })
    }
}

/// Maps an operator's motion since engagement.
#[derive(Debug)]
pub struct Mapper {
    scale: Scale,
    opening: Opening,
    tracking: Tracking,
    heading_from_world: UnitQuaternion<f64>,
    anchors: [Option<Anchor>; 3],
    openings: [f64; 2],
    capture_ns: u64,
}

impl Mapper {
    /// Starts an engagement: `observation` becomes the zero of every displacement, and the openings move
    /// from where the robot's grippers are (right, left).
    pub fn engage(config: &Config, observation: &Observation, openings: [f64; 2]) -> Self {
        Self {
            scale: config.scale,
            opening: config.opening,
            tracking: config.tracking,
            heading_from_world: heading(observation.shell(Shell::Torso)).inverse(),
            anchors: Body::ALL.map(|body| {
                let capture_ns = observation.capture_ns;
                observation.shell(shell_of(body)).map(|pose| Anchor::new(pose, capture_ns))
            }),
            openings: openings.map(|opening| if opening.is_finite() { opening.clamp(0.0, 1.0) } else { 0.0 }),
            capture_ns: observation.capture_ns,
        }
    }

    /// The displacements at one instant, or the jump that ends the engagement.
    ///
    /// A body that was not seen at engagement is anchored at its first sighting: the robot has held its own
    /// until now.
    pub fn map(&mut self, observation: &Observation) -> Result<Motion, Jump> {
        let mut motion = Motion::default();
        for body in Body::ALL {
            let Some(&world_from_body) = observation.shell(shell_of(body)) else { continue };
            let index = body as usize;
            let anchor = self.anchors[index]
                .get_or_insert_with(|| Anchor::new(&world_from_body, observation.capture_ns));
            if let Some(jump) = anchor.jump(body, &world_from_body, observation.capture_ns, &self.tracking) {
                return Err(jump);
            }
            (anchor.last, anchor.last_ns) = (world_from_body, observation.capture_ns);
            let (translation, rotation) = match body {
                Body::Torso => (self.scale.torso_translation, self.scale.torso_rotation),
                Body::RightPalm | Body::LeftPalm => (self.scale.hand_translation, self.scale.hand_rotation),
            };
            let origin = anchor.origin;
            motion.bodies[index] = Some(displacement(
                &self.heading_from_world,
                &origin,
                &world_from_body,
                translation,
                rotation,
            ));
        }
        let dt_s = observation.capture_ns.saturating_sub(self.capture_ns) as f64 * 1e-9;
        self.capture_ns = observation.capture_ns.max(self.capture_ns);
        let hands = [(Shell::RightPalm, Shell::RightThumb), (Shell::LeftPalm, Shell::LeftThumb)];
        for (side, (palm, thumb)) in hands.into_iter().enumerate() {
            if let (Some(palm), Some(thumb)) = (observation.shell(palm), observation.shell(thumb)) {
                let step = self.opening.max_rate_per_s * dt_s;
                let wanted = opening(palm, thumb, &self.opening);
                self.openings[side] += (wanted - self.openings[side]).clamp(-step, step);
                motion.openings[side] = Some(self.openings[side]);
            }
        }
        Ok(motion)
    }
}

const fn shell_of(body: Body) -> Shell {
    match body {
        Body::Torso => Shell::Torso,
        Body::RightPalm => Shell::RightPalm,
        Body::LeftPalm => Shell::LeftPalm,
    }
}

/// `world_from_heading`: the yaw of the torso's x axis; the identity without a torso, or when its x axis
/// stands upright and has no yaw.
fn heading(world_from_torso: Option<&Isometry3<f64>>) -> UnitQuaternion<f64> {
    /// Length of the horizontal part of a unit axis: below this its direction is noise.
    const MIN_HORIZONTAL: f64 = 0.1;
    let Some(forward) = world_from_torso.map(|pose| pose.rotation * Vector3::x()) else {
        return UnitQuaternion::identity();
    };
    if forward.xy().norm() < MIN_HORIZONTAL {
        return UnitQuaternion::identity();
    }
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x))
}

/// The equations at the head of this file.
fn displacement(
    heading_from_world: &UnitQuaternion<f64>,
    origin: &Isometry3<f64>,
    now: &Isometry3<f64>,
    translation_scale: f64,
    rotation_scale: f64,
) -> Isometry3<f64> {
    let moved = now.translation.vector - origin.translation.vector;
    let turned = (now.rotation * origin.rotation.inverse()).scaled_axis();
    Isometry3::from_parts(
        Translation3::from(heading_from_world * (moved * translation_scale)),
        UnitQuaternion::from_scaled_axis(heading_from_world * (turned * rotation_scale)),
    )
}

/// Gripper opening from the angle of the rotation between palm and thumb: 0 closed, 1 open.
fn opening(world_from_palm: &Isometry3<f64>, world_from_thumb: &Isometry3<f64>, angles: &Opening) -> f64 {
    let angle = Rotation3::from(world_from_palm.rotation).angle_to(&world_from_thumb.rotation.into());
    ((angle - angles.closed_rad) / (angles.open_rad - angles.closed_rad)).clamp(0.0, 1.0)
}

#[cfg(test)]
#[path = "map_tests.rs"]
mod tests;
