//! What stands before one camera during one exposure, made ready for many rays.
//!
//! The exposure is cut into slices of time: shells are placed for each, limbs for its middle alone.

mod bounds;
mod facet;
mod lamp;
mod limb;

use locoman_vision::camera::Camera;
use nalgebra::Isometry3;

use super::body::Limb;
use super::lens::Ray;
use super::motion::Posture;
use super::solid::Solid;
use facet::SeenFacet;
use limb::SeenLimb;

pub use bounds::Bounds;
pub use lamp::Lamp;

/// Keys with this bit are limbs'.
const LIMB: u32 = 1 << 31;

/// The nearest thing on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// 1 / depth along the camera's z axis; larger is nearer.
    pub nearness: f32,
    /// Reflected light; 1 is a white surface in full light.
    pub light: f32,
    /// Equal for rays that hit the same surface of the same ink.
    pub key: u32,
}

/// Things by number, and where in the image they are.
pub type Placed = Vec<(u16, Bounds)>;

/// Facets that face the camera, and limbs, in the camera's frame.
#[derive(Debug)]
pub struct View {
    facets: Vec<SeenFacet>,
    limbs: Vec<SeenLimb>,
}

impl View {
    /// Gets ready; `postures` holds one posture for each slice of the exposure, `limbs` those of its middle.
    pub fn new(camera: &Camera, solids: &[Solid], postures: &[Posture], limbs: &[Limb], lamp: &Lamp) -> Self {
        let camera_from_world = camera.world_from_camera.inverse();
        let mut facets = Vec::new();
        for (index, solid) in solids.iter().enumerate() {
            let camera_from_shell: Vec<Isometry3<f64>> =
                postures.iter().map(|posture| camera_from_world * posture.of(solid.body)).collect();
            for (place, facet) in solid.facets.iter().enumerate() {
                facets.extend(SeenFacet::new(camera, (index, place), facet, &camera_from_shell, lamp));
            }
        }
        let limbs = limbs.iter().map(|limb| SeenLimb::new(camera, limb, &camera_from_world)).collect();
        Self { facets, limbs }
    }

    /// Where facets and limbs appear, by the numbers that [`View::trace`] knows them by; those behind the
    /// camera are left out.
    pub fn bounds(&self) -> (Placed, Placed) {
        let facets = self.facets.iter().map(|facet| facet.bounds);
        let limbs = self.limbs.iter().map(|limb| limb.bounds);
        (numbered(facets), numbered(limbs))
    }

    /// The numbers of everything in front of the camera.
    pub fn all(&self) -> (Vec<u16>, Vec<u16>) {
        let (facets, limbs) = self.bounds();
        (facets.iter().map(|(n, _)| *n).collect(), limbs.iter().map(|(n, _)| *n).collect())
    }

    /// The number of a facet, if it faces the camera.
    pub fn number_of(&self, place: (usize, usize)) -> Option<u16> {
        self.facets.iter().position(|facet| facet.place == place).map(|n| n as u16)
    }

    /// The nearest hit of a ray among the named facets and limbs.
    #[inline]
    pub fn trace(&self, facets: &[u16], limbs: &[u16], ray: Ray, slice: usize, lamp: &Lamp) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for &number in facets {
            if let Some(hit) = self.facets[usize::from(number)].hit(number, ray, slice)
                && nearest.is_none_or(|old| hit.nearness > old.nearness)
            {
                nearest = Some(hit);
            }
        }
        for &number in limbs {
            let behind = nearest.map_or(0.0, |hit| hit.nearness);
            if let Some(hit) = self.limbs[usize::from(number)].hit(number, ray, behind, lamp) {
                nearest = Some(hit);
            }
        }
        nearest
    }

    /// Whether a key came from the facet of this number.
    pub fn is_facet(key: u32, number: u16) -> bool {
        key & LIMB == 0 && key >> 1 == u32::from(number)
    }
}

fn numbered(bounds: impl Iterator<Item = Option<Bounds>>) -> Placed {
    bounds.enumerate().filter_map(|(n, bounds)| Some((n as u16, bounds?))).collect()
}
