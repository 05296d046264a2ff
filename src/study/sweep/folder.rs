//! A sweep on disk.
//!
//! ```text
//! plan.ron         the spec, the specs that it names, whole, and the version of zsim
//! points.parquet   the runs: number, what is varied, seed, identity, and which task does it
//! parts/           what is done: a table a run, or some hundred closed forms, named by what it is
//! tmp/             what is being written
//! ```

use super::axis::Shelf;
use super::component::{Kept, Slot};
use super::identity::Identity;
use super::table::{Column, Held, Table, TableWriter};
use super::{BaseSpec, Plan, SweepSpec};
use crate::spec::{self, Source, SpecError, to_text};
use crate::study::StudyError;
use crate::study::atomic_file::write_text;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Closed forms in a part: what a kill loses at most on each thread.
const BLOCK: u64 = 250;

/// Rows in a stretch of a table.
pub(super) const STRETCH: u64 = 16_384;

/// A plan as it is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Frozen {
    version: String,
    name: String,
    /// The identity of all runs in their order.
    identity: String,
    spec: SweepSpec,
    base: BTreeMap<Slot, Kept>,
    others: BTreeMap<String, Kept>,
}

/// What is written at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    pub identity: Identity,
    pub first: u64,
    pub count: u64,
}

/// A sweep that was planned in a folder.
pub struct Sweep {
    pub(super) plan: Plan,
    pub(super) folder: PathBuf,
    /// Of each run.
    pub(super) identities: Vec<Identity>,
    pub(super) units: Vec<Unit>,
    /// Numbers of units that are done together, in the order of the first.
    pub(super) tasks: Vec<Vec<u32>>,
}

impl Plan {
    /// Leaves the plan in `folder`, which is made. One that holds the same is left as it is; with `anew` another plan's
    /// is replaced, of which all runs that are in both stay done.
    ///
    /// # Errors
    /// When the folder holds another plan or files that are not a sweep's, or cannot be written, or runs are wrong in
    /// their combination.
    pub fn write(&self, folder: &Path, anew: bool) -> Result<Sweep, StudyError> {
        if !anew && !plan_of(folder).exists() && is_foreign(folder)? {
            return Err(StudyError::FolderMismatch { folder: folder.to_owned() });
        }
        let temporary = temporary(folder);
        for each in [&temporary, &parts(folder)] {
            std::fs::create_dir_all(each).map_err(StudyError::file(each))?;
        }
        let frozen = |identity: Identity| Frozen {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            name: self.name().to_owned(),
            identity: identity.to_string(),
            spec: self.spec().clone(),
            base: self.shelf().base.clone(),
            others: self.shelf().others.clone(),
        };
        let plan = plan_of(folder);
        let written = temporary.join("points.parquet");
        let identity = self.write_points(&temporary, &written)?;
        let text = to_text(&frozen(identity))? + "\n";
        if plan.exists() && std::fs::read_to_string(&plan).map_err(StudyError::file(&plan))? == text {
            std::fs::remove_file(&written).map_err(StudyError::file(&written))?;
            return Sweep::open(folder);
        }
        if plan.exists() && !anew {
            return Err(StudyError::FolderMismatch { folder: folder.to_owned() });
        }
        // In this order: a plan is there when its points are.
        if plan.exists() {
            std::fs::remove_file(&plan).map_err(StudyError::file(&plan))?;
        }
        std::fs::rename(&written, points_of(folder)).map_err(StudyError::file(&written))?;
        write_text(&temporary, &plan, &text)?;
        Sweep::open(folder)
    }

    /// Writes the table of runs, and tells the identity of all.
    fn write_points(&self, temporary: &Path, place: &Path) -> Result<Identity, StudyError> {
        let mut columns = vec![("point".to_owned(), Held::Counts), ("task".to_owned(), Held::Counts)];
        columns.extend(self.setting_columns());
        columns.push(("id".to_owned(), Held::Words));
        let mut table = TableWriter::create(temporary, place, &columns)?;
        let mut tasks: BTreeMap<Identity, i64> = BTreeMap::new();
        let mut all = Vec::new();
        for first in (0..self.points()).step_by(STRETCH as usize) {
            let numbers: Vec<u64> = (first..(first + STRETCH).min(self.points())).collect();
            let runs: Vec<(Identity, Identity)> = numbers
                .par_iter()
                .map(|index| self.point(*index).map(|point| (point.identity, point.rays)))
                .collect::<Result<_, _>>()?;
            let task = |(index, (_, rays)): (&u64, &(Identity, Identity))| {
                Some(match self.spec().base {
                    BaseSpec::Spring { .. } => (index / BLOCK) as i64,
                    BaseSpec::Journey { .. } => {
                        let next = tasks.len() as i64;
                        *tasks.entry(*rays).or_insert(next)
                    }
                })
            };
            let tasks = numbers.iter().zip(&runs).map(task).collect();
            let mut stretch =
                vec![Column::Counts(numbers.iter().map(|index| Some(*index as i64)).collect()), Column::Counts(tasks)];
            stretch.extend(self.setting_stretch(&numbers));
            stretch.push(Column::Words(runs.iter().map(|(identity, _)| Some(identity.to_string())).collect()));
            table.write(&stretch)?;
            all.extend(runs.into_iter().map(|(identity, _)| identity));
        }
        table.finish()?;
        Ok(Identity::of(all.iter().map(Identity::bytes)))
    }

    /// The columns of what is varied.
    pub(super) fn setting_columns(&self) -> Vec<(String, Held)> {
        let held = |is_number: bool| if is_number { Held::Numbers } else { Held::Words };
        let mut columns: Vec<_> = self.axes().iter().map(|axis| (axis.name.clone(), held(axis.is_number()))).collect();
        if !self.spec().seeds.is_empty() {
            columns.push(("seed".to_owned(), Held::Counts));
        }
        columns
    }

    /// A stretch of these columns.
    pub(super) fn setting_stretch(&self, numbers: &[u64]) -> Vec<Column> {
        let settings: Vec<_> = numbers.iter().map(|index| self.settings(*index)).collect();
        let column = |(k, axis): (usize, &super::axis::Axis)| match axis.is_number() {
            true => Column::Numbers(settings.iter().map(|row| row[k].number()).collect()),
            false => Column::Words(settings.iter().map(|row| Some(row[k].to_string())).collect()),
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
    /// Opens the sweep that was planned in `folder`.
    ///
    /// # Errors
    /// When there is none, it is damaged, or another version of zsim planned it.
    pub fn open(folder: &Path) -> Result<Self, StudyError> {
        let path = plan_of(folder);
        if !path.is_file() {
            let message = "holds no sweep: make one with `zsim sweep plan`".to_owned();
            return Err(SpecError::plain(folder.display().to_string(), message).into());
        }
        let source = Source::read(&path)?;
        let frozen: Frozen = spec::parse(&source)?;
        let ours = env!("CARGO_PKG_VERSION");
        if frozen.version != ours {
            let message = format!("was planned by zsim {}, this is {ours}: its runs would be others", frozen.version);
            return Err(SpecError::plain(source.name, message).into());
        }
        let mut shelf = Shelf { base: frozen.base, others: frozen.others };
        let plan = Plan::with(&frozen.name, &frozen.spec, &mut shelf, &source)?;
        let path = points_of(folder);
        let damaged = || SpecError::plain(path.display().to_string(), "is not of this plan: plan the sweep again");
        let table = Table::open(&path)?.ok_or_else(damaged)?;
        let words = table.column("id", Held::Words)?.words();
        let identities: Option<Vec<Identity>> = words.iter().map(|word| Identity::parse(word.as_deref()?)).collect();
        let identities = identities.filter(|all| all.len() as u64 == plan.points()).ok_or_else(damaged)?;
        if Identity::of(identities.iter().map(Identity::bytes)).to_string() != frozen.identity {
            return Err(damaged().into());
        }
        let units = units(&plan, &identities);
        let mut tasks: BTreeMap<i64, Vec<u32>> = BTreeMap::new();
        let of_points = table.column("task", Held::Counts)?.counts();
        for (k, unit) in units.iter().enumerate() {
            let task = of_points.get(unit.first as usize).copied().flatten().ok_or_else(damaged)?;
            tasks.entry(task).or_default().push(k as u32);
        }
        let tasks = tasks.into_values().collect();
        Ok(Self { plan, folder: folder.to_owned(), identities, units, tasks })
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Runs that share physics and rays, or a block of closed forms: what one worker does.
    pub fn tasks(&self) -> usize {
        self.tasks.len()
    }

    /// Where a unit's part is when it is done.
    pub(super) fn part(&self, unit: &Unit) -> PathBuf {
        parts(&self.folder).join(format!("{}.parquet", unit.identity))
    }

    pub(super) fn temporary(&self) -> PathBuf {
        temporary(&self.folder)
    }
}

fn units(plan: &Plan, identities: &[Identity]) -> Vec<Unit> {
    let size = match plan.spec().base {
        BaseSpec::Spring { .. } => BLOCK,
        BaseSpec::Journey { .. } => 1,
    };
    let unit = |(k, block): (usize, &[Identity])| Unit {
        identity: Identity::of(block.iter().map(Identity::bytes)),
        first: k as u64 * size,
        count: block.len() as u64,
    };
    identities.chunks(size as usize).enumerate().map(unit).collect()
}

/// Whether a folder without a plan holds more than planning leaves behind when it is killed.
fn is_foreign(folder: &Path) -> Result<bool, StudyError> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(StudyError::file(folder)(error)),
    };
    let ours = [temporary(folder), parts(folder), points_of(folder)];
    for entry in entries {
        if !ours.contains(&entry.map_err(StudyError::file(folder))?.path()) {
            return Ok(true);
        }
    }
    Ok(false)
}

fn plan_of(folder: &Path) -> PathBuf {
    folder.join("plan.ron")
}

fn points_of(folder: &Path) -> PathBuf {
    folder.join("points.parquet")
}

fn parts(folder: &Path) -> PathBuf {
    folder.join("parts")
}

fn temporary(folder: &Path) -> PathBuf {
    folder.join("tmp")
}
