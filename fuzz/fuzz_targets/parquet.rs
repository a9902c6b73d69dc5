#![no_main]

use std::sync::Once;

static HOOK: Once = Once::new();

// The decoder panics on some damaged pages; our reader catches that and tells it as damage, and libFuzzer's hook would end the run before.
// A panic that our reader does not catch still ends it.
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    HOOK.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !panic.location().is_some_and(|place| place.file().contains("/parquet-")) {
                before(panic);
            }
        }));
    });
    ndof_fuzz::recording("fuzz.parquet", data);
});
