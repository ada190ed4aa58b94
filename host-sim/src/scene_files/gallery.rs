//! The gallery: scenes that are part of the program, each with what to look at and the command that shows it.
//!
//! A scene of the gallery is a file of the folder `scenes`. Its first line is a comment that says what to look at, the
//! second one the command. `--scene` takes its name as well as a path.
//!
//! The motor of a scene may have been commissioned. Its response map is a file of the folder `maps`, named as the
//! scene, and `--map` takes that name.

use std::path::{Path, PathBuf};

/// A scene of the gallery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GalleryScene {
    /// Name of the file, without its ending.
    pub name: &'static str,
    /// Text of the file.
    pub text: &'static str,
}

macro_rules! scenes {
    ($($name:literal)*) => {
        &[$(GalleryScene {
            name: $name,
            text: include_str!(concat!("../../scenes/", $name, ".toml")),
        }),*]
    };
}

/// All scenes, what a newcomer should see first.
pub const GALLERY: &[GalleryScene] = scenes! {
    "position_clockwise"
    "position_counter_clockwise"
    "rate_staircase"
    "rate_both_ways"
    "gyroscope"
    "bare_stator"
    "averaged_motor"
    "record_stator_sweep"
    "record_ring_down"
    "record_both_modes"
    "record_coast_down_tilting"
    "walking_burst"
    "heavy_rotor"
    "four_times_the_mass"
    "half_the_size"
    "half_the_size_stator"
    "higher_modes"
    "weak_mode_b"
    "slow_camera"
    "three_marks"
    "rough_instruments"
    "stm32g474"
    "stm32h743"
    "rp2350"
    "nominal_20um"
    "set_f"
    "set_g"
    "set_h"
    "set_f_plant"
    "set_g_plant"
    "stator_fem"
    "stator_fem_tilting"
    "stator_fem_plant"
    "hard_far_target"
    "hard_small_step"
    "hard_tight_tolerance"
    "hard_other_friction"
    "hard_off_resonance"
    "hard_bouncy_teeth"
    "hard_dead_teeth"
    "hard_no_friction"
    "fault_camera_lost"
    "fault_camera_stuck"
    "fault_camera_zeros"
    "fault_camera_other_feature"
    "fault_camera_intermittent"
    "fault_camera_outliers"
    "fault_camera_delayed"
    "fault_mark_false"
    "fault_marks_exchanged"
    "fault_ldv_lost"
    "fault_ldv_stuck"
    "fault_ldv_zeros"
    "fault_ldv_inverted"
    "fault_ldv_not_a_number"
    "fault_ldv_intermittent"
    "fault_ldv_outliers"
    "fault_ldv_offset"
    "fault_drive_weak"
    "fault_drive_dead"
    "fault_drive_dead_mode_c"
    "fault_drive_swapped"
    "fault_resonance_drift"
    "fault_rotor_jolt"
    "fault_rotor_stuck"
    "fault_hub_rub"
};

/// What `commission --scene NAME` has written as map.toml: the name, and the text.
const COMMISSIONED: &[(&str, &str)] = &[(COMMISSIONED_TILTING, include_str!("../../maps/set_f_plant.toml"))];

/// The scene of the gallery whose motor tilts and was commissioned: what the program shows when nothing is asked of it.
pub const COMMISSIONED_TILTING: &str = "set_f_plant";

/// The names of the maps of commissioned motors.
pub fn commissioned_names() -> impl Iterator<Item = &'static str> {
    COMMISSIONED.iter().map(|(name, _)| *name)
}

/// The text of the map of the motor that the scene of this name draws by its own seed, if it was commissioned.
#[must_use]
pub fn commissioned_map(name: &str) -> Option<&'static str> {
    let scene = GalleryScene::named(name)?;
    COMMISSIONED.iter().find(|map| map.0 == scene.name).map(|map| map.1)
}

impl GalleryScene {
    /// The scene of this name; `-` and `_` are alike.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        let name = name.replace('-', "_");
        GALLERY.iter().find(|scene| scene.name == name)
    }

    /// The scene whose name is most like `name`, unless none is.
    #[must_use]
    pub fn nearest(name: &str) -> Option<&'static Self> {
        let name = name.trim_end_matches(".toml").replace('-', "_");
        let alike = |scene: &Self| strsim::normalized_damerau_levenshtein(&name, scene.name);
        let scored = GALLERY.iter().map(|scene| (alike(scene), scene));
        let best = scored.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        (best.0 >= 0.5).then_some(best.1)
    }

    /// What to look at: its first line.
    #[must_use]
    pub fn look_at(&self) -> &'static str {
        self.comment(0)
    }

    /// The command that shows it: its second line.
    #[must_use]
    pub fn command(&self) -> &'static str {
        self.comment(1)
    }

    fn comment(&self, line: usize) -> &'static str {
        self.text.lines().nth(line).and_then(|line| line.strip_prefix("# ")).unwrap_or_default()
    }

    /// What messages call it in the place of a file's path.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        Path::new("gallery").join(format!("{}.toml", self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::scene::{Scene, parse_response_map};

    /// Each file of the folder is in the gallery, is a scene, and begins with what to look at and the command.
    #[test]
    fn exact_the_gallery_is_the_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|file| file.unwrap().file_name().into_string().unwrap().replace(".toml", ""))
            .collect();
        files.sort_unstable();
        let mut names: Vec<&str> = GALLERY.iter().map(|scene| scene.name).collect();
        names.sort_unstable();
        assert_eq!(files, names);
        for scene in GALLERY {
            Scene::default().set_all(scene.text, &scene.path()).unwrap_or_else(|error| panic!("{error}"));
            assert!(scene.look_at().len() > 20 && scene.look_at().ends_with('.'), "{}", scene.name);
            let begins = scene.command().starts_with("host-sim ");
            let named = scene.command().contains(&format!("--scene {}", scene.name));
            assert!(begins && named, "{}: {}", scene.name, scene.command());
        }
    }

    /// Each commissioned map belongs to a scene, and is a map that its moves can be planned by.
    #[test]
    fn exact_commissioned_maps_serve_their_scenes() {
        for (name, text) in COMMISSIONED {
            let of_gallery = GalleryScene::named(name).unwrap();
            let mut scene = Scene::default();
            scene.set_all(of_gallery.text, &of_gallery.path()).unwrap();
            let map = parse_response_map(text, &of_gallery.path()).unwrap();
            assert!(scene.with_response_map(map).response_map().is_ok(), "{name}");
            assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("maps/{name}.toml")).exists());
        }
        assert_eq!(commissioned_map("set-f-plant"), Some(COMMISSIONED[0].1));
        assert_eq!(commissioned_map("set_f"), None);
    }

    #[test]
    fn exact_names_are_found() {
        assert_eq!(GalleryScene::named("set-f").map(|scene| scene.name), Some("set_f"));
        assert_eq!(GalleryScene::named("set_f.toml"), None);
        assert_eq!(GalleryScene::nearest("heavy-roter.toml").map(|scene| scene.name), Some("heavy_rotor"));
        assert_eq!(GalleryScene::nearest("xyzzy"), None);
    }
}
