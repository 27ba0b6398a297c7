//! What stands before one camera during one exposure, made ready for many rays.
//!
//! The exposure is cut into slices of time: shells are placed for each slice of each row, limbs once for each band
//! of rows.

mod bounds;
mod facet;
mod lamp;
mod limb;
mod passage;
mod window;

use super::course::Course;
use super::lens::Ray;
use super::shutter::Shutter;
use super::stage::Cast;
use facet::SeenFacet;
use limb::SeenLimb;
use window::Window;

pub use bounds::Bounds;
pub use lamp::Lamp;
pub use passage::Pace;

/// Keys with this bit are limbs'.
const LIMB: u32 = 1 << 31;
/// Rows for which limbs are placed together: at 1 m/s and 25 us a row they move by less than a pixel in between.
pub const BAND_ROWS: usize = 16;

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

/// What a ray may hit, by the numbers that [`View::trace`] knows them by.
#[derive(Debug, Default, Clone)]
pub struct Candidates {
    /// Facets.
    pub facets: Vec<u16>,
    /// Limbs of the band.
    pub limbs: Vec<u16>,
    /// The band of rows.
    pub band: usize,
}

/// Facets that face the camera, and limbs, in the camera's frame.
#[derive(Debug)]
pub struct View {
    facets: Vec<SeenFacet>,
    /// For each band of rows; for all rows if there is but one.
    bands: Vec<Vec<SeenLimb>>,
}

impl View {
    /// Gets ready.
    pub fn new(cast: &Cast<'_>, shutter: &Shutter<'_>, lamp: &Lamp) -> Self {
        let camera = shutter.camera;
        let courses = Course::of_all(shutter, |t_s| cast.poses(t_s));
        let mut facets = Vec::new();
        for (index, (prop, course)) in cast.facets().zip(&courses).enumerate() {
            for (place, facet) in prop.iter().enumerate() {
                facets.extend(SeenFacet::new(shutter, (index, place), facet, course, lamp));
            }
        }
        let camera_from_world = camera.world_from_camera.inverse();
        let limbs_at = |t_s: f64| -> Vec<SeenLimb> {
            let limbs = cast.limbs(t_s, camera);
            limbs.iter().map(|limb| SeenLimb::new(camera, limb, &camera_from_world)).collect()
        };
        let moves = courses.iter().any(|course| matches!(course, Course::Knots { .. }));
        let alike = shutter.is_global() || !(moves || cast.has_passing_hand(camera));
        let bands = if alike {
            vec![limbs_at(shutter.capture_s)]
        } else {
            let middles =
                (0..camera.height).step_by(BAND_ROWS).map(|row| f64::from(row) + 0.5 * BAND_ROWS as f64);
            middles.map(|y_px| limbs_at(shutter.row_s(y_px))).collect()
        };
        Self { facets, bands }
    }

    /// Where facets appear; those behind the camera are left out.
    pub fn placed_facets(&self) -> Placed {
        numbered(self.facets.iter().map(|facet| facet.passage.bounds))
    }

    /// Where limbs appear in a band; those behind the camera are left out.
    pub fn placed_limbs(&self, band: usize) -> Placed {
        self.bands.get(band).map_or_else(Placed::new, |limbs| numbered(limbs.iter().map(|limb| limb.bounds)))
    }

    /// The band of a row.
    pub fn band_of(&self, row: usize) -> usize {
        (row / BAND_ROWS).min(self.bands.len() - 1)
    }

    /// Everything in front of the camera, for each band.
    pub fn all(&self) -> Vec<Candidates> {
        let numbers = |placed: Placed| placed.into_iter().map(|(number, _)| number).collect::<Vec<_>>();
        let facets = numbers(self.placed_facets());
        (0..self.bands.len())
            .map(|band| Candidates { facets: facets.clone(), limbs: numbers(self.placed_limbs(band)), band })
            .collect()
    }

    /// The number of a facet, if it faces the camera.
    pub fn number_of(&self, place: (usize, usize)) -> Option<u16> {
        self.facets.iter().position(|facet| facet.place == place).map(|n| n as u16)
    }

    /// How far a facet moves during an exposure.
    pub fn pace_of(&self, facet: u16) -> Pace {
        self.facets.get(usize::from(facet)).map_or(Pace::Still, |facet| facet.passage.pace)
    }

    /// Leaves of some candidates those that a pixel with these corners may show.
    pub fn narrow(&self, among: &Candidates, corners: &[Ray; 4], narrowed: &mut Candidates) {
        let pixel = Window::of_rays(corners);
        let limbs = &self.bands[among.band];
        let facets = &self.facets;
        let facet_meets = |number: &u16| facets[usize::from(*number)].passage.window.meets(&pixel);
        let limb_meets = |number: &u16| limbs[usize::from(*number)].window.meets(&pixel);
        narrowed.facets.clear();
        narrowed.facets.extend(among.facets.iter().copied().filter(facet_meets));
        narrowed.limbs.clear();
        narrowed.limbs.extend(among.limbs.iter().copied().filter(limb_meets));
        narrowed.band = among.band;
    }

    /// The nearest hit of a ray in a slice of the exposure of a row.
    #[inline]
    pub fn trace(&self, among: &Candidates, ray: Ray, row: usize, slice: usize, lamp: &Lamp) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for &number in &among.facets {
            let facet = &self.facets[usize::from(number)];
            if facet.passage.window.holds(ray)
                && let Some(hit) = facet.hit(number, ray, row, slice)
                && nearest.is_none_or(|old| hit.nearness > old.nearness)
            {
                nearest = Some(hit);
            }
        }
        let limbs = &self.bands[among.band];
        for &number in &among.limbs {
            let limb = &limbs[usize::from(number)];
            let behind = nearest.map_or(0.0, |hit| hit.nearness);
            if limb.window.holds(ray)
                && let Some(hit) = limb.hit(number, ray, behind, lamp)
            {
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
