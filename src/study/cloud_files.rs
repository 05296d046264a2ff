//! The cloud's files.

use super::StudyError;
use super::beside::Beside;
use crate::recording::{CloudPoint, LasWriter, PlyWriter, RecordingError};
use std::fs::File;
use std::path::Path;

/// In which formats the cloud is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CloudFormat {
    /// As `cloud.ply`.
    #[default]
    Ply,
    /// As `cloud.las`.
    Las,
    /// As both.
    Both,
}

/// What is asked of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CloudWishes {
    /// Its files.
    pub format: CloudFormat,
    /// Whether echoes stay in it that are no surface that stands.
    pub keep_outliers: bool,
}

/// The files while they are written: they are in their place when they are whole.
pub(super) struct CloudFiles {
    ply: Option<(PlyWriter<File>, Beside)>,
    las: Option<(LasWriter<File>, Beside)>,
}

impl CloudFiles {
    /// Begins `cloud.ply` and `cloud.las` in `folder`, as far as they are wanted.
    pub(super) fn create(folder: &Path, format: CloudFormat) -> Result<Self, StudyError> {
        let begin = |name: &str| -> Result<(File, Beside), StudyError> {
            let mut beside = Beside::new(folder, &folder.join(name))?;
            let file = beside.file().try_clone().map_err(StudyError::file(beside.place()))?;
            Ok((file, beside))
        };
        let mut files = Self { ply: None, las: None };
        if format != CloudFormat::Las {
            let (file, beside) = begin("cloud.ply")?;
            files.ply = Some((PlyWriter::new(file)?, beside));
        }
        if format != CloudFormat::Ply {
            let (file, beside) = begin("cloud.las")?;
            files.las = Some((LasWriter::new(file)?, beside));
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

    pub(super) fn finish(self) -> Result<(), StudyError> {
        if let Some((ply, beside)) = self.ply {
            ply.finish()?;
            beside.finish()?;
        }
        if let Some((las, beside)) = self.las {
            las.finish()?;
            beside.finish()?;
        }
        Ok(())
    }
}
