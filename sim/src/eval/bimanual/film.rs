//! A robot from its right side, at several instants: its capsules, by the simulator's truth.

use std::path::Path;

use anyhow::Context;
use locoman_robot::kinematics::{Bodies, body_poses};
use locoman_robot::model::Model;
use nalgebra::Vector3;
use plotters::prelude::*;

use crate::eval::lockstep::Lockstep;

/// Pixels for a metre, and of a picture.
const SCALE_PX: f64 = 260.0;
const SIZE_PX: (u32, u32) = (210, 310);
/// Height of the ground in a picture, and where the robot began, px.
const GROUND_PX: f64 = 290.0;
const MIDDLE_PX: f64 = 125.0;

/// A capsule in the world, seen from the side.
#[derive(Debug, Clone, Copy)]
struct Stroke {
    ends: [Vector3<f64>; 2],
    radius: f64,
    is_of_arm: bool,
}

/// One instant.
#[derive(Debug, Clone)]
pub struct Frame {
    caption: String,
    /// Those farthest away first.
    strokes: Vec<Stroke>,
}

impl Frame {
    /// The robot now.
    pub fn take(sut: &Lockstep, model: &Model, caption: String) -> Self {
        let world_from_torso = sut.truth().world_from_torso;
        let bodies = body_poses(model, &sut.snapshot().joint_position);
        let mut strokes: Vec<Stroke> = model
            .collision
            .shapes()
            .iter()
            .map(|shape| {
                let place = |point: Vector3<f64>| {
                    let in_torso = shape.link.joint().map_or(point, |joint| {
                        let (rotation, origin) = bodies.pose(joint);
                        rotation * point + origin
                    });
                    (world_from_torso * nalgebra::Point3::from(in_torso)).coords
                };
                Stroke {
                    ends: [place(shape.capsule.a), place(shape.capsule.b)],
                    radius: shape.capsule.radius,
                    is_of_arm: shape.link.joint().is_some_and(|joint| joint >= 12),
                }
            })
            .collect();
        strokes.sort_by(|a, b| b.ends[0].y.total_cmp(&a.ends[0].y));
        Self { caption, strokes }
    }
}

/// Draws frames side by side, as SVG.
pub fn draw(path: &Path, frames: &[Frame]) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let count = u32::try_from(frames.len().max(1))?;
    let area = SVGBackend::new(path, (SIZE_PX.0 * count, SIZE_PX.1)).into_drawing_area();
    area.fill(&WHITE)?;
    for (frame, picture) in frames.iter().zip(area.split_evenly((1, frames.len().max(1)))) {
        let pixel = |point: &Vector3<f64>| {
            ((MIDDLE_PX + SCALE_PX * point.x) as i32, (GROUND_PX - SCALE_PX * point.z) as i32)
        };
        picture.draw(&PathElement::new(
            [(0, GROUND_PX as i32), (SIZE_PX.0 as i32, GROUND_PX as i32)],
            BLACK.stroke_width(2),
        ))?;
        for stroke in &frame.strokes {
            let depth = (0.5 + 1.5 * stroke.ends[0].y).clamp(0.0, 1.0);
            let [r, g, b] = if stroke.is_of_arm { [200.0, 90.0, 40.0] } else { [60.0, 80.0, 110.0] };
            let fade = |value: f64| (value + (225.0 - value) * depth) as u8;
            let colour = RGBColor(fade(r), fade(g), fade(b));
            let width = (2.0 * SCALE_PX * stroke.radius).round().max(1.0) as u32;
            let ends = stroke.ends.each_ref().map(pixel);
            picture.draw(&PathElement::new(ends, colour.stroke_width(width)))?;
            for end in ends {
                picture.draw(&Circle::new(end, width / 2, colour.filled()))?;
            }
        }
        picture.draw(&Text::new(frame.caption.clone(), (8, 8), ("sans-serif", 15).into_font()))?;
    }
    area.present().context("the file cannot be written")
}
