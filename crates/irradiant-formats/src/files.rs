//! Files from disk: the only place of this crate that touches the file system.

use irradiant_scene::{AssetError, Assets};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files below a folder, gzipped ones decompressed on the way.
///
/// Relative names are relative to that folder, as in pbrt-v4; absolute names are taken as they are.
#[derive(Clone, Debug)]
pub struct FileAssets {
    base: PathBuf,
    max_file_bytes: u64,
}

impl FileAssets {
    /// The largest file that is read, bytes, after decompression too.
    pub const MAX_FILE_BYTES: u64 = 16 << 30;

    /// The files that a scene file may name: relative to its folder.
    pub fn beside(scene: &Path) -> Self {
        Self::below(scene.parent().unwrap_or(Path::new("")))
    }

    /// Files relative to a folder; `""` is the current one (for a scene from the standard input).
    pub fn below(folder: impl Into<PathBuf>) -> Self {
        Self { base: folder.into(), max_file_bytes: Self::MAX_FILE_BYTES }
    }

    /// With another limit on the size of a file, bytes.
    pub fn with_max_file_bytes(mut self, bytes: u64) -> Self {
        self.max_file_bytes = bytes;
        self
    }
}

impl Assets for FileAssets {
    fn read(&self, path: &Path) -> Result<Arc<[u8]>, AssetError> {
        let fail = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => AssetError::NotFound,
            std::io::ErrorKind::PermissionDenied => AssetError::Unreadable("permission denied".into()),
            _ => AssetError::Unreadable(e.to_string()),
        };
        let file = std::fs::File::open(path).map_err(fail)?;
        let metadata = file.metadata().map_err(fail)?;
        if metadata.is_dir() {
            return Err(AssetError::Unreadable("it is a folder".into()));
        }
        // A device or a pipe has no end that could be known beforehand.
        if !metadata.is_file() {
            return Err(AssetError::Unreadable("it is not a regular file".into()));
        }
        if metadata.len() > self.max_file_bytes {
            return Err(AssetError::TooLarge { bytes: metadata.len(), limit: self.max_file_bytes });
        }
        let mut bytes = Vec::with_capacity(metadata.len() as usize);
        file.take(self.max_file_bytes + 1).read_to_end(&mut bytes).map_err(fail)?;
        if bytes.len() as u64 > self.max_file_bytes {
            return Err(AssetError::TooLarge { bytes: bytes.len() as u64, limit: self.max_file_bytes });
        }
        gunzip(bytes.into(), self.max_file_bytes)
    }

    fn resolve(&self, name: &str) -> PathBuf {
        self.base.join(name)
    }

    fn exists(&self, path: &Path) -> bool {
        path.is_file()
    }
}

/// The bytes themselves, or what they decompress to if they are a gzip file.
pub(crate) fn gunzip(bytes: Arc<[u8]>, limit: u64) -> Result<Arc<[u8]>, AssetError> {
    if !bytes.starts_with(&[0x1f, 0x8b, 8]) {
        return Ok(bytes);
    }
    let limit = most_decompressed(bytes.len() as u64, limit);
    let mut out = Vec::new();
    flate2::read::MultiGzDecoder::new(&bytes[..])
        .take(limit + 1)
        .read_to_end(&mut out)
        .map_err(|e| AssetError::Unreadable(format!("not a whole gzip file ({e})")))?;
    if out.len() as u64 > limit {
        return Err(AssetError::TooLarge { bytes: out.len() as u64, limit });
    }
    Ok(out.into())
}

/// What a gzip file may decompress to: deflate makes a thousand bytes of one at most, scenes and meshes rarely twenty, so
/// beyond 256 MiB more than 64 is taken for a bomb.
fn most_decompressed(compressed: u64, limit: u64) -> u64 {
    limit.min(compressed.saturating_mul(64).max(256 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn gzip_is_transparent_and_bounded() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(&[7; 100_000]).unwrap();
        let packed: Arc<[u8]> = encoder.finish().unwrap().into();
        assert_eq!(gunzip(packed.clone(), 1 << 20).unwrap().len(), 100_000);
        assert!(matches!(gunzip(packed.clone(), 1000), Err(AssetError::TooLarge { limit: 1000, .. })));
        let cut: Arc<[u8]> = packed[..packed.len() / 2].into();
        assert!(matches!(gunzip(cut, 1 << 20), Err(AssetError::Unreadable(_))));
        let plain: Arc<[u8]> = Arc::from(&b"WorldBegin"[..]);
        assert_eq!(gunzip(plain.clone(), 1 << 20).unwrap(), plain);
    }

    #[test]
    fn a_small_file_cannot_fill_the_memory() {
        assert_eq!(most_decompressed(10_000_000, 16 << 30), 640_000_000);
        assert_eq!(most_decompressed(1000, 16 << 30), 256 << 20);
        assert_eq!(most_decompressed(1 << 30, 16 << 30), 16 << 30);
        assert_eq!(most_decompressed(u64::MAX, 5), 5);
    }

    #[test]
    fn a_missing_file_and_a_folder_are_told_apart() {
        let assets = FileAssets::below(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(assets.read(&assets.resolve("no such file")), Err(AssetError::NotFound));
        assert!(matches!(assets.read(&assets.resolve("src")), Err(AssetError::Unreadable(_))));
        assert!(assets.read(&assets.resolve("Cargo.toml")).is_ok());
        assert!(assets.exists(&assets.resolve("Cargo.toml")) && !assets.exists(&assets.resolve("src")));
        assert!(matches!(
            assets.with_max_file_bytes(5).read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))),
            Err(AssetError::TooLarge { limit: 5, .. })
        ));
    }
}
