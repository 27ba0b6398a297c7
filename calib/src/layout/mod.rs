//! Shell geometry: where each tag really is, from a recording of the waved shell before calibrated cameras.
//!
//! The drawing need only be about right (hand-glued tags are millimetres off). What is found is laid over the drawing by
//! the sum of distances, so that the few tags that are wrong are named instead of bending the rest.

use std::fmt::Write;

use locoman_vision::pose::Observation;
use locoman_vision::rig::Rig;
use locoman_vision::shells::Shell;
use nalgebra::{Isometry3, Point3};

use crate::bundle::FREE;
use crate::extrinsics::{ExtrinsicsError, Freedom, Solved, align, solve};

/// A tag beside its drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TagFinding {
    /// Number within the family.
    pub id: u32,
    /// Images in which it was used.
    pub images: usize,
    /// Images in which it did not fit.
    pub outliers: usize,
    /// How far its centre is from the drawn one, m.
    pub shift_m: f64,
    /// How it is turned against the drawing, rad.
    pub turn_rad: f64,
    /// Standard deviation of its position, m, and of its orientation, rad, root of the mean of the axes.
    pub sigma_m: f64,
    /// See above.
    pub sigma_rad: f64,
    /// Its size by the stated one, and the standard deviation of that.
    pub scale: (f64, f64),
}

/// A shell as it was found.
#[derive(Debug, Clone)]
pub struct Layout {
    /// In the frame of the drawing; tags that were hardly seen stay as drawn.
    pub shell: Shell,
    /// Each tag, in the order of the shell.
    pub tags: Vec<TagFinding>,
    /// The adjustment behind it; its body stands in a frame of its own.
    pub solved: Solved,
}

/// Fewest images of a tag whose place is believed.
const LEAST_IMAGES: usize = 5;
/// From here on a tag is called misplaced: what prints and glue leave is less.
const MISPLACED_M: f64 = 1e-3;
/// From here on a size is called wrong.
const MISSIZED: f64 = 0.01;
/// Beyond this many standard deviations it is no chance.
const SIGMAS: f64 = 5.0;

/// Finds the place of every tag. `joint`: cameras (but the first) are found along with them, their intrinsics kept.
pub fn measure(
    rig: &Rig,
    drawn: &Shell,
    observations: &[Observation],
    joint: bool,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Layout, ExtrinsicsError> {
    let freedom = Freedom { places: joint, tags_m: FREE, tags_rad: FREE, ..Freedom::NOTHING };
    let solved = solve(rig, drawn, observations, &freedom, progress)?;
    // Sizes are checked apart: freed together with the places they would widen these.
    let sized = Freedom { sizes: 0.05, ..freedom };
    let sized = (!joint && rig.cameras.len() > 1)
        .then(|| solve(rig, drawn, observations, &sized, progress).ok())
        .flatten();
    Ok(conclude(drawn, solved, sized.as_ref()))
}

fn conclude(drawn: &Shell, solved: Solved, sized: Option<&Solved>) -> Layout {
    let count = drawn.tags.len();
    let (mut images, mut outliers) = (vec![0; count], vec![0; count]);
    for sighting in &solved.problem.sightings {
        if sighting.outlier { outliers[sighting.part] += 1 } else { images[sighting.part] += 1 }
    }
    let seen = |k: &usize| images[*k] >= LEAST_IMAGES;
    let pairs: Vec<(Point3<f64>, Point3<f64>)> = (0..count)
        .filter(seen)
        .flat_map(|k| solved.body.tags[k].corners().into_iter().zip(drawn.tags[k].corners()))
        .collect();
    let drawn_from_found = align(&pairs).unwrap_or_else(Isometry3::identity);
    let mut shell = drawn.clone();
    let mut tags = Vec::with_capacity(count);
    for k in 0..count {
        let found = drawn_from_found * solved.body.tags[k].shell_from_tag;
        let believed = seen(&k);
        let was = drawn.tags[k].shell_from_tag;
        if believed {
            shell.tags[k].shell_from_tag = found;
        }
        let difference = if believed { was.inverse() * found } else { Isometry3::identity() };
        let sigmas = solved.outcome.part_sigmas(k);
        let mean = |part: &[f64]| (part.iter().map(|s| s * s).sum::<f64>() / 3.0).sqrt();
        let scale = sized.map_or((1.0, f64::INFINITY), |sized| {
            let sigma = sized.outcome.part_sigmas(k).get(6).copied().unwrap_or(f64::INFINITY);
            (sized.problem.parts[k].scale, sigma)
        });
        tags.push(TagFinding {
            id: drawn.tags[k].id,
            images: images[k],
            outliers: outliers[k],
            shift_m: difference.translation.vector.norm(),
            turn_rad: difference.rotation.angle(),
            sigma_m: sigmas.get(..3).map_or(f64::INFINITY, mean),
            sigma_rad: sigmas.get(3..6).map_or(f64::INFINITY, mean),
            scale,
        });
    }
    Layout { shell, tags, solved }
}

impl TagFinding {
    /// Not where it is drawn, beyond what chance and glue explain.
    pub fn misplaced(&self) -> bool {
        self.images >= LEAST_IMAGES && self.shift_m > MISPLACED_M.max(SIGMAS * self.sigma_m)
    }

    /// Not of the size that the file says.
    pub fn missized(&self) -> bool {
        let (scale, sigma) = self.scale;
        // Of a tag that was not seen the deviation is beyond all measure.
        (scale - 1.0).abs() > MISSIZED.max(SIGMAS * sigma)
    }

    /// Often does not fit: torn, bent, or its number is also elsewhere.
    pub fn damaged(&self) -> bool {
        /// A sound tag hardly ever fails to fit.
        const MOST_SHARE: f64 = 0.2;
        self.outliers >= LEAST_IMAGES
            && self.outliers as f64 > MOST_SHARE * (self.images + self.outliers) as f64
    }
}

/// The findings in words: first what is wrong, then how sure the rest is.
pub fn describe(layout: &Layout) -> String {
    let mut text = String::new();
    let shell = &layout.shell.name;
    for tag in &layout.tags {
        let id = tag.id;
        if tag.images < LEAST_IMAGES {
            let _ =
                writeln!(text, "{shell}: tag {id} was seen in {} images only: it stays as drawn", tag.images);
        }
        if tag.misplaced() {
            let (mm, degrees) = (1e3 * tag.shift_m, tag.turn_rad.to_degrees());
            let _ = writeln!(
                text,
                "{shell}: tag {id} is {mm:.2} mm and {degrees:.1} degrees from where it is drawn"
            );
        }
        if tag.missized() {
            let _ = writeln!(
                text,
                "{shell}: tag {id} is {:.3} times as large as the file says: measure its black square",
                tag.scale.0
            );
        }
        if tag.damaged() {
            let _ = writeln!(
                text,
                "{shell}: tag {id} did not fit in {} of {} images: is it torn, bent or stuck on twice?",
                tag.outliers,
                tag.images + tag.outliers
            );
        }
    }
    let mut sigmas: Vec<f64> = layout.tags.iter().map(|tag| tag.sigma_m).filter(|s| s.is_finite()).collect();
    sigmas.sort_by(f64::total_cmp);
    let at = |share: f64| {
        1e3 * sigmas
            .get((sigmas.len().saturating_sub(1) as f64 * share) as usize)
            .copied()
            .unwrap_or(f64::NAN)
    };
    let _ = writeln!(
        text,
        "{shell}: {} tags known to {:.3} mm (median) and {:.3} mm (worst), {:.3} px RMS",
        sigmas.len(),
        at(0.5),
        at(1.0),
        layout.solved.outcome.rms_px
    );
    text
}

#[cfg(test)]
mod tests;
