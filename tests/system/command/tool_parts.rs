//! Studies in parts: what the parts give together is what one process gives, whatever the threads.
//!
//! Row C6 of the faults to survive: here two threads make the whole, and one thread and seven the parts.

use std::path::Path;

use crate::support::built_command::{folder, output_on, refuses};

/// A study of `words`; `part` is the file of a part that `--merge` takes, and `results` what it writes.
struct Study {
    words: &'static [&'static str],
    scene: &'static [&'static str],
    part: &'static str,
    results: &'static [&'static str],
}

const STUDIES: [Study; 4] = [
    Study {
        words: &["positioning-trials", "--motors", "4"],
        scene: &["--seed", "5", "--set", "plant.step_s=1e-5"],
        part: "trials.csv",
        results: &["trials.csv", "positioning-trials.svg"],
    },
    Study {
        words: &["estimate", "--motors", "2"],
        scene: &["--set", "plant.step_s=1e-5"],
        part: "motors.postcard",
        results: &["table.csv", "estimate.svg"],
    },
    Study {
        words: &["calibrate", "--runs", "3", "--motors", "2"],
        scene: &[
            "--set",
            "plant.step_s=1e-5",
            "--set",
            "calibrate.duration_s=2",
            "--set",
            "calibrate.rest_s=0.05",
        ],
        part: "runs.csv",
        results: &["runs.csv", "calibrate.svg"],
    },
    Study {
        words: &["commission", "--trials", "2", "--moves", "2"],
        scene: &["--seed", "5", "--set", "plant.step_s=1e-5"],
        part: "trials.postcard",
        results: &["trials.csv", "commissioning-trials.svg"],
    },
];

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn exact_parts_on_any_threads_are_the_whole() {
    for Study { words, scene, part, results } in STUDIES {
        let folder = folder();
        let of = |threads, words: &[&str], further: &[&str]| {
            let format = ["--format", "json"];
            output_on(threads, folder.path(), &[words, scene, &format, further].concat())
        };
        let whole = of(2, words, &["--out", "whole"]);
        of(1, words, &["--shard", "1/2", "--out", "one"]);
        of(7, words, &["--shard", "2/2", "--out", "two"]);
        let [one, two] = ["one", "two"].map(|folder| format!("{folder}/{part}"));
        // In another order, and one of them twice.
        let merge = ["--merge", &two, &one, &two, "--out", "merged"];
        let merged = of(2, &words[..1], &merge);
        assert_eq!(String::from_utf8_lossy(&merged), String::from_utf8_lossy(&whole), "{words:?}");
        for name in results {
            let [whole, merged] = ["whole", "merged"].map(|of| bytes(folder.path(), &format!("{of}/{name}")));
            assert!(whole == merged, "{words:?}: {name} differs");
        }
        refuses(
            folder.path(),
            &[&words[..1], scene, &["--merge", &two]].concat(),
            &["the parts are not one whole: run 0 is missing", "hint: --merge"],
        );
        let other = ["--set", "camera.noise_m=3e-6"];
        of(2, words, &[&other[..], &["--shard", "2/2", "--out", "other"]].concat());
        let other_part = format!("other/{part}");
        refuses(
            folder.path(),
            &[&words[..1], scene, &["--merge", &one, &other_part]].concat(),
            &[&format!("other/{part} is of another scene than one/{part}: its digest is "), "; hint: "],
        );
        refuses(
            folder.path(),
            &[&words[..1], scene, &other, &["--merge", &one, &two]].concat(),
            &[&format!("one/{part} is of another scene than this command: its digest is "), "; hint: "],
        );
    }
}

#[test]
fn tool_parts_without_a_run_and_flags_that_have_none_are_refused() {
    let folder = folder();
    for (arguments, words) in [
        (&["estimate", "--motors", "2", "--shard", "3/3"][..], &["part 3/3 of 2 motors has none"][..]),
        (&["calibrate", "--runs", "2", "--shard", "3/3"], &["part 3/3 of 2 motors has none"]),
        (&["positioning-trials", "--motors", "1", "--shard", "2/2"], &["part 2/2 of 1 trials has none"]),
        (
            &["estimate", "--shard", "1/2", "--beside", "set_f_plant"],
            &["--beside is not made in parts", "hint"],
        ),
        (&["positioning-trials", "--shard", "1/2", "--compare", "1"], &["--compare is not made in parts"]),
        (&["commission", "--shard", "1/2"], &["--shard without --trials", "hint: --trials"]),
        (&["commission", "--trials", "2", "--shard", "3/3"], &["part 3/3 of 2 motors has none"]),
        (&["commission", "--merge", "trials.postcard", "--port", "nowhere"], &["--merge with --port"]),
        (&["estimate", "--merge", "nowhere.postcard"], &["cannot read nowhere.postcard"]),
    ] {
        refuses(folder.path(), arguments, words);
    }
}
