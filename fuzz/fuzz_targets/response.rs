#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| ndof_fuzz::response(data));
