#![no_main]

libfuzzer_sys::fuzz_target!(init: taut_fuzz::hunt::told_once(), |data: &[u8]| taut_fuzz::hunt::fuzz("gcode", data));
