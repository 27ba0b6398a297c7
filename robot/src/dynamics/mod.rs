//! Kinematics and dynamics of the floating-base robot.
//!
//! Everything that depends on the state is computed at once by [`Dynamics::update`], into memory that is
//! taken once. The velocity is v = (linear velocity of the torso's origin, angular velocity of the torso,
//! both in the torso's frame; 18 joint velocities), and an acceleration is dv/dt in the same sense.
//!
//! Two passes over the tree, everything along the torso's axes (see [`rigid`]): outwards for poses,
//! velocities and bias accelerations, inwards for composite inertias and forces. The tree is a block arrow:
//! limbs meet only in the torso, so the mass matrix has no entries between limbs.

mod rigid;
mod state;

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, Vector6};
use rigid::{Inertia, Spatial, Wrench};
pub use state::State;

use crate::{
    joints::JOINTS,
    kinematics::Bodies,
    model::{Frame, GRAVITY, Model, PARENT},
};

/// Velocity degrees of freedom: six of the torso, then the joints.
pub const DOF: usize = 6 + JOINTS;
/// One number for each degree of freedom.
pub type Motion = SVector<f64, DOF>;
/// Inertia of the whole robot in joint space.
pub type MassMatrix = SMatrix<f64, DOF, DOF>;
/// Linear, then angular velocity of a frame's origin along the world's axes, from v.
pub type Jacobian = SMatrix<f64, 6, DOF>;

/// Where a frame is and how it moves with v.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameMotion {
    /// Pose in the world.
    pub world_from_frame: Isometry3<f64>,
    /// J: linear (3) then angular (3) rows, along the world's axes at the frame's origin.
    pub jacobian: Jacobian,
    /// J v.
    pub velocity: Vector6<f64>,
    /// J̇ v: acceleration of the frame's origin, and angular acceleration, when dv/dt = 0.
    pub bias_acceleration: Vector6<f64>,
}

/// Everything that the controller needs to know of a model in a state.
#[derive(Debug, Clone)]
pub struct Dynamics {
    frames: [FrameMotion; Frame::COUNT],
    mass_matrix: MassMatrix,
    bias: Motion,
    gravity: Motion,
    com: Vector3<f64>,
    links: [Link; JOINTS],
}

/// A joint's body in the torso's frame.
#[derive(Debug, Clone, Copy)]
struct Link {
    torso_from_body: Matrix3<f64>,
    origin: Vector3<f64>,
    /// S: motion at unit joint speed.
    motion: Spatial,
    velocity: Spatial,
    /// Acceleration when dv/dt = 0, without gravity.
    bias_acceleration: Spatial,
    /// Of the body, then of everything that it carries.
    inertia: Inertia,
    /// On the body, then on everything that it carries, when dv/dt = 0, without gravity.
    bias_force: Wrench,
}

impl Default for Dynamics {
    fn default() -> Self {
        Self::new()
    }
}

impl Dynamics {
    /// An empty workspace: call [`Self::update`] before reading anything.
    pub fn new() -> Self {
        let frame = FrameMotion {
            world_from_frame: Isometry3::identity(),
            jacobian: Jacobian::zeros(),
            velocity: Vector6::zeros(),
            bias_acceleration: Vector6::zeros(),
        };
        let link = Link {
            torso_from_body: Matrix3::identity(),
            origin: Vector3::zeros(),
            motion: Spatial::ZERO,
            velocity: Spatial::ZERO,
            bias_acceleration: Spatial::ZERO,
            inertia: Inertia::ZERO,
            bias_force: Wrench::ZERO,
        };
        Self {
            frames: std::array::from_fn(|_| frame.clone()),
            mass_matrix: MassMatrix::zeros(),
            bias: Motion::zeros(),
            gravity: Motion::zeros(),
            com: Vector3::zeros(),
            links: [link; JOINTS],
        }
    }

    /// Computes everything for a state. Allocates nothing.
    pub fn update(&mut self, model: &Model, state: &State) {
        let world_from_torso = state.world_from_torso.rotation.to_rotation_matrix().into_inner();
        let torso = Torso {
            velocity: Spatial {
                linear: state.torso_twist.fixed_rows::<3>(0).into_owned(),
                angular: state.torso_twist.fixed_rows::<3>(3).into_owned(),
            },
            upwards: world_from_torso.transpose() * Vector3::new(0.0, 0.0, GRAVITY),
        };
        self.outwards(model, state, &torso);
        self.inwards(model, &torso, state);
        for frame in Frame::ALL {
            self.update_frame(model, state, frame, &world_from_torso);
        }
        self.frames[Frame::Torso.index()].world_from_frame = state.world_from_torso;
    }

    /// Poses, velocities and bias accelerations of the bodies, from the torso to the tips.
    fn outwards(&mut self, model: &Model, state: &State, torso: &Torso) {
        for index in 0..JOINTS {
            let joint = &model.joints[index];
            let (parent_rotation, parent_origin, parent_velocity, parent_bias) = match PARENT[index] {
                Some(parent) => {
                    let parent = &self.links[parent];
                    (parent.torso_from_body, parent.origin, parent.velocity, parent.bias_acceleration)
                }
                None => (Matrix3::identity(), Vector3::zeros(), torso.velocity, Spatial::ZERO),
            };
            let placement = &joint.parent_from_joint;
            let torso_from_joint = parent_rotation * placement.rotation.to_rotation_matrix().matrix();
            let origin = parent_rotation * placement.translation.vector + parent_origin;
            let motion = Spatial::about(torso_from_joint * joint.axis.into_inner(), &origin);
            let speed = state.velocity[index];
            let velocity = parent_velocity.plus(&motion, speed);
            // d(S q̇)/dt = v × S q̇ for a joint axis that is fixed to a body moving with v.
            let bias_acceleration = parent_bias.plus(&velocity.cross(&motion), speed);

            let link = &mut self.links[index];
            link.torso_from_body = torso_from_joint * turn(&joint.axis, state.position[index]);
            link.origin = origin;
            link.motion = motion;
            link.velocity = velocity;
            link.bias_acceleration = bias_acceleration;
            link.inertia = Inertia::of(&joint.body, &link.torso_from_body, &origin);
            link.bias_force = link.inertia.bias_force(&velocity, &bias_acceleration);
        }
    }

    /// Composite inertias and forces, from the tips to the torso: mass matrix by the composite-rigid-body
    /// algorithm, bias forces by recursive Newton-Euler (Featherstone 2008, tables 6.2 and 5.1).
    fn inwards(&mut self, model: &Model, torso: &Torso, state: &State) {
        let mut whole = Inertia::of(&model.torso, &Matrix3::identity(), &Vector3::zeros());
        let mut whole_force = whole.bias_force(&torso.velocity, &Spatial::ZERO);
        // Standing in gravity is the same as being accelerated upwards.
        let lift = Spatial { linear: torso.upwards, angular: Vector3::zeros() };
        for index in (0..JOINTS).rev() {
            let link = self.links[index];
            match PARENT[index] {
                Some(parent) => {
                    self.links[parent].inertia.add(&link.inertia);
                    self.links[parent].bias_force.add(&link.bias_force);
                }
                None => {
                    whole.add(&link.inertia);
                    whole_force.add(&link.bias_force);
                }
            }
            self.gravity[6 + index] = link.motion.dot(&link.inertia.times(&lift));
            self.bias[6 + index] = link.motion.dot(&link.bias_force) + self.gravity[6 + index];
            self.fill_mass_matrix(index, model.armature[index]);
        }
        let weight = whole.times(&lift);
        write(&mut self.gravity, &weight.force, &weight.moment);
        write(&mut self.bias, &(whole_force.force + weight.force), &(whole_force.moment + weight.moment));
        self.fill_torso_block(&whole);
        self.com = state.world_from_torso * nalgebra::Point3::from(whole.moment / whole.mass)
            - nalgebra::Point3::origin();
    }

    /// Row and column of a joint: A_ij = S_j · I_i S_i for j between the joint and the torso.
    fn fill_mass_matrix(&mut self, index: usize, armature: f64) {
        let column = 6 + index;
        let wrench = self.links[index].inertia.times(&self.links[index].motion);
        self.mass_matrix[(column, column)] = self.links[index].motion.dot(&wrench) + armature;
        let mut ancestor = PARENT[index];
        while let Some(above) = ancestor {
            let entry = self.links[above].motion.dot(&wrench);
            self.mass_matrix[(6 + above, column)] = entry;
            self.mass_matrix[(column, 6 + above)] = entry;
            ancestor = PARENT[above];
        }
        for axis in 0..3 {
            self.mass_matrix[(axis, column)] = wrench.force[axis];
            self.mass_matrix[(column, axis)] = wrench.force[axis];
            self.mass_matrix[(3 + axis, column)] = wrench.moment[axis];
            self.mass_matrix[(column, 3 + axis)] = wrench.moment[axis];
        }
    }

    /// The 6x6 block of the torso: [m 1, -m c×; m c×, I].
    fn fill_torso_block(&mut self, whole: &Inertia) {
        let moment = whole.moment.cross_matrix();
        let mut block = self.mass_matrix.fixed_view_mut::<6, 6>(0, 0);
        block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * whole.mass));
        block.fixed_view_mut::<3, 3>(0, 3).copy_from(&-moment);
        block.fixed_view_mut::<3, 3>(3, 0).copy_from(&moment);
        let rotational = (whole.rotational + whole.rotational.transpose()) * 0.5;
        block.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotational);
    }

    /// Pose, Jacobian, velocity and bias acceleration of a frame; its joint columns are those between it and
    /// the torso.
    fn update_frame(&mut self, model: &Model, state: &State, frame: Frame, world_from_torso: &Matrix3<f64>) {
        let torso_velocity = Spatial {
            linear: state.torso_twist.fixed_rows::<3>(0).into_owned(),
            angular: state.torso_twist.fixed_rows::<3>(3).into_owned(),
        };
        let target = &mut self.frames[frame.index()];
        let (point, velocity, bias) = match frame.joint() {
            None => (Vector3::zeros(), torso_velocity, Spatial::ZERO),
            Some(joint) => {
                let link = &self.links[joint];
                let body_from_frame = frame.body_from_frame(model);
                let point = link.torso_from_body * body_from_frame.translation.vector + link.origin;
                let rotation = nalgebra::Rotation3::from_matrix_unchecked(link.torso_from_body);
                let torso_from_frame = Isometry3::from_parts(
                    Translation3::from(point),
                    UnitQuaternion::from_rotation_matrix(&rotation) * body_from_frame.rotation,
                );
                target.world_from_frame = state.world_from_torso * torso_from_frame;
                (point, link.velocity, link.bias_acceleration)
            }
        };

        let mut column = |index: usize, motion: &Spatial| {
            write_column(&mut target.jacobian, index, world_from_torso, &motion.at(&point), &motion.angular);
        };
        for axis in 0..3 {
            let unit = Vector3::ith(axis, 1.0);
            column(axis, &Spatial { linear: unit, angular: Vector3::zeros() });
            column(3 + axis, &Spatial { linear: Vector3::zeros(), angular: unit });
        }
        let mut above = frame.joint();
        while let Some(joint) = above {
            column(6 + joint, &self.links[joint].motion);
            above = PARENT[joint];
        }

        let speed = velocity.at(&point);
        stack(&mut target.velocity, world_from_torso, &speed, &velocity.angular);
        let acceleration = bias.of_point(&point, &velocity);
        stack(&mut target.bias_acceleration, world_from_torso, &acceleration, &bias.angular);
    }

    /// A frame's pose, Jacobian and bias acceleration.
    pub fn frame(&self, frame: Frame) -> &FrameMotion {
        &self.frames[frame.index()]
    }

    /// Acceleration of a point of a joint's body when dv/dt = 0; the point and it along the torso's axes, m/s².
    pub fn bias_acceleration_at(&self, joint: usize, point: &Vector3<f64>) -> Vector3<f64> {
        let link = &self.links[joint];
        link.bias_acceleration.of_point(point, &link.velocity)
    }

    /// A(q), with the rotors' reflected inertia on its diagonal.
    pub fn mass_matrix(&self) -> &MassMatrix {
        &self.mass_matrix
    }

    /// b(q, v) + g(q): Coriolis, centrifugal and gravity forces.
    pub fn bias(&self) -> &Motion {
        &self.bias
    }

    /// g(q): the forces that hold the robot at rest against gravity.
    pub fn gravity(&self) -> &Motion {
        &self.gravity
    }

    /// Centre of mass in the world, m.
    pub fn com(&self) -> &Vector3<f64> {
        &self.com
    }

    /// A a + b + g: the forces on torso and joints that make the acceleration `a`.
    pub fn inverse_dynamics(&self, acceleration: &Motion) -> Motion {
        self.mass_matrix * acceleration + self.bias
    }
}

impl Bodies for Dynamics {
    fn pose(&self, joint: usize) -> (&Matrix3<f64>, &Vector3<f64>) {
        (&self.links[joint].torso_from_body, &self.links[joint].origin)
    }

    fn axis(&self, joint: usize) -> &Vector3<f64> {
        &self.links[joint].motion.angular
    }
}

/// What the passes need to know of the torso, in its own frame.
struct Torso {
    velocity: Spatial,
    /// The acceleration that feels like gravity, m/s².
    upwards: Vector3<f64>,
}

impl Inertia {
    /// I a + v ×* I v: the force that moves a body so.
    fn bias_force(&self, velocity: &Spatial, acceleration: &Spatial) -> Wrench {
        let mut force = self.times(acceleration);
        force.add(&velocity.cross_force(&self.times(velocity)));
        force
    }
}

/// Rotation about a unit axis by an angle (Rodrigues).
fn turn(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let (sin, cos) = angle.sin_cos();
    axis.cross_matrix() * sin + axis * axis.transpose() * (1.0 - cos) + Matrix3::identity() * cos
}

fn write(motion: &mut Motion, linear: &Vector3<f64>, angular: &Vector3<f64>) {
    motion.fixed_rows_mut::<3>(0).copy_from(linear);
    motion.fixed_rows_mut::<3>(3).copy_from(angular);
}

fn write_column(
    jacobian: &mut Jacobian,
    column: usize,
    world_from_torso: &Matrix3<f64>,
    linear: &Vector3<f64>,
    angular: &Vector3<f64>,
) {
    jacobian.fixed_view_mut::<3, 1>(0, column).copy_from(&(world_from_torso * linear));
    jacobian.fixed_view_mut::<3, 1>(3, column).copy_from(&(world_from_torso * angular));
}

fn stack(
    target: &mut Vector6<f64>,
    world_from_torso: &Matrix3<f64>,
    linear: &Vector3<f64>,
    angular: &Vector3<f64>,
) {
    target.fixed_rows_mut::<3>(0).copy_from(&(world_from_torso * linear));
    target.fixed_rows_mut::<3>(3).copy_from(&(world_from_torso * angular));
}
