//! Files that are written whole or not at all.

use std::io::Write;
use std::path::Path;

/// Writes a text beside its place and renames it into it; makes the folder.
pub fn write_whole(path: &Path, text: &str) -> std::io::Result<()> {
    write_bytes_whole(path, text.as_bytes())
}

/// [`write_whole`] of bytes.
pub fn write_bytes_whole(path: &Path, contents: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder)?;
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let beside = path.with_file_name(name);
    let written = std::fs::File::create(&beside).and_then(|mut file| {
        file.write_all(contents)?;
        file.sync_all()
    });
    let placed = written.and_then(|()| std::fs::rename(&beside, path));
    if placed.is_err() {
        // Best effort: the first error is the one that matters.
        let _ = std::fs::remove_file(&beside);
    }
    placed
}
