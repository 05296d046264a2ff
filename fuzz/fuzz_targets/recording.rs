//! Parses arbitrary records as an MCAP file.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::io::Cursor;
use zsim_fuzz::read_all;

fuzz_target!(|data: &[u8]| {
    let mut file = b"\x89MCAP0\r\n".to_vec();
    file.extend_from_slice(data.strip_prefix(b"\x89MCAP0\r\n").unwrap_or(data));
    read_all(Cursor::new(file));
});
