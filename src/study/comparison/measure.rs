//! What is told of a run.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A figure of an estimate; less is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Position error after rigid alignment, root mean square, m.
    PositionRmseM,
    /// Angle of the rotation error after rigid alignment, root mean square, degrees.
    RotationRmseDeg,
    /// Drift of the position, m/min.
    DriftMPerMin,
    /// Drift about the vertical, degrees/min.
    YawDriftDegPerMin,
    /// Error of the clock offset over the whole run, its beginning included, root mean square, s.
    ClockRmseS,
    /// Position error of the closed loop, likewise; loops are closed only where this is asked for.
    ClosedPositionRmseM,
    /// Time that the open loop took on one thread, with others beside it, reading included, s.
    WallS,
}

impl Measure {
    /// Every measure, in the order of the columns of `runs.csv`.
    pub const ALL: [Self; 7] = [
        Self::PositionRmseM,
        Self::RotationRmseDeg,
        Self::DriftMPerMin,
        Self::YawDriftDegPerMin,
        Self::ClockRmseS,
        Self::ClosedPositionRmseM,
        Self::WallS,
    ];

    /// Its name in files.
    pub fn key(self) -> &'static str {
        match self {
            Self::PositionRmseM => "position_rmse_m",
            Self::RotationRmseDeg => "rotation_rmse_deg",
            Self::DriftMPerMin => "drift_m_per_min",
            Self::YawDriftDegPerMin => "yaw_drift_deg_per_min",
            Self::ClockRmseS => "clock_rmse_s",
            Self::ClosedPositionRmseM => "closed_position_rmse_m",
            Self::WallS => "wall_s",
        }
    }

    /// Its name in narrow tables.
    pub(super) fn short(self) -> &'static str {
        match self {
            Self::PositionRmseM => "position",
            Self::RotationRmseDeg => "rotation",
            Self::DriftMPerMin => "drift",
            Self::YawDriftDegPerMin => "yaw drift",
            Self::ClockRmseS => "clock",
            Self::ClosedPositionRmseM => "closed loop",
            Self::WallS => "time",
        }
    }

    /// The unit in which people read it, and how many of it make one of the file's.
    pub(super) fn unit(self) -> (&'static str, f64) {
        match self {
            Self::PositionRmseM | Self::ClosedPositionRmseM => ("mm", 1e3),
            Self::RotationRmseDeg => ("deg", 1.0),
            Self::DriftMPerMin => ("mm/min", 1e3),
            Self::YawDriftDegPerMin => ("deg/min", 1.0),
            Self::ClockRmseS => ("ms", 1e3),
            Self::WallS => ("s", 1.0),
        }
    }
}

/// What came of one variant on one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The variant.
    pub variant: String,
    /// The scene's name.
    pub scene: String,
    /// The motion's name.
    pub motion: String,
    /// The seed.
    pub seed: u64,
    /// Its figures; one that is missing could not be told, as of an estimate that was lost.
    pub figures: BTreeMap<Measure, f64>,
}

impl Row {
    /// The columns of `runs.csv`.
    pub(super) fn header() -> String {
        let measures = Measure::ALL.map(Measure::key).join(",");
        format!("variant,scene,motion,seed,{measures}")
    }

    /// A line of `runs.csv`, without its end. Numbers are read back to the same bits.
    pub(super) fn line(&self) -> String {
        let figures = Measure::ALL.map(|measure| self.figures.get(&measure).map_or(String::new(), f64::to_string));
        format!("{},{},{},{},{}", self.variant, self.scene, self.motion, self.seed, figures.join(","))
    }

    /// Reads a line of `runs.csv`; `None` when it is none.
    pub(super) fn parse(line: &str) -> Option<Self> {
        let cells: Vec<&str> = line.split(',').collect();
        let [variant, scene, motion, seed, figures @ ..] = cells.as_slice() else { return None };
        if figures.len() != Measure::ALL.len() {
            return None;
        }
        let mut row = Self {
            variant: (*variant).to_owned(),
            scene: (*scene).to_owned(),
            motion: (*motion).to_owned(),
            seed: seed.parse().ok()?,
            figures: BTreeMap::new(),
        };
        for (measure, cell) in Measure::ALL.into_iter().zip(figures).filter(|(_, cell)| !cell.is_empty()) {
            row.figures.insert(measure, cell.parse().ok()?);
        }
        Some(row)
    }
}
