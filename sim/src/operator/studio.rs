//! The operator before the cameras: everything that does not change from frame to frame is prepared once,
//! then any camera can take a picture at any time.

use locoman_vision::camera::Camera;
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use nalgebra::Point3;

use super::body;
use super::lens::RayTable;
use super::motion::{Body, Posture};
use super::render::{Exposure, SLICES, render};
use super::room;
use super::scene::Scene;
use super::sensor::{Developer, mix};
use super::solid::{Solid, SolidError, solids};
use super::view::{Lamp, View};

/// The scene, ready to be photographed. Deterministic: equal inputs give equal pictures.
#[derive(Debug)]
pub struct Studio {
    scene: Scene,
    solids: Vec<Solid>,
    home: Posture,
    stands: Vec<Stand>,
    seed: u64,
}

/// A camera on its stand.
#[derive(Debug)]
struct Stand {
    camera: Camera,
    rays: RayTable,
    background: Vec<f32>,
    lamp: Lamp,
    developer: Developer,
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
}

impl Studio {
    /// Prepares; `seed` decides textures and noise.
    pub fn new(rig: &Rig, shells: &ShellSet, scene: Scene, seed: u64) -> Result<Self, SolidError> {
        let home = scene.motion.posture(0.0);
        let chest = Point3::from(home.of(Body::Torso).translation.vector);
        let stands = rig
            .cameras
            .iter()
            .map(|camera| {
                let rays = RayTable::new(camera);
                Stand {
                    background: room::background(camera, &rays, seed),
                    lamp: Lamp::new(&scene.light, &camera.world_from_camera.inverse(), &chest),
                    developer: Developer::new(
                        &scene.sensor,
                        &rays,
                        camera.width as usize,
                        camera.height as usize,
                    ),
                    camera: camera.clone(),
                    rays,
                }
            })
            .collect();
        Ok(Self { solids: solids(shells)?, scene, home, stands, seed })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The shells' solids, in the order of the shells file.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The cameras, in the order of the rig.
    pub fn cameras(&self) -> impl ExactSizeIterator<Item = &Camera> {
        self.stands.iter().map(|stand| &stand.camera)
    }

    /// The picture that a camera of the rig takes with its exposure centred on a time; `frame` picks its noise.
    pub fn picture(&self, camera: usize, t_s: f64, frame: u64) -> Picture {
        let stand = &self.stands[camera];
        let exposure_s = self.scene.sensor.exposure_s;
        let postures: Vec<Posture> = (0..SLICES)
            .map(|slice| {
                let share = (slice as f64 + 0.5) / SLICES as f64 - 0.5;
                self.scene.motion.posture(t_s + share * exposure_s)
            })
            .collect();
        let view = self.view(stand, &postures, t_s);
        let light = render(&Exposure {
            view: &view,
            rays: &stand.rays,
            lamp: &stand.lamp,
            background: &stand.background,
            width: stand.camera.width as usize,
        });
        let seed = mix(self.seed ^ mix(camera as u64 ^ mix(frame)));
        Picture {
            width: stand.camera.width,
            height: stand.camera.height,
            grey: stand.developer.develop(&light, seed),
        }
    }

    /// Camera, lamp, and what the camera has before it at one instant.
    pub(super) fn instant(&self, camera: usize, t_s: f64) -> (&Camera, &Lamp, View) {
        let stand = &self.stands[camera];
        (&stand.camera, &stand.lamp, self.view(stand, &[self.scene.motion.posture(t_s)], t_s))
    }

    fn view(&self, stand: &Stand, postures: &[Posture], t_s: f64) -> View {
        let limbs = body::limbs(&self.scene.motion.posture(t_s), &self.home);
        View::new(&stand.camera, &self.solids, postures, &limbs, &stand.lamp)
    }
}
