//! Any bytes as a log: read to its end, or refused or damaged in one line, in bounded memory.

#![no_main]

use std::path::Path;

use host_sim::log::{LogReader, read_head};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("run.mcap");
    if let Err(error) = read_head(path, bytes) {
        assert_eq!(error.to_string().lines().count(), 1);
    }
    let mut reader = LogReader::new(path, bytes);
    loop {
        match reader.next_part() {
            Ok(Some(_)) => {}
            Ok(None) => break,
            Err(error) => {
                assert_eq!(error.to_string().lines().count(), 1);
                assert!(matches!(reader.next_part(), Ok(None)), "nothing is read after damage");
                break;
            }
        }
    }
});
