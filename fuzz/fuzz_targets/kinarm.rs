#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| ndof_fuzz::trials("fuzz.kinarm", data));
