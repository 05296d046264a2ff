//! Parses arbitrary bytes as an SQLite database of rosbag2.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::io::Cursor;
use zsim_fuzz::read_all;

const MAGIC: &[u8] = b"SQLite format 3\0";

fuzz_target!(|data: &[u8]| {
    let file = [MAGIC, data.strip_prefix(MAGIC).unwrap_or(data)].concat();
    read_all(Cursor::new(file));
});
