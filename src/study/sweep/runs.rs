//! Runs of a merged table with their levels on the axes.

use super::axis::Levels;
use super::design::AxisPosition;
use super::table::{Column, ColumnType};
use super::{Plan, Sweep};
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
        let axes = sweep.plan.axes();
        let mut columns = vec![("point", ColumnType::Counts)];
        columns
            .extend(axes.iter().filter(|axis| axis.is_number()).map(|axis| (axis.name.as_str(), ColumnType::Numbers)));
        let mut columns = sweep.read_merged(&sweep.table(), &columns)?.into_iter();
        let numbers = columns.next().map_or_else(Vec::new, Column::counts);
        let numbers: Vec<u64> = numbers.into_iter().flatten().map(|number| number as u64).collect();
        let mut levels = vec![Vec::with_capacity(numbers.len()); axes.len()];
        for number in &numbers {
            for (levels, position) in levels.iter_mut().zip(sweep.plan.positions(*number)) {
                levels.push(match position {
                    AxisPosition::Level(level) => level as u32,
                    AxisPosition::Along(u) => ((u * RANGE_BINS as f64) as u32).min(RANGE_BINS as u32 - 1),
                });
            }
        }
        let filled = |column: Column| column.numbers().into_iter().map(|cell| cell.unwrap_or(f64::NAN)).collect();
        let settings = axes.iter().map(|axis| axis.is_number().then(|| columns.next().map(filled)).flatten()).collect();
        Ok(Self { numbers, levels, settings })
    }

    /// Row of run `number` in the table.
    pub fn row(&self, number: u64) -> Option<usize> {
        self.numbers.binary_search(&number).ok()
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
