//! Any bytes as a trajectory and as a cloud.

#![no_main]

use libfuzzer_sys::fuzz_target;
use zsim::recording::{PlyReader, parse_tum};

fuzz_target!(|data: &[u8]| {
    let _ = parse_tum("fuzz", data);
    if let Ok(cloud) = PlyReader::new("fuzz", data) {
        cloud.for_each(drop);
    }
});
