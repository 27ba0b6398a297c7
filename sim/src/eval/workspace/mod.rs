//! `workspace`: how much more the arms reach than the feet, by the paper's method.
//!
//! The paper samples each joint uniformly within its limits, leaves out configurations with self-collision, and
//! takes the volume that the end effector reaches: the foot of the bare robot, the gripper of this one. It does not
//! say what "volume" is, whether the torso moves, or what its three modes are to each other. So several definitions
//! are computed side by side, and the one that comes nearest to the paper's six volumes is named: found, not fitted.
//!
//! * **single**: the right limb. **both**: right and left in one space (the left is the right's mirror image).
//!   **combined**: both sides, with the torso level on its legs, and upright on its hind legs.
//! * **torso fixed**, or **moving** within the range of `limits.toml` for manipulation on three legs.
//! * **hull**: convex hull of all points. **voxels**: cubes of 4 cm (2 cm) that hold a point.
//!
//! Self-collision: the capsules of `collision.toml` overlap. The other limbs stand, their arms folded.

mod definition;
mod hull;
mod picture;
mod sample;

use std::path::Path;

use anyhow::Context;
use locoman_robot::{control::RobotConfig, joints::JointVector, model::Model};

use super::{Figure, Must, Report};
use definition::{Measure, Mode, PAPER, Space};
use hull::Hull;
use sample::{Cloud, Effector, Torso};

/// Samples of each cloud: as many as two independent computations took (150,000; 120,000 to 250,000), whose
/// ratios of 1.99 and 1.98 stand beside the paper's. The paper does not give its number.
const SAMPLES: usize = 150_000;
/// To see how the hull grows with the number of samples: in the gripper's five effective joints extremes are rare.
const MANY_SAMPLES: usize = 1_000_000;
/// The paper's ratio of the two single-limb volumes: 1 + 99.01 %.
const PAPER_RATIO: f64 = 1.9901;
const SOURCE: &str = "paper, workspace analysis";

/// Volumes of foot and gripper in one definition, m³.
struct Row {
    mode: Mode,
    torso: &'static str,
    measure: Measure,
    volume: [f64; 2],
}

impl Row {
    fn name(&self) -> String {
        format!("{}.{}.{}", self.mode.name(), self.torso, self.measure.name())
    }

    fn ratio(&self) -> f64 {
        self.volume[1] / self.volume[0]
    }
}

/// Runs the experiment; draws both workspaces to `plot`.
pub fn run(configs: &Path, seed: u64, plot: Option<&Path>) -> anyhow::Result<Report> {
    let config = RobotConfig::load(configs)?;
    let (model, poses) = (&config.model, &config.control.poses);
    let upright = definition::upright(model, poses);
    let (mut rows, mut rejected, mut drawn) = (Vec::new(), [0.0; 2], Vec::new());
    for torso in [Torso::Fixed, Torso::Moving(config.limits.gripper_torso)] {
        let clouds =
            Effector::ALL.map(|effector| Cloud::sample(model, poses, effector, &torso, SAMPLES, seed));
        if torso == Torso::Fixed {
            rejected = [clouds[0].rejected, clouds[1].rejected];
        }
        for mode in Mode::ALL {
            let spaces = [&clouds[0], &clouds[1]].map(|cloud| Space::new(mode, cloud, &upright));
            for measure in Measure::ALL {
                let volume = [spaces[0].volume(measure), spaces[1].volume(measure)];
                rows.push(Row { mode, torso: torso.name(), measure, volume });
            }
            if torso == Torso::Fixed && mode != Mode::Combined {
                drawn.push(spaces.map(|space| Hull::of(space.points())));
            }
        }
    }
    let many = Effector::ALL.map(|effector| {
        let cloud = Cloud::sample(model, poses, effector, &Torso::Fixed, MANY_SAMPLES, seed);
        Hull::of(&cloud.points).volume()
    });
    if let Some(path) = plot {
        draw(path, model, &sample::standing(poses), &drawn)?;
    }
    Ok(report(&rows, rejected, many, seed))
}

fn draw(path: &Path, model: &Model, joints: &JointVector, hulls: &[[Hull; 2]]) -> anyhow::Result<()> {
    picture::draw(path, model, joints, hulls).with_context(|| format!("cannot draw {}", path.display()))?;
    tracing::info!("workspaces in space: {}", path.display());
    Ok(())
}

fn report(rows: &[Row], rejected: [f64; 2], many: [f64; 2], seed: u64) -> Report {
    let mut report = Report::new("workspace", seed);
    for row in rows {
        let (name, paper) = (row.name(), row.mode.paper());
        for (effector, (volume, of_paper)) in Effector::ALL.into_iter().zip(row.volume.into_iter().zip(paper))
        {
            let figure = Figure::new(format!("{name}.{}", effector.name()), volume, "m3");
            report.push(figure.reference(of_paper, SOURCE));
        }
        let ratio = Figure::new(format!("{name}.ratio"), row.ratio(), "");
        report.push(ratio.reference((1e4 * row.mode.paper_ratio()).round() / 1e4, SOURCE));
    }
    for (effector, share) in Effector::ALL.into_iter().zip(rejected) {
        report.push(Figure::new(format!("self_collision.{}", effector.name()), share, ""));
    }
    for (effector, volume) in Effector::ALL.into_iter().zip(many) {
        let name = format!("single.torso_fixed.hull_of_1000000.{}", effector.name());
        report.push(Figure::new(name, volume, "m3"));
    }
    let single = rows.iter().find(|row| row.mode == Mode::Single && row.measure == Measure::Hull);
    let ratio = single.map_or(f64::NAN, Row::ratio);
    let error = (ratio / PAPER_RATIO - 1.0).abs();
    report.push(Figure::new("single.ratio_error", error, "").must(Must::AtMost(0.02)));
    let by_volume = nearest(rows, |row| {
        let paper = row.mode.paper();
        (0..2).map(|i| (row.volume[i] / paper[i]).ln().abs()).sum::<f64>() / 2.0
    });
    let by_ratio = nearest(rows, |row| (row.ratio() / row.mode.paper_ratio()).ln().abs());
    report.table = Some(table(rows, rejected, many, error, [("volumes", by_volume), ("ratios", by_ratio)]));
    report
}

/// A choice of torso motion and measure, and how far its figures are from the paper's.
struct Nearest {
    torso: &'static str,
    measure: Measure,
    /// Mean of |ln(ours / paper's)|.
    distance: f64,
}

/// The definition whose rows are nearest to the paper's in the mean of the three modes.
fn nearest(rows: &[Row], distance: impl Fn(&Row) -> f64) -> Option<Nearest> {
    let definitions = rows.iter().map(|row| {
        let alike = rows.iter().filter(|other| other.torso == row.torso && other.measure == row.measure);
        let distance = alike.map(&distance).sum::<f64>() / PAPER.len() as f64;
        Nearest { torso: row.torso, measure: row.measure, distance }
    });
    definitions.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// What people see.
fn table(
    rows: &[Row],
    rejected: [f64; 2],
    [foot_of_many, gripper_of_many]: [f64; 2],
    error: f64,
    nearest: [(&str, Option<Nearest>); 2],
) -> String {
    use std::fmt::Write;
    let mut text = String::from(
        "  Volume that the foot of the bare robot and the gripper reach, m3. Joints uniform in the model's ranges,\n  \
         self-collision (capsules of collision.toml, other limbs standing, arms folded) left out.\n  \
         single: right limb; both: right and left; combined: both, torso level and upright on the hind legs.\n\n",
    );
    let _ = writeln!(
        text,
        "  {:9} {:13} {:11} {:>7} {:>9} {:>7}",
        "mode", "torso", "measure", "foot", "gripper", "ratio"
    );
    for mode in Mode::ALL {
        let [foot, gripper] = mode.paper();
        let ratio = mode.paper_ratio();
        let _ = writeln!(text, "  {:9} {:25} {foot:>7.3} {gripper:>9.3} {ratio:>7.3}", mode.name(), "paper");
        for row in rows.iter().filter(|row| row.mode == mode) {
            let [foot, gripper] = row.volume;
            let _ = writeln!(
                text,
                "  {:9} {:13} {:11} {foot:>7.3} {gripper:>9.3} {:>7.3}",
                "",
                row.torso.trim_start_matches("torso_"),
                row.measure.name(),
                row.ratio()
            );
        }
    }
    let [foot, gripper] = rejected.map(|share| 100.0 * share);
    let _ = writeln!(
        text,
        "\n  left out for self-collision: foot {foot:.1} %, gripper {gripper:.1} % of {SAMPLES} samples"
    );
    let verdict = if error <= 0.02 { "met" } else { "MISSED" };
    let _ = writeln!(
        text,
        "  single-arm ratio (torso fixed, hull) against the paper's {PAPER_RATIO}: off by {:.1} %, must be <= 2 %: {verdict}",
        100.0 * error
    );
    let _ = writeln!(
        text,
        "  the hull grows with the number of samples: of {MANY_SAMPLES} foot {foot_of_many:.3}, gripper \
         {gripper_of_many:.3}, ratio {:.3}",
        gripper_of_many / foot_of_many
    );
    for (what, nearest) in nearest {
        let Some(Nearest { torso, measure, distance }) = nearest else { continue };
        let _ = writeln!(
            text,
            "  nearest to the paper's {what}: torso {}, {} (off by {:.0} % in the mean)",
            torso.trim_start_matches("torso_"),
            measure.name(),
            100.0 * (distance.exp() - 1.0)
        );
    }
    text
}

#[cfg(test)]
mod tests;
