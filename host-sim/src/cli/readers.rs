//! Which command reads which key of a scene, and the refusal of every other key.
//!
//! A key that a command would ignore or overwrite is refused before anything runs, wherever it is set: in a scene file,
//! by `--set` or by a flag.

use simulation::scene::{SceneError, registry};

/// A command that takes a scene, and the keys that it reads.
#[derive(Debug)]
pub(super) struct Reader {
    /// Name on the command line.
    pub command: &'static str,
    /// Keys, and first words of keys: `seed`, `motor` for every `motor.*`, `estimator.assumed` for every
    /// `estimator.assumed.*`.
    reads: &'static [&'static str],
    /// The same of this command alone, beside those that it shares with others.
    also: &'static [&'static str],
    /// Keys, and first words of keys, whose values come from the command itself.
    overwrites: &'static [&'static str],
}

/// A command that sets no key itself.
const fn reader(command: &'static str, reads: &'static [&'static str]) -> Reader {
    Reader { command, reads, also: &[], overwrites: &[] }
}

/// A command that runs a real board.
const fn run_reader(command: &'static str, reads: &'static [&'static str]) -> Reader {
    Reader { also: &["run"], ..reader(command, reads) }
}

/// What a recording reads. No filter runs; what is assumed of the instruments is checked with the instruments, and what
/// shifts the marks tells which pictures are right.
const RECORD_READS: [&str; 15] = [
    "seed",
    "motor",
    "plant",
    "camera",
    "ldv",
    "fault",
    "faults",
    "record",
    "estimator.assumed.camera.frame_rate_hz",
    "estimator.assumed.camera.latency_frames",
    "estimator.assumed.camera.latency_s",
    "estimator.assumed.camera.vibration_m",
    "estimator.assumed.hub.clearance_m",
    "estimator.assumed.ldv.bits",
    "estimator.assumed.ldv.range_m_s",
];

/// What is read for a move.
const MOVE: [&str; 14] = [
    "seed",
    "motor",
    "plant",
    "camera",
    "ldv",
    "fault",
    "faults",
    "estimator",
    "board",
    "position",
    "limits.least_deg",
    "limits.greatest_deg",
    "limits.drive_on_s",
    "limits.amplitude_max",
];

/// What is read for a rate that a board holds, from the start to the end.
const BOARD_RATE: [&str; 15] = [
    "seed",
    "motor",
    "plant",
    "camera",
    "ldv",
    "fault",
    "faults",
    "estimator",
    "board",
    "rate.deg_s",
    "rate.duration_s",
    "limits.least_deg",
    "limits.greatest_deg",
    "limits.drive_on_total_s",
    "limits.amplitude_max",
];

/// What commissioning reads.
const COMMISSION: [&str; 12] = [
    "seed",
    "motor",
    "plant",
    "camera",
    "ldv",
    "fault",
    "faults",
    "estimator",
    "board",
    "limits.least_deg",
    "limits.greatest_deg",
    "limits.amplitude_max",
];

/// What is read for a move or a rate of a board.
const BOARD: [&str; 13] = [
    "seed",
    "motor",
    "plant",
    "camera",
    "ldv",
    "fault",
    "faults",
    "estimator",
    "board",
    "position",
    "rate.deg_s",
    "rate.duration_s",
    "limits",
];

/// What is read for a drive by hand: what a recording reads.
const JOG_READS: [&str; 15] = [
    "seed",
    "motor",
    "plant",
    "camera",
    "ldv",
    "fault",
    "faults",
    "jog",
    "estimator.assumed.camera.frame_rate_hz",
    "estimator.assumed.camera.latency_frames",
    "estimator.assumed.camera.latency_s",
    "estimator.assumed.camera.vibration_m",
    "estimator.assumed.hub.clearance_m",
    "estimator.assumed.ldv.bits",
    "estimator.assumed.ldv.range_m_s",
];

/// Every command that takes a scene.
pub(super) const READERS: [Reader; 18] = [
    reader("import", &["motor", "camera", "ldv", "estimator", "record.model"]),
    reader("simulate", &["seed", "motor", "simulate", "plant.rotor"]),
    reader("position", &MOVE),
    reader("commission", &COMMISSION),
    reader(
        "rate",
        &[
            "seed",
            "motor",
            "plant",
            "camera",
            "ldv",
            "fault",
            "faults",
            "estimator",
            "board",
            "rate",
            "limits.least_deg",
            "limits.greatest_deg",
            "limits.drive_on_total_s",
            "limits.amplitude_max",
        ],
    ),
    reader("record", &RECORD_READS),
    reader(
        "calibrate",
        &[
            "seed",
            "motor",
            "plant",
            "camera",
            "ldv",
            "gyroscope",
            "fault",
            "faults",
            "estimator",
            "board",
            "calibrate",
        ],
    ),
    reader("estimate", &["seed", "motor", "plant", "camera", "ldv", "fault", "faults", "estimator.assumed"]),
    Reader {
        overwrites: &["ldv.sample_rate_hz"],
        ..reader(
            "filters",
            &["seed", "motor", "plant", "camera", "ldv", "fault", "faults", "estimator.assumed"],
        )
    },
    Reader {
        overwrites: &["position.to_deg", "position.deadline_s", "position.hold_s"],
        ..reader("positioning-trials", &MOVE)
    },
    Reader { overwrites: &["camera.marks", "estimator.filter", "position"], ..reader("instruments", &MOVE) },
    Reader { overwrites: &["estimator.filter", "position"], ..reader("faults", &MOVE) },
    Reader {
        // Without instruments nothing happens by chance: no repetition.
        also: &["plant.rotor", "plant.parameters", "plant.impacts", "plant.friction", "plant.tolerance"],
        overwrites: &["plant.step_s", "plant.motor", "plant.stator"],
        ..reader("response-map", &["seed", "motor"])
    },
    reader("stator", &["stator", "motor"]),
    reader("pil", &BOARD),
    run_reader("run", &BOARD),
    reader("jog", &JOG_READS),
    reader("self-test", &["seed", "motor", "plant", "camera", "ldv", "fault", "faults", "estimator.assumed"]),
];

/// What `run` reads for a move.
pub(super) const RUN_MOVE: Reader = run_reader("run without --deg-s", &MOVE);

/// What `run` reads for a rate.
pub(super) const RUN_RATE: Reader = run_reader("run --deg-s", &BOARD_RATE);

/// What `pil` reads for a move.
pub(super) const PIL_MOVE: Reader = reader("pil without --deg-s", &MOVE);

/// What `pil` reads for a rate.
pub(super) const PIL_RATE: Reader = reader("pil --deg-s", &BOARD_RATE);

/// What `pil` reads for experiments.
pub(super) const PIL_COMMISSION: Reader = reader("pil --commission", &COMMISSION);

/// Whether `key` is one of `names` or begins with the words of one.
fn is_among(key: &str, names: &[&str]) -> bool {
    let begins =
        |name: &&str| key.strip_prefix(*name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    names.iter().any(begins)
}

impl Reader {
    /// The reader `command`.
    ///
    /// # Panics
    /// When no such command takes a scene: a slip in the program.
    pub fn named(command: &str) -> &'static Self {
        let reader = READERS.iter().find(|reader| reader.command == command);
        reader.unwrap_or_else(|| panic!("{command} is in no table of readers"))
    }

    /// Whether the command reads `key`.
    pub fn reads(&self, key: &str) -> bool {
        (is_among(key, self.reads) || is_among(key, self.also)) && !is_among(key, self.overwrites)
    }

    /// Takes `key` if the command reads it.
    ///
    /// # Errors
    /// When it does not; the hint names who does.
    pub fn admit(&self, key: &'static str) -> Result<(), SceneError> {
        if self.reads(key) {
            return Ok(());
        }
        let command = self.command;
        let refusal = if is_among(key, self.overwrites) {
            format!("{command} sets {key} itself")
        } else {
            format!("{command} does not read {key}")
        };
        let readers: Vec<&str> = readers_of(key).collect();
        let verb = if readers.len() == 1 { "reads" } else { "read" };
        let hint = format!("{} {verb} it{}", readers.join(", "), self.namesake(key));
        Err(SceneError::NotRead { refusal, hint })
    }

    /// What to set instead: the key of the command's own table with the last word of `key`, if there is one.
    fn namesake(&self, key: &str) -> String {
        let last = key.rsplit('.').next().unwrap_or(key);
        let own = format!("{}.{last}", self.command);
        registry()
            .find(|setting| setting.key == own)
            .map_or_else(String::new, |_| format!("; {} reads {own}", self.command))
    }
}

/// The commands that read `key`.
pub(super) fn readers_of(key: &str) -> impl Iterator<Item = &'static str> {
    READERS.iter().filter(move |reader| reader.reads(key)).map(|reader| reader.command)
}

#[cfg(test)]
mod tests;
