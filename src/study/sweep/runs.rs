//! Runs of a merged table with their levels on the axes.

use super::axis::Levels;
use super::design::AxisPosition;
use super::table::ColumnType;
use super::{Measure, Plan, Sweep};
use crate::StudyError;

/// Number of bins of a continuous axis in summaries and plots.
const RANGE_BINS: usize = 12;

/// Runs of the merged table.
pub(super) struct Runs {
    /// Indices of the runs, ascending.
    pub numbers: Vec<u64>,
    /// Level index of each run, per axis; the bin index on a continuous axis.
    pub levels: Vec<Vec<u32>>,
    /// Value of each run, per axis; `None` for axes that are not numeric.
    pub settings: Vec<Option<Vec<f64>>>,
}

impl Runs {
    /// Reads the runs of a merged sweep.
    pub fn read(sweep: &Sweep) -> Result<Self, StudyError> {
        let table = sweep.open_merged(&sweep.table())?;
        let numbers = table.column("point", ColumnType::Counts)?.counts();
        let numbers: Vec<u64> = numbers.into_iter().flatten().map(|number| number as u64).collect();
        let mut levels = vec![Vec::with_capacity(numbers.len()); sweep.plan.axes().len()];
        for number in &numbers {
            for (levels, position) in levels.iter_mut().zip(sweep.plan.positions(*number)) {
                levels.push(match position {
                    AxisPosition::Level(level) => level as u32,
                    AxisPosition::Along(u) => ((u * RANGE_BINS as f64) as u32).min(RANGE_BINS as u32 - 1),
                });
            }
        }
        let settings = sweep.plan.axes().iter().map(|axis| {
            let cells = axis.is_number().then(|| table.column(&axis.name, ColumnType::Numbers)).transpose()?;
            Ok(cells.map(|cells| cells.numbers().into_iter().map(|cell| cell.unwrap_or(f64::NAN)).collect()))
        });
        let settings = settings.collect::<Result<_, StudyError>>()?;
        Ok(Self { numbers, levels, settings })
    }

    /// Row of run `number` in the table.
    pub fn row(&self, number: u64) -> Option<usize> {
        self.numbers.binary_search(&number).ok()
    }
}

impl Sweep {
    /// A measure of the runs at a level of the first axis, by name, in the unit of files; `None` for a failed run.
    ///
    /// # Errors
    /// If the sweep is not merged.
    pub(crate) fn values_at(&self, level: &str, measure: Measure) -> Result<Vec<Option<f64>>, StudyError> {
        let table = self.open_merged(&self.table())?;
        let Some(axis) = self.plan.axes().first() else { return Ok(Vec::new()) };
        let levels = table.column(&axis.name, ColumnType::Text)?.texts();
        let values = self.open_merged(&self.table_of(measure))?.column(measure.key(), ColumnType::Numbers)?.numbers();
        let at_level = levels.into_iter().zip(values).filter(|(of, _)| of.as_deref() == Some(level));
        Ok(at_level.map(|(_, value)| value).collect())
    }
}

/// Number of levels of an axis, or of bins of a continuous one.
pub(super) fn level_count(plan: &Plan, axis: usize) -> usize {
    match &plan.axes()[axis].levels {
        Levels::Discrete(levels) => levels.len(),
        Levels::Range { .. } => RANGE_BINS,
    }
}

/// Label of a level or bin, and its numeric value.
pub(super) fn level_label(plan: &Plan, axis: usize, level: usize) -> (String, Option<f64>) {
    let axis = &plan.axes()[axis];
    let position = match &axis.levels {
        Levels::Discrete(_) => AxisPosition::Level(level),
        Levels::Range { .. } => AxisPosition::Along((level as f64 + 0.5) / RANGE_BINS as f64),
    };
    let setting = axis.level(position).setting;
    (setting.label(), setting.number())
}
