//! What a reaching limb must not touch: the rest of the robot, itself, the ground.

use nalgebra::Vector6;

use crate::{
    collision::{Clearances, Ground},
    commander::ReachRange,
    joints::{JointVector, Side},
    kinematics::body_poses,
    model::Model,
    polyhedron::Polyhedron,
};

/// What is nearer than this beyond its clearance is looked at, m.
pub(super) const INFLUENCE_M: f64 = 0.03;
/// The most that are looked at: with the six joints' ends as many as the polyhedron takes.
const MOST: usize = Polyhedron::MOST - 12;

/// How a distance, of two links or of one from the ground, depends on the six joints.
#[derive(Debug, Clone, Copy)]
struct Wall {
    /// What is left of it, m.
    room: f64,
    /// m/rad
    slope: Vector6<f64>,
}

/// The walls about one limb.
#[derive(Debug, Clone)]
pub(super) struct Walls {
    side: Side,
    range: ReachRange,
    clearances: Clearances,
    walls: [Wall; MOST],
    count: usize,
}

impl Walls {
    /// Nothing known.
    pub(super) fn new(side: Side, range: ReachRange) -> Self {
        let wall = Wall { room: 0.0, slope: Vector6::zeros() };
        Self { side, range, clearances: Clearances::new(), walls: [wall; MOST], count: 0 }
    }

    /// Finds what the limb is near with these joint angles.
    pub(super) fn find(&mut self, model: &Model, joints: &JointVector, ground: &Ground) {
        let bodies = body_poses(model, joints);
        let pairs = model.collision.pairs_of(self.side);
        let limb = self.side.limb_joints();
        let clearance_m = self.range.clearance_m;
        self.clearances.update(&model.collision, pairs, &bodies, clearance_m + INFLUENCE_M);
        let from_links = self.clearances.near().iter().map(|near| {
            let gradient = near.gradient(&bodies);
            let slope = Vector6::from_fn(|column, _| gradient[limb[column]]);
            Wall { room: near.distance - clearance_m, slope }
        });
        let ends = ground.altitudes(self.side.leg(), &model.collision, &bodies);
        let from_ground = ends.filter_map(|end| {
            let room = end.height - self.range.ground_m;
            let gradient = end.gradient(ground, &bodies);
            let slope = Vector6::from_fn(|column, _| gradient[limb[column]]);
            (room < INFLUENCE_M).then_some(Wall { room, slope })
        });
        self.count = 0;
        for (place, wall) in self.walls.iter_mut().zip(from_ground.chain(from_links)) {
            *place = wall;
            self.count += 1;
        }
    }

    /// What is left of the least distance, m; no more than is looked at.
    pub(super) fn least_room(&self) -> f64 {
        self.walls[..self.count].iter().map(|wall| wall.room).fold(INFLUENCE_M, f64::min)
    }

    /// Adds them to what a change of the joints must satisfy: what is too near is taken away by `recovery_m` at most.
    pub(super) fn enclose(&self, polyhedron: &mut Polyhedron, recovery_m: f64) {
        for wall in &self.walls[..self.count] {
            polyhedron.push(wall.slope, (-wall.room).min(recovery_m));
        }
    }

    /// The joints have moved.
    pub(super) fn pass(&mut self, change: &Vector6<f64>) {
        for wall in &mut self.walls[..self.count] {
            wall.room += wall.slope.dot(change);
        }
    }
}
