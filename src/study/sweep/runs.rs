//! The runs of a merged table, and where they are on the axes.

use super::axis::Levels;
use super::design::Place;
use super::table::{Held, Table};
use super::{Plan, Sweep};
use crate::spec::SpecError;
use crate::study::StudyError;

/// Parts into which a range is cut for its curve.
const PARTS: usize = 12;

/// The runs of the merged table.
pub(super) struct Runs {
    /// Their numbers, rising.
    pub numbers: Vec<u64>,
    /// Where each is on the axes, as a level's number; of a range as the number of a part.
    pub levels: Vec<Vec<u32>>,
    /// The settings themselves, of axes of numbers.
    pub settings: Vec<Option<Vec<f64>>>,
}

impl Runs {
    pub fn of(sweep: &Sweep) -> Result<Self, StudyError> {
        let path = sweep.table();
        let unmerged = || SpecError::plain(path.display().to_string(), "is not there: merge the sweep first");
        let table = Table::open(&path)?.ok_or_else(unmerged)?;
        let numbers = table.column("point", Held::Counts)?.counts();
        let numbers: Vec<u64> = numbers.into_iter().flatten().map(|number| number as u64).collect();
        let mut levels = vec![Vec::with_capacity(numbers.len()); sweep.plan.axes().len()];
        for number in &numbers {
            for (levels, place) in levels.iter_mut().zip(sweep.plan.places(*number)) {
                levels.push(match place {
                    Place::Level(level) => level as u32,
                    Place::Along(u) => ((u * PARTS as f64) as u32).min(PARTS as u32 - 1),
                });
            }
        }
        let settings = sweep.plan.axes().iter().map(|axis| {
            let cells = axis.is_number().then(|| table.column(&axis.name, Held::Numbers)).transpose()?;
            Ok(cells.map(|cells| cells.numbers().into_iter().map(|cell| cell.unwrap_or(f64::NAN)).collect()))
        });
        let settings = settings.collect::<Result<_, StudyError>>()?;
        Ok(Self { numbers, levels, settings })
    }

    /// The row of run `number`, if it is there.
    pub fn row(&self, number: u64) -> Option<usize> {
        self.numbers.binary_search(&number).ok()
    }
}

/// How many levels an axis has, or parts.
pub(super) fn levels_of(plan: &Plan, axis: usize) -> usize {
    match &plan.axes()[axis].levels {
        Levels::Some(levels) => levels.len(),
        Levels::Range { .. } => PARTS,
    }
}

/// What a level is called, and its number.
pub(super) fn level_of(plan: &Plan, axis: usize, level: usize) -> (String, Option<f64>) {
    let axis = &plan.axes()[axis];
    let place = match &axis.levels {
        Levels::Some(_) => Place::Level(level),
        Levels::Range { .. } => Place::Along((level as f64 + 0.5) / PARTS as f64),
    };
    let setting = axis.level(place).setting;
    (setting.to_string(), setting.number())
}
