//! Imports point one way: between the crates, by their manifests, and between the folders of `host-sim` and
//! `simulation`, by their source.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use toml::{Table, Value};

use crate::support::checkout::{files_below, root, text};

/// Every crate of the workspace and the crates of the workspace that it may depend on, tests and build scripts
/// included.
const CRATES: [(&str, &[&str]); 16] = [
    ("ud-filter", &[]),
    ("motor-model", &[]),
    ("stator", &[]),
    ("estimator", &["ud-filter", "motor-model"]),
    ("controller", &["ud-filter", "motor-model", "estimator"]),
    ("link", &["ud-filter", "motor-model", "estimator", "controller"]),
    ("firmware", &["ud-filter", "motor-model", "estimator", "controller", "link"]),
    ("firmware-checks", &["ud-filter", "motor-model", "estimator", "controller", "link", "firmware"]),
    ("simulation", &["ud-filter", "motor-model", "estimator", "controller", "stator"]),
    ("analysis", &["ud-filter", "motor-model", "estimator", "controller", "stator", "simulation"]),
    (
        "host-sim",
        &["ud-filter", "motor-model", "estimator", "controller", "link", "stator", "simulation", "analysis"],
    ),
    (
        "python",
        &[
            "ud-filter",
            "motor-model",
            "estimator",
            "controller",
            "link",
            "stator",
            "simulation",
            "analysis",
            "host-sim",
        ],
    ),
    (
        "web",
        &[
            "ud-filter",
            "motor-model",
            "estimator",
            "controller",
            "link",
            "stator",
            "firmware",
            "firmware-checks",
            "simulation",
        ],
    ),
    ("benches", &["ud-filter", "motor-model", "estimator"]),
    (
        "tests/fuzz",
        &[
            "ud-filter",
            "motor-model",
            "estimator",
            "controller",
            "link",
            "stator",
            "firmware",
            "simulation",
            "analysis",
            "host-sim",
        ],
    ),
    (
        "tests",
        &[
            "ud-filter",
            "motor-model",
            "estimator",
            "controller",
            "link",
            "stator",
            "firmware",
            "firmware-checks",
            "simulation",
            "analysis",
            "host-sim",
            "python",
            "benches",
        ],
    ),
];

/// The folders of `host-sim`, and below them those of `simulation`, top first, each with the folders that it may import
/// besides itself. Both crates have a folder `math`.
const LAYERS: [(&str, &[&str]); 12] = [
    (
        "cli",
        &[
            "studies",
            "board",
            "log",
            "run_reports",
            "scene_files",
            "report",
            "tool",
            "runs",
            "world",
            "scene",
            "math",
        ],
    ),
    (
        "studies",
        &["board", "log", "run_reports", "scene_files", "report", "tool", "runs", "world", "scene", "math"],
    ),
    ("board", &["run_reports", "report", "tool", "runs", "world", "scene", "math"]),
    ("log", &["run_reports", "report", "runs", "world", "scene", "math"]),
    ("run_reports", &["report", "runs", "world", "scene", "math"]),
    ("scene_files", &["scene", "math"]),
    ("report", &["math"]),
    ("tool", &[]),
    ("runs", &["world", "scene", "math"]),
    ("world", &["scene", "math"]),
    ("scene", &["math"]),
    ("math", &[]),
];

/// The crates that have these folders.
const LAYERED: [&str; 2] = ["host-sim", "simulation"];

fn manifest(folder: &Path) -> Table {
    let path = folder.join("Cargo.toml");
    text(&path).parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Names of all dependencies in a manifest, of every kind and for every target.
fn dependencies(manifest: &Table) -> BTreeSet<String> {
    let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
    let of = |table: &Table| -> Vec<String> {
        let tables = kinds.iter().filter_map(|kind| table.get(*kind).and_then(Value::as_table));
        tables.flat_map(Table::keys).cloned().collect()
    };
    let targets = manifest.get("target").and_then(Value::as_table);
    let targets = targets.into_iter().flat_map(Table::values).filter_map(Value::as_table);
    of(manifest).into_iter().chain(targets.flat_map(of)).collect()
}

/// Each member of the workspace depends on no other than its row allows, and each member has a row.
#[test]
fn law_crates_depend_in_one_direction() {
    let workspace = manifest(&root());
    let members = workspace["workspace"]["members"].as_array().expect("members");
    let members: Vec<&str> = members.iter().map(|member| member.as_str().expect("a folder")).collect();
    let known: Vec<&str> = CRATES.iter().map(|(name, _)| *name).collect();
    assert_eq!(
        members.iter().collect::<BTreeSet<_>>(),
        known.iter().collect::<BTreeSet<_>>(),
        "left: the workspace's members, right: the rows of this test"
    );
    for (name, allowed) in CRATES {
        for dependency in dependencies(&manifest(&root().join(name))) {
            let wrong = known.contains(&dependency.as_str()) && !allowed.contains(&dependency.as_str());
            assert!(!wrong, "{name}/Cargo.toml: {name} may not depend on {dependency}");
        }
    }
}

/// A cycle of two rows would make the order above mean nothing.
#[test]
fn law_rows_of_this_test_have_no_cycle() {
    for rows in [&CRATES[..], &LAYERS[..]] {
        let allowed = |name: &str| rows.iter().find(|row| row.0 == name).map_or(&[][..], |row| row.1);
        for (name, below) in rows {
            for other in *below {
                assert!(!allowed(other).contains(name), "{name} and {other} may import each other");
                let through = allowed(other).iter().find(|third| !below.contains(third));
                assert_eq!(through, None, "{name} may import {other}, but not all that {other} may import");
            }
        }
    }
}

/// Code without its line comments, in which links may point anywhere.
fn without_comments(text: &str) -> String {
    let lines = text.lines().map(|line| line.split_once("//").map_or(line, |(code, _)| code));
    lines.collect::<Vec<_>>().join("\n")
}

/// The first segment of each path in `after`, what follows `crate::`: one name, or the names of a group in braces.
fn first_segments(after: &str) -> Vec<&str> {
    let name = |text: &str| text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let Some(group) = after.strip_prefix('{') else { return vec![&after[..name(after)]] };
    let (mut depth, mut start, mut segments) = (0, 0, Vec::new());
    for (index, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                let item = group[start..index].trim();
                segments.push(&item[..name(item)]);
                start = index + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    segments.retain(|segment| !segment.is_empty());
    segments
}

/// The names right below the crate's root that a file imports, or why that cannot be told.
fn imports(code: &str, depth: usize) -> Result<BTreeSet<&str>, String> {
    // A chain of `super` that climbs to the root would be an import by another name.
    for (index, _) in code.match_indices("super::").filter(|(index, _)| !code[..*index].ends_with("super::"))
    {
        let climbed = code[index..].split("::").take_while(|segment| *segment == "super").count();
        if climbed >= depth && depth > 1 {
            return Err("`super` climbs to the crate's root; write the path from `crate`".to_owned());
        }
    }
    let of_roots = ["crate::", "simulation::"].into_iter().flat_map(|root| code.match_indices(root));
    Ok(of_roots.flat_map(|(index, found)| first_segments(&code[index + found.len()..])).collect())
}

/// Every wrong import of the files below `source`.
fn wrong_imports(source: &Path) -> Vec<String> {
    let mut wrong = Vec::new();
    for file in files_below(source, "rs") {
        let path = file.strip_prefix(source).expect("below the folder").with_extension("");
        let segments: Vec<String> =
            path.iter().map(|segment| segment.to_string_lossy().into_owned()).collect();
        let Some((_, allowed)) = LAYERS.iter().find(|(layer, _)| *layer == segments[0]) else {
            // What is no layer is the root: it declares the layers and may import from each.
            if !["lib", "main"].contains(&segments[0].as_str()) {
                wrong.push(format!("{}: in no layer", path.display()));
            }
            continue;
        };
        let code = without_comments(&text(&file));
        match imports(&code, segments.len()) {
            Ok(names) => {
                let above = names.into_iter().filter(|name| *name != segments[0] && !allowed.contains(name));
                wrong.extend(above.map(|name| format!("{}: imports {name}", path.display())));
            }
            Err(why) => wrong.push(format!("{}: {why}", path.display())),
        }
    }
    wrong
}

#[test]
fn law_folders_import_downward() {
    let sources = LAYERED.map(|name| root().join(name).join("src"));
    for (layer, _) in LAYERS {
        let is_there = sources.iter().any(|source| source.join(layer).with_extension("rs").is_file());
        assert!(is_there, "{layer}: no such layer");
    }
    let wrong: Vec<String> = sources.iter().flat_map(|source| wrong_imports(source)).collect();
    assert!(wrong.is_empty(), "{} wrong imports:\n{}", wrong.len(), wrong.join("\n"));
}

/// What a page in a browser has not: the simulation asks for none of it.
#[test]
fn law_a_simulation_has_no_files_threads_terminals_or_clocks() {
    let absent = ["fs", "net", "thread", "process", "env", "time", "os"].map(|name| format!("std::{name}"));
    let absent = absent.iter().map(String::as_str).chain(["println!", "eprintln!", "io::std", "rayon"]);
    let absent: Vec<&str> = absent.collect();
    for file in files_below(&root().join("simulation/src"), "rs") {
        let code = without_comments(&text(&file));
        let code = code.split("#[cfg(test)]").next().unwrap_or_default();
        for name in &absent {
            let used = code.match_indices(name).any(|(index, name)| {
                !code[index + name.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_')
            });
            assert!(!used || file.ends_with("tests.rs"), "{}: {name}", file.display());
        }
    }
}

/// The check itself: what it has to find, and what it has to leave alone.
#[test]
fn exact_wrong_imports_are_found_however_they_are_written() {
    for (path, text, wrong) in [
        ("world/plant.rs", "use crate::scene::Scene;\nuse crate::math::{mean, sum};", 0),
        ("world/plant.rs", "use crate::runs::Run;", 1),
        ("report/chart.rs", "use simulation::runs::Run;", 1),
        ("report/chart.rs", "use simulation::math::statistics::Spread;", 0),
        ("world/plant.rs", "use crate::{scene::Scene, runs::{one, two}, studies};", 2),
        ("world/plant.rs", "fn f() -> crate::cli::Answer { answer() }", 1),
        ("world/plant.rs", "/// As [`crate::runs`] does.\nuse super::camera;", 0),
        ("world/plant/teeth.rs", "use super::super::camera;", 0),
        ("world/plant/teeth.rs", "use super::super::super::runs;", 1),
        ("report/chart.rs", "use crate::world::plant;", 1),
        ("math.rs", "use crate::Scene;", 1),
        ("lib.rs", "pub use crate::runs::Run;", 0),
        ("simulate.rs", "", 1),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join(path);
        fs::create_dir_all(file.parent().expect("a folder")).expect("a writable folder");
        fs::write(file, text).expect("a writable folder");
        let found = wrong_imports(folder.path());
        assert_eq!(found.len(), wrong, "{path}: {text}\n{found:?}");
    }
}
