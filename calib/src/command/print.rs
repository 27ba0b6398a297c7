//! `locoman-calib print`: boards, tag sheets and shells as files to print.

use std::path::{Path, PathBuf};

use anyhow::Context;
use locoman_calib::file::write_bytes_whole;
use locoman_calib::print::drawing::{Drawing, Page};
use locoman_calib::print::spec::Spec;
use locoman_calib::print::{boards, net, pdf, sheets, solid, svg};
use locoman_vision::shells::design;

use super::or_default;

/// Arguments of `print`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What to print.
    #[arg(value_enum)]
    what: What,
    /// Folder for the files; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The dimensions; by default `calib/print.toml` of the configs folder.
    #[arg(long, value_name = "FILE")]
    spec: Option<PathBuf>,
}

/// What can be printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum What {
    /// An AprilTag grid and a checkerboard with tags, and the grid's board file.
    Board,
    /// Tags to cut out and glue on shells.
    Sheets,
    /// Shells as STL for 3D printers and as nets to fold from paper, and their shells file.
    Shells,
}

/// Writes the files and names them on stdout.
pub fn run(args: &Args, configs: &Path) -> anyhow::Result<()> {
    let spec = Spec::load(&or_default(args.spec.as_deref(), configs, "calib/print.toml"))?;
    let set = design::draw(&spec.dimensions());
    let out = args.out.as_path();
    match args.what {
        What::Board => {
            write_pages(out, "board", &[boards::grid(&spec.board, &spec.paper)?])?;
            write_pages(out, "checkerboard", &[boards::checkerboard(&spec.checkerboard, &spec.paper)?])?;
            write(out, "board.toml", boards::board_file(&spec.board))
        }
        What::Sheets => {
            for shell in &set.shells {
                write_pages(out, &format!("{}_tags", shell.name), &sheets::pages(shell, &spec.paper)?)?;
            }
            Ok(())
        }
        What::Shells => {
            for shell in &set.shells {
                write(out, &format!("{}.stl", shell.name), solid::solid(shell, &spec)?.to_stl())?;
                write_pages(out, &format!("{}_net", shell.name), &net::pages(shell, &spec)?)?;
            }
            write(out, "shells.toml", design::to_toml(&set))
        }
    }
}

/// One PDF of all pages, and an SVG of each.
fn write_pages(out: &Path, name: &str, pages: &[Page]) -> anyhow::Result<()> {
    for (number, page) in (1..).zip(pages) {
        let suffix = if pages.len() == 1 { String::new() } else { format!("_{number}") };
        write(out, &format!("{name}{suffix}.svg"), svg::to_svg(&page.drawing))?;
    }
    let drawings: Vec<Drawing> = pages.iter().map(|page| page.drawing.clone()).collect();
    write(out, &format!("{name}.pdf"), pdf::to_pdf(&drawings))
}

fn write(out: &Path, name: &str, contents: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let path = out.join(name);
    write_bytes_whole(&path, contents.as_ref())
        .with_context(|| format!("cannot write {}; check --out and its permissions", path.display()))?;
    println!("{}", path.display());
    Ok(())
}
