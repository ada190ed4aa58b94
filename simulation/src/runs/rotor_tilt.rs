//! What a rotor that tilts did in a run, tick by tick: its tilt, and its shift on the pin.

use std::fmt;

use motor_model::math;
use serde::Serialize;

use crate::math::statistics::MeanSquare;
use crate::world::pose::RotorTilt;

/// The figures of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TiltFigures {
    /// Root mean square of the tilt.
    pub tilt_rms_mrad: f64,
    /// The largest tilt.
    pub tilt_max_mrad: f64,
    /// Root mean square of the distance of the rotor's mass centre from the pin's axis.
    pub shift_rms_m: f64,
    /// The largest distance.
    pub shift_max_m: f64,
}

/// The sums from which they come.
#[derive(Clone, Copy, Debug, Default)]
pub struct TiltFigureSums {
    ticks: u64,
    tilt_mrad2: MeanSquare,
    shift_m2: MeanSquare,
    tilt_max_mrad: f64,
    shift_max_m: f64,
}

impl TiltFigureSums {
    /// Adds a tick; nothing of a rotor that does not tilt.
    pub fn add(&mut self, tilt: Option<&RotorTilt>) {
        let Some(RotorTilt { pose, .. }) = tilt else { return };
        let tilt_mrad = 1e3 * pose.tilt_rad();
        let [x_m, y_m] = pose.shift_m;
        let shift_m = math::sqrt(x_m * x_m + y_m * y_m);
        self.ticks += 1;
        self.tilt_mrad2.add(tilt_mrad);
        self.shift_m2.add(shift_m);
        self.tilt_max_mrad = self.tilt_max_mrad.max(tilt_mrad);
        self.shift_max_m = self.shift_max_m.max(shift_m);
    }

    /// The figures; `None` of a rotor that does not tilt.
    pub fn figures(&self) -> Option<TiltFigures> {
        (self.ticks > 0).then(|| TiltFigures {
            tilt_rms_mrad: self.tilt_mrad2.root(),
            tilt_max_mrad: self.tilt_max_mrad,
            shift_rms_m: self.shift_m2.root(),
            shift_max_m: self.shift_max_m,
        })
    }
}

impl fmt::Display for TiltFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tilt_rms_mrad, tilt_max_mrad, shift_rms_m, shift_max_m } = self;
        let [shift_rms_um, shift_max_um] = [shift_rms_m, shift_max_m].map(|shift_m| 1e6 * shift_m);
        write!(
            f,
            "tilt {tilt_rms_mrad:.2} mrad rms, {tilt_max_mrad:.1} at most; shift \
             {shift_rms_um:.2} um rms, {shift_max_um:.2} at most"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::pose::Pose;

    /// Tilts of 5 and 0 mrad, shifts of 0 and 5 um.
    #[test]
    fn exact_figures_of_two_ticks() {
        let mut sums = TiltFigureSums::default();
        sums.add(None);
        assert!(sums.figures().is_none());
        let tilted = Pose { slope: [3e-3, -4e-3], ..Pose::LEVEL };
        let shifted = Pose { shift_m: [-4e-6, 3e-6], ..Pose::LEVEL };
        for pose in [tilted, shifted] {
            sums.add(Some(&RotorTilt { pose, height_m: 0.0 }));
        }
        let figures = sums.figures().unwrap();
        let root = math::sqrt(12.5);
        assert!((figures.tilt_rms_mrad - root).abs() < 1e-9 && (figures.tilt_max_mrad - 5.0).abs() < 1e-9);
        assert!(
            (1e6 * figures.shift_rms_m - root).abs() < 1e-9 && (1e6 * figures.shift_max_m - 5.0).abs() < 1e-9
        );
    }
}
