//! Who and what is in the room at a time: the operator, his torn tags, visitors, posters, a passing hand.
//!
//! A prop is a set of facets that moves as one. The operator's shells come first, in the order of the shells file.

use std::borrow::Cow;
use std::collections::HashSet;

use locoman_vision::camera::Camera;
use locoman_vision::shells::ShellSet;
use nalgebra::Isometry3;

use super::body::{self, Limb};
use super::event::{Poster, TearLook, Visitor, VisitorTags};
use super::ink::IDS;
use super::motion::{Body, Posture};
use super::scene::Scene;
use super::solid::{self, Facet, Solid, SolidError, solids};

/// All that may ever stand before the cameras.
#[derive(Debug)]
pub struct Stage {
    scene: Scene,
    operator: Vec<Solid>,
    home: Posture,
    visitors: Vec<(Visitor, Vec<Solid>)>,
    posters: Vec<(Poster, Vec<Facet>)>,
}

/// What is there while one picture is taken.
#[derive(Debug)]
pub struct Cast<'a> {
    stage: &'a Stage,
    props: Vec<(Carrier, Cow<'a, [Facet]>)>,
    visitors: Vec<&'a Visitor>,
    capture_s: f64,
}

/// What a prop is fixed to.
#[derive(Debug, Clone, Copy)]
enum Carrier {
    Operator(Body),
    /// By place among the visitors that are there.
    Visitor(usize, Body),
    Room(Isometry3<f64>),
}

impl Stage {
    /// Builds all props.
    pub fn new(scene: Scene, shells: &ShellSet) -> Result<Self, SolidError> {
        let events = &scene.events;
        let visitors = events
            .visitor
            .iter()
            .map(|visitor| {
                let worn = match visitor.tags {
                    VisitorTags::Same => solids(shells),
                    VisitorTags::Other => solids(&renumbered(shells)?),
                };
                Ok((visitor.clone(), worn?))
            })
            .collect::<Result<_, SolidError>>()?;
        let posters = events
            .poster
            .iter()
            .map(|poster| Ok((poster.clone(), vec![solid::sheet(&poster.ids, poster.size_m)?])))
            .collect::<Result<_, SolidError>>()?;
        let home = scene.motion.posture(0.0);
        Ok(Self { operator: solids(shells)?, home, visitors, posters, scene })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The operator's shells, whole, in the order of the shells file.
    pub fn operator(&self) -> &[Solid] {
        &self.operator
    }

    /// Where everybody was at the scene's begin.
    pub fn home(&self) -> &Posture {
        &self.home
    }

    /// Who and what is there at a capture time; nobody comes or goes while a picture is taken.
    pub fn cast(&self, capture_s: f64) -> Cast<'_> {
        let mut props: Vec<_> = self
            .operator
            .iter()
            .map(|solid| (Carrier::Operator(solid.body), self.after_tears(solid, capture_s)))
            .collect();
        let mut visitors = Vec::new();
        for (visitor, solids) in self.visitors.iter().filter(|(it, _)| it.during_s.holds(capture_s)) {
            let carried = |solid: &Solid| Carrier::Visitor(visitors.len(), solid.body);
            props.extend(solids.iter().map(|solid| (carried(solid), Cow::Borrowed(&solid.facets[..]))));
            visitors.push(visitor);
        }
        for (poster, facets) in self.posters.iter().filter(|(it, _)| it.during_s.holds(capture_s)) {
            let place = Carrier::Room(poster.world_from_poster.isometry());
            props.push((place, Cow::Borrowed(&facets[..])));
        }
        Cast { stage: self, props, visitors, capture_s }
    }

    /// The facets of a shell without the tags that are off; those that hang are added at the end.
    fn after_tears<'a>(&self, solid: &'a Solid, t_s: f64) -> Cow<'a, [Facet]> {
        let look = |id: u32| self.scene.events.tear_of(id, t_s);
        let torn = |facet: &Facet| facet.tags.iter().any(|tag| look(tag.id).is_some());
        if !solid.facets.iter().any(torn) {
            return Cow::Borrowed(&solid.facets);
        }
        let mut facets = solid.facets.clone();
        for facet in &mut facets {
            facet.tags.retain(|tag| look(tag.id).is_none());
        }
        for whole in &solid.facets {
            let hang = whole.tags.iter().filter(|tag| look(tag.id) == Some(TearLook::Hanging));
            facets.extend(hang.flat_map(|tag| solid::hanging(whole, tag)));
        }
        Cow::Owned(facets)
    }
}

impl Cast<'_> {
    /// The facets of each prop.
    pub fn facets(&self) -> impl Iterator<Item = &[Facet]> {
        self.props.iter().map(|(_, facets)| &facets[..])
    }

    /// `world_from_prop` of each prop at a time.
    pub fn poses(&self, t_s: f64) -> Vec<Isometry3<f64>> {
        let motion = &self.stage.scene.motion;
        let operator = motion.posture(t_s);
        let visitors: Vec<(Isometry3<f64>, Posture)> = self
            .visitors
            .iter()
            .map(|it| (it.world_from_operator.isometry(), motion.posture(t_s - it.delay_s)))
            .collect();
        let pose = |carrier: &Carrier| match carrier {
            Carrier::Operator(body) => *operator.of(*body),
            Carrier::Visitor(visitor, body) => {
                let (place, posture) = &visitors[*visitor];
                place * posture.of(*body)
            }
            Carrier::Room(pose) => *pose,
        };
        self.props.iter().map(|(carrier, _)| pose(carrier)).collect()
    }

    /// The bodies at a time, in the world, and the hand that passes before this camera.
    pub fn limbs(&self, t_s: f64, camera: &Camera) -> Vec<Limb> {
        let (scene, home) = (&self.stage.scene, &self.stage.home);
        let mut limbs = body::limbs(&scene.motion.posture(t_s), home);
        for visitor in &self.visitors {
            let place = visitor.world_from_operator.isometry();
            let own = body::limbs(&scene.motion.posture(t_s - visitor.delay_s), home);
            limbs.extend(own.iter().map(|limb| limb.moved(&place)));
        }
        for pass in &scene.events.pass {
            if pass.camera == camera.id && pass.during_s.holds(self.capture_s) {
                /// Beyond the image's edge at both ends.
                const BESIDE_M: f64 = 0.15;
                let edge = 0.5 * f64::from(camera.width) / camera.focal_px.x * pass.distance_m + BESIDE_M;
                let x = edge * (2.0 * pass.during_s.share(t_s) - 1.0);
                let place = camera.world_from_camera * Isometry3::translation(x, 0.02, pass.distance_m);
                limbs.extend(body::raised_hand().iter().map(|limb| limb.moved(&place)));
            }
        }
        limbs
    }

    /// Whether anything that [`Cast::poses`] does not tell of moves: a hand before this camera.
    pub fn has_passing_hand(&self, camera: &Camera) -> bool {
        let passes = &self.stage.scene.events.pass;
        passes.iter().any(|it| it.camera == camera.id && it.during_s.holds(self.capture_s))
    }
}

/// The same shells with tags that none of them has.
fn renumbered(shells: &ShellSet) -> Result<ShellSet, SolidError> {
    let taken: HashSet<u32> = shells.shells.iter().flat_map(|shell| &shell.tags).map(|tag| tag.id).collect();
    let free = IDS as usize - taken.len();
    let mut ids = (0..IDS).filter(|id| !taken.contains(id));
    let mut other = shells.clone();
    for tag in other.shells.iter_mut().flat_map(|shell| &mut shell.tags) {
        tag.id = ids.next().ok_or(SolidError::Visitor { needed: taken.len(), free })?;
    }
    Ok(other)
}
