//! How the rate of mode B depends on what a builder can change. A measurement of one of these curves would test the
//! explanation: the height-only rotor is faster the stronger the drive, and has no hub.

use serde::Serialize;

use super::measured::MeasuredRun;
use super::variants::{EXPLAINING, VARIANTS};
use simulation::scene::{Scene, SceneError};

/// Something that is varied.
#[derive(Clone, Copy, Debug)]
pub struct Varied {
    /// Title of its picture.
    pub title: &'static str,
    /// Label of its axis, and the number of its units in one unit of the key.
    pub axis: (&'static str, f64),
    /// Key.
    pub key: &'static str,
    /// Values, rising.
    pub values: &'static [f64],
}

/// What is varied.
pub const PREDICTIONS: [Varied; 5] = [
    Varied {
        title: "Drive",
        axis: ("drive amplitude (of full)", 1.0),
        key: "simulate.amplitude",
        values: &[0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0],
    },
    Varied {
        title: "Length of the hole",
        axis: ("length (mm)", 1e3),
        key: "motor.hub.length_m",
        values: &[0.35e-3, 0.7e-3, 1e-3, 1.5e-3, 2e-3, 3e-3],
    },
    Varied {
        title: "Radial clearance",
        axis: ("clearance (um)", 1e6),
        key: "motor.hub.clearance_m",
        values: &[4e-6, 7e-6, 10e-6, 14e-6, 20e-6, 50e-6],
    },
    Varied {
        title: "Friction of the hub",
        axis: ("coefficient of friction (1)", 1.0),
        key: "motor.hub.friction",
        values: &[0.0, 0.1, 0.2, 0.4, 0.6],
    },
    Varied {
        title: "Ceiling",
        axis: ("height of the ceiling (um)", 1e6),
        key: "motor.ceiling.height_m",
        values: &[20e-6, 35e-6, 50e-6, 75e-6, 100e-6, 150e-6],
    },
];

/// The rate of mode B against one thing that is varied, for one rotor.
#[derive(Clone, Debug, Serialize)]
pub struct Prediction {
    /// The rotor.
    pub rotor: &'static str,
    /// Title of the picture.
    pub title: &'static str,
    /// Key that is varied.
    pub key: &'static str,
    /// Each value and its runs.
    pub points: Vec<(f64, Vec<MeasuredRun>)>,
}

/// The scene of every point, in the order of [`collect`].
///
/// # Errors
/// When one is refused, which a test excludes.
pub fn scenes() -> Result<Vec<Scene>, SceneError> {
    let mut scenes = Vec::new();
    for varied in &PREDICTIONS {
        for rotor in EXPLAINING.map(|index| VARIANTS[index]) {
            for value in varied.values {
                let mut scene = rotor.scene()?;
                scene.set(varied.key, &format!("{value:e}"))?;
                scenes.push(scene);
            }
        }
    }
    Ok(scenes)
}

/// The predictions from the runs of every point, which `next` gives in turn.
pub fn collect(mut next: impl FnMut() -> Vec<MeasuredRun>) -> Vec<Prediction> {
    let mut predictions = Vec::new();
    for varied in &PREDICTIONS {
        for rotor in EXPLAINING.map(|index| VARIANTS[index]) {
            predictions.push(Prediction {
                rotor: rotor.name,
                title: varied.title,
                key: varied.key,
                points: varied.values.iter().map(|&value| (value, next())).collect(),
            });
        }
    }
    predictions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_every_point_is_a_scene_and_finds_its_runs() {
        let scenes = scenes().unwrap();
        let mut taken = 0;
        let predictions = collect(|| {
            taken += 1;
            Vec::new()
        });
        assert_eq!(taken, scenes.len());
        let values = predictions.iter().flat_map(|of| of.points.iter().map(|point| (of.key, point.0)));
        for (scene, (key, value)) in scenes.iter().zip(values) {
            assert!((scene.number(key) - value).abs() <= 1e-12 * value.abs(), "{key}");
        }
    }
}
