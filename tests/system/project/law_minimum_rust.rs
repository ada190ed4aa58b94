//! The `rust-version` of each crate against those that its dependencies declare.
//!
//! With clippy's `incompatible_msrv`, which refuses what the standard library gained later, this holds all that can be
//! seen without the old compiler; what the language itself gained later is not seen.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// Major and minor.
fn version(text: &str) -> (u32, u32) {
    let mut numbers = text.split('.').map(|number| number.parse().expect("a number"));
    (numbers.next().expect("major"), numbers.next().expect("minor"))
}

fn output(program: &str, arguments: &[&str]) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let output = Command::new(program).args(arguments).current_dir(folder).output();
    let output = output.unwrap_or_else(|error| panic!("{program}: {error}"));
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// What cargo resolves for this machine: dependencies of other systems are not downloaded.
fn metadata() -> Value {
    let compiler = output("rustc", &["-vV"]);
    let host = compiler.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    let text =
        output(env!("CARGO"), &["metadata", "--format-version", "1", "--offline", "--filter-platform", host]);
    serde_json::from_str(&text).expect("JSON")
}

fn text<'a>(value: &'a Value, field: &str) -> &'a str {
    value[field].as_str().unwrap_or_else(|| panic!("{field} in {value}"))
}

fn array<'a>(value: &'a Value, field: &str) -> impl Iterator<Item = &'a Value> {
    value[field].as_array().unwrap_or_else(|| panic!("{field} in {value}")).iter()
}

/// What a crate is built from: its dependencies and theirs, but for those of tests and benchmarks.
fn built_from<'a>(of: &'a str, nodes: &BTreeMap<&'a str, &'a Value>) -> BTreeSet<&'a str> {
    let (mut found, mut open) = (BTreeSet::new(), vec![of]);
    while let Some(next) = open.pop() {
        for dependency in array(nodes[next], "deps") {
            let built = array(dependency, "dep_kinds").any(|kind| kind["kind"] != "dev");
            let package = text(dependency, "pkg");
            if built && found.insert(package) {
                open.push(package);
            }
        }
    }
    found
}

#[test]
fn law_no_dependency_needs_a_newer_rust() {
    let metadata = metadata();
    let packages: BTreeMap<&str, &Value> =
        array(&metadata, "packages").map(|package| (text(package, "id"), package)).collect();
    let nodes: BTreeMap<&str, &Value> =
        array(&metadata["resolve"], "nodes").map(|node| (text(node, "id"), node)).collect();
    let mut compared = 0;
    for member in array(&metadata, "workspace_members") {
        let id = member.as_str().expect("a package");
        let ours = text(packages[id], "rust_version");
        for dependency in built_from(id, &nodes).iter().map(|id| packages[id]) {
            let Some(theirs) = dependency["rust_version"].as_str() else { continue };
            compared += 1;
            let (name, of) = (text(packages[id], "name"), text(dependency, "name"));
            assert!(version(theirs) <= version(ours), "{name} says Rust {ours}, and {of} needs {theirs}");
        }
    }
    assert!(compared > 100, "{compared} dependencies compared");
}
