//! Harm between the eyes and the fusion: tags hidden, misread, exchanged, while the images are good.
//!
//! The eyes follow what the fusion makes of it, as in a station. Each tag in each image is spoiled by chance, anew at every
//! moment. A jump is the change of a pose's error from one measured pose to the next within a tenth of a second: what
//! the hand itself does is not one.

use locoman_vision::track::{CameraUpdate, SeenTag, TrackUpdate, Tracker, Verdict};
use nalgebra::Vector2;

use super::error::PoseError;
use super::film::{Shot, scene_s, truth_at};
use super::stage::Stage;
use super::tally::{ShellTally, Tally};
use crate::eval::{Figure, Must, Report};
use crate::operator::sensor::mix;

/// What happens to tags.
#[derive(Debug, Clone, Copy)]
pub struct Harm {
    /// In figures.
    name: &'static str,
    /// Share of the tags that is taken away;
    hidden: f64,
    /// of what is left, the share of which one corner, or all, are 5 to 40 px off;
    gross: f64,
    /// the share whose ids change places with another tag's in the image;
    swapped: f64,
    /// and the share of the single corners that are 5 to 40 px off.
    corners: f64,
    /// Whether the bounds hold for it.
    bound: bool,
}

const NONE: Harm = Harm { name: "", hidden: 0.0, gross: 0.0, swapped: 0.0, corners: 0.0, bound: true };

/// What is tried.
pub const HARMS: [Harm; 4] = [
    Harm { name: "half_hidden", hidden: 0.5, ..NONE },
    Harm { name: "half_hidden_10_gross_5_swapped", hidden: 0.5, gross: 0.1, swapped: 0.05, ..NONE },
    Harm { name: "20_of_tags_replaced", gross: 0.2, ..NONE },
    // Six of ten tags have a false corner then: more than a rule that leaves out whole tags can bear.
    Harm { name: "20_of_corners_replaced", corners: 0.2, bound: false, ..NONE },
];

/// A tracker whose eyes are lied about.
#[derive(Debug)]
pub struct Trial {
    harm: Harm,
    tracker: Tracker,
    random: u64,
    tally: Tally,
    shells: Vec<Course>,
}

/// What became of one shell.
#[derive(Debug, Clone, Default)]
struct Course {
    last: Option<PoseError>,
    worst_jump_m: f64,
    flips: usize,
    /// Updates that had a tag of it that was not spoiled, those of them in which it was measured, and in which it was lost.
    fed: usize,
    tracked: usize,
    lost: usize,
}

/// The shells of tags that were not spoiled.
type Good = Vec<usize>;

impl Trial {
    /// Nothing was seen yet.
    pub fn new(stage: &Stage, harm: Harm, seed: u64) -> anyhow::Result<Self> {
        let shells = &stage.shells;
        Ok(Self {
            harm,
            tracker: stage.tracker()?,
            random: mix(seed),
            tally: Tally::new(shells),
            shells: vec![Course::default(); shells.shells.len()],
        })
    }

    /// Looks at a moment, and compares what comes of it with the truth.
    pub fn see(&mut self, stage: &Stage, shot: &Shot) {
        /// Scene time until which shells are being found.
        const SETTLED_S: f64 = 2.0;
        let (update, good) = self.update(shot);
        self.tally.add(&stage.studio, shot, &update);
        let truth = truth_at(&stage.studio, update.time_ns);
        let time_s = scene_s(update.time_ns);
        let settled = shot.time_s >= SETTLED_S;
        for (index, (course, found)) in self.shells.iter_mut().zip(&update.shells).enumerate() {
            let Some(body) = self.tally.shells[index].body else { continue };
            if settled && good.contains(&index) {
                course.fed += 1;
                course.lost += usize::from(found.verdict == Verdict::Lost);
                course.tracked += usize::from(found.verdict == Verdict::Tracked);
            }
            if found.verdict == Verdict::Tracked {
                course.add(PoseError::new(time_s, truth.of(body), found), settled);
            }
        }
    }

    /// The update with harm in it; also the shells of all tags that were left as they are.
    fn update(&mut self, shot: &Shot) -> (TrackUpdate, Good) {
        let mut seen = self.tracker.look(&shot.frames);
        let spoil = |camera: &mut CameraUpdate| self.harm.spoil(&mut camera.tags, &mut self.random);
        let good = seen.iter_mut().flat_map(spoil).collect();
        (self.tracker.fuse(seen), good)
    }

    /// What happens to tags.
    pub fn name(&self) -> &'static str {
        self.harm.name
    }

    /// What was tracked.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Adds the figures, over all shells.
    pub fn report(&self, report: &mut Report) {
        let figure = |what: &str, value: f64, unit| {
            Figure::new(format!("outliers.{}.{what}", self.harm.name), value, unit)
        };
        let must = |figure: Figure, must: Must| if self.harm.bound { figure.must(must) } else { figure };
        let sum = |of: fn(&Course) -> usize| self.shells.iter().map(of).sum::<usize>() as f64;
        let worst_m = self.shells.iter().map(|course| course.worst_jump_m).fold(0.0, f64::max);
        report.push(must(figure("worst_jump", 1e3 * worst_m, "mm"), Must::AtMost(2.0)));
        report.push(must(figure("flips", sum(|course| course.flips), ""), Must::AtMost(0.0)));
        report.push(must(figure("lost_while_seen", sum(|course| course.lost), ""), Must::AtMost(0.0)));
        report.push(figure("tracked_of_seen", sum(|course| course.tracked) / sum(|course| course.fed), ""));
        let worst_mm = self.tally.shells.iter().map(ShellTally::position_worst_mm).fold(f64::NAN, f64::max);
        report.push(figure("worst_position", worst_mm, "mm"));
        report.push(figure("wrong_called_tracked", self.tally.wrong() as f64, ""));
    }
}

impl Course {
    fn add(&mut self, error: Option<PoseError>, settled: bool) {
        /// Farther turned than this, it shows another side.
        const FLIP_RAD: f64 = 0.35;
        const NEXT_S: f64 = 0.1;
        let Some(error) = error else { return };
        self.flips += usize::from(error.rotation_rad.norm() > FLIP_RAD);
        if let Some(last) = &self.last
            && settled
            && error.time_s - last.time_s < NEXT_S
        {
            self.worst_jump_m = self.worst_jump_m.max((error.position_m - last.position_m).norm());
        }
        self.last = Some(error);
    }
}

impl Harm {
    /// Spoils tags; gives the shells of those that were left as they are.
    fn spoil(&self, tags: &mut Vec<SeenTag>, random: &mut u64) -> Good {
        let mut draw = || {
            *random = mix(*random);
            (*random >> 11) as f64 / (1u64 << 53) as f64
        };
        tags.retain(|_| draw() >= self.hidden);
        let mut spoiled = vec![false; tags.len()];
        let off = |draw: &mut dyn FnMut() -> f64| {
            let angle = std::f64::consts::TAU * draw();
            Vector2::new(angle.cos(), angle.sin()) * (5.0 + 35.0 * draw())
        };
        for (tag, spoiled) in tags.iter_mut().zip(&mut spoiled) {
            let corners_px = &mut tag.detection.corners_px;
            if draw() < self.gross {
                *spoiled = true;
                let shift = off(&mut draw);
                if draw() < 0.5 {
                    corners_px.iter_mut().for_each(|corner| *corner += shift);
                } else {
                    corners_px[(4.0 * draw()) as usize % 4] += shift;
                }
            }
            for corner in corners_px {
                if draw() < self.corners {
                    *spoiled = true;
                    *corner += off(&mut draw);
                }
            }
        }
        for k in 0..tags.len() {
            let other = (draw() * tags.len() as f64) as usize;
            if draw() < self.swapped && other != k {
                (spoiled[k], spoiled[other]) = (true, true);
                let ids = |tag: &SeenTag| (tag.detection.id, tag.shell, tag.tag);
                let (own, others) = (ids(&tags[k]), ids(&tags[other]));
                for (index, (id, shell, tag)) in [(k, others), (other, own)] {
                    tags[index].detection.id = id;
                    (tags[index].shell, tags[index].tag) = (shell, tag);
                }
            }
        }
        tags.iter().zip(&spoiled).filter(|(_, spoiled)| !**spoiled).map(|(tag, _)| tag.shell).collect()
    }
}

#[cfg(test)]
mod tests {
    use locoman_vision::detect::Detection;
    use nalgebra::Point2;

    use super::*;

    fn tag(id: u32) -> SeenTag {
        let corners_px = [[0.0, 30.0], [30.0, 30.0], [30.0, 0.0], [0.0, 0.0]].map(Point2::from);
        let detection =
            Detection { id, hamming: 0, margin: 80.0, corners_px, decimate: 1.0, covariance_px2: None };
        SeenTag::new(detection, 0, id as usize)
    }

    #[test]
    fn as_many_tags_are_hidden_and_spoiled_as_are_asked_for() {
        let harm = Harm { hidden: 0.5, gross: 0.1, swapped: 0.05, ..NONE };
        let (mut random, mut left, mut good, mut moved) = (1, 0, 0, 0);
        for _ in 0..200 {
            let mut tags: Vec<SeenTag> = (0..20).map(tag).collect();
            good += harm.spoil(&mut tags, &mut random).len();
            left += tags.len();
            moved +=
                tags.iter().filter(|seen| seen.detection.corners_px != tag(0).detection.corners_px).count();
            let mut ids: Vec<u32> = tags.iter().map(|seen| seen.detection.id).collect();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), tags.len(), "ids change places, none is made up");
            assert!(tags.iter().all(|seen| seen.detection.id as usize == seen.tag));
        }
        // 4000 tags: four standard deviations are 126 of 2000, 57 of 200.
        assert!((1874..2126).contains(&left), "{left} left");
        assert!((143..257).contains(&moved), "{moved} moved");
        assert!(good < left - moved && good > 1500, "{good} good");
    }
}
