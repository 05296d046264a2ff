//! Output files of the registered cloud.

use super::RunError;
use std::fs::File;
use std::path::Path;
use zsim_base::files::AtomicFile;
use zsim_base::files::FileError;
use zsim_recording::{CloudPoint, LasWriter, PlyWriter, RecordingError};

/// File formats of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CloudFormat {
    /// `cloud.ply`.
    #[default]
    Ply,
    /// `cloud.las`.
    Las,
    /// Both files.
    Both,
}

/// Options of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CloudOptions {
    /// File formats.
    pub format: CloudFormat,
    /// Whether the cloud includes mixed pixels, isolated points and moving objects.
    pub keep_outliers: bool,
}

/// Writers of the cloud files; the files get their final names when they are complete.
pub(super) struct CloudFiles {
    ply: Option<(PlyWriter<File>, AtomicFile)>,
    las: Option<(LasWriter<File>, AtomicFile)>,
}

impl CloudFiles {
    /// Creates the files of `format` in `folder`.
    pub(super) fn create(folder: &Path, format: CloudFormat) -> Result<Self, RunError> {
        let create = |name: &str| -> Result<(File, AtomicFile), RunError> {
            let mut partial = AtomicFile::new(folder, &folder.join(name))?;
            let file = partial.file().try_clone().map_err(FileError::at(partial.target()))?;
            Ok((file, partial))
        };
        let mut files = Self { ply: None, las: None };
        if format != CloudFormat::Las {
            let (file, partial) = create("cloud.ply")?;
            files.ply = Some((PlyWriter::new(file)?, partial));
        }
        if format != CloudFormat::Ply {
            let (file, partial) = create("cloud.las")?;
            files.las = Some((LasWriter::new(file)?, partial));
        }
        Ok(files)
    }

    pub(super) fn point(&mut self, point: &CloudPoint) -> Result<(), RecordingError> {
        if let Some((ply, _)) = &mut self.ply {
            ply.point(point)?;
        }
        if let Some((las, _)) = &mut self.las {
            las.point(point)?;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), RunError> {
        if let Some((ply, partial)) = self.ply {
            ply.finish()?;
            partial.finish()?;
        }
        if let Some((las, partial)) = self.las {
            las.finish()?;
            partial.finish()?;
        }
        Ok(())
    }
}
