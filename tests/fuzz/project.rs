#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| patchwright_fuzz::read(bytes, patchwright::io::Format::Project));
