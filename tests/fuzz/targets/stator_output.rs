//! Any text as what CalculiX wrote: refused in one line, or finite numbers of the right count.

#![no_main]

use libfuzzer_sys::fuzz_target;
use stator::solver::output::read;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    match read(&text, &[4, 15]) {
        Ok(output) => {
            assert_eq!(output.cooled.len(), 2);
            for mode in &output.modes {
                assert!(mode.shape.len() == 2 && mode.eigenvalue.is_finite());
                assert!(mode.shape.iter().flatten().all(|value| value.is_finite()));
            }
        }
        Err(fault) => assert_eq!(fault.to_string().lines().count(), 1),
    }
});
