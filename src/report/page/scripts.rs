//! The scripts of the pages.

pub(crate) const LIBRARIES: &str = include_str!("assets/vendor/vendor.min.js");
pub(crate) const DATA: &str = include_str!("assets/data.js");
pub(crate) const CHARTS: &str = include_str!("assets/charts.js");
pub(crate) const TABLES: &str = include_str!("assets/table.js");
pub(crate) const RUNS: &str = include_str!("assets/runs.js");
pub(crate) const POINTS: &str = include_str!("assets/points.js");
pub(crate) const READY: &str = include_str!("assets/ready.js");
const STAGE: &str = include_str!("assets/stage.js");
const PLAYBACK: &str = include_str!("assets/playback.js");
const HEAD: &str = include_str!("assets/head.js");

/// The scripts of the view of a run or a scene, in the order of their dependencies.
pub(crate) const VIEW: [&str; 13] = [
    LIBRARIES,
    DATA,
    include_str!("assets/paths.js"),
    include_str!("assets/colour.js"),
    include_str!("assets/cloud.js"),
    STAGE,
    PLAYBACK,
    HEAD,
    include_str!("assets/view.js"),
    include_str!("assets/controls.js"),
    CHARTS,
    include_str!("assets/time_charts.js"),
    include_str!("assets/timeline.js"),
];

/// The scripts of the page of a spring, in the order of their dependencies.
pub(crate) const MODES: [&str; 6] = [LIBRARIES, DATA, STAGE, PLAYBACK, HEAD, include_str!("assets/modes.js")];
