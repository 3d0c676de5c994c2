//! All of a file or none of it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::ImageError;

/// Puts `bytes` at `path` so that a reader sees the old file or the whole new one, never a part, even after a crash.
///
/// Writes a temporary file in the same directory, flushes it to the disk, renames it over the old one and
/// flushes the directory (where the platform can). On failure the temporary file is removed and the old one stays.
pub fn atomic_write(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let fail = |error| ImageError::Io { path: path.to_owned(), error };
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let (temporary, file) = create_beside(path, &directory).map_err(fail)?;
    let written = fill(file, bytes).and_then(|()| fs::rename(&temporary, path));
    if let Err(error) = written {
        // The write's own failure is what the caller needs to hear.
        let _ = fs::remove_file(&temporary);
        return Err(fail(error));
    }
    flush_directory(&directory);
    Ok(())
}

/// A new file next to `path`, under a name that nothing else has.
fn create_beside(path: &Path, directory: &Path) -> io::Result<(PathBuf, File)> {
    // Only keeps concurrent writers of one process apart; results do not depend on it.
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let Some(name) = path.file_name() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not the name of a file"));
    };
    let mut tries = 0;
    loop {
        let mut temporary = std::ffi::OsString::from(".");
        temporary.push(name);
        temporary.push(format!(".{}.{}.tmp", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed)));
        let temporary = directory.join(temporary);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && tries < 100 => tries += 1,
            opened => return opened.map(|file| (temporary, file)),
        }
    }
}

fn fill(mut file: File, bytes: &[u8]) -> io::Result<()> {
    file.write_all(bytes)?;
    file.sync_all()
}

/// Makes the rename itself last; file systems that cannot do this are left to their own guarantees.
fn flush_directory(directory: &Path) {
    if cfg!(unix)
        && let Ok(handle) = File::open(directory)
    {
        let _ = handle.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A directory of this test's own, removed at the end.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("irradiant-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn names(&self) -> Vec<String> {
            let entries = fs::read_dir(&self.0).unwrap();
            let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
            names.sort();
            names
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_file_is_replaced_whole() {
        let scratch = Scratch::new("replace");
        let path = scratch.0.join("image.exr");
        atomic_write(&path, b"old").unwrap();
        atomic_write(&path, b"new and longer").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new and longer");
        assert_eq!(scratch.names(), ["image.exr"]);
    }

    #[test]
    fn a_failure_leaves_the_old_as_it_was_and_no_litter() {
        let scratch = Scratch::new("failure");
        // A directory of that name that holds a file cannot be renamed over: the last step fails.
        let taken = scratch.0.join("taken");
        fs::create_dir(&taken).unwrap();
        fs::write(taken.join("precious"), b"old").unwrap();
        assert!(matches!(atomic_write(&taken, b"new"), Err(ImageError::Io { .. })));
        assert_eq!(fs::read(taken.join("precious")).unwrap(), b"old");
        assert_eq!(scratch.names(), ["taken"]);
        assert!(atomic_write(&scratch.0.join("missing/image.exr"), b"new").is_err());
        assert!(atomic_write(Path::new("/"), b"new").is_err());
    }
}
