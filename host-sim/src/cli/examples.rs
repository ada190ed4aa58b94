//! Examples at the end of every command's help.

/// Commands, each with what its examples do and how they are written; the name of the program stands before each.
pub(super) const EXAMPLES: &[(&str, &[(&str, &str)])] = &[
    (
        "simulate",
        &[
            ("How fast mode B turns the rotor", "simulate --drive b"),
            ("Walking, and the motion as a table", "simulate --drive c --amplitude 0.3 --out walk.csv"),
            ("The motor that tilts, in JSON", "simulate --drive b --scene set_f --format json"),
            ("The impacts in slow motion", "simulate --drive b --report motion.html"),
        ],
    ),
    (
        "position",
        &[
            ("Counter-clockwise by 37 degrees", "position --to -37"),
            ("The same as a report for a colleague", "position --to -37 --report move.html"),
            ("What the move will take, without moving", "position --to 37 --tolerance 0.005 --plan"),
            ("All of it in a log, for Foxglove or PlotJuggler", "position --to 20 --log move.mcap"),
            (
                "The camera is blind for 10 ms, then the drive gets weak",
                "position --fault camera:lost@0.05..0.06 --fault drive:weak:0.7@0.08..",
            ),
        ],
    ),
    (
        "commission",
        &[
            ("A motor of which only the design is known", "commission --seed 3 --out mine"),
            ("Its map, as the move that follows takes it", "commission --seed 3 --format json"),
            (
                "A motor that tilts, and is fastest at half drive",
                "commission --scene set_f_plant --out tilting",
            ),
            ("The first of two parts of ten motors", "commission --trials 10 --shard 1/2 --out part1"),
            ("The parts together", "commission --merge part1/trials.postcard part2/trials.postcard"),
        ],
    ),
    (
        "rate",
        &[
            ("100 degrees a second for 5 s", "rate --deg-s 100 --duration 5"),
            ("Five steps up to 500", "rate --profile staircase --deg-s 500"),
            ("With a report of pictures and figures", "rate --duration 2 --report rate.html"),
            ("A table for pandas, polars or MATLAB", "rate --duration 1 --log rate.parquet"),
        ],
    ),
    (
        "import",
        &[
            (
                "Frames and samples of one table",
                "import --camera run.csv --camera-angle phi_deg --vibrometer run.csv --vibrometer-velocity v_mm_s",
            ),
            (
                "A camera that counts the other way, on a clock that is 12.5 ms ahead and 35 ppm fast",
                "import --camera camera.csv --camera-scale -1 --camera-clock 0.0125,35 --log run.mcap",
            ),
            (
                "A sweep of the teeth without a rotor",
                "import --model stator --vibrometer v.csv --drive d.csv --drive-frequency f_hz --log sweep.mcap",
            ),
        ],
    ),
    (
        "record",
        &[
            (
                "Half a second of each mode, and how the rotor comes to rest",
                "record --schedule 'b:1 for 0.5, off for 0.1, c:1 for 0.5, off for 0.1' --log run.mcap",
            ),
            (
                "The teeth without a rotor: a sweep through mode B",
                "record --model stator --schedule 'b:0.2@6250..6350 for 1' --log sweep.mcap",
            ),
        ],
    ),
    (
        "identify",
        &[
            (
                "What two recordings of a motor tell",
                "identify run.mcap ring.mcap --out mine --report mine.html",
            ),
            ("The same without looking for what would tell more", "identify run.mcap --no-advice"),
            ("How often the intervals hold the truth", "identify --calibration 200"),
        ],
    ),
    (
        "replay",
        &[
            ("Whether this program computes what was recorded", "replay run.mcap"),
            ("What the camera alone would have told", "replay run.mcap --filter constant_rate"),
            (
                "With another noise assumed, the estimates in a table",
                "replay run.mcap --set estimator.assumed.camera.noise_m=2e-6 --log again.csv",
            ),
        ],
    ),
    (
        "explain",
        &[
            ("The course of a run in sentences", "explain run.mcap"),
            ("The same for programs", "explain run.mcap --format json"),
        ],
    ),
    (
        "calibrate",
        &[
            ("One gyroscope in 20 s", "calibrate --duration 20"),
            ("A worse one of ten", "calibrate --runs 10 --set gyroscope.random_walk_deg_rh=1"),
            ("The first of two parts", "calibrate --runs 10 --shard 1/2 --out part1"),
            ("The parts together", "calibrate --merge part1/runs.csv part2/runs.csv"),
        ],
    ),
    (
        "estimate",
        &[
            ("All filters on two motors", "estimate --motors 2"),
            ("The same as a report", "estimate --motors 2 --report estimate.html"),
            (
                "The same with the wrong sign of the vibrometer",
                "estimate --motors 2 --fault ldv:inverted@0.2..",
            ),
            (
                "What the twin's error is made of",
                "estimate --motors 2 --told tooth-velocity,jump,small-impacts",
            ),
            ("The first of two parts", "estimate --motors 2 --shard 1/2 --out part1"),
            ("The parts together", "estimate --merge part1/motors.postcard part2/motors.postcard"),
        ],
    ),
    (
        "compare",
        &[
            ("What a change of the program changed", "compare before.json after.json"),
            (
                "In continuous integration: exit code 1 for a change beyond noise",
                "compare before.json after.json --fail-on-change --report changes.html",
            ),
        ],
    ),
    ("filters", &[("Cost and error on the host alone", "filters --motors 2 --host-only")]),
    (
        "positioning-trials",
        &[
            ("20 moves", "positioning-trials --motors 20"),
            (
                "With a report of pictures and intervals",
                "positioning-trials --motors 20 --report trials.html",
            ),
            ("Beside simpler strategies", "positioning-trials --motors 20 --compare 2"),
            ("The first of two parts", "positioning-trials --motors 20 --shard 1/2 --out part1"),
            ("The parts together", "positioning-trials --merge part1/trials.csv part2/trials.csv"),
        ],
    ),
    (
        "instruments",
        &[
            ("The first of four parts", "instruments --motors 1 --shard 1/4 --out part1"),
            ("The parts together", "instruments --merge part1/moves.csv part2/moves.csv"),
        ],
    ),
    (
        "faults",
        &[
            ("20 moves, of both rotors", "faults --runs 20 --beside set_f_plant"),
            ("The first of four parts", "faults --runs 40 --shard 1/4 --out part1"),
            ("The parts together", "faults --merge part1/runs.csv part2/runs.csv"),
        ],
    ),
    (
        "stator",
        &[
            ("The paper's stator in JSON", "stator --format json"),
            ("Thinner silicon", "stator --set stator.silicon_thickness_m=50e-6"),
            ("A drawing that meets the frequencies of the design", "stator --fit"),
            ("With the stress of bonding", "stator --set stator.stressed=yes --report stator.html"),
            ("The first of two parts of an ensemble", "stator --ensemble 30 --shard 1/2 --out part1"),
            ("The parts together", "stator --merge part1/members.csv part2/members.csv"),
        ],
    ),
    (
        "sweep",
        &[
            (
                "How the error of a move depends on the camera, each point with 4 motors",
                "sweep --of position --over camera.noise_m=1e-7..1e-5:log:5 --figure final_error_mdeg --repeats 4",
            ),
            (
                "64 motors of a Sobol sequence, in open loop",
                "sweep --of simulate --over motor.friction=0.1..0.5 --over motor.restitution=0.4..0.8 --sobol 64 \
                 --figure rotor_rate_mean_rad_s",
            ),
            (
                "Which of three keys decides",
                "sweep --over camera.noise_m=0..5e-6 --over ldv.noise_m_s=0..1e-3 --over plant.motor.friction=0.1..0.5 \
                 --indices 128 --figure final_error_mdeg",
            ),
            (
                "What it would cost, here and on clusters",
                "sweep --over seed=1..1000000:1000000 --figure final_error_mdeg --plan --cores 64",
            ),
            (
                "As an array of Slurm jobs of half an hour",
                "sweep --over seed=1..1000000:1000000 --figure final_error_mdeg --slurm --out million",
            ),
            (
                "The first of four parts, to go on with when it was interrupted",
                "sweep --over seed=1..1000:1000 --figure final_error_mdeg --shard 1/4 --resume --out part1",
            ),
        ],
    ),
    ("merge", &[("Two parts together", "merge part1 part2 --out whole")]),
    (
        "response-map",
        &[(
            "A map of another design for --map",
            "response-map --scene heavy_rotor --motors 4 --out map.toml",
        )],
    ),
    (
        "reproduce",
        &[
            ("Two runs of each motor of the paper", "reproduce --seeds 2 --drawn 4"),
            ("Every figure in a fraction of the time", "reproduce --seeds 2 --drawn 4 --quick"),
        ],
    ),
    ("accuracy", &[("Every figure in seconds", "accuracy --quick")]),
    (
        "instructions",
        &[
            ("Operations on a Cortex-M4F", "instructions --board m4"),
            ("Cycles instead", "instructions --cycles"),
        ],
    ),
    (
        "pil",
        &[
            ("A move by 2 degrees on a Cortex-M7", "pil --board m7 --to 2"),
            ("A rate for half a second", "pil --deg-s 160 --duration 0.5"),
        ],
    ),
    (
        "run",
        &[
            (
                "A real board moves the simulated motor",
                "run --port /dev/ttyACM0 --to 5 --set camera.frame_rate_hz=1000 --set ldv.installed=no",
            ),
            (
                "A real board holds a rate of the simulated motor",
                "run --port /dev/ttyACM0 --deg-s 160 --duration 5 --set camera.frame_rate_hz=1000 \
                 --set ldv.installed=no",
            ),
            (
                "A real motor, by the frames of a camera program",
                "run --port /dev/ttyACM0 --camera frames.fifo --to 5 --set camera.frame_rate_hz=1000 --log run.mcap",
            ),
        ],
    ),
    (
        "jog",
        &[
            ("A fifth of a second clockwise", "jog --port /dev/ttyACM0 --mode B --level 0.5 --duration 0.2"),
            (
                "The other way, 20 Hz above the mode",
                "jog --port /dev/ttyACM0 --mode C --level 1 --set jog.offset_hz=20",
            ),
        ],
    ),
    (
        "self-test",
        &[
            ("A board, and the simulated camera", "self-test --port /dev/ttyACM0"),
            ("With the real camera", "self-test --port /dev/ttyACM0 --camera frames.fifo"),
        ],
    ),
    ("size", &[("Flash, RAM and stack in JSON", "size --format json")]),
    ("parts", &[("The filter for each part", "parts")]),
    ("results", &[("One page", "results rate"), ("Whether the pages are those of today", "results --check")]),
    ("keys", &[("Those that a command reads", "keys rate"), ("The words of faults", "keys --faults")]),
    (
        "init",
        &[
            ("A scene file of every key", "init scene.toml"),
            ("Of the keys of one command", "init rate.toml --for rate"),
        ],
    ),
    (
        "scene",
        &[
            ("What a file and a flag set", "scene heavy_rotor --set camera.marks=3 --only-set"),
            ("Every key that rate reads, in JSON", "scene --for rate --format json"),
        ],
    ),
    (
        "scenes",
        &[
            ("The gallery", "scenes"),
            ("The file of a scene, to begin one's own with", "scenes heavy_rotor > mine.toml"),
        ],
    ),
    ("completions", &[("For this shell", "completions bash > host-sim.bash && source host-sim.bash")]),
    ("man", &[("A page for each command", "man --out man && man man/host-sim-position.1")]),
];

/// Examples of no command.
const FIRST_STEPS: &[(&str, &str)] = &[
    ("Move a motor by 90 degrees and draw it", ""),
    ("See what there is to look at", "scenes"),
    ("Begin a scene of one's own", "init scene.toml"),
    ("Run it", "position --scene scene.toml"),
];

/// What the exit codes mean.
pub(super) const EXIT_CODES: &str = "Exit codes:
  0  done, also when a move ended off its target: the result says so
  1  compare --fail-on-change found a change
  2  refused, failed, or a check did not hold; one line on standard error says why
  130  interrupted (Ctrl-C) during a log or a sweep; one line on standard error says what is kept";

/// The end of a command's help.
fn section(examples: &[(&str, &str)]) -> String {
    let lines = examples
        .iter()
        .map(|(what, command)| format!("  # {what}\n  host-sim {command}").trim_end().to_owned());
    format!("Examples:\n{}", lines.collect::<Vec<_>>().join("\n"))
}

/// The command line with examples at the end of each help.
pub(super) fn added_to(mut command: clap::Command) -> clap::Command {
    for (name, examples) in EXAMPLES {
        command = command.mut_subcommand(name, |sub| sub.after_help(section(examples)));
    }
    command.after_help(format!("{}\n\n{EXIT_CODES}", section(FIRST_STEPS)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::{CommandFactory as _, Parser as _};
    use simulation::scene::registry;

    /// Each command has examples of its own, they are parsed, and the keys that they set exist.
    #[test]
    fn tool_every_help_has_examples_that_are_parsed() {
        for command in Cli::command().get_subcommands() {
            let found = EXAMPLES.iter().find(|(name, _)| *name == command.get_name());
            let (name, examples) = found.unwrap_or_else(|| panic!("{}", command.get_name()));
            for (_, example) in *examples {
                assert!(example.starts_with(name), "{example}");
                let words = shlex::split(example).unwrap();
                let words = words.iter().map(String::as_str).take_while(|word| ![">", "&&"].contains(word));
                let line: Vec<&str> = std::iter::once("host-sim").chain(words).collect();
                assert!(Cli::try_parse_from(&line).is_ok(), "{example}");
                for set in line.windows(2).filter(|pair| pair[0] == "--set") {
                    let key = set[1].split('=').next();
                    assert!(registry().any(|setting| Some(setting.key) == key), "{example}");
                }
                for fault in line.windows(2).filter(|pair| pair[0] == "--fault") {
                    assert!(fault[1].parse::<simulation::scene::faults::Fault>().is_ok(), "{example}");
                }
            }
            let help = added_to(Cli::command()).find_subcommand_mut(name).unwrap().render_help().to_string();
            assert!(help.contains("Examples:\n  # ") && help.contains(examples[0].1), "{help}");
        }
        assert!(added_to(Cli::command()).render_help().to_string().contains(EXIT_CODES));
    }
}
