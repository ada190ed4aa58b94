//! Which keys of a scene a run reads, for tests of what the commands say that they read.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use super::Scene;

/// The keys that a scene and its copies were asked for before a copy overwrote them.
#[derive(Clone, Debug, Default)]
pub struct Reads {
    /// Shared by all copies of a scene.
    read: Arc<Mutex<BTreeSet<&'static str>>>,
    /// Keys of this copy whose values come from the program.
    overwritten: BTreeSet<&'static str>,
}

impl Reads {
    pub(super) fn read(&self, key: &'static str) {
        if !self.overwritten.contains(key) {
            self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(key);
        }
    }

    pub(super) fn overwrite(&mut self, key: &'static str) {
        self.overwritten.insert(key);
    }
}

/// What was read of a scene is no part of its value.
impl PartialEq for Reads {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Scene {
    /// The same scene, of which nothing was read, and whose values all come from the user.
    #[must_use]
    pub fn unread(&self) -> Self {
        Self { reads: Reads::default(), ..self.clone() }
    }

    /// The keys that this scene and its copies were asked for, without those that the program overwrote first.
    pub fn keys_read(&self) -> BTreeSet<&'static str> {
        self.reads.read.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
