//! Brings what a fresh Debian or Ubuntu machine lacks: packages, and the MuJoCo library.
//!
//! The library is kept in the user's cache folder; `.mujoco` in the repository links to it, so that
//! `.cargo/config.toml` can name it and plain `cargo build` finds it too. Its path is written into the
//! binaries (`sim/build.rs`).

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::shell;

/// Also named in `mujoco-requirements.txt` and, as the crate's build number, in the root `Cargo.toml`.
const MUJOCO_VERSION: &str = "3.17.0";

/// What the machine is prepared for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Building and running.
    Run,
    /// Tests too: they drive a browser.
    Test,
}

const BUILD_PACKAGES: &[&str] =
    &["build-essential", "clang", "libclang-dev", "libopencv-dev", "libudev-dev", "pkg-config"];
const TEST_PACKAGES: &[&str] = &["chromium"];

/// Installs what is missing, or says exactly what to run.
pub fn ensure(purpose: Purpose) -> Result<()> {
    debian_packages(purpose)?;
    mujoco()
}

fn debian_packages(purpose: Purpose) -> Result<()> {
    let mut wanted = BUILD_PACKAGES.to_vec();
    if purpose == Purpose::Test {
        wanted.extend(TEST_PACKAGES);
    }
    if !succeeds("dpkg-query", &["--version"]) {
        shell::say(&format!(
            "not a Debian or Ubuntu machine: install what corresponds to {} by hand",
            wanted.join(" ")
        ));
        return Ok(());
    }
    let mut missing: Vec<&str> = wanted.into_iter().filter(|package| !installed(package)).collect();
    if !succeeds("python3", &["-m", "pip", "--version"]) && mujoco_missing() {
        missing.push("python3-pip");
    }
    if missing.is_empty() {
        return Ok(());
    }
    install(&missing)
}

fn installed(package: &str) -> bool {
    Command::new("dpkg-query")
        .args(["--show", "--showformat=${db:Status-Status}", package])
        .stderr(Stdio::null())
        .output()
        .is_ok_and(|output| output.stdout == b"installed")
}

fn install(packages: &[&str]) -> Result<()> {
    let by_hand =
        format!("sudo apt-get update && sudo apt-get install --no-install-recommends {}", packages.join(" "));
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout == b"0\n");
    if !is_root {
        if !succeeds("sudo", &["--version"]) {
            bail!("packages are missing and there is no sudo; as root, run:\n  {by_hand}");
        }
        if shell::interactive() && !confirm(&format!("Missing packages. Run\n  {by_hand}\nnow? [y/N] "))? {
            bail!("packages are missing; run:\n  {by_hand}");
        }
    }
    let apt = |args: &[&str]| {
        let mut command = if is_root { Command::new("apt-get") } else { Command::new("sudo") };
        if !is_root {
            // Without a terminal nobody can type a password: fail instead of hanging.
            command.args(if shell::interactive() { &["apt-get"][..] } else { &["-n", "apt-get"] });
        }
        shell::run(command.env("DEBIAN_FRONTEND", "noninteractive").arg("-qq").args(args))
    };
    let mut arguments = vec!["install", "--yes", "--no-install-recommends"];
    arguments.extend(packages);
    shell::say(&format!("installing {}", packages.join(" ")));
    apt(&["update"])
        .and_then(|()| apt(&arguments))
        .with_context(|| format!("could not install packages; run by hand:\n  {by_hand}"))
}

fn mujoco_folder() -> Result<PathBuf> {
    let cache = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(".cache")))
        .context("neither XDG_CACHE_HOME nor HOME is set: no place for the MuJoCo library")?;
    Ok(cache.join("locoman").join(format!("mujoco-{MUJOCO_VERSION}")))
}

fn mujoco_missing() -> bool {
    mujoco_folder().map_or(true, |folder| !folder.join("libmujoco.so").exists())
}

fn mujoco() -> Result<()> {
    let folder = mujoco_folder()?;
    if mujoco_missing() {
        shell::say(&format!("bringing MuJoCo {MUJOCO_VERSION} into {}", folder.display()));
        download_mujoco(&folder).with_context(|| {
            format!(
                "cannot bring the MuJoCo library. On a machine with network, run\n  \
                 python3 -m pip download --no-deps --only-binary=:all: --python-version 3.11 mujoco=={MUJOCO_VERSION}\n\
                 and unpack mujoco/libmujoco.so.{MUJOCO_VERSION} of the wheel into {},\n\
                 with a link libmujoco.so to it",
                folder.display()
            )
        })?;
    }
    let link = Path::new(".mujoco");
    if std::fs::read_link(link).ok().as_deref() != Some(&folder) {
        // Absent, or pointing to another version.
        let _ = std::fs::remove_file(link);
        std::os::unix::fs::symlink(&folder, link).context("cannot link .mujoco to the library")?;
    }
    Ok(())
}

/// Unpacks into a folder beside and renames it: an interrupted download leaves nothing that looks done.
fn download_mujoco(folder: &Path) -> Result<()> {
    let work = folder.with_extension("partial");
    let _ = std::fs::remove_dir_all(&work);
    std::fs::create_dir_all(&work)?;
    let platform = format!("manylinux_2_28_{}", std::env::consts::ARCH);
    shell::run(
        Command::new("python3")
            .args(["-m", "pip", "--quiet", "--disable-pip-version-check", "download", "--no-deps"])
            .args(["--only-binary=:all:", "--python-version", "3.11", "--platform", &platform])
            .args(["--require-hashes", "--requirement", "xtask/mujoco-requirements.txt", "--dest"])
            .arg(&work),
    )?;
    let wheel = std::fs::read_dir(&work)?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
        .context("pip left no wheel")?;
    shell::run(Command::new("python3").args(["-m", "zipfile", "--extract"]).arg(&wheel).arg(&work))?;
    let library = format!("libmujoco.so.{MUJOCO_VERSION}");
    std::fs::rename(work.join("mujoco").join(&library), work.join(&library))
        .context("the wheel holds no library")?;
    std::os::unix::fs::symlink(&library, work.join("libmujoco.so"))?;
    std::fs::remove_dir_all(work.join("mujoco"))?;
    std::fs::remove_file(wheel)?;
    let _ = std::fs::remove_dir_all(folder);
    std::fs::rename(&work, folder)?;
    Ok(())
}

fn succeeds(program: &str, args: &[&str]) -> bool {
    Command::new(program)
        .args(args)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

fn confirm(question: &str) -> Result<bool> {
    let mut stderr = std::io::stderr();
    write!(stderr, "{question}")?;
    stderr.flush()?;
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer)?;
    Ok(matches!(answer.trim(), "y" | "Y" | "yes"))
}
