//! Capsules on links, from `configs/robot/collision.toml`.

use std::path::Path;

use nalgebra::Vector3;
use serde::Deserialize;

use super::{
    capsule::{Capsule, Separation, separation},
    links::{Link, Part, can_meet},
};
use crate::{
    joints::{JointVector, Leg, Side},
    kinematics::{Bodies, slope_of_point},
    model::ModelError,
};

/// The most capsules that there may be.
const MOST_SHAPES: usize = 64;
/// The most pairs that can be near at once; of more, the nearest are kept.
pub const MOST_NEAR: usize = 32;

/// `collision.toml`
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    capsule: Vec<CapsuleOfPart>,
    #[serde(default)]
    allowance: Vec<Allowance>,
}

/// A capsule on a right link, in the frame of the body that carries it.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct CapsuleOfPart {
    link: Part,
    a: Vector3<f64>,
    b: Vector3<f64>,
    radius: f64,
}

/// By how much the capsules of two links may overlap: links of one limb, or of the trunk and any.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Allowance {
    first: Part,
    second: Part,
    by: f64,
}

/// A capsule on a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// The link.
    pub link: Link,
    /// In the frame of the body that carries it.
    pub capsule: Capsule,
    joint: Option<usize>,
}

/// Two shapes that can meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    first: usize,
    second: usize,
    /// Diameters of the spheres about both, m.
    reach: f64,
    allowance: f64,
}

/// The shapes and the pairs of them that can meet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CollisionModel {
    shapes: Vec<Shape>,
    pairs: Vec<Pair>,
    pairs_of_side: [Vec<Pair>; 2],
}

impl CollisionModel {
    /// Reads and checks the file.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ModelError::Read { file: path.to_owned(), source })?;
        let file: File = toml::from_str(&text)
            .map_err(|source| ModelError::Table { file: path.to_owned(), source: Box::new(source) })?;
        match file.flaw() {
            None => Ok(Self::new(&file)),
            Some((element, reason)) => Err(ModelError::Element { file: path.to_owned(), element, reason }),
        }
    }

    fn new(file: &File) -> Self {
        let mut shapes = Vec::new();
        for part in Part::ALL {
            for link in Link::all(part) {
                for of_part in file.capsule.iter().filter(|capsule| capsule.link == part) {
                    shapes.push(Shape { link, capsule: of_part.on(link), joint: link.joint() });
                }
            }
        }
        let mut pairs = Vec::new();
        for (second, late) in shapes.iter().enumerate() {
            for (first, early) in shapes[..second].iter().enumerate() {
                if can_meet(early.link, late.link) {
                    let reach = early.capsule.size() + late.capsule.size();
                    pairs.push(Pair {
                        first,
                        second,
                        reach,
                        allowance: file.allowance(early.link, late.link),
                    });
                }
            }
        }
        let of_side = |side: Side| {
            let leg = Some(side.leg());
            let moves =
                |pair: &&Pair| shapes[pair.first].link.leg == leg || shapes[pair.second].link.leg == leg;
            pairs.iter().filter(moves).copied().collect()
        };
        Self { pairs_of_side: Side::ALL.map(of_side), shapes, pairs }
    }

    /// All shapes.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// Those of a leg and its arm.
    pub fn shapes_of(&self, leg: Leg) -> impl Iterator<Item = &Shape> {
        self.shapes.iter().filter(move |shape| shape.link.leg == Some(leg))
    }

    /// All pairs that can meet.
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// Those of one front limb.
    pub fn pairs_of(&self, side: Side) -> &[Pair] {
        &self.pairs_of_side[side.index()]
    }
}

impl Pair {
    /// The links.
    pub fn links(&self, model: &CollisionModel) -> [Link; 2] {
        [self.first, self.second].map(|shape| model.shapes[shape].link)
    }
}

impl File {
    fn allowance(&self, first: Link, second: Link) -> f64 {
        let matches = |entry: &&Allowance| {
            (first.leg == second.leg || first.leg.is_none())
                && ((entry.first, entry.second) == (first.part, second.part)
                    || (entry.second, entry.first) == (first.part, second.part))
        };
        self.allowance.iter().find(matches).map_or(0.0, |entry| entry.by)
    }

    /// The first element whose numbers make no sense, and why.
    fn flaw(&self) -> Option<(String, String)> {
        let count: usize = self.capsule.iter().map(|capsule| Link::all(capsule.link).count()).sum();
        if count > MOST_SHAPES {
            return Some((
                "capsule".into(),
                format!("makes {count} shapes; at most {MOST_SHAPES} are possible"),
            ));
        }
        for (index, capsule) in self.capsule.iter().enumerate() {
            let element = || format!("capsule {} of link `{}`", index + 1, capsule.link);
            if !(capsule.radius > 0.0 && capsule.radius < 1.0) {
                return Some((element(), "needs a radius above 0 and below 1 m".into()));
            }
            if !capsule.a.iter().chain(&capsule.b).all(|x| x.abs() < 1.0) {
                return Some((element(), "needs ends a and b within 1 m of the link".into()));
            }
        }
        if let Some(missing) =
            Part::ALL.into_iter().find(|part| !self.capsule.iter().any(|c| c.link == *part))
        {
            return Some((format!("link `{missing}`"), "has no capsule".into()));
        }
        let odd = self.allowance.iter().find(|entry| !(0.0..0.1).contains(&entry.by));
        odd.map(|entry| {
            let element = format!("allowance of `{}` and `{}`", entry.first, entry.second);
            (element, "must be at least 0 and below 0.1 m".into())
        })
    }
}

impl CapsuleOfPart {
    /// On one link of the part: mirrored on the left.
    fn on(&self, link: Link) -> Capsule {
        let mirror = Vector3::new(1.0, if link.is_left() { -1.0 } else { 1.0 }, 1.0);
        Capsule { a: self.a.component_mul(&mirror), b: self.b.component_mul(&mirror), radius: self.radius }
    }
}

impl Capsule {
    /// Diameter of the sphere about it, m.
    fn size(&self) -> f64 {
        (self.b - self.a).norm() + 2.0 * self.radius
    }
}

/// Two links that are near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// The links.
    pub links: [Link; 2],
    /// Between the capsules, with their allowance, m.
    pub distance: f64,
    nearest: Separation,
    joints: [Option<usize>; 2],
}

/// How far links are apart in one posture; memory that is taken once.
#[derive(Debug, Clone)]
pub struct Clearances {
    placed: [Capsule; MOST_SHAPES],
    /// Twice the capsules' centres.
    middle: [Vector3<f64>; MOST_SHAPES],
    near: [Clearance; MOST_NEAR],
    count: usize,
}

impl Default for Clearances {
    fn default() -> Self {
        Self::new()
    }
}

impl Clearances {
    /// Nothing known.
    pub fn new() -> Self {
        let capsule = Capsule { a: Vector3::zeros(), b: Vector3::zeros(), radius: 0.0 };
        let trunk = Link { part: Part::Trunk, leg: None };
        let nearest = separation(&capsule, &capsule);
        let clearance = Clearance { links: [trunk; 2], distance: 0.0, nearest, joints: [None; 2] };
        let middle = [Vector3::zeros(); MOST_SHAPES];
        Self { placed: [capsule; MOST_SHAPES], middle, near: [clearance; MOST_NEAR], count: 0 }
    }

    /// Finds the pairs that are nearer than `within` (m). Allocates nothing.
    pub fn update(&mut self, model: &CollisionModel, pairs: &[Pair], bodies: &impl Bodies, within: f64) {
        for ((placed, middle), shape) in self.placed.iter_mut().zip(&mut self.middle).zip(&model.shapes) {
            *placed = match shape.joint {
                None => shape.capsule,
                Some(joint) => {
                    let (rotation, origin) = bodies.pose(joint);
                    let at = |point: &Vector3<f64>| rotation * point + origin;
                    Capsule { a: at(&shape.capsule.a), b: at(&shape.capsule.b), radius: shape.capsule.radius }
                }
            };
            *middle = placed.a + placed.b;
        }
        self.count = 0;
        for pair in pairs {
            // Spheres about both; from here on twice their size.
            let apart = self.middle[pair.first] - self.middle[pair.second];
            let near = pair.reach + 2.0 * within;
            if apart.norm_squared() > near * near {
                continue;
            }
            let (first, second) = (&self.placed[pair.first], &self.placed[pair.second]);
            let nearest = separation(first, second);
            let distance = nearest.distance + pair.allowance;
            if distance < within {
                let shapes = [&model.shapes[pair.first], &model.shapes[pair.second]];
                let links = shapes.map(|shape| shape.link);
                self.keep(Clearance { links, distance, nearest, joints: shapes.map(|shape| shape.joint) });
            }
        }
    }

    fn keep(&mut self, clearance: Clearance) {
        if self.count < MOST_NEAR {
            self.near[self.count] = clearance;
            self.count += 1;
            return;
        }
        let farthest = self.near.iter_mut().max_by(|a, b| a.distance.total_cmp(&b.distance));
        if let Some(farthest) = farthest.filter(|farthest| farthest.distance > clearance.distance) {
            *farthest = clearance;
        }
    }

    /// Those that are near, in no order.
    pub fn near(&self) -> &[Clearance] {
        &self.near[..self.count]
    }

    /// The smallest distance of those that are near, m.
    pub fn least(&self) -> Option<f64> {
        self.near().iter().map(|clearance| clearance.distance).min_by(f64::total_cmp)
    }
}

impl Clearance {
    /// How the distance grows with each joint's angle, m/rad.
    pub fn gradient(&self, bodies: &impl Bodies) -> JointVector {
        let Separation { first, second, direction, .. } = &self.nearest;
        slope_of_point(bodies, self.joints[0], first, direction)
            - slope_of_point(bodies, self.joints[1], second, direction)
    }
}
