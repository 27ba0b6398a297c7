//! `locoman-calib intrinsics`: a camera from pictures of a board, or a rig's cameras from a recording.

use std::path::{Path, PathBuf};

use anyhow::Context;
use locoman_calib::board::Board;
use locoman_calib::bundle::Part;
use locoman_calib::chessboard::Chessboard;
use locoman_calib::file::write_whole;
use locoman_calib::intrinsics::{Calibration, Model, Settings, View, calibrate, parameters, plot, verdict};
use locoman_calib::{reading, toml_out};
use locoman_vision::image::GrayImage;
use locoman_vision::rig::Rig;

use super::{or_default, progress};

/// Arguments of `intrinsics`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A folder of pictures (one camera), or a recording (with `--rig`, which names its cameras).
    #[arg(value_name = "IMAGES|REC")]
    input: PathBuf,
    /// The rig file: its cameras' names, sizes and places; with a recording.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// The camera: its name in the rig file that is written.
    #[arg(long, value_name = "ID", default_value = "camera")]
    camera: String,
    /// The board file; by default `calib/print.toml` of the configs folder.
    #[arg(long, value_name = "FILE")]
    board: Option<PathBuf>,
    /// A chessboard instead: inner corners and side of a square in millimetres, as 9x6x25.
    #[arg(long, value_name = "CxRxMM", value_parser = chessboard)]
    chessboard: Option<Chessboard>,
    /// The lens model.
    #[arg(long, value_enum, default_value = "radtan5")]
    model: Model,
    /// Of a recording, every so many images of each camera.
    #[arg(long, value_name = "N", default_value_t = 5)]
    stride: usize,
    /// Views that are used at most.
    #[arg(long, value_name = "N", default_value_t = 60)]
    views: usize,
    /// The rig file to write; a plot of each camera goes beside it.
    #[arg(short, long, value_name = "FILE", default_value = "rig.toml")]
    output: PathBuf,
}

fn chessboard(text: &str) -> Result<Chessboard, String> {
    let numbers: Vec<&str> = text.split('x').collect();
    let wrong = || format!("`{text}` is no chessboard: write inner corners and millimetres as 9x6x25");
    let [columns, rows, side_mm] = numbers[..] else { return Err(wrong()) };
    let (Ok(columns), Ok(rows), Ok(side_mm)) = (columns.parse(), rows.parse(), side_mm.parse::<f64>()) else {
        return Err(wrong());
    };
    if columns < 3 || rows < 3 || !(side_mm > 0.0 && side_mm.is_finite()) {
        return Err(wrong());
    }
    Ok(Chessboard { columns, rows, square_m: 1e-3 * side_mm })
}

/// Calibrates, prints the verdict, writes rig file and plots.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    match &args.rig {
        Some(rig) => recording(args, rig, configs),
        None => pictures(args, configs),
    }
}

fn pictures(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let pictures = load(&args.input)?;
    let (views, target) = match &args.chessboard {
        Some(board) => {
            let mut views = Vec::new();
            for (name, image) in &pictures {
                views.extend(board.find(name, image)?);
            }
            (views, board.parts())
        }
        None => {
            let body = board(args, configs)?.to_shell();
            (reading::read_pictures(&pictures, &body)?, Part::tags_of(&body))
        }
    };
    let (width, height) = pictures.first().map_or((0, 0), |(_, image)| (image.width(), image.height()));
    let calibration = one(args, &args.camera, (width, height), &views, &target)?;
    let rig = Rig::new(vec![calibration.camera.clone()]);
    write(args, &rig, &[calibration])
}

fn recording(args: &Args, rig: &Path, configs: &Path) -> anyhow::Result<()> {
    let mut rig = Rig::load(rig)?;
    let body = board(args, configs)?.to_shell();
    let bar = progress("images");
    let seen = reading::read_recording(&args.input, &rig, &body, args.stride, &mut |done| {
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let target = Part::tags_of(&body);
    let mut calibrations = Vec::new();
    for (k, camera) in rig.cameras.iter_mut().enumerate() {
        let views = reading::views(&seen, k);
        let calibration = one(args, &camera.id, (camera.width, camera.height), &views, &target)
            .with_context(|| format!("camera `{}`", camera.id))?;
        camera.focal_px = calibration.camera.focal_px;
        camera.center_px = calibration.camera.center_px;
        camera.distortion = calibration.camera.distortion.clone();
        calibrations.push(calibration);
    }
    write(args, &rig, &calibrations)
}

fn board(args: &Args, configs: &Path) -> anyhow::Result<Board> {
    Ok(Board::load(&or_default(args.board.as_deref(), configs, "calib/print.toml"))?)
}

/// The pictures of a folder, by name.
fn load(folder: &Path) -> anyhow::Result<Vec<(String, GrayImage)>> {
    let entries = std::fs::read_dir(folder).with_context(|| {
        format!(
            "cannot list {}\n  hint: give a folder of pictures, or a recording with --rig",
            folder.display()
        )
    })?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|file| {
        let extension = file.extension().and_then(|extension| extension.to_str()).map(str::to_lowercase);
        matches!(extension.as_deref(), Some("png" | "jpg" | "jpeg"))
    });
    files.sort();
    let mut pictures: Vec<(String, GrayImage)> = Vec::new();
    for file in files {
        let bytes = std::fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
        let image = GrayImage::decode(&bytes).with_context(|| format!("{}", file.display()))?;
        if let Some((first, known)) = pictures.first() {
            anyhow::ensure!(
                (known.width(), known.height()) == (image.width(), image.height()),
                "{} has {}x{} pixels, {first} has {}x{}\n  hint: pictures of one camera, at one resolution",
                file.display(),
                image.width(),
                image.height(),
                known.width(),
                known.height()
            );
        }
        pictures.push((file.display().to_string(), image));
    }
    anyhow::ensure!(!pictures.is_empty(), "{} holds no picture\n  hint: .png or .jpg", folder.display());
    Ok(pictures)
}

fn one(
    args: &Args,
    id: &str,
    (width, height): (u32, u32),
    views: &[View],
    target: &[Part],
) -> anyhow::Result<Calibration> {
    let settings = Settings { id: id.to_owned(), width, height, model: args.model, most_views: args.views };
    let calibration = calibrate(views, target, &settings)?;
    println!("{id}");
    for (name, value, sigma) in parameters(&calibration) {
        println!("  {name} {value:12.5} ± {sigma:.5}");
    }
    for view in &calibration.views {
        let name = views.get(view.view).map_or("", |view| view.name.as_str());
        println!("  {:.3} px RMS, {} set aside: {name}", view.rms_px, view.outliers);
    }
    println!("{}", verdict(&calibration));
    let picture = args.output.with_file_name(format!("{id}.svg"));
    plot::draw(&picture, &calibration, views, target)?;
    println!("plot: {}", picture.display());
    Ok(calibration)
}

fn write(args: &Args, rig: &Rig, calibrations: &[Calibration]) -> anyhow::Result<()> {
    let mut comment =
        String::from("Intrinsics by `locoman-calib intrinsics`; places by `locoman-calib extrinsics`.\n");
    for calibration in calibrations {
        comment += &format!("{}: {}", calibration.camera.id, verdict(calibration));
    }
    write_whole(&args.output, &toml_out::rig_text(rig, &comment))
        .with_context(|| format!("cannot write {}", args.output.display()))?;
    println!("rig file: {}", args.output.display());
    Ok(())
}
