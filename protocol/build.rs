//! Turns `proto/*.proto` into Rust and into the descriptor set that recordings embed.
//!
//! protox parses the schemas in Rust, so that no system `protoc` is needed.

use prost::Message;
use std::path::PathBuf;
use std::{env, error, fs};

const SCHEMAS: [&str; 2] = ["locoman.proto", "foxglove.proto"];

fn main() -> Result<(), Box<dyn error::Error>> {
    println!("cargo::rerun-if-changed=proto");
    let out_dir = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);

    let mut descriptors = protox::compile(SCHEMAS, ["proto"])?;
    prost_build::Config::new().enable_type_names().compile_fds(descriptors.clone())?;

    // Comments became rustdoc; a recording needs only the shapes.
    for file in &mut descriptors.file {
        file.source_code_info = None;
    }
    fs::write(out_dir.join("descriptors.bin"), descriptors.encode_to_vec())?;
    Ok(())
}
