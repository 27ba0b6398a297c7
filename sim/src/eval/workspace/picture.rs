//! Both workspaces around the robot, in space: orange where the foot gets to, blue where the gripper does.

use std::path::Path;

use anyhow::Context;
use locoman_robot::{
    collision::{Capsule, Part},
    joints::JointVector,
    kinematics::{Bodies, body_poses},
    model::Model,
};
use nalgebra::{Vector2, Vector3};
use plotters::{coord::Shift, prelude::*};

use super::{hull::Hull, sample::Effector};

const SIZE_PX: (u32, u32) = (1800, 1000);
const PIXELS_PER_METRE: f64 = 690.0;
const FOOT: RGBColor = RGBColor(235, 120, 10);
const GRIPPER: RGBColor = RGBColor(30, 100, 200);
const ROBOT: RGBColor = RGBColor(110, 114, 122);
const ARM: RGBColor = RGBColor(40, 42, 48);
/// From where one looks: angle about the vertical from straight ahead, and above the horizon, rad.
const AZIMUTH: f64 = -0.95;
const ELEVATION: f64 = 0.35;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws a panel for each pair of hulls (foot, gripper), as SVG.
pub fn draw(path: &Path, model: &Model, joints: &JointVector, hulls: &[[Hull; 2]]) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let area = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let panels = area.split_evenly((1, hulls.len().max(1)));
    let captions = ["one side, torso fixed", "both sides, torso fixed"];
    for ((panel, hulls), caption) in panels.iter().zip(hulls).zip(captions) {
        let (width, height) = panel.dim_in_pixel();
        let view = View::new(Vector2::new(f64::from(width) * 0.44, f64::from(height) * 0.53));
        // What is behind the robot, the robot, what is in front of it.
        surface(panel, &view, hulls, false)?;
        robot(panel, &view, model, joints)?;
        surface(panel, &view, hulls, true)?;
        legend(panel, hulls, caption)?;
    }
    area.present().context("the file cannot be written")
}

/// A parallel projection.
struct View {
    right: Vector3<f64>,
    up: Vector3<f64>,
    /// Towards the one who looks.
    near: Vector3<f64>,
    middle: Vector2<f64>,
}

impl View {
    fn new(middle: Vector2<f64>) -> Self {
        let near =
            Vector3::new(AZIMUTH.cos() * ELEVATION.cos(), AZIMUTH.sin() * ELEVATION.cos(), ELEVATION.sin());
        let right = Vector3::z().cross(&near).normalize();
        Self { right, up: near.cross(&right), near, middle }
    }

    fn plane(&self, point: &Vector3<f64>) -> Vector2<f64> {
        self.middle + Vector2::new(self.right.dot(point), -self.up.dot(point)) * PIXELS_PER_METRE
    }
}

fn pixel(place: &Vector2<f64>) -> (i32, i32) {
    (place.x.round() as i32, place.y.round() as i32)
}

/// The faces of both hulls that look away, or those that look here.
fn surface(area: &Area<'_>, view: &View, hulls: &[Hull; 2], front: bool) -> anyhow::Result<()> {
    let light = (view.near + view.up * 0.8 - view.right * 0.4).normalize();
    let mut order = [(&hulls[1], GRIPPER, 0.12), (&hulls[0], FOOT, 0.20)];
    if front {
        order.reverse();
    }
    for (hull, colour, opacity) in order {
        for face in &hull.faces {
            let [a, b, c] = face.map(|corner| hull.corners[corner]);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-15) else { continue };
            if (normal.dot(&view.near) > 0.0) != front {
                continue;
            }
            let outline: Vec<_> = [a, b, c].iter().map(|corner| pixel(&view.plane(corner))).collect();
            let facing = normal.dot(&view.near).abs();
            let shade = 0.75 + 0.35 * normal.dot(&light);
            // Denser at the rim, as a bubble is.
            let opacity = opacity * (0.7 + 1.6 * (1.0 - facing).powi(2)) * if front { 1.0 } else { 0.7 };
            area.draw(&Polygon::new(outline, dimmed(colour, shade).mix(opacity.min(0.6)).filled()))?;
        }
    }
    Ok(())
}

/// The robot's links as the self-collision model has them, the farthest first.
fn robot(area: &Area<'_>, view: &View, model: &Model, joints: &JointVector) -> anyhow::Result<()> {
    let bodies = body_poses(model, joints);
    let mut links: Vec<(Capsule, RGBColor)> = Vec::new();
    for shape in model.collision.shapes() {
        let is_arm = shape.link.part.is_of_arm() || shape.link.part == Part::Mount;
        let at = |point: &Vector3<f64>| {
            shape.link.joint().map_or(*point, |joint| {
                let (rotation, origin) = bodies.pose(joint);
                rotation * point + origin
            })
        };
        let Capsule { a, b, radius } = shape.capsule;
        links.push((Capsule { a: at(&a), b: at(&b), radius }, if is_arm { ARM } else { ROBOT }));
    }
    let depth = |capsule: &Capsule| view.near.dot(&(capsule.a + capsule.b));
    links.sort_by(|(a, _), (b, _)| depth(a).total_cmp(&depth(b)));
    for (capsule, colour) in links {
        // Three layers, each smaller and lighter, make it look round.
        for (size, shade) in [(1.0, 0.7), (0.88, 1.0), (0.6, 1.2), (0.3, 1.4)] {
            let outline = silhouette(view, &capsule, size);
            area.draw(&Polygon::new(outline, dimmed(colour, shade).filled()))?;
        }
    }
    Ok(())
}

/// Outline of a capsule of a share of its radius.
fn silhouette(view: &View, capsule: &Capsule, size: f64) -> Vec<(i32, i32)> {
    const STEPS: i32 = 12;
    let (a, b) = (view.plane(&capsule.a), view.plane(&capsule.b));
    let along = (b - a).try_normalize(1e-9).unwrap_or_else(Vector2::x);
    let across = Vector2::new(-along.y, along.x);
    let radius = size * capsule.radius * PIXELS_PER_METRE;
    let arc = |centre: Vector2<f64>, sign: f64| {
        (0..=STEPS).map(move |step| {
            let angle = std::f64::consts::PI * f64::from(step) / f64::from(STEPS);
            centre + (across * angle.cos() + along * angle.sin()) * (radius * sign)
        })
    };
    arc(b, 1.0).chain(arc(a, -1.0)).map(|place| pixel(&place)).collect()
}

fn legend(area: &Area<'_>, hulls: &[Hull; 2], caption: &str) -> anyhow::Result<()> {
    area.draw(&Text::new(caption.to_owned(), (40, 30), ("sans-serif", 30).into_font()))?;
    for (row, ((effector, hull), colour)) in
        Effector::ALL.into_iter().zip(hulls).zip([FOOT, GRIPPER]).enumerate()
    {
        let y = 78 + 34 * row as i32;
        area.draw(&Rectangle::new([(40, y), (66, y + 20)], colour.mix(0.6).filled()))?;
        let text = format!("{}: {:.3} m³ (convex hull)", effector.name(), hull.volume());
        area.draw(&Text::new(text, (78, y), ("sans-serif", 22).into_font()))?;
    }
    let (_, height) = area.dim_in_pixel();
    let (left, y) = (40, height as i32 - 50);
    let right = left + (0.2 * PIXELS_PER_METRE) as i32;
    area.draw(&PathElement::new(vec![(left, y), (right, y)], BLACK.stroke_width(3)))?;
    area.draw(&Text::new("0.2 m".to_owned(), (left, y + 8), ("sans-serif", 20).into_font()))?;
    Ok(())
}

/// Darker, or lighter.
fn dimmed(colour: RGBColor, shade: f64) -> RGBColor {
    let part = |part: u8| (f64::from(part) * shade).clamp(0.0, 255.0) as u8;
    RGBColor(part(colour.0), part(colour.1), part(colour.2))
}
