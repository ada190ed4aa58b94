//! Every command in the documents: those of `host-sim` run, and any other names what is there.
//!
//! A document is `README.md` or a Markdown file in `docs`. Its commands are the lines of blocks marked `sh`, and the
//! code in its prose that begins with `cargo` or `host-sim`.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use tempfile::TempDir;
use toml::{Table, Value};

use crate::support::built_command::{folder, run};
use crate::support::checkout::{files_below, root, text};

/// What runs smaller here than it stands in the documents: a flag with its value is put in the place of the documented
/// one, or appended. The command as it stands must still be parsed.
const SMALLER: [(&str, &[(&str, &str)]); 10] = [
    (
        "calibrate",
        &[
            ("--runs", "1"),
            ("--duration", "6"),
            ("--set", "calibrate.steps=1"),
            ("--set", "calibrate.pilot_s=0"),
            ("--set", "calibrate.within_ppm=0"),
            COARSE,
        ],
    ),
    ("commission", &[COARSE]),
    ("estimate", &[("--motors", "1"), COARSE]),
    ("faults", &[("--runs", "2")]),
    ("filters", &[("--motors", "1"), ("--host-only", "")]),
    ("identify", &[("--motors", "100"), ("--no-advice", "")]),
    ("positioning-trials", &[("--motors", "2"), COARSE]),
    ("rate", &[("--duration", "2"), COARSE]),
    ("reproduce", &[("--seeds", "2"), ("--drawn", "1"), ("--quick", "")]),
    ("response-map", &[("--motors", "4")]),
];

/// The coarsest step of the plant.
const COARSE: (&str, &str) = ("--set", "plant.step_s=1e-5");

/// What takes ten seconds or more as small as it gets: it is parsed here. The tutorial on recordings has the guide's
/// `identify` once more, and that one runs. Other tests run the like of the rest: a quick `accuracy` (`tool_accuracy`),
/// `instruments` on one motor (`tool_reports`), a move that makes its map (`tool_identify`), a plan (`tool_cluster`),
/// and motors that are commissioned and moved (`tool_commission`).
const LONG: [&[&str]; 6] = [
    &["accuracy"],
    &["commission", "--trials"],
    &["identify", "run.mcap", "out/identify"],
    &["instruments"],
    &["position", "--scene", "heavy_rotor"],
    &["sweep", "--plan"],
];

/// What builds the firmware and runs it in QEMU, or needs a board: it is parsed here and run in `tests/qemu` and
/// `tests/serial`. So is all that has a port.
const IN_QEMU: [&str; 7] = ["instructions", "jog", "parts", "pil", "run", "self-test", "size"];

/// What does not belong to the project and is left alone.
const OTHER_PROGRAMS: [&str; 5] = ["cd", "git", "rustup", "curl", "python3"];

/// Commands of cargo that name nothing of the project's.
const CARGO_ONLY: [&str; 3] = ["fmt", "doc", "clippy"];

/// The documents.
fn documents() -> Vec<PathBuf> {
    let mut documents = files_below(&root().join("docs"), "md");
    documents.insert(0, root().join("README.md"));
    documents
}

/// Where a command stands in its document.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Place {
    /// A line of a block: it is executed.
    Block,
    /// Code in the prose, which may leave out what does not matter there: it is parsed.
    Prose,
}

/// The commands of a text, with the number of their first line.
fn commands(text: &str) -> Vec<(usize, Place, String)> {
    let mut found = Vec::new();
    // The language of the block that a line is in.
    let mut block: Option<&str> = None;
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        if let Some(fence) = line.trim_start().strip_prefix("```") {
            block = if block.is_some() { None } else { Some(fence.trim()) };
        } else if block == Some("sh") {
            let mut command = line.to_owned();
            while let Some(begun) = command.strip_suffix('\\') {
                let (_, next) = lines.next().expect("a command that ends");
                command = format!("{begun} {next}");
            }
            found.push((index + 1, Place::Block, command));
        } else if block.is_none() {
            let spans = line.split('`').skip(1).step_by(2);
            let of_ours = spans.filter(|span| span.starts_with("cargo ") || span.starts_with("host-sim "));
            found.extend(of_ours.map(|span| (index + 1, Place::Prose, span.to_owned())));
        }
    }
    found
}

/// The words of one command: without its comment, variables set for it, and where its output goes.
fn words(command: &str) -> Vec<String> {
    let words = shlex::split(command).unwrap_or_else(|| panic!("quotes that do not end: {command}"));
    let variable = |word: &String| {
        let name = word.split_once('=').map_or("", |(name, _)| name);
        !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
    };
    let kept = words.into_iter().skip_while(variable);
    kept.take_while(|word| !["|", ">", "&&", ";"].contains(&word.as_str())).collect()
}

/// `documented` with the flags of [`SMALLER`] in the place of its own. What joins parts makes
/// no runs: it only has to be of the parts' scene.
fn smaller(documented: &[String]) -> Vec<String> {
    let mut arguments = documented.to_vec();
    let joins = documented.iter().any(|word| word == "--merge");
    let Some(command) = documented.first() else { return arguments };
    let flags = SMALLER.iter().find(|(name, _)| name == command).map_or(&[][..], |(_, flags)| *flags);
    for (flag, value) in flags.iter().filter(|(flag, _)| !joins || *flag == "--set") {
        // `--set` may stand several times, for several keys.
        let at = if *flag == "--set" { None } else { arguments.iter().position(|word| word == flag) };
        match at {
            Some(at) if !value.is_empty() => (*value).clone_into(&mut arguments[at + 1]),
            Some(_) => {}
            None => {
                let added = [*flag, *value];
                arguments.extend(added.iter().filter(|word| !word.is_empty()).map(|word| (*word).to_owned()));
            }
        }
    }
    arguments
}

/// The file that standard output goes to, where a command names one after `>`.
fn output_file(command: &str) -> Option<String> {
    shlex::split(command)?.into_iter().skip_while(|word| word != ">").nth(1)
}

/// Arguments of `host-sim` that have been tried in any document.
type Tried = Mutex<HashSet<Vec<String>>>;

/// A reader of a document, who types its commands in a folder of their own.
struct Reader<'a> {
    folder: TempDir,
    tried: &'a Tried,
}

impl<'a> Reader<'a> {
    fn new(tried: &'a Tried) -> Self {
        Self { folder: folder(), tried }
    }

    /// Whether `arguments` stand in any document for the first time.
    fn is_first_with(&self, arguments: &[String]) -> bool {
        self.tried.lock().unwrap_or_else(PoisonError::into_inner).insert(arguments.to_vec())
    }

    /// Standard output of a command that succeeds.
    fn succeeds(&self, arguments: &[String]) -> Result<Vec<u8>, String> {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = run(self.folder.path(), &arguments);
        let complaint = String::from_utf8_lossy(&output.stderr);
        if output.status.success() {
            Ok(output.stdout)
        } else {
            Err(format!("host-sim {arguments:?}: {complaint}"))
        }
    }
}

/// Whether a later command of the document may read what this one writes.
fn keeps_a_file(arguments: &[String]) -> bool {
    let named = ["--out", "--log", "--report"];
    arguments.first().is_some_and(|command| command == "init")
        || arguments.iter().any(|word| named.contains(&word.as_str()))
}

/// The command with its arguments is parsed as it stands, and runs, unless it stands in prose, needs QEMU or is long.
/// What it prints goes to `file`, for the commands after it. What another document has too, and leaves no file, is not
/// repeated.
fn check_host_sim(
    reader: &Reader,
    place: Place,
    arguments: &[String],
    file: Option<&str>,
) -> Result<(), String> {
    let parsed = [arguments, &["--help".to_owned()]].concat();
    if reader.is_first_with(&parsed) {
        reader.succeeds(&parsed)?;
    }
    let in_qemu = arguments.first().is_some_and(|command| IN_QEMU.contains(&command.as_str()))
        || arguments.iter().any(|of| of == "--port");
    let is_long = LONG.iter().any(|words| words.iter().all(|word| arguments.iter().any(|of| of == word)));
    if place == Place::Prose || in_qemu || is_long {
        return Ok(());
    }
    let arguments = smaller(arguments);
    if !reader.is_first_with(&arguments) && file.is_none() && !keeps_a_file(&arguments) {
        return Ok(());
    }
    let printed = reader.succeeds(&arguments)?;
    let Some(file) = file else { return Ok(()) };
    fs::write(reader.folder.path().join(file), printed).map_err(|error| format!("{file}: {error}"))
}

fn manifest(folder: &str) -> Result<Table, String> {
    let path = root().join(folder).join("Cargo.toml");
    let text = fs::read_to_string(path).map_err(|error| format!("{folder}: {error}"))?;
    text.parse().map_err(|error| format!("{folder}: {error}"))
}

/// The folder of a package, whose name in the registry may be another than that of its folder.
fn folder_of(package: &str) -> Result<String, String> {
    let workspace: Table = manifest(".")?;
    let members = workspace["workspace"]["members"].as_array().into_iter().flatten();
    let is_it = |folder: &&str| {
        manifest(folder).is_ok_and(|manifest| manifest["package"]["name"].as_str() == Some(package))
    };
    let folder = members.filter_map(Value::as_str).find(is_it);
    folder.map(str::to_owned).ok_or_else(|| format!("no package {package}"))
}

fn there(path: &str) -> Result<(), String> {
    if root().join(path).exists() { Ok(()) } else { Err(format!("{path}: no such file")) }
}

/// What the flags of a cargo command name is there.
fn check_flags(flags: &[String]) -> Result<(), String> {
    let value = |names: &[&str]| {
        let at = flags.iter().position(|word| names.contains(&word.as_str()));
        at.and_then(|at| flags.get(at + 1)).map(String::as_str)
    };
    let folder = match value(&["-p", "--package"]) {
        Some(package) => folder_of(package)?,
        None => "host-sim".to_owned(),
    };
    if let Some(path) = value(&["--path"]) {
        there(&format!("{path}/Cargo.toml"))?;
    }
    if let Some(bench) = value(&["--bench"]) {
        let benches = manifest("benches")?;
        let named = benches["bench"].as_array().into_iter().flatten();
        let known =
            named.filter_map(|table| table.get("name").and_then(Value::as_str)).any(|name| name == bench);
        known.then_some(()).ok_or(format!("no benchmark {bench}"))?;
    }
    if let Some(program) = value(&["--bin", "--example"]) {
        let programs = if flags.iter().any(|word| word == "--example") { "examples" } else { "src/bin" };
        there(&format!("{folder}/{programs}/{program}.rs"))?;
    }
    if let Some(features) = value(&["--features"]) {
        let manifest = manifest(&folder)?;
        for feature in features.split(',') {
            let known = manifest.get("features").and_then(|table| table.get(feature));
            known.map(|_| ()).ok_or(format!("no feature {feature}"))?;
        }
    }
    Ok(())
}

fn check_cargo(reader: &Reader, place: Place, words: &[String], file: Option<&str>) -> Result<(), String> {
    let split = words.iter().position(|word| word == "--").unwrap_or(words.len());
    let (flags, arguments) = (&words[..split], words.get(split + 1..).unwrap_or(&[]));
    check_flags(flags)?;
    let other_package = flags.iter().any(|word| ["-p", "--package", "--example"].contains(&word.as_str()));
    match flags.first().map(String::as_str) {
        Some("run") if !other_package => check_host_sim(reader, place, arguments, file),
        Some("run" | "bench" | "build" | "test" | "install") => Ok(()),
        Some(name) if CARGO_ONLY.contains(&name) => Ok(()),
        other => Err(format!("cargo {other:?}: this test does not know it")),
    }
}

/// A script of the project's is there, and its text or a program of the firmware's has the words that it is called
/// with.
fn check_script(script: &str, arguments: &[String]) -> Result<(), String> {
    let text = fs::read_to_string(root().join(script)).map_err(|error| format!("{script}: {error}"))?;
    let programs = ["firmware/src/bin", "firmware-checks/src/bin"];
    let known = |word: &str| {
        let program = programs.iter().any(|folder| there(&format!("{folder}/{word}.rs")).is_ok());
        let named = text.split(|c: char| c.is_whitespace() || "|,)(;".contains(c)).any(|part| part == word);
        program || named || word.parse::<f64>().is_ok()
    };
    let unknown = arguments.iter().find(|word| !known(word));
    unknown.map_or(Ok(()), |word| Err(format!("{script}: it does not know {word}")))
}

fn check(reader: &Reader, place: Place, command: &str) -> Result<(), String> {
    let mut words = words(command);
    let file = output_file(command);
    if place == Place::Prose {
        // What follows a word in capitals or dots is left to the reader.
        let open = |word: &String| word.contains("...") || word.contains('…') || *word == word.to_uppercase();
        let end = words.iter().position(|word| word.chars().any(char::is_alphabetic) && open(word));
        words.truncate(end.unwrap_or(words.len()));
    }
    let Some((program, arguments)) = words.split_first() else { return Ok(()) };
    match program.as_str() {
        "cargo" => check_cargo(reader, place, arguments, file.as_deref()),
        "host-sim" => check_host_sim(reader, place, arguments, file.as_deref()),
        script if script.contains('/') => check_script(script, arguments),
        "pip" => arguments
            .iter()
            .filter(|word| word.starts_with("./"))
            .try_for_each(|folder| there(&format!("{folder}/pyproject.toml"))),
        "python" => arguments.first().map_or(Ok(()), |script| there(script)),
        other if OTHER_PROGRAMS.contains(&other) => Ok(()),
        other => Err(format!("{other}: this test does not know it")),
    }
}

/// How many commands in blocks a document has, and which of its commands fail.
fn check_document(document: &Path, tried: &Tried) -> (usize, Vec<String>) {
    let reader = Reader::new(tried);
    let name = document.strip_prefix(root()).expect("in the repository").display();
    let mut in_blocks = 0;
    let mut failures = Vec::new();
    for (line, place, command) in commands(&text(document)) {
        in_blocks += usize::from(place == Place::Block);
        if let Err(why) = check(&reader, place, &command) {
            failures.push(format!("{name}:{line}: {command}\n    {why}"));
        }
    }
    (in_blocks, failures)
}

/// The documents are tried side by side: most commands leave one of two processors idle.
#[test]
fn tool_every_documented_command_runs() {
    let tried = Tried::default();
    let checked: Vec<_> = documents().par_iter().map(|document| check_document(document, &tried)).collect();
    let in_blocks: usize = checked.iter().map(|(in_blocks, _)| in_blocks).sum();
    let failures: Vec<String> = checked.into_iter().flat_map(|(_, failures)| failures).collect();
    assert!(in_blocks > 1, "no commands found");
    assert!(failures.is_empty(), "{} commands fail:\n{}", failures.len(), failures.join("\n"));
}

/// The check itself: what it must refuse, and what it must leave alone.
#[test]
fn tool_wrong_commands_are_found() {
    let tried = Tried::default();
    let reader = Reader::new(&tried);
    for command in [
        "cargo run --release -- simulat",
        "cargo run --release -- simulate --durations 1",
        "cargo run --release -- size --boards m4",
        "cargo run --release -- simulate --set motor.frictoin=0.4 --duration 0.6",
        "cargo run --release --features piers",
        "cargo bench --bench steps",
        "cargo run -p firmwares --release",
        "pip install ./pithon numpy",
        "python python/benches/calman.py",
        "tests/ran.sh",
        "tests/run.sh quicker",
        "unknown --flag",
    ] {
        assert!(check(&reader, Place::Block, command).is_err(), "{command}");
    }
    for command in
        ["", "# a comment", "tests/run.sh quick", "cd host-sim", "cargo run --release -- keys # all"]
    {
        assert_eq!(check(&reader, Place::Block, command), Ok(()), "{command}");
    }
    let text = "`cargo bench` and `host-sim keys COMMAND`\n```sh\nA=b cargo run -- \\\n  keys\n```\n```text\nno\n```";
    let found = commands(text);
    assert_eq!(found.iter().map(|(line, ..)| *line).collect::<Vec<_>>(), [1, 1, 3]);
    assert_eq!(words(&found[2].2), ["cargo", "run", "--", "keys"]);
}
