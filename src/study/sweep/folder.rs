//! Files of a sweep on disk.
//!
//! ```text
//! plan.ron         the sweep's spec, all specs that it names, and the version of zsim
//! points.csv       the runs: index (`point`), values of the axes, seed, hash, and job (`task`)
//! parts/           finished runs: one file per batch, a simulated run or 250 closed forms, named by its hash
//! tmp/             files being written
//! ```

use super::axis::SpecSet;
use super::identity::ContentHash;
use super::table::{Column, ColumnType, TableWriter, open, read_columns};
use super::tree::Tree;
use super::{BaseSpec, Plan, SweepSpec};
use crate::StudyError;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_base::files::FileError;
use zsim_base::files::write_text;
use zsim_base::spec::{self, Source, SpecError, to_text};

/// Number of runs that are hashed in parallel and written together to the table of runs.
const RUNS_PER_GROUP: u64 = 16_384;

/// Folder of the finished runs.
const PARTS: &str = "parts";
/// Folder of files being written.
const TEMPORARY: &str = "tmp";

/// Content of `plan.ron`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanFile {
    version: String,
    name: String,
    /// Hash of all runs in their order.
    identity: String,
    spec: SweepSpec,
    base: Tree,
    named: BTreeMap<String, Value>,
}

/// Runs that are stored together in one file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Batch {
    pub identity: ContentHash,
    pub first: u64,
    pub count: u64,
}

impl Batch {
    /// Indices of the runs.
    pub fn runs(&self) -> Range<u64> {
        self.first..self.first + self.count
    }
}

/// A sweep planned in a folder.
pub struct Sweep {
    pub(super) plan: Plan,
    pub(super) folder: PathBuf,
    /// Hash of each run.
    pub(super) identities: Vec<ContentHash>,
    pub(super) batches: Vec<Batch>,
    /// Indices of the batches of each job, ordered by the first batch.
    pub(super) jobs: Vec<Vec<u32>>,
}

impl Plan {
    /// Writes the plan to `folder`, creating the folder if needed.
    ///
    /// An identical plan in the folder is kept. With `anew` a different plan is replaced; finished runs that both plans
    /// contain stay finished.
    ///
    /// # Errors
    /// If the folder contains another plan or files not written by a sweep, if it cannot be written, or if a combination
    /// of settings is invalid.
    pub fn write(&self, folder: &Path, anew: bool) -> Result<Sweep, StudyError> {
        if !anew && !plan_path(folder).exists() && is_foreign(folder)? {
            return Err(StudyError::FolderMismatch { folder: folder.to_owned() });
        }
        let create = |name: &str| files::subfolder(folder, name).map_err(FileError::at(folder));
        let (temporary, _) = (create(TEMPORARY)?, create(PARTS)?);
        let plan = plan_path(folder);
        let written = temporary.join("points.csv");
        let identity = self.write_points(&temporary, &written)?;
        let text = self.text_with(&identity.to_string())?;
        let points = points_path(folder);
        let read = |path: &Path| files::open(path).and_then(std::io::read_to_string).map_err(FileError::at(path));
        if plan.exists() && read(&plan)? == text {
            // The same content, unless the file is damaged or of a version with another format.
            std::fs::rename(&written, &points).map_err(FileError::at(&points))?;
            return Sweep::open(folder);
        }
        if plan.exists() && !anew {
            return Err(StudyError::FolderMismatch { folder: folder.to_owned() });
        }
        // Write the plan last: its presence implies a complete table of runs.
        if plan.exists() {
            std::fs::remove_file(&plan).map_err(FileError::at(&plan))?;
        }
        std::fs::rename(&written, &points).map_err(FileError::at(&points))?;
        write_text(&temporary, &plan, &text)?;
        Sweep::open(folder)
    }

    /// The sweep's spec, all specs that it names, and the version of zsim.
    pub(crate) fn text(&self) -> Result<String, SpecError> {
        self.text_with("")
    }

    /// Content of `plan.ron`; `identity` is the hash of all runs.
    fn text_with(&self, identity: &str) -> Result<String, SpecError> {
        let content = PlanFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            name: self.name().to_owned(),
            identity: identity.to_owned(),
            spec: self.spec().clone(),
            base: self.specs().base.clone(),
            named: self.specs().named.clone(),
        };
        Ok(to_text(&content)? + "\n")
    }

    /// Writes the table of runs to `target` and returns the hash of all runs.
    fn write_points(&self, temporary: &Path, target: &Path) -> Result<ContentHash, StudyError> {
        let mut columns = vec![("point".to_owned(), ColumnType::Counts), ("task".to_owned(), ColumnType::Counts)];
        columns.extend(self.setting_columns());
        columns.push(("id".to_owned(), ColumnType::Text));
        let mut table = TableWriter::create(temporary, target, &columns)?;
        let mut jobs: BTreeMap<ContentHash, i64> = BTreeMap::new();
        let mut all = Vec::new();
        for first in (0..self.runs()).step_by(RUNS_PER_GROUP as usize) {
            let numbers: Vec<u64> = (first..(first + RUNS_PER_GROUP).min(self.runs())).collect();
            let runs: Vec<(ContentHash, Option<ContentHash>)> =
                numbers.par_iter().map(|index| self.hashes_of(*index)).collect::<Result<_, _>>()?;
            let job = |(index, (_, rays)): (&u64, &(ContentHash, Option<ContentHash>))| {
                Some(match rays {
                    None => (index / self.spec().base.runs_per_batch()) as i64,
                    Some(rays) => {
                        let next = jobs.len() as i64;
                        *jobs.entry(*rays).or_insert(next)
                    }
                })
            };
            let job_of_run = numbers.iter().zip(&runs).map(job).collect();
            let mut cells = vec![
                Column::Counts(numbers.iter().map(|index| Some(*index as i64)).collect()),
                Column::Counts(job_of_run),
            ];
            cells.extend(self.setting_cells(&numbers));
            cells.push(Column::Text(runs.iter().map(|(identity, _)| Some(identity.to_string())).collect()));
            table.write(&cells)?;
            all.extend(runs.into_iter().map(|(identity, _)| identity));
        }
        table.finish()?;
        Ok(ContentHash::of(all.iter().map(ContentHash::bytes)))
    }

    /// Hash of run `index`, and of its physics and rays, if any.
    fn hashes_of(&self, index: u64) -> Result<(ContentHash, Option<ContentHash>), StudyError> {
        let inputs = self.inputs(index)?;
        let rays = match self.spec().base {
            BaseSpec::Journey(_) => Some(self.journey(index, &inputs)?.rays),
            BaseSpec::Spring { .. } | BaseSpec::Gains { .. } => None,
        };
        Ok((self.identity(index, &inputs)?, rays))
    }

    /// Names and types of the columns of axis values and seed.
    pub(super) fn setting_columns(&self) -> Vec<(String, ColumnType)> {
        let column_type = |is_number: bool| if is_number { ColumnType::Numbers } else { ColumnType::Text };
        let mut columns: Vec<_> =
            self.axes().iter().map(|axis| (axis.name.clone(), column_type(axis.is_number()))).collect();
        if !self.spec().seeds.is_empty() {
            columns.push(("seed".to_owned(), ColumnType::Counts));
        }
        columns
    }

    /// Cells of these columns for the runs `numbers`.
    pub(super) fn setting_cells(&self, numbers: &[u64]) -> Vec<Column> {
        let settings: Vec<_> = numbers.iter().map(|index| self.settings(*index)).collect();
        let column = |(k, axis): (usize, &super::axis::Axis)| match axis.is_number() {
            true => Column::Numbers(settings.iter().map(|row| row[k].number()).collect()),
            false => Column::Text(settings.iter().map(|row| Some(row[k].to_string())).collect()),
        };
        let mut columns: Vec<Column> = self.axes().iter().enumerate().map(column).collect();
        if !self.spec().seeds.is_empty() {
            columns
                .push(Column::Counts(numbers.iter().map(|index| self.seed(*index).map(|seed| seed as i64)).collect()));
        }
        columns
    }
}

impl Sweep {
    /// Opens the sweep planned in `folder`.
    ///
    /// # Errors
    /// If the folder contains no sweep, if the sweep is damaged, or if another version of zsim planned it.
    pub fn open(folder: &Path) -> Result<Self, StudyError> {
        let path = plan_path(folder);
        if !path.is_file() {
            let message = "contains no sweep: create one with `zsim sweep plan`".to_owned();
            return Err(SpecError::plain(folder.display().to_string(), message).into());
        }
        for name in [TEMPORARY, PARTS] {
            files::check_subfolder(folder, Path::new(name)).map_err(FileError::at(folder))?;
        }
        let source = Source::read(&path)?;
        let file: PlanFile = spec::parse(&source)?;
        let ours = env!("CARGO_PKG_VERSION");
        if file.version != ours {
            let message = format!(
                "was planned by zsim {}, this is zsim {ours}, whose runs may differ: plan the sweep again",
                file.version
            );
            return Err(SpecError::plain(source.name, message).into());
        }
        let mut specs = SpecSet { base: file.base, named: file.named };
        let plan = Plan::with_specs(&file.name, &file.spec, &mut specs, &source)?;
        let path = points_path(folder);
        let damaged = || {
            SpecError::plain(path.display().to_string(), "is missing or does not match the plan: plan the sweep again")
        };
        let columns = [("id", ColumnType::Text), ("task", ColumnType::Counts)];
        let columns = open(&path)?.and_then(|file| read_columns(file, &columns).ok());
        let mut columns = columns.ok_or_else(damaged)?;
        let job_of_run = columns.pop().map_or_else(Vec::new, Column::counts);
        let hashes = columns.pop().map_or_else(Vec::new, Column::texts);
        let identities: Option<Vec<ContentHash>> =
            hashes.iter().map(|hash| ContentHash::parse(hash.as_deref()?)).collect();
        let identities = identities.filter(|all| all.len() as u64 == plan.runs()).ok_or_else(damaged)?;
        if ContentHash::of(identities.iter().map(ContentHash::bytes)).to_string() != file.identity {
            return Err(damaged().into());
        }
        let batches = batches(&plan, &identities);
        let mut jobs: BTreeMap<i64, Vec<u32>> = BTreeMap::new();
        for (k, batch) in batches.iter().enumerate() {
            let job = job_of_run.get(batch.first as usize).copied().flatten().ok_or_else(damaged)?;
            jobs.entry(job).or_default().push(k as u32);
        }
        Ok(Self { plan, folder: folder.to_owned(), identities, batches, jobs: jobs.into_values().collect() })
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Number of jobs. One worker processes a job: runs that share physics and rays, or a batch of closed forms.
    pub fn jobs(&self) -> usize {
        self.jobs.len()
    }

    /// Path of the file of a batch.
    pub(super) fn batch_path(&self, batch: &Batch) -> PathBuf {
        parts_folder(&self.folder).join(format!("{}.part", batch.identity))
    }

    /// Folder of files being written.
    pub(super) fn temporary(&self) -> PathBuf {
        temporary_folder(&self.folder)
    }
}

fn batches(plan: &Plan, identities: &[ContentHash]) -> Vec<Batch> {
    let size = plan.spec().base.runs_per_batch();
    let batch = |(k, block): (usize, &[ContentHash])| Batch {
        identity: ContentHash::of(block.iter().map(ContentHash::bytes)),
        first: k as u64 * size,
        count: block.len() as u64,
    };
    identities.chunks(size as usize).enumerate().map(batch).collect()
}

/// Whether a folder without a plan contains files other than those of an interrupted planning.
fn is_foreign(folder: &Path) -> Result<bool, StudyError> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(FileError::at(folder)(error).into()),
    };
    let ours = [temporary_folder(folder), parts_folder(folder), points_path(folder)];
    for entry in entries {
        if !ours.contains(&entry.map_err(FileError::at(folder))?.path()) {
            return Ok(true);
        }
    }
    Ok(false)
}

fn plan_path(folder: &Path) -> PathBuf {
    folder.join("plan.ron")
}

fn points_path(folder: &Path) -> PathBuf {
    folder.join("points.csv")
}

fn parts_folder(folder: &Path) -> PathBuf {
    folder.join(PARTS)
}

fn temporary_folder(folder: &Path) -> PathBuf {
    folder.join(TEMPORARY)
}
