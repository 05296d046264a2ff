//! Parses arbitrary text as a calibration in Kalibr YAML.

#![no_main]

use libfuzzer_sys::fuzz_target;
use zsim_run::CalibrationSpec;

fuzz_target!(|data: &[u8]| {
    if let Ok(text) = std::str::from_utf8(data) {
        let _ = CalibrationSpec::from_kalibr(text, "fuzz.yaml");
    }
});
