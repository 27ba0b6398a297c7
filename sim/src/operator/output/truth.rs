//! A truth file.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::Context;

use super::{Instant, Output, Unfinished};

/// The truth in the columns of a poses file, the last five left empty.
#[derive(Debug)]
pub struct TruthFile {
    file: BufWriter<File>,
    unfinished: Unfinished,
}

impl TruthFile {
    /// Begins a file.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let unfinished = Unfinished::new(path)?;
        let file = File::create(&unfinished.temporary)
            .with_context(|| format!("cannot write {}", path.display()))?;
        let mut file = BufWriter::new(file);
        writeln!(file, "t_ns,shell,x,y,z,qw,qx,qy,qz,sigma_pos_m,sigma_rot_rad,rms_px,tags,cameras")?;
        Ok(Self { file, unfinished })
    }
}

impl Output for TruthFile {
    fn add(&mut self, instant: &Instant<'_>) -> anyhow::Result<()> {
        for &body in instant.bodies {
            let pose = instant.posture.of(body);
            let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
            writeln!(
                self.file,
                "{},{},{:.9},{:.9},{:.9},{:.12},{:.12},{:.12},{:.12},,,,,",
                instant.capture_ns,
                body.name(),
                p.x,
                p.y,
                p.z,
                q.w,
                q.i,
                q.j,
                q.k
            )?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> anyhow::Result<()> {
        let Self { mut file, unfinished } = *self;
        file.flush()?;
        drop(file);
        unfinished.keep()
    }
}
