//! `locoman-calib export`: our rig and board as files of others.

use std::path::PathBuf;

use anyhow::Context;
use locoman_calib::board::Board;
use locoman_calib::exchange::{kalibr, ros};
use locoman_calib::file::write_whole;
use locoman_vision::rig::Rig;

/// Arguments of `export`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The rig file.
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Whose format.
    #[arg(long, value_enum)]
    format: Format,
    /// Folder for the files; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A board file, to be written as Kalibr's target.
    #[arg(long, value_name = "FILE")]
    board: Option<PathBuf>,
}

/// Formats that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// `camchain.yaml`, and `target.yaml` if a board is given.
    Kalibr,
    /// `CAMERA.yaml` for each camera, without poses.
    Ros,
}

/// Writes the files and names them on stdout.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let rig = Rig::load(&args.rig)?;
    let mut files: Vec<(String, String)> = match args.format {
        Format::Kalibr => vec![("camchain.yaml".to_owned(), kalibr::write_camchain(&rig.cameras)?)],
        Format::Ros => {
            rig.cameras.iter().map(|camera| (format!("{}.yaml", camera.id), ros::write(camera))).collect()
        }
    };
    if let Some(board) = &args.board {
        files.push(("target.yaml".to_owned(), kalibr::write_target(&Board::load(board)?)));
    }
    for (name, text) in files {
        let path = args.out.join(name);
        write_whole(&path, &text).with_context(|| format!("cannot write {}; check --out", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}
