//! `sweep --slurm` and `sweep --hyperqueue` on real clusters of one node: a part that is stopped midway goes on, and
//! nothing is lost or doubled.
//!
//! Row S1 of the faults to survive: a part killed, run twice.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::built_command::{folder, json_on_two, refuses, succeeds, written};
use crate::support::checkout::root;
use crate::support::python::hyperqueue;
use crate::support::started::wait_until;

/// 2,000 rows of a millisecond or more, in parts of about a second.
const SWEEP: [&str; 9] = [
    "sweep",
    "--of=simulate",
    "--over=seed=1..2000:2000",
    "--figure=rotor_rate_mean_rad_s",
    "--set=simulate.duration_s=0.1",
    "--set=simulate.settle_s=1e-3",
    "--set=simulate.step_s=2e-6",
    "--format=json",
    "--part-time=1",
];

/// The sweep in one process that nothing happened to, made once for all tests.
fn one() -> &'static TempDir {
    static ONE: OnceLock<TempDir> = OnceLock::new();
    ONE.get_or_init(|| {
        let folder = folder();
        let one = [&SWEEP[..8], &["--out", "one"]].concat();
        assert_eq!(json_on_two(folder.path(), &one)["rows"], 2000);
        folder
    })
}

/// The rows and the manifest of a folder are those of one process.
#[track_caller]
fn assert_whole(folder: &Path, merged: &str) {
    for file in ["rows.parquet", "manifest.json"] {
        let [one, merged] = [one().path().join("one"), folder.join(merged)]
            .map(|of| std::fs::read(of.join(file)).expect("a file"));
        assert!(one == merged, "{file} differs");
    }
}

/// Rows in the journal of a part.
fn rows_done(folder: &Path, part: u64) -> usize {
    let journal = folder.join(format!("swept/parts/{part}/rows.partial.csv"));
    std::fs::read_to_string(journal).map_or(0, |text| text.lines().count().saturating_sub(1))
}

/// A Slurm cluster of this machine, which is stopped when it is dropped.
struct Slurm(PathBuf);

impl Slurm {
    fn start(folder: &Path) -> Self {
        let slurm = Self(folder.join("slurm"));
        let started = Self::script("start", &slurm.0);
        assert!(started.status.success(), "{}", String::from_utf8_lossy(&started.stderr));
        slurm
    }

    fn script(action: &str, folder: &Path) -> Output {
        let script = root().join("tests/cluster/slurm.sh");
        Command::new(script).arg(action).arg(folder).output().expect("bash")
    }

    /// Standard output of a program that finds the cluster.
    fn output(&self, folder: &Path, words: &[&str]) -> String {
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).current_dir(folder).env("SLURM_CONF", self.0.join("slurm.conf"));
        let output = command.output().expect("it starts");
        assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        Self::script("stop", &self.0);
    }
}

/// Slurm tells the first part to end, as it does before it takes a node away: the part keeps its rows, is queued again
/// by its own script, and goes on. The job that merges waits for it.
#[test]
fn tool_a_part_that_slurm_stops_goes_on() {
    let folder = folder();
    let slurm = Slurm::start(folder.path());
    let program = env!("CARGO_BIN_EXE_host-sim-under-test");
    let submit = [&[program], &SWEEP[..], &["--slurm", "--out", "swept"]].concat();
    let submitted: Value = serde_json::from_str(&slurm.output(folder.path(), &submit)).expect("JSON");
    assert!(submitted["parts"].as_u64().is_some_and(|parts| parts > 1), "{submitted}");
    let first = format!("{}_1", submitted["submitted"].as_str().expect("a number"));

    wait_until("a row of the first part", || rows_done(folder.path(), 1) > 10);
    // It repeats itself while the task is between two states.
    let mut told = Command::new("scancel");
    told.args(["--batch", "--signal=TERM", &first]).env("SLURM_CONF", slurm.0.join("slurm.conf"));
    let mut told = told.stderr(std::process::Stdio::null()).spawn().expect("scancel");
    let queued = || slurm.output(folder.path(), &["squeue", "--noheader", "--format=%i %r %T"]);
    wait_until("the first part in the queue", || queued().contains(&format!("{first} BeginTime")));
    let _ = told.kill();
    told.wait().expect("it ends");
    let done = rows_done(folder.path(), 1);
    assert!(done > 10, "{done}");
    let log = written(folder.path(), "swept/parts/1.log");
    assert!(log.contains(&format!("interrupted: {done} of ")), "{log}");
    // Slurm holds a job that is queued again back for two minutes. Three seconds do: it refuses a credential of the
    // second in which it revoked the earlier one, and the job then has failed.
    slurm.output(folder.path(), &["scontrol", "update", &format!("jobid={first}"), "StartTime=now+3"]);
    wait_until("the whole", || {
        let manifest = std::fs::read_to_string(folder.path().join("swept/manifest.json"));
        manifest.is_ok_and(|manifest| manifest.contains("\"complete\": true"))
    });
    assert_whole(folder.path(), "swept");
}

/// Process ids of the parts of a sweep in `folder` that run, by what they were started with.
fn process_of_part(folder: &Path, part: u64) -> Option<String> {
    let out = folder.join(format!("swept/parts/{part}"));
    let entries = std::fs::read_dir("/proc").expect("processes").flatten();
    let ids = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    ids.filter(|id| id.chars().all(|c| c.is_ascii_digit())).find(|id| {
        let words = std::fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
        let words: Vec<&[u8]> = words.split(|byte| *byte == 0).collect();
        words.get(1) == Some(&&b"sweep"[..]) && words.contains(&out.as_os_str().as_encoded_bytes())
    })
}

/// The first part is killed. The others end; the same command with `--resume` submits all parts again, of which the
/// first alone has something left to do.
#[test]
fn tool_a_part_that_is_killed_under_hyperqueue_goes_on() {
    let folder = folder();
    let python = hyperqueue();
    let script = root().join("tests/cluster/hyperqueue_cluster.py");
    let submit = |cluster: &str, further: &[&str]| {
        let mut command = Command::new(&python);
        command.arg(&script).arg(cluster).arg(env!("CARGO_BIN_EXE_host-sim-under-test")).args(SWEEP);
        command.args(["--hyperqueue", "--out", "swept"]).args(further).current_dir(folder.path());
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
        command.spawn().expect("python")
    };
    let first = submit("first", &[]);
    wait_until("a row of the first part", || rows_done(folder.path(), 1) > 10);
    let id = process_of_part(folder.path(), 1).expect("it runs");
    assert!(Command::new("kill").args(["-KILL", &id]).status().expect("kill").success());
    let first = first.wait_with_output().expect("it ends");
    assert_eq!(first.status.code(), Some(1), "{}", String::from_utf8_lossy(&first.stderr));
    let done = rows_done(folder.path(), 1);
    assert!(done > 10, "{done}");

    let parts: Value = serde_json::from_str(&written(folder.path(), "swept/job.json")).expect("JSON");
    let folders: Vec<String> =
        (1..=parts["parts"].as_u64().expect("a number")).map(|part| format!("swept/parts/{part}")).collect();
    let merge: Vec<&str> =
        ["merge", "--out", "swept"].into_iter().chain(folders.iter().map(String::as_str)).collect();
    refuses(folder.path(), &merge, &["swept/parts/1 has no finished sweep", "--resume"]);
    let again = submit("again", &["--resume"]).wait_with_output().expect("it ends");
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    succeeds(folder.path(), &merge);
    assert_whole(folder.path(), "swept");
}

#[test]
fn tool_arrays_are_refused_where_there_is_no_cluster_or_another_sweep() {
    let folder = folder();
    let flags = |further: &[&'static str]| [&SWEEP[..], further, &["--out", "swept"]].concat();
    refuses(folder.path(), &flags(&["--slurm", "--shard", "1/2"]), &["--slurm", "--shard"]);
    // Without a submitting program the scripts are there, and run by hand.
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim-under-test"));
    let refused = command.args(flags(&["--hyperqueue"])).current_dir(folder.path()).env("PATH", "/nowhere");
    let refused = refused.output().expect("it starts");
    let complaint = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{complaint}");
    assert!(complaint.contains("cannot run hq") && complaint.contains("hint"), "{complaint}");
    refuses(folder.path(), &flags(&["--hyperqueue"]), &["swept/job.json is there already", "--resume"]);
    refuses(
        folder.path(),
        &flags(&["--hyperqueue", "--resume", "--seed", "3"]),
        &["swept has another sweep", "job.json"],
    );
    let parts: Value = serde_json::from_str(&written(folder.path(), "swept/job.json")).expect("JSON");
    let script = folder.path().join("swept/sweep.sh");
    let last = parts["parts"].to_string();
    // Run again, it finds the part finished, and leaves its rows as they are.
    let rows = folder.path().join(format!("swept/parts/{last}/rows.parquet"));
    let [first, again] = [(); 2].map(|()| {
        let ran = Command::new("bash").arg(&script).arg(&last).output().expect("bash");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        std::fs::metadata(&rows).and_then(|rows| rows.modified()).expect("the part has rows")
    });
    assert_eq!(first, again, "the part was computed again");
    let manifest: Value =
        serde_json::from_str(&written(folder.path(), &format!("swept/parts/{last}/manifest.json")))
            .expect("JSON");
    assert_eq!((&manifest["complete"], &manifest["part"]["of"]), (&Value::Bool(true), &parts["parts"]));
}

/// What a plan says is its rows times the time of a row.
#[test]
fn tool_a_plan_says_what_a_sweep_costs() {
    let folder = folder();
    let plan = [&SWEEP[..8], &["--plan"]].concat();
    let cost = json_on_two(folder.path(), &plan);
    assert_eq!((&cost["rows"], &cost["measured_rows"]), (&2000.into(), &16.into()));
    let row_s = cost["row_s"].as_f64().expect("a number");
    assert!(row_s > 0.0, "{cost}");
    let text: Vec<&str> = plan.into_iter().filter(|word| *word != "--format=json").collect();
    let text = succeeds(folder.path(), &[&text[..], &["--cores", "8"]].concat());
    for words in ["Plan of a sweep, 2000 rows", "100    800 ", "1000   8000 "] {
        assert!(text.contains(words), "{words} is not in {text}");
    }
    assert!(!folder.path().join("out").exists(), "nothing is made");
}
