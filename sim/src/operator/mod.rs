//! The operator's side without cameras: images of tag shells along a scripted motion, with the truth.
//!
//! ```text
//! scene file ─► motion, event ─► stage ─► course ─► view (shells, limbs) ─► render ─► sensor ─► encode ─► output
//! rig file ───► shutter (rows), lens (rays), room ───────────────────┘
//! shells file ► solid ─► ink
//! ```

pub mod body;
pub mod course;
pub mod encode;
pub mod event;
pub mod ink;
pub mod lens;
pub mod motion;
pub mod output;
pub mod render;
pub mod room;
pub mod scene;
pub mod schedule;
pub mod sensor;
pub mod shutter;
pub mod sight;
pub mod solid;
pub mod stage;
pub mod studio;
pub mod view;
pub mod wander;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant as Clock;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use locoman_vision::rig::Rig;
use locoman_vision::shells::ShellSet;
use rayon::prelude::*;

use motion::Body;
use output::{Folder, Image, Instant, Output, Recording, TruthFile};
use scene::Scene;
use schedule::Moment;
use studio::Studio;

pub use schedule::{FIRST_CAPTURE_NS, Schedule};

/// Arguments of `locoman-sim operator`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Recording (MCAP) to write: images and truth.
    #[arg(short, long, value_name = "REC.mcap", required_unless_present = "folder")]
    pub output: Option<PathBuf>,
    /// Also write (or only write) images in the EuRoC layout: `CAMERA/data/T_NS.png`.
    #[arg(long, value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// Also write the truth as poses CSV.
    #[arg(long, value_name = "CSV")]
    pub truth: Option<PathBuf>,
    /// Length in seconds; the scene's own period loops without a seam.
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
    /// Images a second of each camera.
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    pub rate: f64,
    /// Cameras and where they stand; default: `rigs/two_zed_pairs.toml` in the configs folder.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
    /// What the operator wears; default: `shells/standard.toml` in the configs folder.
    #[arg(long, value_name = "FILE")]
    pub shells: Option<PathBuf>,
    /// Motion, light and sensor; default: `scenes/operator.toml` in the configs folder.
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Seed of noise and textures.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// Instants that are rendered before any is written: enough to keep many cores busy, few to hold.
const BATCH: usize = 8;

/// The files that a rendering is made from.
#[derive(Debug)]
pub struct Inputs {
    /// The cameras.
    pub rig: PathBuf,
    /// The shells.
    pub shells: PathBuf,
    /// Motion, light and sensor.
    pub scene: PathBuf,
}

impl Inputs {
    /// The default files in a folder of configurations.
    pub fn standard(configs: &Path) -> Self {
        Self {
            rig: configs.join("rigs/two_zed_pairs.toml"),
            shells: configs.join("shells/standard.toml"),
            scene: configs.join("scenes/operator.toml"),
        }
    }

    /// Reads them, and prepares the studio.
    pub fn studio(&self, seed: u64) -> anyhow::Result<Studio> {
        let rig = Rig::load(&self.rig)?;
        let shells = ShellSet::load(&self.shells)?;
        let scene = Scene::read(&self.scene)?;
        Studio::new(&rig, &shells, scene, seed)
            .with_context(|| format!("cannot render the shells of {}", self.shells.display()))
    }
}

/// Runs `locoman-sim operator`.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let standard = Inputs::standard(configs);
    let inputs = Inputs {
        rig: args.rig.clone().unwrap_or(standard.rig),
        shells: args.shells.clone().unwrap_or(standard.shells),
        scene: args.scene.clone().unwrap_or(standard.scene),
    };
    let studio = inputs.studio(args.seed)?;
    let seconds = args.seconds.unwrap_or(studio.scene().motion.period_s);
    let schedule = Schedule::new(seconds, args.rate)?;
    report_paces(&studio, seconds);

    let mut outputs: Vec<Box<dyn Output>> = Vec::new();
    if let Some(path) = &args.output {
        outputs.push(Box::new(create_recording(path, &inputs, &studio)?));
    }
    if let Some(path) = &args.folder {
        outputs.push(Box::new(Folder::create(path, studio.cameras().map(|camera| camera.id.as_str()))?));
    }
    if let Some(path) = &args.truth {
        outputs.push(Box::new(TruthFile::create(path)?));
    }
    let formats = Formats { jpeg: args.output.is_some(), png: args.folder.is_some() };

    let started = Clock::now();
    render_to(&studio, schedule, formats, &mut outputs)?;
    for output in outputs {
        output.finish()?;
    }
    let images = schedule.count * studio.cameras().len() as u64;
    let elapsed_s = started.elapsed().as_secs_f64();
    tracing::info!("{images} images in {elapsed_s:.1} s, {:.1} ms each", 1e3 * elapsed_s / images as f64);
    Ok(())
}

/// Begins a recording that carries the files it was made from.
pub fn create_recording(path: &Path, inputs: &Inputs, studio: &Studio) -> anyhow::Result<Recording> {
    let read =
        |path: &Path| fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()));
    let (rig, shells, scene) = (read(&inputs.rig)?, read(&inputs.shells)?, read(&inputs.scene)?);
    let attachments =
        [("rig.toml", rig.as_str()), ("shells.toml", shells.as_str()), ("scene.toml", scene.as_str())];
    Recording::create(path, &attachments, studio.cameras())
}

/// Which encodings the outputs need.
#[derive(Debug, Clone, Copy)]
pub struct Formats {
    /// For recordings.
    pub jpeg: bool,
    /// For folders.
    pub png: bool,
}

/// Renders all pictures, on all cores, and hands them to the outputs in the order of time.
pub fn render_to(
    studio: &Studio,
    schedule: Schedule,
    formats: Formats,
    outputs: &mut [Box<dyn Output>],
) -> anyhow::Result<()> {
    let bodies: Vec<Body> = studio.solids().iter().map(|solid| solid.body).collect();
    let cameras: Vec<&str> = studio.cameras().map(|camera| camera.id.as_str()).collect();
    let moments = schedule.moments(studio);
    let progress = progress_bar(moments.len() as u64);
    for (batch, moments) in moments.chunks(BATCH).enumerate() {
        let pictures: Vec<(&Moment, usize)> = moments
            .iter()
            .flat_map(|moment| moment.cameras.iter().map(move |camera| (moment, *camera)))
            .collect();
        let mut images = pictures
            .into_par_iter()
            .map(|(moment, camera)| -> anyhow::Result<Image<'_>> {
                let picture = studio.picture(camera, moment.time_s, moment.frame);
                Ok(Image {
                    camera: cameras[camera],
                    jpeg: formats.jpeg.then(|| encode::jpeg(&picture)).transpose()?,
                    png: formats.png.then(|| encode::png(&picture)).transpose()?,
                })
            })
            .collect::<anyhow::Result<Vec<_>>>()?
            .into_iter();
        for (i, moment) in moments.iter().enumerate() {
            let instant = Instant {
                capture_ns: moment.capture_ns,
                number: (batch * BATCH + i) as u64,
                posture: studio.true_posture(moment.time_s),
                bodies: &bodies,
                images: images.by_ref().take(moment.cameras.len()).collect(),
            };
            for output in outputs.iter_mut() {
                output.add(&instant)?;
            }
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    Ok(())
}

/// Says how fast each shell moves.
fn report_paces(studio: &Studio, seconds: f64) {
    for solid in studio.solids() {
        let pace = studio.scene().motion.pace(solid.body, 0.0, seconds);
        tracing::info!(
            "{}: at most {:.2} m/s, {:.0} deg/s, {:.1} m/s2; RMS {:.2} m/s, {:.0} deg/s",
            solid.body.name(),
            pace.peak_m_s,
            pace.peak_rad_s.to_degrees(),
            pace.peak_m_s2,
            pace.rms_m_s,
            pace.rms_rad_s.to_degrees()
        );
    }
}

/// Draws on a terminal only.
fn progress_bar(instants: u64) -> ProgressBar {
    let bar = ProgressBar::new(instants);
    let template = "rendering the operator {bar:40} {pos}/{len} instants, {eta} left";
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
