//! The operator before the cameras: everything that does not change from frame to frame is prepared once,
//! then any camera can take a picture at any time.

use std::sync::Arc;

use locoman_vision::camera::Camera;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use nalgebra::{Isometry3, Point3};

use super::event::{Look, Span};
use super::lens::RayTable;
use super::motion::{Body, Posture};
use super::render::{Exposure, render};
use super::room;
use super::scene::Scene;
use super::sensor::{Developer, mix};
use super::shutter::Shutter;
use super::solid::{Solid, SolidError};
use super::stage::Stage;
use super::view::{Lamp, View};

/// The scene, ready to be photographed. Deterministic: equal inputs give equal pictures.
#[derive(Debug)]
pub struct Studio {
    stage: Stage,
    shells: ShellSet,
    stands: Vec<Stand>,
    seed: u64,
}

/// A camera on its stand.
#[derive(Debug)]
struct Stand {
    /// As the rig has it.
    place: Place,
    /// Where it stands after it was bumped.
    bumped: Vec<(Span, Place)>,
    rays: Arc<RayTable>,
    developer: Developer,
    sync_group: usize,
    phase_s: f64,
}

/// A camera at one place.
#[derive(Debug, Clone)]
struct Place {
    camera: Camera,
    background: Arc<Vec<f32>>,
    lamp: Lamp,
}

/// What a camera sees whatever the scene: the costly part of a studio.
struct Drawn {
    camera: Camera,
    rays: Arc<RayTable>,
    background: Arc<Vec<f32>>,
    sync_group: usize,
}

/// A picture of 8 bit grey levels, by rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Width times height grey levels.
    pub grey: Vec<u8>,
    /// The quality that the scene asks for when it is coded as JPEG.
    pub jpeg_quality: i32,
}

/// An exposed picture before blur and noise: where nothing moves, one serves many pictures.
#[derive(Debug, Clone)]
pub struct Negative {
    camera: usize,
    light: Vec<f32>,
    brightness: f32,
}

/// A scene that cannot be played before these cameras with these shells.
#[derive(Debug, thiserror::Error)]
pub enum StudioError {
    /// The shells cannot be rendered.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// The scene names a camera that the rig does not have.
    #[error("the scene speaks of a camera `{id}`; the rig has {known}")]
    Camera {
        /// What the scene says.
        id: String,
        /// All cameras of the rig.
        known: String,
    },
    /// Two cameras that the rig exposes together have different phases in the scene.
    #[error("the scene gives `{id}` another phase than a camera that the rig exposes together with it")]
    Phase {
        /// The later one in the scene file.
        id: String,
    },
}

impl Studio {
    /// Prepares; `seed` decides textures and noise.
    pub fn new(rig: &Rig, shells: &ShellSet, scene: Scene, seed: u64) -> Result<Self, StudioError> {
        let drawn = rig.cameras.iter().zip(&rig.sync_groups).map(|(camera, sync_group)| {
            let rays = Arc::new(RayTable::new(camera));
            let background = Arc::new(room::background(camera, &rays, seed));
            Drawn { camera: camera.clone(), rays, background, sync_group: *sync_group }
        });
        Self::with_drawn(drawn.collect(), shells.clone(), scene, seed)
    }

    /// The same cameras, shells and room with another scene: cheaper than to draw the room again.
    pub fn with_scene(&self, scene: Scene) -> Result<Self, StudioError> {
        let drawn = self.stands.iter().map(|stand| {
            let Place { camera, background, .. } = stand.place.clone();
            Drawn { camera, rays: stand.rays.clone(), background, sync_group: stand.sync_group }
        });
        Self::with_drawn(drawn.collect(), self.shells.clone(), scene, self.seed)
    }

    fn with_drawn(drawn: Vec<Drawn>, shells: ShellSet, scene: Scene, seed: u64) -> Result<Self, StudioError> {
        let ids = || drawn.iter().map(|drawn| drawn.camera.id.as_str());
        let named = scene.cameras.iter().map(|phase| phase.id.as_str()).chain(scene.events.cameras());
        if let Some(id) = named.into_iter().find(|id| !ids().any(|known| known == *id)) {
            let known = ids().collect::<Vec<_>>().join(", ");
            return Err(StudioError::Camera { id: id.to_owned(), known });
        }
        let groups: Vec<(&str, usize)> =
            drawn.iter().map(|drawn| (drawn.camera.id.as_str(), drawn.sync_group)).collect();
        let phases = phases(&scene, &groups)?;
        let chest = Point3::from(scene.motion.posture(0.0).of(Body::Torso).translation.vector);
        let lamp = |camera: &Camera| Lamp::new(&scene.light, &camera.world_from_camera.inverse(), &chest);
        let stands = drawn
            .into_iter()
            .zip(phases)
            .map(|(Drawn { camera, rays, background, sync_group }, phase_s)| {
                let (width, height) = (camera.width as usize, camera.height as usize);
                let bumps = scene.events.bump.iter().filter(|bump| bump.camera == camera.id);
                let bumped = bumps
                    .map(|bump| {
                        let world_from_camera = camera.world_from_camera * bump.isometry();
                        let camera = Camera { world_from_camera, ..camera.clone() };
                        let background = Arc::new(room::background(&camera, &rays, seed));
                        (bump.during_s, Place { lamp: lamp(&camera), camera, background })
                    })
                    .collect();
                Stand {
                    developer: Developer::new(&scene.sensor, &rays, width, height),
                    place: Place { lamp: lamp(&camera), camera, background },
                    bumped,
                    rays,
                    sync_group,
                    phase_s,
                }
            })
            .collect();
        Ok(Self { stage: Stage::new(scene, &shells)?, shells, stands, seed })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        self.stage.scene()
    }

    /// The shells' solids, in the order of the shells file.
    pub fn solids(&self) -> &[Solid] {
        self.stage.operator()
    }

    /// The cameras as the rig has them, in its order.
    pub fn cameras(&self) -> impl ExactSizeIterator<Item = &Camera> {
        self.stands.iter().map(|stand| &stand.place.camera)
    }

    /// A camera as it truly is at a time: bumped or not.
    pub fn true_camera(&self, camera: usize, t_s: f64) -> &Camera {
        &self.stands[camera].at(t_s).camera
    }

    /// How much later than others a camera takes its pictures.
    pub fn phase_s(&self, camera: usize) -> f64 {
        self.stands[camera].phase_s
    }

    /// `world_from_shell` of one shell at any time.
    pub fn true_pose(&self, body: Body, t_s: f64) -> Isometry3<f64> {
        *self.true_posture(t_s).of(body)
    }

    /// `world_from_shell` of all shells at any time.
    pub fn true_posture(&self, t_s: f64) -> Posture {
        self.scene().motion.posture(t_s)
    }

    /// The picture that a camera of the rig takes with this capture time; `frame` picks its noise.
    pub fn picture(&self, camera: usize, t_s: f64, frame: u64) -> Picture {
        self.develop(&self.expose(camera, t_s, 1), frame)
    }

    /// The light that falls on a camera's pixels for a picture with this capture time. Edges are sampled in so many
    /// draws; where one exposure serves many pictures their errors do not average out.
    pub fn expose(&self, camera: usize, t_s: f64, draws: u32) -> Negative {
        let stand = &self.stands[camera];
        let place = stand.at(t_s);
        let Camera { id, width, height, .. } = &place.camera;
        let scene = self.scene();
        let (brightness, exposure_s) = scene.events.exposing_of(id, t_s);
        let light = match scene.events.cover_of(id, t_s) {
            Some(look) => covered(look, *width as usize, *height as usize),
            None => {
                let exposure_s = exposure_s.unwrap_or(scene.sensor.exposure_s);
                render(&Exposure {
                    view: &self.view(place, t_s, exposure_s),
                    rays: &stand.rays,
                    lamp: &place.lamp,
                    background: &place.background,
                    width: *width as usize,
                    draws: draws.max(1),
                    // Others for each picture: what they miss of an edge must not look like a bias of what is measured.
                    seed: mix(self.seed ^ mix(camera as u64 ^ t_s.to_bits())),
                })
            }
        };
        Negative { camera, light, brightness: brightness as f32 }
    }

    /// A picture of such light; `frame` picks its noise.
    pub fn develop(&self, negative: &Negative, frame: u64) -> Picture {
        let stand = &self.stands[negative.camera];
        let seed = mix(self.seed ^ mix(negative.camera as u64 ^ mix(frame)));
        Picture {
            width: stand.place.camera.width,
            height: stand.place.camera.height,
            grey: stand.developer.develop(&negative.light, negative.brightness, seed),
            jpeg_quality: self.scene().sensor.jpeg_quality,
        }
    }

    /// Whether a camera's lens is covered.
    pub(super) fn is_covered(&self, camera: usize, t_s: f64) -> bool {
        self.scene().events.cover_of(&self.stands[camera].place.camera.id, t_s).is_some()
    }

    /// What a camera has before it, each row at the middle of its exposure.
    pub(super) fn sharp_view(&self, camera: usize, t_s: f64) -> (&Lamp, View) {
        let place = self.stands[camera].at(t_s);
        (&place.lamp, self.view(place, t_s, 0.0))
    }

    fn view(&self, place: &Place, capture_s: f64, exposure_s: f64) -> View {
        let shutter = Shutter { camera: &place.camera, capture_s, exposure_s };
        View::new(&self.stage.cast(capture_s), &shutter, &place.lamp)
    }
}

impl Stand {
    fn at(&self, t_s: f64) -> &Place {
        let bumped = self.bumped.iter().find(|(during_s, _)| during_s.holds(t_s));
        bumped.map_or(&self.place, |(_, place)| place)
    }
}

/// The phase of each camera, given the id and the sync group of each.
fn phases(scene: &Scene, groups: &[(&str, usize)]) -> Result<Vec<f64>, StudioError> {
    let group_of = |id: &str| groups.iter().find(|(known, _)| *known == id).map(|(_, group)| *group);
    for (i, phase) in scene.cameras.iter().enumerate() {
        let same = |other: &&super::scene::Phase| group_of(&other.id) == group_of(&phase.id);
        if scene.cameras[..i].iter().filter(same).any(|other| other.phase_s != phase.phase_s) {
            return Err(StudioError::Phase { id: phase.id.clone() });
        }
    }
    let phase_of = |group: usize| scene.cameras.iter().find(|phase| group_of(&phase.id) == Some(group));
    Ok(groups.iter().map(|(_, group)| phase_of(*group).map_or(0.0, |phase| phase.phase_s)).collect())
}

/// Light on the pixels behind a covered lens.
fn covered(look: Look, width: usize, height: usize) -> Vec<f32> {
    /// Skin that lets light in at one side.
    const SKIN: f32 = 0.22;
    const SLOPE: f32 = 0.16;
    match look {
        Look::Black => vec![0.0; width * height],
        Look::Hand => (0..width * height)
            .map(|at| {
                let (x, y) = ((at % width) as f32 / width as f32, (at / width) as f32 / height as f32);
                SKIN + SLOPE * x * (1.0 - 0.5 * y)
            })
            .collect(),
    }
}
