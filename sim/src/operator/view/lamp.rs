//! The light of the scene, in one camera's frame.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::operator::scene::Light;

/// A lamp as one camera sees it.
#[derive(Debug, Clone, Copy)]
pub struct Lamp {
    towards: Vector3<f32>,
    lamp: f32,
    ambient: f32,
    pub(super) gradient: Vector3<f32>,
    chest: Vector3<f32>,
}

impl Lamp {
    /// Moves the scene's light into a camera's frame; `chest` is where the gradient is zero.
    pub fn new(light: &Light, camera_from_world: &Isometry3<f64>, chest: &Point3<f64>) -> Self {
        let towards = Vector3::from(light.towards_lamp).normalize();
        Self {
            towards: (camera_from_world.rotation * towards).cast(),
            lamp: light.lamp as f32,
            ambient: light.ambient as f32,
            gradient: (camera_from_world.rotation * Vector3::from(light.gradient_per_m)).cast(),
            chest: (camera_from_world * chest).coords.cast(),
        }
    }

    /// Light on a surface with a normal (matte), before the gradient.
    pub(super) fn on(&self, normal: &Vector3<f32>) -> f32 {
        // Half of the ambient light comes from above all else: soft shading of what the lamp misses.
        let soft = 0.5 + 0.5 * normal.dot(&self.towards);
        self.ambient * (0.6 + 0.4 * soft) + self.lamp * normal.dot(&self.towards).max(0.0)
    }

    pub(super) fn gradient_at(&self, p: &Vector3<f32>) -> f32 {
        1.0 + self.gradient.dot(&(p - self.chest))
    }
}
