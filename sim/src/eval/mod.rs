//! Evaluations: each runs one reproducible experiment and reports its figures.
//!
//! To add one: a module with `run`, and a variant of [`Experiment`].

pub mod bimanual;
pub mod body;
pub mod calibration;
pub mod demo;
pub mod drive;
pub mod faults;
pub mod latency;
pub mod lockstep;
pub mod loco_manipulation;
pub mod modes;
pub mod punctuality;
pub mod report;
pub mod robustness;
pub mod statistics;
pub mod tracking;
pub mod vision;
pub mod walking;
pub mod wire;
pub mod workspace;

use std::path::{Path, PathBuf};

pub use report::{Figure, Must, Report};

/// Arguments of `locoman-sim eval`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which experiment.
    #[command(subcommand)]
    pub experiment: Experiment,
    /// Where to write the report; its plots go beside it.
    #[arg(long, value_name = "FILE", global = true)]
    pub json: Option<PathBuf>,
    /// Seed of everything random in it.
    #[arg(long, default_value_t = 1, global = true)]
    pub seed: u64,
}

/// The experiments.
#[derive(Debug, Clone, PartialEq, clap::Subcommand)]
pub enum Experiment {
    /// Poses from rendered images against the truth.
    Vision(vision::Args),
    /// Lenses, rigs and shells found from scratch, against the truth; real pictures beside OpenCV and TagSLAM.
    Calibration(calibration::Args),
    /// From images in memory to poses published, by the station's threads in real time.
    Latency(latency::Args),
    /// A recorded session of the demo: following, latency, control period.
    Demo {
        /// What the station recorded.
        #[arg(long, value_name = "SESSION")]
        recording: PathBuf,
    },
    /// Bad lines, failing motors, an empty battery, killed programs: the robot's reactions and their times.
    Faults(faults::Args),
    /// How punctually a real-time loop with the controller in it wakes up on this machine.
    Loop(punctuality::Args),
    /// The paper's tracking tasks and its square, against the estimator and against the truth.
    Tracking(tracking::Args),
    /// Unreachable and singular targets, pushes, loads, slippery feet, lost commands: does it fall or shake?
    Robustness(robustness::Args),
    /// A gripper that points somewhere while the robot trots.
    LocoManipulation(loco_manipulation::Args),
    /// From every mode to every other.
    Modes(modes::Args),
    /// Sitting up, working with both grippers, being pushed, coming down.
    Bimanual(bimanual::Args),
    /// Walking: pace, pushes, rough ground.
    Walking(walking::Args),
    /// The robot's program over the real robot's datagrams, beside the same motion in lockstep.
    Wire(wire::Args),
    /// How much more the arms reach than the feet: the paper's table, in several definitions.
    Workspace,
}

/// Runs `locoman-sim eval`.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let plot = args.json.as_ref().map(|json| json.with_extension("svg"));
    let report = match &args.experiment {
        Experiment::Vision(of) => vision::run(configs, of, args.seed, plot.as_deref())?,
        Experiment::Calibration(of) => calibration::run(of, args.seed)?,
        Experiment::Latency(of) => latency::run(configs, *of, args.seed)?,
        Experiment::Demo { recording } => demo::run(recording, args.seed)?,
        Experiment::Faults(of) => faults::run(configs, *of, args.seed)?,
        Experiment::Wire(of) => wire::run(configs, *of, args.seed)?,
        Experiment::Loop(of) => punctuality::run(configs, *of, args.seed)?,
        Experiment::Robustness(of) => robustness::run(configs, of, args.seed, plot.as_deref())?,
        Experiment::LocoManipulation(of) => loco_manipulation::run(configs, of, args.seed, plot.as_deref())?,
        Experiment::Modes(of) => modes::run(configs, of, args.seed)?,
        Experiment::Bimanual(of) => bimanual::run(configs, of, args.seed, plot.as_deref())?,
        Experiment::Walking(of) => walking::run(configs, of, args.seed)?,
        Experiment::Workspace => workspace::run(configs, args.seed, plot.as_deref())?,
        Experiment::Tracking(of) => tracking::run(configs, of, args.seed, plot.as_deref())?,
    };
    report.finish(args.json.as_deref())
}
