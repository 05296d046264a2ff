//! Parses arbitrary records as a ROS 1 bag.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::io::Cursor;
use zsim_fuzz::read_all;

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

fuzz_target!(|data: &[u8]| {
    let file = [MAGIC, data.strip_prefix(MAGIC).unwrap_or(data)].concat();
    read_all(Cursor::new(file));
});
