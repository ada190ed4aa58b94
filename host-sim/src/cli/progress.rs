//! What a command says on standard error beside its errors: how far it is, and notes. `--quiet` leaves both out.
//!
//! A progress bar shows only on a terminal.

use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

/// Whether the command was told to be quiet: of the whole process, as standard error is.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Leaves out progress and notes from now on.
pub(super) fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// A progress bar over so much work.
pub(super) fn bar(work: u64) -> ProgressBar {
    if QUIET.load(Ordering::Relaxed) {
        return ProgressBar::hidden();
    }
    let template = "{bar:40} {percent:>3} %, {eta} to go";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(work).with_style(style)
}

/// A few lines that are drawn anew with every message.
pub(super) fn lines() -> ProgressBar {
    if QUIET.load(Ordering::Relaxed) {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new_spinner().with_style(style)
}

/// A note, for people.
pub(super) fn note(text: &str) {
    if !QUIET.load(Ordering::Relaxed) {
        eprintln!("{text}");
    }
}

/// Says which keys of a scene of the gallery `command` has passed over, since it does not read them.
pub(super) fn note_passed_over(command: &str, keys: &[&str]) {
    if !keys.is_empty() {
        note(&format!("note: {command} passes over {} of this scene", keys.join(", ")));
    }
}
