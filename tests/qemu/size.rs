//! `host-sim size`: the firmware fits its part, and its tasks can neither panic nor allocate nor fall back on software's double precision.

use serde_json::Value;

use crate::host_sim;

#[test]
fn tool_firmware_fits_and_its_tasks_call_nothing_forbidden() {
    let output = host_sim().args(["size", "--format", "json"]).output().expect("host-sim starts");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    for program in report["programs"].as_array().expect("programs") {
        let number = |field: &str| program[field].as_u64().unwrap_or_else(|| panic!("{field} in {program}"));
        // Empty images, or tasks whose calls are not followed, would pass for small and harmless.
        assert!(number("flash_bytes") > 16 * 1024 && number("flash_bytes") <= 96 * 1024, "{program}");
        assert!(number("functions") > 10, "{program}");
        assert_eq!(program["forbidden"], Value::Array(vec![]), "{program}");
    }
    let pil = &report["programs"][1];
    let ram = pil["static_bytes"].as_u64().expect("bytes") + pil["stack_bytes_max"].as_u64().expect("bytes");
    assert!(pil["program"] == "pil" && ram > 4 * 1024 && ram <= 16 * 1024, "{pil}");
}
