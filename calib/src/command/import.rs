//! `locoman-calib import`: a rig or board file from a calibration of somebody else.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use locoman_calib::exchange::{Foreign, kalibr, opencv_yaml, ros, zed};
use locoman_calib::file::write_whole;
use locoman_calib::print::boards::board_file;
use locoman_vision::camera::Camera;
use locoman_vision::rig::{Calibration, Rig};

/// Arguments of `import`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// ZED factory file (SN*.conf), Kalibr camchain or target, OpenCV YAML, ROS `camera_info`; its content tells which.
    /// Several ROS files make one rig.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The rig file to write (the board file, from a Kalibr target).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Which mode of a ZED factory file: 2K, FHD, HD, VGA, FHD1200, SVGA, 4K, QHDPLUS.
    #[arg(long, value_name = "MODE", default_value = "HD")]
    mode: String,
    /// Size of the images, for files that do not tell it.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = parse_size)]
    size: Option<[u32; 2]>,
}

/// Reads, writes, and says on stdout what was read.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let sources = args.files.iter().map(|path| Foreign::read(path)).collect::<Result<Vec<_>, _>>()?;
    let Some(first) = sources.first() else { bail!("no file; name at least one") };
    if first.text.contains("tagCols") {
        let board = kalibr::read_target(first)?;
        return write(&args.out, &board_file(&board));
    }
    let mut serial = None;
    let mut cameras: Vec<Camera> = if first.text.contains("[LEFT_CAM_") {
        serial = first.path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        zed_pair(first, &args.mode)?
    } else if first.text.contains("camera_model:") && first.text.contains("intrinsics:") {
        kalibr::read_camchain(first)?
    } else if first.text.contains("image_width:") && !first.text.contains("opencv-matrix") {
        sources.iter().map(ros::read).collect::<Result<_, _>>()?
    } else if first.text.contains("opencv-matrix") {
        opencv_yaml::read(first, args.size)?
    } else {
        bail!(
            "{}: no format that we know\n  hint: ZED factory file, Kalibr camchain or target, OpenCV YAML, or ROS \
             camera_info",
            first.path.display()
        );
    };
    for camera in &mut cameras {
        // Ids name folders and topics here.
        camera.id =
            camera.id.replace(|letter: char| !letter.is_ascii_alphanumeric() && !"_-".contains(letter), "_");
        println!("{}: {}x{} px", camera.id, camera.width, camera.height);
    }
    let mut rig = Rig::new(cameras);
    rig.serials.fill(serial);
    rig.calibration = Some(Calibration::default());
    write(&args.out, &rig.to_toml())?;
    // What was written has to be readable: two cameras of one name, for instance, are not.
    Rig::load(&args.out)?;
    Ok(())
}

fn zed_pair(source: &Foreign, mode: &str) -> anyhow::Result<Vec<Camera>> {
    let pairs = zed::read(source)?;
    let modes: Vec<&str> = pairs.iter().map(|pair| pair.mode).collect();
    match pairs.iter().find(|pair| pair.mode.eq_ignore_ascii_case(mode)) {
        Some(pair) => Ok(vec![pair.left.clone(), pair.right.clone()]),
        None => bail!("{} has no mode {mode}\n  hint: --mode {}", source.path.display(), modes.join(" or ")),
    }
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    write_whole(path, text).with_context(|| format!("cannot write {}; check --out", path.display()))?;
    println!("{}", path.display());
    Ok(())
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed =
        text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    parsed.ok_or_else(|| format!("`{text}` is no size; write it as 1280x720"))
}
