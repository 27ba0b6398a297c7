//! Writes the place of the MuJoCo library into the binaries, so that they find it without LD_LIBRARY_PATH.
use std::path::PathBuf;

fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    let dir = std::env::var_os("MUJOCO_DYNAMIC_LINK_DIR").map(PathBuf::from).unwrap_or_default();
    match dir.canonicalize() {
        Ok(dir) => println!("cargo::rustc-link-arg=-Wl,-rpath,{}", dir.display()),
        Err(_) => println!("cargo::error=MuJoCo is not installed: run `cargo xtask setup`"),
    }
}
