//! Parses arbitrary text as a spec. The first byte selects the kind.

#![no_main]

use libfuzzer_sys::fuzz_target;
use zsim_base::spec::{Source, parse};
use zsim_base::time::Stamp;
use zsim_dynamics::{HeadModel, HeadSpec};
use zsim_elasticity::SpringSpec;
use zsim_estimation::EstimatorSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::{Clocks, ClocksSpec, ImuSpec, LidarSpec};
use zsim_world::SceneSpec;

fuzz_target!(|data: &[u8]| {
    let Some((kind, text)) = data.split_first() else { return };
    let Ok(text) = std::str::from_utf8(text) else { return };
    let source = Source::in_memory("fuzz", text);
    match kind % 8 {
        0 => drop(parse::<SceneSpec>(&source)),
        1 => drop(parse::<HeadSpec>(&source).map(|spec| HeadModel::new(&spec, &source))),
        2 => drop(parse::<SpringSpec>(&source)),
        3 => drop(parse::<LidarSpec>(&source)),
        4 => drop(parse::<ImuSpec>(&source)),
        5 => drop(parse::<ClocksSpec>(&source).map(|spec| Clocks::new(&spec, &source, Stamp::from_nanos(0)))),
        6 => drop(parse::<MotionSpec>(&source)),
        _ => drop(parse::<EstimatorSpec>(&source)),
    }
});
