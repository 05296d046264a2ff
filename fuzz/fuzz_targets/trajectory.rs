//! Parses arbitrary bytes as a trajectory, a cloud and a map.

#![no_main]

use libfuzzer_sys::fuzz_target;
use zsim_recording::{PlyReader, parse_surfel_map, parse_tum};

fuzz_target!(|data: &[u8]| {
    let _ = parse_tum("fuzz", data);
    let _ = parse_surfel_map("fuzz", data);
    if let Ok(cloud) = PlyReader::new("fuzz", data) {
        cloud.for_each(drop);
    }
});
